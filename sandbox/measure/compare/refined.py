"""Refined: a fixed step, halved until the answer stays the same."""

from dataclasses import dataclass

import numpy as np
from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run
from sandbox.measure.compare.errors import Errors, errors
from sandbox.measure.compare.horizon import agree_until, perturb
from sandbox.measure.joint_error import HOLDING
from sandbox.measure.recorder import frame_count
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

WORK = 5e6
"""Bodies × steps that all halvings together may take."""
LIMIT = 20.0
"""Counted cost, s, that all halvings of one choice of settings may have; the first run a fifth of it, else the next
choice is tried."""
HALVINGS = 8
"""At most; the time step is 1/256 then."""
AGREE = 0.1
"""The share of the tolerance within which two successive answers agree."""
ITERATIONS = 20
"""At least; a truth should not hang on a contact solver that stops early."""
JUMP = 1e-3
"""The share of the tolerance that two runs are apart at most in the frame before they jump apart."""
SLOP = 0.01
"""The share of the tolerance that may stay overlapped."""

PREFERENCES: tuple[dict[str, object], ...] = (
    {"integrator": "velocity_verlet", "detection": "swept"},
    {"detection": "swept"},
    {"integrator": "velocity_verlet"},
    {"half_kick": True},
    {},
)
"""The first that an engine has is taken: exact flight and impacts within a step agree sooner."""
JOINED: dict[str, object] = {"integrator": "velocity_verlet", "joints": "rattle"}
"""Before all others where bodies are joined: of second order, where impulses alone leave an error of the first."""
SMOOTH: dict[str, object] = {"integrator": "rk4"}
"""Before all others where nothing can collide and no joint is rigid: forces are smooth, and order 4 pays."""


@dataclass(frozen=True, eq=False)
class Refined:
    """The finest answer of an engine, and until when it agrees with the one before."""

    engine: str
    settings: Settings
    halvings: int
    trajectory: Trajectory
    agrees_until: float
    """s, within the tolerance itself"""
    about: str
    """why it was refined no further"""
    difference: float
    """m, largest distance from the previous halving, as long as the two agree"""
    horizon: float
    """s, until when a perturbation changes nothing beyond the tolerance"""
    work: int
    """bodies × steps that all runs took together"""


def refined(scene: Scene, settings: Settings, tolerance: float) -> Refined | None:
    """Halve dt until two successive answers agree within `AGREE` of the tolerance, or the work becomes too much.

    Where a perturbation changes the answer from some time on, they need not agree beyond it. An answer in which
    contacts were missed agrees with nothing from the first of them on.

    The reference is asked first, then every other engine with a step, in the order of the registry; of each, the
    settings in the order of `PREFERENCES`. Where all of these fail, they are asked again with as many substeps as the
    settings have. Frames stay where they were. None where no engine can run the scene.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    names = sorted((name for name in ENGINES if name != "exact"), key=lambda name: name != "reference")
    iterations = max(settings.iterations, ITERATIONS)
    start = Settings(dt=settings.dt, record_every=settings.record_every, iterations=iterations, slop=SLOP * tolerance)
    for substeps in dict.fromkeys((1, settings.substeps)):
        for name in names:
            for preference in preferences(scene):
                wanted = start.replace(substeps=substeps, **preference)
                if ENGINES[name].missing(scene, wanted):
                    continue
                found = _halved(scene, name, wanted, tolerance)
                if found is not None:
                    return found
    return None


def preferences(scene: Scene) -> tuple[dict[str, object], ...]:
    """Return the ways of doing things that agree soonest with a finer step, the best first."""
    if len(scene.links.of(*HOLDING, LinkKind.MOTOR)):
        return JOINED, *PREFERENCES
    return PREFERENCES if contact_matrix(scene).touches.any() else (SMOOTH, *PREFERENCES)


def _halved(scene: Scene, engine: str, settings: Settings, tolerance: float) -> Refined | None:
    """Refine one choice of settings; None where not even the first run gets to its end."""
    try:
        coarse, _ = bounded_run(scene, engine, settings, LIMIT / 5.0, audit=False)
        if coarse.status != "ok":
            return None
        # Beyond the time at which a perturbation matters, agreement is not to be had, nor of use.
        other = perturb(scene)
        enough, _ = _horizon(scene, other, engine, settings, coarse, tolerance)
    except TookTooLongError:
        return None
    left = LIMIT
    work = each = max(len(scene.bodies), 1) * max(frame_count(scene, settings)[0], 1)
    agrees, halvings, about = 0.0, 0, "dt was not halved further"
    last: Errors | None = None
    horizon: float | None = None
    while halvings < HALVINGS:
        each *= 2
        finer = half(settings)
        if work + each > WORK:
            about = "further halving would take too long"
            break
        if finer is None or scene.world.duration / finer.dt > MAX_STEPS:
            about = "dt cannot be halved further"
            break
        try:
            fine, counted = bounded_run(scene, engine, finer, left)
            left -= counted
            if fine.status != "ok":
                about = f"the next halving {fine.status}: {fine.reason}"
                break
            # Two that tunnel through the same wall agree as well.
            missed = float(np.min(fine.missed_time, initial=np.inf))
            close = min(agree_until(fine, coarse, scene, AGREE * tolerance), missed)
            agrees = min(agree_until(fine, coarse, scene, tolerance), missed)
            last = errors(fine, coarse, ~scene.bodies.fixed)
            coarse, settings, halvings, work = fine, finer, halvings + 1, work + each
            horizon = None
            if close >= enough:
                horizon, jumps = _horizon(scene, other, engine, settings, coarse, tolerance)
                enough = max(enough, horizon)
                if close >= enough and not jumps:  # a jump is as high as a step is long: a smaller one makes less of it
                    about = f"agrees with the previous halving within {AGREE * tolerance:.2g} m"
                    break
        except TookTooLongError:
            about = "further halving would take too long"
            break
    try:
        if horizon is None:
            horizon, _ = _horizon(scene, other, engine, settings, coarse, tolerance)
    except TookTooLongError:
        horizon = min(enough, agrees)
    difference = 0.0 if last is None else last.until(min(agrees, horizon)).max_position or 0.0
    return Refined(engine, settings, halvings, coarse, agrees, about, difference, horizon, work)


def _horizon(
    scene: Scene, other: Setup | None, engine: str, settings: Settings, found: Trajectory, tolerance: float
) -> tuple[float, bool]:
    """Return until when a run of the scene agrees with one of the perturbed scene, s, and whether they jump apart then.

    They do where the perturbation decides in which step a contact is seen, and grow apart where it is chaos.
    """
    if other is None:
        return scene.world.duration, False
    again, _ = bounded_run(other, engine, settings, LIMIT, audit=False)
    apart = errors(found, again, ~scene.bodies.fixed).position
    above = np.flatnonzero(apart > tolerance)
    jumps = bool(len(above)) and bool(apart[: above[0]].max(initial=0.0) < JUMP * tolerance)
    return agree_until(found, again, scene, tolerance), jumps


def half(settings: Settings) -> Settings | None:
    """Return settings with half the time step, whose frames lie where they did; None where there are none."""
    try:
        return settings.replace(dt=settings.dt / 2.0, record_every=settings.record_every * 2)
    except ValidationError:
        return None
