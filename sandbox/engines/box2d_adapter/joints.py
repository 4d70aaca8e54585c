"""Joints in a Box2D world, their breaking, and the forces of springs.

Motors and rotary limits are part of the pivot between their two bodies. Welds, prismatic joints and wheels are Box2D's
own. Springs, also those of wheels, are forces, constant during a substep.
"""

import math
from typing import Any

import numpy as np
import pyb2d3 as box2d

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.box2d_adapter.requirements import MERGED
from sandbox.engines.box2d_adapter.world import Box2DWorld
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.springs import SpringExtent, rotary_torques, spring_tensions
from sandbox.scene.compile.joint_arrays import MOTORS, WORLD, JointArrays, JointKind

SPRINGS = JointKind.SPRING, JointKind.ROTARY_SPRING

UNLIMITED_TORQUE = 1e30
"""N·m or N in Box2D's units, practically unlimited"""


class WorldJoints:
    """Joints of a scene in a world."""

    def __init__(self, world: Box2DWorld, store: BodyStore) -> None:
        self._world, self._store = world, store
        self._joints: dict[int, Any] = {}  # by the index of the joint
        joints = store.all_joints
        for k in store.intact_joints().tolist():
            kind = JointKind(int(joints.kind[k]))
            if joints.part_of[k] != joints.number[k]:
                continue
            if kind not in MERGED and (kind not in SPRINGS or (joints.a[k] != WORLD and not joints.collide[k])):
                self._joints[k] = world.create_joint(self._definition(joints, k))
        self.has_springs = bool(np.isin(joints.kind, SPRINGS).any())
        self.has_linear_motors = bool((joints.kind == JointKind.LINEAR_MOTOR).any())
        self.has_breakable = bool(np.isfinite(joints.strength).any())
        """whether joints can break"""

    def _definition(self, joints: JointArrays, k: int) -> Any:
        """Return the definition of a joint that is not part of a pivot.

        Springs are forces: theirs only excludes contacts of the two bodies.
        """
        x, y, _ = joints.figures[k].tolist()
        scale = self._world.scale
        a, b = int(joints.a[k]), int(joints.b[k])
        match JointKind(int(joints.kind[k])):
            case JointKind.SPRING | JointKind.ROTARY_SPRING:
                joint = box2d.FilterJointDef()
                joint.body_a, joint.body_b = self._world.body(a), self._world.body(b)
                return joint
            case JointKind.ROD:
                joint = box2d.DistanceJointDef()
                joint.length = x * scale
            case JointKind.SLIDE:
                joint = box2d.DistanceJointDef()
                joint.length = y * scale
                joint.enable_spring, joint.hertz = True, 0.0  # no spring, and not rigid: only the limits act
                joint.enable_limit, joint.min_length, joint.max_length = True, x * scale, y * scale
            case JointKind.GROOVE:
                joint = self._along_axis(joints, k)
            case JointKind.PIVOT if joints.is_compound[k]:
                joint = box2d.WeldJointDef()
                joint.reference_angle = math.remainder(float(joints.figures[self._parts(joints, k)[0], 0]), math.tau)
            case _:
                joint = self._pivot(joints, k)
        joint.body_a, joint.body_b = self._world.body(a), self._world.body(b)
        joint.local_anchor_a = tuple((joints.anchor_a[k] * scale).tolist())
        joint.local_anchor_b = tuple((joints.anchor_b[k] * scale).tolist())
        joint.collide_connected = bool(joints.collide[k])
        return joint

    def _parts(self, joints: JointArrays, k: int) -> list[int]:
        """Return the further rows of the joint whose first row is k."""
        return [int(row) for row in joints.whole(np.asarray([k]))[1:]]

    def _along_axis(self, joints: JointArrays, k: int) -> Any:
        """Return the definition of a groove, a prismatic joint or a wheel, whose first row is k."""
        scale, kinds = self._world.scale, {int(joints.kind[part]): part for part in self._parts(joints, k)}
        along = joints.figures[k, :2] - joints.anchor_a[k]
        length = float(np.hypot(*along))
        if JointKind.GEAR in kinds:
            joint = box2d.PrismaticJointDef()
            joint.reference_angle = math.remainder(float(joints.figures[kinds[JointKind.GEAR], 0]), math.tau)
        else:
            joint = box2d.WheelJointDef()
        if JointKind.LINEAR_MOTOR in kinds:
            motor = kinds[JointKind.LINEAR_MOTOR]
            joint.enable_motor, joint.motor_speed = True, float(joints.figures[motor, 2]) * scale
            joint.max_motor_force = min(float(joints.max_force[motor]) * scale, UNLIMITED_TORQUE)
        if JointKind.MOTOR in kinds:
            motor = kinds[JointKind.MOTOR]
            joint.enable_motor, joint.motor_speed = True, float(joints.figures[motor, 0])
            joint.max_motor_torque = min(float(joints.max_force[motor]) * scale**2, UNLIMITED_TORQUE)
        joint.local_axis_a = tuple((along / length).tolist())
        joint.enable_spring = False
        joint.enable_limit, joint.lower_translation, joint.upper_translation = True, 0.0, length * scale
        return joint

    def _pivot(self, joints: JointArrays, k: int) -> Any:
        """Return the definition of a pivot, with the motor and the rotary limit of its two bodies."""
        joint, scale = box2d.RevoluteJointDef(), self._world.scale
        intact = np.isin(np.arange(len(joints)), self._store.intact_joints())
        between = (joints.a == joints.a[k]) & (joints.b == joints.b[k]) & intact & ~joints.is_compound
        for other in np.flatnonzero(between).tolist():
            low, high, _ = joints.figures[other].tolist()
            if joints.kind[other] == JointKind.MOTOR:
                joint.enable_motor, joint.motor_speed = True, low
                joint.max_motor_torque = min(float(joints.max_force[other]) * scale**2, UNLIMITED_TORQUE)
            elif joints.kind[other] == JointKind.ROTARY_LIMIT:
                joint.reference_angle = math.remainder(0.5 * (low + high), math.tau)
                joint.enable_limit, joint.lower_angle, joint.upper_angle = True, 0.5 * (low - high), 0.5 * (high - low)
        return joint

    def remove(self, broken: IntArray) -> None:
        """Remove joints, by their indices; those of a body that was removed are gone already."""
        for k in broken.tolist():
            joint = self._joints.pop(k, None)
            if joint is not None:
                joint.destroy()

    def renew(self, replaced: set[int]) -> None:
        """Create the joints of bodies, by their indices, that were replaced and have lost them."""
        joints = self._store.all_joints
        for k in self._joints:
            if not replaced.isdisjoint((int(joints.a[k]), int(joints.b[k]))):
                self._joints[k] = self._world.create_joint(self._definition(joints, k))

    def update_motors(self, before: JointArrays) -> None:
        """Set the values of motors that differ from those of the joints before an action."""
        joints = self._store.all_joints
        if joints is before:
            return
        changed = (joints.figures != before.figures).any(axis=1) | (joints.max_force != before.max_force)
        for motor in np.flatnonzero(changed & np.isin(joints.kind, MOTORS)).tolist():
            if joints.is_compound[motor]:
                holders = joints.number == joints.part_of[motor]
            else:
                holders = (joints.a == joints.a[motor]) & (joints.b == joints.b[motor])
                holders &= (joints.kind == JointKind.PIVOT) & ~joints.is_compound
            for k in np.flatnonzero(holders).tolist():
                if k in self._joints:
                    definition, joint = self._definition(joints, k), self._joints[k]
                    limit = "max_motor_force" if joints.kind[motor] == JointKind.LINEAR_MOTOR else "max_motor_torque"
                    joint.motor_speed = definition.motor_speed
                    setattr(joint, limit, getattr(definition, limit))
                    joint.wake_bodies()

    def limit_linear_motors(self, length: float) -> None:
        """Set the speeds of motors along axes so that a step of a length, s, does not pass the end of the travel."""
        joints = self._store.all_joints
        for motor in np.flatnonzero(joints.kind == JointKind.LINEAR_MOTOR).tolist():
            joint = self._joints.get(int(np.flatnonzero(joints.number == joints.part_of[motor])[0]))
            if joint is not None:
                before, after = joint.lower_limit - joint.translation, joint.upper_limit - joint.translation
                speed = float(joints.figures[motor, 2]) * self._world.scale
                joint.motor_speed = min(max(speed, before / length), after / length)

    def forget(self) -> None:
        """Forget joints whose bodies were removed with them."""
        intact = set(self._store.intact_joints().tolist())
        self._joints = {k: joint for k, joint in self._joints.items() if k in intact}

    def add_spring_forces(self, force: FloatArray, torque: FloatArray) -> None:
        """Add the forces (N, 2), N, and torques (N,), N·m, of springs and their dampers in the present state."""
        store = self._store
        springs, rotary = store.joints.of(JointKind.SPRING), store.joints.of(JointKind.ROTARY_SPRING)
        if len(springs):
            extent = SpringExtent.of(springs, store.position, store.angle)
            pull = extent.direction * self._tensions(springs, extent)[:, None]
            for index, arm, sign in ((springs.b, extent.arm_b, 1.0), (springs.a, extent.arm_a, -1.0)):
                free = index >= 0
                np.add.at(force, index[free], sign * pull[free])
                moment = arm[:, 0] * pull[:, 1] - arm[:, 1] * pull[:, 0]
                np.add.at(torque, index[free], sign * moment[free])
        if len(rotary):
            moment = rotary_torques(rotary, store.angle, store.angular_velocity)
            free = rotary.a >= 0
            np.add.at(torque, rotary.b, moment)
            np.add.at(torque, rotary.a[free], -moment[free])

    def _tensions(self, springs: JointArrays, extent: SpringExtent) -> FloatArray:
        """Return the present forces of springs, (K,) N."""
        return spring_tensions(springs, extent, self._store.velocity, self._store.angular_velocity)

    def overloaded(self) -> IntArray:
        """Return the indices of joints whose force exceeds their strength; of rigid ones, that of the last substep."""
        joints, found = self._store.all_joints, []
        for k, joint in self._joints.items():
            if math.isfinite(joints.strength[k]):
                force = joint.get_constraint_force()
                if math.hypot(force.x, force.y) > joints.strength[k] * self._world.scale:
                    found.append(k)
        for k in np.flatnonzero(np.isfinite(joints.strength) & (joints.part_of != joints.number)).tolist():
            weld = self._joints.get(int(np.flatnonzero(joints.number == joints.part_of[k])[0]))
            if weld is not None and abs(weld.get_constraint_torque()) > joints.strength[k] * self._world.scale**2:
                found.append(k)
        store = self._store
        springs, rotary = store.joints.of(JointKind.SPRING), store.joints.of(JointKind.ROTARY_SPRING)
        if len(springs):
            tensions = self._tensions(springs, SpringExtent.of(springs, store.position, store.angle))
            found += springs.number[np.abs(tensions) > springs.strength].tolist()
        if len(rotary):
            torques = rotary_torques(rotary, store.angle, store.angular_velocity)
            found += rotary.number[np.abs(torques) > rotary.strength].tolist()
        return joints.whole(np.asarray(found, np.int64)) if found else np.empty(0, np.int64)
