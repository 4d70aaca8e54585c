"""Probability of an event, estimated from trials, with its confidence interval.

Source of the interval: E. B. Wilson, Probable inference, the law of succession, and statistical inference, J. Am. Stat.
Assoc. 22 (1927) 209-212; unlike p ± z √(p(1−p)/n), it also holds near 0 and 1.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

Z_95 = 1.959963984540054
"""half width of the 95 % interval in standard deviations"""


def wilson_interval(hits: int, trials: int, z: float = Z_95) -> tuple[float, float]:
    """Return the Wilson score interval of a probability, (0, 1) without trials.

    Args:
        hits: number of trials with the event.
        trials: number of trials.
        z: half width in standard deviations; default: 95 %.

    Raises:
        ValueError: `hits` is negative or exceeds `trials`.
    """
    if not 0 <= hits <= trials:
        raise ValueError(f"{hits} of {trials} is not a count of trials")
    if trials == 0:
        return 0.0, 1.0
    fraction, square = hits / trials, z * z / trials
    middle = (fraction + 0.5 * square) / (1.0 + square)
    half = math.sqrt(fraction * (1.0 - fraction) * square + 0.25 * square * square) / (1.0 + square)
    low = 0.0 if hits == 0 else middle - half  # rounding would leave 1e-19
    return low, 1.0 if hits == trials else middle + half


@dataclass(frozen=True)
class Proportion:
    """Frequency of an event in a number of trials."""

    hits: int
    """number of trials with the event"""
    trials: int
    """number of trials"""

    json_properties: ClassVar = ("probability", "low", "high")

    @property
    def probability(self) -> float:
        """Estimate of the probability, hits / trials; nan without trials."""
        return self.hits / self.trials if self.trials else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the probability (Wilson 1927)."""
        return wilson_interval(self.hits, self.trials)

    @property
    def low(self) -> float:
        """Lower end of the 95 % confidence interval."""
        return self.interval[0]

    @property
    def high(self) -> float:
        """Upper end of the 95 % confidence interval."""
        return self.interval[1]

    @property
    def interval_text(self) -> str:
        """The confidence interval in whole per cent: `(95 % interval 83 to 99 %)`."""
        low, high = self.interval
        return f"(95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %)"

    def __str__(self) -> str:
        """Return the probability with its confidence interval, in per cent."""
        if not self.trials:
            return "unknown"
        low, high = self.interval
        return f"{100.0 * self.probability:.1f} % (95 % interval {100.0 * low:.1f} to {100.0 * high:.1f} %)"
