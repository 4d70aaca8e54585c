"""The search on synthetic landscapes: error and counted cost are functions of the configuration alone."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest

from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.tradeoff import search as module
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation, SearchSpace
from sandbox.measure.tradeoff.search import SettingsSearch
from sandbox.scene.compile.scene import Scene
from tests.measure.tradeoff.evaluations_by_hand import context_of, point_of
from tests.runs_by_hand import DROP, SWING, scene_of

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

ErrorFunction = Callable[[Configuration], float | None]
"""Error of a configuration; infinite if it diverges, None if the metric is not defined."""


def steps(configuration: Configuration) -> float:
    """Return the number of substeps in one step of the scene."""
    return float(configuration.refinement) * configuration.substeps


def order(power: float, at_one: float = 1.0, floor: float = 0.0) -> ErrorFunction:
    return lambda configuration: at_one * steps(configuration) ** -power + floor


class Landscape:
    """Replacement of `evaluate` with errors by a function; costs are the work times the price of the options."""

    def __init__(
        self,
        error: ErrorFunction,
        price: Callable[[Configuration], float] = lambda configuration: 1.0,
    ) -> None:
        self.error, self.price = error, price
        self.evaluated: list[Configuration] = []

    def __call__(
        self,
        configuration: Configuration,
        space: SearchSpace,
        contexts: Sequence[EvaluationContext],
        metric: str,
        limit: float,
        *_: Any,
    ) -> Evaluation:
        self.evaluated.append(configuration)
        error = self.error(configuration)
        is_diverged = error is not None and math.isinf(error)
        metrics = {**dict.fromkeys(METRICS), "max_position": None if is_diverged else error}
        cost = 1e-3 * configuration.work * self.price(configuration)
        status, reason = ("diverged", "synthetic") if is_diverged else ("ok", None)
        settings = space.settings(configuration)
        return replace(
            point_of(cost, metrics[metric], configuration.engine),
            configuration=configuration,
            asked=settings,
            settings=settings,
            status=status,
            reason=reason,
            metrics=metrics,
            counted_seconds=cost,
            spent_seconds=cost,
        )


def search_landscape(
    monkeypatch: pytest.MonkeyPatch,
    landscape: Landscape,
    tolerance: float,
    *,
    engines: tuple[str, ...] = ("pymunk",),
    scene: Scene | None = None,
    budget: float | None = None,
    most: int = 150,
    effort: float = 1e6,
    evaluate: Callable[..., Evaluation] | None = None,
    **more: Any,
) -> SettingsSearch:
    monkeypatch.setattr(module, "evaluate", evaluate or landscape)
    scene = scene_of(DROP) if scene is None else scene
    contexts = [context_of(scene, until=0.0)]
    space = SearchSpace(scene, scene.solver, engines, frame=1.0)
    found = SettingsSearch(space, contexts, "max_position", tolerance, budget, effort, most, lambda _: None, **more)
    found.run()
    return found


def cheapest(search: SettingsSearch) -> Evaluation:
    accurate = [
        evaluation for evaluation in search.evaluations.values() if evaluation.ranking_error <= search.tolerance
    ]
    return min(accurate, key=lambda evaluation: evaluation.counted_seconds)


@pytest.mark.parametrize(("power", "tolerance"), [(1.0, 0.3), (1.0, 0.0023), (2.0, 0.011), (4.0, 0.0023)])
def test_fewest_steps_within_the_tolerance_are_found(monkeypatch, power, tolerance):
    search = search_landscape(monkeypatch, Landscape(order(power)), tolerance)
    needed = tolerance ** (-1.0 / power)
    found_steps = steps(cheapest(search).configuration)
    # The bisection ends within an eighth, or at the next whole number.
    assert needed <= found_steps <= max(needed * 9.0 / 8.0, math.ceil(needed)) + 1e-9


@pytest.mark.parametrize("at_one", [0.0, 1.0])
def test_coarser_steps_than_those_of_the_scene_are_found_if_they_suffice(monkeypatch, at_one: float) -> None:
    search = search_landscape(monkeypatch, Landscape(order(1.0, at_one)), 5.0)
    # 1/4 of the steps has 4 times the error; 1/8 has too few steps
    assert steps(cheapest(search).configuration) == 0.25


@pytest.mark.parametrize("needed", [1, 3, 40])
def test_search_ends_with_a_tolerance_of_zero(monkeypatch: pytest.MonkeyPatch, needed: int) -> None:
    search = search_landscape(monkeypatch, Landscape(lambda v: 0.0 if steps(v) >= needed else 2.0), 0.0)
    assert needed <= steps(cheapest(search).configuration) <= max(needed * 9 / 8, needed)


@pytest.mark.parametrize("needed", [100, 400])
def test_errors_that_grow_before_they_fall_do_not_end_the_refinement(
    monkeypatch: pytest.MonkeyPatch, needed: int
) -> None:
    """As where a contact is missed with any number of substeps below some hundred."""
    search = search_landscape(
        monkeypatch, Landscape(lambda v: 0.01 if steps(v) >= needed else 0.2 + steps(v) / 1e4), 0.1
    )
    assert needed <= steps(cheapest(search).configuration) <= needed * 9 / 8
    assert search.limit is None


@pytest.mark.parametrize(("most", "effort", "limit"), [(60, 1e6, "points"), (150, 0.05, "effort"), (150, 1e6, None)])
def test_search_without_an_answer_says_what_ended_it(
    monkeypatch: pytest.MonkeyPatch, most: int, effort: float, limit: str | None
) -> None:
    landscape = Landscape(order(1.0, floor=0.5))
    search = search_landscape(monkeypatch, landscape, 0.1, most=most, effort=effort)
    assert not [t for t in search.evaluations.values() if t.ranking_error <= 0.1]
    assert search.limit == limit


def test_two_helpful_options_and_finer_steps_are_combined(monkeypatch: pytest.MonkeyPatch) -> None:
    def error(configuration: Configuration) -> float:
        options = dict(configuration.options)
        helpful = (options.get("integrator") == "velocity_verlet") + (options.get("detection") == "swept")
        return 10.0 ** (-2 * helpful) / steps(configuration)

    search = search_landscape(monkeypatch, Landscape(error), 0.5e-4, engines=("reference",), most=80)
    assert dict(cheapest(search).configuration.options) == {"detection": "swept", "integrator": "velocity_verlet"}
    assert steps(cheapest(search).configuration) == 2.0


def test_iterations_are_traded_for_substeps_where_that_is_cheaper(monkeypatch: pytest.MonkeyPatch) -> None:
    """Substeps count twice for the error, as for a stack, and iterations cost more than the rest."""
    landscape = Landscape(lambda v: 400.0 / steps(v) ** 2 / v.iterations, lambda v: 1.0 + v.iterations)
    found = cheapest(search_landscape(monkeypatch, landscape, 1.0, most=30, scene=scene_of(SWING)))
    pairs = ((s, k) for s in range(1, 65) for k in range(1, 65) if s * s * k >= 400)
    best = min(s * (1.0 + k / 20.0) * (1.0 + k) for s, k in pairs)
    assert found.counted_seconds <= 1.15e-3 * best  # the bisection ends within an eighth


def test_smallest_sufficient_number_of_iterations_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_landscape(monkeypatch, Landscape(lambda v: 30.0 / v.iterations), 1.0, scene=scene_of(SWING))
    assert 30 <= cheapest(search).configuration.iterations <= 33
    assert steps(cheapest(search).configuration) <= 1.0


def test_diverging_start_is_refined(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_landscape(monkeypatch, Landscape(lambda v: 0.01 if steps(v) >= 13 else math.inf), 0.1)
    assert 13 <= steps(cheapest(search).configuration) <= 14
    failed = [evaluation for evaluation in search.evaluations.values() if evaluation.status == "diverged"]
    assert [evaluation.reason for evaluation in failed] == ["synthetic"] * len(failed)
    assert any(evaluation.configuration == Configuration("pymunk") for evaluation in failed)


def test_coarser_steps_are_tried_if_those_of_the_scene_take_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))

    def bounded(configuration: Configuration, *more: Any) -> Evaluation:
        found = landscape(configuration, *more)
        return (
            found
            if steps(configuration) <= 0.25
            else replace(found, status="stopped", error=None, metrics=dict.fromkeys(METRICS))
        )

    search = search_landscape(monkeypatch, landscape, 5.0, evaluate=bounded)
    assert steps(cheapest(search).configuration) == 0.25
    assert max(map(steps, landscape.evaluated)) == 1.0
    assert landscape.evaluated[1].work < landscape.evaluated[0].work  # no other configuration as slow is evaluated


def test_search_for_an_undefined_metric_ends_early(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(lambda _: None)
    search_landscape(monkeypatch, landscape, 0.1)
    assert len(landscape.evaluated) < 20


def test_dominated_branches_are_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """If options only add cost, each is evaluated once beside the front and none is explored further."""
    landscape = Landscape(order(1.0), price=lambda configuration: 3.0 ** len(configuration.options))
    search = search_landscape(monkeypatch, landscape, 0.1, engines=("reference",))
    assert not cheapest(search).configuration.options
    combined = {configuration for configuration in landscape.evaluated if len(configuration.options) > 1}
    assert combined == {configuration for configuration in search.space.presets() if len(configuration.options) > 1}


def test_options_that_help_only_in_combination_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exact flight and exact impact times: each alone leaves the error of the other, and costs more."""
    both = {("integrator", "velocity_verlet"), ("detection", "swept")}
    landscape = Landscape(
        lambda configuration: 1e-9 if both <= set(configuration.options) else 1.0 / steps(configuration),
        price=lambda configuration: 3.0 ** len(configuration.options),
    )
    search = search_landscape(monkeypatch, landscape, 1e-6, engines=("reference",))
    assert set(cheapest(search).configuration.options) == both


def test_no_configuration_is_evaluated_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))
    search = search_landscape(monkeypatch, landscape, 0.01, engines=("pymunk", "exact", "reference"), most=60)
    assert len(set(landscape.evaluated)) == len(landscape.evaluated)
    assert list(search.evaluations) == landscape.evaluated
    resolved = {(v.engine, search.space.resolved(v)) for v in landscape.evaluated}
    assert len(resolved) == len(landscape.evaluated)


@pytest.mark.parametrize("most", [1, 2, 7])
def test_number_of_evaluations_is_limited(monkeypatch: pytest.MonkeyPatch, most: int) -> None:
    landscape = Landscape(order(1.0))
    search_landscape(monkeypatch, landscape, 1e-3, most=most)
    # The last fifth is reserved for bisection, which does not start here, as nothing meets the tolerance.
    assert max(1.0, 0.8 * most) <= len(landscape.evaluated) <= most


def test_effort_limits_the_counted_cost_of_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape, limits = Landscape(order(1.0)), []

    def recorded(configuration: Configuration, *more: Any) -> Evaluation:
        limits.append(more[3])
        return landscape(configuration, *more)

    search = search_landscape(monkeypatch, landscape, 1e-3, effort=0.1, most=400, evaluate=recorded)
    assert search.spent == pytest.approx(
        sum(evaluation.spent_seconds for evaluation in search.evaluations.values()), rel=1e-12
    )  # a sum
    assert search.spent <= 0.1 + 1e-12  # configurations that cost more than the rest were skipped
    assert search.skipped
    assert max(limits[1:]) <= 0.2 * 0.1  # at most a fifth of the effort for one run


def test_search_finds_accurate_settings_within_the_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tolerance is met at once; finer steps within the budget are searched nevertheless."""
    budget = 1e-3 * Configuration("pymunk", substeps=20).work
    search = search_landscape(monkeypatch, Landscape(order(1.0)), 2.0, budget=budget)
    affordable = [evaluation for evaluation in search.evaluations.values() if evaluation.counted_seconds <= budget]
    best = min(affordable, key=lambda evaluation: evaluation.ranking_error)
    assert steps(best.configuration) >= 10.0  # within a factor of 2 of the budget


def test_scene_with_a_step_longer_than_its_duration_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP.replace("dt = 0.02", "dt = 1.0"))
    search = search_landscape(monkeypatch, Landscape(order(1.0)), 0.1, scene=scene)
    assert search.space.starts()[0] in search.evaluations
    assert 10.0 <= steps(cheapest(search).configuration) <= 11.25  # at most an eighth more


def test_time_limit_ends_the_search_and_keeps_its_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    landscape = Landscape(order(1.0))
    monkeypatch.setattr(module, "clock_without_compilation", lambda: float(len(landscape.evaluated)))
    search = search_landscape(monkeypatch, landscape, 1e-3, most=400, deadline=5.0)
    assert list(search.evaluations) == landscape.evaluated
    assert len(landscape.evaluated) == 5
