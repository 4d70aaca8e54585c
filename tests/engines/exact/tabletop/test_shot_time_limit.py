"""Shots with a time limit or too many events: they are reported as incomplete."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.engines.contract import Exhaustion
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.scene.description.surface import Stroke
from sandbox.scene.files.load import load, loads

CASES = Path(__file__).parent / "cases"


@pytest.mark.parametrize("until", [0.05, 0.4, 1.0])
def test_truncated_shot_matches_the_complete_shot_at_that_time(until: float) -> None:
    table = Table(load(CASES / "three_cushions.toml"))
    full, truncated = table.shoot(record_paths=True), table.shoot(until=until)
    assert full.complete
    assert not truncated.complete
    assert truncated.position == pytest.approx(full.at(np.array([until]))[0], abs=1e-14)  # the same parabola
    continued = table.after(truncated).shoot()
    assert continued.complete
    assert continued.position == pytest.approx(full.position, abs=1e-9)  # m: rounding, after the remaining collisions


def test_fan_reports_which_shots_are_incomplete() -> None:
    table = Table(load(CASES / "draw.toml"))
    strokes = [Stroke(aim=1.0, speed=speed) for speed in (0.05, 3.0)]
    fan = table.fan(strokes, until=2.0)
    assert list(fan.complete) == [True, False]
    assert fan.position[1] == pytest.approx(table.shoot(strokes[1], until=2.0).position, abs=0.0)


def test_shot_without_friction_never_completes() -> None:
    ball = '[[ball]]\nname = "cue"\nposition = [0, 0]\nvelocity = [1, 0]\nradius = 0.03\n'
    scene = loads(f"[surface]\nspinning_friction = 0.01\n{ball}")
    outcome = Table(scene).shoot(until=3.0)
    assert not outcome.complete
    assert outcome.position[0] == pytest.approx([3.0, 0.0], abs=1e-14)  # rounding


@pytest.mark.parametrize("limit", [7, 20_000])
def test_too_many_events_are_reported_at_any_limit(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_EVENTS", str(limit))  # kernels return after 20,000 events
    walls = "[[wall]]\npoints = [[-0.1, -1], [-0.1, 1]]\nrestitution = 1\n[[wall]]\npoints = [[0.1, -1], [0.1, 1]]\n"
    ball = '[[ball]]\nname = "cue"\nposition = [0, 0]\nvelocity = [100, 0]\nradius = 0.03\n'
    scene = loads(f"[surface]\nspinning_friction = 0.01\n{walls}restitution = 1\n{ball}")
    with pytest.raises(Exhaustion, match="events, more than allowed"):
        Table(scene).shoot()
    assert not Table(scene).fan_of(np.array([[100.0, 0.0, 0.0, 0.0, 0.0]])).complete[0]
