"""Objections: a setting that its own run or the forecast calls broken is not recommended, however small its error."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.compare.metrics import METRICS, times_of_leaving, worst_error
from sandbox.measure.preflight import warnings
from sandbox.measure.run.runner import run
from sandbox.measure.tradeoff.objections import MAX_ODDS, SPEED_MARGIN, ErrorLimits, find_objections
from sandbox.measure.tradeoff.study import tradeoff
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.measure.tradeoff.evaluations_by_hand import context_of, shifted

DT = 1.0 / 60.0
LIMITS = ErrorLimits(METRICS["max_position"], 0.02, 50.0)


def document(**tables: Any) -> Scene:
    tables.setdefault("solver", {"dt": DT})
    return from_document(tables)


def bullet(speed: float) -> Scene:
    return document(
        world={"duration": 0.3},
        wall=[{"name": "pane", "points": [[1.0, -1.0], [1.0, 1.0]], "thickness": 0.01}],
        ball=[{"name": "bullet", "position": [0.0, 0.0], "velocity": [speed, 0.0], "radius": 0.05}],
    )


def crates(count: int) -> Scene:
    stack = {"name": "crate", "base": [0.0, 0.0], "size": [0.2, 0.2], "columns": 1, "rows": count}
    ground = {"name": "ground", "point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 0.8}
    world = {"gravity": [0.0, -9.81], "duration": 2.0}
    return document(world=world, plane=[ground], stack=[{**stack, "friction": 0.8}])


def rope(links: int) -> Scene:
    """Return a rope of rods that falls from the horizontal."""
    balls = [{"name": f"b{k}", "position": [0.2 * k, 0.0], "radius": 0.05} for k in range(1, links + 1)]
    joints = [
        {"name": f"j{k}", "kind": "rod", "between": [f"b{k - 1}", f"b{k}"] if k > 1 else ["b1"]}
        for k in range(1, links + 1)
    ]
    joints[0]["anchors"] = [[0.0, 0.0], [0.0, 0.0]]
    return document(world={"gravity": [0.0, -9.81], "duration": 1.5}, ball=balls, joint=joints)


def bouncing() -> Scene:
    walls = [{"points": [[0, 0], [2, 0], [2, 2], [0, 2]], "closed": True, "restitution": 1.0}]
    places = [(0.5, 0.5), (1.0, 0.52), (1.5, 0.5), (1.0, 1.5)]
    balls = [
        {"position": [x, y], "velocity": [1.0 - x, 0.3], "radius": 0.1, "restitution": 1.0, "mass": 1.0 + x}
        for x, y in places
    ]
    return document(world={"duration": 2.0}, wall=walls, ball=balls)


@pytest.mark.fail_slow(60)  # searches
@pytest.mark.parametrize(
    ("scene", "metric", "tolerance"),
    [
        (bullet(8.0), "max_position", 10.0),
        (bullet(20.0), "missed_contacts", None),
        (crates(6), "penetration", 10.0),
        (rope(5), "max_position", 0.05),
        (bouncing(), "penetration", 10.0),
    ],
    ids=["wide tolerance", "lucky phase", "tower", "rope", "bouncing"],
)
def test_no_recommended_setting_has_an_objection(scene: Scene, metric: str, tolerance: float | None) -> None:
    """The tolerances are so wide that the cheapest settings would be within them."""
    found = tradeoff(scene, ["pymunk"], metric=metric, tolerance=tolerance, budget=1000.0, effort=0.3, repeats=1)
    assert found.within_tolerance is not None
    for chosen in (found.within_tolerance, found.within_budget):
        assert chosen.point.objections == ()
        assert chosen.point.metrics["missed_contacts"] == 0.0
        odds = [each.details.get("odds", 1.0) for each in warnings(scene, chosen.point.asked, "pymunk")]
        assert all(float(each) <= MAX_ODDS for each in odds)  # no body of these scenes is faster than at the start
        if metric == "max_position" and len(scene.joint_arrays):
            assert chosen.point.metrics["joint_distance"] <= tolerance
    assert any(point.objections for point in found.points)
    if found.rejected is not None:  # where it is the cheapest, which its time decides
        assert found.rejected.point.objections[0] in found.sentences[-1]


@given(st.floats(0.1, 100.0))
def test_odds_are_those_at_the_speed_of_the_run(speed: float) -> None:
    """The scene may let the bullet be faster; what counts is the run, with a margin."""
    reach = 0.05 + 0.005
    metrics = dict.fromkeys(METRICS)
    found = find_objections(bullet(100.0), "pymunk", bullet(1.0).solver, metrics, np.asarray([speed]), LIMITS)
    odds = 1.0 - reach / (min(SPEED_MARGIN * speed, 100.0) * DT)
    assert bool(found) == (odds > MAX_ODDS)


@pytest.mark.parametrize(
    ("metric", "observed", "is_objection"),
    [
        ("max_position", {"missed_contacts": 1.0}, True),
        ("max_position", {"missed_contacts": 0.0}, False),
        ("max_position", {"joint_distance": 0.021}, True),
        ("max_position", {"joint_distance": 0.019}, False),
        ("pixels", {"joint_distance": 0.019}, True),  # 0.95 px
        ("max_position", {"joint_error": 0.5}, False),  # of a length of which it is less than the tolerance
        ("energy", {"joint_error": 0.021}, True),
        ("energy", {"joint_distance": 5.0}, False),
        ("missed_contacts", {"joint_error": 0.02}, True),
    ],
)
def test_what_a_run_shows_is_an_objection_beyond_the_tolerance(
    metric: str, observed: dict[str, float], is_objection: bool
) -> None:
    limits = ErrorLimits(METRICS[metric], 0.0 if metric == "missed_contacts" else 0.02, 50.0)
    metrics = {**dict.fromkeys(METRICS), **observed}
    still = bullet(0.0)
    assert bool(find_objections(still, "pymunk", still.solver, metrics, np.zeros(1), limits)) == is_objection


def platform(duration: float = 3.0, **more: Any) -> Scene:
    """Return a ball that rolls off a platform, and one that stays on it."""
    return document(
        world={"gravity": [0.0, -9.81], "duration": duration},
        wall=[{"points": [[0.0, 0.0], [2.0, 0.0]]}],
        ball=[
            {"name": "player", "position": [1.0, 0.1], "velocity": [2.0, 0.0], "radius": 0.1},
            {"name": "crate", "position": [0.5, 0.1], "radius": 0.1},
        ],
        **more,
    )


def test_body_that_has_left_the_level_is_not_the_measure() -> None:
    """Its last frame that counts is the one before its upper end is below the platform."""
    scene = platform()
    truth = run(scene, "reference")
    context = context_of(scene, truth)
    y = truth.position[:, 0, 1] + 0.1
    assert context.left_at[0] == truth.time[int((y < 0.0).argmax())]
    assert math.isinf(context.left_at[1])
    for frames, error in ((slice(-1, None), 0.0), (slice(0, 1), 5.0)):
        displaced = replace(truth, position=shifted(truth, frames, 0, (5.0, 0.0)))
        assert METRICS["max_position"].measure(displaced, context) == pytest.approx(error)


def test_static_level_of_one_body_stops_what_is_above_it_only() -> None:
    """The disc about two far parts of a body reaches deep below both."""
    parts = {"box": [{"size": [2.0, 0.1], "position": [x, 0.0]} for x in (-50.0, 50.0)]}
    scene = platform(body=[{"name": "level", "position": [0.0, 0.0], "fixed": True, **parts}])
    truth = run(scene, "reference")
    left = times_of_leaving(scene, truth, np.asarray([0.0, -1.0]))
    assert left[truth.names.tolist().index("player")] < 1.6  # it falls by 1 m within a second after the edge


@pytest.mark.parametrize(
    "more",
    [
        {"plane": [{"point": [0.0, -50.0], "normal": [0.0, 1.0]}]},
        {"joint": [{"kind": "rod", "between": ["player", "crate"]}]},
        {"attraction": [{"toward": [0.0, 0.0], "strength": 1.0, "softening": 1.0}]},
        {"post": [{"position": [20.0, -100.0], "radius": 1.0}]},
    ],
    ids=["plane", "joint", "attraction", "post below"],
)
def test_body_that_something_can_stop_has_not_left_the_level(more: dict[str, Any]) -> None:
    scene = platform(**more)
    assert np.isinf(times_of_leaving(scene, run(scene, "reference"), np.asarray([0.0, -1.0]))).all()


@pytest.mark.fail_slow(60)  # a run each
@given(st.integers(0, 1), st.integers(1, 20), st.floats(0.01, 3.0))
def test_worst_error_names_body_time_and_place(body: int, frame: int, size: float) -> None:
    scene = platform(duration=0.5)
    truth = run(scene, "reference")
    found = worst_error(replace(truth, position=shifted(truth, frame, body, (0.0, size))), context_of(scene, truth))
    assert found is not None
    assert (found.body, found.time) == (scene.bodies.names[body], truth.time[frame])
    assert found.error == pytest.approx(size, rel=1e-9)
    assert found.position == pytest.approx(truth.position[frame, body] + [0.0, size])
