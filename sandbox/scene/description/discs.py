"""Discs: balls, and grids, scatters and emitters of balls."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from sandbox.scene.description.base import (
    MAX_BODIES,
    Accepts,
    BodySource,
    BodySpec,
    Collides,
    Colour,
    Coordinate,
    PointField,
    Radius,
    VelocityField,
    default,
)
from sandbox.scene.description.surface import Spin

Count = Annotated[int, Field(ge=1, le=MAX_BODIES)]
Colours = Annotated[tuple[Colour, ...], Field(min_length=2, max_length=64)]
Lifetime = Annotated[float, Field(ge=1e-9, le=1e10)]


class Disc(BodySource):
    """Common fields of balls and of generators of balls: a uniform disc, I = ½ m r²."""

    radius: Radius
    """radius of the disc, m"""


class Ball(Disc, BodySpec):
    """One ball; on a `[surface]` a sphere, I = ⅖ m r²."""

    spin: Accepts[Spin | None, Sequence[float] | None] = default(None)
    """angular velocity of a ball on a `[surface]`, rad/s, right-handed, z up; replaces `angular_velocity`"""


class Grid(Disc):
    """Balls in columns and rows, numbered along each row from the lower left."""

    origin: PointField
    """centre of the lower left ball, m"""
    columns: Count
    """number of balls in each row"""
    rows: Count = 1
    """number of rows"""
    spacing: Accepts[tuple[Coordinate, Coordinate], Sequence[float]]
    """distance between centres, m"""
    jitter: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """Largest random displacement ± of each coordinate, m."""
    velocity: VelocityField = default((0.0, 0.0))
    """initial velocity of every ball, m/s"""
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Largest random change ± of each velocity component, m/s."""


class Scatter(Disc):
    """Balls at random positions in a box; those that collide do not overlap at the start."""

    count: Count
    """number of balls"""
    lower: PointField
    """lower left corner of the box, m"""
    upper: PointField
    """upper right corner of the box, m"""
    velocity: VelocityField = default((0.0, 0.0))
    """initial velocity of every ball, m/s"""
    velocity_jitter: Annotated[float, Field(ge=0, le=1e12)] = 0.0
    """Largest random change ± of each velocity component, m/s."""


class Emitter(Disc):
    """Particles that start at one point with random velocities, such as a firework."""

    position: PointField
    """position of the starting point, m"""
    count: Count
    """number of particles"""
    velocity_min: VelocityField
    """smallest value of each velocity component, m/s"""
    velocity_max: VelocityField
    """Largest value of each velocity component, m/s; components are uniformly distributed."""
    radius: Radius = 0.05
    """radius of each particle, m"""
    collides: Collides = "none"
    """bodies that the particles collide with: `all`, `fixed` (only planes, walls, posts and fixed bodies) or `none`"""
    lifetime: Lifetime | None = None
    """lifetime, s, after which a particle is removed; default: unlimited"""
    lifetime_jitter: Annotated[float, Field(ge=0, le=1e10)] = 0.0
    """Largest random change ± of the lifetime, s; particles are numbered in the order in which they are removed."""
    colours: Accepts[Colours | None, Sequence[str] | None] = default(None)
    """colours over the lifetime of a particle, with equal fades between them; replaces `colour`"""


Generator = Grid | Scatter | Emitter
