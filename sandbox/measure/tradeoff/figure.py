"""Figure: a number as it is told, with the unit that reads best."""


def figure(value: float, unit: str) -> str:
    """Write a figure with its unit, short lengths in mm, µm or nm."""
    if unit == "m" and 0.0 < value < 1.0:
        for size, name in ((1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")):
            if value >= size:
                return f"{value / size:.3g} {name}"
    return f"{value:.3g} {unit}".strip()
