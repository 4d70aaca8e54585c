"""Ground truth of a scene: closed form, exact engine or refined run, and its independent confirmation.

An engine can converge to a wrong result: a body caught at the joint of two walls is caught at every step. A refined
result is therefore compared with another engine, or else with another method of the same engine, which is refined until
it agrees. It need not become as accurate as the result itself: the change by its last halving of dt bounds its error.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.formatting import format_fraction
from sandbox.measure.analytic import solution
from sandbox.measure.analytic.trajectory import solution_run
from sandbox.measure.compare.self_convergence import RefinedRun, halve_step, preferred_settings, refine
from sandbox.measure.metrics.contacts import are_collisions
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.invariants import momentum_drift
from sandbox.measure.metrics.perturbation import PERTURBATION, agreement_time, perturb
from sandbox.measure.metrics.trajectory_error import Errors, default_tolerance, errors
from sandbox.measure.preflight.predictability import event_warnings
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run, counted_cost
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.schedule import frame_count
from sandbox.trajectory import Trajectory

WORK_FRACTION = 0.5
"""Work of one second method relative to that of the result, unless three runs take more; all together may take twice
that.
"""
MIN_WORK = 50_000
"""Bodies × steps that one second method may always take: some tenths of a second."""
CONFIRMATION_LIMIT = 20.0
"""Counted cost, s, of all second methods together (`bounded_run`)."""
CONVERGED_TOLERANCES = 10.0
"""A second method whose last halving changes it by more than this many tolerances, and by more than the default
tolerance, has not converged and confirms nothing.
"""
ALLOWED_CHANGES = 2.0
"""The remaining error of a first-order method is the change by its last halving; twice that is allowed."""
CONTRADICTION_CHANGES = 4.0
"""A second method that differs by more than this many times the changes by its last two halvings converges to another
result.
"""
IMPACT_STEPS = 2.0
"""An impact detected one step late displaces a body by (1 + e)·v·h, and a halving need not change that."""
MIN_RUNS = 3
"""Smallest number of runs for a contradiction: a single halving can change little by chance."""
GROWTH = 0.01
"""Largest relative growth of energy without a source, as a fraction of the largest kinetic energy; also for momentum.
"""

ORDERS = 4
"""Pairs of opposite perturbations of a scene with simultaneous impacts. Measured on 1,500 random arrangements of
balls that hit up to six touching ones: they miss a dependence on the order of impacts in 1 %.
"""
SIMULTANEOUS = 1e-12
"""Largest difference of the times of simultaneous impacts, relative, and s: rounding."""

METHODS: tuple[dict[str, object], ...] = (
    {"integrator": "semi_implicit_euler", "detection": "shrink"},
    {"integrator": "semi_implicit_euler", "detection": "discrete"},
    {"detection": "bisect"},
)
"""Second methods after those of `preferred_settings`: other integrators and other detections of impacts."""
CHOICES = ("integrator", "detection", "joints", "half_kick")
"""Settings by which two methods of one engine differ."""
SOURCES = frozenset(
    {
        Demand.THRUST,
        Demand.TYRES,
        Demand.MOTORS,
        Demand.DRIVES,
        Demand.KINEMATIC,
        Demand.KICKS,
        Demand.ZONES,
        Demand.EVENTS,
    }
)
"""Demands that can add energy to a scene, besides wind and emitted bodies."""


class Confirmation(NamedTuple):
    """Time up to which a refined result is confirmed."""

    until: float
    """s"""
    by: str | None
    """engine and method that confirm it; None if there is none"""
    about: str
    """reason for the end of the confirmation; empty if there is none"""


class _Agreement(NamedTuple):
    """Agreement of a second method with a result."""

    until: float
    """s, end of the agreement"""
    contradicts: bool
    """whether the second method converges to another result afterwards"""
    apart: float
    """m, largest distance from the result"""


@dataclass
class _Budget:
    """Cost of the second methods."""

    remaining: float
    """s, counted cost that is left"""
    work: int = 0
    """bodies × steps of all runs"""


def confirm(scene: Scene, found: RefinedRun, settings: Settings, tolerance: float, until: float) -> Confirmation:
    """Return the time up to which a second method and the conservation laws confirm a result.

    Other engines are tried first, then other methods of the same engine. The first contradiction ends the truth; of the
    methods that have not converged, the one that confirms most counts.

    Args:
        scene: the scene.
        found: the result.
        settings: dt, recorded frames and iterations.
        tolerance: tolerance of positions, m.
        until: end of the result's predictability, s.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    conserved, breach = _conserves_until(scene, found.trajectory, tolerance)
    if conserved < until:
        until, limit = conserved, breach
    else:
        limit = ""
    best: Confirmation | None = None
    budget = _Budget(CONFIRMATION_LIMIT)
    for name, wanted in _second_methods(scene, found, settings):
        if best is not None and budget.work >= 2.0 * max(WORK_FRACTION * found.work, MIN_WORK):
            break
        agreement = _refine_until_agreement(scene, name, wanted, found, tolerance, until, budget)
        if agreement is None:
            continue
        by = _method_name(scene, name, wanted, found)
        if agreement.until >= until:
            return Confirmation(until, by, limit)
        if agreement.contradicts:
            reason = f"{found.engine} and {by} converge to different results, {agreement.apart:.2g} m apart"
            return Confirmation(agreement.until, by if agreement.until > 0.0 else None, reason)
        if best is None or agreement.until > best.until:
            best = Confirmation(agreement.until, by, f"{by} has not converged and confirms nothing later")
    return best or Confirmation(0.0, None, "no second engine or method can run the scene to confirm the first")


def _second_methods(scene: Scene, found: RefinedRun, settings: Settings) -> Iterator[tuple[str, Settings]]:
    """Yield engines and settings of methods other than that of a result, the most independent first.

    Of another engine only its first method is tried.
    """
    common = {key: getattr(found.settings, key) for key in ("substeps", "iterations", "slop")}
    start = Settings(dt=settings.dt, record_every=settings.record_every).replace(**common)
    others = sorted((name for name in ENGINES if name != "exact"), key=lambda name: name == found.engine)
    own = ENGINES[found.engine].resolve(scene, found.settings)
    for name in others:
        tried: set[tuple[object, ...]] = {_choices(own)} if name == found.engine else set()
        for method in (*preferred_settings(scene), *METHODS):
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


def _method_name(scene: Scene, name: str, wanted: Settings, found: RefinedRun) -> str:
    """Return the name of a second method: another engine, or the settings that differ."""
    if name != found.engine:
        return name
    new, old = (ENGINES[name].resolve(scene, each) for each in (wanted, found.settings))
    other = {key: getattr(new, key) for key in CHOICES if getattr(new, key) != getattr(old, key)}
    words = [f"without {key}" if value is False else f"{key} {value}" for key, value in other.items()]
    return f"{name} with {' and '.join(words)}".replace("with without", "without")


def _refine_until_agreement(
    scene: Scene,
    engine: str,
    settings: Settings,
    found: RefinedRun,
    tolerance: float,
    until: float,
    budget: _Budget,
) -> _Agreement | None:
    """Refine a second method until it agrees, contradicts, or exceeds its work, which the budget gets.

    The agreement is None if the method does not reach the end of the run.
    """
    moving, converged = ~scene.bodies.fixed, max(CONVERGED_TOLERANCES * tolerance, default_tolerance(scene))
    each = max(len(scene.bodies), 1) * max(frame_count(scene, settings)[0], 1)
    allowed = budget.work + max(WORK_FRACTION * found.work, (2**MIN_RUNS - 1) * each, MIN_WORK)
    coarse: Trajectory | None = None
    changed: list[FloatArray] = []
    """by each halving, at each frame, m"""
    agreement: _Agreement | None = None
    finer: Settings | None = settings
    while finer is not None and budget.work + each <= allowed:
        settings = finer
        try:
            run, cost = bounded_run(scene, engine, settings, budget.remaining)
        except RunTimeoutError:
            budget.remaining = 0.0
            break
        budget.remaining -= cost
        if run.status != "ok":
            break
        away = errors(run, found.trajectory, moving)
        if coarse is None:
            if not (away.position[away.time <= until] > tolerance).any() and not len(run.missed_time):
                agreement = _Agreement(until, False, 0.0)
        else:
            step = errors(run, coarse, moving).position
            before = 0.5 * changed[-1] if changed else step
            fastest = float(np.hypot(*np.moveaxis(run.velocity[run.time <= until], 2, 0)).max(initial=0.0))
            slack = tolerance + CONTRADICTION_CHANGES * np.maximum(step, before) + IMPACT_STEPS * fastest * settings.h
            agreement = _agreement_of(run, away, step, slack, tolerance, converged, until)
            agreement = agreement._replace(contradicts=agreement.contradicts and len(changed) + 2 >= MIN_RUNS)
            changed.append(step)
        coarse, each, finer = run, 2 * each, halve_step(settings)
        budget.work += each // 2
        if agreement is not None and (agreement.until >= until or agreement.contradicts):
            break
    return agreement


def _agreement_of(
    run: Trajectory,
    away: Errors,
    step: FloatArray,
    slack: FloatArray,
    tolerance: float,
    converged: float,
    until: float,
) -> _Agreement:
    """Return the agreement of a second method.

    Args:
        run: its finest run.
        away: its distances from the result at K frames.
        step: change by its last halving, (K,) m.
        slack: distance beyond which it converges to another result, (K,) m.
        tolerance: tolerance of positions, m.
        converged: largest change by the last halving of a converged method, m.
        until: end of the comparison, s.
    """
    end = min(until, float(np.min(run.missed_time, initial=np.inf)))
    apart, compared = away.position, away.time <= end
    agrees = (apart <= tolerance) | ((apart <= ALLOWED_CHANGES * step) & (step <= converged))
    disagreeing = np.flatnonzero(~agrees & compared)
    if not len(disagreeing):
        return _Agreement(end, False, 0.0)
    beyond = np.flatnonzero((apart > slack) & compared)
    contradicts = len(beyond) > 0
    # A method that converges to another result departs from this one before the contradiction is certain.
    last = np.flatnonzero(agrees[: beyond[0]]) if contradicts else np.arange(disagreeing[0])
    agreed = float(away.time[last[-1]]) if len(last) else 0.0
    return _Agreement(agreed, contradicts, float(apart[beyond].max(initial=0.0)))


def _conserves_until(scene: Scene, run: Trajectory, tolerance: float) -> tuple[float, str]:
    """Return the time up to which a run satisfies the conservation laws, s, and the violation that ends it.

    Energy must not grow without a source, and momentum has to be constant if it is conserved
    (`invariants.momentum_drift`).
    """
    end = scene.world.duration
    drift = momentum_drift(run, scene)
    if drift is not None and abs(drift) > GROWTH:
        return 0.0, f"the momentum in {run.info['engine']} changes by {format_fraction(abs(drift))} without a force"
    needed = demands(scene)
    windy = Demand.DRAG in needed and any(scene.world.wind)
    if windy or needed & SOURCES or (scene.bodies.born > 0.0).any():
        return end, ""
    energy = energies(run, scene)
    counted = run.time < np.nanmin(run.retired_time, initial=np.inf)  # a retired body takes its energy with it
    bodies = scene.bodies
    mass = float(np.where(bodies.fixed, 0.0, bodies.mass * np.abs(bodies.gravity_scale)).sum())
    weight = mass * math.hypot(*scene.world.gravity)
    allowed = GROWTH * float(energy.kinetic.max(initial=0.0)) + weight * tolerance
    grown = energy.total - np.minimum.accumulate(energy.total)
    broken = np.flatnonzero((grown > allowed) & counted)
    if not len(broken):
        return end, ""
    first = int(broken[0])
    until = float(run.time[first - 1]) if first else 0.0
    return until, f"the energy in {run.info['engine']} grows by {float(grown[first]):.2g} J without a source"


EXACT_LIMIT = 120.0
"""Counted cost, s, of the exact engine; beyond it, the refined truth is used."""
DOUBTFUL_EXACT_LIMIT = 10.0
"""Counted cost, s, of the exact engine if the preflight checks predict that it gives up: the bodies may not come to
rest within the run.
"""

TruthKind = Literal["closed_form", "exact", "refined"]


@dataclass(frozen=True, eq=False)
class Truth:
    """Best known solution of a scene."""

    kind: TruthKind
    about: str
    """source of the truth, in a few words"""
    trajectory: Trajectory
    trusted_until: float
    """s; last frame up to which no finer step, second method or perturbation moves a body by more than the tolerance"""
    witness: str | None = None
    """second method that confirms a refined truth"""
    difference: float = 0.0
    """m; of a refined truth, its largest distance from the previous halving of dt: smaller errors mean nothing"""

    def is_run_of(self, engine: str, settings: Settings) -> bool:
        """Return whether a run of an engine is this trajectory, so that its error is 0 by definition.

        Args:
            engine: name of the engine.
            settings: settings as the engine resolved them. The frames do not matter, nor those of `exact`, which only
                choose its frames.
        """
        if self.kind == "closed_form" or engine != self.trajectory.info["engine"]:
            return False
        return self.kind == "exact" or _without_frames(settings) == _without_frames(
            Settings.model_validate(self.trajectory.info["settings"])
        )

    def __repr__(self) -> str:
        """Return kind, source and end of the truth."""
        return f"<Truth {self.kind}: {self.about}; trusted until {self.trusted_until:.4g} s>"


def _without_frames(settings: Settings) -> dict[str, object]:
    return settings.model_dump(exclude={"record_every"})


def frame_settings(settings: Settings) -> Settings:
    """Return settings with only the times of the frames; all other choices are left to the engine."""
    return Settings(dt=settings.dt, record_every=settings.record_every)


TRUTH_RUNS: Mapping[TruthKind, float] = {"closed_form": 0.0, "exact": 1.0, "refined": 15.0}
"""Cost of a truth in that of its finest run: before it, dt is halved several times, and a second method and perturbed
runs confirm it. That took 14 times the finest run for `chain_of_20`."""


def run_cost(scene: Scene, run: Trajectory) -> float:
    """Return the counted cost of a run of a scene by an engine, s."""
    info = run.info
    settings = Settings.model_validate(info["settings"])
    return counted_cost(scene, info["engine"], settings, info["steps"], info["work"])


def truth_cost(scene: Scene, truth: Truth) -> float:
    """Return the counted cost of finding the truth of another start of a scene, s, from that of its own."""
    runs = TRUTH_RUNS[truth.kind]
    return runs * run_cost(scene, truth.trajectory) if runs else 0.0


def truth_of(scene: Scene, settings: Settings, tolerance: float) -> Truth | None:
    """Return the best known solution of a scene, or None (`find_truth`)."""
    found = find_truth(scene, settings, tolerance)
    return found if isinstance(found, Truth) else None


def find_truth(scene: Scene, settings: Settings, tolerance: float) -> Truth | str:
    """Return the best known solution of a scene: closed form, exact engine, or a run refined until it converges.

    A refined result counts as the truth up to the time to which a second method and the conservation laws confirm it
    (`confirm`). It depends on the scene, the times of its frames and the tolerance, but not on the engine that is
    scored.

    Args:
        scene: the scene.
        settings: dt and recorded frames.
        tolerance: tolerance of positions, m.

    Returns:
        The truth, or the reason why there is none.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    form = solution(scene)
    if form is not None:
        return Truth("closed_form", form.about, solution_run(form, settings), scene.world.duration)

    note = ""
    exact = ENGINES.get("exact")
    if exact is not None and not exact.missing(scene, frame_settings(settings)):
        doubtful = next(event_warnings(scene, contact_matrix(scene)), None) is not None
        try:
            found, _ = bounded_run(
                scene, "exact", frame_settings(settings), DOUBTFUL_EXACT_LIMIT if doubtful else EXACT_LIMIT, audit=False
            )
        except RunTimeoutError as error:
            note = f"; exact was stopped: {error}"
        else:
            if found.status == "ok":
                until = _predictable_until(scene, "exact", frame_settings(settings), found, tolerance)
                return Truth("exact", f"event-driven, models the whole scene{_chaos_note(scene, until)}", found, until)
            note = f"; exact {found.status}: {found.reason}"

    finest = refine(scene, settings, tolerance)
    if finest is None:
        able = any(not engine.missing(scene, settings) for engine in ENGINES.values())
        why = "no engine reaches a result that a smaller step confirms" if able else "no engine can run the scene"
        return f"{why}{note}"
    until = min(finest.agrees_until, finest.horizon)
    cause = f"; {finest.about}" if until == finest.agrees_until else _chaos_note(scene, until)
    confirmation = confirm(scene, finest, settings, tolerance, until)
    times = "once" if finest.halvings == 1 else f"{finest.halvings} times"
    method = f"{finest.engine}, dt halved {times}"
    if confirmation.until < until:
        until = confirmation.until
        cause = f"; no truth is known after {until:.4g} s: {confirmation.about}"
    if until == 0.0 and scene.world.duration > 0.0:
        return f"{confirmation.about or finest.about} (unconfirmed result: {method}){note}"
    if confirmation.by is not None:
        method = f"{method}, confirmed by {confirmation.by}"
    return Truth("refined", f"{method}{cause}{note}", finest.trajectory, until, confirmation.by, finest.difference)


def _predictable_until(scene: Scene, engine: str, settings: Settings, found: Trajectory, tolerance: float) -> float:
    """Return the time up to which two opposite perturbations change nothing beyond the tolerance, s.

    An engine resolves simultaneous impacts in some order, which is likely that of one of the two. If there are such
    impacts, more perturbations try more orders.
    """
    until = scene.world.duration
    for seed in range(ORDERS if _has_simultaneous_impacts(found) else 1):
        for reverse in (False, True):
            other = perturb(scene, seed=seed, reverse=reverse)
            if other is not None:
                again = run(other, engine, audit=False, **settings.model_dump()).of_first(len(scene.bodies))
                until = min(until, agreement_time(found, again, scene, tolerance))
    return until


def _has_simultaneous_impacts(run: Trajectory) -> bool:
    """Return whether a body has two impacts at one time. Impacts in a row of touching balls count too."""
    hits = np.flatnonzero(are_collisions(run))
    order = hits[np.argsort(run.contact_time[hits], kind="stable")]
    time, pair = run.contact_time[order], run.contact_pair[order]
    moment = np.cumsum(np.diff(time, prepend=-np.inf) > SIMULTANEOUS * np.maximum(time, 1.0))
    body = pair.ravel()
    keys = np.column_stack((np.repeat(moment, 2), body))[body >= 0]
    return len(np.unique(keys, axis=0)) < len(keys)


def _chaos_note(scene: Scene, until: float) -> str:
    note = f"; later motion is unpredictable: it changes if every body is moved by {PERTURBATION:g} m"
    return note if until < scene.world.duration else ""
