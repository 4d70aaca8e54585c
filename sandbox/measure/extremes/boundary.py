"""Boundary of an axis: the last level that passes, found by bisection."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sandbox.measure.extremes.experiment import Axis, AxisPair, EngineSetup, Scale
from sandbox.measure.extremes.outcome import Outcome, PairSample, Sample, Task
from sandbox.measure.extremes.survival import (
    RunStart,
    StartSampling,
    Survival,
    is_below_held,
    survival,
    survival_bounds,
)
from sandbox.measure.proportion import Proportion

TOLERANCE = 0.01
"""Relative width to which a boundary is found; whole numbers are found exactly."""
MAX_HALVINGS = 40
NEIGHBOUR_FACTORS = (0.9, 1.1)
"""Factors of the levels beside a boundary at which it is checked that nothing fails before it, or passes behind it."""

Predicate = Callable[[float], bool]
Submit = Callable[[Task], Outcome]
OnSample = Callable[[Sample], None]


@dataclass(frozen=True)
class Bracket:
    """Levels on both sides of a boundary."""

    limit: float | None
    """last level that passes before the first failure; None if the easiest level fails"""
    first_failure: float | None
    """first level that fails; None if none does"""
    monotone: bool
    """whether no sampled level passes behind the boundary, and none fails before it"""


@dataclass(frozen=True)
class Boundary:
    """Boundary of an axis on an engine configuration."""

    axis: str
    engine: str
    settings: Mapping[str, Any]
    """settings of the engine configuration"""
    setup: str
    """name of the engine configuration"""
    limit: float | None
    """last level that passes before the first failure; None if the easiest level fails"""
    first_failure: float | None
    """first level that fails; None if none does"""
    reason: str
    """reason for the first failure, or for a missing boundary"""
    rule: str | None = None
    """rule broken at the first failure"""
    monotone: bool = True
    """whether no sampled level passes behind the boundary, and none fails before it"""
    refused: bool = False
    """whether the engine refused every level"""
    unit: str = ""
    bounds: tuple[float | None, float | None] | None = None
    """levels between which survival falls below 95 %, see `survival_bounds`: the hardest up to which every start
    survived, and the easiest beyond the limit whose survival is below 95 %; None if the engine refused every level"""
    limit_survived: Proportion | None = None
    """starts that survived at the limit; None without a limit"""
    failure_survived: Proportion | None = None
    """starts that survived at the first failure; None without one"""
    cost_ratio: float | None = None
    """counted cost of a run at the easiest level, relative to that of plain pymunk; None without both runs"""
    limit_at_equal_cost: float | None = None
    """limit / cost_ratio where levels are proportional to the time step: with that step, plain pymunk costs as much as
    this setup at its limit; None on other axes"""


def run_axis(
    axis: Axis,
    setup: EngineSetup,
    levels: Sequence[float],
    overrides: tuple[str, ...],
    submit: Submit,
    on_sample: OnSample,
    *,
    bisect: bool = True,
    sampling: StartSampling | None = None,
) -> Boundary:
    """Run an axis on an engine configuration, level by level, and find its boundary.

    Refused levels do not count: a boundary lies between a level that passed and one that failed. A level that fails is
    run until that is certain; then at the first failure, and at levels that are not certainly below 95 % or of which
    some starts survive, all starts are run.

    Args:
        axis: the axis.
        setup: the engine configuration.
        levels: levels from the easiest to the hardest.
        overrides: `KEY=VALUE`, changes to every scene.
        submit: runs a task.
        on_sample: called with each finished sample, and again if more of its starts are run.
        bisect: whether to bisect between the levels.
        sampling: from which starts a level is run; default: that of the scene.
    """
    sampling = sampling or StartSampling(1)
    samples: dict[float, Sample] = {}
    survivals: dict[float, Survival] = {}

    def run_start(level: float) -> RunStart:
        task = Task(axis.case.name, {axis.parameter: level}, setup.engine, dict(setup.changes), overrides)
        return lambda number: submit(replace(task, start=number, spread=sampling.spread))

    def keep(level: float, found: Survival) -> Sample:
        survivals[level] = found
        settings = dict(setup.changes)
        samples[level] = Sample(
            axis.name, level, setup.engine, settings, setup.name, found.outcome(), survived=found.survived
        )
        on_sample(samples[level])
        return samples[level]

    def run_level(level: float) -> Sample:
        return keep(level, survival(run_start(level), sampling))

    for level in levels:
        run_level(level)
    known = {level: sample.passed for level, sample in samples.items() if sample.verdict != "refused"}
    if not known:
        bracket, reason, rule = Bracket(None, None, True), samples[levels[0]].outcome.reason, None
    else:
        # If the time limit stopped the first failure, another machine gets farther: that is not worth a bisection.
        is_slow = next((each.outcome.slow for each in samples.values() if each.verdict == "failed"), False)
        passes = None if is_slow or not bisect else lambda level: run_level(level).passed
        bracket = find_boundary(known, passes, axis.scale)
        for level, found in tuple(survivals.items()):
            is_certain = found.survived is not None and found.survived.hits == 0 and is_below_held(found.survived)
            if found.remaining and (not is_certain or level == bracket.first_failure):
                keep(level, found.run(run_start(level), to_end=True))
        reason, rule = "no level failed", None
        if bracket.first_failure is not None:
            failure = samples[bracket.first_failure].outcome
            reason, rule = failure.reason, failure.rule
    survived = {level: each.survived for level, each in samples.items()}
    return Boundary(
        axis=axis.name,
        engine=setup.engine,
        settings=dict(setup.changes),
        setup=setup.name,
        limit=bracket.limit,
        first_failure=bracket.first_failure,
        reason=reason,
        rule=rule,
        monotone=bracket.monotone,
        refused=not known,
        unit=axis.unit,
        bounds=survival_bounds(survived, bracket.limit, levels) if known else None,
        limit_survived=None if bracket.limit is None else survived[bracket.limit],
        failure_survived=None if bracket.first_failure is None else survived[bracket.first_failure],
    )


def run_pair(
    pair: AxisPair, setup: EngineSetup, overrides: tuple[str, ...], submit: Submit, on_sample: OnSample
) -> None:
    """Run every combination of a pair's levels on an engine configuration, from the start of the scene only."""
    for both in pair.levels:
        parameters = {pair.first.parameter: both[0], pair.second.parameter: both[1]}
        outcome = submit(Task(pair.case.name, parameters, setup.engine, dict(setup.changes), overrides))
        names = pair.first.parameter, pair.second.parameter
        on_sample(PairSample(pair.name, both, setup.engine, dict(setup.changes), setup.name, outcome, axes=names))


def find_boundary(
    levels: Mapping[float, bool], passes: Predicate | None, scale: Scale, tolerance: float = TOLERANCE
) -> Bracket:
    """Return the boundary between the levels that pass and those that fail.

    Args:
        levels: whether each known level passes, from the easiest to the hardest.
        passes: returns whether another level passes; None to use the known levels only.
        scale: how the interval between two levels is halved.
        tolerance: relative width to which the boundary is found.
    """
    known = dict(levels)
    order = list(levels)
    is_rising = len(order) < 2 or order[-1] > order[0]
    failed = next((k for k, level in enumerate(order) if not known[level]), None)
    if failed is None:
        return Bracket(order[-1] if order else None, None, True)
    if failed == 0:
        return Bracket(None, order[0], not any(known.values()))
    good, bad = order[failed - 1], order[failed]
    if passes is None:
        return Bracket(good, bad, not any(known[level] for level in order[failed:]))
    for _ in range(MAX_HALVINGS):
        middle = halfway(good, bad, scale)
        if middle in (good, bad) or abs(bad - good) <= tolerance * max(abs(good), abs(bad)):
            break
        known[middle] = passes(middle)
        good, bad = (middle, bad) if known[middle] else (good, middle)
    for level in _neighbours(good, bad, is_rising, scale, order):
        if level not in known:
            known[level] = passes(level)
    before = [passed for level, passed in known.items() if (level <= good if is_rising else level >= good)]
    behind = [passed for level, passed in known.items() if (level >= bad if is_rising else level <= bad)]
    return Bracket(good, bad, all(before) and not any(behind))


def halfway(a: float, b: float, scale: Scale) -> float:
    """Return the middle of two levels: the geometric mean, or the arithmetic one from or to 0 and on linear scales."""
    if scale == "whole":
        middle = round(math.sqrt(a * b)) if a > 0 and b > 0 else (a + b) // 2
        inside = min(a, b) < middle < max(a, b)
        return middle if inside else (min(a, b) + 1 if abs(a - b) > 1 else a)
    if scale == "log" and a * b > 0.0:
        return math.copysign(math.sqrt(a) * math.sqrt(b), a) if a > 0 else -math.sqrt(a * b)
    return 0.5 * (a + b)


def _neighbours(good: float, bad: float, is_rising: bool, scale: Scale, order: list[float]) -> list[float]:
    """Return a level shortly before and one shortly behind a boundary, within the range of the levels."""
    less, more = NEIGHBOUR_FACTORS if is_rising else NEIGHBOUR_FACTORS[::-1]
    found = [good * less, bad * more]
    if scale == "whole":
        found = [round(level) for level in found]
    return [level for level in found if min(order) <= level <= max(order)]
