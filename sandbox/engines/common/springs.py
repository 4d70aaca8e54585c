"""Law of springs and rotary springs with dampers, and the anchors of joints in the world."""

import numpy as np

from sandbox.arrays import FloatArray, IntArray
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
