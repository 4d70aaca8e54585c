"""Thin walls of several edges as chain loops of Box2D.

A body with corners that slides from one single segment to the next meets the end of the second as a corner, and stops
there. The edges of a chain know their neighbours (ghost vertices), so that it does not. But a chain is solid on its
right-hand side only, and two chains in opposite directions on the same points do not make a wall: where the wall turns
away from a long body, the edge that the body has left takes it for one on its other side, as its centre is there, and
pulls it through. So the second chain is behind the wall, by `DEPTH_LENGTHS`: the side on which the bodies are is exact,
and what comes to the other side later meets it that much too early. With bodies on both sides, and with rounds finer
than this depth, a wall remains single segments.

Source: Box2D's manual, "Chain Shapes".
"""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.box2d_adapter.limits import SLOP_LENGTHS
from sandbox.engines.common.colliders import straightened
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Wall

DEPTH_LENGTHS = 10.0 * SLOP_LENGTHS
"""Box2D's lengths between the two sides of a chained wall. Within 4 times its slop, Box2D makes contacts in advance; a
body on the one side must not meet the other, also if it sinks in by the slop."""

CHUNK = 1_000_000
"""Pairs of a position and an edge that are compared at once."""


def has_joints(wall: Wall) -> bool:
    """Return whether edges of a wall join by their ends; those of a thick wall join by round ends."""
    return not wall.thickness and len(straightened(wall)) > 2


def chain_loops(scene: Scene, bodies: Bodies, positions: FloatArray, k: int, depth: float) -> list[FloatArray] | None:
    """Return the chain loops of the k-th static collider, a wall, as `loops_of`; None for one that is not chained.

    Discs do not stop at the ends of segments: a wall that only discs can meet needs no chain.

    Args:
        scene: the scene.
        bodies: its bodies.
        positions: (N, 2) their centres, m.
        k: index of the wall.
        depth: distance of the second side, m.
    """
    wall, able = scene.fixed[k], ~bodies.immovable
    if len(scene.layers) > 1 or scene.categories:
        able = able & filter_table(scene, bodies).meets_fixed(k)
    if not isinstance(wall, Wall) or bodies.round[able].all():
        return None
    return loops_of(wall, positions[able], depth)


def loops_of(wall: Wall, positions: FloatArray, depth: float) -> list[FloatArray] | None:
    """Return the chain loops (K, 2), m, of a wall, solid on their right-hand sides.

    Args:
        wall: the wall.
        positions: (N, 2) centres of the bodies that can meet it, m.
        depth: distance of the second side, m.

    Returns:
        One loop around an open wall, or two for a closed one; None for a wall that cannot be chained: a thick one,
        whose edges join by their round ends, one of a single edge, with bodies on both sides, or with rounds that are
        finer than the depth.
    """
    points = np.asarray(straightened(wall))
    if not has_joints(wall):
        return None
    is_loop = len(points) > 3 and bool((points[0] == points[-1]).all())
    sides = sides_of(points, is_loop, positions)
    if (sides > 0.0).any() and (sides < 0.0).any():
        return None
    front = points[::-1] if (sides > 0.0).any() else points
    back = _shifted(front, is_loop, depth)
    if not (((back[1:] - back[:-1]) * (front[1:] - front[:-1])).sum(axis=1) > 0.0).all():
        return None
    return [front[:-1], back[:0:-1]] if is_loop else [np.vstack((front, back[::-1]))]


def sides_of(points: FloatArray, is_loop: bool, positions: FloatArray) -> FloatArray:
    """Return on which side of a polyline (K, 2) positions (N, 2) are: 1.0 left of its direction, −1.0 right, 0.0 on it.

    Near a corner, the mean of both directions decides (Bærentzen and Aanæs 2005).
    """
    start, edge = points[:-1], points[1:] - points[:-1]
    unit = edge / np.hypot(*edge.T)[:, None]
    found, step = np.zeros(len(positions)), max(1, CHUNK // len(edge))
    for first in range(0, len(positions), step):
        there = positions[first : first + step]
        along = ((there[:, None] - start) * edge).sum(axis=2) / (edge * edge).sum(axis=1)
        offset = there[:, None] - start - np.clip(along, 0.0, 1.0)[:, :, None] * edge
        rows = np.arange(len(there))
        nearest = (offset * offset).sum(axis=2).argmin(axis=1)
        place = along[rows, nearest]
        neighbour = nearest + (place >= 1.0) - (place <= 0.0)
        if is_loop:
            neighbour %= len(edge)
        direction = unit[nearest] + unit[np.clip(neighbour, 0, len(edge) - 1)]
        x, y = offset[rows, nearest].T
        found[first : first + step] = np.sign(direction[:, 0] * y - direction[:, 1] * x)
    return found


def _shifted(points: FloatArray, is_loop: bool, depth: float) -> FloatArray:
    """Return a polyline (K, 2) shifted to its left-hand side, with mitred corners."""
    edge = points[1:] - points[:-1]
    normal = np.column_stack((-edge[:, 1], edge[:, 0])) / np.hypot(*edge.T)[:, None]
    before, after = np.vstack((normal[:1], normal)), np.vstack((normal, normal[-1:]))
    if is_loop:
        before[0], after[-1] = normal[-1], normal[0]
    both = before + after
    share: FloatArray = 1.0 + (before * after).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):  # a wall that turns back has no mitre, so no shifted edge
        shifted: FloatArray = points + depth * both / share[:, None]
    return shifted
