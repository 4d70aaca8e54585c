"""Attraction, thrusts, tyres and drives (flippers, diverters, plungers).

A drive prescribes the motion of its body. With a torque drive, gravity and collisions act on the body too, air drag and
damping do not. With a stroke or plunger drive, no load stops the body: it pushes free bodies, and passes through static
bodies and other bodies with such a drive.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.description.base import (
    Accepts,
    Angle,
    Moment,
    Name,
    Part,
    Point,
    PointField,
    Vector,
    default,
    default_kind,
)

DriveKey = Literal[
    "up", "down", "left", "right", "space", "left shift", "right shift", "z", "slash", "return"
]  # fmt: skip
"""Key of the window."""

StopAngle = Annotated[float, Field(ge=-1e9, le=1e9)]
Torque = Annotated[float, Field(gt=0, le=1e30)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Second = Annotated[float, Field(ge=0, le=1e9)]
Rate = Annotated[float, Field(gt=0, le=1e9)]


class Driven(Part):
    """Fields of all drives."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file, such as `drive-1`"""
    body: Name
    """name of a single body that is at rest at the start"""
    key: DriveKey | None = None
    """The level is 1 while this key is held in the window; a `drive` action can set it at any time."""


class TorqueDrive(Driven):
    """Turns a body about a hinge from one stop to another by a torque, and back by a weaker torque: a flipper.

    Collisions act on the body according to its moment of inertia. The target torque is `-return_ratio * torque` at
    level 0 and `level * torque` otherwise; the torque approaches it at `torque / ramp` per second. The torque starts at
    0, so that the first stroke does not have to overcome the return torque. Within `hold_within` of the end of a stroke
    the target torque is multiplied by b + hold_ratio (1 − b), b = (d / hold_within)⁴, d the remaining angle.
    """

    kind: Literal["torque"] = default_kind("torque")
    pivot: PointField
    """position of the hinge at the start, m"""
    stops: Accepts[tuple[StopAngle, StopAngle], Sequence[float]]
    """rest angle and driven angle of the body, rad; either sense"""
    torque: Torque
    """torque at level 1, N·m"""
    ramp: Second = 0.0
    """time in which the torque rises from 0 to its full value, s"""
    return_ratio: Fraction = 0.1
    """fraction of the torque that returns it at level 0"""
    hold_ratio: Fraction = 1.0
    """fraction of the torque that remains at the end of the stroke"""
    hold_within: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """angle before the end of the stroke within which the torque falls to that fraction, rad"""
    bounce: Fraction = 0.0
    """restitution at the stops"""
    moment: Moment | None = None
    """moment of inertia about the hinge, kg·m²; default: from the shape and mass of the body"""


class StrokeDrive(Driven):
    """Turns a body about a hinge at a prescribed rate, independent of the load: a diverter, a windmill."""

    kind: Literal["stroke"] = default_kind("stroke")
    pivot: PointField
    """position of the hinge at the start, m"""
    stops: Accepts[tuple[StopAngle, StopAngle], Sequence[float]]
    """rest angle and driven angle of the body, rad; it turns to the second while the level is above 0; either sense"""
    rate: Rate
    """rate of rotation, rad/s"""
    return_rate: Annotated[float, Field(ge=0, le=1e9)] | None = None
    """rate at level 0, rad/s; default: `rate`; at 0 the body keeps its angle"""


class PlungerDrive(Driven):
    """Pulls a body back along a line and releases it, so that it springs forward to its start: a plunger.

    The level is the desired fraction of the pull. At level 0 the plunger is released: the remaining pull decreases as
    cos(ω t), ω = speed / travel, until the plunger reaches its stop.
    """

    kind: Literal["plunger"] = default_kind("plunger")
    direction: Accepts[Vector, Sequence[float]]
    """direction of the strike; any length"""
    travel: Annotated[float, Field(gt=0, le=1e9)]
    """largest distance that it can be drawn back, m"""
    speed: Annotated[float, Field(gt=0, le=1e9)]
    """speed at the stop after a full pull, m/s; proportional to the pull"""
    draw_time: Annotated[float, Field(gt=0, le=1e9)] = 1.0
    """duration of a full pull, s"""


AnyDrive = Annotated[TorqueDrive | StrokeDrive | PlungerDrive, Field(discriminator="kind")]


Newton = Annotated[float, Field(ge=-1e30, le=1e30)]

ThrustKey = Literal["up", "down", "left", "right"]
"""Arrow key of the window."""


class Attraction(Part):
    """Attracts every moving body towards a point or a body: a = strength / (r² + softening²)."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file, such as `attraction-1`"""
    toward: Accepts[Point | Name, Sequence[float] | str]
    """a point, m, or the name of a body; a body that can move is attracted by the reaction"""
    strength: Annotated[float, Field(ge=-1e30, le=1e30)]
    """G·M, m³/s²; negative values repel"""
    softening: Annotated[float, Field(ge=0, le=1e9)] = 0.0
    """length that limits the acceleration near the centre, m"""


class Thrust(Part):
    """A force fixed to a body, such as a rocket engine: it turns with the body."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file, such as `thrust-1`"""
    body: Name
    """name of the body"""
    force: Accepts[tuple[Newton, Newton], Sequence[float]]
    """force in the frame of the body, N"""
    point: PointField = default((0.0, 0.0))
    """point of action in the frame of the body, m"""
    begin: Second = 0.0
    """start, s"""
    end: Second | None = None
    """end, s; default: unlimited"""
    key: ThrustKey | None = None
    """Acts only while this key is held or a `throttle` action has switched it on."""


Positive = Annotated[float, Field(gt=0, le=1e30)]
NotNegative = Annotated[float, Field(ge=0, le=1e30)]


class Tyre(Part):
    """Friction of a body on the ground, seen from above: it rolls freely along one direction and grips across it.

    A tyre of a car, an ice skate, a runner of a sledge. The force on the body is at most `grip` in any direction: a
    tyre that is driven or braked has less of it left for cornering, and beyond it the tyre skids. Gravity is usually 0.
    """

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file, such as `tyre-1`"""
    body: Name
    """name of the body"""
    point: PointField = default((0.0, 0.0))
    """where it touches the ground, in the frame of the body, m"""
    angle: Angle = 0.0
    """rolling direction in the frame of the body, rad; at 0 it rolls along the x axis"""
    grip: Positive
    """largest force, N: coefficient of friction times load"""
    slip: NotNegative = 0.0
    """speed at which it slides per force that it exerts, below its grip, m/(N·s); 0: it does not slide there"""
    rolling_drag: NotNegative = 0.0
    """force that opposes rolling, N; from `grip` on it does not roll, and slides alike in all directions"""
    drive: NotNegative = 0.0
    """force of the engine at level 1, forwards, N"""
    brake: NotNegative = 0.0
    """largest force of the brake at level 1, N; from `grip` on it locks the wheel"""
    steer: Angle = 0.0
    """angle by which steering at level 1 turns it to the left, rad"""
    keys: bool = False
    """Whether keys control it: Up and Down drive forwards and backwards, Left and Right steer, Space brakes."""
