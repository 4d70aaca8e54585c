"""Clearance: signed distance of pairs of shapes in each frame."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.geometry.hulls import hull_distance
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.geometry.shapes import pieces_of
from sandbox.scene.geometry.vectors import offset_from_segment

CHUNK = 1_000_000
"""Frames × segments that are processed at once."""


def rotate_points(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors rotated counter-clockwise, (…, 2).

    Args:
        vectors: (…, 2).
        angle: (…) rad; broadcast with the vectors.
    """
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack((cos * x - sin * y, sin * x + cos * y), axis=-1)


def posed_pieces(
    bodies: Bodies, number: int, position: FloatArray, angle: FloatArray
) -> Iterator[tuple[FloatArray, float]]:
    """Yield the corners (T, V, 2) m, counter-clockwise, and the radius, m, of each convex piece of a body.

    Args:
        bodies: the bodies.
        number: index of the body.
        position: centre of mass, (T, 2) m.
        angle: (T,) rad.
    """
    shapes = bodies.shapes
    begin, end = np.searchsorted(shapes.body, (number, number + 1)).tolist()
    for piece in range(begin, end):
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]]
        yield position[:, None] + rotate_points(corners, angle[:, None]), float(shapes.radius[piece])


def plane_clearance(
    bodies: Bodies, number: int, position: FloatArray, angle: FloatArray, point: FloatArray, normal: FloatArray
) -> FloatArray:
    """Return the clearance of a body from a plane, (T,) m; negative if part of it is behind the plane.

    Args:
        bodies: the bodies.
        number: index of the body.
        position: centre of mass, (T, 2) m.
        angle: (T,) rad.
        point: point of the plane, (2,) m.
        normal: unit normal of the plane, (2,).
    """
    if bodies.round[number]:
        return np.asarray((position - point) @ normal - float(bodies.radius[number]))
    gaps = [
        ((corners - point) @ normal).min(axis=1) - radius
        for corners, radius in posed_pieces(bodies, number, position, angle)
    ]
    return np.asarray(np.minimum.reduce(gaps))


IndexPair = tuple[int, int]
"""Indices as in `Contacts`: the second can be −1 − k for the k-th static object."""


def clearance(
    scene: Scene, bodies: Bodies, position: FloatArray, angle: FloatArray, pair: tuple[int, int]
) -> FloatArray:
    """Return the distance of the surfaces of a pair, (T,) m; negative if they overlap.

    Args:
        scene: scene with the static objects.
        bodies: the bodies.
        position: (T, N, 2) m.
        angle: (T, N) rad.
        pair: indices as in `Contacts`: the second can be −1 − k for the k-th static object.
    """
    first, second = pair
    centre = position[:, first]
    if -1 - second >= len(scene.fixed) + len(scene.pockets):
        return _zone_clearance(centre, scene.zones[-1 - second - len(scene.fixed) - len(scene.pockets)])
    if -1 - second >= len(scene.fixed):  # a body is in a pocket if its centre is
        pocket = scene.pockets[-1 - second - len(scene.fixed)]
        return _length(centre - np.asarray(pocket.position)) - pocket.radius
    thing = scene.fixed[-1 - second] if second < 0 else None
    if isinstance(thing, Plane):
        normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
        return plane_clearance(bodies, first, centre, angle[:, first], np.asarray(thing.point), normal)
    if bodies.round[first] and (second < 0 or bodies.round[second]):
        other, its_radius = (centre, 0.0) if second < 0 else (position[:, second], float(bodies.radius[second]))
        return _disc_clearance(centre, float(bodies.radius[first]), thing, other, its_radius)
    if thing is None:
        others = list(posed_pieces(bodies, second, position[:, second], angle[:, second]))
    else:
        others = list(_pieces_of(thing, centre, float(bodies.radius[first])))
    gaps = np.full(len(position), np.inf)
    for corners, radius in posed_pieces(bodies, first, centre, angle[:, first]):
        for its_corners, its_radius in others:
            _lower_to_distance(gaps, corners, its_corners, radius + its_radius)
    return gaps


def close_pairs(start: Scene | Setup, reach: float = 0.0) -> list[tuple[IndexPair, float]]:
    """Return the pairs that can collide and whose clearance at the start is at most `reach`, with the clearance, m.

    At least one of a pair can move. A negative clearance is an overlap. Pairs have the indices of `Contacts`.
    """
    setup = Setup.of(start)
    scene, bodies, matrix = setup.scene, setup.bodies, contact_matrix(setup)
    immovable = bodies.fixed | is_driven(scene, bodies)
    collides = matrix.touches | bodies.fixed
    with_all = np.asarray([element.collides == "all" for element in bodies.elements], np.bool_)[bodies.element]
    first, second = _near_pairs(bodies, collides, reach)
    filters = filter_table(scene, bodies)
    wanted = ~(immovable[first] & immovable[second]) & filters.meets(first, second)
    wanted &= (with_all[first] & with_all[second]) | bodies.fixed[first] | bodies.fixed[second]
    first, second = first[wanted], second[wanted]
    discs = bodies.round[first] & bodies.round[second]
    clear = _length(bodies.position[first] - bodies.position[second]) - bodies.radius[first] - bodies.radius[second]
    found = [
        ((i, j), float(clear[k]) if discs[k] else _initial_clearance(setup, (i, j)))
        for k, (i, j) in enumerate(zip(first.tolist(), second.tolist(), strict=True))
    ]
    apart = set(map(tuple, setup.joints.apart().tolist()))  # joined bodies that do not collide
    found = [(pair, clear) for pair, clear in found if clear <= reach and pair not in apart]
    movable = np.flatnonzero(~immovable & collides)
    for k, thing in enumerate(scene.fixed):
        clear = bounding_clearances(thing, bodies.position, bodies.radius)
        able = movable[filters.meets_fixed(k)[movable] & (clear[movable] <= reach)]
        candidates = ((number, -1 - k) for number in able.tolist())
        exact = ((p, float(clear[p[0]]) if bodies.round[p[0]] else _initial_clearance(setup, p)) for p in candidates)
        found += [(pair, own) for pair, own in exact if own <= reach]
    return found


def _initial_clearance(setup: Setup, pair: IndexPair) -> float:
    bodies = setup.bodies
    return float(clearance(setup.scene, bodies, bodies.position[None], bodies.angle[None], pair)[0])


def _near_pairs(bodies: Bodies, collides: BoolArray, reach: float) -> tuple[IntArray, IntArray]:
    """Return the pairs of bodies whose bounding discs are no farther apart than `reach`, (K,) indices each."""
    chosen = np.flatnonzero(collides)
    if len(chosen) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    position, radius = bodies.position, bodies.radius
    found = []
    for a, b in near_pairs(position[chosen], (2.0 * float(radius[chosen].max()) + reach) * (1.0 + 1e-9)):  # rounding
        i, j = chosen[np.minimum(a, b)], chosen[np.maximum(a, b)]
        close = np.hypot(*(position[j] - position[i]).T) - radius[i] - radius[j] <= reach
        found.append(np.stack((i[close], j[close])))
    pairs = np.concatenate(found, axis=1) if found else np.empty((2, 0), np.int64)
    return pairs[0], pairs[1]


def bounding_clearances(thing: Plane | Wall | Post, position: FloatArray, radius: FloatArray) -> FloatArray:
    """Return the clearance of bounding discs, (N, 2) m and (N,) m, from a static object, (N,) m; exact for balls."""
    if isinstance(thing, Plane):
        normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
        return np.asarray((position - np.asarray(thing.point)) @ normal - radius)
    return _disc_clearance(position, radius, thing, position, 0.0)


def _zone_clearance(centre: FloatArray, zone: Zone) -> FloatArray:
    """Return the distance of a centre from a zone, (T,) m: a body enters a zone with its centre."""
    nearest = np.full(len(centre), np.inf)
    for corners, radius in pieces_of(zone):
        repeated = np.broadcast_to(np.asarray(corners), (len(centre), len(corners), 2))
        _lower_to_distance(nearest, centre[:, None], repeated, radius)
    return nearest


def _disc_clearance(
    centre: FloatArray, radius: FloatArray | float, thing: Wall | Post | None, other: FloatArray, its_radius: float
) -> FloatArray:
    """Return the clearance of a disc from another, or from a static object, (T,) m."""
    if thing is None:
        return _length(centre - other) - radius - its_radius
    if isinstance(thing, Post):
        return _length(centre - np.asarray(thing.position)) - radius - thing.radius
    rows = max(1, CHUNK // len(thing.points))
    parts = [_from_segments(thing, centre[k : k + rows]).min(axis=0) for k in range(0, len(centre), rows)]
    return np.concatenate((np.empty(0), *parts)) - radius - 0.5 * thing.thickness


def _line(wall: Wall) -> list[tuple[float, float]]:
    return [*wall.points, wall.points[0]] if wall.closed else list(wall.points)


def _pieces_of(thing: Wall | Post, centre: FloatArray, radius: float) -> Iterator[tuple[FloatArray, float]]:
    """Yield the corners, (T, 1 or 2, 2) m, and the radius of each piece of a static object near a body.

    Of a wall, these are the segments that can be nearest to the body in some frame, with its centre, (T, 2) m, and its
    bounding radius, m: the distance of a segment from the centre differs from that from the body by at most the radius.
    """
    frames = len(centre)
    if isinstance(thing, Post):
        yield np.broadcast_to(np.asarray(thing.position), (frames, 1, 2)), thing.radius
        return
    away, ends = _from_segments(thing, centre), list(pairwise(_line(thing)))
    can_be_nearest = ~(away - 2.0 * radius > away.min(axis=0)).all(axis=1)  # nan: a body that is diverging
    for number in np.flatnonzero(can_be_nearest).tolist():
        yield np.broadcast_to(np.asarray(ends[number]), (frames, 2, 2)), 0.5 * thing.thickness


def _lower_to_distance(gaps: FloatArray, first: FloatArray, second: FloatArray, radii: float) -> None:
    """Lower clearances (T,) to the distance of two pieces, where their bounding discs do not exclude that."""
    with np.errstate(over="ignore", invalid="ignore"):
        a, b = first.mean(axis=1), second.mean(axis=1)
        reach = np.hypot(*np.moveaxis(first - a[:, None], 2, 0)).max(axis=1)
        reach = reach + np.hypot(*np.moveaxis(second - b[:, None], 2, 0)).max(axis=1)
        rows = np.flatnonzero(~(_length(a - b) - reach - radii >= gaps))
    gaps[rows] = np.fmin(gaps[rows], hull_distance(first[rows], second[rows]) - radii)


def _length(vector: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.hypot(vector[:, 0], vector[:, 1]))


def _from_segments(wall: Wall, centre: FloatArray) -> FloatArray:
    """Return the distance of each of S segments of a wall from centres (T, 2), (S, T) m."""
    line = np.asarray(_line(wall))
    with np.errstate(over="ignore", invalid="ignore"):
        away = offset_from_segment(centre, line[:-1, None], np.diff(line, axis=0)[:, None])
        return np.asarray(np.hypot(away[..., 0], away[..., 1]))
