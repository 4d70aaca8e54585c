"""Survival of a level: the fraction of its perturbed starts in which no rule is broken.

A level passes if at least 95 % of its starts do. The start of the scene is no trial, because scenarios choose it as the
worst phase or a perfect alignment: it is run for the verdict, the error and the check that a repeated run is the same.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from sandbox.measure.extremes.outcome import PASSED, Outcome
from sandbox.measure.proportion import Proportion
from sandbox.measure.starts import DEFAULT_SPREAD, HELD_FRACTION, allowed_failures, check_spread

LEVEL_STARTS = 20
"""Default number of starts of a level, the fewest of which one may fail."""
MAX_COST = 0.1
"""s, mean counted cost of a start: a level whose runs cost more has fewer starts, for the same cost in all."""
MIN_STARTS = 5
"""Where the cost does not allow as many, a level is run from the start of the scene only."""

RunStart = Callable[[int], Outcome]


@dataclass(frozen=True)
class StartSampling:
    """From which starts a level is run."""

    count: int = LEVEL_STARTS
    """number of perturbed starts; 1: the start of the scene only"""
    spread: float = DEFAULT_SPREAD
    """largest change of a start, as in `Starts`"""

    def __post_init__(self) -> None:
        """Raise ValueError if the count is not positive or the spread not from 0 to `MAX_SPREAD`."""
        if self.count < 1:
            raise ValueError(f"starts: must be at least 1, is {self.count}")
        check_spread(self.spread)

    def numbers(self, first: Outcome) -> range:
        """Return the numbers of the starts that are trials, by the outcome of the start of the scene."""
        if self.count < 2 or first.slow:
            return range(1)
        affordable = math.floor(self.count * MAX_COST / first.cost) if first.cost else self.count
        return range(1, min(self.count, affordable) + 1) if affordable >= min(MIN_STARTS, self.count) else range(1)


@dataclass(frozen=True)
class Survival:
    """Outcomes of a level: that of the start of the scene, and those of its trials so far."""

    first: Outcome
    """of the start of the scene"""
    trials: tuple[Outcome, ...] = ()
    """of the trials that have been run, without those that the engine refused"""
    remaining: tuple[int, ...] = ()
    """numbers of the starts that have not been run"""

    @property
    def survived(self) -> Proportion | None:
        """Trials in which no rule was broken; None if the engine refused the level."""
        passed = sum(each.verdict in PASSED for each in self.trials)
        return Proportion(passed, len(self.trials)) if self.trials else None

    @property
    def is_failed(self) -> bool:
        """Whether the level fails, whatever the outcomes of the remaining trials."""
        failures = sum(each.verdict not in PASSED for each in self.trials)
        return self.first.rule == "repeat" or failures > allowed_failures(len(self.trials) + len(self.remaining))

    def run(self, run_start: RunStart, *, to_end: bool = False) -> "Survival":
        """Return the survival with the remaining trials, up to the one after which the level fails in any case.

        Args:
            run_start: runs a start by its number.
            to_end: whether to run all trials.
        """
        found = self
        while found.remaining and (to_end or not found.is_failed):
            outcome = run_start(found.remaining[0])
            trials = found.trials if outcome.verdict == "refused" else (*found.trials, outcome)
            found = replace(found, trials=trials, remaining=found.remaining[1:])
        return found

    def outcome(self) -> Outcome:
        """Return the outcome of the level: its verdict, and the largest error of the starts that survived.

        Figures and predictions are those of the start of the scene.
        """
        if self.trials in ((), (self.first,)):
            return self.first
        seconds = self.first.seconds + sum(each.seconds for each in self.trials)
        failures = [each for each in self.trials if each.verdict not in PASSED]
        found = replace(self.first, seconds=seconds, slow=any(each.slow for each in failures))
        if self.first.rule == "repeat":
            return found
        text = ""
        if failures:
            text = f"{len(failures)} of {len(self.trials)} starts failed, the first: {failures[0].reason}"
        if self.is_failed:
            return replace(found, verdict="failed", reason=text, rule=failures[0].rule, error=failures[0].error)
        survivors = [each for each in (self.first, *self.trials) if each.verdict in PASSED]
        worst = max(survivors, key=lambda each: -1.0 if each.error is None else each.error)
        own = f"the start of the scene failed: {self.first.reason}" if self.first.verdict == "failed" else ""
        verdict = "degraded" if text or own else worst.verdict
        reason = "; ".join(filter(None, (worst.reason, text, own)))
        return replace(found, verdict=verdict, reason=reason, rule=None, error=worst.error)


def survival(run_start: RunStart, sampling: StartSampling) -> Survival:
    """Run a level from its starts, up to the one after which it fails in any case.

    Args:
        run_start: runs a start by its number.
        sampling: from which starts.
    """
    first = run_start(0)
    if first.verdict == "refused":
        return Survival(first)
    numbers = sampling.numbers(first)
    if numbers == range(1):
        return Survival(first, (first,))
    found = Survival(first, remaining=tuple(numbers)).run(run_start)
    return found if found.trials else Survival(first, (first,))


MAX_ERROR = 0.025
"""Largest probability that a level with a survival of exactly 95 % counts as one below 95 %."""


def is_below_held(survived: Proportion) -> bool:
    """Return whether a survival is below 95 %: if it were 95 %, so many failures would be rarer than `MAX_ERROR`.

    This is the exact binomial test, whose interval C. J. Clopper and E. S. Pearson, The use of confidence or fiducial
    limits, Biometrika 26 (1934) 404-413, state; Wilson's excludes a survival of 95 % in 8 to 10 % of such levels. It
    also holds for a level that stopped at its last failure: f failures occur by the n-th trial as often as f or more in
    n trials.
    """
    n, failures = survived.trials, survived.trials - survived.hits
    logs = math.log(1.0 - HELD_FRACTION), math.log(HELD_FRACTION)
    fewer = sum(
        math.exp(math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1) + k * logs[0] + (n - k) * logs[1])
        for k in range(failures)
    )
    return 1.0 - fewer < MAX_ERROR


def survival_bounds(
    survived: Mapping[float, Proportion | None], limit: float | None, levels: Sequence[float]
) -> tuple[float | None, float | None]:
    """Return the levels between which survival falls below 95 %.

    Args:
        survived: survival at each sampled level; None where the engine refused it.
        limit: last level that passes before the first failure; None if the easiest fails.
        levels: levels of the axis, from the easiest to the hardest.

    Returns:
        The hardest level, up to the limit, with no failure there or at an easier one, None if there is none; and the
        easiest level beyond the limit whose survival is below 95 % (`is_below_held`), or that fails and is run from one
        start only, None if there is none.
    """
    low, high, is_beyond, has_failures = None, None, limit is None, False
    for level in sorted(survived, reverse=levels[-1] < levels[0]):
        found = survived[level]
        if found is None:
            continue
        has_failures |= found.hits < found.trials
        if is_beyond and high is None and (is_below_held(found) or (found.hits, found.trials) == (0, 1)):
            high = level
        if not is_beyond and not has_failures:
            low = level
        is_beyond |= level == limit
    return low, high
