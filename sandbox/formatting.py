"""Text of quantities: significant digits, SI prefixes, and a real minus sign."""

import math

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
PREFIXED_UNITS = frozenset({"m", "s", "J", "N"})
"""Units that take a prefix; others, such as m/s², do not."""


def format_si(value: float, unit: str = "", digits: int = 3) -> str:
    """Return a value with its unit, such as `12.3 mm`, `−9.81 m/s²` or `1.20 GJ`.

    Args:
        value: in the unit; nan is written `?`.
        unit: it gets a prefix if it is one of `PREFIXED_UNITS`; without a unit there is only the number.
        digits: significant ones, at least 1.
    """
    tail = f" {unit}" if unit else ""
    if not math.isfinite(value):
        return ("?" if math.isnan(value) else "∞" if value > 0 else "−∞") + tail
    if value == 0:
        return f"0{tail}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")  # rounded first, so that 999.9 µm is 1.00 mm
    power = int(exponent)
    if unit in PREFIXED_UNITS:
        thousands = 3 * (power // 3)
        if thousands in PREFIXES:
            above = power - thousands
            return _signed(f"{float(mantissa) * 10**above:.{max(digits - 1 - above, 0)}f} {PREFIXES[thousands]}{unit}")
    elif -4 <= power < 6:
        return _signed(f"{float(mantissa) * 10.0**power:.{max(digits - 1 - power, 0)}f}{tail}")
    return _signed(f"{mantissa}e{power}{tail}")


def format_percent(fraction: float) -> str:
    """Return a fraction in percent, such as `63 %`; below one percent with three digits, such as `0.400 %`."""
    is_plain = fraction == 0 or 0.01 <= abs(fraction) < 1e6
    return f"{100 * fraction:.0f} %" if is_plain else f"{format_si(100 * fraction)} %"


def format_fraction(fraction: float) -> str:
    """Return a fraction that may exceed 1: in percent up to 1, such as `63 %`, and above as a multiple, `3.1 times`."""
    if abs(fraction) <= 1.0:
        return format_percent(fraction)
    return f"{format_number(fraction)} times"


def format_time(time: float, step: float = 0.01) -> str:
    """Return a time in seconds with enough decimals that each step changes it, such as `12.34 s` at 10 ms.

    Args:
        time: s.
        step: s; there are at least 2 and at most 9 decimals.
    """
    if not math.isfinite(time) or abs(time) >= 1e9:
        return format_si(time, "s")
    has_decimals = math.isfinite(step) and 0 < step < 1
    decimals = min(max(math.ceil(-math.log10(step) - 1e-9), 2), 9) if has_decimals else 2
    return _signed(f"{time:.{decimals}f} s")


UNKNOWN = "–"
"""Stands for an unknown value in a table."""
ROUNDING = 1e-12
"""Relative changes below it are rounding errors of double precision and are written as about 0."""
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def format_number(value: float | None, digits: int = 3) -> str:
    """Return a number for a table, with a power of ten where it is far from 1, such as `98,800` or `1.23×10⁻⁷`.

    Args:
        value: None and nan are written `–`.
        digits: significant ones, at least 1; trailing zeros after the decimal point are left out.
    """
    if value is None or math.isnan(value):
        return UNKNOWN
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0.0:
        return "0"
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    power = int(exponent)
    if -3 <= power < 3:
        return _signed(_without_zeros(f"{value:.{max(digits - 1 - power, 0)}f}"))
    if 3 <= power < 6:
        return _signed(f"{float(f'{mantissa}e{exponent}'):,.0f}")
    factor = _without_zeros(mantissa)
    raised = f"10{str(power).translate(_SUPERSCRIPTS)}"
    return _signed(f"{factor[:-1]}{raised}" if factor in {"1", "-1"} else f"{factor}×{raised}")


def format_change(fraction: float | None) -> str:
    """Return a relative change in percent with its sign, such as `+5.1 %`; rounding errors as `≈ 0`, None as `–`."""
    if fraction is None:
        return UNKNOWN
    if 0.0 < abs(fraction) < ROUNDING:
        return "≈ 0"
    return f"{'+' if fraction > 0 else ''}{format_number(100.0 * fraction, 2)} %" if fraction else "0"


def format_count(count: int | None) -> str:
    """Return a count with separators of thousands, such as `12,000`; None as `–`."""
    return UNKNOWN if count is None else f"{count:,}"


def format_plural(count: int, noun: str, plural: str | None = None) -> str:
    """Return a count with its noun, such as `1 body` or `3 bodies`.

    Args:
        count: of things.
        noun: in the singular.
        plural: of the noun; by default with an s.
    """
    return f"{count:,} {noun if count == 1 else plural or f'{noun}s'}"


def _without_zeros(text: str) -> str:
    """Return a decimal number without trailing zeros after the point."""
    return text.rstrip("0").rstrip(".") if "." in text else text


def format_signed(value: float, digits: int) -> str:
    """Return a number with a sign and `digits` decimals, such as `+1.5` or `−0.2`; zero has no sign.

    Args:
        value: finite.
        digits: number of decimals.
    """
    text = f"{value:+.{digits}f}"
    return _signed(text) if float(text) else text[1:]


def _signed(text: str) -> str:
    return f"−{text[1:]}" if text.startswith("-") else text


LENGTH_UNITS = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))


def format_quantity(value: float, unit: str) -> str:
    """Return a value with three significant digits and its unit; short lengths in mm, µm or nm, such as `310 µm`."""
    rounded = float(f"{value:.3g}")  # first, otherwise 0.9999 m would be 1e+03 mm
    if unit == "m" and rounded > 0.0:
        for name, size in LENGTH_UNITS:
            if rounded >= size:
                return f"{rounded / size:.3g} {name}"
    return f"{value:.3g} {unit}".strip()
