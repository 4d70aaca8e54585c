"""Starts: whether bodies begin where an engine can tell inside from outside, and not in crowds that none can part."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.faults import Location
from sandbox.scene.layouts import count_of
from sandbox.scene.model import Mover, Plane, Scene
from sandbox.scene.near import BoolArray, FloatArray, IntArray, near_pairs
from sandbox.scene.part import BACKING

Whose = tuple[Location, Mover]

MAX_OVERLAPS, MAX_OVERLAPS_EACH = 10_000, 10
"""Overlapping pairs that a scene may start with: this many, and so many more for every body."""
MAX_PASSING = 1_000_000
"""The same for balls that pass through each other, whose pairs an engine still looks at: a second a step or so."""
OVERLAP_BUDGET = 50_000_000
"""Candidate pairs looked at before the search for overlaps is given up; a few seconds."""
PLACES = {"grid": "origin", "scatter": "lower", "stack": "base", "rope": "start", "cloth": "corner"}
"""The keys that say where a generator is; of everything else it is `position`."""


def starts(scene: Scene, bodies: Bodies, elements: list[Whose], owners: list[Whose]) -> Iterator[tuple[Location, str]]:
    """Yield the faults of where bodies start.

    Args:
        scene: the scene.
        bodies: its own.
        elements: what has bodies, each with its location.
        owners: the same, one for each of `bodies.elements`.
    """
    touches = np.asarray([e.collides != "none" for e in bodies.elements], dtype=bool)[bodies.element]
    for plane, name in zip(scene.planes, scene.fixed_names, strict=False):
        if not has_direction(plane):
            continue
        depth = -height_above(plane, bodies.position)
        for element in each_of(bodies.element[touches & (depth > BACKING)]):
            deepest = float(depth[(bodies.element == element) & touches].max())
            message = (
                f"a centre starts {deepest:g} m behind the plane {name!r}; at most {BACKING:g}, "
                "or it would leave on the wrong side"
            )
            location = owners[element][0]
            key = PLACES.get(str(location[0]), "position")
            yield (*location, key), message

    movers = np.asarray([e.collides == "all" for e in bodies.elements], dtype=bool)[bodies.element] & ~bodies.fixed
    most = MAX_OVERLAPS + MAX_OVERLAPS_EACH * int(movers.sum())
    overlaps = count_overlaps(bodies.position[movers], bodies.core[movers], most)
    location = max(elements, key=lambda e: count_of(e[1]))[0] if elements else ()
    if overlaps > most:
        message = (
            f"the scene starts with {overlaps:,} or more overlapping pairs of bodies; at most {most:,} can be solved. "
            'Spread them, or let them pass through each other with collides = "none" or "fixed"'
        )
        yield location, message
        return
    if _crowd(bodies, movers):
        message = (
            f"the scene starts with more than {MAX_PASSING:,} pairs of pieces so near each other that an engine has to "
            "look at them at every step. Spread the bodies, or use fewer pieces"
        )
        yield location, message
    passing = touches & ~bodies.fixed
    most = max(most, MAX_PASSING)
    if passing.sum() > movers.sum() and count_overlaps(bodies.position[passing], bodies.core[passing], most) > most:
        message = (
            f"the scene starts with more than {most:,} overlapping pairs of bodies; that they pass through each other "
            "has to be found out again at every step. Spread them, use fewer, or let them meet nothing with "
            'collides = "none"'
        )
        yield location, message


def _crowd(bodies: Bodies, movers: BoolArray) -> bool:
    """Tell whether the pieces of bodies that are no balls crowd each other: their cores may be anywhere, or nowhere."""
    among = movers & ~bodies.round
    if not among.any():
        return False
    shapes = bodies.shapes
    chosen = among[shapes.body]
    body = shapes.body[chosen]
    cos, sin = np.cos(bodies.angle[body]), np.sin(bodies.angle[body])
    x, y = shapes.middle[chosen].T
    place = bodies.position[body] + np.column_stack((cos * x - sin * y, sin * x + cos * y))
    return count_overlaps(place, shapes.reach[chosen], MAX_PASSING, body) > MAX_PASSING


def each_of(elements: IntArray) -> list[int]:
    """Return the different ones among numbers of elements, ascending."""
    return sorted(set(elements.tolist()))


def has_direction(plane: Plane) -> bool:
    """Tell whether a plane's normal can be normalised."""
    return 1e-100 <= math.hypot(*plane.normal) <= 1e100


def height_above(plane: Plane, position: FloatArray) -> FloatArray:
    """Return the signed distances (N,) of points (N, 2) from a plane's surface, m."""
    normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
    return np.asarray((position - np.asarray(plane.point)) @ normal)


def count_overlaps(
    position: FloatArray, radius: FloatArray, enough: float = math.inf, owner: IntArray | None = None
) -> int:
    """Count overlapping pairs, stopping early once more than enough are found or the budget is spent.

    Where radii differ much, a great ball makes neighbours of all the small ones, and the budget may be spent before
    a crowd among them is come upon. So each octave of radii is counted by itself first: however the rest goes, of K
    octaves on one spot the pairs are K times those within the octaves at most.

    Args:
        position: (N, 2) m, of discs.
        radius: (N,) m.
        enough: beyond it counting stops.
        owner: (N,) whose they are; two of one owner are no pair.
    """
    owner = np.arange(len(radius)) if owner is None else owner
    position, radius, owner = position[radius > 0.0], radius[radius > 0.0], owner[radius > 0.0]
    octave = np.floor(np.log2(radius))
    present = np.unique(octave).tolist()
    alike = 0
    for each in present if len(present) > 1 else ():
        those = octave == each
        alike += _overlaps(position[those], radius[those], owner[those], enough - alike)
        if alike > enough:
            return alike
    return max(alike, _overlaps(position, radius, owner, enough))


def _overlaps(position: FloatArray, radius: FloatArray, owner: IntArray, enough: float) -> int:
    if len(radius) < 2:
        return 0
    overlaps = looked_at = 0
    for i, j in near_pairs(position, 2.0 * float(radius.max())):
        near = (np.hypot(*(position[i] - position[j]).T) < radius[i] + radius[j]) & (owner[i] != owner[j])
        overlaps += int(near.sum())
        looked_at += len(i)
        if overlaps > enough or looked_at > OVERLAP_BUDGET:
            break
    return overlaps
