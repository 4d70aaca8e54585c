"""Gaps: how far apart the two of a pair are, frame by frame."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.distance import hull_distance
from sandbox.measure.lying import gap_above, pieces_over_time
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.geometry.shapes import pieces_of
from sandbox.scene.scene import Scene

Pair = tuple[int, int]
"""Numbers as in `Contacts`: the second may be −1 − k for the k-th fixed thing."""


def gap(scene: Scene, bodies: Bodies, position: FloatArray, angle: FloatArray, pair: tuple[int, int]) -> FloatArray:
    """Return the distance between two surfaces, (T,) m, negative where they overlap.

    Args:
        scene: gives the fixed things.
        bodies: its bodies.
        position: (T, N, 2) m.
        angle: (T, N) rad.
        pair: numbers as in `Contacts`: the second may be −1 − k for the k-th fixed thing.
    """
    first, second = pair
    centre = position[:, first]
    if -1 - second >= len(scene.fixed) + len(scene.pockets):
        return _from_zone(centre, scene.zones[-1 - second - len(scene.fixed) - len(scene.pockets)])
    if -1 - second >= len(scene.fixed):  # a pocket is in contact with whose centre it holds
        pocket = scene.pockets[-1 - second - len(scene.fixed)]
        return _distance(centre - np.asarray(pocket.position)) - pocket.radius
    thing = scene.fixed[-1 - second] if second < 0 else None
    if isinstance(thing, Plane):
        normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
        return gap_above(bodies, first, centre, angle[:, first], np.asarray(thing.point), normal)
    if bodies.round[first] and (second < 0 or bodies.round[second]):
        other, its_radius = (centre, 0.0) if second < 0 else (position[:, second], float(bodies.radius[second]))
        return _of_disc(centre, float(bodies.radius[first]), thing, other, its_radius)
    if thing is None:
        others = list(pieces_over_time(bodies, second, position[:, second], angle[:, second]))
    else:
        others = list(_pieces_of(thing, len(position)))
    gaps = np.full(len(position), np.inf)
    for corners, radius in pieces_over_time(bodies, first, centre, angle[:, first]):
        for its_corners, its_radius in others:
            _lower(gaps, corners, its_corners, radius + its_radius)
    return gaps


def close_pairs(start: Scene | Setup, reach: float = 0.0) -> list[tuple[Pair, float]]:
    """Return all that can meet, of which one can move, and whose gap at the start is at most `reach`, with that, m.

    A negative gap is an overlap. Pairs are numbered as in `Contacts`.
    """
    setup = Setup.of(start)
    scene, bodies, meet = setup.scene, setup.bodies, contact_matrix(setup)
    still = bodies.fixed | is_driven(scene, bodies)
    meeting = meet.touches | bodies.fixed
    found = []
    for i, j in _near(bodies, meeting, reach):
        if not (still[i] and still[j]) and (bodies.group[i] != bodies.group[j] or bodies.group[i] == 0):
            found.append(((i, j), _gap(setup, (i, j))))
    apart = set(map(tuple, setup.links.apart().tolist()))  # joined, and kept from meeting
    found = [(pair, clear) for pair, clear in found if clear <= reach and pair not in apart]
    movable = np.flatnonzero(~still & meeting)
    for k, thing in enumerate(scene.fixed):
        clear = bounding_gaps(thing, bodies.position, bodies.radius)
        near = ((number, -1 - k) for number in movable[clear[movable] <= reach].tolist())
        exact = ((p, float(clear[p[0]]) if bodies.round[p[0]] else _gap(setup, p)) for p in near)
        found += [(pair, own) for pair, own in exact if own <= reach]
    return found


def _gap(setup: Setup, pair: Pair) -> float:
    bodies = setup.bodies
    return float(gap(setup.scene, bodies, bodies.position[None], bodies.angle[None], pair)[0])


def _near(bodies: Bodies, meeting: BoolArray, reach: float) -> Iterator[Pair]:
    """Yield the pairs whose bounding discs are no farther apart than `reach`."""
    chosen = np.flatnonzero(meeting)
    if len(chosen) < 2:
        return
    position, radius = bodies.position, bodies.radius
    for a, b in near_pairs(position[chosen], (2.0 * float(radius[chosen].max()) + reach) * (1.0 + 1e-9)):  # rounding
        i, j = chosen[np.minimum(a, b)], chosen[np.maximum(a, b)]
        close = np.hypot(*(position[j] - position[i]).T) - radius[i] - radius[j] <= reach
        yield from zip(i[close].tolist(), j[close].tolist(), strict=True)


def bounding_gaps(thing: Plane | Wall | Post, position: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how far bounding discs, (N, 2) m and (N,) m, are from a fixed thing, (N,) m; of balls that is the gap."""
    if isinstance(thing, Plane):
        normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
        return np.asarray((position - np.asarray(thing.point)) @ normal - radius)
    return _of_disc(position, radius, thing, position, 0.0)


def _from_zone(centre: FloatArray, zone: Zone) -> FloatArray:
    """Return the distance of a centre from a zone, (T,) m: it is noted when it is inside."""
    nearest = np.full(len(centre), np.inf)
    for corners, radius in pieces_of(zone):
        own = np.broadcast_to(np.asarray(corners), (len(centre), len(corners), 2))
        _lower(nearest, centre[:, None], own, radius)
    return nearest


def _of_disc(
    centre: FloatArray, radius: FloatArray | float, thing: Wall | Post | None, other: FloatArray, its_radius: float
) -> FloatArray:
    """Return the gap of a disc from another, or from a fixed thing."""
    if thing is None:
        return _distance(centre - other) - radius - its_radius
    if isinstance(thing, Post):
        return _distance(centre - np.asarray(thing.position)) - radius - thing.radius
    nearest = np.full(len(centre), np.inf)
    for tail, tip in pairwise(_line(thing)):
        nearest = np.fmin(nearest, _from_segment(centre, np.asarray(tail), np.asarray(tip)))
    return nearest - radius - 0.5 * thing.thickness


def _line(wall: Wall) -> list[tuple[float, float]]:
    return [*wall.points, wall.points[0]] if wall.closed else list(wall.points)


def _pieces_of(thing: Wall | Post, frames: int) -> Iterator[tuple[FloatArray, float]]:
    """Yield the corners, (T, 1 or 2, 2) m, and the radius of what a fixed thing consists of."""
    if isinstance(thing, Post):
        yield np.broadcast_to(np.asarray(thing.position), (frames, 1, 2)), thing.radius
        return
    for ends in pairwise(_line(thing)):
        yield np.broadcast_to(np.asarray(ends), (frames, 2, 2)), 0.5 * thing.thickness


def _lower(gaps: FloatArray, first: FloatArray, second: FloatArray, radii: float) -> None:
    """Lower gaps (T,) to the distance of two pieces, where discs around them tell that it may be less."""
    with np.errstate(over="ignore", invalid="ignore"):
        a, b = first.mean(axis=1), second.mean(axis=1)
        reach = np.hypot(*np.moveaxis(first - a[:, None], 2, 0)).max(axis=1)
        reach = reach + np.hypot(*np.moveaxis(second - b[:, None], 2, 0)).max(axis=1)
        near = np.flatnonzero(~(_distance(a - b) - reach - radii >= gaps))
    gaps[near] = np.fmin(gaps[near], hull_distance(first[near], second[near]) - radii)


def _distance(vector: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.hypot(vector[:, 0], vector[:, 1]))


def _from_segment(centre: FloatArray, tail: FloatArray, tip: FloatArray) -> FloatArray:
    along = tip - tail
    squared = float(along @ along)
    share = ((centre - tail) @ along / squared).clip(0.0, 1.0) if squared > 0.0 else np.zeros(len(centre))
    return _distance(centre - tail - share[:, None] * along)
