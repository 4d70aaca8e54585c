"""Scene: what a scene file says, as frozen values. SI units, y up, radians.

The model holds the file as it was written: generators are not expanded, mixing rules not applied.
`bodies.py` numbers what moves, `demands.py` derives the physics that is needed.
"""

from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, StringConstraints

from sandbox.scene.part import (
    MAX_BODIES,
    AngularVelocity,
    Colour,
    Coordinate,
    Density,
    Friction,
    Mass,
    Name,
    Part,
    Point,
    Radius,
    Restitution,
    Vector,
    Velocity,
)
from sandbox.scene.settings import Settings

if TYPE_CHECKING:
    from sandbox.scene.bodies import Bodies

Collides = Literal["all", "fixed", "none"]
"""What a body can meet: everything, only planes, walls, posts and fixed balls, or nothing at all."""

Count = Annotated[int, Field(ge=1, le=MAX_BODIES)]
Acceleration = Annotated[float, Field(ge=-1e9, le=1e9)]
Drag = Annotated[float, Field(ge=0, le=1e9)]


class World(Part):
    """The surroundings: gravity, air, time, and the box outside which bodies are retired."""

    gravity: tuple[Acceleration, Acceleration] = (0.0, 0.0)
    """m/s²"""
    duration: Annotated[float, Field(gt=0, le=1e9)] = 10.0
    """s, of a headless run"""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """All randomness of a scene comes from it."""
    linear_drag: Drag = 0.0
    """k, 1/s: a = −k (v − wind)"""
    quadratic_drag: Drag = 0.0
    """c, 1/m: a = −c |v − wind| (v − wind)"""
    wind: Velocity = (0.0, 0.0)
    """m/s"""
    bounds: tuple[Point, Point] | None = None
    """Lower-left and upper-right corner, m. A body whose centre leaves the box is retired."""


class Material(Part):
    """A named pair of coefficients."""

    name: Name
    restitution: Restitution | None = None
    friction: Friction | None = None


class Pair(Part):
    """The coefficients of two materials in contact; outranks whatever they would mix to."""

    between: tuple[Name, Name]
    restitution: Restitution | None = None
    friction: Friction | None = None


class Surfaced(Part):
    """Anything that can be touched. A figure stated here outranks its material's."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    material: Name | None = None
    restitution: Restitution | None = None
    friction: Friction | None = None
    colour: Colour | None = None


class Plane(Surfaced):
    """A half-plane, solid behind its normal."""

    point: Point
    """any point of the surface, m"""
    normal: Vector
    """out of the solid; any length"""


class Wall(Surfaced):
    """A polyline with round ends, solid on both sides."""

    points: Annotated[tuple[Point, ...], Field(min_length=2, max_length=100_000)]
    thickness: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """full thickness, m"""
    closed: bool = False
    """Join the last point to the first."""


class Post(Surfaced):
    """A fixed circle."""

    position: Point
    radius: Radius


class Disc(Surfaced):
    """What the balls of a scene and of its generators have in common: a uniform disc, I = ½ m r²."""

    radius: Radius
    mass: Mass | None = None
    """kg; without mass or density, 1"""
    density: Density | None = None
    """kg/m²"""
    angle: Annotated[float, Field(ge=-1e12, le=1e12)] = 0.0
    angular_velocity: AngularVelocity = 0.0
    """rad/s"""
    collides: Collides = "all"


class Ball(Disc):
    """One ball."""

    position: Point
    velocity: Velocity = (0.0, 0.0)
    fixed: bool = False
    """Never moves: infinitely heavy."""


class Grid(Disc):
    """Balls in columns and rows, counted along each row from the lower left."""

    origin: Point
    """centre of the lower left ball, m"""
    columns: Count
    rows: Count = 1
    spacing: tuple[Coordinate, Coordinate]
    """from centre to centre, m"""
    jitter: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """Each coordinate is moved by up to ± this, m."""
    velocity: Velocity = (0.0, 0.0)
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Each component is changed by up to ± this, m/s."""


class Scatter(Disc):
    """Balls placed at random in a box, none overlapping another of the same scatter if they collide."""

    count: Count
    lower: Point
    upper: Point
    velocity: Velocity = (0.0, 0.0)
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Each component is changed by up to ± this, m/s."""


class Emitter(Disc):
    """Particles that leave one point with random velocities, such as a firework."""

    position: Point
    count: Count
    velocity_min: Velocity
    velocity_max: Velocity
    """Each component is uniform between the two, m/s."""
    radius: Radius = 0.05
    collides: Collides = "none"


Generator = Grid | Scatter | Emitter


class Play(Part):
    """How the window plays a scene. No engine reads it, and no run depends on it."""

    arrows: Name | None = None
    """a body that the arrow keys move"""
    arrow_step: Annotated[float, Field(gt=0, le=1e9)] = 0.5
    """m, how far each time"""
    relaunch: Name | None = None
    """a generator whose balls Space starts anew, with other chances"""
    show: Literal["overlap"] | None = None
    """Colour bodies by whether they overlap anything."""


class Scene(Part):
    """A whole scene file."""

    title: Annotated[str, StringConstraints(max_length=200)] = ""
    about: Annotated[str, StringConstraints(max_length=2000)] = ""
    """What to look for."""
    world: World = Field(default_factory=World)
    solver: Settings = Field(default_factory=Settings)
    play: Play = Field(default_factory=Play)
    materials: tuple[Material, ...] = Field((), alias="material")
    pairs: tuple[Pair, ...] = Field((), alias="pair")
    planes: tuple[Plane, ...] = Field((), alias="plane")
    walls: tuple[Wall, ...] = Field((), alias="wall")
    posts: tuple[Post, ...] = Field((), alias="post")
    balls: tuple[Ball, ...] = Field((), alias="ball")
    grids: tuple[Grid, ...] = Field((), alias="grid")
    scatters: tuple[Scatter, ...] = Field((), alias="scatter")
    emitters: tuple[Emitter, ...] = Field((), alias="emitter")

    @cached_property
    def bodies(self) -> "Bodies":
        """What moves, numbered: arrays in scene order, generators expanded."""
        from sandbox.scene.bodies import expand  # needs numpy, which reading a file does not

        return expand(self)

    @property
    def discs(self) -> tuple[Disc, ...]:
        """The balls and generators of the file, in scene order."""
        return self.balls + self.grids + self.scatters + self.emitters

    def placed(self, bodies: "Bodies") -> "Scene":
        """Return this scene with its bodies as they have come to be: elsewhere, fewer, or more.

        Only `bodies` differs: the file that it would be written to is the same.
        """
        scene = self.model_copy()
        scene.__dict__["bodies"] = bodies  # where cached_property looks first
        return scene

    @property
    def fixed(self) -> tuple[Plane | Wall | Post, ...]:
        """The fixed things, in the order of their numbers: planes, walls, posts."""
        return self.planes + self.walls + self.posts

    @cached_property
    def fixed_names(self) -> tuple[str, ...]:
        """A name for each fixed thing; one without a name is called by its kind and place in the file."""
        return tuple(
            thing.name or default_name(kind, k)
            for kind, things in (("plane", self.planes), ("wall", self.walls), ("post", self.posts))
            for k, thing in enumerate(things)
        )


def default_name(kind: str, index: int) -> str:
    """Return what the index-th (from 0) nameless element of a kind is called."""
    return f"{kind}-{index + 1}"
