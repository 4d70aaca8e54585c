"""Static elements: planes, walls, posts and zones; sensors; collision layers and categories.

A visit of a zone begins when the centre of a body is inside the zone while the body is in one of the zone's layers. It
ends when the centre is outside. A change of layer does not end it; each visit is recorded once. Bodies with
`collides = "none"` and bodies held by a drive are not detected.
"""

from collections.abc import Sequence
from typing import Annotated, TypeAlias

from pydantic import Field

from sandbox.scene.description.base import (
    GROUND,
    Acceleration,
    Accepts,
    Collider,
    Colour,
    Coordinates,
    Name,
    OptionalPoint,
    Part,
    Point,
    PointField,
    Radius,
    Vector,
    VelocityField,
    default,
)
from sandbox.scene.description.world import Kick

Layers = Annotated[tuple[Name, ...], Field(min_length=1, max_length=10)]
"""Collision layers of an object; objects collide if they share a layer."""

MAX_LAYERS = 10
"""Largest number of layers of a scene: a 32-bit collision filter has three bits for each layer, and two for zones."""

MAX_ZONES = 1000
"""Largest number of zones of a scene: the state has an entry for each pair of a body and a zone."""

AWAY, INSIDE, HELD, RELEASED = range(4)
"""State of a body in a zone: outside; inside; held at the centre; released and still inside."""

MAX_CATEGORIES = 32
"""Largest number of collision categories of a scene, as many as pymunk's filters have bits."""

Width = Annotated[float, Field(gt=0, le=1e9)]


ZonePoints = Annotated[tuple[Point, ...], Field(min_length=2, max_length=1000)]

MAX_SENSORS = 1000
"""Largest number of sensors of a scene, each of which is compared with all bodies after every step."""

SensorCategories = Annotated[tuple[Name, ...], Field(min_length=1, max_length=32)]
"""Collision categories, by name, at least one."""


Coefficient = Annotated[float, Field(ge=0, le=1e9)]


class Liquid(Part):
    """The liquid of a zone: buoyancy and drag on the submerged part of each body in the layers of the zone.

    It acts on bodies with `collides = "none"` too, and not on static, kinematic, driven and held ones. Its weight per
    area is that in the zone's `gravity`, or without one in the world's; `gravity_scale` of a body does not change it.
    The area of a body is that of its parts: where these overlap, it counts twice, as in its mass.
    """

    density: Annotated[float, Field(gt=0, le=1e9)]
    """kg/m²; a body floats if its own density, mass divided by area, is smaller"""
    linear_drag: Coefficient = 0.0
    """force of the drag per submerged area and speed, N·s/m³"""
    quadratic_drag: Coefficient = 0.0
    """force of the drag per submerged area and square of the speed, N·s²/m⁴"""
    current: VelocityField = default((0.0, 0.0))
    """velocity of the liquid, m/s"""


class Zone(Part):
    """An area that detects bodies: circle (`position`, `radius`), polygon (`points`), strip (`points`, `thickness`)."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    layers: Accepts[Layers, Sequence[str]] = default((GROUND,))
    """layers in which it acts"""
    position: OptionalPoint = default(None)
    """centre of a circle, m"""
    radius: Radius | None = None
    """radius of a circle, m"""
    points: Accepts[ZonePoints | None, Coordinates | None] = default(None)
    """corners of a polygon, or centre line of a strip, m"""
    thickness: Width | None = None
    """full thickness of a strip, m"""
    to_layer: Name | None = None
    """moves a body that enters the zone to this collision layer, as at the mouth of a ramp"""
    holds: bool = False
    """A body that enters is held at the centre, one at a time, until an action moves it, as in a kicker."""
    gravity: Accepts[tuple[Acceleration, Acceleration] | None, Sequence[float] | None] = default(None)
    """gravity for bodies inside the zone and in its layers, m/s²; where zones overlap, the last one applies"""
    liquid: Liquid | None = None
    """liquid that fills a polygon"""
    colour: Colour | None = None
    """colour in the window, `#rrggbb`"""

    @property
    def moves_bodies(self) -> bool:
        """Whether it changes how bodies move: it holds them, has a gravity of its own, or a liquid."""
        return self.holds or self.gravity is not None or self.liquid is not None


class Sensor(Part):
    """An area that detects shapes that overlap it, and acts on none: circle, polygon, or strip, as of a `[[zone]]`.

    It is fixed in the world, or moves with a body. On a body that can move it detects all other bodies and static
    objects, elsewhere bodies that can move. Bodies with `collides = "none"`, walls and posts that are not solid, and
    other sensors are not detected.
    """

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    body: Name | None = None
    """name of the body that it moves with; default: it is fixed in the world"""
    position: OptionalPoint = default(None)
    """centre of a circle, m, in the frame of the body, or in the world without one"""
    radius: Radius | None = None
    """radius of a circle, m"""
    points: Accepts[ZonePoints | None, Coordinates | None] = default(None)
    """corners of a polygon, or centre line of a strip, m, in the frame of the body, or in the world without one"""
    thickness: Width | None = None
    """full thickness of a strip, m"""
    detects: Accepts[SensorCategories | None, Sequence[str] | None] = default(None)
    """collision categories that it detects; default: all. An object without categories belongs to all."""
    colour: Colour | None = None
    """colour in the window, `#rrggbb`"""


def mask_of(layers: Layers | None, known: tuple[str, ...]) -> int:
    """Return layers as a bit mask; None means all."""
    if layers is None:
        return (1 << len(known)) - 1
    return sum(1 << known.index(name) for name in {*layers})


Height = Annotated[float, Field(gt=0, le=1e9)]
Course = Annotated[tuple[Point, ...], Field(min_length=2, max_length=100_000)]

Passing: TypeAlias = tuple[tuple[int, int], ...]
"""Pairs of a body index and what the body is passing: a one-way wall, −1 − k, or the index of a one-way body."""

PlaneReach: TypeAlias = tuple[float, float, float]
"""Centre (x, y) of the start positions, and the distance from it within which half-planes are exact, m."""


class Plane(Collider):
    """A half-plane, solid behind its normal."""

    point: PointField
    """a point on the surface, m"""
    normal: Accepts[Vector, Sequence[float]]
    """direction out of the solid; any length"""
    layers: Accepts[Layers | None, Sequence[str] | None] = default(None)
    """layers in which it is solid; default: all"""


class Wall(Collider):
    """A polyline with round ends, solid on both sides."""

    points: Accepts[Course, Coordinates]
    """corners, m"""
    thickness: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """full thickness, m"""
    closed: bool = False
    """Connect the last point to the first."""
    layers: Accepts[Layers, Sequence[str]] = default((GROUND,))
    """layers in which it is solid"""
    height: Height | None = None
    """height of the nose above a floor, m"""
    kick: Kick | None = None
    """active kick, as of a slingshot"""
    one_way: bool = False
    """Solid only from the left of its direction (first to last point); bodies from the right pass."""
    solid: bool = True
    """whether bodies collide with it; an action can change this"""


class Post(Collider):
    """A fixed circle."""

    position: PointField
    """position of the centre, m"""
    radius: Radius
    """radius of the circle, m"""
    layers: Accepts[Layers, Sequence[str]] = default((GROUND,))
    """layers in which it is solid"""
    height: Height | None = None
    """height of the nose above a floor, m"""
    kick: Kick | None = None
    """active kick, as of a bumper"""
    solid: bool = True
    """whether bodies collide with it; an action can change this"""
