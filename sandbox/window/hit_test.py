"""Hit tests: the body at a point, and overlaps of bodies with static geometry and with each other.

A body is a set of rounded convex hulls: the convex hull of its corners, expanded by a radius.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.filters import bits_of_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.geometry.hulls import hull_distance
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.geometry.vectors import offset_from_segment
from sandbox.trajectory import Frame

Distance = Callable[[FloatArray, FloatArray], FloatArray]
"""Signed distance at points x, y, which broadcast; negative inside."""


class Hull(NamedTuple):
    """Convex hull of corners, expanded by a radius; in m or px, clockwise or counter-clockwise."""

    corners: FloatArray
    """(n, 2); one corner is a disc, two are a capsule"""
    radius: float


def hulls_of(bodies: Bodies, frame: Frame, index: int) -> list[Hull]:
    """Return the hulls of a body at its pose in a frame, m."""
    shapes = bodies.shapes
    first, last = np.searchsorted(shapes.body, (index, index + 1)).tolist()
    angle = float(frame.angle[index])
    cos, sin = math.cos(angle), math.sin(angle)
    rotation, position = np.asarray(((cos, sin), (-sin, cos))), frame.position[index]
    found = []
    for piece in range(first, last):
        corners = shapes.corner[int(shapes.first[piece]) : int(shapes.first[piece + 1])]
        found.append(Hull(position + corners @ rotation, float(shapes.radius[piece])))
    return found


def distance_from_hull(hull: Hull) -> Distance:
    """Return the signed distance function of a hull, exact inside and outside."""
    corners, radius = hull
    if len(corners) == 1:
        x, y = corners[0].tolist()
        return lambda px, py: np.asarray(np.hypot(px - x, py - y) - radius)
    sides = list(zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True))
    if len(corners) == 2:
        away = segment_distance(sides[0])
        return lambda px, py: away(px, py) - radius
    orientation = 1.0 if _area(corners) >= 0.0 else -1.0
    lines = []
    for (ax, ay), (bx, by) in sides:
        length = max(math.hypot(bx - ax, by - ay), 1e-300) * orientation
        x, y = (by - ay) / length, (ax - bx) / length
        lines.append((x, y, -(ax * x + ay * y)))
    edges = [segment_distance(side) for side in sides]

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        signed = np.asarray(np.maximum.reduce([px * x + (py * y + offset) for x, y, offset in lines]))
        outside = signed > 0.0
        if outside.any():  # near a corner, the distance to the edge lines is too small
            x, y = (np.broadcast_to(each, signed.shape)[outside] for each in (px, py))
            signed[outside] = np.minimum.reduce([edge(x, y) for edge in edges])
        return np.asarray(signed - radius)

    return distance


def segment_distance(ends: Sequence[Sequence[float]]) -> Distance:
    """Return the distance function of a segment, never negative."""
    (ax, ay), (bx, by) = ends
    dx, dy = bx - ax, by - ay
    squared = max(dx * dx + dy * dy, 1e-300)

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        x, y = px - ax, py - ay
        t = np.clip(x * (dx / squared) + y * (dy / squared), 0.0, 1.0)
        return np.asarray(np.sqrt((x - t * dx) ** 2 + (y - t * dy) ** 2))

    return distance


def rounded_hull(hull: Hull, steps: int = 6) -> FloatArray:
    """Return a polygon that approximates a rounded hull, (K, 2), with `steps` + 1 points per corner."""
    corners, radius = hull
    if radius == 0.0:
        return corners
    if len(corners) == 1:
        angles = np.linspace(0.0, 2.0 * math.pi, 4 * steps, endpoint=False)
        return np.asarray(corners + radius * np.column_stack((np.cos(angles), np.sin(angles))))
    edge = np.roll(corners, -1, axis=0) - corners
    sign = 1.0 if _area(corners) >= 0.0 else -1.0
    out = np.arctan2(-edge[:, 0] * sign, edge[:, 1] * sign)  # direction of the outward normal of each side
    before = np.roll(out, 1)
    turn = np.mod((out - before) * sign, 2.0 * math.pi) * sign
    angles = before[:, None] + turn[:, None] * np.linspace(0.0, 1.0, steps + 1)
    return np.asarray((corners[:, None] + radius * np.stack((np.cos(angles), np.sin(angles)), axis=-1)).reshape(-1, 2))


def hull_area(hull: Hull) -> float:
    """Return the area of a hull."""
    corners, radius = hull
    perimeter = float(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).sum())  # of a segment, twice its length
    return abs(_area(corners)) / 2.0 + perimeter * radius + math.pi * radius**2


def _area(corners: FloatArray) -> float:
    x, y = (corners - corners[0]).T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def signed_distance(hulls: list[Hull], x: float, y: float) -> float:
    """Return the signed distance of a point from the nearest hull; inf without hulls."""
    point = np.asarray(x), np.asarray(y)
    return min((float(distance_from_hull(hull)(*point)) for hull in hulls), default=math.inf)


def hull_gap(a: Hull, b: Hull, tolerance: float = 0.0) -> tuple[float, FloatArray]:
    """Return the gap between two hulls, negative if they overlap, and the point of contact or closest approach, (2,).

    Args:
        a: a hull.
        b: another.
        tolerance: the mean is returned of all points whose gap exceeds the smallest one by at most this.
    """
    gaps, midpoints = [], []
    for one, other in ((a, b), (b, a)):
        offset = _offsets(one.corners, other.corners)
        length = np.hypot(offset[:, 0], offset[:, 1])[:, None]
        # Midpoint of the gap, or of the overlap, between the two surfaces.
        shift = 0.5 * (length + other.radius - one.radius)
        midpoints.append(one.corners - offset + offset / np.maximum(length, 1e-300) * shift)
        gaps.append(length[:, 0])
    gap, points = np.concatenate(gaps), np.concatenate(midpoints)
    is_closest = gap <= float(gap.min()) + tolerance
    first, second = (each[::-1] if _area(each) < 0.0 else each for each in (a.corners, b.corners))
    distance = float(hull_distance(first[None], second[None])[0])
    return distance - a.radius - b.radius, np.asarray(points[is_closest].mean(axis=0))


def _offsets(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return the shortest offset of each point, (K, 2), from the edges of a hull."""
    offset = offset_from_segment(points[:, None], corners, np.roll(corners, -1, axis=0) - corners)
    return np.asarray(offset[np.arange(len(points)), np.argmin((offset**2).sum(-1), axis=1)])


def pick_body(bodies: Bodies, frame: Frame, point: tuple[float, float], reach: float = 0.0) -> int | None:
    """Return the index of the body at a point, else of the nearest one within reach; None if there is none.

    If several bodies contain the point, the one with the smallest ratio of centre distance to radius is chosen.

    Args:
        bodies: N of them.
        frame: their state.
        point: m.
        reach: distance from the outline up to which a body is selected, m.
    """
    count = min(len(bodies), len(frame.position))
    with np.errstate(all="ignore"):
        distance = np.hypot(*(frame.position[:count] - np.asarray(point)).T)
        radius = bodies.radius[:count]
        is_candidate = frame.present[:count] & (distance <= radius + reach)
        gap = distance - radius
        for number in np.flatnonzero(is_candidate & ~bodies.round[:count]).tolist():
            gap[number] = signed_distance(hulls_of(bodies, frame, number), *point)
        is_candidate &= gap <= reach
        if not is_candidate.any():
            return None
        score = np.where(is_candidate, np.where(gap <= 0.0, distance / radius, 1.0 + gap), np.inf)
    return int(np.argmin(score))


def overlapping_bodies(scene: Scene, bodies: Bodies, frame: Frame) -> BoolArray:
    """Return which bodies overlap a plane, wall, post or another body, (N,); touching does not count."""
    position, present = frame.position, frame.present
    count = min(len(position), len(bodies))
    radius, is_disc = bodies.radius[: len(position)], bodies.round[:count]
    found, layers = np.zeros(len(position), np.bool_), scene.layers
    layer_bits = bits_of_layers(frame.layer, len(position))
    is_valid = present & np.isfinite(position).all(axis=1) & np.isfinite(frame.angle)
    solids = {number: hulls_of(bodies, frame, number) for number in np.flatnonzero(is_valid & ~is_disc).tolist()}
    with np.errstate(all="ignore"):
        for plane in scene.planes:
            normal, on_layer = (
                np.asarray(plane.normal) / np.hypot(*plane.normal),
                layer_bits & mask_of(plane.layers, layers) != 0,
            )
            found |= on_layer & is_disc & ((position - np.asarray(plane.point)) @ normal < radius)
            for number, hulls in solids.items():
                overlaps = any(((h.corners - plane.point) @ normal < h.radius).any() for h in hulls)
                found[number] |= on_layer[number] and overlaps
        for wall in (wall for wall in scene.walls if wall.solid):
            on_layer = layer_bits & mask_of(wall.layers, layers) != 0
            points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
            for a, b in pairwise(points):
                is_near = on_layer & (segment_distance((a, b))(*position.T) < radius + wall.thickness / 2.0)
                found |= is_near & is_disc
                _mark_overlaps(found, is_near, solids, Hull(np.asarray((a, b)), wall.thickness / 2.0))
        for post in (post for post in scene.posts if post.solid):
            is_near = np.hypot(*(position - np.asarray(post.position)).T) < radius + post.radius
            is_near &= layer_bits & mask_of(post.layers, layers) != 0
            found |= is_near & is_disc
            _mark_overlaps(found, is_near, solids, Hull(np.asarray((post.position,)), post.radius))
    valid = np.flatnonzero(is_valid)
    reach = 2.0 * float(radius[valid].max()) if len(valid) else 0.0
    for i, j in near_pairs(position[valid], reach):
        a, b = valid[i], valid[j]
        overlap = (np.hypot(*(position[a] - position[b]).T) < radius[a] + radius[b]) & (layer_bits[a] == layer_bits[b])
        for k in np.flatnonzero(overlap & ~(is_disc[a] & is_disc[b])).tolist():
            hulls_a, hulls_b = (solids.get(n) or hulls_of(bodies, frame, n) for n in (int(a[k]), int(b[k])))
            overlap[k] = any(hull_gap(p, q)[0] < 0.0 for p in hulls_a for q in hulls_b)
        found[a[overlap]] = found[b[overlap]] = True
    return found & present


def is_free(scene: Scene, bodies: Bodies, frame: Frame, hulls: list[Hull], layer: str) -> bool:
    """Return whether hulls, m, overlap nothing solid on a layer; touching does not count."""
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
        is_near = np.hypot(*(frame.position[:count] - middle).T) < reach + bodies.radius[:count]
    is_near &= frame.present[:count] & solid & (bits_of_layers(frame.layer, count) & bit != 0)
    others = [hull for number in np.flatnonzero(is_near).tolist() for hull in hulls_of(bodies, frame, number)]
    return all(hull_gap(hull, other)[0] >= 0.0 for hull in hulls for other in (*fixed, *others))


def _mark_overlaps(found: BoolArray, is_near: BoolArray, solids: dict[int, list[Hull]], fixed: Hull) -> None:
    """Mark the bodies near a static shape that overlap it."""
    for number, hulls in solids.items():
        if is_near[number] and not found[number]:
            found[number] = any(hull_gap(hull, fixed)[0] < 0.0 for hull in hulls)
