"""Parameter of a slider: positions map to values, exactly at the ends and on whole steps."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.files.load import from_document
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import Parameter, SessionParameters
from sandbox.window.playback.session import Session

GRAVITY = Parameter("gravity", "gravity", -30, 30, -9.81, step=0.01, unit="m/s²")
STEP = Parameter("dt", "time step", 1e-4, 0.1, 0.01, log=True, step=0.1, unit="s")
SUBSTEPS = Parameter("substeps", "substeps", 1, 32, 1, step=1)
WORDS = Parameter("integrator", "integrator", value="leapfrog", choices=("explicit_euler", "leapfrog", "rk4"))
PARAMETERS = [GRAVITY, STEP, SUBSTEPS, Parameter("e", "restitution"), Parameter("mu", "friction", 0, 2, 0.3)]


@pytest.mark.parametrize("parameter", PARAMETERS)
def test_ends_are_exact_and_values_clamp(parameter: Parameter) -> None:
    assert parameter.at(0.0) == parameter.at(-3.0) == parameter.low
    assert parameter.at(1.0) == parameter.at(3.0) == parameter.high
    assert parameter.fraction(parameter.low) == parameter.fraction(parameter.low - 1e-5) == 0.0
    assert parameter.fraction(parameter.high) == parameter.fraction(parameter.high + 5.0) == 1.0


@pytest.mark.parametrize("parameter", PARAMETERS)
@given(fraction=st.floats(0, 1))
def test_values_are_within_the_range_and_monotonic(parameter: Parameter, fraction: float) -> None:
    value = parameter.at(fraction)
    assert parameter.low <= value <= parameter.high
    assert parameter.at(fraction / 2) <= value
    # A value differs from its position by at most half a step, or by 5 % where two digits are kept.
    half = (
        math.log10(1.05) / math.log10(parameter.high / parameter.low)
        if parameter.log
        else 0.5 * parameter.step / (parameter.high - parameter.low)
    )
    assert abs(parameter.fraction(value) - fraction) <= half + 1e-12  # rounding of the fractions


def test_values_are_exactly_whole_steps() -> None:
    assert Parameter("e", "e", step=0.1).at(0.31) == 0.3
    assert GRAVITY.at(0.3366) == -9.8
    assert SUBSTEPS.at(0.5) == 16.0
    assert STEP.at(2 / 3) == 0.01


@pytest.mark.parametrize("parameter", PARAMETERS)
@pytest.mark.parametrize("direction", [1, -1])
def test_wheel_steps_from_end_to_end_and_stops_there(parameter: Parameter, direction: int) -> None:
    value: float | str = parameter.low if direction > 0 else parameter.high
    end = parameter.high if direction > 0 else parameter.low
    values = [value]
    while value != end:
        value = parameter.stepped(value, direction)
        assert value != values[-1]
        values.append(value)
        assert len(values) < 7000
    assert parameter.stepped(end, direction) == end


def test_choices_cycle_and_an_unknown_choice_steps_to_an_end() -> None:
    assert WORDS.stepped("leapfrog", 1) == "rk4"
    assert WORDS.stepped("rk4", 1) == "explicit_euler"
    assert WORDS.stepped("explicit_euler", -1) == "rk4"
    assert WORDS.stepped("other", 1) == "explicit_euler"
    assert WORDS.stepped("other", -1) == "rk4"


@pytest.mark.parametrize(
    ("parameter", "value", "text"),
    [
        (GRAVITY, -9.81, "−9.81 m/s²"),
        (STEP, 0.01, "10.0 ms"),
        (SUBSTEPS, 4.0, "4"),
        (WORDS, "explicit_euler", "explicit euler"),
        (Parameter("speed", "speed", unit="%"), 0.63, "63 %"),
        (SUBSTEPS, math.nan, "?"),
    ],
)
def test_value_is_shown_with_its_unit(parameter: Parameter, value: float | str, text: str) -> None:
    assert parameter.text(value) == text


def test_value_that_is_not_finite_is_at_the_low_end() -> None:
    assert STEP.fraction(math.nan) == 0.0
    assert STEP.stepped(math.inf, 1) == STEP.low
    assert Parameter("flat", "flat", 1.0, 1.0, 1.0).at(0.7) == 1.0


GROUND, WALL = {"point": [0, 0], "normal": [0, 1]}, {"points": [[9, 0], [9, 1]]}


@pytest.mark.parametrize("key", ["restitution", "friction"])
@pytest.mark.parametrize(
    ("of_ball", "of_material", "of_ground", "of_wall", "shown"),
    [
        (None, None, 0.5, None, 0.5),
        (None, None, 0.2, 0.6, 0.6),
        (None, None, None, None, 0.0),
        (None, 0.3, 0.5, None, 0.3),
        (0.4, 0.3, 0.5, None, 0.4),
        (0.0, None, 0.5, None, 0.0),
    ],
)
def test_slider_shows_the_coefficient_that_acts(
    key: str,
    of_ball: float | None,
    of_material: float | None,
    of_ground: float | None,
    of_wall: float | None,
    shown: float,
) -> None:
    def stating(value: float | None) -> dict[str, float]:
        return {} if value is None else {key: value}

    scene = from_document(
        {
            "material": [{"name": "m", **stating(of_material)}],
            "ball": [{"position": [0, 2], "radius": 0.5, "material": "m", **stating(of_ball)}],
            "plane": [{**GROUND, **stating(of_ground)}],
            "wall": [{**WALL, **stating(of_wall)}],
        }
    )
    live = LiveView(Session(scene))
    for picked in (None, 0):
        values = {each.key: each for each in SessionParameters().of(live, scene, picked)}
        assert values[key].value == shown
    live.close()
