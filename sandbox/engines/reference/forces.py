"""External forces: gravity, air, attraction, thrust, liquids and springs, as inputs of the integrators."""

from collections.abc import Callable

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.forces.air import Air
from sandbox.engines.forces.field import ForceField
from sandbox.engines.reference.integrators import Inputs, State
from sandbox.engines.reference.joints import JointSolver
from sandbox.scene.compile.joint_arrays import JointKind


def forces_on(store: BodyStore, field: ForceField, joints: JointSolver | None, coordinates: int) -> Inputs:
    """Return the forces on the bodies of a body store.

    Args:
        store: the bodies, and the constant forces on them.
        field: attractions, thrusts and liquids.
        joints: solver of the joints, if there are any.
        coordinates: D of a state: 2, or 3 if a body turns.
    """
    moving = store.moving[:, None]
    if store.has_driven:  # drives apply the forces on their bodies
        moving = moving & ~store.driven[:, None]
    constant: FloatArray = np.zeros((len(moving), coordinates))
    constant[:, :2] = np.where(moving, store.gravity, 0.0) + store.force * store.inverse_mass[:, None]
    if coordinates == 3:
        constant[:, 2] = store.torque * store.inverse_moment
    forces: list[Callable[[float, State], FloatArray]] = [] if field.empty else [field]
    if field.liquids is not None:
        forces.append(field.by_liquids)
    springs = store.setup.joints.of(JointKind.SPRING, JointKind.ROTARY_SPRING)
    if joints is not None and joints.method != "xpbd" and len(springs):
        forces.append(joints.forces_at)
    return Inputs(
        constant,
        Air.of(store.scene.world, store.bodies, store.present),
        moving.astype(np.float64),
        forces=tuple(forces),
        damped_forces=bool(springs.figures[:, 2].any()) or (field.liquids is not None and field.liquids.has_drag),
    )
