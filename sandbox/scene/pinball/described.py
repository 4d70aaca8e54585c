"""Pinball: what a scene file says of a table, and of what it is built."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Colour, Coordinate, Mass, Part, Radius, Restitution
from sandbox.scene.pinball.element import Corners
from sandbox.scene.pinball.moving import Flipper, PinballBall, Plunger
from sandbox.scene.pinball.painted import Art
from sandbox.scene.pinball.sensed import Drain, Kicker, Ramp, Rollover, Spinner
from sandbox.scene.pinball.solids import Bumper, DropTargets, Gate, PinballPost, PinballWall, Rubber, Slingshot, Standup


class Pinball(Part):
    """A table seen from above, y up its slope, as a list of elements: it stands for a scene of primitives.

    What else the scene states outranks it: a wall or ball of the same name, `world.gravity`, a material, a pair.
    """

    game: Literal["pinball"] = "pinball"
    """whose rules are kept"""
    slope: Annotated[float, Field(ge=0, le=1.5)] = 0.11345
    """rad: 6.5°; the ball rolls down it with 5/7 of g sin(slope)"""
    axis: Coordinate = 0.0
    """x of the line in which elements are mirrored, m"""
    tolerance: Annotated[float, Field(ge=1e-6, le=1e-2)] = 2e-5
    """how far the short straight pieces that an arc is made of may lie from it, m"""
    ball_radius: Radius = 0.01349
    """25 units, m: 1 1/16 in across"""
    ball_mass: Mass = 0.08
    """kg"""
    ball_restitution: Restitution = 0.9
    """of two balls"""
    colour: Colour | None = None
    """of the playfield"""
    outline: Corners | None = None
    """of the playfield, which is painted within it, m; corners may be rounded"""
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
