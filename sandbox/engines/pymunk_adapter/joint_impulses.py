"""Joint impulses: impulses of springs and motors on their bodies in a substep."""

from typing import NamedTuple, Self, TypeAlias

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.springs import SpringExtent, anchors_in_world, relative
from sandbox.engines.pymunk_adapter.joints import SpaceJoints, elastic_force, rod_anchors
from sandbox.scene.compile.joint_arrays import MOTORS, JointArrays, JointKind


class JointImpulses(NamedTuple):
    """Impulses of K joints on their second bodies, and with opposite sign on their first."""

    a: IntArray
    """(K,) index of the first body; −1 is the world"""
    b: IntArray
    """(K,) index of the second"""
    arm_a: FloatArray
    """(K, 2) m, from the first body's centre to its anchor"""
    arm_b: FloatArray
    """(K, 2) likewise of the second"""
    impulse: FloatArray
    """(K, 2) N·s"""
    angular_impulse: FloatArray
    """(K,) N·m·s, angular impulse in addition to that of `impulse` at its arms"""

    def without(self, asleep: BoolArray) -> Self:
        """Return those without a body that is asleep, (N,): pymunk does not apply the others."""
        is_applied = ~np.append(asleep, False)  # the world is the last
        kept = is_applied[self.a] & is_applied[self.b]
        return type(self)(*(column[kept] for column in self))

    def separating_velocity(self, velocity: FloatArray, spin: FloatArray) -> FloatArray:
        """Return the velocities of the second anchors relative to the first, (K, 2) m/s.

        Args:
            velocity: (N + 1, 2) m/s, of all bodies and of the world, which is the last.
            spin: (N + 1,) rad/s.
        """
        anchors = (self.a, self.arm_a), (self.b, self.arm_b)
        first, second = (velocity[n] + spin[n, None] * _left(arm) for n, arm in anchors)
        return np.asarray(second - first)

    def work(self, velocity: FloatArray, spin: FloatArray) -> float:
        """Return their work, J, at mean velocities."""
        angular_work = self.angular_impulse @ (spin[self.b] - spin[self.a])
        return float(np.sum(self.impulse * self.separating_velocity(velocity, spin)) + angular_work)


JointPair: TypeAlias = tuple[JointImpulses, JointImpulses]


class ImpulseSums(NamedTuple):
    """Sums of some impulses on N bodies, and on the world as the last."""

    linear: FloatArray
    """(N + 1, 2) N·s"""
    angular: FloatArray
    """(N + 1,) N·m·s"""
    joined: IntArray
    """indices of bodies with joints"""

    def subtract(self, joint_impulses: JointImpulses) -> None:
        """Subtract the impulses of joints or contacts."""
        for n, arm, sign in (
            (joint_impulses.a, joint_impulses.arm_a, -1.0),
            (joint_impulses.b, joint_impulses.arm_b, 1.0),
        ):
            np.subtract.at(self.linear, n, sign * joint_impulses.impulse)
            np.subtract.at(
                self.angular, n, sign * (cross(arm, joint_impulses.impulse) + joint_impulses.angular_impulse)
            )

    def work(self, velocity: FloatArray, spin: FloatArray) -> float:
        """Return their work on bodies with joints, J, at mean velocities and spins."""
        n = self.joined
        return float(np.sum(self.linear[n] * velocity[n]) + self.angular[n] @ spin[n])


def springs(joints: SpaceJoints, position: FloatArray, angle: FloatArray, h: float) -> tuple[JointPair, JointPair]:
    """Return the impulses of springs and rotary springs by their stiffness, and by their dampers.

    Args:
        joints: the joints of the space.
        position: (N, 2) m, at the end of the substep, where pymunk evaluates springs.
        angle: (N,) rad.
        h: substep, s.
    """
    springs = joints.by_kind.springs
    extent = SpringExtent.of(springs, position, angle)
    direction, elastic = extent.direction, elastic_force(springs, extent.length) * h
    damper = joints.impulses(springs) - elastic
    no_torque = np.zeros(len(springs))
    spring_ends = springs.a, springs.b, extent.arm_a, extent.arm_b

    rotary = joints.by_kind.rotary
    rotary_elastic = elastic_force(rotary, relative(rotary, angle)) * h
    rotary_damper = joints.impulses(rotary) - rotary_elastic
    no_force = np.zeros((len(rotary), 2))
    rotary_ends = rotary.a, rotary.b, no_force, no_force, no_force
    stiffness = (
        JointImpulses(*spring_ends, direction * elastic[:, None], no_torque),
        JointImpulses(*rotary_ends, rotary_elastic),
    )
    dampers = (
        JointImpulses(*spring_ends, direction * damper[:, None], no_torque),
        JointImpulses(*rotary_ends, rotary_damper),
    )
    return stiffness, dampers


def motors(joints: SpaceJoints, position: FloatArray, angle: FloatArray, joint_sums: ImpulseSums) -> JointImpulses:
    """Return the impulses of motors.

    pymunk reports their magnitudes. Their signs follow from the sum of the impulses of all joints, by least squares.

    Args:
        joints: the joints of the space.
        position: (N, 2) m.
        angle: (N,) rad.
        joint_sums: sum of the impulses of all joints but springs.
    """
    rigid, motor_joints = joints.by_kind.rigid, joints.by_kind.motors
    a, b, no_force = motor_joints.a, motor_joints.b, np.zeros((len(motor_joints), 2))
    if not len(motor_joints):
        return JointImpulses(a, b, no_force, no_force, no_force, np.zeros(0))
    unknown = _least_squares(_unit_responses(rigid, position, angle), _stacked(joint_sums))
    first = np.cumsum(_component_counts(rigid)) - _component_counts(rigid)
    signs = np.sign(unknown[first[np.isin(rigid.kind, MOTORS)]])
    impulse, is_linear = signs * np.abs(joints.impulses(motor_joints)), motor_joints.kind == JointKind.LINEAR_MOTOR
    arm_a, point_a = anchors_in_world(a, rod_anchors(motor_joints), position, angle)
    arm_b, point_b = anchors_in_world(b, motor_joints.anchor_b, position, angle)
    along = point_b - point_a
    length = np.where(is_linear, np.hypot(*along.T), 1.0)
    linear = np.where(is_linear, impulse / length, 0.0)[:, None] * along
    return JointImpulses(a, b, arm_a, arm_b, linear, np.where(is_linear, 0.0, impulse))


def set_unknown_sums(
    joints: SpaceJoints, position: FloatArray, angle: FloatArray, joint_sums: ImpulseSums, known: BoolArray
) -> None:
    """Set the sums on bodies whose changes of momentum do not tell them, from those on the other bodies.

    They are those of the joint impulses that fit the known sums best, by least squares. With redundant joints the split
    between the joints is arbitrary.

    Args:
        joints: the joints of the space.
        position: (N, 2) m.
        angle: (N,) rad.
        joint_sums: sum of the impulses of all joints but springs.
        known: (N,) whether the sum on each body is known.
    """
    table, rows = _unit_responses(joints.by_kind.rigid, position, angle), np.repeat(known, 3)
    unknown = _least_squares(table[rows], _stacked(joint_sums)[rows])
    found = (table[~rows] @ unknown).reshape(-1, 3)
    others = np.flatnonzero(~known)
    joint_sums.linear[others], joint_sums.angular[others] = found[:, :2], found[:, 2]


def _least_squares(table: FloatArray, sums: FloatArray) -> FloatArray:
    """Return the impulses (U,) that fit sums (R,) best by a table (R, U); nan if a diverging state has overflowed."""
    if not (np.isfinite(table).all() and np.isfinite(sums).all()):
        return np.full(table.shape[1], np.nan)
    return np.asarray(np.linalg.lstsq(table, sums, rcond=None)[0], dtype=np.float64)


def _component_counts(joints: JointArrays) -> IntArray:
    """Return the number of components of the impulse of each joint, (K,)."""
    return np.where(np.isin(joints.kind, (JointKind.PIVOT, JointKind.GROOVE)), 2, 1)


def _stacked(joint_sums: ImpulseSums) -> FloatArray:
    return np.column_stack((joint_sums.linear, joint_sums.angular))[:-1].reshape(-1)


def _unit_responses(joints: JointArrays, position: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the effect of unit impulses of joints, (U,), on all bodies: (3N, U); x, y and angular for each body."""
    count = _component_counts(joints)
    column = np.cumsum(count) - count
    table = np.zeros((len(position) + 1, 3, int(count.sum())))
    arm_a, point_a = anchors_in_world(joints.a, rod_anchors(joints), position, angle)
    arm_b, point_b = anchors_in_world(joints.b, joints.anchor_b, position, angle)
    for k, kind in enumerate(joints.kind.tolist()):
        a, b, first_column = int(joints.a[k]), int(joints.b[k]), int(column[k])
        if kind in (JointKind.MOTOR, JointKind.ROTARY_LIMIT, JointKind.GEAR, JointKind.RATCHET):
            table[b, 2, first_column] += 1.0
            table[a, 2, first_column] -= 1.0 / joints.figures[k, 1] if kind == JointKind.GEAR else 1.0
            continue
        middle = position[a] if a >= 0 else np.zeros(2)
        first_arm = point_b[k] - middle if kind == JointKind.GROOVE else arm_a[k]
        directions = np.eye(2) if count[k] == 2 else (point_b - point_a)[k : k + 1]
        for component, direction in enumerate(directions):
            for body, arm, sign in ((a, first_arm, -1.0), (b, arm_b[k], 1.0)):
                table[body, :2, first_column + component] += sign * direction
                table[body, 2, first_column + component] += sign * float(cross(arm, direction))
    return table[:-1].reshape(-1, table.shape[2])


def cross(arm: FloatArray, impulse: FloatArray) -> FloatArray:
    """Return the angular impulses (…,) of impulses (…, 2) at arms (…, 2)."""
    return np.asarray(arm[..., 0] * impulse[..., 1] - arm[..., 1] * impulse[..., 0])


def _left(arm: FloatArray) -> FloatArray:
    return np.column_stack((-arm[:, 1], arm[:, 0]))
