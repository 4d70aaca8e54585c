"""Joints with a largest force, a largest speed of correction or their own bias, and ratchets, on `pymunk`."""

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
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

H, STEPS = 0.01, 100
"""s, and number of steps of a run"""
G = 10.0
GROUND: dict[str, Any] = {"kind": "pivot", "anchors": [[0.0, 0.0], [0.0, 0.0]], "max_bias": 0.0}
"""Friction of the ground, seen from above"""


def scene_of(joint: dict[str, Any], gravity: float = 0.0, **body: Any) -> Scene:
    """Return a ball of 2 kg, 1 m from the world's origin, with one joint to the world."""
    ball = {"name": "a", "position": [1.0, 0.0], "radius": 0.5, "mass": 2.0, **body}
    return from_document(
        {
            "world": {"gravity": [0.0, -gravity], "duration": H * STEPS},
            "solver": {"dt": H},
            "ball": [ball],
            "joint": [{"between": ["a"], **joint}],
        }
    )


def run_of(scene: Scene, engine: str = "pymunk") -> Trajectory:
    run = sandbox.run(scene, engine, audit=False)
    assert run.status == "ok", run.reason
    return run


def test_ground_friction_stops_a_body_after_its_braking_distance() -> None:
    run = run_of(scene_of({**GROUND, "max_force": 8.0}, velocity=[2.0, 0.0]))
    braking = np.maximum(2.0 - 8.0 / 2.0 * run.time, 0.0)
    assert run.velocity[:, 0, 0] == pytest.approx(braking, abs=1e-12)  # rounding of 50 steps
    distance = run.position[-1, 0, 0] - 1.0
    # v² m/(2 F), and v h/2 because positions move by the old velocity; rounding of 50 steps
    assert distance == pytest.approx(2.0**2 * 2.0 / (2.0 * 8.0) + 2.0 * H / 2.0, abs=1e-12)


def test_ground_friction_does_not_depend_on_the_direction() -> None:
    run = run_of(scene_of({**GROUND, "max_force": 2.0}, velocity=[3.0, 4.0]))
    speed = np.hypot(*run.velocity[-1, 0])
    assert speed == pytest.approx(5.0 - 2.0 / 2.0 * 1.0, abs=1e-12)  # rounding of 100 steps


def test_gear_with_a_largest_torque_slows_a_spin() -> None:
    scene = scene_of({"kind": "gear", "ratio": 1.0, "max_bias": 0.0, "max_force": 0.5}, angular_velocity=6.0)
    moment = 0.5 * 2.0 * 0.5**2
    assert run_of(scene).angular_velocity[-1, 0] == pytest.approx(6.0 - 0.5 / moment, abs=1e-12)  # rounding


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize(("max_force", "acceleration"), [(0.0, G), (5.0, G - 2.5), (19.0, G - 9.5)])
def test_rod_with_a_small_largest_force_lets_a_weight_fall(engine: str, max_force: float, acceleration: float) -> None:
    rod = {"kind": "rod", "anchors": [[0.0, 0.0], [1.0, 1.0]], "max_force": max_force}
    run = run_of(scene_of(rod, gravity=G), engine)
    assert run.velocity[-1, 0].tolist() == pytest.approx([0.0, -acceleration], rel=1e-12)  # rounding of 100 steps


def test_rod_with_a_sufficient_largest_force_holds_a_weight() -> None:
    run = run_of(scene_of({"kind": "rod", "anchors": [[0.0, 0.0], [1.0, 1.0]], "max_force": 21.0}, gravity=G))
    assert run.position[-1, 0, 1] == pytest.approx(0.0, abs=1e-12)  # rounding: it hangs at rest


@pytest.mark.parametrize("limit", [0.0, 0.25, 0.5])
def test_error_of_a_pivot_is_corrected_at_max_bias(limit: float) -> None:
    run = run_of(scene_of({**GROUND, "max_bias": limit}))
    # the first step moves by the velocity before it, which is 0; rounding of 100 steps
    assert run.position[-1, 0].tolist() == pytest.approx([1.0 - limit * (STEPS - 1) * H, 0.0], abs=1e-12)


def test_error_of_a_rotary_limit_is_corrected_at_max_bias() -> None:
    run = run_of(scene_of({"kind": "rotary_limit", "least": -1.0, "most": 0.0, "max_bias": 0.5}, angle=2.0))
    assert run.angle[-1, 0] == pytest.approx(2.0 - 0.5 * (STEPS - 1) * H, abs=1e-12)  # as above


@pytest.mark.parametrize("bias", [0.1, 0.5, 1.0])
def test_fraction_of_an_error_remains_after_a_second(bias: float) -> None:
    run = run_of(scene_of({**GROUND, "max_bias": 1e6, "bias": bias}))
    assert run.position[-1, 0, 0] == pytest.approx(bias ** ((STEPS - 1) * H), rel=1e-12)  # as above


def test_joint_without_its_own_bias_has_that_of_the_solver() -> None:
    pivot = {"kind": "pivot", "anchors": [[0.0, 0.0], [0.0, 0.0]]}
    own, solver = (
        sandbox.run(scene, "pymunk", audit=False, **settings).position
        for scene, settings in ((scene_of({**pivot, "bias": 0.3}), {}), (scene_of(pivot), {"bias": 0.3}))
    )
    assert own.tobytes() == solver.tobytes()


@pytest.mark.parametrize(("kind", "extent"), [("spring", 1.0), ("rotary_spring", 1.0)])
def test_spring_pulls_with_at_most_its_largest_force(kind: str, extent: float) -> None:
    rest = {"rest_length": 0.0} if kind == "spring" else {"rest_angle": 0.0}
    spring = {"kind": kind, "stiffness": 1000.0, "max_force": 0.1, **rest}
    run = run_of(scene_of(spring, angle=extent if kind == "rotary_spring" else 0.0))
    moment = 0.5 * 2.0 * 0.5**2
    rate = run.velocity[-1, 0, 0] if kind == "spring" else run.angular_velocity[-1, 0]
    assert rate == pytest.approx(-0.1 / (2.0 if kind == "spring" else moment), rel=1e-12)  # rounding of 100 steps


@pytest.mark.parametrize("kind", ["rod", "spring"])
def test_joint_does_not_break_under_less_than_its_strength(kind: str) -> None:
    more = {"spring": {"stiffness": 1e4, "rest_length": 0.0}, "rod": {}}[kind]
    joint = {"kind": kind, "anchors": [[0.0, 0.0], [1.0, 1.0]], "max_force": 5.0, **more}
    assert run_of(scene_of({**joint, "strength": 5.1}, gravity=G)).breaks(1).tolist() == [math.inf]
    assert np.isfinite(run_of(scene_of({**joint, "strength": 4.9}, gravity=G)).breaks(1)).all()


def ratchet(ratchet: float = 0.3, phase: float = 0.1, **more: Any) -> dict[str, Any]:
    return {"kind": "ratchet", "ratchet": ratchet, "phase": phase, **more}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ratchet_turns_freely_in_its_direction(sign: float) -> None:
    run = run_of(scene_of(ratchet(sign * 0.3), angular_velocity=sign * 5.0))
    assert (run.angular_velocity == sign * 5.0).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("angle", "click"), [(0.11, 0.1), (0.39, 0.1), (0.95, 0.7), (-0.05, -0.2)])
def test_ratchet_holds_at_the_last_click(angle: float, click: float, sign: float) -> None:
    scene = scene_of(ratchet(sign * 0.3, sign * 0.1), angle=sign * angle, angular_velocity=-sign * 2.0)
    turned = sign * run_of(scene).angle[:, 0]
    # It acts in the step after the click: 2 rad/s · h. The correction then turns it back, by less than that a step.
    assert turned.min() == pytest.approx(click, abs=2.0 * H + 1e-12)
    assert click <= turned[-1] < click + 0.3


def test_ratchet_holds_a_weight_and_lets_go_beyond_its_largest_torque() -> None:
    axle = {"kind": "pivot", "between": ["arm"], "at": [0.0, 0.0]}
    arm = {"name": "arm", "position": [0.5, 0.0], "size": [1.0, 0.1], "mass": 1.0}
    world = {"gravity": [0.0, -G], "duration": 3.0}
    torque = 1.0 * G * 0.5
    angles = []
    for limit in (1.1 * torque, 0.5 * torque):
        joints = [axle, ratchet(0.2, 0.0, between=["arm"], max_force=limit)]
        scene = from_document({"world": world, "solver": {"dt": H / 10}, "box": [arm], "joint": joints})
        angles.append(run_of(scene).angle[:, 0].min())
    # α h² = 15·1e-6 rad a step; the bias of 0.6 % a step holds it within some hundred of these
    assert angles[0] == pytest.approx(0.0, abs=5e-3)
    assert angles[1] < -1.0  # where half of the torque of its weight, cos θ, is left


def test_ratchet_keeps_its_click_when_the_engine_is_started_again() -> None:
    scene = scene_of(ratchet(0.3, 0.0), angle=0.05, angular_velocity=4.0)
    simulation = start(scene, "pymunk")
    for _ in range(50):
        simulation.step()
    assert simulation.frame().angle[0] == pytest.approx(2.05)  # clicks at 1.8 and 2.1
    simulation.apply(Switch(time=0.0, engine="pymunk", settings={"dt": 0.005}))
    simulation.apply(sandbox.action.Move(time=0.0, body="a", position=(1.0, 0.0), angular_velocity=-4.0))
    for _ in range(100):
        simulation.step()
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
