"""Figures: numbers as they are told."""

import pytest

from sandbox.formatting import format_quantity


@pytest.mark.parametrize(
    ("value", "unit", "told"),
    [
        (0.00031, "m", "310 µm"),
        (0.005, "m", "5 mm"),
        (0.9999, "m", "1 m"),
        (0.0009999, "m", "1 mm"),
        (5e-10, "m", "5e-10 m"),
        (0.0, "m", "0 m"),
        (1234.5, "m", "1.23e+03 m"),
        (0.5, "px", "0.5 px"),
        (0.01, "", "0.01"),
    ],
)
def test_figure_is_told_in_the_unit_that_reads_best(value: float, unit: str, told: str) -> None:
    assert format_quantity(value, unit) == told
