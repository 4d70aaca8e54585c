"""Self-convergence: a fixed step, halved until the result no longer changes."""

from dataclasses import dataclass

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.invariants import CONSTRAINT_KINDS
from sandbox.measure.metrics.perturbation import agreement_time, perturb
from sandbox.measure.metrics.trajectory_error import Errors, errors
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import MOTORS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError
from sandbox.schedule import frame_count
from sandbox.trajectory import Trajectory

MAX_WORK = 5e6
"""Bodies × steps of all halvings together."""
COST_LIMIT = 20.0
"""Counted cost, s, of all halvings with one choice of settings. If the first run takes more than a fifth of it, the
next choice is tried.
"""
MAX_HALVINGS = 8
"""Largest number of halvings; the step is 1/256 then."""
AGREEMENT_FRACTION = 0.1
"""Fraction of the tolerance within which two successive results agree."""
MIN_ITERATIONS = 20
"""Smallest number of iterations, so that a truth does not depend on a contact solver that stops early."""
JUMP_FRACTION = 1e-3
"""Two runs jump apart if their distance in the previous frame is below this fraction of the tolerance."""
SLOP_FRACTION = 0.01
"""Overlap that may remain, as a fraction of the tolerance."""

PREFERENCES: tuple[dict[str, object], ...] = (
    {"integrator": "velocity_verlet", "detection": "swept"},
    {"detection": "swept"},
    {"integrator": "velocity_verlet"},
    {"half_kick": True},
    {},
)
"""The first choice that an engine has is taken: exact flight and impacts within a step converge faster."""
JOINT_SETTINGS: dict[str, object] = {"integrator": "velocity_verlet", "joints": "rattle"}
"""First choice for scenes with joints: of second order, where impulses alone are of first order."""
SMOOTH_SETTINGS: dict[str, object] = {"integrator": "rk4"}
"""First choice without collisions and rigid joints: forces are smooth, and a method of order 4 converges faster."""


@dataclass(frozen=True, eq=False)
class RefinedRun:
    """Finest result of an engine, and the time up to which it agrees with the previous one."""

    engine: str
    settings: Settings
    halvings: int
    trajectory: Trajectory
    agrees_until: float
    """s, end of the agreement within the tolerance"""
    about: str
    """reason why it was not refined further"""
    difference: float
    """m, largest distance from the previous halving as long as the two agree"""
    horizon: float
    """s, time up to which a perturbation changes nothing beyond the tolerance"""
    work: int
    """bodies × steps of all runs"""


def refine(scene: Scene, settings: Settings, tolerance: float) -> RefinedRun | None:
    """Halve dt until two successive results agree, or the work exceeds its limit.

    They agree if they differ by at most `AGREEMENT_FRACTION` of the tolerance. Beyond the time at which a perturbation
    changes the result, they need not agree. A result with missed contacts agrees with nothing after the first of them.

    The reference engine is tried first, then the other engines with a step, in the order of the registry; of each, the
    settings in the order of `PREFERENCES`. If all of these fail, they are tried again with the number of substeps in
    the settings. The recorded frames stay the same. None if no engine can run the scene.

    Args:
        scene: the scene.
        settings: dt, recorded frames, iterations and substeps.
        tolerance: tolerance of positions, m.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    names = sorted((name for name in ENGINES if name != "exact"), key=lambda name: name != "reference")
    iterations = max(settings.iterations, MIN_ITERATIONS)
    start = Settings(
        dt=settings.dt, record_every=settings.record_every, iterations=iterations, slop=SLOP_FRACTION * tolerance
    )
    for substeps in dict.fromkeys((1, settings.substeps)):
        for name in names:
            for preference in preferred_settings(scene):
                wanted = start.replace(substeps=substeps, **preference)
                if ENGINES[name].missing(scene, wanted):
                    continue
                found = _refine_settings(scene, name, wanted, tolerance)
                if found is not None:
                    return found
    return None


def preferred_settings(scene: Scene) -> tuple[dict[str, object], ...]:
    """Return the choices of methods that converge fastest in a scene, the best first."""
    if len(scene.joint_arrays.of(*CONSTRAINT_KINDS, *MOTORS)):
        return JOINT_SETTINGS, *PREFERENCES
    return PREFERENCES if contact_matrix(scene).touches.any() else (SMOOTH_SETTINGS, *PREFERENCES)


def _refine_settings(scene: Scene, engine: str, settings: Settings, tolerance: float) -> RefinedRun | None:
    """Refine one choice of settings; None if the first run does not reach its end."""
    try:
        refinement = _Refinement.begin(scene, engine, settings, tolerance)
    except RunTimeoutError:
        return None
    about: str | None = None
    while refinement is not None and about is None:
        try:
            about = refinement.halve()
        except RunTimeoutError:
            about = "further halving would take too long"
    return None if refinement is None else refinement.result(str(about))


@dataclass
class _Refinement:
    """Halvings of one choice of settings so far."""

    scene: Scene
    engine: str
    settings: Settings
    """of the finest run"""
    tolerance: float
    finest: Trajectory
    perturbed: Setup | None
    required: float
    """s, time up to which two results must agree: beyond the time at which a perturbation matters they need not"""
    step_work: int
    """bodies × steps of the finest run"""
    work: int
    """bodies × steps of all runs"""
    remaining: float = COST_LIMIT
    """s, counted cost that is left"""
    halvings: int = 0
    agrees: float = 0.0
    """s, end of the agreement of the last two runs within the tolerance"""
    change: Errors | None = None
    """difference of the last two runs"""
    horizon: float | None = None
    """s, predictability horizon of the finest run, if it is known"""

    @classmethod
    def begin(cls, scene: Scene, engine: str, settings: Settings, tolerance: float) -> "_Refinement | None":
        """Make the first run; None if it does not reach its end.

        Raises:
            RunTimeoutError: the run exceeds a fifth of `COST_LIMIT`.
        """
        first, _ = bounded_run(scene, engine, settings, COST_LIMIT / 5.0, audit=False)
        if first.status != "ok":
            return None
        perturbed = perturb(scene)
        required, _ = _predictable_until(scene, perturbed, engine, settings, first, tolerance)
        work = max(len(scene.bodies), 1) * max(frame_count(scene, settings)[0], 1)
        return cls(scene, engine, settings, tolerance, first, perturbed, required, work, work)

    def halve(self) -> str | None:
        """Make a run with half the step; return the reason why it is the last one, or None.

        Raises:
            RunTimeoutError: the run exceeds the remaining cost.
        """
        scene, finer, work = self.scene, halve_step(self.settings), 2 * self.step_work
        if self.halvings == MAX_HALVINGS:
            return "dt was not halved further"
        if self.work + work > MAX_WORK:
            return "further halving would take too long"
        if finer is None or scene.world.duration / finer.dt > MAX_STEPS:
            return "dt cannot be halved further"
        run, cost = bounded_run(scene, self.engine, finer, self.remaining)
        self.remaining -= cost
        if run.status != "ok":
            return f"the next halving {run.status}: {run.reason}"
        # Two runs in which a body tunnels through the same wall agree as well.
        missed = float(np.min(run.missed_time, initial=np.inf))
        close_within = AGREEMENT_FRACTION * self.tolerance
        close = min(agreement_time(run, self.finest, scene, close_within), missed)
        self.agrees = min(agreement_time(run, self.finest, scene, self.tolerance), missed)
        self.change = errors(run, self.finest, ~scene.bodies.fixed)
        self.finest, self.settings, self.step_work = run, finer, work
        self.halvings, self.work, self.horizon = self.halvings + 1, self.work + work, None
        if close >= self.required:
            self.horizon, jumps = self._predictable_until()
            self.required = max(self.required, self.horizon)
            if close >= self.required and not jumps:  # a jump is proportional to the step
                return f"agrees with the previous halving within {close_within:.2g} m"
        return None

    def result(self, about: str) -> RefinedRun:
        """Return the finest run.

        Args:
            about: reason why it was not refined further.
        """
        horizon = self.horizon
        if horizon is None:
            try:
                horizon, _ = self._predictable_until()
            except RunTimeoutError:
                horizon = min(self.required, self.agrees)
        end = min(self.agrees, horizon)
        difference = 0.0 if self.change is None else self.change.largest("position", end) or 0.0
        return RefinedRun(
            self.engine, self.settings, self.halvings, self.finest, self.agrees, about, difference, horizon, self.work
        )

    def _predictable_until(self) -> tuple[float, bool]:
        return _predictable_until(self.scene, self.perturbed, self.engine, self.settings, self.finest, self.tolerance)


def _predictable_until(
    scene: Scene, other: Setup | None, engine: str, settings: Settings, found: Trajectory, tolerance: float
) -> tuple[float, bool]:
    """Return the time up to which a run agrees with one of the perturbed scene, s, and whether they jump apart then.

    They jump apart if the perturbation decides in which step a contact is detected, and grow apart in chaotic motion.
    """
    if other is None:
        return scene.world.duration, False
    again, _ = bounded_run(other, engine, settings, COST_LIMIT, audit=False)
    apart = errors(found, again, ~scene.bodies.fixed).position
    above = np.flatnonzero(apart > tolerance)
    jumps = bool(len(above)) and bool(apart[: above[0]].max(initial=0.0) < JUMP_FRACTION * tolerance)
    return agreement_time(found, again, scene, tolerance), jumps


def halve_step(settings: Settings) -> Settings | None:
    """Return settings with half the time step and the same recorded frames; None if dt is out of bounds."""
    try:
        return settings.replace(dt=settings.dt / 2.0, record_every=settings.record_every * 2)
    except SettingsError:
        return None
