"""Forces: what acts on the bodies of a run, but contacts: gravity, steady forces, air, springs, fields."""

from collections.abc import Callable

import numpy as np

from sandbox.engines.reference.joints.field import Field
from sandbox.engines.reference.joints.solver import JointSolver
from sandbox.engines.reference.motion import Inputs, State
from sandbox.engines.roster import Roster
from sandbox.scene.links import LinkKind
from sandbox.trajectory import FloatArray


def forces_on(roster: Roster, field: Field, joints: JointSolver | None, coordinates: int) -> Inputs:
    """Return what acts on the bodies of a roster.

    Args:
        roster: who is there, and what pushes whom.
        field: what acts from afar and from within.
        joints: what holds the scene's links, if it has any.
        coordinates: of a state: 2, or 3 where something turns.
    """
    world = roster.scene.world
    moving = roster.moving[:, None]
    if roster.held:  # what acts on them is their drives' concern
        moving = moving.copy()
        moving[list(roster.held)] = False
    steady: FloatArray = np.zeros((len(moving), coordinates))
    steady[:, :2] = np.where(moving, roster.gravity, 0.0) + roster.force * roster.inverse_mass[:, None]
    if coordinates == 3:
        steady[:, 2] = roster.torque * roster.inverse_moment
    forces: list[Callable[[float, State], FloatArray]] = [] if field.empty else [field]
    springs = roster.scene.links.of(LinkKind.SPRING, LinkKind.ROTARY_SPRING)
    if joints is not None and joints.how != "xpbd" and len(springs):
        forces.append(lambda _, x: joints.forces(x))
    return Inputs(
        steady,
        world.linear_drag,
        world.quadratic_drag,
        world.wind,
        moving.astype(np.float64),
        forces=tuple(forces),
        rubbing=bool(springs.figures[:, 2].any()),
    )
