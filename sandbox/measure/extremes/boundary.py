"""Boundary: up to where an axis goes well, found by halving the way between what passed and what failed."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sandbox.measure.extremes.axis import Scale

TOLERANCE = 0.01
"""Relative width within which a boundary is found; of whole numbers, one."""
MOST_HALVINGS = 40
BESIDE = (0.9, 1.1)
"""What a boundary is multiplied by to look whether all is well before it, and nothing behind."""

Passes = Callable[[float], bool]


@dataclass(frozen=True)
class Found:
    """A boundary, from the easiest level on."""

    limit: float | None
    """the last level that passes before the first failure; None where the easiest fails"""
    first_failure: float | None
    """the first that fails; None where none does"""
    monotone: bool
    """whether nothing passes behind it, and nothing fails before it, of what was looked at"""


@dataclass(frozen=True)
class Limit:
    """How far a setup goes on an axis."""

    axis: str
    engine: str
    setup: str
    settings: Mapping[str, Any]
    limit: float | None
    first_failure: float | None
    reason: str
    """why the first failure failed, or why there is no limit"""
    rule: str | None = None
    monotone: bool = True
    unit: str = ""
    refused: bool = False
    """everywhere"""

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {
            "axis": self.axis,
            "engine": self.engine,
            "settings": dict(self.settings),
            "setup": self.setup,
            "limit": self.limit,
            "first_failure": self.first_failure,
            "reason": self.reason,
            "rule": self.rule,
            "monotone": self.monotone,
            "refused": self.refused,
            "unit": self.unit,
        }


def boundary(levels: Mapping[float, bool], passes: Passes | None, scale: Scale, tolerance: float = TOLERANCE) -> Found:
    """Return the boundary between what passes and what fails.

    Args:
        levels: what is known of some levels, from the easiest to the hardest: whether each passes.
        passes: finds out about another; without, the boundary is somewhere between two of the levels.
        scale: how the way between two levels is halved.
        tolerance: relative width within which it is found.
    """
    known = dict(levels)
    order = list(levels)
    rising = len(order) < 2 or order[-1] > order[0]
    failed = next((k for k, level in enumerate(order) if not known[level]), None)
    if failed is None:
        return Found(order[-1] if order else None, None, True)
    if failed == 0:
        return Found(None, order[0], not any(known.values()))
    good, bad = order[failed - 1], order[failed]
    if passes is None:
        return Found(good, bad, not any(known[level] for level in order[failed:]))
    for _ in range(MOST_HALVINGS):
        middle = halfway(good, bad, scale)
        if middle in (good, bad) or abs(bad - good) <= tolerance * max(abs(good), abs(bad)):
            break
        known[middle] = passes(middle)
        good, bad = (middle, bad) if known[middle] else (good, middle)
    for level in _beside(good, bad, rising, scale, order):
        if level not in known:
            known[level] = passes(level)
    before = [well for level, well in known.items() if (level <= good if rising else level >= good)]
    behind = [well for level, well in known.items() if (level >= bad if rising else level <= bad)]
    return Found(good, bad, all(before) and not any(behind))


def halfway(a: float, b: float, scale: Scale) -> float:
    """Return what lies between two levels: their geometric mean, but from or to 0 and on linear scales the other."""
    if scale == "whole":
        middle = round(math.sqrt(a * b)) if a > 0 and b > 0 else (a + b) // 2
        inside = min(a, b) < middle < max(a, b)
        return middle if inside else (min(a, b) + 1 if abs(a - b) > 1 else a)
    if scale == "log" and a * b > 0.0:
        return math.copysign(math.sqrt(a) * math.sqrt(b), a) if a > 0 else -math.sqrt(a * b)
    return 0.5 * (a + b)


def _beside(good: float, bad: float, rising: bool, scale: Scale, order: list[float]) -> list[float]:
    """Return levels shortly before and behind a boundary, within those that there are."""
    less, more = BESIDE if rising else BESIDE[::-1]
    found = [good * less, bad * more]
    if scale == "whole":
        found = [round(level) for level in found]
    return [level for level in found if min(order) <= level <= max(order)]
