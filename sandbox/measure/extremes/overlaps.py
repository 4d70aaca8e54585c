"""Overlaps: how deep bodies are in each other and in fixed things, frame by frame."""

import math

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.collisions import can_meet
from sandbox.measure.compare.gaps import gap
from sandbox.measure.lying import gap_above
from sandbox.scene.compile.contacts import contact_matrix, reach
from sandbox.scene.description.fixed import Plane
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MOST_DISCS, MOST_SHAPES = 100_000, 10_000
"""Frames × bodies looked at, of discs alone and of other shapes: of more, frames are left out."""
MOST_APART = 50
"""Bodies up to which pairs of other shapes, and fixed things other than planes, are looked at one by one."""


def looked_at(run: Trajectory, scene: Scene) -> list[int]:
    """Return the frames that are looked at, by their numbers: evenly spread, first and last among them."""
    frames, bodies = run.position.shape[:2]
    most = MOST_DISCS if scene.bodies.round.all() else MOST_SHAPES
    count = min(frames, max(2, most // max(bodies, 1)))
    return [int(k) for k in np.unique(np.linspace(0, frames - 1, count).round())]


def deepest(run: Trajectory, scene: Scene) -> FloatArray:
    """Return the deepest overlap of each frame, (T,) m, 0 where nothing overlaps.

    Of bodies with other shapes than discs those pairs are looked at that start next to each other: in a stack no
    others meet before it has fallen.

    Args:
        run: whose T frames are all finite.
        scene: its scene.
    """
    bodies = scene.bodies
    found = np.zeros(len(run.time))
    able = np.flatnonzero(contact_matrix(scene).touches & ~bodies.fixed)
    for plane in scene.planes:
        point, normal = np.asarray(plane.point), np.asarray(plane.normal) / math.hypot(*plane.normal)
        discs = able[bodies.round[able]]
        if len(discs):
            above = (run.position[:, discs] - point) @ normal - bodies.radius[discs]
            found = np.maximum(found, -above.min(axis=1))
        for number in able[~bodies.round[able]].tolist():
            above = gap_above(bodies, number, run.position[:, number], run.angle[:, number], point, normal)
            found = np.maximum(found, -above)
    others = [-1 - k for k, thing in enumerate(scene.fixed) if not isinstance(thing, Plane) and thing.solid]
    pairs = [(number, thing) for number in able[:MOST_APART].tolist() for thing in others]
    mutual = (
        contact_matrix(scene).mutual and len(scene.layers) == 1
    )  # which of two pass over each other is not looked into
    if mutual and not bodies.round[able].all():
        pairs += _beside(scene)
    # Who can change its layer may lie over what it does not meet: only what can do nothing else is looked at.
    if len(scene.layers) > 1:
        sure = reach(scene, bodies)
        pairs = [pair for pair in pairs if sure[pair[0]].bit_count() == 1 and can_meet(scene, pair)]
    for pair in pairs:
        found = np.maximum(found, -gap(scene, bodies, run.position, run.angle, pair))
    if mutual and bodies.round.all():
        among = np.flatnonzero(contact_matrix(scene).touches)
        farthest = 2.0 * float(bodies.radius[among].max())
        for k, position in enumerate(run.position[:, among]):
            for i, j in near_pairs(position, farthest):
                apart = np.hypot(*(position[i] - position[j]).T) - bodies.radius[among[i]] - bodies.radius[among[j]]
                found[k] = max(found[k], -float(apart.min(initial=np.inf)))
    return found


def _beside(scene: Scene) -> list[tuple[int, int]]:
    """Return the pairs of bodies whose bounding discs overlap at the start, and that joints do not keep apart."""
    bodies = scene.bodies
    apart = {(a, b) for a, b in scene.links.apart().tolist()}
    found = []
    for i, j in near_pairs(bodies.position, 2.0 * float(bodies.radius.max())):
        near = np.hypot(*(bodies.position[i] - bodies.position[j]).T) < bodies.radius[i] + bodies.radius[j]
        for a, b in zip(i[near].tolist(), j[near].tolist(), strict=True):
            pair = (min(a, b), max(a, b))
            if pair not in apart and not (bodies.fixed[a] and bodies.fixed[b]):
                found.append(pair)
    return sorted(found)[: 4 * MOST_APART]
