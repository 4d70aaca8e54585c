"""Overlaps: what starts in something else, which engines of a fixed step push apart at once."""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import SLOP_PER_RADIUS
from sandbox.measure.compare.gaps import bounding_gaps, gap
from sandbox.measure.forecast.laid import MOST, Laid
from sandbox.measure.forecast.passages import meet_each_other
from sandbox.measure.forecast.warning import Warning
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, reach
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.scene import Scene
from sandbox.scene.validate.bodies import MAX_OVERLAPS, MAX_OVERLAPS_EACH, OVERLAP_BUDGET, count_overlaps

GRAZE = 1e-6
"""The share of a half width by which bodies that were laid out to touch may overlap: rounding."""

Overlap = tuple[float, str, str]
"""A depth, m, and the names of the two."""


def overlap_warnings(scene: Scene, meet: ContactMatrix, close: Laid) -> Iterator[Warning]:
    """Yield a warning of what overlaps at the start, with the deepest; not what joints keep from meeting.

    Of bodies in planes, walls and posts only those are counted that are deeper than the slop that engines leave.
    """
    pairs, deepest, what = 0, (0.0, "", ""), "balls"
    if meet.mutual:
        balls, pair = _balls(scene, meet)
        if balls > 0:
            pairs, deepest = balls, pair
        bodies = scene.bodies
        deep = close.gap < -GRAZE * np.minimum(bodies.thin[close.first], bodies.thin[close.second])
        deep &= ~bodies.fixed[close.first] & ~bodies.fixed[close.second]
        if deep.any():
            k = int(np.argmin(np.where(deep, close.gap, 0.0)))
            names = bodies.names[int(close.first[k])], bodies.names[int(close.second[k])]
            pairs, what = pairs + int(deep.sum()), "bodies"
            deepest = max(deepest, (-float(close.gap[k]), *names))
    held = list(_in_fixed(scene, meet))
    if held:
        what = f"{what} and fixed elements" if pairs else "bodies and fixed elements"
        pairs, deepest = pairs + len(held), max(deepest, max(held))
    if pairs > 0:
        depth, first, second = deepest
        count = "overlapping pair" if pairs == 1 else "overlapping pairs"
        message = (
            f"{pairs:,} {count} of {what} at the start, {first!r} and {second!r} by {depth:.3g} m; "
            "the engine will push them apart"
        )
        yield Warning("overlap", message, {"pairs": pairs, "depth": depth, "first": first, "second": second})


def _balls(scene: Scene, meet: ContactMatrix) -> tuple[int, Overlap]:
    """Return how many pairs of moving balls overlap, and the deepest of them."""
    bodies = scene.bodies
    among = np.flatnonzero(meet_each_other(bodies) & meet.touches & ~bodies.fixed & bodies.round)
    most = MAX_OVERLAPS + MAX_OVERLAPS_EACH * len(among)  # a scene with more is refused
    owner = np.where(bodies.group > 0, bodies.group, -1 - np.arange(len(bodies)))[among]
    position, radius = bodies.position[among], bodies.radius[among]
    count = count_overlaps(position, radius, most, owner)
    first, second = scene.links.apart().T
    joined = np.isin(first, among) & np.isin(second, among)
    joined &= (bodies.group[first] == 0) | (bodies.group[first] != bodies.group[second])
    away = (
        np.hypot(*(bodies.position[first] - bodies.position[second]).T) - bodies.radius[first] - bodies.radius[second]
    )
    count -= int((joined & (away < 0.0)).sum())
    if count <= 0:
        return 0, (0.0, "", "")
    keys = np.minimum(first, second) * len(bodies) + np.maximum(first, second)
    deepest, i, j = _deepest(position, radius, owner, among, keys, len(bodies))
    return count, (deepest, bodies.names[i], bodies.names[j])


def _deepest(
    position: FloatArray, radius: FloatArray, owner: IntArray, among: IntArray, apart: IntArray, count: int
) -> tuple[float, int, int]:
    """Return the depth, m, and the numbers of the two discs that overlap most.

    Args:
        position: (M, 2) m.
        radius: (M,) m.
        owner: (M,) two of one owner are no pair.
        among: (M,) their numbers among all bodies.
        apart: (K,) pairs that do not meet, as number of the first × count + number of the second.
        count: of all bodies.
    """
    deepest, looked_at = (0.0, int(among[0]), int(among[0])), 0
    for i, j in near_pairs(position, 2.0 * float(radius.max())):
        low, high = np.minimum(among[i], among[j]), np.maximum(among[i], among[j])
        depth = radius[i] + radius[j] - np.hypot(*(position[i] - position[j]).T)
        depth[(owner[i] == owner[j]) | np.isin(low * count + high, apart)] = -np.inf
        k = int(np.argmax(depth)) if len(depth) else -1
        if k >= 0 and depth[k] > deepest[0]:
            deepest = float(depth[k]), int(low[k]), int(high[k])
        looked_at += len(i)
        if looked_at > OVERLAP_BUDGET:
            break
    return deepest


def _in_fixed(scene: Scene, meet: ContactMatrix) -> Iterator[Overlap]:
    """Yield the bodies that start in a plane, wall or post, deeper than engines leave them.

    On a floor cushions are met at a height, and what starts in a one-way wall is let through: neither is looked at, nor
    are bodies that a drive moves, which stay where the drive holds them.
    """
    if scene.surface is not None:
        return
    bodies, layers = scene.bodies, reach(scene, scene.bodies)
    able = meet.touches & ~bodies.fixed & (bodies.thin > 0.0) & ~is_driven(scene, bodies)
    looked_at = measured = 0
    for k, (thing, name) in enumerate(zip(scene.fixed, scene.fixed_names, strict=False)):
        if (not isinstance(thing, Plane) and not thing.solid) or (isinstance(thing, Wall) and thing.one_way):
            continue
        near = np.flatnonzero(able & (layers & mask_of(thing.layers, scene.layers) != 0) & _near(bodies, thing))
        looked_at += len(near) * (len(thing.points) if isinstance(thing, Wall) else 1)
        if looked_at > OVERLAP_BUDGET:
            return
        depths = -bounding_gaps(thing, bodies.position[near], bodies.radius[near])
        for number, depth in zip(near[depths > 0.0].tolist(), depths[depths > 0.0].tolist(), strict=True):
            if not bodies.round[number]:
                measured += 1
                if measured > MOST:
                    return
                place = bodies.position[None], bodies.angle[None]
                depth = -float(gap(scene, bodies, *place, (number, -1 - k))[0])
            if depth > SLOP_PER_RADIUS * float(bodies.thin[number]):
                yield depth, bodies.names[number], name


def _near(bodies: Bodies, thing: Plane | Wall | Post) -> BoolArray:
    """Return which bodies' bounding discs overlap the box about a wall or post, (N,); near a plane are all."""
    if isinstance(thing, Plane):
        return np.ones(len(bodies), dtype=np.bool_)
    corners = np.asarray(thing.points if isinstance(thing, Wall) else [thing.position])
    half = thing.thickness / 2.0 if isinstance(thing, Wall) else thing.radius
    low, high = corners.min(axis=0) - half, corners.max(axis=0) + half
    away = np.maximum(low - bodies.position, 0.0) + np.maximum(bodies.position - high, 0.0)
    return np.asarray(np.hypot(*away.T) < bodies.radius)
