"""Joints between bodies, or between a body and the world.

`between` names one or two bodies. A single body is joined to the world. Angles are those of the second body relative to
the first; of a single body, relative to the world.
"""

from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.description.base import (
    Accepts,
    Coordinates,
    Name,
    OptionalPoint,
    Part,
    Point,
    PointField,
    Vector,
    default,
    default_kind,
)

JointStrength = Annotated[float, Field(gt=0, le=1e42)]
JointLimit = Annotated[float, Field(ge=0, le=1e42)]
JointBias = Annotated[float, Field(ge=0, le=1)]
JointDistance = Annotated[float, Field(ge=0, le=1e9)]
Travel = Annotated[float, Field(ge=-1e9, le=1e9)]
JointAngle = Annotated[float, Field(ge=-1e12, le=1e12)]
Stiffness = Annotated[float, Field(gt=0, le=1e30)]
Damping = Annotated[float, Field(ge=0, le=1e30)]


class Joined(Part):
    """Fields of all joints."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file, such as `joint-1`"""
    between: Accepts[Annotated[tuple[Name, ...], Field(min_length=1, max_length=2)], Sequence[str]]
    """names of one body (joined to the world) or of two"""
    collide: bool = False
    """Allow collisions between the two bodies."""
    strength: JointStrength | None = None
    """strength, N (N·m for joints that hold an angle): a larger load breaks the joint; default: unbreakable"""


class ForceLimited(Joined):
    """A joint whose force can have a limit."""

    max_force: JointLimit | None = None
    """largest force, N (N·m for joints that hold an angle): the joint gives way to a larger load; default: unlimited"""


class ErrorCorrecting(ForceLimited):
    """A joint that corrects its error, a length or an angle, over several steps."""

    max_bias: JointLimit | None = None
    """largest speed at which the error is corrected, m/s (rad/s for joints that hold an angle); 0: never, so that the
    joint only resists motion; default: unlimited"""
    bias: JointBias | None = None
    """fraction of the error that remains after one second of correction; default: that of the solver"""


class Anchored(Joined):
    """A joint that acts on one point of each body."""

    anchors: Accepts[tuple[Point, Point], Coordinates] = default(((0.0, 0.0), (0.0, 0.0)))
    """the two end points, m, in the order of `between`, each in the frame of its body. With one body, the second is a
    point in the world"""


class Rod(Anchored, ErrorCorrecting):
    """Keeps two points at a constant distance, as a massless rod. `pin` is a synonym (pymunk's term)."""

    kind: Literal["rod", "pin"] = default_kind("rod")
    length: JointDistance | None = None
    """length, m; default: the distance at the start. A rod of length 0 holds two points together along the line
    between them only, as pymunk's `PinJoint` does; a pivot holds them in both directions"""


class Pivot(ErrorCorrecting):
    """Joins two bodies at one point, about which they turn."""

    kind: Literal["pivot"] = default_kind("pivot")
    at: OptionalPoint = default(None)
    """position of the pivot in the world at the start, m"""
    anchors: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """or its position in the frame of each body, m, in the order of `between`; with one body, the second is a point in
    the world"""


class Slide(Anchored, ErrorCorrecting):
    """Keeps the distance of two points between two limits; a string if the lower limit is 0."""

    kind: Literal["slide"] = default_kind("slide")
    least: JointDistance = 0.0
    """smallest distance, m"""
    most: JointDistance
    """largest distance, m"""


class Groove(ErrorCorrecting):
    """Lets a point of the second body slide along a groove in the first; with one body, the groove is in the world."""

    kind: Literal["groove"] = default_kind("groove")
    groove: Accepts[tuple[Point, Point], Coordinates]
    """ends of the groove in the frame of the first body, m"""
    anchor: PointField = default((0.0, 0.0))
    """point of the other body in its own frame, m"""


class RotaryLimit(ErrorCorrecting):
    """Keeps the angle between two bodies within limits."""

    kind: Literal["rotary_limit"] = default_kind("rotary_limit")
    least: JointAngle
    """smallest angle, rad"""
    most: JointAngle
    """largest angle, rad"""


class Motor(Joined):
    """Turns the second body relative to the first at a constant rate."""

    kind: Literal["motor"] = default_kind("motor")
    rate: JointAngle
    """rate of rotation, rad/s"""
    max_torque: JointLimit | None = None
    """largest torque, N·m; default: unlimited"""


class Ratchet(ErrorCorrecting):
    """Lets the second body turn in one direction, click by click, and holds it at the last click in the other.

    Clicks are at the angles phase + k·ratchet, for all integers k.
    """

    kind: Literal["ratchet"] = default_kind("ratchet")
    ratchet: JointAngle
    """angle between two clicks, rad; if negative, the body turns freely clockwise, else counter-clockwise"""
    phase: JointAngle = 0.0
    """angle of a click, rad"""
    angle: JointAngle | None = None
    """angle at which it holds until the next click is passed, rad; default: the last click at the start"""


class Gear(ErrorCorrecting):
    """Keeps angle₂·ratio − angle₁ = phase: the first body turns `ratio` times as fast as the second."""

    kind: Literal["gear"] = default_kind("gear")
    ratio: Annotated[float, Field(ge=-1e6, le=1e6)]
    """angle₁ / angle₂"""
    phase: JointAngle | None = None
    """phase, rad; default: its value at the start"""


class Spring(Anchored, ForceLimited):
    """A damped spring between two points: F = −k (l − l₀) − c l̇ along their line."""

    kind: Literal["spring"] = default_kind("spring")
    rest_length: JointDistance | None = None
    """length without force, m; default: the distance at the start"""
    stiffness: Stiffness
    """stiffness k, N/m"""
    damping: Damping = 0.0
    """damping c, N·s/m"""
    pulls_only: bool = False
    """Act only while longer than the rest length, and never push, as an elastic band."""


class RotarySpring(ForceLimited):
    """A damped spring of the angle between two bodies: τ = −k (φ − φ₀) − c φ̇."""

    kind: Literal["rotary_spring"] = default_kind("rotary_spring")
    rest_angle: JointAngle | None = None
    """angle without torque, rad; default: its value at the start"""
    stiffness: Stiffness
    """stiffness k, N·m/rad"""
    damping: Damping = 0.0
    """damping c, N·m·s/rad"""


class Pulley(Anchored):
    """A massless rope from one body over two fixed wheels to another: length₁ + ratio·length₂ is at most its length.

    The lengths are those from each wheel to its body. The rope pulls and never pushes. Wheels have no size.
    """

    kind: Literal["pulley"] = default_kind("pulley")
    between: Accepts[Annotated[tuple[Name, ...], Field(min_length=2, max_length=2)], Sequence[str]]
    """names of two bodies"""
    wheels: Accepts[tuple[Point, Point], Coordinates]
    """positions of the wheels in the world, m, in the order of `between`"""
    ratio: Annotated[float, Field(ge=1e-6, le=1e6)] = 1.0
    """tension at the second body / tension at the first; 2 if the second hangs in a loop of the rope"""
    length: JointDistance | None = None
    """length of the rope, m; default: length₁ + ratio·length₂ at the start"""


class Weld(Joined):
    """Holds two bodies together as they are at the start: neither their distance nor their angle changes."""

    kind: Literal["weld"] = default_kind("weld")
    at: OptionalPoint = default(None)
    """point in the world at the start at which it holds them, m; default: the centre of mass of the second body. The
    force is that at this point, so it matters for the strengths"""
    torque_strength: JointStrength | None = None
    """torque at which it breaks, N·m; default: unbreakable"""


class OnAxis(Joined):
    """A joint that lets a point of the second body move along an axis of the first."""

    axis: Accepts[Vector, Sequence[float]]
    """direction of the axis in the frame of the first body, any length; with one body, in the world"""
    at: OptionalPoint = default(None)
    """the point, in the world at the start, m; default: the centre of mass of the second body"""
    travel: Accepts[tuple[Travel, Travel], Sequence[float]]
    """smallest and largest displacement along the axis, m; it is 0 at the start"""


class Prismatic(OnAxis):
    """Lets the second body slide along an axis of the first without turning relative to it, as a piston or a lift."""

    kind: Literal["prismatic"] = default_kind("prismatic")
    rate: Annotated[float, Field(ge=-1e9, le=1e9)] | None = None
    """speed at which a motor moves the second body along the axis, up to the end of the travel, m/s; default: no
    motor"""
    max_force: JointLimit | None = None
    """largest force of the motor, N; default: unlimited"""


class Wheel(OnAxis):
    """A wheel with its suspension: the hub moves along an axis of the first body, with a spring, and the wheel turns.

    The spring acts along the axis: F = −k (s − s₀) − c ṡ, s the displacement of the hub.
    """

    kind: Literal["wheel"] = default_kind("wheel")
    stiffness: Stiffness
    """stiffness k, N/m"""
    damping: Damping = 0.0
    """damping c, N·s/m"""
    rest: Travel = 0.0
    """displacement s₀ without force of the spring, m"""
    rate: JointAngle | None = None
    """rate at which a motor turns the wheel relative to the first body, rad/s; default: no motor"""
    max_torque: JointLimit | None = None
    """largest torque of the motor, N·m; default: unlimited"""


Joint = Annotated[
    Rod
    | Pivot
    | Slide
    | Groove
    | RotaryLimit
    | Motor
    | Gear
    | Spring
    | RotarySpring
    | Pulley
    | Ratchet
    | Weld
    | Prismatic
    | Wheel,
    Field(discriminator="kind"),
]
