"""A row of the benchmarks: the timed workload, its peer, the claim, and the comparison of their timings."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from tools.benchmarks.workloads import Timed

RESAMPLES = 4000
"""Resamples of an interval: its ends vary by less than the second digit of a ratio."""


class Bench(NamedTuple):
    """A row: our workload, the peer, and the claimed target."""

    name: str
    about: str
    ours: Callable[[], Timed]
    peer: Callable[[], Timed]
    target: float | None = None
    """largest ratio, or for `above` largest difference in seconds; for a rate, the smallest value of ours"""
    unit: str = "s"
    above: bool = False
    """whether the result is the difference of ours and the peer, not their ratio"""
    rate: bool = False
    """whether both sides return amounts per second"""
    missing: Callable[[], str | None] | None = None
    """returns the reason why an optional peer is not installed, or None; with a reason the row is skipped"""
    same: Callable[[], None] | None = None
    """asserts that both sides compute the same; None if they differ by design: another method, less physics, or a
    process that is only started"""

    def result(self, ours: Sequence[float], peer: Sequence[float]) -> "Estimate":
        """Return the figure that has the target: the ratio of medians, their difference, or the median rate of ours."""
        if self.above:
            return estimate(lambda a, b: a - b, ours, peer)
        return estimate(lambda a, _: a, ours, peer) if self.rate else ratio(ours, peer)


class Estimate(NamedTuple):
    """A figure with its interval."""

    value: float
    low: float
    high: float
    """ends of the 95 % interval"""

    def spans(self, target: float) -> bool:
        """Return whether the interval contains a target, so that more repeats could decide otherwise."""
        return self.low <= target <= self.high


def ratio(ours: Sequence[float], peer: Sequence[float]) -> Estimate:
    """Return the ratio of the medians of two sides that took turns, with its 95 % interval."""
    return estimate(lambda a, b: a / b, ours, peer)


def estimate(
    figure: Callable[[np.ndarray, np.ndarray], np.ndarray], ours: Sequence[float], peer: Sequence[float]
) -> Estimate:
    """Return a figure of the medians of two sides that took turns, with its 95 % interval.

    The interval is a paired percentile bootstrap: both sides of a repeat are drawn together, because noise of the
    machine affects both. Over synthetic timings it contains the true ratio in 93 % of cases with 7 repeats and in 95 to
    98 % from 9 repeats on. It covers the noise within one run, not changes from run to run.

    Args:
        figure: function of the medians of both sides.
        ours: measures of our side, one per repeat.
        peer: measures of the peer in the same order.
    """
    sides = np.array([ours, peer])
    count = sides.shape[1]
    drawn = sides[:, np.random.default_rng(1).integers(0, count, (RESAMPLES, count))]
    low, high = np.quantile(figure(*np.median(drawn, axis=2)), (0.025, 0.975))
    return Estimate(float(figure(*np.median(sides, axis=1))), float(low), float(high))
