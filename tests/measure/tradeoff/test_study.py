"""Trade-off studies of small scenes from end to end, with independent runs of the recommendations."""

import json
import math
import re
from random import Random
from time import perf_counter
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.engines.registry import UnknownEngineError
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.preflight import warnings
from sandbox.measure.seeds import with_seed
from sandbox.measure.starts import Starts
from sandbox.measure.tradeoff import Tradeoff, tradeoff
from sandbox.measure.tradeoff import start_trials as trials
from sandbox.measure.tradeoff import timing as cost_module
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.objective import UnknownMetricError
from sandbox.measure.tradeoff.recommendation import EQUAL_WORK_FACTOR, FRAME_TOLERANCE, NOISE_FACTOR, label
from sandbox.measure.tradeoff.result import shown_of
from sandbox.measure.tradeoff.study import setting_warnings
from sandbox.progress import Progress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from tests.runs_by_hand import DROP, SWING, scene_of
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

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
"""A ball that the wall stops with 5 substeps, but that can pass it with fewer than 8 at a different phase."""


def study(scene: Scene, *engines: str, **more: Any) -> Tradeoff:
    return tradeoff(scene, engines or ("pymunk",), **{"most": 14, "repeats": 1, "starts": 1, **more})


def error_of(scene: Scene, point: Evaluation, metric: str = "max_position") -> float:
    """Run the settings of a point independently and return the error."""
    settings = point.asked.model_dump()
    run = sandbox.run(scene, point.engine, **settings)
    context = EvaluationContext(scene, truth_of(scene, scene.solver, 1e-4), 100.0)
    error = METRICS[metric].measure(run, context)
    assert error is not None
    return error


def test_recommendation_is_within_the_tolerance_in_an_independent_run() -> None:
    scene = scene_of(DROP)
    found = study(scene, tolerance=4e-3)
    assert found.truth == "closed_form"
    assert found.metric.name == "max_position"
    point = found.within_tolerance.point
    assert point.error <= 4e-3
    assert error_of(scene, point) == point.error
    accurate = [p for p in found.points if p.repeats and (p.error or 0.0) <= 4e-3]
    least = min(p.cost or 0.0 for p in accurate)
    close = [p for p in accurate if (p.cost or 0.0) <= NOISE_FACTOR * least]
    assert (point.counted or 0.0) <= EQUAL_WORK_FACTOR * min(p.counted or 0.0 for p in close)


def test_recommendation_leaves_the_margin_unused() -> None:
    scene = scene_of(DROP)
    found = study(scene, tolerance=4e-3, margin=0.75)
    pick = found.within_tolerance.point
    assert pick.error <= 1e-3
    between = [point for point in found.points if point.error is not None and 1e-3 < point.error <= 4e-3]
    assert any(point.counted < pick.counted for point in between), "otherwise the margin changes nothing"
    assert error_of(scene, found.within_tolerance.point) == found.within_tolerance.point.error
    assert (found.tolerance, found.margin, found.max_error) == (4e-3, 0.75, 1e-3)
    assert "within 1 mm (4 mm less a margin of 75 %): " in found.sentences[0]


LUCKY = (
    toml("world", gravity=[0.0, 0.0], duration=2.0)
    + toml("solver", dt=0.125)
    + toml("wall", points=[[2.0, -1.0], [2.0, 1.0]], thickness=0.5)
    + toml("ball", name="ball", position=[0.250001, 0.0], velocity=[1.0, 0.0], radius=0.5, restitution=1.0)
)
"""A ball that is 1 µm in the wall at the end of a step, 1 s; from other starts, it enters the wall by up to 0.125 m."""


@pytest.mark.fail_slow(60)  # hundreds of runs
def test_setting_that_is_lucky_with_the_start_of_the_file_is_not_recommended() -> None:
    scene = scene_of(LUCKY)
    lucky = study(scene, tolerance=0.02, starts=1).within_tolerance
    assert (lucky.confirmation, lucky.point.settings.substeps) == (None, 1)
    found = study(scene, tolerance=0.02, starts=30).within_tolerance
    assert found.confirmation.held.trials == 30
    assert found.confirmation.held.hits >= 28
    # independent runs from starts that the study did not use
    starts = Starts(scene)

    def held_fraction(point: Evaluation) -> float:
        return float(np.mean([error_of(starts.start(1000 + k), point) <= 0.02 for k in range(60)]))

    assert held_fraction(lucky.point) < 0.5
    assert held_fraction(found.point) > 0.85  # 0.95 or more; of 60 starts, 51 or fewer hold in 1 of 1,000 cases


def test_recommendation_for_a_random_scene_is_within_the_tolerance_on_new_seeds() -> None:
    scene = scene_of(RANDOM)
    found = study(scene, tolerance=6e-3, starts=5, spread=0.0)
    assert (found.starts, found.spread) == (5, 0.0)
    assert found.within_tolerance.confirmation.held.hits == 5
    assert found.within_tolerance.confirmation.error_95 <= 6e-3
    for seed in (101, 102):
        assert error_of(with_seed(scene, seed), found.within_tolerance.point) <= 6e-3


def test_scene_that_cannot_vary_has_one_start() -> None:
    found = study(scene_of(DROP), starts=5, spread=0.0, most=1)
    assert found.starts == 1
    assert found.within_tolerance is None or found.within_tolerance.confirmation is None


@pytest.mark.fail_slow(60)  # hundreds of runs
def test_settings_of_the_table_have_the_errors_of_the_same_fresh_starts() -> None:
    scene = scene_of(LUCKY)
    found = study(scene, tolerance=0.02, starts=8, effort=20.0, most=8)
    shown = [point for front in found.fronts().values() for point in shown_of(front)]
    assert len(shown) > 2
    starts = Starts(scene)
    for point in shown:
        errors = sorted(error_of(starts.start(number), point) for number in range(9, 17))  # after those that decide
        assert point.fresh_starts.held.trials == 8
        assert point.fresh_starts.median_error == errors[4]
        assert (point.fresh_starts.error_5, point.fresh_starts.error_95) == (errors[0], errors[-1])
    pick = found.within_tolerance
    assert pick.point.fresh_starts == pick.confirmation
    assert any(pick.point is each for each in found.points)


def test_costs_are_stated_relative_to_the_cheapest_setting() -> None:
    found = study(scene_of(DROP), "pymunk", "exact", tolerance=4e-3, repeats=5, effort=1.0)
    cheapest = found.within_tolerance
    assert cheapest.cost_ratio is None
    (other,) = [each for each in found.cheapest_by_engine.values() if each.point is not cheapest.point]
    ratio = other.cost_ratio
    turns = np.array(other.point.turns) / np.array(cheapest.point.turns)
    assert len(turns) == 5
    assert ratio.ratio == pytest.approx(np.median(turns), rel=1e-12)  # rounding
    low, high = ratio.interval
    assert turns.min() <= low <= ratio.ratio <= high <= turns.max()
    assert other.sentence.endswith(f"; {ratio} times the cost of {label(cheapest.point)}")
    stored = found.document()["cheapest_by_engine"][other.point.engine]["cost_ratio"]
    assert stored == {"ratio": ratio.ratio, "interval": [low, high]}


def test_settings_whose_starts_take_too_much_have_none() -> None:
    found = study(scene_of(DROP), effort=1e-4, starts=30, most=3)
    assert all(point.fresh_starts is None for point in found.points)


def test_effort_bounds_the_starts() -> None:
    found = study(scene_of(DROP), tolerance=1.0, starts=30, effort=1e-4, most=1).within_tolerance
    assert found.confirmation.held.trials == 0
    assert "not tried from other starts" in found.sentence


def test_refused_engine_is_a_point_with_its_reason() -> None:
    found = study(scene_of(SWING), "exact")
    (refused,) = found.points
    assert (refused.status, refused.error, refused.cost) == ("refused", None, None)
    assert "rod" in (refused.reason or "")
    assert (found.pareto, found.within_tolerance) == ((), None)
    assert "none of the 1" in found.sentences[0]


def test_settings_that_diverge_are_points_with_a_reason() -> None:
    diverging = scene_of(
        DROP.replace("gravity = [0.0, -10.0]", "gravity = [1e9, 0.0]").replace("duration = 0.4", "duration = 10.0")
    )
    found = study(diverging, most=2, dt=0.1, metric="energy")
    failed = [point for point in found.points if point.status == "diverged"]
    assert failed
    assert all(point.reason and point.error is None and not point.is_usable for point in failed)
    assert not set(map(id, failed)) & set(map(id, found.pareto))
    json.dumps(found.document(), allow_nan=False)


def test_machine_speed_and_load_do_not_change_the_result(monkeypatch):
    """A slow clock makes runs take 1,000 times as long, and a third of all runs is delayed by other programs."""
    found = []
    for slow in (1.0, 1e3):
        noise = Random(3)

        def timed(scene: Scene, engine: str, settings: Settings, slow: float = slow, noise: Random = noise) -> float:
            return slow * clock(scene, settings) * (1.0 if noise.random() < 0.7 else noise.uniform(1.0, 5.0))

        monkeypatch.setattr(cost_module, "run_seconds", timed)
        monkeypatch.setattr(cost_module, "clock_without_compilation", lambda slow=slow: slow * perf_counter())
        found.append(study(scene_of(DROP), "pymunk", "exact", tolerance=4e-3, repeats=5, most=30))
    first, second = found
    assert [(p.engine, p.settings, p.error, p.counted) for p in first.points] == [
        (p.engine, p.settings, p.error, p.counted) for p in second.points
    ]
    assert first.spent == second.spent
    assert first.within_tolerance.point.settings == second.within_tolerance.point.settings
    assert second.within_tolerance.point.cost > 100.0 * first.within_tolerance.point.cost


def clock(scene: Scene, settings: Settings) -> float:
    """Return the duration of a run in s on a machine where a substep takes 10 µs."""
    return 1e-5 * scene.world.duration / settings.h


def test_settings_of_the_scene_are_a_marked_point_of_every_engine() -> None:
    found = study(scene_of(DROP), "pymunk", "exact", "reference", tolerance=1e-9, effort=1e-9)
    own = [point for point in found.points if point.is_own]
    assert [point.engine for point in own] == ["pymunk", "exact", "reference"]
    assert all(not point.changes and point.repeats for point in own)
    assert [row["scene_setting"] for row in found.document()["points"]] == [point.is_own for point in found.points]


def test_given_runs_are_not_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(DROP)
    runs = sandbox.compare(scene, ("pymunk", "exact")).trajectories
    plain = study(scene, "pymunk", "exact", most=2)
    monkeypatch.setattr("sandbox.measure.tradeoff.configuration.bounded_run", None)
    again = study(scene, "pymunk", "exact", most=2, runs=runs)
    assert [(p.settings, p.error, p.counted) for p in plain.points] == [
        (p.settings, p.error, p.counted) for p in again.points
    ]


def test_nearest_is_given_if_nothing_meets_the_tolerance_or_budget() -> None:
    found = study(scene_of(DROP), tolerance=1e-12, budget=1e-9)
    assert (found.within_tolerance, found.within_budget) == (None, None)
    assert found.nearest_to_budget is not None
    assert found.nearest_to_tolerance.point.error == min(p.error for p in found.points if p.is_usable)
    assert all("the nearest is pymunk" in line for line in found.sentences)
    document = found.document()
    assert document["nearest_to_tolerance"]["sentence"] in document["answers"][0]


def test_metric_is_an_invariant_with_a_reason_if_two_methods_contradict() -> None:
    why = "reference, dt halved 8 times; pymunk contradicts it from 0 s on"
    found = study(scene_of(DROP), most=2, truth=why)
    assert (found.best, found.truth, found.metric.name) == (None, None, "penetration")
    assert found.metric_reason == f"no truth is known ({why}), and bodies can collide"
    assert found.document()["truth_about"] == why
    assert f"because no truth is known ({why})" in found.error_about


@pytest.mark.parametrize(
    "wrong",
    [
        {"tolerance": 0.0}, {"tolerance": math.nan}, {"tolerance": math.inf}, {"budget": 0.0}, {"budget": math.inf},
        {"tolerance": -1.0, "metric": "missed_contacts"}, {"fps": math.nan}, {"starts": 0}, {"zoom": -1.0},
        {"effort": 0.0}, {"effort": math.inf}, {"time_limit": 0.0}, {"repeats": 0}, {"most": 0},
        {"margin": -0.1}, {"margin": 1.0}, {"margin": math.nan},
    ],
)  # fmt: skip
def test_invalid_argument_is_rejected_before_any_run(wrong: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "find_truth", None)
    with pytest.raises(ValueError, match=r"at least|positive"):
        tradeoff(scene_of(DROP), **wrong)


def test_unknown_names_are_rejected_before_any_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trials, "find_truth", None)
    with pytest.raises(UnknownMetricError, match="metrics: max_position"):
        tradeoff(scene_of(DROP), metric="beauty")
    with pytest.raises(UnknownEngineError, match="engines: pymunk"):
        tradeoff(scene_of(DROP), ["unity"])


def test_scene_without_moving_bodies_can_be_studied() -> None:
    fixed = scene_of(DROP.replace("radius = 0.5", "radius = 0.5\nfixed = true"))
    found = study(fixed, most=3)
    json.dumps(found.document(), allow_nan=False)
    assert all(point.status == "ok" for point in found.points)
    assert found.metric.name == "energy"
    assert found.within_tolerance is not None


def test_undefined_metric_is_reported() -> None:
    found = study(scene_of(DROP), metric="joint_error", most=3)
    assert found.within_tolerance is None
    assert found.sentences == ["joint_error cannot be measured in this scene; choose another --metric"]


def test_progress_names_each_stage_of_a_study() -> None:
    states: list[Progress] = []
    study(scene_of(DROP), most=2, on_progress=states.append)
    assert states[0].message == "the truth"
    assert "1 tried: pymunk, dt, 1 × 10" in [each.message for each in states]
    assert Progress("timing") in states


def test_substeps_that_prevent_tunnelling_are_stated_and_do_so() -> None:
    scene = scene_of(BULLET)
    (warning,) = [each for each in setting_warnings(scene, "pymunk", scene.solver) if each.kind == "tunnelling"]
    safe = warning.details["safe_substeps"]
    assert isinstance(safe, int)
    dt, reach, speed = scene.solver.dt, 0.02 + 0.01 / 2, 20.0
    assert safe == math.ceil(dt * speed / reach * (1.0 - 1e-9))  # rounding: 8 is 8.000000000000002
    assert f"substeps >= {safe}" in warning.message
    for substeps, is_warned in ((safe, False), (safe - 1, True)):
        kinds = {each.kind for each in setting_warnings(scene, "pymunk", scene.solver.replace(substeps=substeps))}
        assert ("tunnelling" in kinds) == is_warned


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


def test_max_dt_is_a_frame_or_the_step_of_the_scene() -> None:
    scene = scene_of(BULLET)
    found = study(scene, most=12)
    assert found.max_dt == FRAME_TOLERANCE / 60.0
    assert any(point.settings.dt > found.max_dt for point in found.points)
    for each in (found.within_tolerance, found.nearest_to_tolerance, *found.cheapest_by_engine.values()):
        assert each is None or each.point.settings.dt <= found.max_dt
    assert study(scene, most=1, dt=0.1).max_dt == 0.1


POSTS = """
world = { gravity = [0.0, -9.81], duration = 1.0 }
solver = { dt = 0.02 }
post = [{ position = [0.0, 1.0], radius = 0.3, restitution = 0.9 }, { position = [1.2, 0.8], radius = 0.3 }]
ball = [{ position = [0.13, 2.0], radius = 0.1, restitution = 0.9 }]
"""
"""A ball that a post deflects: errors of the impact's time become errors of the direction."""


def test_answer_says_that_errors_do_not_fall_steadily_and_what_ended_the_search() -> None:
    found = tradeoff(scene_of(POSTS), ("pymunk",), tolerance=1e-9, most=12, repeats=1)
    (answer, *_) = found.sentences
    assert re.match(
        "cheapest setting with max_position within 1 nm: none of the [0-9]+ settings tried; the near", answer
    )
    assert ". The largest number of settings (--points) ended the search, after " in answer
    assert found.nearest_to_tolerance is not None
    options = found.nearest_to_tolerance.point.configuration.options
    errors = {p.settings.substeps: p.error for p in found.points if p.configuration.options == options}
    assert any(errors[n] < errors[2 * n] for n in errors if 2 * n in errors)
    assert ". Its errors do not fall steadily with the step: " in answer
