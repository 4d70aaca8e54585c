"""The search, on landscapes made by hand: error and counted cost are functions of the configuration alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random
from typing import Any

import pytest

from sandbox.measure.tradeoff import search as module
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation, SearchSpace
from sandbox.measure.tradeoff.metrics import METRICS, EvaluationContext
from sandbox.measure.tradeoff.search import SettingsSearch
from sandbox.scene.compile.scene import Scene
from tests.measure.tradeoff.evaluations_by_hand import context_of
from tests.runs_by_hand import DROP, scene_of

pytestmark = pytest.mark.full  # long runs and sweeps

Law = Callable[[Configuration], float | None]
"""The error of a configuration; infinite where it diverges, None where the metric says nothing of it."""

CHAIN = """
[world]
gravity = [0.0, -10.0]
duration = 0.4
[solver]
dt = 0.01
[[rope]]
name = "chain"
kind = "rods"
start = [0.0, 0.0]
end = [1.0, 0.0]
links = 5
radius = 0.05
fix = ["start"]
"""


def steps(configuration: Configuration) -> float:
    """Return substeps in one of the scene's steps."""
    return float(configuration.refinement) * configuration.substeps


def order(power: float, at_one: float = 1.0, floor: float = 0.0) -> Law:
    return lambda configuration: at_one * steps(configuration) ** -power + floor


class Landscape:
    """Trials as a law has them; costs are the configuration's work, and those of some options more."""

    def __init__(
        self,
        law: Law,
        price: Callable[[Configuration], float] = lambda configuration: 1.0,
        clock: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self.law, self.price = law, price
        self.asked: list[Configuration] = []
        self.clock = clock

    def __call__(
        self,
        configuration: Configuration,
        space: SearchSpace,
        contexts: Sequence[EvaluationContext],
        metric: str,
        limit: float,
        *_: Any,
    ) -> Evaluation:
        self.asked.append(configuration)
        error = self.law(configuration)
        bad = error is not None and math.isinf(error)
        metrics = {**dict.fromkeys(METRICS), "max_position": None if bad else error}
        cost = 1e-3 * configuration.work * self.price(configuration)
        status, reason = ("diverged", "by law") if bad else ("ok", None)
        settings = space.settings(configuration)
        return Evaluation(
            configuration=configuration,
            engine=configuration.engine,
            asked=settings,
            settings=settings,
            changes={},
            error=metrics[metric],
            cost=None,
            cost_median=None,
            repeats=0,
            counted=None,
            is_own=False,
            status=status,
            reason=reason,
            metrics=metrics,
            work={},
            counted_seconds=cost,
            spent_seconds=cost,
            seconds=self.clock(),
        )


def searched(
    monkeypatch: pytest.MonkeyPatch,
    landscape: Landscape,
    tolerance: float,
    *,
    engines: tuple[str, ...] = ("pymunk",),
    scene: Scene | None = None,
    budget: float | None = None,
    most: int = 150,
    effort: float = 1e6,
    trying: Callable[..., Evaluation] | None = None,
) -> SettingsSearch:
    monkeypatch.setattr(module, "evaluate", trying or landscape)
    scene = scene_of(DROP) if scene is None else scene
    contexts = [context_of(scene, until=0.0)]
    space = SearchSpace(scene, scene.solver, engines, frame=1.0)
    found = SettingsSearch(space, contexts, "max_position", tolerance, budget, effort, most, lambda _: None)
    found.run()
    return found


def cheapest(search: SettingsSearch) -> Evaluation:
    good = [evaluation for evaluation in search.evaluations.values() if evaluation.ranking_error <= search.tolerance]
    return min(good, key=lambda evaluation: evaluation.counted_seconds)


@pytest.mark.parametrize(("power", "tolerance"), [(1.0, 0.3), (1.0, 0.0023), (2.0, 0.011), (4.0, 0.0023)])
def test_fewest_steps_within_the_tolerance_are_found(
    monkeypatch: pytest.MonkeyPatch, power: float, tolerance: float
) -> None:
    search = searched(monkeypatch, Landscape(order(power)), tolerance)
    needed = tolerance ** (-1.0 / power)
    got = steps(cheapest(search).configuration)
    # It closes in to an eighth of what it takes, or to the next whole number.
    assert needed <= got <= max(needed * 9.0 / 8.0, math.ceil(needed)) + 1e-9


def test_coarser_than_the_scene_is_found_where_it_will_do(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searched(monkeypatch, Landscape(order(1.0)), 5.0)
    assert (
        steps(cheapest(search).configuration) == 0.25
    )  # 1/4 of the steps: 4 times the error; 1/8 leaves too few steps


def test_errors_of_nothing_are_no_trap(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searched(monkeypatch, Landscape(lambda _: 0.0), 1e-3)
    assert steps(cheapest(search).configuration) == 0.25


@pytest.mark.parametrize("needed", [1, 3, 40])
def test_nothing_tolerated_is_no_trap(monkeypatch: pytest.MonkeyPatch, needed: int) -> None:
    search = searched(monkeypatch, Landscape(lambda v: 0.0 if steps(v) >= needed else 2.0), 0.0)
    assert needed <= steps(cheapest(search).configuration) <= max(needed * 9 / 8, needed)


def test_floor_of_the_model_is_not_dug_at(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0, floor=0.5))
    search = searched(monkeypatch, landscape, 0.1)
    assert not [t for t in search.evaluations.values() if t.ranking_error <= 0.1]
    # 64 substeps leave 0.97 of what 32 do: that is not gone on from.
    assert max(map(steps, landscape.asked)) == 64.0


def test_better_way_is_found_where_the_usual_one_has_a_floor(monkeypatch: pytest.MonkeyPatch) -> None:
    def law(configuration: Configuration) -> float:
        good = dict(configuration.options).get("integrator") == "rk4"
        return steps(configuration) ** -4.0 * 0.1 if good else 0.5 + 1.0 / steps(configuration)

    search = searched(monkeypatch, Landscape(law), 0.01, engines=("reference",), most=60)
    found = cheapest(search).configuration
    assert dict(found.options)["integrator"] == "rk4"
    assert steps(found) == 2.0


def test_two_words_that_only_help_together_with_steps_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def law(configuration: Configuration) -> float:
        options = dict(configuration.options)
        helping = (options.get("integrator") == "velocity_verlet") + (options.get("detection") == "swept")
        return 10.0 ** (-2 * helping) / steps(configuration)

    search = searched(monkeypatch, Landscape(law), 0.5e-4, engines=("reference",), most=80)
    assert dict(cheapest(search).configuration.options) == {"detection": "swept", "integrator": "velocity_verlet"}
    assert steps(cheapest(search).configuration) == 2.0


def test_iterations_that_are_needed_are_found_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searched(monkeypatch, Landscape(lambda v: 30.0 / v.iterations), 1.0, scene=scene_of(CHAIN))
    assert 30 <= cheapest(search).configuration.iterations <= 33
    assert steps(cheapest(search).configuration) <= 1.0


def test_start_that_diverges_is_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    search = searched(monkeypatch, Landscape(lambda v: 0.01 if steps(v) >= 13 else math.inf), 0.1)
    assert 13 <= steps(cheapest(search).configuration) <= 14
    failed = [evaluation for evaluation in search.evaluations.values() if evaluation.status == "diverged"]
    assert [evaluation.reason for evaluation in failed] == ["by law"] * len(failed)
    assert any(evaluation.configuration == Configuration("pymunk") for evaluation in failed)


def test_coarser_steps_are_tried_where_the_scenes_own_take_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))

    def bounded(
        configuration: Configuration,
        space: SearchSpace,
        contexts: Sequence[EvaluationContext],
        metric: str,
        limit: float,
        *_: Any,
    ) -> Evaluation:
        found = landscape(configuration, space, contexts, metric, limit)
        return (
            found
            if steps(configuration) <= 0.25
            else replace(found, status="stopped", error=None, metrics=dict.fromkeys(METRICS))
        )

    search = searched(monkeypatch, landscape, 5.0, trying=bounded)
    assert steps(cheapest(search).configuration) == 0.25
    assert max(map(steps, landscape.asked)) == 1.0
    assert landscape.asked[1].work < landscape.asked[0].work  # nothing as slow is tried beside it


def test_metric_that_says_nothing_is_not_sought_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(lambda _: None)
    searched(monkeypatch, landscape, 0.1)
    assert len(landscape.asked) < 20


def test_dominated_branches_are_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where options only cost, each is tried beside the front and none is gone on from."""
    landscape = Landscape(order(1.0), price=lambda configuration: 3.0 ** len(configuration.options))
    search = searched(monkeypatch, landscape, 0.1, engines=("reference",))
    assert not cheapest(search).configuration.options
    together = {configuration for configuration in landscape.asked if len(configuration.options) > 1}
    assert together == {configuration for configuration in search.space.presets() if len(configuration.options) > 1}


def test_ways_that_only_help_together_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exact flight and impacts within a step: each alone leaves the other's error, and costs more."""
    both = {("integrator", "velocity_verlet"), ("detection", "swept")}
    landscape = Landscape(
        lambda configuration: 1e-9 if both <= set(configuration.options) else 1.0 / steps(configuration),
        price=lambda configuration: 3.0 ** len(configuration.options),
    )
    search = searched(monkeypatch, landscape, 1e-6, engines=("reference",))
    assert set(cheapest(search).configuration.options) == both


def test_no_variant_is_tried_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))
    search = searched(monkeypatch, landscape, 0.01, engines=("pymunk", "exact", "reference"), most=60)
    assert len(set(landscape.asked)) == len(landscape.asked)
    assert list(search.evaluations) == landscape.asked
    filled = {(v.engine, search.space.resolved(v)) for v in landscape.asked}
    assert len(filled) == len(landscape.asked)


def test_same_landscape_is_searched_in_the_same_order(monkeypatch: pytest.MonkeyPatch) -> None:
    ways = []
    for _ in range(2):
        landscape = Landscape(order(1.0))
        searched(monkeypatch, landscape, 0.02, engines=("pymunk", "reference"), most=40)
        ways.append(landscape.asked)
    assert ways[0] == ways[1]


@pytest.mark.parametrize("most", [1, 2, 7])
def test_most_is_kept(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    landscape = Landscape(order(1.0))
    searched(monkeypatch, landscape, 1e-3, most=most)
    # The last fifth is kept for closing in, of which nothing meets the tolerance here.
    assert max(1.0, 0.8 * most) <= len(landscape.asked) <= most


def test_effort_is_kept_by_the_counted_cost_of_the_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape, allowed = Landscape(order(1.0)), []

    def noted(
        configuration: Configuration,
        space: SearchSpace,
        contexts: Sequence[EvaluationContext],
        metric: str,
        limit: float,
        *_: Any,
    ) -> Evaluation:
        allowed.append(limit)
        return landscape(configuration, space, contexts, metric, limit)

    search = searched(monkeypatch, landscape, 1e-3, effort=0.1, most=400, trying=noted)
    assert search.spent == pytest.approx(
        sum(evaluation.spent_seconds for evaluation in search.evaluations.values()), rel=1e-12
    )  # a sum
    assert search.spent <= 0.1 + 1e-12  # what would cost more than what is left was left out
    assert search.skipped
    assert max(allowed[1:]) <= 0.2 * 0.1  # a fifth of it, for one


@pytest.mark.parametrize("slower", [1e-3, 1.0, 1e3])
def test_the_clock_changes_nothing(monkeypatch: pytest.MonkeyPatch, slower: float) -> None:
    noise = Random(4)
    plain, odd = Landscape(order(1.0)), Landscape(order(1.0), clock=lambda: slower * noise.random())
    for landscape in (plain, odd):
        searched(monkeypatch, landscape, 0.02, engines=("pymunk", "reference", "exact"), effort=0.5)
    assert plain.asked == odd.asked


def test_a_time_limit_ends_the_search_and_keeps_what_was_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    landscape = Landscape(order(1.0))

    def slow(
        configuration: Configuration,
        space: SearchSpace,
        contexts: Sequence[EvaluationContext],
        metric: str,
        limit: float,
        *_: Any,
    ) -> Evaluation:
        now[0] += 1.0
        return landscape(configuration, space, contexts, metric, limit)

    monkeypatch.setattr(module, "clock_without_compilation", lambda: now[0])
    monkeypatch.setattr(module, "evaluate", slow)
    scene = scene_of(DROP)
    space = SearchSpace(scene, scene.solver, ("pymunk",))
    search = SettingsSearch(
        space, [context_of(scene, until=0.0)], "max_position", 1e-3, None, 1e6, 400, lambda _: None, 5.0
    )
    assert len(search.run()) == 5


def test_own_settings_of_every_engine_are_tried_whatever_they_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))
    search = searched(monkeypatch, landscape, 1e-3, engines=("pymunk", "exact", "reference"), effort=1e-9)
    assert list(search.evaluations) == search.space.starts()


def test_budget_is_aimed_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tolerance is met at once; what the budget buys is looked for all the same, and a finer step is better."""
    budget = 1e-3 * Configuration("pymunk", substeps=20).work
    search = searched(monkeypatch, Landscape(order(1.0)), 2.0, budget=budget)
    able = [evaluation for evaluation in search.evaluations.values() if evaluation.counted_seconds <= budget]
    best = min(able, key=lambda evaluation: evaluation.ranking_error)
    assert steps(best.configuration) >= 10.0  # within a factor of 2 of what it buys


def test_every_engine_gets_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))
    searched(monkeypatch, landscape, 0.05, engines=("pymunk", "exact", "reference"), most=60)
    assert {configuration.engine for configuration in landscape.asked} == {"pymunk", "exact", "reference"}


def test_nobody_to_ask_is_no_trap(monkeypatch: pytest.MonkeyPatch) -> None:
    assert searched(monkeypatch, Landscape(order(1.0)), 0.1, engines=()).evaluations == {}


def test_steps_of_a_scene_longer_than_its_duration_are_tried_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP.replace("dt = 0.02", "dt = 1.0"))
    search = searched(monkeypatch, Landscape(order(1.0)), 0.1, scene=scene)
    assert search.space.starts()[0] in search.evaluations
    assert 10.0 <= steps(cheapest(search).configuration) <= 11.25  # an eighth more at most
