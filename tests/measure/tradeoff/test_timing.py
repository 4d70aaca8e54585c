"""Costs are timed in turns, without recording. No test asserts on time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sandbox.engines.contract import Divergence, Exhaustion, Simulation
from sandbox.measure.tradeoff import timing as module
from sandbox.measure.tradeoff.timing import CostRatio, TimedRun, Timing, run_seconds, time_in_turns, warm_up
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from tests.runs_by_hand import DROP, scene_of


def test_cost_is_scaled_to_a_simulated_second() -> None:
    assert Timing.of([0.2, 0.1, 0.6], 4.0) == Timing(25.0, 50.0, 3, (0.2, 0.1, 0.6))


@pytest.mark.fail_slow(60)  # 600 bootstraps
@pytest.mark.parametrize("turns", [5, 8, 20])
def test_interval_of_a_cost_ratio_covers_the_true_one(turns: int) -> None:
    """Times of a machine whose speed varies by 20 % from turn to turn, and which other programs interrupt."""
    random, covered, studies = np.random.default_rng(7), 0, 600
    for _ in range(studies):
        speed = np.exp(0.2 * random.normal(size=turns))
        noise = 1.0 + 0.05 * random.exponential(size=(2, turns)) + 0.5 * (random.random((2, turns)) < 0.05)
        a, b = np.array([[2.4], [1.0]]) * speed * noise
        found = CostRatio.of(a.tolist(), b.tolist())
        assert found is not None and found.interval is not None
        covered += found.interval[0] <= 2.4 <= found.interval[1]
    # The extremes of 5 ratios enclose the true one in 93.75 %, and the expansion makes intervals of 8 too wide; the
    # fraction of 600 studies has a standard deviation of 0.9 %.
    assert 0.91 <= covered / studies <= 0.995


def test_turns_are_paired() -> None:
    """A machine that is ten times slower in some turns changes no ratio."""
    slow = [1.0, 10.0, 1.0, 10.0, 1.0]
    found = CostRatio.of([3.0 * each for each in slow], slow)
    assert found == CostRatio(3.0, (3.0, 3.0))
    assert str(found) == "3 (3 to 3)"


def test_few_turns_have_no_interval_and_unpaired_ones_no_ratio() -> None:
    assert CostRatio.of([2.0, 2.0, 4.0, 2.0], [1.0] * 4) == CostRatio(2.0, None)
    assert CostRatio.of([2.0], [1.0, 1.0]) is None
    assert CostRatio.of([], []) is None


@pytest.mark.parametrize("engine", ["pymunk", "exact"])
def test_run_is_stepped_to_its_end(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    original, ended = module.start, []

    def watched(scene: Scene, engine: str, settings: Settings) -> object:
        simulation = original(scene, engine, settings)
        close = simulation.close
        simulation.close = lambda: (ended.append(simulation.frame().time), close())  # type: ignore[method-assign]
        return simulation

    monkeypatch.setattr(module, "start", watched)
    for dt in (0.02, 0.03):  # 20 whole steps; 13 and a third
        seconds = run_seconds(scene, engine, scene.solver.replace(dt=dt))
        assert seconds > 0.0
    assert ended == pytest.approx([0.4, 0.42 if engine == "pymunk" else 0.4], rel=1e-12)  # sum of the steps


@pytest.mark.parametrize("error", [Divergence(0.1, "a", "is gone"), Exhaustion("enough")])
def test_run_that_fails_has_no_cost_and_is_closed(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = []

    def step() -> None:
        raise error

    broken = SimpleNamespace(step=step, frame=lambda: None, close=lambda: closed.append(True))
    monkeypatch.setattr(module, "start", lambda *_: broken)
    scene = scene_of(DROP)
    assert time_in_turns([TimedRun(scene, "pymunk", scene.solver)], 3) == [None]
    assert closed == [True, True]  # the warm-up and the first turn; no repeat after that


def test_runs_are_warmed_up_and_timed_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    order: list[str] = []

    def seconds(scene: Scene, engine: str, settings: Settings) -> float:
        order.append(engine)
        return 1.0

    monkeypatch.setattr(module, "run_seconds", seconds)
    monkeypatch.setattr(module, "warm_up", lambda _, engine, settings: order.append(f"warm {engine}"))
    scene = scene_of(DROP)
    found = time_in_turns([TimedRun(scene, "a", scene.solver), TimedRun(scene, "b", scene.solver)], 3)
    assert order == ["warm a", "warm b"] + ["a", "b"] * 3
    assert [each.repeats for each in found if each is not None] == [3, 3]


@pytest.mark.parametrize("engine", ["pymunk", "exact", "reference"])
@pytest.mark.parametrize(
    ("dt", "end"),
    [
        (0.02, 0.02 * module.WARM_UP_STEPS),  # of a run of 0.4 s
        (0.4, 0.4),
        (0.5, 0.4),  # a step that the end of the run shortens, but not on pymunk
    ],
)
def test_warm_up_is_short_even_for_a_run_of_one_step(engine, dt, end, monkeypatch):
    original, started = module.start, list[Simulation]()

    def begin(*arguments: Any) -> Simulation:
        started.append(original(*arguments))
        return started[-1]

    monkeypatch.setattr(module, "start", begin)
    scene = scene_of(DROP)
    warm_up(scene, engine, scene.solver.replace(dt=dt))
    (simulation,) = started
    end = dt if simulation.makes_whole_steps and dt > end else end
    assert simulation.time == pytest.approx(end, rel=1e-12)  # rounding of a sum
