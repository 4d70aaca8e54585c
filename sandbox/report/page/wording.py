"""Wording: numbers as a page writes them."""

import math

UP = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NONE = "–"
"""Stands for a figure that is not known."""
MINUS = "−"
ROUNDING = 1e-12
"""A share below it is called about 0."""


def number(value: float | None, digits: int = 3) -> str:
    """Return a number to so many digits, with a power of ten where it is far from 1: `1.23×10⁻⁷`."""
    if value is None or math.isnan(value):
        return NONE
    if math.isinf(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    if value == 0.0:
        return "0"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if -3 <= power < 3:
        text = f"{value:.{max(digits - 1 - power, 0)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    elif 3 <= power < 6:
        text = f"{float(f'{value:.{digits - 1}e}'):,.0f}"
    else:
        short = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        text = (
            f"{short}×10{power_of(power)}".replace("1×10", "10")
            if short in {"1", "-1"}
            else f"{short}×10{power_of(power)}"
        )
    return text.replace("-", MINUS)


def power_of(exponent: int) -> str:
    """Return an exponent, raised."""
    return str(exponent).translate(UP)


def share(value: float | None) -> str:
    """Return a share as per cent with its sign; what is but rounding as about 0."""
    if value is None:
        return NONE
    if 0.0 < abs(value) < ROUNDING:
        return "≈ 0"
    return f"{'+' if value > 0 else ''}{number(100.0 * value, 2)} %" if value else "0"


def count(value: int | None) -> str:
    """Return how many."""
    return NONE if value is None else f"{value:,}"


def plural(value: int, noun: str) -> str:
    """Return how many of a noun."""
    return f"{value:,} {noun}" if value == 1 else f"{value:,} {noun}s"
