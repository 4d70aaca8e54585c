"""Weighing: small scenes from end to end, their picks run again by others."""

import json
import math
from random import Random
from time import perf_counter
from typing import Any

import pytest

import sandbox
from sandbox.engines.registry import ENGINES, UnknownEngineError
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.preflight import Diagnostic, warnings
from sandbox.measure.seeds import with_seed
from sandbox.measure.tradeoff import Tradeoff, tradeoff
from sandbox.measure.tradeoff import study as module
from sandbox.measure.tradeoff import timing as cost_module
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.metrics import METRICS, EvaluationContext
from sandbox.measure.tradeoff.objective import UnknownMetricError
from sandbox.measure.tradeoff.recommendation import EQUAL_WORK_FACTOR, FRAME_TOLERANCE, WORK_FACTOR, label
from sandbox.measure.tradeoff.result import Recommendation
from sandbox.measure.tradeoff.study import setting_warnings
from sandbox.progress import Progress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from tests.runs_by_hand import DROP, SWING, scene_of

pytestmark = pytest.mark.full  # long runs and sweeps

PROMISED = {"scene", "truth", "metric", "points", "pareto", "within_tolerance", "within_budget"}
OF_A_POINT = {"engine", "settings", "error", "cost_ms_per_second", "status"}
RANDOM = """
[world]
gravity = [0.0, -10.0]
duration = 0.3
seed = 4
[solver]
dt = 0.02
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[grid]]
name = "g"
origin = [0.0, 1.0]
columns = 3
rows = 1
spacing = [3.0, 1.0]
radius = 0.5
velocity_jitter = 1.0
restitution = 0.5
"""
BULLET = """
[world]
duration = 0.2
[solver]
dt = 0.01
[[wall]]
name = "wall"
points = [[1.0, -1.0], [1.0, 1.0]]
thickness = 0.01
[[ball]]
name = "bullet"
position = [0.0, 0.0]
velocity = [20.0, 0.0]
radius = 0.02
restitution = 1.0
"""
"""A ball that the search stops with 5 substeps, and that can pass the wall with fewer than 8 at another phase."""


def weighed(scene: Scene, *engines: str, **more: Any) -> Tradeoff:
    return tradeoff(scene, engines or ("pymunk",), **{"most": 14, "repeats": 1, **more})


def error_of(scene: Scene, point: Evaluation, metric: str = "max_position") -> float:
    """Run a point's settings on their own and return the error."""
    settings = point.asked.model_dump()
    run = sandbox.run(scene, point.engine, **settings)
    judge = EvaluationContext(scene, truth_of(scene, scene.solver, 1e-4), 100.0)
    error = METRICS[metric].measure(run, judge)
    assert error is not None
    return error


def test_pick_keeps_to_the_tolerance_when_run_on_its_own() -> None:
    scene = scene_of(DROP)
    found = weighed(scene, tolerance=4e-3)
    assert found.truth == "closed_form"
    assert found.metric.name == "max_position"
    assert found.within_tolerance is not None
    point = found.within_tolerance.point
    assert point.error is not None
    assert point.error <= 4e-3
    assert error_of(scene, point) == point.error
    able = [p for p in found.points if p.repeats and (p.error or 0.0) <= 4e-3]
    least = min(p.cost or 0.0 for p in able)
    close = [p for p in able if (p.cost or 0.0) <= WORK_FACTOR * least]
    assert (point.counted or 0.0) <= EQUAL_WORK_FACTOR * min(p.counted or 0.0 for p in close)


def test_pick_of_a_random_scene_keeps_to_the_tolerance_on_seeds_that_nobody_used() -> None:
    scene = scene_of(RANDOM)
    found = weighed(scene, tolerance=6e-3, seeds=2)
    assert found.seeds == (4, 5)
    assert found.within_tolerance is not None
    assert found.within_tolerance.fresh_seeds == (6, 7, 8)
    assert found.within_tolerance.fresh_error is not None
    assert found.within_tolerance.fresh_error <= 6e-3
    for seed in (101, 102):
        assert error_of(with_seed(scene, seed), found.within_tolerance.point) <= 6e-3


def test_seeds_go_round_at_their_end() -> None:
    last = scene_of(RANDOM.replace("seed = 4", f"seed = {2**63 - 1}"))
    found = weighed(last, tolerance=1.0, most=1)
    assert found.within_tolerance is not None
    assert found.within_tolerance.fresh_seeds == (0, 1, 2)


def test_scene_without_chances_has_one_seed() -> None:
    found = weighed(scene_of(DROP), seeds=5, most=1)
    assert found.seeds == (0,)
    assert found.within_tolerance is None or found.within_tolerance.fresh_seeds == ()


def test_refused_engine_is_a_point_that_says_why() -> None:
    found = weighed(scene_of(SWING), "pymunk", "exact", most=2)
    (refused,) = [point for point in found.points if point.engine == "exact"]
    assert refused.status == "refused"
    assert "rod" in (refused.reason or "")
    assert (refused.error, refused.cost) == (None, None)


def test_nobody_able_is_an_answer_too() -> None:
    found = weighed(scene_of(SWING), "exact")
    assert [point.status for point in found.points] == ["refused"]
    assert (found.pareto, found.within_tolerance) == ((), None)
    assert "none of the 1" in found.answers()[0]


def test_settings_that_diverge_are_points_with_a_reason() -> None:
    wild = scene_of(
        DROP.replace("gravity = [0.0, -10.0]", "gravity = [1e9, 0.0]").replace("duration = 0.4", "duration = 10.0")
    )
    found = weighed(wild, most=2, dt=0.1, metric="energy")
    bad = [point for point in found.points if point.status == "diverged"]
    assert bad
    assert all(point.reason and point.error is None and not point.is_usable for point in bad)
    assert not set(map(id, bad)) & set(map(id, found.pareto))
    json.dumps(found.document(), allow_nan=False)


def test_words_that_an_engine_lacks_are_left_out_for_it() -> None:
    scene = scene_of(DROP.replace("dt = 0.02", 'dt = 0.02\nintegrator = "rk4"'))
    assert ENGINES["pymunk"].missing(scene, scene.solver)
    found = weighed(scene, most=3)
    assert [point.status for point in found.points] == ["ok"] * 3
    assert found.points[0].changes == {"integrator": None}
    assert "without integrator" in label(found.points[0])


def test_document_has_the_keys_promised_and_no_figure_that_json_lacks() -> None:
    found = weighed(scene_of(DROP), tolerance=4e-3, budget=5.0)
    document = json.loads(json.dumps(found.document("drop.toml"), allow_nan=False))
    assert set(document) >= PROMISED
    assert (document["scene"], document["metric"], document["truth"]) == ("drop.toml", "max_position", "closed_form")
    for row in [*document["points"], *document["pareto"], document["within_tolerance"], document["within_budget"]]:
        assert set(row) >= OF_A_POINT
    errors = [row["error"] for row in document["pareto"]]
    costs = [row["cost_ms_per_second"] for row in document["pareto"]]
    assert errors == sorted(errors, reverse=True)
    assert costs == sorted(costs)
    assert [each.split(" setting")[0] for each in document["answers"]] == ["cheapest", "most accurate"]


def test_work_is_counted_and_the_same_every_time() -> None:
    first, second = (weighed(scene_of(DROP), most=3) for _ in range(2))
    assert [point.work for point in first.points] == [point.work for point in second.points]
    assert all(point.work for point in first.points)


def test_machine_and_load_change_neither_what_is_tried_nor_its_errors_nor_the_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By a slow clock a run takes 1,000 times as long, and one run in three is interrupted by another program."""
    found = []
    for slow in (1.0, 1e3):
        noise = Random(3)

        def timed(scene: Scene, engine: str, settings: Settings, slow: float = slow, noise: Random = noise) -> float:
            return slow * clock(scene, settings) * (1.0 if noise.random() < 0.7 else noise.uniform(1.0, 5.0))

        monkeypatch.setattr(cost_module, "run_seconds", timed)
        monkeypatch.setattr(cost_module, "clock_without_compilation", lambda slow=slow: slow * perf_counter())
        found.append(weighed(scene_of(DROP), "pymunk", "exact", tolerance=4e-3, repeats=5, most=30))
    first, second = found
    assert [(p.engine, p.settings, p.error, p.counted) for p in first.points] == [
        (p.engine, p.settings, p.error, p.counted) for p in second.points
    ]
    assert first.spent == second.spent
    assert first.within_tolerance is not None
    assert second.within_tolerance is not None
    assert first.within_tolerance.point.settings == second.within_tolerance.point.settings
    assert second.within_tolerance.point.cost > 100.0 * first.within_tolerance.point.cost


def clock(scene: Scene, settings: Settings) -> float:
    """Return s that a run takes on a machine where a substep takes 10 µs."""
    return 1e-5 * scene.world.duration / settings.h


def test_scenes_own_setting_is_a_point_of_every_engine_and_marked() -> None:
    found = weighed(scene_of(DROP), "pymunk", "exact", "reference", tolerance=1e-9, effort=1e-9)
    own = [point for point in found.points if point.is_own]
    assert [point.engine for point in own] == ["pymunk", "exact", "reference"]
    assert all(not point.changes and point.repeats for point in own)
    assert [row["scene_setting"] for row in found.document()["points"]] == [point.is_own for point in found.points]


def test_runs_that_are_known_are_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    runs = sandbox.compare(scene, ("pymunk", "exact")).trajectories
    plain = weighed(scene, "pymunk", "exact", most=2)
    monkeypatch.setattr("sandbox.measure.tradeoff.configuration.bounded_run", None)
    again = weighed(scene, "pymunk", "exact", most=2, runs=runs)
    assert [(p.settings, p.error, p.counted) for p in plain.points] == [
        (p.settings, p.error, p.counted) for p in again.points
    ]


def test_nearest_is_given_where_nothing_is_within_the_tolerance_or_the_budget() -> None:
    found = weighed(scene_of(DROP), tolerance=1e-12, budget=1e-9)
    assert (found.within_tolerance, found.within_budget) == (None, None)
    assert found.nearest_to_tolerance is not None
    assert found.nearest_to_budget is not None
    assert found.nearest_to_tolerance.point.error == min(p.error for p in found.points if p.is_usable)
    assert all("the nearest is pymunk" in line for line in found.answers())
    document = found.document()
    assert document["nearest_to_tolerance"]["sentence"] in document["answers"][0]


def test_metric_and_its_reason_are_stated() -> None:
    found = weighed(scene_of(DROP), most=1)
    assert (found.metric.name, found.metric_reason) == (
        "max_position",
        "the truth (closed form) is trusted to the end, 0.4 s",
    )
    assert found.document()["metric_reason"] == found.metric_reason
    assert weighed(scene_of(DROP), most=1, metric="energy").metric_reason == "it was requested"


def test_where_two_methods_contradict_each_other_an_invariant_is_the_metric_and_the_reason_is_stated() -> None:
    why = "reference, dt halved 8 times; pymunk contradicts it from 0 s on"
    found = weighed(scene_of(DROP), most=2, truth=why)
    assert (found.best, found.truth, found.metric.name) == (None, None, "penetration")
    assert found.metric_reason == f"no truth is known ({why}), and bodies can collide"
    assert found.document()["truth_about"] == why
    assert f"because no truth is known ({why})" in found.error_about


def test_metric_in_pixels_scales_with_the_zoom() -> None:
    scene = scene_of(DROP)
    small, large = (weighed(scene, metric="pixels", zoom=zoom, most=1).points[0].error for zoom in (10.0, 1000.0))
    assert small is not None
    assert large == pytest.approx(100.0 * small, rel=1e-12)


@pytest.mark.parametrize(
    "wrong",
    [
        {"tolerance": 0.0},
        {"tolerance": math.nan},
        {"tolerance": math.inf},
        {"tolerance": -1.0, "metric": "missed_contacts"},
        {"budget": 0.0},
        {"budget": math.inf},
        {"fps": math.nan},
        {"seeds": 0},
        {"zoom": -1.0},
        {"effort": 0.0},
        {"effort": math.inf},
        {"time_limit": 0.0},
        {"repeats": 0},
        {"most": 0},
    ],
)
def test_senseless_figure_is_refused_before_anything_is_run(
    wrong: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "find_truth", None)
    with pytest.raises(ValueError, match=r"at least|positive"):
        tradeoff(scene_of(DROP), **wrong)


def test_unknown_names_are_refused_before_anything_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_truth", None)
    with pytest.raises(UnknownMetricError, match="metrics: max_position"):
        tradeoff(scene_of(DROP), metric="beauty")
    with pytest.raises(UnknownEngineError, match="engines: pymunk"):
        tradeoff(scene_of(DROP), ["unity"])


def test_nothing_missed_is_a_tolerance_of_nothing() -> None:
    found = weighed(scene_of(DROP), metric="missed_contacts", most=3)
    assert found.tolerance == 0.0
    assert found.within_tolerance is not None
    assert found.within_tolerance.point.error == 0.0


def test_nothing_that_moves_is_no_trap() -> None:
    still = scene_of(DROP.replace("radius = 0.5", "radius = 0.5\nfixed = true"))
    found = weighed(still, most=3)
    json.dumps(found.document(), allow_nan=False)
    assert all(point.status == "ok" for point in found.points)
    assert found.metric.name == "energy"
    assert found.within_tolerance is not None


def test_metric_that_says_nothing_is_told() -> None:
    found = weighed(scene_of(DROP), metric="joint_error", most=3)
    assert found.within_tolerance is None
    assert found.answers() == ["joint_error cannot be measured in this scene; choose another --metric"]


def test_who_watches_is_told_what_is_being_done() -> None:
    told: list[Progress] = []
    weighed(scene_of(DROP), most=2, on_progress=told.append)
    assert told[0].message == "the truth"
    assert "1 tried: pymunk, dt, 1 × 10" in [each.message for each in told]
    assert Progress("timing") in told


def tunnelling(pick: Recommendation) -> list[Diagnostic]:
    return [each for each in pick.warnings if each.kind == "tunnelling"]


def test_recommended_setting_that_can_tunnel_says_so_and_how_many_substeps_prevent_it() -> None:
    scene = scene_of(BULLET)
    found = weighed(scene, metric="missed_contacts", budget=100.0, most=30)
    pick = found.within_tolerance
    assert pick is not None
    assert pick.point.error == 0.0
    (warning,) = tunnelling(pick)
    safe = warning.details["safe_substeps"]
    assert isinstance(safe, int)
    dt, reach, speed = pick.point.settings.dt, 0.02 + 0.01 / 2, 20.0
    assert safe == math.ceil(dt * speed / reach * (1.0 - 1e-9))  # rounding: 8 is 8.000000000000002
    assert pick.point.settings.substeps < safe
    assert f"substeps >= {safe}" in warning.message
    document = json.loads(json.dumps(found.document(), allow_nan=False))
    assert document["within_tolerance"]["warnings"][0]["safe_substeps"] == safe
    assert tunnelling(found.cheapest_by_engine["pymunk"] or pick) == [warning]
    assert not any(each.kind == "tunnelling" for each in setting_warnings(scene, "pymunk", with_substeps(pick, safe)))
    assert any(each.kind == "tunnelling" for each in setting_warnings(scene, "pymunk", with_substeps(pick, safe - 1)))


def with_substeps(pick: Recommendation, substeps: int) -> Settings:
    return pick.point.asked.replace(substeps=substeps)


def test_warnings_are_those_of_check_for_the_same_settings() -> None:
    scene = scene_of(BULLET)
    settings = scene.solver.replace(substeps=5, iterations=1)
    known = warnings(scene, settings, "pymunk")
    found = setting_warnings(scene, "pymunk", settings)
    assert [each.kind for each in found] == [each.kind for each in known]
    assert all(mine.message.startswith(its.message) for mine, its in zip(found, known, strict=True))
    assert setting_warnings(scene, "reference", settings.replace(detection="swept")) == []


def test_more_substeps_than_allowed_are_not_advised() -> None:
    scene = scene_of(BULLET.replace("[20.0, 0.0]", "[20000.0, 0.0]"))
    (warning,) = [each for each in setting_warnings(scene, "pymunk", scene.solver) if each.kind == "tunnelling"]
    assert "safe_substeps" not in warning.details


def test_longest_step_of_a_recommendation_is_a_frame_or_the_step_of_the_scene() -> None:
    scene = scene_of(BULLET)
    found = weighed(scene, most=12)
    assert found.max_dt == FRAME_TOLERANCE / 60.0
    assert found.document()["max_dt"] == found.max_dt
    assert any(point.settings.dt > found.max_dt for point in found.points)
    picks = [found.within_tolerance, found.nearest_to_tolerance, *found.cheapest_by_engine.values()]
    assert all(pick.point.settings.dt <= found.max_dt for pick in picks if pick is not None)
    assert weighed(scene, most=1, dt=0.1).max_dt == 0.1
