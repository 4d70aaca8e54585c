"""Preflight warnings of zones: bodies fast enough to pass one within a substep, and the effect of layers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.preflight import tunnelling_risks, warnings
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document


def gate(speed: float, width: float, **ball: object) -> Scene:
    zone = {"name": "gate", "points": [[1, -1], [1, 1]], "thickness": width}
    body = {"name": "b", "position": [0, 0], "velocity": [speed, 0], "radius": 0.1, **ball}
    return from_document({"ball": [body], "zone": [zone], "solver": {"dt": 0.01}})


@given(speed=st.floats(0.1, 1e3), width=st.floats(0.01, 1.0))
def test_zone_narrower_than_a_substep_of_motion_is_warned_of(speed: float, width: float) -> None:
    found = [each for each in warnings(gate(speed, width)) if each.kind == "entry"]
    odds = 1.0 - width / (speed * 0.01)
    assert len(found) == (odds > 1e-9)  # less is rounding
    for each in found:
        assert each.details["odds"] == odds
        assert each.details["safe_dt"] == width / speed
        assert "'gate'" in each.message


@pytest.mark.parametrize("ball", [{"layer": "up"}, {"collides": "none"}])
def test_zone_that_ignores_the_ball_is_not_warned_of(ball: dict[str, object]) -> None:
    assert not [each for each in warnings(gate(1e3, 0.01, **ball)) if each.kind == "entry"]


def test_wall_on_another_layer_is_no_tunnelling_risk() -> None:
    walls = [{"name": name, "points": [[1, -1], [1, 1]], "layers": [name]} for name in ("up", "ground")]
    ball = {"position": [0, 0], "velocity": [99, 0], "radius": 0.1}
    assert [each.thing for each in tunnelling_risks(from_document({"ball": [ball], "wall": walls}))] == ["ground"]
