"""Finite figures: those that JSON has a number for."""

import math


def finite(value: float | None) -> float | None:
    """Return a figure as it is, or None where it is unknown or not finite."""
    return value if value is not None and math.isfinite(value) else None
