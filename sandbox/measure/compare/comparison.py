"""Comparison: one scene on several engines, or with several values of a setting, each run timed and scored."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Unpack

import numpy as np

from sandbox.engines.registry import ENGINES, USUAL, able, engine_named
from sandbox.formatting import format_plural
from sandbox.measure.compare.attribution import one_at_a_time, verdict
from sandbox.measure.compare.contact_matching import match_contacts
from sandbox.measure.compare.end_statistics import MIN_END_STARTS, end_ensemble
from sandbox.measure.compare.ground_truth import Truth, find_truth, run_cost, truth_cost
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.compare.result import (
    Comparison,
    Row,
    Score,
    Sweep,
    Variant,
    physics_of,
    set_text,
    short_key,
    truth_settings,
    variants_of,
)
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.metrics.invariants import energy_drift, momentum_drift
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.run.recorder import require_memory
from sandbox.measure.run.runner import run
from sandbox.measure.starts import DEFAULT_SPREAD, MAX_STARTS, Starts, check_spread
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings, SettingsChanges
from sandbox.scene.files.load import as_scene
from sandbox.schedule import with_whole_steps
from sandbox.signals import defer_interrupt
from sandbox.trajectory import Trajectory

START_EFFORT = 120.0
"""Counted work of the runs and truths of other starts of a variant, s"""
MAX_REPEATED_SECONDS = 5.0
"""s: a run no longer than this is timed a second time, because the first may have loaded compiled code from disk."""
NEGLIGIBLE = 1e-6
"""Fraction of the tolerance below which an error needs no explanation."""


def compare(
    scene: Scene | str | Path,
    engines: Sequence[str] | None = None,
    *,
    sweep: Sweep | None = None,
    tolerance: float | None = None,
    why: bool = False,
    truth: Truth | None = None,
    starts: int = 1,
    spread: float = DEFAULT_SPREAD,
    on_progress: ProgressCallback | None = None,
    **settings: Unpack[SettingsChanges],
) -> Comparison:
    """Run a scene on several engines, or with several values of a setting, and score each run against the truth.

    The truth is the closed form of the scene, if it has one. Otherwise it is `exact`, or a fixed step refined until it
    converges, up to the time to which a second method confirms it. Errors, contacts and divergence are measured up to
    `trusted_until`, drifts of energy and momentum over the whole run. A duration that is not a whole number of steps is
    taken to the next one, so that all runs end at the same time.

    With several `starts`, each row also has its errors over perturbed starts (`Starts`), each against a truth of its
    own; or, if the truth is not trusted to the end, the statistics of the end against those of the truth's
    method (`EndStatistics`).

        sandbox.compare(scene, sweep={"solver.integrator": ["explicit_euler", "velocity_verlet", "rk4"]})

    Args:
        scene: the scene, or its name or path, as `load` takes it.
        engines: names of the engines, or one name; default: all. An engine that cannot run the scene gets a
            row with the reason. With a sweep, the default is the engines that can run every value.
        sweep: values by key, such as `{"solver.dt": [0.01, 0.001]}`. Each value is a row; several keys give each
            combination of their values.
        tolerance: position error beyond which a run has diverged from the truth, m; default: 1 % of the smallest radius
            or half width of the moving bodies.
        why: rerun each engine whose error is not negligible with other settings, and report the changes that lower the
            error.
        truth: truth of this scene, with its frames and the tolerance, if already known; not with a sweep.
        starts: number of perturbed starts, besides that in the scene; 1: none. There are fewer if their runs and
            truths would take more counted work than `START_EFFORT`.
        spread: largest change of a start, as a fraction: 0.01 moves bodies by up to 1 % of the smallest half width.
        on_progress: progress callback; its message describes each stage.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Returns:
        One row for each engine and combination of values; after Ctrl-C the finished rows, if there are any.

    Raises:
        UnknownEngineError: no engine has one of the names.
        TooLargeError: the frames of all runs would not fit into memory together.
        ValueError: the tolerance is not positive and finite; or a sweep is empty, too large, or has a key that
            `settings` sets too; or `starts` or `spread` is out of range.
        SceneError: a swept key or value is invalid.
        SettingsError: a setting is invalid.

    Example:
        >>> found = sandbox.compare("spring", "pymunk", dt=0.01)
        >>> [row.engine for row in found.rows]
        ['pymunk']
    """
    scene = as_scene(scene)
    both = [key for key in sweep or () if short_key(key) in settings]
    if both:
        raise ValueError(f"{', '.join(both)}: both swept and set; remove one")
    if sweep and truth is not None:
        raise ValueError("truth: belongs to one scene and one set of frames; leave it out with a sweep")
    wanted = scene.solver.replace(**settings) if settings else scene.solver
    scene_as_set = scene.model_copy(update={"solver": wanted}) if settings and sweep else scene
    variants = variants_of(scene_as_set, sweep) if sweep else [Variant(scene)]
    return compare_variants(
        variants,
        engines,
        tolerance=tolerance,
        why=why,
        truth=truth,
        starts=starts,
        spread=spread,
        on_progress=on_progress,
        **({} if sweep else settings),
    )


def compare_variants(
    variants: Sequence[Variant],
    engines: Sequence[str] | None = None,
    *,
    tolerance: float | None = None,
    why: bool = False,
    truth: Truth | None = None,
    starts: int = 1,
    spread: float = DEFAULT_SPREAD,
    on_progress: ProgressCallback | None = None,
    **settings: Unpack[SettingsChanges],
) -> Comparison:
    """Run the variants of a scene on engines, and score each run against the truth of its variant.

    Args:
        variants: at least one variant; if there are several, `set` of each has its swept values.
        engines: names of the engines; defaults as in `compare`.
        tolerance: tolerance of positions, m.
        why: explain the errors.
        truth: truth of the first variant.
        starts: number of perturbed starts; 1: none.
        spread: largest change of a start, as a fraction.
        on_progress: progress callback; its message describes each stage.
        settings: changes to `[solver]`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        TooLargeError: the frames of all runs would not fit into memory together.
        ValueError: the tolerance is not positive and finite; `starts` or `spread` is out of range.
        SettingsError: a setting is invalid.
    """
    if not 1 <= starts <= MAX_STARTS:
        raise ValueError(f"starts: must be from 1 to {MAX_STARTS:,}, is {starts}")
    check_spread(spread)
    engines = [engines] if isinstance(engines, str) else engines
    for name in engines or ():
        engine_named(name)
    wanted = [each.scene.solver.replace(**settings) if settings else each.scene.solver for each in variants]
    same_scene = len(variants) == 1 or len({physics_of(each.scene) for each in variants}) == 1
    variants = [
        replace(each, scene=with_whole_steps(each.scene, own.dt)) for each, own in zip(variants, wanted, strict=True)
    ]
    first = variants[0].scene
    plan = list(zip(variants, wanted, _engines_of(variants, wanted, engines), strict=True))
    if tolerance is None:
        tolerance = min(default_tolerance(each.scene) for each in variants)
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"a tolerance of {tolerance} m; it must be positive and finite")
    count = sum(len(names) for _, _, names in plan)
    for variant, own, _ in plan:
        # All runs are in memory at once: those of the engines, the truths, and two more while a truth is found.
        require_memory(variant.scene, own, len(variant.scene.bodies) * (count + len(variants) + 2))

    truths: dict[tuple[str, float, int], Truth | str] = {}
    if truth is not None:
        truths[_truth_key(first, wanted[0])] = truth
    scoring = _Scoring(tolerance, why, wanted, on_progress or ignore_progress, truths)
    interrupted = False
    try:
        for variant, own, names in plan:
            scoring.score_variant(variant, own, names)
        if starts > 1:
            longest = max(own.dt for own in wanted)
            for variant, own, _ in plan:
                scoring.score_starts(variant, own, Starts(variant.scene, spread, longest), starts)
    except KeyboardInterrupt:
        if not scoring.rows:
            raise
        interrupted = starts > 1 or len(scoring.rows) < count
    answer = truths[_truth_key(first, wanted[0])]
    best, doubt = (answer, None) if isinstance(answer, Truth) else (None, answer)
    return Comparison(
        scene=first,
        best=best,
        tolerance=tolerance,
        rows=tuple(scoring.rows),
        trajectories=scoring.runs,
        doubt=doubt,
        interrupted=interrupted,
        truths=scoring.row_truths,
        same_scene=same_scene,
        starts=starts,
        spread=spread,
        starts_about=scoring.starts_about,
    )


def _affordable(effort: float, cost: float, count: int) -> int:
    """Return how many of some starts an effort allows, s, if each costs some counted work, s."""
    return min(count, math.floor(effort / cost)) if cost > 0.0 else count


def _starts_text(what: str, count: int, asked: int, starts: Starts) -> str:
    """Return over how many perturbed starts something is measured, and how they differ."""
    fewer = "" if count == asked else f", not {asked:,}, which would exceed the counted work of {START_EFFORT:g} s"
    return f"{what} {format_plural(count, 'perturbed start')}{fewer}, with {starts}"


@dataclass
class _Scoring:
    """Runs and scores of a comparison so far."""

    tolerance: float
    why: bool
    all_settings: Sequence[Settings]
    """settings of all variants"""
    report: ProgressCallback
    truths: dict[tuple[str, float, int], Truth | str]
    """truth, or the reason why there is none, by scene and times of the frames"""
    rows: list[Row] = field(default_factory=list)
    runs: dict[str, Trajectory] = field(default_factory=dict)
    row_truths: dict[str, Truth | None] = field(default_factory=dict)
    starts_about: str | None = None
    """perturbed starts that were run, or the reason why there are none; None if no row needs them"""

    def score_variant(self, variant: Variant, settings: Settings, engines: Sequence[str]) -> None:
        """Find the truth of a variant, and run and score each engine."""
        truth = self._truth(variant.scene, settings)
        for name in engines:
            self.report(Progress(", ".join(filter(None, (name, set_text(variant.set))))))
            run = timed_run(variant.scene, name, settings)
            row = replace(score_run(variant.scene, name, settings, run, truth, self.tolerance), set=variant.set)
            if self.why and truth is not None and _has_error(row, self.tolerance):
                self.report(Progress(f"{row.name}: why"))
                row = _with_attribution(variant.scene, row, settings, truth)
            with defer_interrupt():
                self.rows.append(row)
                self.row_truths[row.name] = truth
                if len(run.time):
                    self.runs[row.name] = run

    def score_starts(self, variant: Variant, settings: Settings, starts: Starts, count: int) -> None:
        """Run each engine that reached its end from perturbed starts too, as many as `START_EFFORT` allows."""
        scene, truth = variant.scene, self._truth(variant.scene, settings)
        rows = [k for k, row in enumerate(self.rows) if row.set == variant.set and row.status == "ok"]
        rows = [k for k in rows if not self.rows[k].is_truth]
        if not rows:
            return
        if truth is None or not starts.can_vary:
            self.starts_about = "no other starts: " + ("no truth is known" if truth is None else "none would differ")
            return
        cost = sum(run_cost(scene, self.runs[self.rows[k].name]) for k in rows)
        if truth.trusted_until < scene.world.duration:
            self._score_ends(rows, settings, starts, truth, count, cost)
            return
        affordable = _affordable(START_EFFORT, truth_cost(scene, truth) + cost, count)
        known: dict[int, EvaluationContext] = {}
        for k in rows if affordable else ():
            row = self.rows[k]
            self.report(Progress(f"{row.name}: from {affordable} other starts"))
            errors = [self._error(row.engine, settings, starts, n, known) for n in range(1, affordable + 1)]
            found = FreshStarts.of([error for error in errors if not math.isnan(error)], self.tolerance)
            self.rows[k] = replace(row, start_errors=found)
        self.starts_about = _starts_text("errors over", affordable, count, starts)

    def _score_ends(
        self, rows: Sequence[int], settings: Settings, starts: Starts, truth: Truth, count: int, cost: float
    ) -> None:
        """Compare the ends of rows, by their indices, with those of the truth's method; `cost` is that of all, s."""
        context = EvaluationContext(starts.scene, truth)
        affordable = _affordable(0.5 * START_EFFORT, cost, count)
        ensemble = end_ensemble(context, starts, settings, affordable, 0.5 * START_EFFORT, self.tolerance)
        if ensemble is None:
            cause = f"that takes {MIN_END_STARTS} of them"
            if count >= MIN_END_STARTS:
                cause = f"{cause}, which exceed the counted work of {START_EFFORT:g} s"
            self.starts_about = f"ends from other starts were not compared: {cause}"
            return
        for k in rows:
            row = self.rows[k]
            self.report(Progress(f"{row.name}: the ends of runs from {ensemble.count} other starts"))
            ends = ensemble.compare(row.engine, settings, range(1, ensemble.count + 1))
            self.rows[k] = replace(row, end_statistics=ends)
        self.starts_about = _starts_text("ends compared over", ensemble.count, count, starts)

    def _error(
        self, engine: str, settings: Settings, starts: Starts, number: int, known: dict[int, EvaluationContext]
    ) -> float:
        """Return the largest position error from a start, m; infinite if the run fails, nan if it has no truth.

        Args:
            engine: name of the engine.
            settings: its settings.
            starts: perturbed starts.
            number: of the start.
            known: scenes and truths of the starts so far; the new one is added.
        """
        if number not in known:
            scene = starts.start(number)
            truth = find_truth(scene, truth_settings(settings, self.all_settings), self.tolerance)
            known[number] = EvaluationContext(scene, truth if isinstance(truth, Truth) else None)
        scene = known[number].scene
        found = run(scene, engine, audit=False, **settings.model_dump()).of_first(len(scene.bodies))
        error = Score.of(found, known[number]).max_position if found.status == "ok" else math.inf
        return math.nan if error is None else error

    def _truth(self, scene: Scene, settings: Settings) -> Truth | None:
        key = _truth_key(scene, settings)
        if key not in self.truths:
            self.report(Progress("the truth"))
            self.truths[key] = find_truth(scene, truth_settings(settings, self.all_settings), self.tolerance)
        found = self.truths[key]
        return found if isinstance(found, Truth) else None


def _engines_of(
    variants: Sequence[Variant], wanted: Sequence[Settings], engines: Sequence[str] | None
) -> list[list[str]]:
    """Return the engines that run each variant.

    They are the named engines, or all engines if there is no sweep. In a sweep they are those that can run every
    variant; if there are none, those that can run the variant.
    """
    if engines is not None:
        return [list(dict.fromkeys(engines))] * len(variants)
    if not variants[0].set:
        return [list(ENGINES)] * len(variants)
    each = [able(variant.scene, own) for variant, own in zip(variants, wanted, strict=True)]
    common = [name for name in ENGINES if all(name in names for names in each)]
    return [common or list(names) or [USUAL] for names in each]


def _truth_key(scene: Scene, settings: Settings) -> tuple[str, float, int]:
    """Return the key of a truth: the scene, and the times of its frames."""
    return physics_of(scene), settings.dt, settings.record_every


def timed_run(scene: Scene, engine: str, settings: Settings) -> Trajectory:
    """Run an engine, and return the run of the scene's own bodies.

    A short run is made twice and the faster one returned: the first may have loaded compiled code.
    """
    count = len(scene.bodies)
    first = run(scene, engine, audit=False, **settings.model_dump()).of_first(count)
    if first.status == "refused" or first.info["seconds"] > MAX_REPEATED_SECONDS:
        return first
    second = run(scene, engine, audit=False, **settings.model_dump()).of_first(count)
    return min(first, second, key=lambda each: float(each.info["seconds"]))


def score_run(
    scene: Scene, engine: str, settings: Settings, run: Trajectory, truth: Truth | None, tolerance: float
) -> Row:
    """Score a run against the truth; without a truth, only by the conservation laws.

    Args:
        scene: scene of the run.
        engine: name of the engine.
        settings: settings given to the engine.
        run: the run.
        truth: truth of the scene.
        tolerance: position error beyond which the run has diverged, m.
    """
    row = Row(engine=engine, status=run.status, reason=run.reason, settings=run.info["settings"])
    if truth is not None:
        row = replace(row, truth=truth.kind, trusted_until=truth.trusted_until)
    if run.status == "refused":
        return row
    path = None if truth is None else truth.trajectory
    energy = energy_drift(run, scene, path, row.trusted_until == scene.world.duration)
    row = replace(
        row,
        seconds=float(run.info["seconds"]),
        momentum_drift=momentum_drift(run, scene),
        energy_drift=energy.fraction,
        energy_against=energy.against,
    )
    if truth is None:
        return row
    context, until, last = EvaluationContext(scene, truth), truth.trusted_until, float(run.time[-1])
    first = context.errors(run).first_above(tolerance, until)
    if first is None and run.status == "diverged" and last <= until:
        first = last
    return replace(
        row,
        is_truth=run.status == "ok" and truth.is_run_of(engine, Settings.model_validate(run.info["settings"])),
        score=Score.of(run, context),
        first_divergence=first,
        events=match_contacts(run, truth.trajectory, scene, settings.dt, tolerance, min(until, last)),
    )


def _has_error(row: Row, tolerance: float) -> bool:
    error = row.score.max_position
    return error is not None and error > NEGLIGIBLE * tolerance and bool(np.isfinite(error))


def _with_attribution(scene: Scene, row: Row, settings: Settings, truth: Truth) -> Row:
    before = row.score.max_position
    assert before is not None
    effects = one_at_a_time(EvaluationContext(scene, truth), row.engine, settings, before)
    return replace(row, why=effects, verdict=verdict(row.engine, effects, before))
