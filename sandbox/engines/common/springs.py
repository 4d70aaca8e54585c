"""Springs and rotary springs with dampers: their law, and their forces in a state of the bodies."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.geometry.vectors import Component, rotate


def spring_law(
    rest: Component, stiffness: Component, damping: Component, extent: Component, rate: Component
) -> Component:
    """Return the force of a spring, N, or the torque of a rotary spring, N·m; positive if it increases the extent.

    Args:
        rest: rest length, m, or rest angle, rad.
        stiffness: N/m or N·m/rad.
        damping: N·s/m or N·m·s/rad.
        extent: length, m, or angle of the second body relative to the first, rad.
        rate: of the extent, m/s or rad/s.
    """
    return stiffness * (rest - extent) - damping * rate


def anchors_in_world(
    index: IntArray, anchor: FloatArray, position: FloatArray, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the anchors of joints on one of their bodies, (K, 2) m: relative to the body's centre, and in the world.

    Args:
        index: (K,) index of the body; −1 for the world.
        anchor: (K, 2) m, in the frame of the body; of the world, a position.
        position: (N, 2) m, of all bodies.
        angle: (N,) rad.
    """
    arm, point = np.zeros_like(anchor), position[index]
    has_arm, is_world = anchor.any(axis=1) & (index >= 0), index < 0
    if has_arm.any():  # most anchors are at the centre
        body = index[has_arm]
        x, y = anchor[has_arm].T
        arm[has_arm] = np.column_stack(rotate(x, y, np.cos(angle[body]), np.sin(angle[body])))
        point[has_arm] += arm[has_arm]
    point[is_world] = anchor[is_world]
    return arm, point


class SpringExtent(NamedTuple):
    """K springs in a state of the bodies."""

    arm_a: FloatArray
    """(K, 2) m, from the centre of the first body to its anchor; 0 for the world"""
    arm_b: FloatArray
    """(K, 2) likewise of the second body"""
    displacement: FloatArray
    """(K, 2) m, from the first anchor to the second"""
    length: FloatArray
    """(K,) m"""

    @property
    def direction(self) -> FloatArray:
        """Unit vectors from the first anchor to the second, (K, 2); 0 where both coincide."""
        return np.asarray(self.displacement / np.where(self.length > 0.0, self.length, 1.0)[:, None])

    @classmethod
    def of(cls, springs: JointArrays, position: FloatArray, angle: FloatArray) -> "SpringExtent":
        """Return the extent of springs with the bodies at positions (N, 2), m, and angles (N,), rad."""
        arm_a, point_a = anchors_in_world(springs.a, springs.anchor_a, position, angle)
        arm_b, point_b = anchors_in_world(springs.b, springs.anchor_b, position, angle)
        displacement = point_b - point_a
        return cls(arm_a, arm_b, displacement, np.hypot(displacement[:, 0], displacement[:, 1]))


def spring_tensions(springs: JointArrays, extent: SpringExtent, velocity: FloatArray, spin: FloatArray) -> FloatArray:
    """Return the forces of springs with their dampers, (K,) N; positive if they push the anchors apart.

    Args:
        springs: K springs.
        extent: their present extent.
        velocity: (N, 2) m/s, of all bodies.
        spin: (N,) rad/s.
    """
    second = _anchor_velocity(springs.b, extent.arm_b, velocity, spin)
    separating = second - _anchor_velocity(springs.a, extent.arm_a, velocity, spin)
    length = np.where(extent.length > 0.0, extent.length, 1.0)
    rate = np.einsum("kd,kd->k", extent.displacement, separating) / length
    rest, stiffness, damping = springs.figures.T
    return of_bands(springs, extent.length, spring_law(rest, stiffness, damping, extent.length, rate))


def of_bands(springs: JointArrays, length: FloatArray, force: FloatArray) -> FloatArray:
    """Return the forces of springs, (K,) N, where those that only pull are slack, or pull and do not push.

    Args:
        springs: K springs.
        length: (K,) m.
        force: (K,) N, by `spring_law`.
    """
    if not springs.pulls_only.any():
        return force
    pull = np.where(length > springs.figures[:, 0], np.minimum(force, 0.0), 0.0)
    return np.where(springs.pulls_only, pull, force)


def rotary_torques(springs: JointArrays, angle: FloatArray, spin: FloatArray) -> FloatArray:
    """Return the torques of rotary springs with their dampers on their second bodies, (K,) N·m."""
    rest, stiffness, damping = springs.figures.T
    return np.asarray(spring_law(rest, stiffness, damping, relative(springs, angle), relative(springs, spin)))


def relative(joints: JointArrays, values: FloatArray) -> FloatArray:
    """Return values (N,) of second bodies minus those of first bodies, (K,); 0 for the world."""
    return np.asarray(values[joints.b] - np.where(joints.a >= 0, values[joints.a], 0.0))


def _anchor_velocity(index: IntArray, arm: FloatArray, velocity: FloatArray, spin: FloatArray) -> FloatArray:
    """Return the velocities of anchors, (K, 2) m/s, of joints on bodies with an index (K,); 0 for the world."""
    turning = np.column_stack((-spin[index] * arm[:, 1], spin[index] * arm[:, 0]))
    return np.where((index >= 0)[:, None], velocity[index] + turning, 0.0)
