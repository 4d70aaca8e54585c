"""Faulting: why a table's elements cannot be built, each with where it stands and what would be right."""

import math
from collections.abc import Iterator

from sandbox.scene.faults import Location, path_of
from sandbox.scene.model import Scene
from sandbox.scene.pinball.described import Pinball
from sandbox.scene.pinball.element import Corner, Element, Line
from sandbox.scene.pinball.mirroring import both
from sandbox.scene.pinball.moving import Flipper, Plunger
from sandbox.scene.pinball.painted import Art
from sandbox.scene.pinball.rounding import RoundingError, length_of, rounded
from sandbox.scene.pinball.sensed import LEAST_DEPTH, Drain, Ramp, Spinner
from sandbox.scene.pinball.solids import DropTargets, Gate, Slingshot, Standup

Found = tuple[Location, str]

CLOSEST = 1e-6
"""m: the least distance of an element's points"""


def faults_of(scene: Scene) -> Iterator[Found]:
    """Yield why a scene's `[pinball]` stands for nothing."""
    pinball = scene.pinball
    if pinball is None:
        return
    if scene.surface is not None:
        yield ("surface",), "is of billiards; a pinball table needs none, its ball rolls by `slope`"
    if pinball.outline is not None:
        yield from _corners(("pinball", "outline"), pinball.outline, True, pinball.tolerance)
    for kind, those in elements_of(pinball):
        for k, element in enumerate(those):
            for location, message in _wrong(element, pinball):
                yield ("pinball", kind, k, *location), message
    yield from _called_alike(pinball)


def elements_of(pinball: Pinball) -> Iterator[tuple[str, tuple[Element, ...]]]:
    """Yield the elements of a table by the headings of their tables, in the order in which they are built."""
    for name, field in type(pinball).model_fields.items():
        if field.alias is not None:
            yield field.alias, getattr(pinball, name)


def _called_alike(pinball: Pinball) -> Iterator[Found]:
    """Yield the elements that are called as another one is."""
    first: dict[str, Location] = {}
    for kind, those in elements_of(pinball):
        for k, element in enumerate(those if kind != "art" else ()):  # of paint nobody speaks by name
            here: Location = ("pinball", kind, k)
            names = [name for name, _ in both(element, kind, k, pinball.axis)]
            if len(set(names)) < len(names):
                yield (*here, "mirrored"), f"puts it onto itself: it stands on the table's axis, x = {pinball.axis!r} m"
                names = names[:1]
            for name in names:
                there = first.setdefault(name, here)
                if there is not here:
                    yield (*here, "name"), f"{name!r} is what {path_of(there, {})} is called; names are unique"


def _wrong(element: Element, pinball: Pinball) -> Iterator[Found]:
    """Yield what is wrong with one element, located within it."""
    tolerance = pinball.tolerance
    match element:
        case Line():
            yield from _corners(("points",), element.points, element.closed, tolerance)
            if element.fill is not None and not element.closed:
                yield ("fill",), "is of what a closed line encloses; set `closed`, or leave it out"
        case Art() if element.points is not None:
            yield from _corners(("points",), element.points, True, tolerance)
        case Ramp():
            yield from _ramp(element, tolerance, 2.0 * pinball.ball_radius)
        case Gate() | Spinner() | Drain() if math.dist(*element.points) < CLOSEST:
            yield ("points", 1), "lies on the point before it; they are the ends of a line"
        case Spinner() if math.dist(*element.points) <= element.thickness:
            yield ("points",), f"are nearer than its thickness, {element.thickness!r} m"
        case Slingshot() if _height(element) <= element.thickness:
            yield ("points",), f"enclose nothing; three posts that a band of {element.thickness!r} m fits around"
        case Standup() | DropTargets():
            if not any(element.facing):
                yield ("facing",), "has no direction; such as [1, 0] for a target on the left that faces right"
            if element.width <= element.thickness:
                yield ("width",), f"is no more than the thickness, {element.thickness!r} m"
        case Plunger() if not any(element.direction):
            yield ("direction",), "has no direction; such as [0, 1] for up the table"
        case Flipper():
            if element.length <= abs(element.base - element.tip):
                yield ("length",), "leaves one end inside the other; more than `base` and `tip` differ by"
            if element.stops[0] == element.stops[1]:
                yield ("stops",), "are one and the same; they are the directions at rest and raised, rad"


def _corners(at: Location, corners: tuple[Corner, ...], closed: bool, tolerance: float) -> Iterator[Found]:
    sharp = next((k for k, corner in enumerate(corners) if len(corner) > 2 and corner[2] < 0.0), None)
    if sharp is not None:
        yield (*at, sharp, 2), "a corner cannot be rounded by less than nothing"
        return
    if closed and len(corners) < 3:
        yield at, "two points enclose nothing; a closed line has three or more"
        return
    try:
        rounded(corners, closed, tolerance)
    except RoundingError as error:
        yield (*at, error.corner), str(error)


def _ramp(ramp: Ramp, tolerance: float, ball: float) -> Iterator[Found]:
    wrong = list(_corners(("points",), ramp.points, False, tolerance))
    yield from wrong
    if ramp.width <= max(ball, LEAST_DEPTH):
        yield ("width",), f"is too narrow for the ball; more than {max(ball, LEAST_DEPTH):.4g} m"
    if wrong:
        return
    length = length_of(rounded(ramp.points, False, tolerance))
    if ramp.climb >= length:
        yield ("climb",), f"is longer than the ramp, {length:.4g} m"
    elif ramp.climb < 4.0 * LEAST_DEPTH:
        yield ("climb",), f"is too short for a mouth; at least {4.0 * LEAST_DEPTH:g} m"


def _height(slingshot: Slingshot) -> float:
    """Return how far the post behind lies from the side that kicks, m."""
    (ax, ay), (bx, by), (cx, cy) = slingshot.points
    return abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / max(math.hypot(bx - ax, by - ay), CLOSEST)
