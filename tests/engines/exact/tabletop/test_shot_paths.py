"""Recorded paths of a shot, evaluated at any time."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.surface import Stroke
from sandbox.scene.files.load import load

CASES = Path(__file__).parent / "cases"


def scene(name: str) -> Scene:
    return load(CASES / f"{name}.toml")


@pytest.mark.parametrize("name", ["draw", "swerve", "pot", "row", "three_cushions", "rattle"])
def test_positions_at_any_time_match_a_run(name: str) -> None:
    shot = scene(name)
    frames = run(shot, "exact")
    outcome = Table(shot).shoot(record_paths=True)
    difference = np.abs(outcome.at(frames.time) - frames.position)
    assert difference.max() < 1e-12  # m: the same parabolas, summed in another order


def test_positions_can_be_evaluated_in_any_order_and_rest_after_the_end() -> None:
    outcome = Table(scene("three_cushions")).shoot(record_paths=True)
    end = outcome.duration
    late, early, middle = outcome.at(np.array([end + 5.0, 0.0, end / 2.0]))
    assert late == pytest.approx(outcome.position, abs=0.0)
    assert early == pytest.approx(Table(scene("three_cushions")).position, abs=0.0)
    assert middle == pytest.approx(outcome.at(np.array([end / 2.0]))[0], abs=0.0)


def test_pocketed_ball_is_at_the_centre_of_its_pocket() -> None:
    shot = scene("pot")
    outcome = Table(shot).shoot(record_paths=True)
    time = next(event.time for event in outcome.events if event.kind == "pocket" and event.ball == "object")
    before, after = outcome.at(np.array([np.nextafter(time, 0.0), time]))[:, 1]
    centre, radius = np.asarray(shot.pockets[5].position), shot.pockets[5].radius
    assert np.hypot(*(before - centre)) == pytest.approx(radius, abs=1e-12)  # m: it enters over the rim
    assert after == pytest.approx(centre, abs=0.0)


def test_paths_are_recorded_from_the_first_shot() -> None:
    table = Table(scene("nine_ball_break"))
    stroke = Stroke(aim=1.57, speed=3.0)
    first, second = table.shoot(stroke, record_paths=True), table.shoot(stroke, record_paths=True)
    assert first.path is not None and second.path is not None
    assert first.path.tobytes() == second.path.tobytes()
    assert first.at(np.array([0.0]))[0] == pytest.approx(table.position, abs=0.0)


def test_positions_are_refused_if_paths_were_not_recorded() -> None:
    with pytest.raises(ValueError, match="not recorded"):
        Table(scene("draw")).shoot().at(np.array([1.0]))
