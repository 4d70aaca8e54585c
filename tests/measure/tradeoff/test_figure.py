"""Formatting of quantities with units."""

import pytest

from sandbox.formatting import format_quantity


@pytest.mark.parametrize(
    ("value", "unit", "text"),
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
def test_quantity_is_formatted_with_a_suitable_unit_prefix(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text
