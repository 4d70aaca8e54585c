"""Picking: which body lies under the hand, and which overlap something."""

from itertools import pairwise

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.play.hulls import Hull, hulls_of, meeting, nearest
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import bits_of
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame


def picked(bodies: Bodies, frame: Frame, place: tuple[float, float], reach: float = 0.0) -> int | None:
    """Return the body at a place, m; of several the one whose centre is nearest for its size, else one within reach.

    Args:
        bodies: N of them.
        frame: where they are.
        place: m.
        reach: how far beside a body one may point, m.
    """
    count = min(len(bodies), len(frame.position))
    with np.errstate(all="ignore"):
        distance = np.hypot(*(frame.position[:count] - np.asarray(place)).T)
        radius = bodies.radius[:count]
        able = frame.present[:count] & (distance <= radius + reach)
        beside = distance - radius
        for number in np.flatnonzero(able & ~bodies.round[:count]).tolist():
            beside[number] = nearest(hulls_of(bodies, frame, number), *place)
        able &= beside <= reach
        if not able.any():
            return None
        score = np.where(able, np.where(beside <= 0.0, distance / radius, 1.0 + beside), np.inf)
    return int(np.argmin(score))


def overlapping(scene: Scene, bodies: Bodies, frame: Frame) -> BoolArray:
    """Tell which bodies overlap a plane, wall, post or one another, (N,); what just touches does not."""
    position, there = frame.position, frame.present
    count = min(len(position), len(bodies))
    radius, lone = bodies.radius[: len(position)], bodies.round[:count]
    found, layers = np.zeros(len(position), np.bool_), scene.layers
    lies = bits_of(frame.layer, len(position))
    sound = there & np.isfinite(position).all(axis=1) & np.isfinite(frame.angle)
    solids = {number: hulls_of(bodies, frame, number) for number in np.flatnonzero(sound & ~lone).tolist()}
    with np.errstate(all="ignore"):
        for plane in scene.planes:
            normal, on = np.asarray(plane.normal) / np.hypot(*plane.normal), lies & mask_of(plane.layers, layers) != 0
            found |= on & lone & ((position - np.asarray(plane.point)) @ normal < radius)
            for number, hulls in solids.items():
                deep = any(((h.corners - plane.point) @ normal < h.radius).any() for h in hulls)
                found[number] |= on[number] and deep
        for wall in (wall for wall in scene.walls if wall.solid):
            on = lies & mask_of(wall.layers, layers) != 0
            points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
            for a, b in pairwise(points):
                near = on & (_to_segment(position, a, b) < radius + wall.thickness / 2.0)
                found |= near & lone
                _meet_fixed(found, near, solids, Hull(np.asarray((a, b)), wall.thickness / 2.0))
        for post in (post for post in scene.posts if post.solid):
            near = np.hypot(*(position - np.asarray(post.position)).T) < radius + post.radius
            near &= lies & mask_of(post.layers, layers) != 0
            found |= near & lone
            _meet_fixed(found, near, solids, Hull(np.asarray((post.position,)), post.radius))
    able = np.flatnonzero(sound)
    reach = 2.0 * float(radius[able].max()) if len(able) else 0.0
    for i, j in near_pairs(position[able], reach):
        a, b = able[i], able[j]
        over = (np.hypot(*(position[a] - position[b]).T) < radius[a] + radius[b]) & (lies[a] == lies[b])
        for k in np.flatnonzero(over & ~(lone[a] & lone[b])).tolist():
            one, other = (solids.get(n) or hulls_of(bodies, frame, n) for n in (int(a[k]), int(b[k])))
            over[k] = any(meeting(p, q)[0] < 0.0 for p in one for q in other)
        found[a[over]] = found[b[over]] = True
    return found & there


def is_free(scene: Scene, bodies: Bodies, frame: Frame, hulls: list[Hull], layer: str) -> bool:
    """Tell whether nothing solid of a layer overlaps some hulls, m; what just touches does not."""
    bit, layers = 1 << scene.layers.index(layer), scene.layers
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
        if mask_of(plane.layers, layers) & bit:
            depth = min(float(((hull.corners - plane.point) @ normal).min()) - hull.radius for hull in hulls)
            if depth < 0.0:
                return False
    fixed = [
        Hull(np.asarray(ends), wall.thickness / 2.0)
        for wall in scene.walls
        if wall.solid and mask_of(wall.layers, layers) & bit
        for ends in pairwise((*wall.points, wall.points[0]) if wall.closed else wall.points)
    ]
    fixed += [
        Hull(np.asarray((post.position,)), post.radius)
        for post in scene.posts
        if post.solid and mask_of(post.layers, layers) & bit
    ]
    low = np.min([hull.corners.min(axis=0) - hull.radius for hull in hulls], axis=0)
    high = np.max([hull.corners.max(axis=0) + hull.radius for hull in hulls], axis=0)
    middle, reach = (low + high) / 2.0, float(np.hypot(*(high - low))) / 2.0
    count = min(len(bodies), len(frame.position))
    solid = np.asarray([each.collides != "none" for each in bodies.elements], np.bool_)[bodies.element[:count]]
    with np.errstate(all="ignore"):
        near = np.hypot(*(frame.position[:count] - middle).T) < reach + bodies.radius[:count]
    near &= frame.present[:count] & solid & (bits_of(frame.layer, count) & bit != 0)
    others = [hull for number in np.flatnonzero(near).tolist() for hull in hulls_of(bodies, frame, number)]
    return all(meeting(hull, other)[0] >= 0.0 for hull in hulls for other in (*fixed, *others))


def _meet_fixed(found: BoolArray, near: BoolArray, solids: dict[int, list[Hull]], fixed: Hull) -> None:
    """Note which bodies near a fixed thing overlap it."""
    for number, hulls in solids.items():
        if near[number] and not found[number]:
            found[number] = any(meeting(hull, fixed)[0] < 0.0 for hull in hulls)


def _to_segment(position: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    along = b - a
    share = np.clip((position - a) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.hypot(*(position - a - share[:, None] * along).T))
