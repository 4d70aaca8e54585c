"""Costs: of separate repeats, in turns, with nothing recorded; no figure of them is asserted on."""

import math
from types import SimpleNamespace

import pytest
from runs_by_hand import DROP, scene_of

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.measure.tradeoff import cost as module
from sandbox.measure.tradeoff.cost import Cost, costs, seconds_of
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings


def test_cost_is_scaled_to_a_simulated_second() -> None:
    assert Cost.of([0.2, 0.1, 0.6], 4.0) == Cost(25.0, 50.0, 3)


@pytest.mark.parametrize("engine", ["pymunk", "exact"])
def test_run_is_stepped_to_its_end(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    real, ended = module.start, []

    def watched(scene: Scene, engine: str, settings: Settings) -> object:
        simulation = real(scene, engine, settings)
        close = simulation.close
        simulation.close = lambda: (ended.append(simulation.frame().time), close())  # type: ignore[method-assign]
        return simulation

    monkeypatch.setattr(module, "start", watched)
    for dt in (0.02, 0.03):  # 20 whole steps; 13 and a third
        seconds = seconds_of(scene, engine, scene.solver.replace(dt=dt))
        assert seconds is not None
        assert seconds > 0.0
    assert ended == pytest.approx([0.4, 0.4], rel=1e-12)  # the sum of the steps


@pytest.mark.parametrize("error", [Divergence(0.1, "a", "is gone"), Exhaustion("enough")])
def test_run_that_does_not_end_has_no_cost_and_is_closed(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    closed = []

    def step() -> None:
        raise error

    broken = SimpleNamespace(step=step, frame=lambda: None, close=lambda: closed.append(True))
    monkeypatch.setattr(module, "start", lambda *_: broken)
    scene = scene_of(DROP)
    assert costs(scene, [("pymunk", scene.solver)], 3, math.inf) == [None]
    assert closed == [True]  # and not tried again


def test_ways_are_timed_in_turns_as_long_as_there_is_time(monkeypatch: pytest.MonkeyPatch) -> None:
    now, order = [0.0], []

    def seconds(scene: Scene, engine: str, settings: Settings) -> float:
        order.append(engine)
        now[0] += 1.0
        return 1.0

    monkeypatch.setattr(module, "seconds_of", seconds)
    monkeypatch.setattr(module, "working", lambda: now[0])
    scene = scene_of(DROP)
    ways = [("a", scene.solver), ("b", scene.solver)]
    found = costs(scene, ways, 5, 6.0)
    assert order == ["a", "b"] * 3  # a fourth turn would end at 8 s
    assert [each.repeats for each in found if each is not None] == [3, 3]
    order.clear()
    costs(scene, ways, 5, 0.0)
    assert order == ["a", "b"]  # once, whatever it takes
