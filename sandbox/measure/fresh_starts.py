"""Errors of a setting over perturbed starts that did not decide on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from sandbox.jsonable import finite
from sandbox.measure.proportion import Proportion

MIN_QUANTILE_STARTS = 20
"""Of fewer starts, the 95 % quantile is the largest error and the 5 % quantile the smallest."""


@dataclass(frozen=True)
class FreshStarts:
    """Errors of a setting over perturbed starts that were not used to choose it."""

    held: Proportion
    """starts in which the error was within the tolerance, less the margin; without trials if the effort allows none"""
    error_5: float | None
    """5 % quantile over the starts, in the unit of the metric; None if more than 95 % of the runs failed"""
    median_error: float | None
    """median over the starts, in the unit of the metric; None if half of the runs failed"""
    error_95: float | None
    """95 % quantile over the starts, in the unit of the metric: the largest error of fewer than `MIN_QUANTILE_STARTS`;
    None if more than 5 % of the runs failed"""

    @classmethod
    def of(cls, errors: Sequence[float], max_error: float) -> Self:
        """Return the confirmation by the errors of the starts; infinite for a run that failed."""
        if not errors:
            return cls(Proportion(0, 0), None, None, None)
        low = float(np.quantile(errors, 0.05, method="lower"))
        median, high = np.quantile(errors, (0.5, 0.95), method="higher").tolist()
        held = Proportion(sum(error <= max_error for error in errors), len(errors))
        return cls(held, finite(low), finite(median), finite(high))

    def __str__(self) -> str:
        """Return in how many starts the setting held: `held in 29 of 30 fresh starts (95 % interval 83 to 99 %)`."""
        if not self.held.trials:
            return "not tried from other starts, because their truths and runs take more than the effort"
        return f"held in {self.held.hits} of {self.held.trials} fresh starts {self.held.interval_text}"
