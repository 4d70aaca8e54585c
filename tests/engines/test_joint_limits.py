"""Joints with a largest force, a largest speed of correction or their own bias, and ratchets."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import start
from sandbox.measure.analytic.solve import solution
from sandbox.measure.preflight import warnings
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

H, STEPS = 0.01, 100
"""s, and number of steps of a run"""
G = 10.0
GROUND: dict[str, Any] = {"kind": "pivot", "anchors": [[0.0, 0.0], [0.0, 0.0]], "max_bias": 0.0}
"""Friction of the ground, seen from above"""


def scene_of(joint: dict[str, Any], gravity: float = 0.0, **body: Any) -> Scene:
    """Return a ball of 2 kg, 1 m from the world's origin, with one joint to the world."""
    ball = {"name": "a", "position": [1.0, 0.0], "radius": 0.5, "mass": 2.0, **body}
    return make_scene(
        world={"gravity": [0.0, -gravity], "duration": H * STEPS},
        solver={"dt": H},
        ball=[ball],
        joint=[{"between": ["a"], **joint}],
    )


def run_of(scene: Scene, engine: str = "pymunk") -> Trajectory:
    run = sandbox.run(scene, engine, audit=False)
    assert run.status == "ok", run.reason
    return run


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize(("max_force", "acceleration"), [(0.0, G), (5.0, G - 2.5), (19.0, G - 9.5)])
def test_rod_with_a_small_largest_force_lets_a_weight_fall(engine: str, max_force: float, acceleration: float) -> None:
    rod = {"kind": "rod", "anchors": [[0.0, 0.0], [1.0, 1.0]], "max_force": max_force}
    run = run_of(scene_of(rod, gravity=G), engine)
    assert run.velocity[-1, 0].tolist() == pytest.approx([0.0, -acceleration], rel=1e-12)  # rounding of 100 steps


def test_joint_without_its_own_bias_has_that_of_the_solver() -> None:
    pivot = {"kind": "pivot", "anchors": [[0.0, 0.0], [0.0, 0.0]]}
    own, solver = (
        sandbox.run(scene, "pymunk", audit=False, **settings).position
        for scene, settings in ((scene_of({**pivot, "bias": 0.3}), {}), (scene_of(pivot), {"bias": 0.3}))
    )
    assert own.tobytes() == solver.tobytes()


@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_joint_does_not_break_under_less_than_its_strength(kind: str) -> None:
    more = {"spring": {"stiffness": 1e4, "rest_length": 0.0}, "rod": {}}[kind]
    joint = {"kind": kind, "anchors": [[0.0, 0.0], [1.0, 1.0]], "max_force": 5.0, **more}
    assert run_of(scene_of({**joint, "strength": 5.1}, gravity=G)).breaks(1).tolist() == [math.inf]
    assert np.isfinite(run_of(scene_of({**joint, "strength": 4.9}, gravity=G)).breaks(1)).all()


def ratchet(ratchet: float = 0.3, phase: float = 0.1, **more: Any) -> dict[str, Any]:
    return {"kind": "ratchet", "ratchet": ratchet, "phase": phase, **more}


def test_ratchet_keeps_its_click_when_the_engine_is_started_again() -> None:
    scene = scene_of(ratchet(0.3, 0.0), angle=0.05, angular_velocity=4.0)
    simulation = start(scene, "pymunk")
    advance(simulation, 50)
    assert simulation.frame().angle[0] == pytest.approx(2.05)  # clicks at 1.8 and 2.1
    simulation.apply(Switch(time=0.0, engine="pymunk", settings={"dt": 0.005}))
    simulation.apply(sandbox.action.Move(time=0.0, body="a", position=(1.0, 0.0), angular_velocity=-4.0))
    advance(simulation, 100)
    assert 1.8 - 4.0 * 0.005 <= simulation.frame().angle[0] < 2.1


@pytest.mark.parametrize(
    "joint",
    [
        {"kind": "spring", "stiffness": 5.0, "max_force": 1.0},
        {"kind": "rotary_spring", "stiffness": 5.0, "max_force": 1.0},
        {"kind": "groove", "groove": [[0.0, 0.0], [2.0, 0.0]], "max_force": 1.0},
    ],
    ids=lambda joint: str(joint["kind"]),
)
def test_reference_refuses_the_largest_force_of_springs_and_grooves(joint: dict[str, Any]) -> None:
    with pytest.raises(Refusal, match="max_force of a "):
        start(scene_of(joint), "reference")


@pytest.mark.parametrize("method", ["relaxation", "xpbd", "rattle"])
def test_other_methods_than_impulses_refuse_a_largest_speed_of_correction(method: str) -> None:
    with pytest.raises(Refusal, match=r"max_bias of .* needs joints = 'impulses'"):
        start(scene_of(GROUND), "reference", joints=method)


ERRORS: list[dict[str, Any]] = [
    {"kind": "pivot", "anchors": [[0.0, 0.3], [0.0, 0.4]]},
    {"kind": "rod", "anchors": [[0.0, 0.5], [0.0, 0.0]], "length": 3.0},
    {"kind": "slide", "anchors": [[0.0, 0.0], [0.0, 0.0]], "least": 0.0, "most": 0.2},
    {"kind": "rotary_limit", "least": 0.5, "most": 1.0},
    {"kind": "gear", "ratio": 1.0, "phase": 2.0},
]
"""Joints that are not fulfilled at the start, by more than 0.05 m/s or rad/s corrects in the run"""


@pytest.mark.parametrize("joint", ERRORS, ids=lambda joint: str(joint["kind"]))
@pytest.mark.parametrize("max_bias", [0.0, 0.05])
def test_reference_corrects_errors_at_the_bounded_speed_as_pymunk_does(joint: dict[str, Any], max_bias: float) -> None:
    scene = scene_of({**joint, "max_bias": max_bias}, velocity=[0.2, -0.1])
    one, other = (run_of(scene, engine) for engine in ("pymunk", "reference"))
    assert other.position == pytest.approx(one.position, abs=1e-9)  # the same scheme; rounding of 100 steps
    assert other.angle == pytest.approx(one.angle, abs=1e-9)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_friction_of_the_ground_stops_a_body_after_its_stopping_distance(engine: str) -> None:
    scene = scene_of({**GROUND, "max_force": 4.0}, velocity=[1.2, 1.6])  # 2 m/s and 2 m/s²: 1 m in 1 s
    end = run_of(scene, engine).position[-1, 0]
    assert np.hypot(*(end - [1.0, 0.0])) == pytest.approx(1.0, abs=2.0 * H)  # first order: v·h
    assert (end - [1.0, 0.0]).tolist() == pytest.approx([0.6, 0.8], abs=2.0 * H)


@pytest.mark.parametrize("limit", [{"max_force": 1e3}, {"max_bias": 1e3}])
def test_pendulum_that_may_give_way_has_no_closed_form(limit: dict[str, float]) -> None:
    rod = {"kind": "rod", "anchors": [[0.0, 0.0], [0.0, 0.0]]}
    assert solution(scene_of(rod, gravity=G, collides="none")) is not None
    assert solution(scene_of({**rod, **limit}, gravity=G, collides="none")) is None


def test_check_does_not_take_ground_friction_for_a_violated_joint() -> None:
    scene = scene_of({**GROUND, "max_force": 3.0}, position=[100.0, 50.0], velocity=[3.0, 0.0])
    assert not {"joint_start", "anchors", "chain"} & {each.kind for each in warnings(scene)}
    assert run_of(scene).info["joint_error"] is None
    assert math.isfinite(run_of(scene).info["energy_end"])
