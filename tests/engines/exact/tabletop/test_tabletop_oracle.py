"""Shots on a surface against results of an independent simulator, stored in `cases`."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.engines.exact.tabletop.shot_result import ShotEvent, ShotResult
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import load

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

CASES = Path(__file__).parent / "cases"
NAMES = sorted(path.stem for path in CASES.glob("*.json"))
EVENT_KINDS = {
    "slide_roll": "rolls",
    "roll_spin": "spins",
    "roll_stop": "rests",
    "spin_stop": "rests",
    "slide_stop": "rests",
}
EVENT_KINDS |= {"slide_spin": "spins", "ball_ball": "ball", "pocket": "pocket"}


def case(name: str) -> dict[str, Any]:
    return json.loads((CASES / f"{name}.json").read_text())


@pytest.mark.parametrize("name", NAMES)
def test_positions_and_velocities_match_the_oracle(name: str) -> None:
    stored, scene = case(name), load(CASES / f"{name}.toml")
    trajectory = run(scene, "exact")
    frames = stored["frames"]
    # m: accuracy of the stored shot, at least rounding after about twenty impacts
    tolerance = max(1e-9, 4.0 * stored["position_error"])
    np.testing.assert_allclose(trajectory.position[frames], stored["position"], atol=tolerance)
    # m/s and rad/s: the position error over a fraction of a second, and that divided by the radius of a ball
    np.testing.assert_allclose(trajectory.velocity[frames], stored["velocity"], atol=10.0 * tolerance)
    np.testing.assert_allclose(trajectory.spin[frames], stored["spin"], atol=400.0 * tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_events_match_the_oracle_in_order(name: str) -> None:
    stored, scene = case(name), load(CASES / f"{name}.toml")
    until = stored["trusted_until"]
    outcome: ShotResult = Table(scene).shoot(until=until)
    found = [key(event) for event in outcome.events]
    expected = [(EVENT_KINDS.get(e["kind"], "cushion"), tuple(e["names"]), e["time"]) for e in stored["events"]]
    expected = [each for each in expected if each[2] <= until]
    assert [each[:2] for each in found] == [each[:2] for each in expected]
    # s: balls move at some mm/s or more at an event, and positions are known to 1e-9 m
    np.testing.assert_allclose([each[2] for each in found], [each[2] for each in expected], atol=1e-6)


def key(event: ShotEvent) -> tuple[str, tuple[str, ...], float]:
    kind = "cushion" if event.kind == "jaw" else event.kind
    names = (event.ball,) if event.partner is None else (event.ball, event.partner)
    return kind, names, event.time
