"""Sight: the part of the world that a replay shows at first, and the part that it keeps."""

from collections.abc import Iterable, Iterator

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.report.page.packing import Crate
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.scene import Scene

MANY = 1000
"""From so many places on the outermost are left out, `OUTLIERS` per cent at each side."""
OUTLIERS = 0.5
LARGEST = 1e15
"""m: what lies beyond does not count."""
NEAR = 0.6
"""Fixed things count so near to where bodies are, as a share of its size."""
ROOM = 0.06
"""What is left free around all, as a share of its size."""
KEPT = 3.0
"""The side of what is kept, in sizes of what is shown."""
ANCHORED = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.GROOVE, LinkKind.SPRING)

Box = tuple[float, float, float, float]
"""left, bottom, right, top, m"""


def box_of(scene: Scene, paths: Iterable[FloatArray]) -> Box:
    """Return what is to be seen: where bodies go, and the fixed things near by.

    Args:
        scene: of what.
        paths: places (T, N, 2), m, of all its bodies; nan counts for nothing.
    """
    bodies = scene.bodies
    found = [each for path in paths if (each := _around(path, bodies)) is not None]
    start = _around(bodies.position[None], bodies, everything=True)
    if start is not None and not found:
        found = [start]
    near = list(_things(scene))
    if not found:
        found = near or [np.asarray(((-1.0, -1.0), (1.0, 1.0)))]
    low, high = np.min([each[0] for each in found], axis=0), np.max([each[1] for each in found], axis=0)
    reach = NEAR * max(float((high - low).max()), 1e-12)
    for corners in near:
        if (corners[0] <= high + reach).all() and (corners[1] >= low - reach).all():
            inside = np.clip(corners, low - reach, high + reach)
            low, high = np.minimum(low, inside[0]), np.maximum(high, inside[1])
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
        middle = 0.5 * (low + high)
        foot = middle - ((middle - np.asarray(plane.point)) @ normal) * normal
        if (foot >= low - reach).all() and (foot <= high + reach).all():
            low, high = np.minimum(low, foot), np.maximum(high, foot)
    size = float((high - low).max())
    if not size > 0.0:
        size = 2.0
        low, high = low - 1.0, high + 1.0
    low, high = low - ROOM * size, high + ROOM * size
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def crate_of(box: Box) -> Crate:
    """Return the square that a replay keeps of the world: what it shows, and as much around it."""
    left, bottom, right, top = box
    side = KEPT * max(right - left, top - bottom)
    return Crate(0.5 * (left + right) - 0.5 * side, 0.5 * (bottom + top) - 0.5 * side, side)


def _around(path: FloatArray, bodies: Bodies, everything: bool = False) -> FloatArray | None:
    """Return the lower left and upper right corner (2, 2), m, of where the bodies that move are."""
    which = np.ones(len(bodies), np.bool_) if everything else ~bodies.fixed
    size = int(which.sum())
    # Of a long path some frames are enough to tell.
    places = path[:: max(1, len(path) * size // 500_000), which]
    with np.errstate(invalid="ignore"):
        counts = (np.abs(places) < LARGEST).all(axis=2)
    some, around = places[counts], np.broadcast_to(bodies.radius[which], counts.shape)[counts][:, None]
    if not len(some):
        return None
    if size > MANY:
        usual = float(np.median(around))
        low, high = np.percentile(some, (OUTLIERS, 100.0 - OUTLIERS), axis=0)
        return np.asarray((low - usual, high + usual))
    return np.asarray(((some - around).min(axis=0), (some + around).max(axis=0)))


def _things(scene: Scene) -> Iterator[FloatArray]:
    """Yield the corners (2, 2), m, of walls, posts, fixed bodies, what attracts, and where the world holds joints."""
    for thing in scene.fixed:
        if isinstance(thing, Wall):
            points = np.asarray(thing.points)
            yield np.asarray((points.min(axis=0), points.max(axis=0))) + 0.5 * thing.thickness * SIDES
        elif isinstance(thing, Post):
            yield np.asarray(thing.position) + thing.radius * SIDES
        else:
            assert isinstance(thing, Plane)  # has no end, and is seen to apart
    bodies, links = scene.bodies, scene.links
    for number in np.flatnonzero(bodies.fixed).tolist():
        yield bodies.position[number] + bodies.radius[number] * SIDES
    for each in scene.attractions:
        if not isinstance(each.toward, str):
            yield np.asarray((each.toward, each.toward))
    held = links.anchor_a[(links.a < 0) & np.isin(links.kind, ANCHORED)]
    for place in held:
        yield np.asarray((place, place))


SIDES = np.asarray(((-1.0, -1.0), (1.0, 1.0)))
