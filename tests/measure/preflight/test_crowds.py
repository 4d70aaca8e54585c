"""Predictions for crowds: event rates of piles on `exact`, and the predictability horizon of a gas."""

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

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def heap(positions: list[tuple[float, float]], width: float, friction: float, restitution: float = 0.1) -> Scene:
    sides = [([0.0, 0.0], [0.0, 1.0]), ([0.0, 0.0], [1.0, 0.0]), ([width, 0.0], [-1.0, 0.0])]
    ball = {"radius": 0.05, "restitution": restitution, "friction": friction}
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 3.0},
            "solver": {"dt": 1 / 60},
            "plane": [{"point": point, "normal": normal, "friction": 1.0} for point, normal in sides],
            "ball": [{"position": list(position), **ball} for position in positions],
        }
    )


UPRIGHT = [(0.05, 0.05), (0.05, 0.16)]
WEDGED = [(0.06, 0.05), (0.17, 0.05), (0.115, 0.2)]


@pytest.mark.parametrize(
    ("positions", "width", "friction"), [(UPRIGHT, 0.1 + 1e-6, 0.5), (WEDGED, 0.23, 0.0)], ids=["upright", "wedged"]
)
def test_event_rate_of_exact_agrees_with_the_prediction(positions, width, friction):
    scene = heap(positions, width, friction)
    simulation = start(scene, "exact")
    for _ in range(60):
        simulation.step()
    events_before = simulation.work["events"]
    for _ in range(60):
        simulation.step()
    predicted = event_rate(scene, contact_matrix(scene))
    # 56,000 to 77,000 were measured
    assert simulation.work["events"] - events_before == pytest.approx(predicted, rel=0.25)
    assert [w.kind for w in warnings(scene, engine="exact")] == []


def test_exact_is_exhausted_as_predicted_in_a_pile_with_friction() -> None:
    scene = heap(WEDGED, 0.23, 0.5)
    (warning,) = warnings(scene, engine="exact")
    assert warning.kind == "event_rate"
    assert float(warning.details["rate"]) > float(warning.details["allowed"])
    simulation = start(scene, "exact")
    with pytest.raises(Exhaustion, match="more than 1,000,000 events within one second"):
        for _ in range(180):
            simulation.step()
    assert "event_rate" in [w.kind for w in warnings(scene)]  # without an engine, warnings are of all engines
    assert warnings(scene, engine="pymunk") == warnings(scene, engine="reference")
    assert "event_rate" not in [w.kind for w in warnings(scene, engine="pymunk")]


@pytest.mark.parametrize("scene", [heap(WEDGED, 0.23, 0.5, restitution=1.0), heap(UPRIGHT[:1], 0.2, 0.5)])
def test_elastic_or_single_balls_have_no_event_rate(scene: Scene) -> None:
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
def test_divergence_time_of_a_gas_agrees_with_the_prediction(columns: int, radius: float) -> None:
    found, predicted = [], []
    for seed in (1, 2):
        scene = gas(columns, radius, seed, 30.0)
        first, other = (run(each, "exact", audit=False) for each in (scene, perturb(scene)) if each is not None)
        found.append(agreement_time(first, other, scene, 0.01 * radius))
        predicted.append(lyapunov_time(scene) or math.nan)
    # The rate was measured at 0.75 to 1.45 times that of the formula.
    assert 0.65 < sum(found) / sum(predicted) < 1.5


def test_horizon_is_noted_if_the_run_is_longer() -> None:
    until = lyapunov_time(gas(10, 0.25, 1, 1.0))
    assert [note.kind for note in notes(gas(10, 0.25, 1, 1.1 * until))] == ["horizon"]
    assert notes(gas(10, 0.25, 1, 0.9 * until)) == []
    assert lyapunov_time(gas(2, 0.25, 1, 9.0)) is None  # four balls are no crowd
