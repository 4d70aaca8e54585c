"""Scores: how the scores of many games are spread."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""of games, whose scores are no more than the quantiles"""
MAX_BINS = 10
"""and up to two more, as bins begin and end at round figures, not at the least and the most score"""


@dataclass(frozen=True)
class Scores:
    """A sample of scores."""

    count: int
    mean: float
    deviation: float
    """of one score, from the sample; 0 of a single game"""
    quantiles: tuple[float, ...]
    """for each of `SHARES`"""
    edges: tuple[float, ...]
    """of the histogram's bins, one more than there are bins; a bin holds its lower edge"""
    counts: tuple[int, ...]
    """games in each bin"""

    @classmethod
    def of(cls, scores: Sequence[float]) -> "Scores":
        """Return how scores are spread.

        Raises:
            ValueError: there are none.
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

    def document(self) -> dict[str, Any]:
        """Return it as JSON values."""
        return {
            "count": self.count,
            "mean": self.mean,
            "deviation": self.deviation,
            "quantiles": {f"{share:g}": value for share, value in zip(QUANTILES, self.quantiles, strict=True)},
            "histogram": {"edges": list(self.edges), "counts": list(self.counts)},
        }


def _edges(scores: FloatArray) -> list[float]:
    """Return the edges of bins that are 1, 2 or 5 times a power of ten wide, of few digits, and hold all scores.

    Where all scores are whole numbers, no bin lies between two of these.
    """
    least, most = float(scores.min()), float(scores.max())
    width = 10.0 ** math.floor(math.log10(max(most - least, 1.0) / MAX_BINS))
    width *= next(times for times in (1.0, 2.0, 5.0, 10.0) if most - least <= width * times * MAX_BINS)
    if (scores == np.round(scores)).all():
        width = max(width, 1.0)
    first, last = math.floor(least / width), math.floor(most / width) + 1
    if least < width * first:  # a negative score so small that the quotient is -0
        first -= 1
    parts = round(1.0 / width)  # of 1, where a bin is narrower: 3 / 10 is 0.3, 3 × 0.1 is not
    return [k / parts if width < 1.0 else width * k for k in range(first, last + 1)]
