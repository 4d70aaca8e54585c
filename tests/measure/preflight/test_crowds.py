"""Forecasts of crowds: the events of piles on `exact`, and until when a gas can be told."""

import math

import pytest

from sandbox.engines.contract import Exhaustion
from sandbox.engines.registry import start
from sandbox.measure.metrics.perturbation import agreement_time, perturb
from sandbox.measure.preflight import notes, warnings
from sandbox.measure.preflight.predictability import event_rate, lyapunov_time
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.full  # long runs and sweeps


def heap(places: list[tuple[float, float]], width: float, friction: float, restitution: float = 0.1) -> Scene:
    sides = [([0.0, 0.0], [0.0, 1.0]), ([0.0, 0.0], [1.0, 0.0]), ([width, 0.0], [-1.0, 0.0])]
    ball = {"radius": 0.05, "restitution": restitution, "friction": friction}
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 3.0},
            "solver": {"dt": 1 / 60},
            "plane": [{"point": point, "normal": normal, "friction": 1.0} for point, normal in sides],
            "ball": [{"position": list(place), **ball} for place in places],
        }
    )


UPRIGHT = [(0.05, 0.05), (0.05, 0.16)]
WEDGED = [(0.06, 0.05), (0.17, 0.05), (0.115, 0.2)]


@pytest.mark.parametrize(
    ("places", "width", "friction"), [(UPRIGHT, 0.1 + 1e-6, 0.5), (WEDGED, 0.23, 0.0)], ids=["upright", "wedged"]
)
def test_exact_has_as_many_events_as_were_told(
    places: list[tuple[float, float]], width: float, friction: float
) -> None:
    scene = heap(places, width, friction)
    simulation = start(scene, "exact")
    for _ in range(60):
        simulation.step()
    settled = simulation.work["events"]
    for _ in range(60):
        simulation.step()
    told = event_rate(scene, contact_matrix(scene))
    assert simulation.work["events"] - settled == pytest.approx(told, rel=0.25)  # 56,000 to 77,000 were measured
    assert [w.kind for w in warnings(scene, engine="exact")] == []


def test_exact_gives_up_as_was_told_where_balls_rub() -> None:
    scene = heap(WEDGED, 0.23, 0.5)
    (warning,) = warnings(scene, engine="exact")
    assert warning.kind == "event_rate"
    assert float(warning.details["rate"]) > float(warning.details["allowed"])
    simulation = start(scene, "exact")
    with pytest.raises(Exhaustion, match="more than 1,000,000 events within one second"):
        for _ in range(180):
            simulation.step()
    assert "event_rate" in [w.kind for w in warnings(scene)]  # who names no engine is told of all
    assert warnings(scene, engine="pymunk") == warnings(scene, engine="reference")
    assert "event_rate" not in [w.kind for w in warnings(scene, engine="pymunk")]


@pytest.mark.parametrize("scene", [heap(WEDGED, 0.23, 0.5, restitution=1.0), heap(UPRIGHT[:1], 0.2, 0.5)])
def test_what_bounces_for_ever_or_lies_alone_is_not_told_of(scene: Scene) -> None:
    assert event_rate(scene, contact_matrix(scene)) == 0.0


def gas(columns: int, radius: float, seed: int, duration: float) -> Scene:
    side = float(columns)
    box = [([0, 0], [0, 1]), ([0, 0], [1, 0]), ([side, 0.0], [-1, 0]), ([0.0, side], [0, -1])]
    grid = {"name": "a", "origin": [0.5, 0.5], "columns": columns, "rows": columns, "spacing": [1.0, 1.0]}
    return from_document(
        {
            "world": {"duration": duration, "seed": seed},
            "solver": {"dt": 0.02},
            "plane": [{"point": point, "normal": normal} for point, normal in box],
            "grid": [{**grid, "radius": radius, "velocity_jitter": 1.0, "restitution": 1.0}],
        }
    )


@pytest.mark.parametrize(("columns", "radius"), [(6, 0.25), (10, 0.25), (10, 0.1)])
def test_positions_are_lost_about_when_was_told(columns: int, radius: float) -> None:
    found, told = [], []
    for seed in (1, 2):
        scene = gas(columns, radius, seed, 30.0)
        first, other = (run(each, "exact", audit=False) for each in (scene, perturb(scene)) if each is not None)
        found.append(agreement_time(first, other, scene, 0.01 * radius))
        told.append(lyapunov_time(scene) or math.nan)
    # The rate was measured at 0.75 to 1.45 times the formula's.
    assert 0.65 < sum(found) / sum(told) < 1.5


def test_horizon_is_noted_where_the_run_is_longer() -> None:
    until = lyapunov_time(gas(10, 0.25, 1, 1.0))
    assert until is not None
    assert [note.kind for note in notes(gas(10, 0.25, 1, 1.1 * until))] == ["horizon"]
    assert notes(gas(10, 0.25, 1, 0.9 * until)) == []
    assert lyapunov_time(gas(2, 0.25, 1, 9.0)) is None  # four balls are no crowd
