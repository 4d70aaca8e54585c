"""Witnesses: a refined answer counts as the truth only as far as a second method and the conservation laws confirm it.

An engine that converges need not converge to what is right: a corner caught at a joint of two walls is caught at every
step. So another engine, or else another method of the same, is refined until it agrees. It need not come as close as
the answer itself: what its own last halving has changed tells how far it still may be off.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run
from sandbox.measure.compare.drift import momentum_drift
from sandbox.measure.compare.errors import Errors, errors, usual_tolerance
from sandbox.measure.compare.refined import Refined, half, preferences
from sandbox.measure.energy import energies
from sandbox.measure.recorder import frame_count
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SHARE = 0.5
"""Of the work of the answer, what one witness may take, if three runs do not take more; all may take twice that."""
LEAST = 50_000
"""Bodies × steps that one witness may always take: some tenths of a second."""
LIMIT = 20.0
"""Counted cost, s, that all witnesses together may have."""
CLOSE = 10.0
"""Tolerances: a witness whose last halving changes more than that, and more than the usual tolerance, has not
converged, and confirms nothing."""
CONVERGES = 2.0
"""The error left by a method of the first order is what its last halving has changed; twice that is allowed."""
CONTRADICTS = 4.0
"""Beyond so many times what its last two halvings have changed, a witness converges to something else."""
IMPACT = 2.0
"""An impact seen a step late leaves a body (1 + e)·v·h off; a halving may change nothing of that by chance."""
RUNS = 3
"""The fewest runs from which a witness may contradict: two halvings, as one alone may change little by chance."""
GROWTH = 0.01
"""The share of the largest kinetic energy by which energy may grow without a source; likewise momentum."""

METHODS: tuple[dict[str, object], ...] = (
    {"integrator": "semi_implicit_euler", "detection": "shrink"},
    {"integrator": "semi_implicit_euler", "detection": "discrete"},
    {"detection": "bisect"},
)
"""Asked after the preferences of `refined`: other integrators, and other ways to find impacts."""
CHOICES = ("integrator", "detection", "joints", "half_kick")
"""Settings by which two methods of one engine differ."""
SOURCES = frozenset({Demand.THRUST, Demand.MOTORS, Demand.DRIVES, Demand.KICKS, Demand.ZONES})
"""What may bring energy into a scene, beside wind and the bodies that are launched."""


class Confirmation(NamedTuple):
    """How far a refined answer is confirmed."""

    until: float
    """s"""
    by: str | None
    """the engine and method that confirm it; None where none does"""
    about: str
    """what ends it; empty where nothing does"""


class _Testimony(NamedTuple):
    until: float
    """s, as far as the witness agrees"""
    contradicts: bool
    """it converges to something else after that"""
    apart: float
    """m, how far it gets from the answer"""


def confirmed(scene: Scene, found: Refined, settings: Settings, tolerance: float, until: float) -> Confirmation:
    """Return until when a second method and the conservation laws confirm an answer, at most a time, s.

    Other engines are asked first, then other methods of the same engine. The first that contradicts ends the truth;
    of those that have not converged, the one that confirms most counts.

    Args:
        scene: of what.
        found: the answer.
        settings: give dt, which frames are kept, and iterations.
        tolerance: of positions, m.
        until: s, beyond which the answer is not trusted anyway.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    lawful, breach = _lawful_until(scene, found.trajectory, tolerance)
    if lawful < until:
        until, limit = lawful, breach
    else:
        limit = ""
    best: Confirmation | None = None
    left, work = LIMIT, 0
    for name, wanted in _witnesses(scene, found, settings):
        if best is not None and work >= 2.0 * max(SHARE * found.work, LEAST):
            break
        testimony, took, counted = _testimony(scene, name, wanted, found, tolerance, until, left)
        work, left = work + took, left - counted
        if testimony is None:
            continue
        by = _method(scene, name, wanted, found)
        if testimony.until >= until:
            return Confirmation(until, by, limit)
        if testimony.contradicts:
            what = f"{found.engine} and {by} converge to different results, {testimony.apart:.2g} m apart"
            return Confirmation(testimony.until, by if testimony.until > 0.0 else None, what)
        if best is None or testimony.until > best.until:
            best = Confirmation(testimony.until, by, f"{by} has not converged and confirms nothing later")
    return best or Confirmation(0.0, None, "no second engine or method can run the scene to confirm the first")


def _witnesses(scene: Scene, found: Refined, settings: Settings) -> Iterator[tuple[str, Settings]]:
    """Yield engines and settings of methods other than that of an answer, the most independent first.

    Of another engine one is enough, the first that it has.
    """
    common = {key: getattr(found.settings, key) for key in ("substeps", "iterations", "slop")}
    start = Settings(dt=settings.dt, record_every=settings.record_every).replace(**common)
    others = sorted((name for name in ENGINES if name != "exact"), key=lambda name: name == found.engine)
    own = ENGINES[found.engine].resolve(scene, found.settings)
    for name in others:
        tried: set[tuple[object, ...]] = {_choices(own)} if name == found.engine else set()
        for method in (*preferences(scene), *METHODS):
            wanted = start.replace(**method)
            if ENGINES[name].missing(scene, wanted):
                continue
            choices = _choices(ENGINES[name].resolve(scene, wanted))
            if choices in tried:
                continue
            tried.add(choices)
            yield name, wanted
            if name != found.engine:
                break


def _choices(settings: Settings) -> tuple[object, ...]:
    return tuple(getattr(settings, key) for key in CHOICES)


def _method(scene: Scene, name: str, wanted: Settings, found: Refined) -> str:
    """Name a witness: another engine by its name, another method of the same with what it does otherwise."""
    if name != found.engine:
        return name
    mine, its = (ENGINES[name].resolve(scene, each) for each in (wanted, found.settings))
    other = {key: getattr(mine, key) for key in CHOICES if getattr(mine, key) != getattr(its, key)}
    said = [f"without {key}" if value is False else f"{key} {value}" for key, value in other.items()]
    return f"{name} with {' and '.join(said)}".replace("with without", "without")


def _testimony(
    scene: Scene, engine: str, settings: Settings, found: Refined, tolerance: float, until: float, limit: float
) -> tuple[_Testimony | None, int, float]:
    """Refine a witness until it agrees, contradicts, or has worked enough; return also its work and its counted cost.

    The testimony is None where the witness does not get to its end.
    """
    moving, converged = ~scene.bodies.fixed, max(CLOSE * tolerance, usual_tolerance(scene))
    each = max(len(scene.bodies), 1) * max(frame_count(scene, settings)[0], 1)
    allowed, work, cost = max(SHARE * found.work, (2**RUNS - 1) * each, LEAST), 0, 0.0
    coarse: Trajectory | None = None
    changed: list[FloatArray] = []
    """by each halving, at each frame, m"""
    testimony: _Testimony | None = None
    while work + each <= allowed:
        try:
            run, counted = bounded_run(scene, engine, settings, limit - cost)
        except TookTooLongError:
            cost = limit
            break
        cost += counted
        if run.status != "ok":
            break
        away = errors(run, found.trajectory, moving)
        if coarse is not None:
            step = errors(run, coarse, moving).position
            before = 0.5 * changed[-1] if changed else step
            fastest = float(np.hypot(*np.moveaxis(run.velocity[run.time <= until], 2, 0)).max(initial=0.0))
            slack = tolerance + CONTRADICTS * np.maximum(step, before) + IMPACT * fastest * settings.h
            testimony = _heard(run, away, step, slack, tolerance, converged, until)
            contradicts = testimony.contradicts and len(changed) + 2 >= RUNS
            testimony = testimony._replace(contradicts=contradicts)
            if testimony.until >= until or contradicts:
                break
            changed.append(step)
        elif not (away.position[away.time <= until] > tolerance).any() and not len(run.missed_time):
            return _Testimony(until, False, 0.0), work + each, cost
        coarse, work, each = run, work + each, 2 * each
        finer = half(settings)
        if finer is None:
            break
        settings = finer
    return testimony, work, cost


def _heard(
    run: Trajectory,
    away: Errors,
    step: FloatArray,
    slack: FloatArray,
    tolerance: float,
    converged: float,
    until: float,
) -> _Testimony:
    """Return what a witness says.

    Args:
        run: its last.
        away: from the answer, at K frames.
        step: (K,) what its last halving has changed, m.
        slack: (K,) m, by how much it may be away before it is sure to converge to something else.
        tolerance: of positions, m.
        converged: m, up to which its last halving may change it.
        until: s, beyond which it is not heard.
    """
    end = min(until, float(np.min(run.missed_time, initial=np.inf)))
    apart, heard = away.position, away.time <= end
    agrees = (apart <= tolerance) | ((apart <= CONVERGES * step) & (step <= converged))
    against = np.flatnonzero(~agrees & heard)
    if not len(against):
        return _Testimony(end, False, 0.0)
    beyond = np.flatnonzero((apart > slack) & heard)
    contradicts = len(beyond) > 0
    # What converges to something else begins to leave the answer before it is sure that it does.
    last = np.flatnonzero(agrees[: beyond[0]]) if contradicts else np.arange(against[0])
    agreed = float(away.time[last[-1]]) if len(last) else 0.0
    return _Testimony(agreed, contradicts, float(apart[beyond].max(initial=0.0)))


def _lawful_until(scene: Scene, run: Trajectory, tolerance: float) -> tuple[float, str]:
    """Return until when a run keeps the conservation laws, s, and how it breaks them then.

    Energy must not grow where nothing brings any, and momentum stay where it is conserved (`drift.momentum_drift`).
    """
    end = scene.world.duration
    drift = momentum_drift(run, scene)
    if drift is not None and abs(drift) > GROWTH:
        return 0.0, f"the momentum in {run.info['engine']} changes by {abs(drift):.1%} without a force"
    needed = demands(scene)
    windy = Demand.DRAG in needed and any(scene.world.wind)
    if windy or needed & SOURCES or (scene.bodies.born > 0.0).any():
        return end, ""
    energy = energies(run, scene)
    kept = run.time < np.nanmin(run.retired_time, initial=np.inf)  # what is retired takes its energy along
    weight = float(np.where(scene.bodies.fixed, 0.0, scene.bodies.mass).sum()) * math.hypot(*scene.world.gravity)
    allowed = GROWTH * float(energy.kinetic.max(initial=0.0)) + weight * tolerance
    grown = energy.total - np.minimum.accumulate(energy.total)
    broken = np.flatnonzero((grown > allowed) & kept)
    if not len(broken):
        return end, ""
    first = int(broken[0])
    until = float(run.time[first - 1]) if first else 0.0
    return until, f"the energy in {run.info['engine']} grows by {float(grown[first]):.2g} J without a source"
