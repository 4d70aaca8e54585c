"""States of a pymunk space in which a game's changes are seen: motion of bodies, and form of the space."""

import math
from collections.abc import Collection, Container, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Any, NamedTuple

import pymunk

from sandbox.pymunk_capture.joint_capture import joint_values, motor_values
from sandbox.pymunk_capture.space_capture import callbacks_remark, coefficients_of


class MotionState(NamedTuple):
    """Motion of a body."""

    position: tuple[float, float]
    """m"""
    velocity: tuple[float, float]
    """m/s"""
    angle: float
    """rad"""
    angular_velocity: float
    """rad/s"""

    @classmethod
    def of(cls, body: pymunk.Body) -> "MotionState":
        """Return the present motion of a body."""
        (x, y), (vx, vy) = body.position, body.velocity
        return cls((x, y), (vx, vy), body.angle, body.angular_velocity)

    @property
    def is_finite(self) -> bool:
        """Whether all values are finite; pymunk computes others for some bodies that turn static."""
        return math.isfinite(sum(self.position) + sum(self.velocity) + self.angle + self.angular_velocity)


@dataclass(frozen=True)
class SpaceForm:
    """What a game may change in a space, and a step does not change: all but motion, forces and gravity."""

    settings: tuple[float, ...]
    bodies: Mapping[pymunk.Body, tuple[Any, ...]]
    """type, mass, moment and functions of the bodies that are in the space"""
    shapes: Mapping[pymunk.Shape, tuple[Any, ...]]
    """body, filter and kind of each shape"""
    coefficients: Mapping[pymunk.Shape, dict[str, Any]]
    """as `coefficients_of` each shape"""
    joints: Mapping[pymunk.Constraint, tuple[Any, ...]]
    """values of each joint, without those of motors and the angles of ratchets, and whether its bodies collide"""
    motors: Mapping[pymunk.SimpleMotor, dict[str, Any]]
    """values of motors, as keys of their tables"""

    @classmethod
    def of(cls, space: pymunk.Space, bodies: Collection[pymunk.Body]) -> "SpaceForm":
        """Return the form of a space; of its bodies only some."""
        return cls(
            (
                space.iterations,
                space.collision_slop,
                space.collision_bias,
                space.collision_persistence,
                space.sleep_time_threshold,
                space.idle_speed_threshold,
                len(getattr(space, "_handlers", ())),
            ),
            {
                body: (body.body_type, body.mass, body.moment, body._velocity_func, body._position_func)
                for body in bodies
                if body.space is space
            },
            {each: (each.body, each.filter, each.sensor) for each in space.shapes},
            {each: coefficients_of(each) for each in space.shapes},
            {joint: _joint_form(joint, space.collision_bias) for joint in space.constraints},
            {joint: motor_values(joint) for joint in space.constraints if isinstance(joint, pymunk.SimpleMotor)},
        )

    def changes_since(
        self,
        before: "SpaceForm",
        explained: Set[pymunk.Body],
        names: Mapping[pymunk.Body, str],
        joints: Container[pymunk.Constraint],
    ) -> Iterator[str]:
        """Yield what has changed since an earlier form.

        Args:
            before: the earlier form.
            explained: bodies that were added or removed by actions, with their shapes.
            names: names of bodies.
            joints: the joints of the scene.
        """
        if self.settings != before.settings:
            yield "settings and callbacks of the space that the game changes"
        if self.settings[-1] > before.settings[-1]:
            yield callbacks_remark(int(self.settings[-1]))
        if self.bodies != before.bodies:
            yield from self._changes_of_bodies(before, names)
        if self.shapes != before.shapes:
            yield from self._changes_of_shapes(before, explained)
        if self.joints == before.joints:
            return
        yield from _joints("adds", [joint for joint in self.joints if joint not in before.joints])
        # A body that is removed takes its joints along.
        gone = [joint for joint in before.joints if joint not in self.joints and joint in joints]
        yield from _joints("removes", [joint for joint in gone if not {joint.a, joint.b} & explained])
        if any(self.joints[joint] != before.joints[joint] for joint in self.joints.keys() & before.joints.keys()):
            yield f"joints that the game changes, other than the rate and the largest torque of motors; {MOVED}"

    def _changes_of_bodies(self, before: "SpaceForm", names: Mapping[pymunk.Body, str]) -> Iterator[str]:
        both = [body for body in self.bodies if body in before.bodies]
        for body in both:
            was, now = (form.bodies[body][0] for form in (before, self))
            if was != now:
                change = f"which the game changes from {TYPES[was]} to {TYPES[now]}"
                yield f"the type of {names[body]}, {change}; {SET_MOTION}"
        if any(_differ(self.bodies[body], before.bodies[body]) for body in both):
            yield "masses, moments and functions of bodies that the game changes"

    def _changes_of_shapes(self, before: "SpaceForm", explained: Set[pymunk.Body]) -> Iterator[str]:
        exchanged = {*self.shapes.items()} ^ {*before.shapes.items()}
        if any(shape in self.shapes and shape in before.shapes for shape, _ in exchanged):
            yield "filters of shapes that the game changes"
        single = [values for shape, values in exchanged if (shape in self.shapes) != (shape in before.shapes)]
        if any(values[0] not in explained and not values[2] for values in single):
            yield "shapes that the game adds to bodies or removes from them"
        if any(values[2] for values in single):
            yield "sensor shapes that the game adds or removes"


TYPES = {pymunk.Body.DYNAMIC: "dynamic", pymunk.Body.KINEMATIC: "kinematic", pymunk.Body.STATIC: "static"}


SET_MOTION = "the recording sets its motion after each step"
"""Effect of a type that differs from that in the scene."""
MOVED = "the recording sets the motion of their bodies after each step"
"""Effect of joints that differ from those of the scene."""


def _differ(now: tuple[Any, ...], before: tuple[Any, ...]) -> bool:
    """Return whether mass, moment or functions of a body differ; those of a body whose type changes follow from it."""
    return now[0] == before[0] and now[1:] != before[1:]


def _joint_form(joint: pymunk.Constraint, default_bias: float) -> tuple[Any, ...]:
    """Return the values of a joint that a step does not change, and whether its bodies collide."""
    values = None if isinstance(joint, pymunk.SimpleMotor) else joint_values(joint, default_bias)
    if values is not None and isinstance(joint, pymunk.RatchetJoint):
        del values["angle"]
    return values, joint.collide_bodies


def _joints(verb: str, joints: Sequence[pymunk.Constraint]) -> Iterator[str]:
    kinds = dict.fromkeys(type(joint).__name__ for joint in joints)
    if kinds:
        yield f"joints that the game {verb} while it runs: {', '.join(kinds)}; {MOVED}"
