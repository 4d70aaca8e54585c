"""Formatting of quantities: significant digits, SI prefixes, and every float."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.formatting import (
    format_change,
    format_count,
    format_number,
    format_percent,
    format_plural,
    format_quantity,
    format_si,
    format_signed,
    format_time,
)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0, "m", "0 m"), (1.2345e-9, "m", "1.23 nm"), (4.56e-5, "m", "45.6 µm"), (0.00123, "m", "1.23 mm"),
        (0.9999e-3, "m", "1.00 mm"), (999.9e-6, "m", "1.00 mm"), (999.4e-6, "m", "999 µm"), (3.0, "m", "3.00 m"),
        (1000.0, "m", "1.00 km"), (0.01, "s", "10.0 ms"), (-0.165, "J", "−165 mJ"), (-9.81, "m/s²", "−9.81 m/s²"),
        (0.5, "m/s²", "0.500 m/s²"), (0.8, "", "0.800"), (1e-20, "m", "1.00e-20 m"), (1e17, "J", "1.00e17 J"),
        (math.nan, "m", "? m"), (math.inf, "J", "∞ J"), (-math.inf, "J", "−∞ J"),
    ],
)  # fmt: skip
def test_si_text_has_three_digits_and_a_prefix(value: float, unit: str, text: str) -> None:
    assert format_si(value, unit) == text


@pytest.mark.parametrize(
    ("metres", "text"),
    [
        (1.0, "1 m"), (0.2, "200 mm"), (0.005, "5 mm"), (2e-6, "2 µm"), (500.0, "500 m"), (5000.0, "5 km"),
        (2e13, "2e13 m"),
    ],
)  # fmt: skip
def test_si_text_with_one_digit_has_no_trailing_zeros(metres: float, text: str) -> None:
    assert format_si(metres, "m", digits=1) == text


@given(st.floats(1e-12, 9.99e11))
def test_si_text_is_right_to_half_its_last_digit(value: float) -> None:
    number, unit = format_si(value, "m").split()
    power = {"p": -12, "n": -9, "µ": -6, "m": -3, "k": 3, "M": 6, "G": 9}[unit[0]] if len(unit) > 1 else 0
    # half of the third digit is at most 0.5 %, reached at 1.00
    assert math.isclose(float(number) * 10.0**power, value, rel_tol=0.00501)
    assert len(number.replace(".", "")) == 3


@given(st.floats(), st.sampled_from(["", "m", "m/s²", "%"]))
def test_texts_of_any_float_are_short(value: float, unit: str) -> None:
    assert len(format_si(value, unit)) < 20
    assert len(format_percent(value)) < 20
    assert len(format_time(value, abs(value))) < 24


@pytest.mark.parametrize(
    ("fraction", "text"), [(1.0, "100 %"), (0.63, "63 %"), (0.004, "0.400 %"), (0.0, "0 %"), (math.inf, "∞ %")]
)
def test_percent_of_a_small_fraction_is_not_zero(fraction: float, text: str) -> None:
    assert format_percent(fraction) == text


@pytest.mark.parametrize(
    ("time", "step", "text"),
    [(12.3, 0.01, "12.30 s"), (1.5, 1e-4, "1.5000 s"), (3.0, 1.0, "3.00 s"), (0.5, 0.0, "0.50 s")],
)
def test_time_has_enough_decimals_to_show_each_step(time: float, step: float, text: str) -> None:
    assert format_time(time, step) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"), (math.nan, "–"), (math.inf, "∞"), (-math.inf, "−∞"), (0.0, "0"), (0.00123456, "0.00123"),
        (0.000999, "9.99×10⁻⁴"), (1e-4, "10⁻⁴"), (-1e-7, "−10⁻⁷"), (999.6, "1,000"), (98765.0, "98,800"),
        (1.5e7, "1.5×10⁷"), (-2.5, "−2.5"), (100.0, "100"),
    ],
)  # fmt: skip
def test_numbers_far_from_one_are_shown_with_powers_of_ten(value: float | None, text: str) -> None:
    assert format_number(value) == text


def test_relative_changes_are_signed_percentages() -> None:
    assert [format_change(x) for x in (None, 0.0, 0.0512, -0.5, 1e-14)] == ["–", "0", "+5.1 %", "−50 %", "≈ 0"]


def test_counts_have_separators_and_plurals() -> None:
    assert [format_count(n) for n in (None, 0, 12345)] == ["–", "0", "12,345"]
    assert [format_plural(n, "point") for n in (0, 1, 2)] == ["0 points", "1 point", "2 points"]
    assert format_plural(1200, "body", "bodies") == "1,200 bodies"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(1.26, 1, "+1.3"), (-0.25, 2, "−0.25"), (0.0, 1, "0.0"), (-0.04, 1, "0.0"), (-12.0, 0, "−12")],
)
def test_signed_numbers_have_a_typographic_minus(value: float, digits: int, text: str) -> None:
    assert format_signed(value, digits) == text


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.00031, "m", "310 µm"), (0.005, "m", "5 mm"), (0.9999, "m", "1 m"), (0.0009999, "m", "1 mm"),
        (5e-10, "m", "5e-10 m"), (0.0, "m", "0 m"), (1234.5, "m", "1.23e+03 m"), (0.5, "px", "0.5 px"),
        (0.01, "", "0.01"),
    ],
)  # fmt: skip
def test_quantity_is_formatted_with_a_suitable_unit_prefix(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text
