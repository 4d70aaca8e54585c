"""Surfaced and Mover: what everything that can be touched, and everything that moves, has in common."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import (
    AngularVelocity,
    Colour,
    Density,
    Falloff,
    Friction,
    Mass,
    Name,
    Part,
    Point,
    Restitution,
    Velocity,
)

GROUND = "ground"
"""The layer of what states none."""

Collides = Literal["all", "fixed", "none"]
"""What a body can meet: everything, only planes, walls, posts and fixed bodies, or nothing at all."""


class Surfaced(Part):
    """Anything that can be touched. A figure stated here outranks its material's."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    material: Name | None = None
    """name of a [[material]], which states what is not stated here"""
    restitution: Restitution | None = None
    """e: speed of separation / speed of approach, 0 to 1; where both sides of a contact state one they multiply"""
    restitution_falloff: Falloff | None = None
    """s/m: how restitution falls with the speed of approach, e(v) = e / (1 + f·v); the sides of a contact add theirs"""
    friction: Friction | None = None
    """Coulomb friction μ; where both sides of a contact state one they multiply"""
    colour: Colour | None = None
    """in the window, `#rrggbb`"""


class Mover(Surfaced):
    """Anything that has a number: bodies, and the generators that stand for many."""

    mass: Mass | None = None
    """kg; without mass or density, 1"""
    density: Density | None = None
    """kg/m²"""
    angle: Annotated[float, Field(ge=-1e12, le=1e12)] = 0.0
    """at the start, rad, counter-clockwise"""
    angular_velocity: AngularVelocity = 0.0
    """rad/s"""
    collides: Collides = "all"
    """what it can meet: `all`, `fixed` (planes, walls, posts and fixed bodies alone) or `none`"""
    layer: Name = GROUND
    """where it starts: it meets what shares its layer"""


class Single(Mover):
    """One body."""

    position: Point
    """m, of the origin of its own frame: of balls, boxes and capsules their centre"""
    velocity: Velocity = (0.0, 0.0)
    """of the centre of mass, m/s"""
    fixed: bool = False
    """Never moves: infinitely heavy."""
