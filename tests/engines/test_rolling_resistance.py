"""Rolling resistance: a torque up to c·r·N against rolling.

A ball that rolls without slipping on level ground, I = β m r², gets the deceleration c g/(1 + β): the torque and the
friction F give m a = −F and I a/r = r F − c r m g. On a slope of the angle α it is g (sin α − c cos α)/(1 + β).
"""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Drive, SetParameter, Spawn
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.measure.analytic.solve import solution
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.accounts import closed_account

G, R, M = 9.81, 0.25, 2.0
ABLE = ["pymunk", "box2d", "reference"]
LEDGERS = ["pymunk", "reference"]
DISC, SPHERE = 0.5, 0.4
"""β: moment of inertia as a part of m r²"""


def rolling(v: float = 0.0, slope: float = 0.0, **more: Any) -> dict[str, Any]:
    """Return a ball that rolls without slipping on a slope through the origin, up at v, m/s."""
    along, normal = (math.cos(slope), math.sin(slope)), (-math.sin(slope), math.cos(slope))
    state = {"position": [R * x for x in normal], "velocity": [v * x for x in along], "angular_velocity": -v / R}
    return {"name": "a", **state, "radius": R, "mass": M, "friction": 1.0, **more}


def scene_of(
    *balls: dict[str, Any], slope: float = 0.0, duration: float = 1.0, solver: dict[str, Any] | None = None, **more: Any
) -> Scene:
    plane = {"point": [0.0, 0.0], "normal": [-math.sin(slope), math.cos(slope)], **more.pop("plane", {})}
    world = {"gravity": [0.0, -G], "duration": duration, **more.pop("world", {})}
    dt = {"dt": 1.0 / 240.0, **(solver or {})}
    return from_document({"world": world, "solver": dt, "ball": [*balls], "plane": [plane], **more})


@pytest.mark.fail_slow(60)  # 1920 steps
@pytest.mark.parametrize("beta", [DISC, SPHERE])
@pytest.mark.parametrize("engine", ABLE)
def test_a_ball_stops_after_the_distance_of_the_formula(engine: str, beta: float) -> None:
    c, v = 0.05, 2.0
    scene = scene_of(rolling(v, rolling_resistance=c, moment=beta * M * R * R), duration=8.0)
    result = run(scene, engine)
    error = v / 240.0 * 1.6  # a first-order step at each end: v·h, and on pymunk one more without resistance
    assert result.position[-1, 0, 0] == pytest.approx(v * v * (1.0 + beta) / (2.0 * c * G), abs=error)
    assert np.abs(result.velocity[-1, 0]).max() < 1e-9  # it rests
    assert abs(result.angular_velocity[-1, 0]) < 1e-9  # likewise


@pytest.mark.parametrize("beta", [DISC, SPHERE])
@pytest.mark.parametrize("engine", ABLE)
def test_a_ball_rolls_down_a_slope_with_the_reduced_acceleration(engine: str, beta: float) -> None:
    slope, c = 0.1, 0.04
    ball = rolling(slope=slope, rolling_resistance=c, moment=beta * M * R * R)
    result = run(scene_of(ball, slope=slope), engine)
    speed = -float(result.velocity[-1, 0] @ (math.cos(slope), math.sin(slope)))
    # Box2D's soft contacts lose 2e-4 of the normal force; 64-bit engines round
    error = 1e-3 if engine == "box2d" else 1e-9
    assert speed == pytest.approx(G * (math.sin(slope) - c * math.cos(slope)) / (1.0 + beta), rel=error)
    assert result.angular_velocity[-1, 0] == pytest.approx(speed / R, rel=5e-3)  # it does not slip


@pytest.mark.parametrize("engine", ABLE)
def test_a_ball_rests_on_a_slope_that_is_not_steeper_than_its_resistance(engine: str) -> None:
    slope = 0.1
    for factor, rests in ((1.02, True), (0.9, False)):
        ball = rolling(slope=slope, rolling_resistance=factor * math.tan(slope))
        result = run(scene_of(ball, slope=slope, duration=2.0), engine)
        moved = float(np.hypot(*(result.position[-1, 0] - result.position[0, 0])))
        if rests:
            assert np.abs(result.velocity[-1, 0]).max() < 1e-6  # 32-bit numbers on box2d
            assert moved < 0.02 * R  # it sinks in by up to a slop
        else:
            assert moved > 0.1


@pytest.mark.parametrize("engine", ABLE)
def test_a_spinning_ball_without_friction_loses_its_spin_at_a_constant_rate(engine: str) -> None:
    ball = rolling(rolling_resistance=0.05, friction=0.0) | {"angular_velocity": 20.0}
    result = run(scene_of(ball), engine)
    rate = 0.05 * R * M * G / (DISC * M * R * R)
    assert result.angular_velocity[-1, 0] == pytest.approx(20.0 - rate, abs=3.0 * rate / 240.0)  # three steps
    assert abs(result.velocity[-1, 0, 0]) < 0.01  # m/s, it stays


@pytest.mark.parametrize("engine", ABLE)
def test_the_larger_value_of_the_two_sides_applies_unless_a_pair_states_it(engine: str) -> None:
    def loss(ball: dict[str, Any], plane: dict[str, Any], **more: Any) -> float:
        result = run(scene_of(rolling(2.0, **ball), plane=plane, duration=0.5, **more), engine)
        return 2.0 - float(result.velocity[-1, 0, 0])

    own = loss({"rolling_resistance": 0.05}, {"rolling_resistance": 0.02})
    assert own == pytest.approx(0.05 * G / 1.5 * 0.5, rel=0.02)  # two steps of 120
    assert loss({}, {"rolling_resistance": 0.05}) == pytest.approx(own)
    materials = [{"name": "tyre", "rolling_resistance": 0.05}, {"name": "rail"}]
    assert loss({"material": "tyre"}, {"material": "rail"}, material=materials) == pytest.approx(own)
    pair = [{"between": ["tyre", "rail"], "rolling_resistance": 0.01, "friction": 1.0}]
    paired = loss({"material": "tyre"}, {"material": "rail"}, material=materials, pair=pair)
    assert paired == pytest.approx(0.2 * own, rel=0.02)  # two steps of 120


@pytest.mark.parametrize("engine", ABLE)
def test_two_balls_that_press_on_each_other_stop_turning_relative_to_each_other(engine: str) -> None:
    """A ball that spins on another one: the torques on both are opposite, and angular momentum is conserved."""
    below = {"name": "b", "position": [0.0, R], "radius": R, "mass": M, "fixed": True, "rolling_resistance": 0.1}
    above = {"name": "a", "position": [0.0, 3.0 * R], "radius": R, "mass": M, "angular_velocity": 10.0}
    result = run(scene_of(below, above), engine)
    rate = 0.1 * R * M * G / (DISC * M * R * R)
    assert result.angular_velocity[-1, 1] == pytest.approx(max(10.0 - rate, 0.0), abs=2.0 * rate / 240.0)  # two steps


@pytest.mark.parametrize("engine", ABLE)
def test_a_wheel_on_a_cart_slows_it(engine: str) -> None:
    """Two wheels on pivots carry a box: a = −c g M/(M + Σ I/r²), M being the whole mass."""
    wheels = [rolling(2.0, rolling_resistance=0.05, mass=1.0) for _ in range(2)]
    for name, x, wheel in zip("ab", (-0.5, 0.5), wheels, strict=True):
        wheel |= {"name": name, "position": [x, R], "collides": "fixed"}
    box = {"name": "cart", "position": [0.0, R], "size": [1.0, 0.1], "mass": 2.0, "velocity": [2.0, 0.0]}
    joints = [
        {"kind": "pivot", "between": ["cart", n], "anchors": [[x, 0.0], [0.0, 0.0]]}
        for n, x in (("a", -0.5), ("b", 0.5))
    ]
    scene = scene_of(*wheels, box=[{**box, "collides": "none"}], joint=joints)
    result = run(scene, engine)
    expected = 2.0 - 0.05 * G * 4.0 / (4.0 + 2.0 * DISC * 1.0)
    assert result.velocity[-1, 2, 0] == pytest.approx(expected, rel=5e-3)  # two steps of 240, and soft joints on box2d


def test_bodies_with_corners_and_round_ends_have_none() -> None:
    box = {"name": "x", "position": [2.0, 0.5], "size": [1.0, 1.0], "velocity": [1.0, 0.0]}
    capsule = {"name": "y", "position": [5.0, R], "length": 1.0, "radius": R, "velocity": [1.0, 0.0]}
    resisting = {"rolling_resistance": 0.5, "friction": 0.3}
    with_c = scene_of(rolling(), plane=resisting, box=[{**box, "rolling_resistance": 0.4}], capsule=[capsule])
    without = scene_of(rolling(), plane={"friction": 0.3}, box=[box], capsule=[capsule])
    for engine in LEDGERS:
        ends = [run(scene, engine).position[-1, 1:] for scene in (with_c, without)]
        assert (ends[0] == ends[1]).all(), engine


@pytest.mark.parametrize("engine", LEDGERS)
def test_the_account_of_energy_names_the_loss(engine: str) -> None:
    ball = rolling(2.0, rolling_resistance=0.05, restitution=0.4)
    account = closed_account(
        scene_of(ball, rolling(slope=0.0) | {"name": "b", "position": [1.5, 0.6]}), 300, engine=engine, closes=1e-12
    )
    assert account[Cause.ROLLING] < -1.0


@pytest.mark.parametrize("engine", LEDGERS)
@pytest.mark.parametrize("kind", ["torque", "stroke"])
def test_the_account_balances_with_balls_on_driven_bodies(engine: str, kind: str) -> None:
    bat = {"name": "bat", "position": [0.0, 1.0], "size": [1.0, 0.1], "mass": 0.5, "friction": 0.5}
    drive = {"name": "d", "kind": kind, "body": "bat", "pivot": [-0.45, 1.0], "stops": [0.0, 0.6]}
    drive |= {"torque": 5.0} if kind == "torque" else {"rate": 3.0}
    ball = {
        "name": "a",
        "position": [0.2, 1.15],
        "radius": 0.1,
        "mass": 0.1,
        "friction": 1.0,
        "rolling_resistance": 0.2,
    }
    actions = [(20, Drive(time=0.0, drive="d", level=1.0))]
    account = closed_account(scene_of(ball, box=[bat], drive=[drive]), 150, actions, engine=engine, closes=1e-12)
    assert account[Cause.ROLLING] != 0.0


@pytest.mark.parametrize("engine", LEDGERS)
def test_the_account_balances_with_balls_on_kinematic_bodies(engine: str) -> None:
    drum = {"name": "drum", "position": [0.0, R], "radius": R, "kinematic": True, "angular_velocity": 3.0}
    ball = {
        "name": "a",
        "position": [0.02, 3.0 * R],
        "radius": R,
        "mass": M,
        "friction": 1.0,
        "rolling_resistance": 0.2,
    }
    account = closed_account(scene_of({**drum, "friction": 1.0}, ball), 200, engine=engine, closes=1e-12)
    assert account[Cause.ROLLING] < 0.0


@pytest.mark.fail_slow(60)  # 1920 steps with an account, twice
@pytest.mark.parametrize("engine", LEDGERS)
def test_all_the_energy_of_a_ball_that_stops_is_lost_to_rolling_resistance(engine: str) -> None:
    scene = scene_of(rolling(2.0, rolling_resistance=0.05), duration=8.0)
    account = closed_account(scene, 8 * 240, engine=engine, closes=1e-12)
    kinetic = 0.5 * M * 2.0**2 * (1.0 + DISC)
    # but for a fall by g·h² on the first steps
    assert account[Cause.ROLLING] == pytest.approx(-kinetic, rel=2e-3)


def test_reference_continues_from_a_snapshot_bit_for_bit() -> None:
    simulation = start(scene_of(rolling(1.0, slope=0.05, rolling_resistance=0.04), slope=0.05), "reference")
    for _ in range(50):
        simulation.step()
    kept, ends = simulation.snapshot(), []
    for _ in range(2):
        for _ in range(50):
            simulation.step()
        ends.append(simulation.state_hash())
        simulation.restore(kept)
    assert ends[0] == ends[1]


@pytest.mark.parametrize("engine", ABLE)
def test_balls_come_and_go(engine: str) -> None:
    simulation = start(scene_of(rolling(2.0, rolling_resistance=0.05), duration=9.0), engine)
    for _ in range(20):
        simulation.step()
    ball = rolling(2.0, rolling_resistance=0.1) | {"name": "new", "position": [-3.0, R]}
    simulation.apply(Spawn(time=0.0, ball=Ball(**ball)))
    for _ in range(40):
        simulation.step()
    simulation.apply(SetParameter(time=0.0, path="ball.a.friction", value=0.9))
    for _ in range(200):
        simulation.step()
    lost = 2.0 - simulation.frame().velocity[1, 0]
    assert lost == pytest.approx(0.1 * G / 1.5, rel=0.02)  # two steps of 240


@pytest.mark.parametrize("detection", ["bisect", "swept", "shrink"])
def test_detections_of_impacts_have_it_too(detection: str) -> None:
    scene = scene_of(rolling(2.0, rolling_resistance=0.05), solver={"detection": detection})
    assert run(scene, "reference").velocity[-1, 0, 0] == pytest.approx(2.0 - 0.05 * G / 1.5, rel=5e-3)  # a first step


def test_what_cannot_be_combined_is_refused_by_name() -> None:
    ball = rolling(rolling_resistance=0.1)
    for engine, solver in (
        ("exact", {}),
        ("pymunk", {"sleeping": True}),
        ("reference", {"response": "penalty"}),
        ("reference", {"impact": "dissipative"}),
    ):
        with pytest.raises(Refusal, match="rolling resistance"):
            start(scene_of(ball, solver=solver), engine)
    with pytest.raises(ActionError, match="rolling resistance"):
        start(scene_of(rolling()), "exact").apply(
            Spawn(time=0.0, ball=Ball(**(ball | {"name": "b", "position": [3.0, 1.0]})))
        )


def test_box2d_refuses_contacts_at_which_it_takes_another_radius() -> None:
    post = {"position": [5.0, 0.0], "radius": 1.0}
    with pytest.raises(Refusal, match="has a radius of 1 m"):
        start(scene_of(rolling(rolling_resistance=0.1), post=[post]), "box2d")
    capsule = {"name": "y", "position": [5.0, R], "length": 1.0, "radius": R}
    with pytest.raises(Refusal, match="round corners or ends"):
        start(scene_of(rolling(), plane={"rolling_resistance": 0.1}, capsule=[capsule]), "box2d")


def test_a_surface_has_its_own_rolling_friction() -> None:
    with pytest.raises(SceneError, match=r"surface\.rolling_friction"):
        from_document({"surface": {"sliding_friction": 0.2}, "ball": [rolling(rolling_resistance=0.1)]})


def test_no_formula_is_claimed() -> None:
    slope = 0.1
    scene = scene_of(rolling(slope=slope), slope=slope)
    assert solution(scene) is not None
    scene = scene_of(rolling(slope=slope, rolling_resistance=0.01), slope=slope)
    assert contact_matrix(scene).rolling == 0.01
    assert solution(scene) is None
