"""Elements of a pinball table, and mirror images of them."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, model_validator

from sandbox.scene.description.base import (
    GROUND,
    Colour,
    Coordinate,
    Mass,
    Name,
    Part,
    Point,
    Radius,
    Restitution,
    Vector,
    Velocity,
    Wording,
)
from sandbox.scene.description.fixed import Layers
from sandbox.scene.description.world import MIN_THRESHOLD

ElementLength = Annotated[float, Field(gt=0, le=1e3)]
"""m"""
ElementSize = Annotated[float, Field(ge=0, le=1e3)]
"""m"""
Points = Annotated[int, Field(ge=0, le=10**12)]
"""of a score"""
FilletCorner = Annotated[tuple[Coordinate, ...], Field(min_length=2, max_length=3)]
"""x and y, m; and, of a corner that is round, the radius of the arc that rounds it, m"""
FilletCorners = Annotated[tuple[FilletCorner, ...], Field(min_length=2, max_length=1000)]


class Element(Part):
    """Anything that a table is built of."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    mirrored: bool = False
    """Also build a mirror image across the table's axis; the two names then begin with `left` and `right`."""
    colour: Colour | None = None
    """colour in the window, `#rrggbb`"""


class Scoring(Element):
    """An element that scores."""

    score: Points = 0
    """points each time it is hit or entered"""
    group: Name | None = None
    """group that it belongs to, such as a bank of targets or a set of lanes"""
    step: Annotated[int, Field(ge=0, le=1000)] = 0
    """position in the group"""
    light: Point | None = None
    """position of the lamp that shows whether it is lit, m"""


class Line(Element):
    """A line of straight pieces and arcs, such as `[[0.0, 0.1], [0.0, 1.0, 0.2], [0.5, 1.0]]`, one corner rounded."""

    points: FilletCorners
    """corners, m; a third number rounds a corner with an arc of that radius, m"""
    thickness: ElementSize
    """full thickness, m"""
    closed: bool = False
    """Connect the last point to the first."""
    layers: Layers = (GROUND,)
    """layers in which it is solid"""
    fill: Colour | None = None
    """colour of the area inside a closed line"""


MaterialName = Literal["wall", "rubber", "post", "target"]
Speed = Annotated[float, Field(ge=0, le=1e3)]
"""m/s"""
Threshold = Annotated[float, Field(ge=MIN_THRESHOLD, le=1e3)]
"""m/s"""


class PinballWall(Line):
    """Wood, plastic or wire."""

    thickness: ElementSize = 0.006
    """full thickness, m"""
    material: MaterialName = "wall"
    """name of the material"""


class Rubber(Line):
    """A rubber band around posts at its corners."""

    thickness: ElementSize = 0.008
    """thickness of the band, which is also the diameter of its posts, m"""


class PinballPost(Element):
    """A round post with a sleeve."""

    position: Point
    """position of the centre, m"""
    radius: Radius = 0.005
    """radius of the post, m"""
    material: MaterialName = "post"
    """name of the material"""
    layers: Layers = (GROUND,)
    """layers in which it is solid"""


class Gate(Scoring):
    """A one-way wire: solid from the left of its direction (first to second point), open from the right."""

    points: tuple[Point, Point]
    """ends of the wire, m"""
    thickness: ElementSize = 0.003
    """thickness of the wire, m"""


class Bumper(Scoring):
    """A pop bumper: it pushes a ball away when hit."""

    position: Point
    """position of the centre, m"""
    radius: Radius = 0.0243
    """radius, m: 45 units of Visual Pinball"""
    speed: Speed = 0.81
    """speed that it adds, m/s"""
    threshold: Threshold = 0.054
    """lowest speed of approach that it responds to, m/s"""
    score: Points = 100


class Slingshot(Scoring):
    """A triangle of rubber whose first side kicks, most strongly in the middle."""

    points: Annotated[
        tuple[Point, Point, Point], Wording("corners, the two ends of the kicking side and one behind it")
    ]
    """its three posts, m: the ends of the kicking side, and the one behind"""
    thickness: ElementSize = 0.008
    """thickness of the rubber, m"""
    speed: Speed = 2.16
    """speed that is added to the approach in the middle, m/s"""
    threshold: Threshold = 0.054
    """m/s"""
    score: Points = 10


class Standup(Scoring):
    """A target that stays up when hit."""

    position: Point
    """centre of its face, m"""
    facing: Vector
    """direction out of its face; any length"""
    width: ElementLength = 0.025
    """width of its face, m"""
    thickness: ElementSize = 0.005
    """thickness of the target, m"""
    score: Points = 500


class DropTargets(Scoring):
    """A bank of drop targets, which fall when hit; the rules of the game lower and raise them."""

    position: Point
    """centre of the front of the bank, m"""
    facing: Vector
    """direction out of the front; any length"""
    count: Annotated[int, Field(ge=1, le=20)] = 3
    """number of targets"""
    width: ElementLength = 0.025
    """width of each target, m"""
    gap: ElementSize = 0.003
    """gap between two targets, m"""
    thickness: ElementSize = 0.005
    """thickness of each target, m"""
    score: Points = 500


ElementAngle = Annotated[float, Field(ge=-10, le=10)]
"""rad"""


class PinballBall(Element):
    """A steel ball."""

    position: Point
    """position of the centre at the start of the game, m"""
    radius: Radius | None = None
    """m; default: `ball_radius` of the table"""
    mass: Mass | None = None
    """kg; default: `ball_mass` of the table"""


class Flipper(Element):
    """A bat that turns about a pivot between two stops.

    It is driven by a coil (default: that of Visual Pinball, 0.513 N·m after 30 ms, on a moment of inertia of m L²/3),
    or by a stroke at given rates, independent of the load: up at `rate`, down at `return_rate`.
    """

    pivot: Point
    """position of the pivot, m"""
    stops: tuple[ElementAngle, ElementAngle] = (-0.541, 0.349)
    """directions of the bat at rest and raised, rad; default −31° and 20°, for the left one of a pair"""
    length: ElementLength = 0.0702
    """length from the pivot to the centre of the tip, m: 130 units of Visual Pinball"""
    base: Radius = 0.0116
    """radius at the pivot, m"""
    tip: Radius = 0.007
    """radius at the tip, m"""
    mass: Mass = 0.08
    """kg"""
    side: Literal["left", "right"] | None = None
    """button that moves it; default: the side of the table that its pivot is on"""
    drive: Literal["torque", "stroke"] = "torque"
    """`torque`: turned by the torque of its coil; `stroke`: turned at given rates, independent of the load"""
    torque: Annotated[float, Field(gt=0, le=1e6)] = 0.513
    """N·m"""
    rate: Annotated[float, Field(gt=0, le=1e4)] = 40.0
    """rate of the upward stroke, rad/s"""
    return_rate: Annotated[float, Field(gt=0, le=1e4)] = 10.0
    """rate of the downward stroke, rad/s"""


class Plunger(Scoring):
    """A spring-loaded rod that shoots the ball up its lane."""

    position: Point
    """centre of the tip, where the ball rests, m"""
    direction: Vector = (0.0, 1.0)
    """direction of the shot; any length"""
    width: ElementLength = 0.02
    """width of the tip, m"""
    travel: ElementLength = 0.043
    """travel of a full pull, m: 80 units of Visual Pinball"""
    speed: Annotated[float, Field(gt=0, le=1e3)] = 1.03
    """speed of the ball after a full pull, m/s"""


MIN_ZONE_DEPTH = 0.012
"""m, smallest extent of a zone along the path of a ball: at 1 kHz, balls slower than 12 m/s are detected in it"""


class Rollover(Scoring):
    """A wire in a lane that the ball rolls over."""

    position: Point
    """position of the centre, m"""
    radius: Radius = 0.008
    """detection radius for the centre of a ball, m"""
    score: Points = 250


class Spinner(Scoring):
    """A plate on an axle that a passing ball spins; the rules count its turns."""

    points: tuple[Point, Point]
    """ends of the axle, m"""
    thickness: ElementLength = MIN_ZONE_DEPTH
    """thickness of the area in which a ball is detected, m"""
    score: Points = 100


class Kicker(Scoring):
    """A hole that holds a ball until the rules of the game release it."""

    position: Point
    """position of the centre, m"""
    radius: Radius = 0.0135
    """capture radius for the centre of the ball, m: 25 units of Visual Pinball"""
    out: Velocity
    """velocity of a released ball, m/s"""
    score: Points = 1000


class Drain(Scoring):
    """The drain: a ball is lost when its centre crosses this line."""

    points: tuple[Point, Point]
    """ends of the line, m"""
    thickness: ElementLength = 0.02
    """m"""


class Ramp(Scoring):
    """A ramp between two rails that leads up to a layer of its own; at its end the ball drops to the playfield.

    A ball that enters the mouth is moved to that layer; one too slow for the climb rolls back out of the mouth.
    """

    points: FilletCorners
    """centre line from the mouth to the end, m; corners may be rounded as those of walls"""
    width: ElementLength = 0.040
    """width between the rails, m"""
    thickness: ElementSize = 0.003
    """thickness of the rails, m"""
    layer: Name | None = None
    """name of its layer; default: the name of the ramp"""
    climb: ElementLength = 0.12
    """length of the climb from the mouth, m"""
    rise: ElementSize = 0.04
    """height above the playfield after the climb, m"""
    floor: Colour | None = None
    """colour of the ground between the rails"""
    score: Points = 2500


class Art(Element):
    """A painted area: a disc, or an outline whose corners may be rounded."""

    colour: Colour
    """`#rrggbb`"""
    position: Point | None = None
    """centre of a disc, m"""
    radius: Radius | None = None
    """radius of a disc, m"""
    points: FilletCorners | None = None
    """corners of an outline, m"""

    @model_validator(mode="after")
    def _one(self) -> "Art":
        disc = self.position is not None and self.radius is not None and self.points is None
        outline = self.points is not None and len(self.points) > 2 and self.position is None and self.radius is None
        if not (disc or outline):
            raise ValueError("has no shape; add `position` and `radius`, or at least three `points`")
        return self


Built = TypeVar("Built", bound=Element)

POSITION_FIELDS = ("position", "pivot", "light")
DIRECTION_FIELDS = ("facing", "direction", "out")


def mirrored_copies(element: Built, kind: str, number: int, axis: float) -> Iterator[tuple[str, Built]]:
    """Yield names and elements: the element itself, or, if it is mirrored, one on each side of the axis."""
    name = element.name or f"{kind}-{number + 1}"
    if not element.mirrored:
        yield name, element
        return
    for copy in (element, reflected(element, axis)):
        yield f"{'left' if centre_of_element(copy)[0] < axis else 'right'} {name}", copy


def reflected(element: Built, axis: float) -> Built:
    """Return the mirror image of an element across x = axis."""
    changes: dict[str, Any] = {}
    for key in type(element).model_fields:
        value = getattr(element, key)
        if value is None:
            continue
        if key in POSITION_FIELDS:
            changes[key] = (2.0 * axis - value[0], *value[1:])
        elif key == "points":
            # The open side of a gate depends on the order of its points, which a mirror image reverses.
            order = reversed(value) if isinstance(element, Gate) else value
            changes[key] = tuple((2.0 * axis - point[0], *point[1:]) for point in order)
        elif key in DIRECTION_FIELDS:
            changes[key] = (-value[0], value[1])
        elif key == "stops":
            changes[key] = tuple(math.pi - angle for angle in value)
        elif key == "side":
            changes[key] = "right" if value == "left" else "left"
    return element.model_copy(update=changes)


def centre_of_element(element: Element) -> Point:
    """Return the approximate centre of an element, m."""
    for key in ("position", "pivot"):
        position = getattr(element, key, None)
        if position is not None:
            return float(position[0]), float(position[1])
    points: tuple[tuple[float, ...], ...] = getattr(element, "points", None) or ((0.0, 0.0),)
    return sum(p[0] for p in points) / len(points), sum(p[1] for p in points) / len(points)


class Pinball(Part):
    """A pinball table seen from above, y up the slope, as a list of elements; it is expanded to primitives.

    Other tables of the scene file take precedence: a wall or ball of the same name, `world.gravity`, a material
    or a pair.
    """

    game: Literal["pinball"] = "pinball"
    """game whose rules apply"""
    slope: Annotated[float, Field(ge=0, le=1.5)] = 0.11345
    """inclination of the table, rad; default 6.5°; the ball rolls down with the acceleration 5/7 g sin(slope)"""
    axis: Coordinate = 0.0
    """x coordinate of the axis of mirrored elements, m"""
    tolerance: Annotated[float, Field(ge=1e-6, le=1e-2)] = 2e-5
    """largest deviation of the line segments from the arc that they replace, m"""
    ball_radius: Radius = 0.01349
    """radius of the ball, m: 25 units of Visual Pinball, a diameter of 1 1/16 in"""
    ball_mass: Mass = 0.08
    """kg"""
    ball_restitution: Restitution = 0.9
    """restitution of two balls"""
    colour: Colour | None = None
    """colour of the playfield"""
    outline: FilletCorners | None = None
    """outline of the painted playfield, m; corners may be rounded"""
    arts: tuple[Art, ...] = Field((), alias="art")
    walls: tuple[PinballWall, ...] = Field((), alias="wall")
    rubbers: tuple[Rubber, ...] = Field((), alias="rubber")
    posts: tuple[PinballPost, ...] = Field((), alias="post")
    gates: tuple[Gate, ...] = Field((), alias="gate")
    bumpers: tuple[Bumper, ...] = Field((), alias="bumper")
    slingshots: tuple[Slingshot, ...] = Field((), alias="slingshot")
    standups: tuple[Standup, ...] = Field((), alias="standup")
    drops: tuple[DropTargets, ...] = Field((), alias="drops")
    rollovers: tuple[Rollover, ...] = Field((), alias="rollover")
    spinners: tuple[Spinner, ...] = Field((), alias="spinner")
    kickers: tuple[Kicker, ...] = Field((), alias="kicker")
    ramps: tuple[Ramp, ...] = Field((), alias="ramp")
    drains: tuple[Drain, ...] = Field((), alias="drain")
    flippers: tuple[Flipper, ...] = Field((), alias="flipper")
    plungers: tuple[Plunger, ...] = Field((), alias="plunger")
    balls: tuple[PinballBall, ...] = Field((), alias="ball")
