"""Figure: a number as it is told, with the unit that reads best."""

SMALL = (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))


def figure(value: float, unit: str) -> str:
    """Write a figure with its unit and three digits, short lengths in mm, µm or nm."""
    rounded = float(f"{value:.3g}")  # first, else 0.9999 m would be 1e+03 mm
    if unit == "m" and rounded > 0.0:
        for name, size in SMALL:
            if rounded >= size:
                return f"{rounded / size:.3g} {name}"
    return f"{value:.3g} {unit}".strip()
