"""Discs: balls, and the generators that stand for many of them."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import MAX_BODIES, Coordinate, Point, Radius, Velocity
from sandbox.scene.surfaced import Collides, Mover, Single

Count = Annotated[int, Field(ge=1, le=MAX_BODIES)]


class Disc(Mover):
    """What the balls of a scene and of its generators have in common: a uniform disc, I = ½ m r²."""

    radius: Radius


class Ball(Disc, Single):
    """One ball."""


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
