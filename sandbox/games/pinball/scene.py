"""Expansion of a pinball table, and its faults."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from sandbox.games.pinball import build
from sandbox.games.pinball.build import MATERIALS, Building, pairs, rolling_gravity
from sandbox.games.pinball.elements import (
    MIN_ZONE_DEPTH,
    Art,
    Drain,
    DropTargets,
    Element,
    FilletCorner,
    Flipper,
    Gate,
    Line,
    Pinball,
    Plunger,
    Ramp,
    Slingshot,
    Spinner,
    Standup,
    mirrored_copies,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.errors import LocatedMessage, Location, path_of
from sandbox.scene.files.presets import Preset, added, paired, stated
from sandbox.scene.geometry.polyline import RoundingError, length_of, rounded

MIN_DISTANCE = 1e-6
"""m, minimum distance of the points of an element"""
MAX_COORDINATE = 1e6
"""m: farther from the origin, zones of 0.1 mm along a ramp vanish by rounding."""
_TOO_FAR = f"is too far away; the coordinates of a pinball table are at most {MAX_COORDINATE:g} m"


def faults_of(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of the `[pinball]` of a scene, which prevent its expansion."""
    pinball = table_of(scene, Pinball)
    if pinball is None:
        return
    if scene.surface is not None:
        yield ("surface",), "applies to billiards; a pinball table uses `slope` instead, remove it"
    if abs(pinball.axis) > MAX_COORDINATE:
        yield ("pinball", "axis"), _TOO_FAR
    if pinball.outline is not None:
        yield from ((("pinball", "outline", k), _TOO_FAR) for k in _far_corners(pinball.outline))
        yield from _corner_faults(("pinball", "outline"), pinball.outline, True, pinball.tolerance)
    for kind, elements in elements_of(pinball):
        for k, element in enumerate(elements):
            distant = list(_distant_points(element))
            for location, message in distant or _element_faults(element, pinball):
                yield ("pinball", kind, k, *location), message
    yield from _name_faults(pinball)


def _distant_points(element: Element) -> Iterator[LocatedMessage]:
    """Yield the points of an element that are too far from the origin."""
    for key in ("position", "pivot"):
        point = getattr(element, key, None)
        if point is not None and list(_far_corners((point,))):
            yield (key,), _TOO_FAR
    yield from ((("points", k), _TOO_FAR) for k in _far_corners(getattr(element, "points", None) or ()))


def _far_corners(corners: Sequence[tuple[float, ...]]) -> Iterator[int]:
    """Yield the indices of the corners that are too far from the origin."""
    for k, (x, y, *_) in enumerate(corners):
        if max(abs(x), abs(y)) > MAX_COORDINATE:
            yield k


def elements_of(pinball: Pinball) -> Iterator[tuple[str, tuple[Element, ...]]]:
    """Yield kind, as in the headings of the scene file, and elements, in the order of their expansion."""
    for name, field in type(pinball).model_fields.items():
        if field.alias is not None:
            yield field.alias, getattr(pinball, name)


def _name_faults(pinball: Pinball) -> Iterator[LocatedMessage]:
    """Yield the elements whose names are not unique."""
    first: dict[str, Location] = {}
    for kind, elements in elements_of(pinball):
        for k, element in enumerate(elements if kind != "art" else ()):  # nothing refers to painted areas by name
            location: Location = ("pinball", kind, k)
            names = [name for name, _ in mirrored_copies(element, kind, k, pinball.axis)]
            if len(set(names)) < len(names):
                yield (
                    (*location, "mirrored"),
                    f"has no effect: the element is on the table's axis, x = {pinball.axis!r} m; remove it",
                )
                names = names[:1]
            for name in names:
                first_location = first.setdefault(name, location)
                if first_location is not location:
                    yield (
                        (*location, "name"),
                        f"{path_of(first_location, {})} is also named {name!r}; names must be unique",
                    )


def _element_faults(element: Element, pinball: Pinball) -> Iterator[LocatedMessage]:
    """Yield the faults of one element, with locations relative to it."""
    tolerance = pinball.tolerance
    match element:
        case Line():
            yield from _corner_faults(("points",), element.points, element.closed, tolerance)
            if element.fill is not None and not element.closed:
                yield ("fill",), "applies to closed lines only; set `closed = true`, or remove it"
        case Art() if element.points is not None:
            yield from _corner_faults(("points",), element.points, True, tolerance)
        case Ramp():
            yield from _ramp_faults(element, tolerance, 2.0 * pinball.ball_radius)
        case Gate() | Spinner() | Drain() if math.dist(*element.points) < MIN_DISTANCE:
            yield ("points", 1), "has the same position as the point before; the ends of a line must differ"
        case Spinner() if math.dist(*element.points) <= element.thickness:
            yield ("points",), f"must be farther apart than the thickness, {element.thickness!r} m"
        case Slingshot() if _height(element) <= element.thickness:
            yield (
                ("points",),
                f"are nearly on a line; a band of {element.thickness!r} m must fit around the three posts",
            )
        case Standup() | DropTargets():
            if not any(element.facing):
                yield (
                    ("facing",),
                    "has no direction; use a vector such as [1, 0] for a target on the left that faces right",
                )
            if element.width <= element.thickness:
                yield ("width",), f"must be greater than the thickness, {element.thickness!r} m"
        case Plunger() if not any(element.direction):
            yield ("direction",), "has no direction; use a vector such as [0, 1] for up the table"
        case Flipper():
            if element.length <= abs(element.base - element.tip):
                yield ("length",), "must be greater than the difference of `base` and `tip`"
            if element.stops[0] == element.stops[1]:
                yield ("stops",), "must be two different angles: at rest and raised, rad"


def _corner_faults(
    at: Location, corners: tuple[FilletCorner, ...], closed: bool, tolerance: float
) -> Iterator[LocatedMessage]:
    sharp = next((k for k, corner in enumerate(corners) if len(corner) > 2 and corner[2] < 0.0), None)
    if sharp is not None:
        yield (*at, sharp, 2), "must not be negative: it is the radius of the corner"
        return
    if closed and len(corners) < 3:
        yield at, "must be at least three points for a closed line"
        return
    try:
        rounded(corners, closed, tolerance)
    except RoundingError as error:
        yield (*at, error.corner), str(error)


def _ramp_faults(ramp: Ramp, tolerance: float, ball: float) -> Iterator[LocatedMessage]:
    corner_faults = list(_corner_faults(("points",), ramp.points, False, tolerance))
    yield from corner_faults
    if ramp.width <= max(ball, MIN_ZONE_DEPTH):
        yield ("width",), f"is too narrow for the ball; it must be more than {max(ball, MIN_ZONE_DEPTH):.4g} m"
    if corner_faults:
        return
    length = length_of(rounded(ramp.points, False, tolerance))
    if ramp.climb >= length:
        yield ("climb",), f"must be less than the length of the ramp, {length:.4g} m"
    elif ramp.climb < 4.0 * MIN_ZONE_DEPTH:
        yield ("climb",), f"is too short for a mouth; it must be at least {4.0 * MIN_ZONE_DEPTH:g} m"


def _height(slingshot: Slingshot) -> float:
    """Return the distance of the rear post from the kicking side, m."""
    (ax, ay), (bx, by), (cx, cy) = slingshot.points
    return abs((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)) / max(math.hypot(bx - ax, by - ay), MIN_DISTANCE)


SUBSTEPS = 10
"""substeps of engines with fixed steps: at 1 kHz, a ball at 8 m/s moves by less than its radius in one of them"""
DURATION = 60.0
"""s, default duration"""

BUILD: dict[str, Callable[[Building, str, Any], None]] = {
    "art": build.art,
    "wall": build.wall,
    "rubber": build.wall,
    "post": build.post,
    "gate": build.gate,
    "bumper": build.bumper,
    "slingshot": build.slingshot,
    "standup": build.standup,
    "drops": build.drops,
    "rollover": build.rollover,
    "spinner": build.spinner,
    "kicker": build.kicker,
    "ramp": build.ramp,
    "drain": build.drain,
    "flipper": build.flipper,
    "plunger": build.plunger,
    "ball": build.ball,
}
"""Function that expands an element, by its kind."""


def expanded(scene: Scene) -> Scene:
    """Return a scene with its valid `[pinball]` expanded to primitives; a scene without one unchanged.

    Elements of the scene precede the expanded ones in each list, and replace those of the same name.
    """
    pinball = table_of(scene, Pinball)
    if pinball is None:
        return scene
    gravity = scene.world.gravity if "gravity" in scene.world.model_fields_set else rolling_gravity(pinball.slope)
    building = _built(pinball, gravity)
    changes: dict[str, Any] = {
        "pinball": None,
        "world": stated(scene.world, {"gravity": gravity, "duration": DURATION}),
        "solver": stated(scene.solver, {"substeps": SUBSTEPS}),
        "materials": added(scene.materials, MATERIALS),
        "pairs": paired(scene.pairs, pairs(pinball.ball_restitution)),
        "play": stated(scene.play, {"game": pinball.game, "ground": "playfield"}).model_copy(
            update={
                "parts": added(scene.play.parts, building.parts),
                "markings": (*building.markings, *scene.play.markings),
            }
        ),
    }
    for key in ("walls", "posts", "zones", "balls", "polygons", "drives"):
        changes[key] = added(getattr(scene, key), getattr(building, key))
    return scene.model_copy(update=changes)


def origins(scene: Scene) -> dict[str, Location]:
    """Return the location of the element of a valid `[pinball]` by each name in its expansion."""
    pinball = table_of(scene, Pinball)
    return {} if pinball is None else _built(pinball, rolling_gravity(pinball.slope)).origins


def _built(pinball: Pinball, gravity: tuple[float, float]) -> Building:
    building = Building(pinball.axis, pinball.tolerance, pinball.ball_radius, pinball.ball_mass, gravity)
    if pinball.outline is not None:
        building.paint(pinball.colour, building.line(pinball.outline, closed=True))
    for kind, elements in elements_of(pinball):
        for k, element in enumerate(elements):
            building.location = ("pinball", kind, k)
            for name, copy in mirrored_copies(element, kind, k, pinball.axis):
                BUILD[kind](building, name, copy)
    return building


PINBALL = Preset(
    Pinball,
    "expanded to primitives when the scene is read; None afterwards",
    is_kept=False,
    faults_of=faults_of,
    expanded=expanded,
    origins=origins,
    excludes=("billiards",),
)


def presents(scene: Scene) -> bool:
    """Return whether a scene is drawn as a pinball table."""
    return scene.play.ground == "playfield"
