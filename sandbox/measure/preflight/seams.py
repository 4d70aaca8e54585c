"""Seams of a floor: places where two static objects continue each other, and bodies with corners can stop or tip.

An engine that meets two objects there treats the end of the second as a corner, of which it does not know that the
first covers it. The edges of one wall do know it. Measured with boxes that slide over tiles of 1 m
(`tests/measure/preflight/test_seams.py`).

Source: Box2D's manual, "Chain Shapes", on ghost collisions.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.box2d_adapter.chains import DEPTH_LENGTHS, chain_loops, has_joints
from sandbox.engines.box2d_adapter.engine import Box2DEngine
from sandbox.engines.box2d_adapter.limits import scale_for
from sandbox.engines.common.colliders import wall_segments
from sandbox.measure.metrics.clearance import posed_pieces
from sandbox.measure.preflight.diagnostic import Details, Diagnostic
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Wall

ALIGNED = 1e-6
"""Difference of directions, rad, and distance from a common line, as a fraction of the largest coordinate, up to which
edges continue each other."""

GAP = 1e-3
"""Gap between two edges, as a fraction of the shorter one, up to which their ends make a seam."""


class StaticEdges(NamedTuple):
    """E edges of static objects that bodies can slide on, solid on their left-hand side."""

    start: FloatArray
    """(E, 2) m"""
    end: FloatArray
    """(E, 2) m"""
    owner: IntArray
    """(E,) index of the solid that an edge belongs to: a convex piece of a body, or a wall"""


class Solids(NamedTuple):
    """Static solids: convex pieces of fixed bodies, then thin walls."""

    pieces: list[FloatArray]
    """(V, 2) m, corners of each piece, counter-clockwise"""
    circles: FloatArray
    """(P, 3) m, a circle around each piece: centre and radius"""
    names: list[str]
    movers: list[frozenset[int]]
    """bodies with corners that can meet each"""
    edges: StaticEdges


class Seam(NamedTuple):
    """Place where an edge of one static object continues that of another."""

    first: str
    second: str
    place: tuple[float, float]
    """m"""


def seam_notes(scene: Scene, engine: str | None) -> Iterator[Diagnostic]:
    """Yield a note if bodies with corners can stop at seams between static objects; on box2d, also within walls."""
    found = seams(scene)
    if found:
        first, second, (x, y) = found[0]
        others = f", and at {len(found) - 1:,} other seams" if len(found) > 1 else ""
        parts = f"two parts of {first!r}" if first == second else f"{first!r} and {second!r}"
        message = (
            f"a body with corners can stop or tip at the seam of {parts} at ({x:.6g}, {y:.6g}) m"
            f"{others}; make them one box, or a wall of several points"
        )
        details: Details = {"first": first, "second": second, "x": x, "y": y, "seams": len(found)}
        yield Diagnostic("seams", message, details)
    if engine == "box2d":
        for name in unchained_walls(scene):
            message = (
                f"box2d: a body with corners can stop where the edges of {name!r} join, as it has bodies on both sides "
                "or rounds that are too fine for one of Box2D's chains; give it a thickness, of about a tenth of a "
                "body's width"
            )
            yield Diagnostic("joined_edges", message, {"wall": name})


def unchained_walls(scene: Scene) -> list[str]:
    """Return the walls with joints that `box2d` represents by single segments, though bodies with corners meet them."""
    sharp, bodies = has_corners(scene), scene.bodies
    if not sharp.any():
        return []
    depth, filters = DEPTH_LENGTHS / scale_for(Box2DEngine().resolve(scene, scene.solver)), filter_table(scene, bodies)
    return [
        str(scene.fixed_names[k])
        for k, wall in enumerate(scene.fixed)
        if isinstance(wall, Wall) and has_joints(wall)
        if chain_loops(scene, bodies, bodies.position, k, depth) is None
        if (filters.meets_fixed(k) & sharp).any()
    ]


def seams(scene: Scene) -> list[Seam]:
    """Return the seams of a scene at its start that a body with corners can reach; those on top, by gravity, first."""
    solids = _solids(scene)
    edges, found = solids.edges, dict[tuple[float, float], tuple[float, int, Seam]]()
    down = np.asarray(scene.world.gravity)
    for line in _lines(edges):
        along = edges.end[line[0]] - edges.start[line[0]]
        along = along / np.hypot(*along)
        low, high = edges.start[line] @ along, edges.end[line] @ along
        order = np.argsort(low, kind="stable")
        for left, right in zip(order[:-1].tolist(), order[1:].tolist(), strict=True):
            one, other = int(edges.owner[line[left]]), int(edges.owner[line[right]])
            near = GAP * min(high[left] - low[left], high[right] - low[right])
            place = edges.start[line[right]]
            if one == other or low[right] > high[left] + near or not solids.movers[one] & solids.movers[other]:
                continue
            if not _is_covered(solids, place, along):
                x, y = place.tolist()
                one, other = sorted((one, other))
                seam = Seam(solids.names[one], solids.names[other], (x, y))
                rank = float(along[1] * down[0] - along[0] * down[1])  # negative for an outward normal against gravity
                found.setdefault((round(x, 9), round(y, 9)), (rank, one, seam))
    return [seam for _, _, seam in sorted(found.values())]


def _solids(scene: Scene) -> Solids:
    bodies = scene.bodies
    pieces: list[FloatArray] = []
    names: list[str] = []
    movers: list[frozenset[int]] = []
    rows: list[tuple[FloatArray, FloatArray, int]] = []
    sharp = np.flatnonzero(has_corners(scene))
    if len(sharp):
        filters = filter_table(scene, bodies)
        for number in np.flatnonzero(bodies.fixed & ~bodies.round).tolist():
            able = frozenset(sharp[filters.meets(sharp, np.full(len(sharp), number))].tolist())
            for corners, radius in posed_pieces(
                bodies, number, bodies.position[number][None], bodies.angle[number][None]
            ):
                if radius == 0.0 and len(corners[0]) > 2:
                    rows.append((corners[0], np.roll(corners[0], -1, axis=0), len(names)))
                    pieces.append(corners[0])
                    names.append(bodies.names[number])
                    movers.append(able)
        for k, collider in enumerate(scene.fixed):
            if isinstance(collider, Wall) and collider.solid and not collider.thickness:
                ends = np.asarray([(part.a, part.b) for part in wall_segments(collider)])
                rows += [(ends[:, 0], ends[:, 1], len(names)), (ends[:, 1], ends[:, 0], len(names))]
                names.append(str(scene.fixed_names[k]))
                movers.append(frozenset(sharp[filters.meets_fixed(k)[sharp]].tolist()))
    if not rows:
        return Solids(
            [], np.empty((0, 3)), [], [], StaticEdges(np.empty((0, 2)), np.empty((0, 2)), np.empty(0, np.int64))
        )
    start, end = (np.vstack([row[k] for row in rows]) for k in (0, 1))
    owner = np.concatenate([np.full(len(row[0]), row[2]) for row in rows])
    circles = [(*(centre := each.mean(axis=0)), np.hypot(*(each - centre).T).max()) for each in pieces]
    return Solids(pieces, np.asarray(circles).reshape(-1, 3), names, movers, StaticEdges(start, end, owner))


def has_corners(scene: Scene) -> BoolArray:
    """Return which moving bodies can collide and have a part that is not rounded, (N,)."""
    bodies, sharp = scene.bodies, np.zeros(len(scene.bodies), np.bool_)
    if bodies.round.all():
        return sharp
    sharp[bodies.shapes.body[bodies.shapes.radius == 0.0]] = True
    return np.asarray(contact_matrix(scene).touches & ~bodies.fixed & ~bodies.round & sharp)


def _lines(edges: StaticEdges) -> Iterator[IntArray]:
    """Yield the edges of each line and direction on which there are several."""
    along = edges.end - edges.start
    length = np.hypot(*along.T)
    if not len(length):
        return
    x, y = (along / length[:, None]).T
    offset = (x * edges.start[:, 1] - y * edges.start[:, 0]) / max(float(np.abs(edges.start).max()), 1e-300)
    keys = np.rint(np.column_stack((x, y, offset)) / ALIGNED + 0.25).astype(np.int64)
    _, line = np.unique(keys, axis=0, return_inverse=True)
    order = np.argsort(line.ravel(), kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(line.ravel()[order])) + 1):
        if len(group) > 1:
            yield group


def _is_covered(solids: Solids, place: FloatArray, along: FloatArray) -> bool:
    """Return whether a static piece covers a point of an edge, so that nothing can reach it."""
    above = place + 10.0 * ALIGNED * max(1.0, float(np.abs(place).max())) * np.asarray((along[1], -along[0]))
    near = np.hypot(*(solids.circles[:, :2] - above).T) <= solids.circles[:, 2]
    for k in np.flatnonzero(near).tolist():
        corners = solids.pieces[k]
        edge, to = np.roll(corners, -1, axis=0) - corners, above - corners
        if (edge[:, 0] * to[:, 1] - edge[:, 1] * to[:, 0] > 0.0).all():
            return True
    return False
