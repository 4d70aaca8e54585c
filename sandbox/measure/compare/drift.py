"""Drift: energy and momentum that a run has gained or lost without a cause."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.measure.energy import energies
from sandbox.measure.recorder import frame_count
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

TREMBLING = 1e-4
"""The share of what lifts all bodies by their own width below which a scene with other bodies than balls stands still:
what little they move then is the solver's own, and a share of that says nothing."""


class EnergyDrift(NamedTuple):
    """A share of the energy that is in motion, and what it was counted against."""

    share: float | None
    against: str
    """`truth` or `start`"""


def energy_drift(run: Trajectory, scene: Scene, truth: Trajectory | None, trusted: bool) -> EnergyDrift:
    """Return what total energy changed by over a whole run, as a share of the energy in motion.

    Where the truth is trusted to the end, its change is taken off first, so that what impacts and drag rightly
    take does not count; else the plain change against the start is left. The energy in motion is the largest
    kinetic energy of any frame, the truth's where there is one: unlike the total, it does not depend on where
    potential energy is 0. None where a run has no end to speak of, or energy changed with nothing in motion; a stack of
    boxes that trembles (`TREMBLING`) is not in motion.
    """
    against = "truth" if trusted and truth is not None else "start"
    if not len(run.time) or run.status != "ok":
        return EnergyDrift(None, against)
    own = energies(run, scene)
    change, scale = float(own.total[-1] - own.total[0]), float(own.kinetic.max())
    if truth is not None:
        its = energies(truth, scene)
        scale = float(its.kinetic.max())
        if trusted:
            change -= float(its.total[-1] - its.total[0])
    if not scene.bodies.round.all() and scale < TREMBLING * _lift(scene):
        return EnergyDrift(0.0 if change == 0.0 else None, against)
    return EnergyDrift(_share(change, scale), against)


def _lift(scene: Scene) -> float:
    """Return what it takes to lift every body by its own width, J."""
    bodies = scene.bodies
    weight = np.where(bodies.fixed, 0.0, bodies.mass) * math.hypot(*scene.world.gravity)
    return float(weight @ (2.0 * bodies.thin))


def momentum_drift(run: Trajectory, scene: Scene) -> float | None:
    """Return the momentum at the end that nothing explains, as a share of the largest sum of |m v| of any frame.

    Explained are gravity, and the recorded impulses between bodies that move and things that do not; joints and
    attraction between bodies that move keep momentum. None with drag, thrust, drives, a joint to what stands still or
    an attraction towards it, or zones that stop or lift, whose impulses are not recorded; where a body was retired,
    and took its momentum along; where the run did not reach its end, or ended within a step, of whose contacts there
    is no record.
    """
    bodies, world = scene.bodies, scene.world
    if run.status != "ok" or np.isfinite(run.retired_time).any():
        return None
    if frame_count(scene, Settings.model_validate(run.info["settings"]))[1] > 0.0:
        return None
    if world.linear_drag or world.quadratic_drag or scene.thrusts or scene.drives or _anchored(scene):
        return None
    if any(zone.holds or zone.gravity is not None for zone in scene.zones):
        return None
    mass = np.where(bodies.fixed, 0.0, bodies.mass)
    explained = mass.sum() * np.asarray(world.gravity) * run.time[-1]
    still = np.append(bodies.fixed, np.ones(len(scene.fixed_names), dtype=np.bool_))  # −1 − k counts from the end
    first, second = (still[run.contact_pair[:, side]] for side in (0, 1))
    explained = explained - run.contact_impulse[~first & second].sum(axis=0)
    explained = explained + run.contact_impulse[first & ~second].sum(axis=0)
    momentum = np.einsum("n,tnk->tk", mass, run.velocity[[0, -1]])
    scale = max(float(np.hypot(*np.moveaxis(frame, 1, 0)) @ mass) for frame in run.velocity)
    return _share(float(np.hypot(*(momentum[1] - momentum[0] - explained))), scale)


def _anchored(scene: Scene) -> bool:
    """Tell whether a joint or an attraction acts between what moves and what does not."""
    bodies, links = scene.bodies, scene.links
    still = {name for name, fixed in zip(bodies.names, bodies.fixed.tolist(), strict=True) if fixed}
    drawn = any(not isinstance(each.toward, str) or each.toward in still for each in scene.attractions)
    return drawn or bool(((links.a < 0) | bodies.fixed[links.a] | bodies.fixed[links.b]).any())


def _share(change: float, scale: float) -> float | None:
    if change == 0.0:
        return 0.0
    return change / scale if math.isfinite(change) and math.isfinite(scale) and scale > 0.0 else None
