"""Knob: positions become values, exactly at the ends and on whole steps."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.window.playback.parameters import Parameter

GRAVITY = Parameter("gravity", "gravity", -30, 30, -9.81, step=0.01, unit="m/s²")
STEP = Parameter("dt", "time step", 1e-4, 0.1, 0.01, log=True, step=0.1, unit="s")
SUBSTEPS = Parameter("substeps", "substeps", 1, 32, 1, step=1)
WORDS = Parameter("integrator", "integrator", value="leapfrog", choices=("explicit_euler", "leapfrog", "rk4"))
KNOBS = [GRAVITY, STEP, SUBSTEPS, Parameter("e", "restitution"), Parameter("mu", "friction", 0, 2, 0.3)]


@pytest.mark.parametrize("knob", KNOBS)
def test_ends_are_exact_and_values_clamp(knob: Parameter) -> None:
    assert knob.at(0.0) == knob.at(-3.0) == knob.low
    assert knob.at(1.0) == knob.at(3.0) == knob.high
    assert knob.fraction(knob.low) == knob.fraction(knob.low - 1e-5) == 0.0
    assert knob.fraction(knob.high) == knob.fraction(knob.high + 5.0) == 1.0


@pytest.mark.parametrize("knob", KNOBS)
@given(share=st.floats(0, 1))
def test_values_lie_within_and_grow_with_the_share(knob: Parameter, share: float) -> None:
    value = knob.at(share)
    assert knob.low <= value <= knob.high
    assert knob.at(share / 2) <= value
    # a value is at most half a step, or 5 % where two digits are kept, beside the place that it was asked at
    half = math.log10(1.05) / math.log10(knob.high / knob.low) if knob.log else 0.5 * knob.step / (knob.high - knob.low)
    assert abs(knob.fraction(value) - share) <= half + 1e-12  # rounding of the shares


def test_values_are_whole_steps_without_crumbs() -> None:
    assert Parameter("e", "e", step=0.1).at(0.31) == 0.3
    assert GRAVITY.at(0.3366) == -9.8
    assert SUBSTEPS.at(0.5) == 16.0
    assert STEP.at(2 / 3) == 0.01


@pytest.mark.parametrize("knob", KNOBS)
@pytest.mark.parametrize("way", [1, -1])
def test_wheel_goes_from_end_to_end_and_stays_there(knob: Parameter, way: int) -> None:
    value: float | str = knob.low if way > 0 else knob.high
    end = knob.high if way > 0 else knob.low
    seen = [value]
    while value != end:
        value = knob.stepped(value, way)
        assert value != seen[-1]
        seen.append(value)
        assert len(seen) < 7000
    assert knob.stepped(end, way) == end


def test_choices_go_round_and_an_unknown_one_leads_to_an_end() -> None:
    assert WORDS.stepped("leapfrog", 1) == "rk4"
    assert WORDS.stepped("rk4", 1) == "explicit_euler"
    assert WORDS.stepped("explicit_euler", -1) == "rk4"
    assert WORDS.stepped("other", 1) == "explicit_euler"
    assert WORDS.stepped("other", -1) == "rk4"


@pytest.mark.parametrize(
    ("knob", "value", "text"),
    [
        (GRAVITY, -9.81, "−9.81 m/s²"),
        (STEP, 0.01, "10.0 ms"),
        (SUBSTEPS, 4.0, "4"),
        (WORDS, "explicit_euler", "explicit euler"),
        (Parameter("speed", "speed", unit="%"), 0.63, "63 %"),
        (SUBSTEPS, math.nan, "?"),
    ],
)
def test_value_is_shown_with_its_unit(knob: Parameter, value: float | str, text: str) -> None:
    assert knob.text(value) == text


def test_value_that_is_no_figure_lies_at_the_low_end() -> None:
    assert STEP.share(math.nan) == 0.0
    assert STEP.stepped(math.inf, 1) == STEP.low
    assert Parameter("flat", "flat", 1.0, 1.0, 1.0).at(0.7) == 1.0
