"""Drives: what moves a body to and fro on demand, as a scene file says it: flippers, diverters, plungers.

A drive holds its body by itself: nothing else can move it but, of a drive by torque, its weight and what it meets; the
air does not slow it. What a stroke or a plunger leads goes on whatever is in its way: it pushes what moves freely, and
passes through what never moves and through others that are led.
"""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Name, Part, Point, Vector

DriveKey = Literal[
    "up", "down", "left", "right", "space", "left shift", "right shift", "z", "slash", "return"
]  # fmt: skip
"""a key of the window"""

Turned = Annotated[float, Field(ge=-1e9, le=1e9)]
Torque = Annotated[float, Field(gt=0, le=1e30)]
Moment = Annotated[float, Field(gt=0, le=1e30)]
Share = Annotated[float, Field(ge=0, le=1)]
Second = Annotated[float, Field(ge=0, le=1e9)]
Rate = Annotated[float, Field(gt=0, le=1e9)]


class Driven(Part):
    """What all drives have."""

    name: Name | None = None
    """without one it is called by its kind and its place in the file, such as `joint-1`"""
    body: Name
    """a single body, which stands still as the scene starts"""
    key: DriveKey | None = None
    """Its level is 1 while this key is held in the window; a `drive` action sets it at any time."""


class TorqueDrive(Driven):
    """Turns a body about a hinge from one stop to another by a torque, and back by a weaker one: a flipper.

    What it meets pushes it about, as heavy as it is. At level 0 the wanted torque is `-return_ratio * torque`, else
    `level * torque`; the torque goes there by `torque / ramp` a second. It starts at 0, so that the first stroke need
    not overcome the torque that draws the body back. Within `hold_within` of the end the wanted torque, either way, is
    multiplied by b + hold_ratio (1 − b), b = (d / hold_within)⁴, d the angle that is left.
    """

    kind: Literal["torque"]
    pivot: Point
    """the hinge, where the scene starts, m"""
    stops: tuple[Turned, Turned]
    """angles of the body, rad: where it rests, and where it is driven to; either sense"""
    torque: Torque
    """N·m"""
    ramp: Second = 0.0
    """s in which the torque rises from 0 to all of it"""
    return_ratio: Share = 0.1
    """the part of the torque that draws it back at level 0"""
    hold_ratio: Share = 1.0
    """the part of the wanted torque that is left at the end"""
    hold_within: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """rad from the end, within which the wanted torque falls off to that part"""
    bounce: Share = 0.0
    """the part of its speed with which it is thrown back from a stop"""
    moment: Moment | None = None
    """of inertia about the hinge, kg·m²; without, as the body's shape and mass have it"""


class StrokeDrive(Driven):
    """Turns a body about a hinge at a rate, and nothing stops it but its stops: a diverter, a windmill."""

    kind: Literal["stroke"]
    pivot: Point
    """the hinge, where the scene starts, m"""
    stops: tuple[Turned, Turned]
    """angles of the body, rad: where it rests, and where it turns to while its level is above 0; either sense"""
    rate: Rate
    """rad/s"""
    return_rate: Annotated[float, Field(ge=0, le=1e9)] | None = None
    """rad/s at level 0; without, as fast as there; 0 stays where it is"""


class PlungerDrive(Driven):
    """Draws a body back along a line, and lets it spring forward to where it started: a plunger.

    The level is the wanted part of the pull. At level 0 it is let go: what is left of the pull goes as cos(ω t),
    ω = speed / travel, until it stands on its stop.
    """

    kind: Literal["plunger"]
    direction: Vector
    """in which it strikes; any length"""
    travel: Annotated[float, Field(gt=0, le=1e9)]
    """how far it can be drawn back, m"""
    speed: Annotated[float, Field(gt=0, le=1e9)]
    """m/s at its stop after a full pull; after a part of one, that part of it"""
    draw_time: Annotated[float, Field(gt=0, le=1e9)] = 1.0
    """s that a full pull takes"""


Drive = Annotated[TorqueDrive | StrokeDrive | PlungerDrive, Field(discriminator="kind")]
