"""Actions: timed changes of a running scene, made by a player, a script or the scene, and applied between steps."""

from collections.abc import Sequence
from typing import Annotated, Literal, Self, TypeAlias

from pydantic import Field, model_validator

from sandbox.scene.description.base import (
    Accepts,
    Angle,
    AngularVelocity,
    BodySpec,
    Coordinates,
    Name,
    OptionalPoint,
    Part,
    PointField,
    Radius,
    Velocity,
    default,
    default_kind,
)
from sandbox.scene.description.bodies import Box, Capsule, Compound, Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Course
from sandbox.scene.description.joints import Joint
from sandbox.scene.description.surface import Stroke

Amount = Annotated[float, Field(ge=-1e42, le=1e42)]
"""Component of an impulse or force; the bound is the greatest mass times the greatest speed."""

Level = Annotated[float, Field(ge=0, le=1)]
"""Fraction of a thrust, or level of a drive."""

SignedLevel = Annotated[float, Field(ge=-1, le=1)]
"""Throttle or steering of a tyre, or level of a motor."""

Value = float | int | bool | str | None
"""Value of a setting."""


SPAWNED = ("ball", "box", "capsule", "polygon", "body")
"""Table headings of the bodies that can be added to a running scene."""


class Timed(Part):
    """Base of all actions. An action is applied before the first step that starts at `time` or later."""

    time: Annotated[float, Field(ge=0, le=1e9)]
    """earliest simulated time at which it is applied, s"""

    def at(self, time: float) -> Self:
        """Return the action with another time, s."""
        if time == self.time:
            return self
        # As `model_copy` does, which takes five times as long.
        copied, set_value = object.__new__(type(self)), object.__setattr__
        set_value(copied, "__dict__", {**self.__dict__, "time": time})
        set_value(copied, "__pydantic_fields_set__", self.__pydantic_fields_set__ | {"time"})
        set_value(copied, "__pydantic_extra__", None)
        set_value(copied, "__pydantic_private__", None)
        return copied


class Impulse(Timed):
    """Apply an impulse to a body: v changes by impulse / mass, ω by angular / moment of inertia."""

    kind: Literal["impulse"] = default_kind("impulse")
    body: Name
    """name of the body"""
    impulse: Accepts[tuple[Amount, Amount], Sequence[float]]
    """linear impulse at the centre of mass, N·s"""
    angular: Amount = 0.0
    """angular impulse, N·m·s"""


class Explosion(Timed):
    """Push all bodies within a radius away from a point, the more the nearer their centres are.

    A body whose centre of mass has the distance d gets the impulse (1 − d/radius) · impulse along the line from the
    point. Walls do not shield it, and it does not turn bodies.
    """

    kind: Literal["explosion"] = default_kind("explosion")
    position: PointField
    """centre, m"""
    radius: Radius
    """distance from which on it has no effect, m"""
    impulse: Annotated[float, Field(ge=0, le=1e42)]
    """impulse on a body at the centre, N·s"""


class Force(Timed):
    """Apply a constant force and torque to a body.

    They replace those of an earlier `Force` on the body. Zero force and torque end it.
    """

    kind: Literal["force"] = default_kind("force")
    body: Name
    """name of the body"""
    force: Accepts[tuple[Amount, Amount], Sequence[float]]
    """force at the centre of mass, N"""
    torque: Amount = 0.0
    """torque, N·m"""


class Move(Timed):
    """Set the position of a body, and its angle, velocity and angular velocity if they are given.

    A fixed body can be moved but cannot have a velocity. A kinematic body keeps the velocities from then on. A body
    held by a drive cannot be moved.
    """

    kind: Literal["move"] = default_kind("move")
    body: Name
    """name of the body"""
    position: PointField
    """new position of the centre of mass, m"""
    angle: Angle | None = None
    """new angle, rad; default: unchanged"""
    velocity: Accepts[Velocity | None, Sequence[float] | None] = default(None)
    """new velocity, m/s; default: unchanged"""
    angular_velocity: AngularVelocity | None = None
    """new angular velocity, rad/s; default: unchanged"""


class Spawn(Timed):
    """Add a body, which gets the next body index.

    Exactly one of the shapes `ball`, `box`, `capsule`, `polygon` and `body` must be given. Its fields are the keys of
    that table in a scene file.
    """

    kind: Literal["spawn"] = default_kind("spawn")
    ball: Ball | None = None
    box: Box | None = None
    capsule: Capsule | None = None
    polygon: Polygon | None = None
    body: Compound | None = None

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(each is not None for each in self._shapes) != 1:
            raise ValueError(f"give exactly one of {', '.join(SPAWNED)}")
        return self

    @property
    def _shapes(self) -> tuple[BodySpec | None, ...]:
        return tuple(getattr(self, key) for key in SPAWNED)

    @property
    def single(self) -> BodySpec:
        """The body that is added."""
        return next(each for each in self._shapes if each is not None)

    def named(self, name: str) -> Self:
        """Return a copy of the action with a name for the body."""
        key = next(key for key in SPAWNED if getattr(self, key) is not None)
        return self.model_copy(update={key: self.single.model_copy(update={"name": name})})


class Remove(Timed):
    """Remove a body. It keeps its index and its last position, and its velocity becomes zero."""

    kind: Literal["remove"] = default_kind("remove")
    body: Name
    """name of the body"""


class SetParameter(Timed):
    """Change a parameter of the running scene.

    Parameters that can change are `world.gravity`, `world.wind`, `world.linear_drag`, `world.quadratic_drag`,
    `world.damping`, `surface.sliding_friction`, `surface.curl`, and every `restitution`, `friction`, `surface_speed`
    and `surface_velocity`, and `rate`, `max_torque` and `max_force` of the motors of the scene, also of those of its
    prismatic joints and wheels.
    """

    kind: Literal["set"] = default_kind("set")
    path: Name
    """path of the parameter, such as `world.gravity` or `ball.a.friction`"""
    value: float | int | bool | str | list[float] | None
    """new value, in the unit of the scene file"""


class Pull(Timed):
    """Pull a point of a body towards a target by a damped spring, as when dragging with the mouse.

    The pull lasts until another `Pull` of the same body; one without a target releases the body. The spring has a
    frequency of 7.5 Hz and is critically damped. Its force is at most 100 times the weight of the body, with g = 9.81
    m/s² in a scene without gravity. It is a soft constraint (E. Catto, "Soft Constraints", GDC 2011), stable at any dt.
    The grip is fixed in the frame of the body and turns with it.
    """

    kind: Literal["pull"] = default_kind("pull")
    body: Name
    """name of the body"""
    grip: PointField = default((0.0, 0.0))
    """point at which the body is pulled, in its own frame about the centre of mass, m"""
    target: OptionalPoint = default(None)
    """point that the grip is pulled to, m; default: release the body"""


class Launch(Timed):
    """Put the bodies of a generator back to their start, laid out with another seed.

    Bodies of the generator that were removed are added again, and finite lifetimes start again.
    """

    kind: Literal["launch"] = default_kind("launch")
    generator: Name
    """name of the generator"""
    seed: Annotated[int, Field(ge=0, lt=2**63)]
    """seed of the new layout"""


class Throttle(Timed):
    """Set the throttle of a thrust of the scene."""

    kind: Literal["throttle"] = default_kind("throttle")
    thrust: Name
    """name of the thrust"""
    level: Level
    """fraction of the force of the thrust"""


class Steer(Timed):
    """Set the throttle, brake and steering of a tyre of the scene. They act until the next such action."""

    kind: Literal["steer"] = default_kind("steer")
    tyre: Name
    """name of the tyre"""
    throttle: SignedLevel = 0.0
    """fraction of the force that drives it; negative values drive backwards"""
    brake: Level = 0.0
    """fraction of the force of its brake"""
    steer: SignedLevel = 0.0
    """fraction of its steering angle; negative values steer to the right"""


class Reshape(Timed):
    """Replace the points of a wall, for example to dig a crater into terrain or to raise it.

    Bodies that overlap the new wall are pushed out. Walls on a `[surface]` cannot be reshaped.
    """

    kind: Literal["reshape"] = default_kind("reshape")
    thing: Name
    """name of the wall"""
    points: Accepts[Course, Coordinates]
    """new corners of the wall, m"""


class Drive(Timed):
    """Set the level of a drive of the scene."""

    kind: Literal["drive"] = default_kind("drive")
    drive: Name
    """name of the drive"""
    level: Level
    """0 at rest; fraction of the torque of a flipper or of the pull of a plunger; any value above 0 is the full stroke
    of a stroke drive"""


class Actuate(Timed):
    """Set the levels of motors, also of those of prismatic joints and wheels.

    At a level a the motor aims at its rate, or at the opposite one if a is negative, with at most `|a|` times its
    largest torque or force; at 0 it is off. Motors start at level 1. A motor without a largest torque is off or
    unlimited.
    """

    kind: Literal["actuate"] = default_kind("actuate")
    levels: Annotated[dict[Name, SignedLevel], Field(min_length=1)]
    """level of each motor that changes, −1 to 1, by the name of its joint"""


class Toggle(Timed):
    """Switch collisions with a wall or post on or off, as for a drop target or a diverter.

    Walls and posts of a scene with a `[surface]` or pockets cannot be switched.
    """

    kind: Literal["toggle"] = default_kind("toggle")
    thing: Name
    """name of the wall or post"""
    solid: bool
    """whether bodies collide with it"""


class Join(Timed):
    """Add a joint, for example a grappling hook.

    Lengths and angles that the joint leaves out, its `at` and its `travel` are taken from the present positions. Its
    name must differ from those of the joints that are there. Contacts begin anew, as after a `Switch`.
    """

    kind: Literal["join"] = default_kind("join")
    joint: Joint
    """the joint; its fields are the keys of a `[[joint]]`"""


class Unjoin(Timed):
    """Remove a joint of the scene, of a generator or of an earlier `Join`, for example to cut a rope.

    It counts as broken. Contacts begin anew, as after a `Switch`.
    """

    kind: Literal["unjoin"] = default_kind("unjoin")
    joint: Name
    """name of the joint"""


class Strike(Timed, Stroke):
    """Strike a ball on a `[surface]` with a cue; its velocity and spin are replaced by those of the stroke.

    Pucks cannot be struck. A stroke that would miscue cannot be applied.
    """

    kind: Literal["strike"] = default_kind("strike")
    ball: Name
    """name of the ball"""


class Switch(Timed):
    """Continue from the present state with another engine or other settings."""

    kind: Literal["switch"] = default_kind("switch")
    engine: Name | None = None
    """name of the new engine; default: the same engine"""
    settings: dict[str, Value] = Field(default_factory=dict)
    """changes to `[solver]`"""
    resumes: bool = False
    """whether the same engine continues from a checkpoint; values that it derived from the initial positions of bodies
    are then kept"""


_AnyEvent: TypeAlias = (
    Impulse
    | Explosion
    | Force
    | Move
    | Spawn
    | Remove
    | SetParameter
    | Launch
    | Throttle
    | Steer
    | Drive
    | Actuate
    | Toggle
    | Reshape
    | Join
    | Unjoin
)
Event = Annotated[_AnyEvent, Field(discriminator="kind")]
"""Actions that a scene can make itself"""

Action = Annotated[_AnyEvent | Pull | Strike | Switch, Field(discriminator="kind")]


_SETTABLE = (
    "world.gravity",
    "world.wind",
    "world.linear_drag",
    "world.quadratic_drag",
    "world.damping",
    "surface.sliding_friction",
    "surface.curl",
)

_SETTABLE_OF_SURFACES = ("restitution", "friction", "surface_speed", "surface_velocity")

_SETTABLE_OF_MOTORS = ("rate", "max_torque", "max_force")

SETTABLE = (
    f"{', '.join(_SETTABLE)}, any {', '.join(_SETTABLE_OF_SURFACES)}, and {', '.join(_SETTABLE_OF_MOTORS)} of motors"
)
"""Parameters of a running scene that can be changed, as text for messages."""


def is_settable(path: str) -> bool:
    """Return whether a parameter of a running scene can be changed."""
    key = path.rpartition(".")[2]
    is_of_motor = path.startswith(("joint.", "joint[")) and key in _SETTABLE_OF_MOTORS
    return path in _SETTABLE or key in _SETTABLE_OF_SURFACES or is_of_motor
