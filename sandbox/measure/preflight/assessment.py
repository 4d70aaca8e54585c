"""Assessment: the diagnostics of the formulas, confirmed or refuted by trial runs.

The trial runs cover the first part of a scene with its settings, on the chosen engine. If they cover the whole scene,
diagnostics of the formulas that none of them shows become notes; if they cover a part, what they show is added to the
diagnostics of the formulas, which remain as predictions for the rest. The work is bounded by counts, so that the result
does not depend on the machine.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from sandbox.engines.contract import Exhaustion
from sandbox.engines.registry import ENGINES, start
from sandbox.measure.preflight.checks import warnings
from sandbox.measure.preflight.diagnostic import Diagnostic, Occurrence
from sandbox.measure.preflight.predictability import event_warning
from sandbox.measure.preflight.remedies import RemedyTrials
from sandbox.measure.preflight.trial_ensemble import (
    NAMING_KINDS,
    STARTS_EFFORT,
    TrialEnsemble,
    family_of,
    obstacle_of,
    run_trials,
    shows,
)
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

MAX_EVENTS = 100_000
"""Limit of a trial run on `exact`: a tenth of its own limit in a simulated second."""
EVENT_WINDOW = 0.02
"""s over which events are counted: some tens of the longest bounces of a body that comes to rest."""
MAX_EXACT_STEPS = 5_000
"""Frames of a trial run on `exact`."""

STEPPING_ENGINES = ("pymunk", "reference")
"""Engines tried for trial runs if no engine is given, in this order."""
MAX_NAMED = 5
"""Largest number of bodies at risk of one obstacle that are diagnosed one by one."""
REFUTABLE = frozenset({"tunnelling", "depth", "chain", "mass_ratio", "stack", "spring", "iterations", "orbit"})
"""Kinds of diagnostics that trial runs of the whole scene confirm or refute on their engine."""

FORMULA_KINDS = REFUTABLE | {"entry", "lift", "kick_threshold"}
"""Kinds of diagnostics that predict, from formulas, what may happen; the others state what is so at the start."""
MIN_ODDS = 0.05
"""Smallest odds that make a warning; a problem with smaller ones is a note, unless the start of the file shows it."""


class TrialCoverage(NamedTuple):
    """Engine, duration and number of trial runs."""

    engine: str
    duration: float
    """s"""
    whole: bool
    """whether they covered the whole scene"""
    starts: int
    """number of starts, that of the file among them"""
    spread: float
    """largest change of a start, as a fraction"""
    asked: int
    """number of starts asked for"""
    limited_by: str | None
    """why there are fewer starts; None if there are as many"""


class PreflightResult(NamedTuple):
    """Result of the preflight checks."""

    warnings: list[Diagnostic]
    refuted: list[Diagnostic]
    """notes: diagnostics of the formulas that trial runs of the whole scene did not show, and rare problems"""
    tried: TrialCoverage | None
    """the trial runs; None if there were none"""

    @property
    def covered(self) -> bool:
        """Whether trial runs covered the whole scene."""
        return self.tried is not None and self.tried.whole


def run_preflight(
    scene: Scene,
    settings: Settings | None = None,
    engine: str | None = None,
    cover: float = 1.0,
    starts: int = DEFAULT_STARTS,
    spread: float = DEFAULT_SPREAD,
) -> PreflightResult:
    """Return the diagnostics of a scene, by formulas and by trial runs.

    Args:
        scene: the scene.
        settings: settings of the run; default: those of the scene.
        engine: name of the engine; default: the formulas of every engine, and trial runs on the first engine with a
            time step that supports the scene.
        cover: fraction of the scene that a trial run may cover at most; 0 for no trial run.
        starts: number of perturbed starts of the trial runs, that of the file among them; fewer where their work would
            be too much.
        spread: largest change of a start, as a fraction.
    """
    settings = scene.solver if settings is None else settings
    diagnostics = warnings(scene, settings, engine)
    if engine is None and ENGINES["exact"].missing(scene, settings):
        diagnostics = [each for each in diagnostics if each.kind != "event_rate"]
    if cover <= 0.0:
        return PreflightResult(diagnostics, [], None)
    if engine == "exact":
        return _with_events(diagnostics, scene, settings, cover, starts)
    names = [engine] if engine is not None else [name for name in STEPPING_ENGINES if name in ENGINES]
    if engine is None and scene.surface is not None:
        names = []  # a surface is a compiled kernel on every engine, whose first use takes half a minute
    trials = (run_trials(scene, settings, name, starts, spread, cover) for name in names)
    trial = next((done for done in trials if done is not None), None)
    if trial is None:
        return PreflightResult(diagnostics, [], None)
    concerned = warnings(scene, settings, trial.engine) if engine is None else diagnostics
    found, refuted = _merge(diagnostics, concerned, trial)
    remedies = RemedyTrials(trial)
    found = [remedies.with_tried(each) if each.is_observed else each for each in found]
    return PreflightResult(found, refuted, _coverage(trial, starts))


def _coverage(trial: TrialEnsemble, asked: int) -> TrialCoverage:
    """Return what trial runs cover, and why there are fewer of them than asked for."""
    count, reason = len(trial.findings), None
    if count < asked:
        reason = f"more would exceed the counted work of {STARTS_EFFORT:g} s"
        if count < trial.affordable:
            varies = trial.starts.can_vary
            reason = f"{trial.engine} cannot run another start" if varies else "no start differs from that of the file"
    return TrialCoverage(trial.engine, trial.duration, trial.whole, count, trial.starts.spread, asked, reason)


def _merge(
    diagnostics: list[Diagnostic], concerned: list[Diagnostic], trial: TrialEnsemble
) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """Return the remaining diagnostics with the findings of trial runs, and the refuted ones as notes.

    Args:
        diagnostics: diagnostics of the formulas.
        concerned: those that concern the engine of the trial runs.
        trial: the trial runs.
    """
    at_risk, others = _BodiesAtRisk(trial), _Families(trial)
    kept: list[Diagnostic] = []
    refuted: list[Diagnostic] = []
    for each in diagnostics:
        by_formula = replace(each, problem=f"by formula, {each.problem}") if each.kind in FORMULA_KINDS else each
        if each.kind not in REFUTABLE or each not in concerned:
            kept.append(by_formula)
            continue
        occurrence = (at_risk if each.kind in NAMING_KINDS else others).take(each)
        judged = replace(each, seen=occurrence)
        if occurrence.starts.hits:
            kept.append(judged)
        elif trial.has_diverged or trial.is_blind_to(each):
            kept.append(by_formula)
        elif trial.whole or (each.kind in NAMING_KINDS and not trial.may_pass(each)):
            refuted.append(judged)
        else:
            kept.append(replace(by_formula, seen=occurrence))
    found = [*kept, *at_risk.rest(), *others.rest()]
    rare = [each for each in found if is_rare(each)]
    return [each for each in found if each not in rare], [*map(_note, refuted), *rare]


def is_rare(found: Diagnostic) -> bool:
    """Return whether the odds of a problem are below `MIN_ODDS`, and the start of the file does not show it."""
    in_file = found.seen is not None and found.seen.in_file
    return found.odds_of_any is not None and found.odds_of_any < MIN_ODDS and not in_file


class _Families:
    """Problems other than those of named bodies, by family, with the starts that show them."""

    def __init__(self, trial: TrialEnsemble) -> None:
        self._trial = trial
        self._found: dict[str, tuple[Diagnostic, list[int]]] = {}
        for number, findings in enumerate(trial.findings):
            for each in findings:
                if each.kind not in NAMING_KINDS:
                    self._found.setdefault(family_of(each), (each, []))[1].append(number)
        self._taken: set[str] = set()

    def take(self, predicted: Diagnostic) -> Occurrence:
        """Return how often the problem of a diagnostic occurs, which is then not listed by itself."""
        self._taken.add(family_of(predicted))
        if family_of(predicted) not in self._found:
            return self._trial.occurrence(())
        found, starts = self._found[family_of(predicted)]
        return self._trial.occurrence(starts, found.problem)

    def rest(self) -> Iterator[Diagnostic]:
        """Yield the problems that no formula predicts, as the first start shows them."""
        for family, (found, starts) in self._found.items():
            if family not in self._taken:
                yield replace(found, seen=self._trial.occurrence(starts))


class _BodiesAtRisk:
    """Bodies that miss contacts or sink too deep, by kind and obstacle, with the starts that show it."""

    def __init__(self, trial: TrialEnsemble) -> None:
        self._trial = trial
        self._found: dict[tuple[str, str | None], dict[str, tuple[Diagnostic, list[int]]]] = {}
        for number, findings in enumerate(trial.findings):
            for each in findings:
                if each.kind in NAMING_KINDS:
                    bodies = self._found.setdefault((each.kind, obstacle_of(each, trial.scene)), {})
                    starts = bodies.setdefault(str(each.details["ball"]), (each, []))[1]
                    starts += [] if number in starts else [number]

    def take(self, predicted: Diagnostic) -> Occurrence:
        """Return how often the problem of a diagnostic occurs; the bodies that show it are not listed by themselves."""
        starts: set[int] = set()
        for bodies in self._found.values():
            for name, (found, numbers) in tuple(bodies.items()):
                if shows(found, predicted, self._trial.scene):
                    starts.update(numbers)
                    del bodies[name]
        return self._trial.occurrence(starts)

    def rest(self) -> Iterator[Diagnostic]:
        """Yield the bodies that no formula names, those in most starts first; many at one obstacle together."""
        for bodies in self._found.values():
            if not bodies:
                continue
            listed = sorted(bodies.values(), key=lambda each: -len(each[1]))
            if len(listed) > MAX_NAMED:
                yield self._together(listed)
            else:
                yield from (replace(found, seen=self._trial.occurrence(starts)) for found, starts in listed)

    def _together(self, listed: Sequence[tuple[Diagnostic, list[int]]]) -> Diagnostic:
        """Return one diagnostic for many bodies at an obstacle."""
        first, starts = listed[0][0], {number for _, shown in listed for number in shown}
        others = len(listed) - 1
        return replace(
            first,
            problem=f"{first.problem}, and {others:,} others in other starts or at other times",
            details={**first.details, "other_bodies": others},
            seen=self._trial.occurrence(starts),
        )


def _note(refuted: Diagnostic) -> Diagnostic:
    """Return a note on a diagnostic of the formulas that the trial runs did not show."""
    message = f"not confirmed, it {refuted.seen}, but another engine or setting may show it: {refuted.problem}"
    return Diagnostic(refuted.kind, message, refuted.details, refuted.remedy)


def _with_events(
    diagnostics: list[Diagnostic], scene: Scene, settings: Settings, cover: float, asked: int
) -> PreflightResult:
    """Return the diagnostics with the rate of events of a trial run on `exact`."""
    tried = run_exact_trial(scene, settings, cover) if len(scene.bodies) else None
    if tried is None:
        return PreflightResult(diagnostics, [], None)
    rate, duration, whole = tried
    reason = "events are counted from the start of the file" if asked > 1 else None
    coverage = TrialCoverage("exact", duration, whole, 1, 0.0, asked, reason)
    others = [each for each in diagnostics if each.kind != "event_rate"]
    if (warning := event_warning(rate, len(scene.bodies))) is not None:
        return PreflightResult([*others, warning], [], coverage)
    return PreflightResult(others if whole else diagnostics, [], coverage)


def run_exact_trial(scene: Scene, settings: Settings, cover: float = 1.0) -> tuple[float, float, bool] | None:
    """Run a scene on `exact` up to `MAX_EVENTS` events.

    Returns:
        Largest rate of events, 1/s, inf if the engine gave up; duration, s; and whether that was the whole scene. None
            if the engine refuses the scene.
    """
    if ENGINES["exact"].missing(scene, settings):
        return None
    simulation = start(scene, "exact", settings)
    rate, before, window = 0.0, 0, max(1, math.ceil(EVENT_WINDOW / settings.dt))
    try:
        steps = math.ceil(scene.world.duration / settings.dt)
        max_steps = min(MAX_EXACT_STEPS, math.ceil(cover * steps))
        for step in range(1, min(steps, max_steps) + 1):
            simulation.step()
            events = int(simulation.work["events"])
            if step % window == 0:
                rate, before = max(rate, (events - before) / (window * settings.dt)), events
            if events > MAX_EVENTS:
                return max(rate, (events - before) / (((step - 1) % window + 1) * settings.dt)), simulation.time, False
        return rate, simulation.time, steps <= max_steps
    except Exhaustion:
        return math.inf, simulation.time, False
    finally:
        simulation.close()
