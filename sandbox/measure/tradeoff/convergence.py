"""Order of convergence of the methods of a trade-off: the power of the substep that their error is proportional to.

A method is an engine with all settings but dt and substeps. Its order is the slope of the error against the substep on
logarithmic axes, fitted to as many of the finest substeps as lie on a line; coarser ones need not show the order yet.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.measure.tradeoff.configuration import Evaluation

MIN_SUBSTEPS = 3
"""Smallest number of substeps of a fit; two points lie on any line."""
MAX_DEVIATION = 0.3
"""Largest difference of the slope between two neighbouring substeps from the fitted one, for errors that fall steadily.
With impacts, where the errors depend on where the steps fall, slopes differ by 0.5 and more."""
MIN_ORDER = 0.5
"""Smallest order that counts as convergence: each halving of the substep removes at least 30 % of the error."""
NEGLIGIBLE = 1e-6
"""Errors below this fraction of the tolerance are left out, because rounding errors are among them."""
STEP_KEYS = frozenset({"dt", "substeps"})
"""Settings that choose the substep."""


@dataclass(frozen=True)
class ConvergenceOrder:
    """Order of convergence of a method in the substep."""

    engine: str
    """name of the engine"""
    changes: Mapping[str, Any]
    """changes of the method to the `[solver]` of the scene, without dt and substeps"""
    order: float
    """power p of error ~ substep^p"""
    finest: float
    """s, smallest substep of the fit"""
    coarsest: float
    """s, largest substep of the fit"""
    points: tuple[int, ...]
    """indices of the points of the fit"""


def convergence_orders(points: Sequence[Evaluation], tolerance: float) -> list[ConvergenceOrder]:
    """Return the order of each method whose errors fall steadily with the substep, over three substeps or more.

    Args:
        points: all points of a trade-off.
        tolerance: in the unit of the errors.
    """
    methods: dict[Any, list[int]] = {}
    for index, point in enumerate(points):
        chosen = point.configuration
        if point.status == "ok" and math.isfinite(point.ranking_error) and not point.is_truth:
            methods.setdefault((chosen.engine, chosen.iterations, chosen.options), []).append(index)
    found = (_order_of(points, indices, NEGLIGIBLE * tolerance) for indices in methods.values())
    return [each for each in found if each is not None]


def _order_of(points: Sequence[Evaluation], indices: Sequence[int], negligible: float) -> ConvergenceOrder | None:
    """Return the order of a method from its points; None if the errors do not fall steadily."""
    by_substep: dict[float, list[int]] = {}
    for index in indices:
        if points[index].ranking_error > negligible:
            by_substep.setdefault(points[index].settings.h, []).append(index)
    # Of equal substeps with other frames, the largest error: it is that of the most frames.
    largest = {
        substep: max(group, key=lambda index: points[index].ranking_error)
        for substep, group in sorted(by_substep.items(), reverse=True)
    }
    kept = list(largest.values())
    while len(kept) >= MIN_SUBSTEPS:
        substeps = np.log([points[index].settings.h for index in kept])
        errors = np.log([points[index].ranking_error for index in kept])
        order = float(np.polyfit(substeps, errors, 1)[0])
        slopes = np.diff(errors) / np.diff(substeps)
        if order >= MIN_ORDER and bool((np.abs(slopes - order) <= MAX_DEVIATION).all()):
            first, last = points[kept[0]], points[kept[-1]]
            changes = {key: value for key, value in last.changes.items() if key not in STEP_KEYS}
            return ConvergenceOrder(first.engine, changes, order, last.settings.h, first.settings.h, tuple(kept))
        kept = kept[1:]
    return None
