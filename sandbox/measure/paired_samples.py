"""Two samples of a quantity, paired by the start of their runs: do they differ, and by how much.

The difference of the means has Student's interval for paired values. Whether the values differ is tested by exchanging
the two values of some of the starts, which changes nothing if both are from the same runs. The statistics are the
Kolmogorov–Smirnov distance, which finds any difference of the distributions, and the mean difference, which finds
shifts that are small beside the spread over the starts; the smaller of their p-values is compared with those after the
exchanges. It needs no form of the distributions and holds for counts with ties. The Wasserstein distance, the mean
distance of the sorted values, is the difference of the samples in the unit of the quantity.

Sources: M. D. Ernst, Permutation methods: a basis for exact inference, Statistical Science 19 (2004) 676-685; P. H.
Westfall and S. S. Young, Resampling-based multiple testing (1993), for the smallest of several p-values;
M. Abramowitz and I. Stegun, Handbook of Mathematical Functions (1964), 26.7.5, quantile of Student's distribution.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray
from sandbox.measure.proportion import Z_95

EXCHANGES = 4096
"""Random exchanges of the test; of up to 12 pairs, all exchanges are made instead."""


def student_quantile(freedom: int) -> float:
    """Return the 97.5 % quantile of Student's distribution from its expansion about the normal one.

    The error is 0.3 % at 4 degrees of freedom, and less with more; with fewer it should not be used.
    """
    z, n = Z_95, freedom
    terms = (
        (z**3 + z) / (4 * n),
        (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2),
        (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3),
    )
    return z + sum(terms)


@dataclass(frozen=True)
class PairedDifference:
    """Difference of two samples of a quantity, in its unit."""

    mean: float
    """mean of the first sample"""
    deviation: float
    """standard deviation of the first sample"""
    other_mean: float
    """mean of the second sample"""
    other_deviation: float
    """standard deviation of the second sample"""
    difference: float
    """first mean less the second"""
    low: float
    """lower end of the 95 % confidence interval of the difference"""
    high: float
    """upper end of the 95 % confidence interval of the difference"""
    distance: float
    """Wasserstein distance of the distributions"""
    p_value: float
    """probability of a difference as large as that of the samples if values and others are exchangeable"""

    @property
    def is_constant(self) -> bool:
        """Whether all values of both samples are equal, such as counts of 0."""
        return self.deviation == self.other_deviation == self.difference == 0.0

    @classmethod
    def of(
        cls, values: Sequence[float] | FloatArray, others: Sequence[float] | FloatArray, resolution: float = 0.0
    ) -> Self:
        """Compare two samples.

        Args:
            values: (n,) of the first sample, n at least 5, finite.
            others: (n,) of the second sample, each paired with the value at its index.
            resolution: differences below it do not count in the test, which rounds values to its multiples.
        """
        first, second = np.asarray(values, np.float64), np.asarray(others, np.float64)
        own = first - second
        tested = [np.round(each / resolution) if resolution else each for each in (first, second)]
        half = student_quantile(len(own) - 1) * float(own.std(ddof=1)) / math.sqrt(len(own))
        return cls(
            mean=float(first.mean()),
            deviation=float(first.std(ddof=1)),
            other_mean=float(second.mean()),
            other_deviation=float(second.std(ddof=1)),
            difference=float(own.mean()),
            low=float(own.mean()) - half,
            high=float(own.mean()) + half,
            distance=float(np.abs(np.sort(first) - np.sort(second)).mean()),
            p_value=_exchange_p_value(*tested),
        )


def _exchange_p_value(first: FloatArray, second: FloatArray) -> float:
    """Return the fraction of the exchanges within pairs that show no smaller a difference than the samples do."""
    count = len(first)
    levels = np.unique(np.concatenate((first, second)))
    # Integers, so that equal distances are equal: 1 where only the first value of a pair is at most a level, −1 where
    # only the second is. An exchange changes the sign.
    steps = (first[:, None] <= levels).astype(np.int32) - (second[:, None] <= levels)
    if 2**count <= EXCHANGES:
        bits = np.arange(2**count)[:, None] >> np.arange(count) & 1
    else:
        bits = np.random.default_rng(0).integers(2, size=(EXCHANGES, count))
        bits[0] = 0  # no exchange is one of them, so that a probability is never 0
    signs = (2 * bits - 1).astype(np.int32)
    distances = np.abs(signs @ steps).max(axis=1)
    sums = np.abs(signs @ (first - second))
    sums = np.round(sums / (sums.max() or 1.0), 12)  # equal sums differ by rounding
    least = np.minimum(_fractions_above(distances), _fractions_above(sums))
    return float((least <= least[0]).mean())


def _fractions_above(values: npt.NDArray[Any]) -> FloatArray:
    """Return for each of some values the fraction of them that is not smaller."""
    ordered = np.sort(values)
    return np.asarray(1.0 - np.searchsorted(ordered, values, side="left") / len(values))


def adjusted_p_values(p_values: Sequence[float]) -> list[float]:
    """Return the probabilities of several tests, adjusted so that a single bound holds for all together (Holm 1979).

    Source: S. Holm, A simple sequentially rejective multiple test procedure, Scand. J. Stat. 6 (1979) 65-70.
    """
    found, least = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[index]))
        found[index] = least
    return found
