"""What stands: the solid things of a scene that never move, `[[plane]]`, `[[wall]]` and `[[post]]`."""

from typing import Annotated, TypeAlias

from pydantic import Field

from sandbox.scene.kick import Kick
from sandbox.scene.part import Point, Radius, Vector
from sandbox.scene.surfaced import GROUND, Surfaced
from sandbox.scene.zone import Layers

Height = Annotated[float, Field(gt=0, le=1e9)]
Course = Annotated[tuple[Point, ...], Field(min_length=2, max_length=100_000)]

Passing: TypeAlias = tuple[tuple[int, int], ...]
"""Pairs of a body, by its number, and a one-way wall that lets it through, −1 − k."""


class Plane(Surfaced):
    """A half-plane, solid behind its normal."""

    point: Point
    """any point of the surface, m"""
    normal: Vector
    """out of the solid; any length"""
    layers: Layers | None = None
    """on which it is solid; without, on all"""


class Wall(Surfaced):
    """A polyline with round ends, solid on both sides."""

    points: Course
    """its corners, m"""
    thickness: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """full thickness, m"""
    closed: bool = False
    """Join the last point to the first."""
    layers: Layers = (GROUND,)
    """on which it is solid"""
    height: Height | None = None
    """of the nose above a floor, m"""
    kick: Kick | None = None
    """throws what hits it, as a slingshot does"""
    one_way: bool = False
    """Solid only for what comes from the left of its direction, first to last point; from the right all pass."""
    solid: bool = True
    """whether anything meets it; an action can change that"""


class Post(Surfaced):
    """A fixed circle."""

    position: Point
    """of its centre, m"""
    radius: Radius
    """of the circle, m"""
    layers: Layers = (GROUND,)
    """on which it is solid"""
    height: Height | None = None
    """of the nose above a floor, m"""
    kick: Kick | None = None
    """throws what hits it, as a bumper does"""
    solid: bool = True
    """whether anything meets it; an action can change that"""
