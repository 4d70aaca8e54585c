"""Forecasts of zones: who is fast enough to fly through one between two looks, and what is passed on which layer."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.preflight import tunnelling_risks, warnings
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document


def gate(speed: float, width: float, **ball: object) -> Scene:
    strip = {"name": "gate", "points": [[1, -1], [1, 1]], "thickness": width}
    one = {"name": "b", "position": [0, 0], "velocity": [speed, 0], "radius": 0.1, **ball}
    return from_document({"ball": [one], "zone": [strip], "solver": {"dt": 0.01}})


@given(speed=st.floats(0.1, 1e3), width=st.floats(0.01, 1.0))
def test_zone_is_warned_of_if_a_substep_is_wider(speed: float, width: float) -> None:
    told = [each for each in warnings(gate(speed, width)) if each.kind == "entry"]
    odds = 1.0 - width / (speed * 0.01)
    assert len(told) == (odds > 1e-9)  # less is rounding
    for each in told:
        assert each.details["odds"] == odds
        assert each.details["safe_dt"] == width / speed
        assert "'gate'" in each.message


@pytest.mark.parametrize("ball", [{"layer": "up"}, {"collides": "none"}])
def test_zone_that_cannot_note_somebody_is_not_missed(ball: dict[str, object]) -> None:
    assert not [each for each in warnings(gate(1e3, 0.01, **ball)) if each.kind == "entry"]


def test_what_is_on_another_layer_is_not_tunnelled_through() -> None:
    walls = [{"name": name, "points": [[1, -1], [1, 1]], "layers": [name]} for name in ("up", "ground")]
    ball = {"position": [0, 0], "velocity": [99, 0], "radius": 0.1}
    assert [each.thing for each in tunnelling_risks(from_document({"ball": [ball], "wall": walls}))] == ["ground"]
