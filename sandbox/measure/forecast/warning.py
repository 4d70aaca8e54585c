"""Warning: one thing that will, or may, go wrong, and what would be right."""

import math
from dataclasses import dataclass, field

ROUNDING = 1e-9
"""Relative: a limit exceeded by less counts as kept."""

Figure = float | int | str
Figures = dict[str, Figure]


@dataclass(frozen=True)
class Warning:
    """Something that will, or may, go wrong; or, as a note, that is worth knowing."""

    kind: str
    message: str
    figures: Figures = field(default_factory=dict)


def at_most(limit: float) -> str:
    """Write a limit with three digits, rounded down: what is typed from it must stay within, but for rounding."""
    from decimal import ROUND_FLOOR, Context  # at 5 ms, for those alone who are warned

    return f"{float(Context(prec=3, rounding=ROUND_FLOOR).create_decimal(limit * (1.0 + ROUNDING))):g}"


def enough_work(needed: float, h: float, substeps: int) -> tuple[int, float]:
    """Return the iterations, and the dt, s, either of which alone brings iterations/h up to what is needed.

    Args:
        needed: iterations a second.
        h: the substep, s.
        substeps: of a step.
    """
    return math.ceil(needed * h * (1.0 - ROUNDING)), substeps / needed
