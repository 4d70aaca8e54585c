"""Statistics of the scores of many games: mean, standard deviation, quantiles and histogram."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""probabilities of the quantiles"""
MAX_BINS = 10
"""number of bins over the range of the scores; rounding the outer edges to multiples of the width adds up to two"""


@dataclass(frozen=True)
class Scores:
    """Statistics of a sample of scores."""

    count: int
    mean: float
    deviation: float
    """sample standard deviation; 0 for a single game"""
    quantiles: tuple[float, ...]
    """for the probabilities `QUANTILES`"""
    edges: tuple[float, ...]
    """edges of the bins of the histogram, one more than bins; a bin includes its lower edge"""
    counts: tuple[int, ...]
    """number of games in each bin"""

    @classmethod
    def of(cls, scores: Sequence[float]) -> "Scores":
        """Return the statistics of scores.

        Raises:
            ValueError: there are no scores.
        """
        if not scores:
            raise ValueError("no games, so no score statistics")
        values = np.asarray(scores, dtype=np.float64)
        counts, edges = np.histogram(values, _edges(values))
        return cls(
            count=len(values),
            mean=float(values.mean()),
            deviation=float(values.std(ddof=1)) if len(values) > 1 else 0.0,
            quantiles=tuple(np.quantile(values, QUANTILES).tolist()),
            edges=tuple(edges.tolist()),
            counts=tuple(counts.tolist()),
        )

    def document(self) -> "ScoreStatistics":
        """Return the statistics as they appear in JSON documents."""
        return ScoreStatistics(
            self.count,
            self.mean,
            self.deviation,
            {f"{fraction:g}": value for fraction, value in zip(QUANTILES, self.quantiles, strict=True)},
            Histogram(self.edges, self.counts),
        )


@dataclass(frozen=True)
class Histogram:
    """Histogram of scores."""

    edges: Sequence[float]
    """bounds of the bins; a bin includes its lower edge"""
    counts: Sequence[int]
    """number of games in each bin"""


@dataclass(frozen=True)
class ScoreStatistics:
    """JSON document of the statistics of scores."""

    count: int
    mean: float
    deviation: float
    """sample standard deviation"""
    quantiles: Mapping[str, float]
    """by probability"""
    histogram: Histogram


def _edges(scores: FloatArray) -> list[float]:
    """Return the edges of bins that contain all scores; their width is 1, 2 or 5 times a power of ten.

    If all scores are integers, the width is at least 1.
    """
    low, high = float(scores.min()), float(scores.max())
    width = 10.0 ** math.floor(math.log10(max(high - low, 1.0) / MAX_BINS))
    width *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if high - low <= width * factor * MAX_BINS)
    if (scores == np.round(scores)).all():
        width = max(width, 1.0)
    first, last = math.floor(low / width), math.floor(high / width) + 1
    if low < width * first:  # a negative score so small that the quotient is -0
        first -= 1
    parts = round(1.0 / width)  # bins per unit: 3 / 10 is exactly 0.3, 3 × 0.1 is not
    return [k / parts if width < 1.0 else width * k for k in range(first, last + 1)]
