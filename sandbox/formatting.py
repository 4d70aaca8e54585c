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


def _signed(text: str) -> str:
    return f"−{text[1:]}" if text.startswith("-") else text
