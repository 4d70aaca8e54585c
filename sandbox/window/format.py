"""Figures: numbers as people read them, three significant digits and a prefixed unit."""

import math

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
PREFIXED = frozenset({"m", "s", "J", "N"})
"""Units that take a prefix; others, such as m/s², stay as they are."""
DIGITS = 3


def format_si(value: float, unit: str = "") -> str:
    """Write a value with three significant digits, such as `12.3 mm`, `−9.81 m/s²` or `1.20 GJ`.

    Args:
        value: in the unit; nan is `?`.
        unit: with a prefix where it is one of `PREFIXED`; without a unit there is the number alone.
    """
    tail = f" {unit}" if unit else ""
    if not math.isfinite(value):
        return ("?" if math.isnan(value) else "∞" if value > 0 else "−∞") + tail
    if value == 0:
        return f"0{tail}"
    mantissa, exponent = f"{value:.{DIGITS - 1}e}".split("e")  # rounded first, so that 999.9 µm is 1.00 mm
    power = int(exponent)
    if unit in PREFIXED:
        thousands = 3 * (power // 3)
        if thousands in PREFIXES:
            above = power - thousands
            return _signed(f"{float(mantissa) * 10**above:.{max(DIGITS - 1 - above, 0)}f} {PREFIXES[thousands]}{unit}")
    elif -4 <= power < 6:
        return _signed(f"{float(mantissa) * 10.0**power:.{max(DIGITS - 1 - power, 0)}f}{tail}")
    return _signed(f"{mantissa}e{power}{tail}")


def format_percent(share: float) -> str:
    """Write a share as `63 %`, and one below a percent as `0.40 %`."""
    plain = share == 0 or 0.01 <= abs(share) < 1e6
    return f"{100 * share:.0f} %" if plain else f"{format_si(100 * share)} %"


def format_time(time: float, step: float = 0.01) -> str:
    """Write a time so that each step is seen to move it, `12.34 s` at 10 ms; it keeps its width while it runs.

    Args:
        time: s.
        step: s; at least 2 and at most 9 digits after the point.
    """
    if not math.isfinite(time) or abs(time) >= 1e9:
        return format_si(time, "s")
    fine = math.isfinite(step) and 0 < step < 1
    places = min(max(math.ceil(-math.log10(step) - 1e-9), 2), 9) if fine else 2
    return _signed(f"{time:.{places}f} s")


def _signed(text: str) -> str:
    return f"−{text[1:]}" if text.startswith("-") else text
