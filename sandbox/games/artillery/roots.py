"""Roots: where a function changes sign, by false position with halving (Illinois; Dowell, Jarratt, BIT 11, 1971)."""

from collections.abc import Callable

PASSES = 200


def bracketed(f: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Return a place of a change of sign between two that differ in sign, to within `width`.

    A jump is found as well as a root. Where the function is smooth it converges with order 1.44; every third step
    halves the bracket, so that a jump cannot hold it up.

    Raises:
        ValueError: the function has one sign at both.
    """
    at_low, at_high = f(low), f(high)
    if at_low == 0.0 or at_high == 0.0:
        return low if at_low == 0.0 else high
    if (at_low > 0.0) == (at_high > 0.0):
        raise ValueError(f"no change of sign between {low:g} and {high:g}")
    weight_low, weight_high = at_low, at_high
    for count in range(PASSES):
        if abs(high - low) <= width:
            break
        here = (low * weight_high - high * weight_low) / (weight_high - weight_low)
        if count % 3 == 2 or not min(low, high) < here < max(low, high):
            here = 0.5 * (low + high)
        there = f(here)
        if there == 0.0:
            return here
        if (there > 0.0) == (at_low > 0.0):
            low, weight_low, weight_high = here, there, 0.5 * weight_high
        else:
            high, weight_high, weight_low = here, there, 0.5 * weight_low
    return 0.5 * (low + high)
