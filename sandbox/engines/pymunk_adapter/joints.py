"""Joints as pymunk constraints, their breaking, and the forces of springs."""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
import pymunk

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.springs import SpringExtent, of_bands, rotary_torques, spring_law, spring_tensions
from sandbox.scene.compile.joint_arrays import MOTORS, WORLD, JointArrays, JointKind

_AnyConstraint = TypeVar("_AnyConstraint", bound=pymunk.Constraint)


def constraint_of(joints: JointArrays, k: int, a: pymunk.Body, b: pymunk.Body, bias: float) -> pymunk.Constraint:
    """Create the constraint of joint k between two bodies of a space.

    Args:
        joints: of the scene.
        k: index of the joint.
        a: first body; the space's static body if that is the world.
        b: second body.
        bias: fraction of the error that remains after one second, of joints without their own.
    """
    return _with_limits(_new_constraint(joints, k, a, b), joints, k, bias)


def _with_limits(constraint: _AnyConstraint, joints: JointArrays, k: int, bias: float) -> _AnyConstraint:
    """Set the limits of joint k, and whether its bodies collide; return the constraint."""
    constraint.collide_bodies = bool(joints.collide[k])
    constraint.max_force = float(joints.max_force[k])
    if joints.kind[k] == JointKind.LINEAR_MOTOR:
        constraint.error_bias = 0.0  # corrected in one step, if its speed allows that
    else:
        constraint.error_bias = bias if math.isnan(joints.bias[k]) else float(joints.bias[k])
        constraint.max_bias = float(joints.max_bias[k])
    return constraint


def _new_constraint(joints: JointArrays, k: int, a: pymunk.Body, b: pymunk.Body) -> pymunk.Constraint:
    x, y, z = joints.figures[k].tolist()
    anchor_a, anchor_b = tuple(joints.anchor_a[k].tolist()), tuple(joints.anchor_b[k].tolist())
    match JointKind(int(joints.kind[k])):
        case JointKind.ROD:
            rod = pymunk.PinJoint(a, b, anchor_a, anchor_b)
            rod.distance = x
            return rod
        case JointKind.PIVOT:
            return pymunk.PivotJoint(a, b, anchor_a, anchor_b)
        case JointKind.SLIDE:
            return pymunk.SlideJoint(a, b, anchor_a, anchor_b, x, y)
        case JointKind.GROOVE if joints.is_compound[k]:
            return _across_axis(a, b, joints, k)
        case JointKind.GROOVE:
            return pymunk.GrooveJoint(a, b, anchor_a, (x, y), anchor_b)
        case JointKind.ROTARY_LIMIT:
            return pymunk.RotaryLimitJoint(a, b, x, y)
        case JointKind.MOTOR:
            return pymunk.SimpleMotor(a, b, -x)  # pymunk: rate of the first body relative to the second
        case JointKind.GEAR:
            return pymunk.GearJoint(a, b, x, y)
        case JointKind.SPRING:
            if joints.pulls_only[k]:
                band = pymunk.DampedSpring(a, b, anchor_a, anchor_b, x, y, 0.0)
                band.force_func = _pull(x, y, z)
                return band
            return pymunk.DampedSpring(a, b, anchor_a, anchor_b, x, y, z)
        case JointKind.ROTARY_SPRING:
            return pymunk.DampedRotarySpring(a, b, -x, y, z)  # pymunk: angle of the first body relative to the second
        case JointKind.RATCHET:
            ratchet = pymunk.RatchetJoint(a, b, y, z)
            ratchet.angle = x
            return ratchet
        case JointKind.LINEAR_MOTOR:
            return _linear_motor(a, b, joints, k)
        case kind:
            raise ValueError(f"pymunk has no {kind.name.lower()} joints")


def _pull(rest: float, stiffness: float, damping: float) -> Callable[[pymunk.DampedSpring, float], float]:
    """Return the force, N, of a spring that only pulls, at its length, m, and the velocities before the step.

    The damper is part of it: pymunk's own would push.
    """

    def force(spring: pymunk.DampedSpring, length: float) -> float:
        if length <= rest:
            return 0.0
        rate = 0.0
        if damping:
            first, second = spring.a.local_to_world(spring.anchor_a), spring.b.local_to_world(spring.anchor_b)
            velocity = spring.b.velocity_at_world_point(second) - spring.a.velocity_at_world_point(first)
            rate = velocity.dot(second - first) / length
        return min(spring_law(rest, stiffness, damping, length, rate), 0.0)

    return force


FAR_ANCHOR = 1e5
"""Distance of an anchor from an axis, as a fraction of its length: a point at an end of the axis is 1e-6 of it off"""


def _across_axis(a: pymunk.Body, b: pymunk.Body, joints: JointArrays, k: int) -> pymunk.PinJoint:
    """Return the constraint of a wheel or prismatic joint across its axis: a long rod at a right angle to it.

    `pymunk.GrooveJoint` projects the impulse of a pivot onto the normal. Where the axis does not pass through the
    centre of mass, that is not the impulse that stops the motion across the axis, in any number of iterations.
    """
    anchor, distance = anchor_across_axis(joints, k)
    rod = pymunk.PinJoint(a, b, anchor, tuple(joints.anchor_b[k].tolist()))
    rod.distance = distance
    return rod


def anchor_across_axis(joints: JointArrays, k: int) -> tuple[tuple[float, float], float]:
    """Return the far anchor of the rod of `_across_axis` in the first body's frame, m, and its length, m."""
    (x, y), along = joints.anchor_a[k].tolist(), joints.figures[k, :2] - joints.anchor_a[k]
    dx, dy = along.tolist()
    return (x + 0.5 * dx - FAR_ANCHOR * dy, y + 0.5 * dy + FAR_ANCHOR * dx), FAR_ANCHOR * math.hypot(dx, dy)


def _axis_ends(a: pymunk.Body, b: pymunk.Body, joints: JointArrays, k: int) -> pymunk.SlideJoint:
    """Return the constraint of a wheel or prismatic joint at the ends of its travel."""
    before, length = 2.0 * joints.anchor_a[k] - joints.figures[k, :2], axis_length(joints, k)
    return pymunk.SlideJoint(a, b, tuple(before.tolist()), tuple(joints.anchor_b[k].tolist()), length, 2.0 * length)


def axis_length(joints: JointArrays, k: int) -> float:
    """Return the length of the axis of joint k, m."""
    return math.hypot(*(joints.figures[k, :2] - joints.anchor_a[k]).tolist())


def _linear_motor(a: pymunk.Body, b: pymunk.Body, joints: JointArrays, k: int) -> pymunk.PinJoint:
    """Return a motor along an axis, which pymunk lacks: a rod that corrects its length at a constant speed.

    Its first anchor is on the axis, before the near end, so that the rod has the direction of the axis. Its length is
    that at the end of the travel towards which the motor moves.
    """
    rod = pymunk.PinJoint(a, b, tuple(rod_anchors(joints)[k].tolist()), tuple(joints.anchor_b[k].tolist()))
    _set_speed(rod, joints, k)
    return rod


def rod_anchors(joints: JointArrays) -> FloatArray:
    """Return the first anchors of joints in pymunk, (J, 2) m: before the near end of the axis of a linear motor."""
    is_linear = (joints.kind == JointKind.LINEAR_MOTOR)[:, None]
    return np.where(is_linear, 2.0 * joints.anchor_a - joints.figures[:, :2], joints.anchor_a)


def _set_speed(rod: pymunk.PinJoint, joints: JointArrays, k: int) -> None:
    speed, travel = float(joints.figures[k, 2]), axis_length(joints, k)
    rod.distance = travel if speed < 0.0 else 2.0 * travel
    rod.max_bias = abs(speed)


def spring_forces(joints: JointArrays, position: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the forces (N, 2), N, of springs on bodies, without their dampers.

    Args:
        joints: K springs.
        position: (N, 2) m.
        angle: (N,) rad.
    """
    _, _, displacement, length = SpringExtent.of(joints, position, angle)
    per_length = np.divide(elastic_force(joints, length), length, out=np.zeros_like(length), where=length > 0.0)
    force = displacement * per_length[:, None]
    total = np.zeros((len(position) + 1, 2))  # the last row is the world, −1
    np.add.at(total, joints.b, force)
    np.subtract.at(total, joints.a, force)
    return total[:-1]


def elastic_force(joints: JointArrays, extent: FloatArray) -> FloatArray:
    """Return the force of springs without dampers, at lengths (K,), m, or angles of rotary springs (K,), rad.

    pymunk limits it to `max_force`, and then its sum with the force of the damper.
    """
    rest, stiffness, damping = joints.figures.T
    force = of_bands(joints, extent, spring_law(rest, stiffness, damping, extent, np.zeros_like(extent)))
    return np.asarray(np.clip(force, -joints.max_force, joints.max_force))


def _limited(joints: JointArrays, force: FloatArray) -> FloatArray:
    """Return the magnitudes of forces or torques (K,), which pymunk limits."""
    return np.asarray(np.minimum(np.abs(force), joints.max_force))


class JointsByKind(NamedTuple):
    """Joints by kind."""

    springs: JointArrays
    rotary: JointArrays
    """rotary springs"""
    rigid: JointArrays
    """all but springs and rotary springs"""
    motors: JointArrays
    """motors of both kinds among the rigid joints"""

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return len(self.springs) + len(self.rotary) + len(self.rigid) > 0


class SpaceJoints:
    """Constraints in a space, by the indices of their joints."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._joints: JointArrays | None = None
        self._constraints: dict[int, pymunk.Constraint] = {}
        self._ends: dict[int, pymunk.SlideJoint] = {}  # of the axes of wheels and prismatic joints
        self._by_kind: JointsByKind | None = None
        self.count = 0
        """number of constraints"""
        self._rebuild(JointArrays.none())

    def add(self, joints: JointArrays, body: Callable[[int], pymunk.Body], bias: float) -> None:
        """Add the joints of a scene, once.

        Args:
            joints: of the scene; all their bodies are in the space.
            body: returns a body by its index.
            bias: fraction of the error that remains after one second, of joints without their own.
        """
        if self._joints is not None:
            return
        self._joints = joints
        for k, (a, b) in enumerate(zip(joints.a.tolist(), joints.b.tolist(), strict=True)):
            first = self._space.static_body if a == WORLD else body(a)
            constraint = constraint_of(joints, k, first, body(b), bias)
            self._space.add(constraint)
            self._constraints[k] = constraint
            if joints.kind[k] == JointKind.GROOVE and joints.is_compound[k]:
                self._ends[k] = _with_limits(_axis_ends(first, body(b), joints, k), joints, k, bias)
                self._space.add(self._ends[k])
        self._rebuild(joints.counted())

    def update(self, joints: JointArrays) -> None:
        """Set the values of motors to those of the scene's joints, of which only these differ from before."""
        before = self._joints
        if before is None or joints is before:
            return
        self._joints = joints
        changed = (joints.figures != before.figures).any(axis=1) | (joints.max_force != before.max_force)
        for k in np.flatnonzero(changed).tolist():  # only of these, as to set values wakes bodies
            constraint = self._constraints.get(k)
            if isinstance(constraint, pymunk.SimpleMotor):
                constraint.rate = -float(joints.figures[k, 0])
            elif isinstance(constraint, pymunk.PinJoint):
                _set_speed(constraint, joints, k)
            else:
                continue
            constraint.max_force = float(joints.max_force[k])
        self._by_kind = None

    def remove(self, index: int) -> None:
        """Remove the joints of a body that leaves."""
        if self._joints is None:
            return
        attached = np.flatnonzero((self._joints.a == index) | (self._joints.b == index))
        self._remove([k for k in attached.tolist() if k in self._constraints])

    def break_overloaded(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray, h: float
    ) -> IntArray:
        """Remove joints whose load exceeded their strength in the last substep; return their indices.

        pymunk returns the impulse of one constraint at a time, 1 µs each. The force of springs is computed for all at
        once, from the state at the end of the substep; it differs from pymunk's by rounding and a part of the damper's
        force.

        Args:
            position: (N, 2) m, of all bodies.
            velocity: (N, 2) m/s.
            angle: (N,) rad.
            spin: (N,) rad/s.
            h: substep, s.
        """
        rigid, springs, rotary = self._breakable_joints, self._breakable_springs, self._breakable_rotary
        force = np.asarray([self._impulse(k) for k in rigid.number.tolist()]) / h
        broken = [rigid.number[force > rigid.strength]]
        if len(springs):
            tensions = spring_tensions(springs, SpringExtent.of(springs, position, angle), velocity, spin)
            broken.append(springs.number[_limited(springs, tensions) > springs.strength])
        if len(rotary):
            torques = rotary_torques(rotary, angle, spin)
            broken.append(rotary.number[_limited(rotary, torques) > rotary.strength])
        indices = np.sort(np.concatenate(broken))
        if len(indices):
            assert self._joints is not None
            indices = np.intersect1d(self._joints.whole(indices), list(self._constraints))
            self._remove(indices.tolist())
        return indices

    @property
    def by_kind(self) -> "JointsByKind":
        """The present joints by kind."""
        if self._by_kind is None:
            springs, rotary = JointKind.SPRING, JointKind.ROTARY_SPRING
            present = self._of_constraints()
            rigid = present.some(~np.isin(present.kind, (springs, rotary)))
            self._by_kind = JointsByKind(present.of(springs), present.of(rotary), rigid, rigid.of(*MOTORS))
        return self._by_kind

    def impulses(self, joints: JointArrays) -> FloatArray:
        """Return pymunk's impulse of each of some joints in the last substep, (K,) N·s or N·m·s.

        For joints it is the magnitude; for springs it is signed, positive if it pushes the bodies apart.
        """
        return np.asarray([self._constraints[k].impulse for k in joints.number.tolist()], dtype=np.float64)

    def _impulse(self, k: int) -> float:
        """Return the magnitude of the impulse of joint k, N·s or N·m·s."""
        ends = self._ends.get(k)
        return self._constraints[k].impulse if ends is None else math.hypot(self._constraints[k].impulse, ends.impulse)

    def _remove(self, indices: list[int]) -> None:
        if not indices:
            return
        for k in indices:
            self._space.remove(self._constraints.pop(k))
            if k in self._ends:
                self._space.remove(self._ends.pop(k))
        self._rebuild(self._of_constraints())

    def _of_constraints(self) -> JointArrays:
        """Return the joints that have a constraint."""
        if self._joints is None:
            return JointArrays.none()
        return self._joints.counted().some(np.asarray(sorted(self._constraints), dtype=np.int64))

    def _rebuild(self, joints: JointArrays) -> None:
        """Update the lists of present joints, and of those that can break."""
        self.count = len(self._constraints)
        self._by_kind = None
        breakable = joints.some(np.isfinite(joints.strength))
        kinds = JointKind.SPRING, JointKind.ROTARY_SPRING
        self._breakable_springs, self._breakable_rotary = breakable.of(kinds[0]), breakable.of(kinds[1])
        self._breakable_joints = breakable.some(~np.isin(breakable.kind, kinds)) if len(breakable) else breakable
        self.has_breakable = len(breakable) > 0
        """whether a present joint can break"""
