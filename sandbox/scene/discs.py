"""Discs: balls, and the generators that stand for many of them."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.floor import Spin
from sandbox.scene.part import MAX_BODIES, Colour, Coordinate, Point, Radius, Velocity
from sandbox.scene.surfaced import Collides, Mover, Single

Count = Annotated[int, Field(ge=1, le=MAX_BODIES)]
Lifetime = Annotated[float, Field(ge=1e-9, le=1e10)]


class Disc(Mover):
    """What the balls of a scene and of its generators have in common: a uniform disc, I = ½ m r²."""

    radius: Radius
    """of the disc, m"""


class Ball(Disc, Single):
    """One ball; on a `[surface]` a sphere, I = ⅖ m r²."""

    spin: Spin | None = None
    """of a ball on a `[surface]`, instead of `angular_velocity`"""


class Grid(Disc):
    """Balls in columns and rows, counted along each row from the lower left."""

    origin: Point
    """centre of the lower left ball, m"""
    columns: Count
    """balls in each row"""
    rows: Count = 1
    """how many rows"""
    spacing: tuple[Coordinate, Coordinate]
    """from centre to centre, m"""
    jitter: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """Each coordinate is moved by up to ± this, m."""
    velocity: Velocity = (0.0, 0.0)
    """of every ball, m/s"""
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Each component is changed by up to ± this, m/s."""


class Scatter(Disc):
    """Balls placed at random in a box, none overlapping another of the same scatter if they collide."""

    count: Count
    """how many balls"""
    lower: Point
    """lower left corner of the box, m"""
    upper: Point
    """upper right corner of the box, m"""
    velocity: Velocity = (0.0, 0.0)
    """of every ball, m/s"""
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Each component is changed by up to ± this, m/s."""


class Emitter(Disc):
    """Particles that leave one point with random velocities, such as a firework."""

    position: Point
    """of the point that they leave, m"""
    count: Count
    """how many particles"""
    velocity_min: Velocity
    """the least of each component, m/s"""
    velocity_max: Velocity
    """Each component is uniform between the two, m/s."""
    radius: Radius = 0.05
    """of each particle, m"""
    collides: Collides = "none"
    """what they can meet: `all`, `fixed` (planes, walls, posts and fixed bodies alone) or `none`"""
    lifetime: Lifetime | None = None
    """s, after which a particle is gone; None for ever"""
    lifetime_jitter: Annotated[float, Field(ge=0, le=1e10)] = 0.0
    """Each lives longer or shorter by up to ± this, s; the sooner, the lower its number."""
    colours: Annotated[tuple[Colour, ...], Field(min_length=2, max_length=64)] | None = None
    """one after the other over the life of a particle, faded in equal parts; instead of `colour`"""


Generator = Grid | Scatter | Emitter
