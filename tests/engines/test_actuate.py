"""Levels of motors: torque and direction on every engine, in switches, copies and recordings."""

import copy
import itertools

import numpy as np
import pytest

import sandbox
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import PartError

MOTORED = tuple(name for name, engine in ENGINES.items() if Demand.MOTORS in engine.capabilities)
INERTIA = 0.5 * 2.0 * 0.5**2
"""kg·m², of the disc: m r² / 2"""
TORQUE = 0.8
"""N·m"""


def flywheel(max_torque: float | None = TORQUE) -> Scene:
    """A disc on a fixed axle, which a motor turns at up to 50 rad/s; far from that in the tests."""
    limit = "" if max_torque is None else f"max_torque = {max_torque}"
    return sandbox.loads(f"""
        [world]
        duration = 1.0
        [solver]
        dt = 0.01
        iterations = 20
        [[ball]]
        name = "disc"
        position = [0.0, 0.0]
        radius = 0.5
        mass = 2.0
        [[joint]]
        kind = "pivot"
        between = ["disc"]
        at = [0.0, 0.0]
        [[joint]]
        name = "engine"
        kind = "motor"
        between = ["disc"]
        rate = 50.0
        {limit}
    """)


def spin_after(engine: str, levels: list[float], scene: Scene | None = None) -> float:
    """Return the angular velocity after 10 steps at each of several levels, rad/s."""
    simulation = sandbox.start(scene or flywheel(), engine)
    for level in levels:
        simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": level}))
        for _ in range(10):
            simulation.step()
    return float(simulation.frame().angular_velocity[0])


@pytest.mark.parametrize("engine", MOTORED)
@pytest.mark.parametrize("levels", [[1.0], [0.5], [-0.25], [0.0], [1.0, -1.0], [0.75, 0.0, -0.5]])
def test_torque_is_the_level_times_the_largest_torque(engine: str, levels: list[float]) -> None:
    expected = 0.1 * TORQUE / INERTIA * sum(levels)
    assert spin_after(engine, levels) == pytest.approx(expected, abs=1e-5)  # box2d computes with floats


@pytest.mark.parametrize("engine", MOTORED)
def test_motor_without_a_largest_torque_is_unlimited_in_either_direction_or_off(engine: str) -> None:
    scene = flywheel(None)
    assert spin_after(engine, [0.01], scene) == pytest.approx(50.0, rel=1e-5)
    assert spin_after(engine, [-0.01], scene) == pytest.approx(-50.0, rel=1e-5)
    assert spin_after(engine, [0.0], scene) == 0.0


@pytest.mark.parametrize("engine", MOTORED)
def test_level_scales_values_that_an_action_has_set(engine: str) -> None:
    simulation = sandbox.start(flywheel(), engine)
    simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": -0.5}))
    simulation.apply(sandbox.SetParameter(time=0.0, path="joint.engine.max_torque", value=2.0 * TORQUE))
    for _ in range(10):
        simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(-0.1 * TORQUE / INERTIA, abs=1e-5)


@pytest.mark.parametrize(("before", "after"), list(itertools.permutations(MOTORED, 2)))
def test_levels_last_through_a_switch_of_engines(before: str, after: str) -> None:
    simulation = sandbox.start(flywheel(), before)
    simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": -0.5}))
    for k in range(20):
        if k == 10:
            simulation.apply(sandbox.Switch(time=0.0, engine=after))
        simulation.step()
    assert simulation.frame().angular_velocity[0] == pytest.approx(-0.5 * 0.2 * TORQUE / INERTIA, abs=1e-5)


def test_levels_are_part_of_copies_and_checkpoints() -> None:
    simulation = sandbox.start(flywheel(), "reference")
    simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": 0.5}))
    simulation.step()
    others = [copy.deepcopy(simulation), type(simulation).resumed(simulation.checkpoint())]
    for each in (simulation, *others):
        each.step()
        assert each.frame().angular_velocity[0] == pytest.approx(0.5 * 0.02 * TORQUE / INERTIA, rel=1e-12)


@pytest.mark.parametrize("engine", MOTORED)
def test_prismatic_motor_pushes_with_the_level_of_its_force(engine: str) -> None:
    scene = sandbox.loads("""
        [world]
        duration = 1.0
        [solver]
        dt = 0.01
        iterations = 30
        [[box]]
        name = "slider"
        position = [0.0, 0.0]
        size = [0.4, 0.2]
        mass = 2.0
        [[joint]]
        name = "ram"
        kind = "prismatic"
        between = ["slider"]
        axis = [1.0, 0.0]
        travel = [-5.0, 5.0]
        rate = 4.0
        max_force = 3.0
    """)
    simulation = sandbox.start(scene, engine)
    simulation.apply(sandbox.Actuate(time=0.0, levels={"ram": -0.5}))
    for _ in range(20):
        simulation.step()
    assert simulation.frame().velocity[0, 0] == pytest.approx(-0.5 * 0.2 * 3.0 / 2.0, abs=2e-3)  # the axis gives a bit


def test_recording_with_levels_replays_bit_for_bit(tmp_path: object) -> None:
    actions = [sandbox.Actuate(time=0.1 * k, levels={"engine": (-1.0) ** k * 0.3}) for k in range(5)]
    run = sandbox.run(flywheel(), actions=actions)
    recording = Recording(flywheel(), "pymunk", flywheel().solver, tuple(actions), 1.0, run.info["state_hash"])
    assert rerun(Recording.from_json(recording.to_json())).info["state_hash"] == run.info["state_hash"]


def test_event_actuates_a_motor() -> None:
    event = sandbox.Actuate(time=0.0, levels={"engine": 0.5})
    scene = flywheel().model_copy(update={"events": (event,)})
    assert sandbox.run(scene).angular_velocity[10, 0] == pytest.approx(0.1 * 0.5 * TORQUE / INERTIA, abs=1e-9)


def test_levels_of_motors_that_have_gone_are_left_out_in_a_switch() -> None:
    simulation = sandbox.start(flywheel(), "pymunk")
    simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": 0.5}))
    simulation.apply(sandbox.Unjoin(time=0.0, joint="engine"))
    simulation.apply(sandbox.Switch(time=0.0, engine="reference"))
    simulation.step()
    assert simulation.frame().angular_velocity[0] == 0.0


@pytest.mark.parametrize("engine", MOTORED)
def test_motor_that_is_joined_under_the_name_of_one_that_has_gone_starts_at_level_1(engine: str) -> None:
    simulation = sandbox.start(flywheel(), engine)
    simulation.apply(sandbox.Actuate(time=0.0, levels={"engine": 0.0}))
    simulation.apply(sandbox.Unjoin(time=0.0, joint="engine"))
    motor = sandbox.Motor(name="engine", between=("disc",), rate=50.0, max_torque=TORQUE)
    simulation.apply(sandbox.Join(time=0.0, joint=motor))
    for _ in range(10):
        simulation.step()
    expected = 0.1 * TORQUE / INERTIA
    assert simulation.frame().angular_velocity[0] == pytest.approx(expected, abs=1e-5)  # box2d computes with floats


@pytest.mark.parametrize("leaving", ['kind = "unjoin"\njoint = "engine"', 'kind = "remove"\nbody = "disc"'])
def test_events_pass_over_motors_that_have_gone(leaving: str) -> None:
    scene = sandbox.loads(
        sandbox.dumps(flywheel())
        + f"""
        [[ball]]
        name = "other"
        position = [3.0, 0.0]
        radius = 0.5
        mass = 2.0
        [[joint]]
        name = "other engine"
        kind = "motor"
        between = ["other"]
        rate = 50.0
        max_torque = {TORQUE}
        [[event]]
        time = 0.0
        kind = "actuate"
        levels = {{ "other engine" = 0.0 }}
        [[event]]
        time = 0.1
        {leaving}
        [[event]]
        time = 0.5
        kind = "actuate"
        levels = {{ engine = 0.5, "other engine" = 0.5 }}
        """
    )
    run = sandbox.run(scene, "pymunk", actions=[sandbox.Switch(time=0.3, engine="reference")])
    assert run.status == "ok"
    expected = 0.5 * 0.5 * TORQUE / INERTIA  # in 0.5 s, at half the torque
    assert run.angular_velocity[-1, 1] == pytest.approx(expected, abs=1e-9)  # rounding of 50 sums


def test_event_that_actuates_a_joint_without_a_motor_is_refused() -> None:
    event = '[[event]]\ntime = 0.0\nkind = "actuate"\nlevels = { joint-1 = 1.0 }'
    with pytest.raises(sandbox.SceneError, match="'joint-1' has no motor"):
        sandbox.loads(f"{sandbox.dumps(flywheel())}\n{event}")


@pytest.mark.parametrize("levels", [{}, {"engine": 1.5}, {"engine": float("nan")}])
def test_invalid_levels_are_refused(levels: dict[str, float]) -> None:
    with pytest.raises(PartError, match="levels"):
        sandbox.Actuate(time=0.0, levels=levels)


def test_actuating_a_joint_without_a_motor_or_an_unknown_one_is_an_error() -> None:
    simulation = sandbox.start(flywheel(), "pymunk")
    with pytest.raises(sandbox.ActionError, match="has no motor"):
        simulation.apply(sandbox.Actuate(time=0.0, levels={"joint-1": 1.0}))
    with pytest.raises(sandbox.ActionError, match="no joint is named 'wheel'"):
        simulation.apply(sandbox.Actuate(time=0.0, levels={"wheel": 1.0}))
    assert not np.any(simulation.frame().angular_velocity)


def test_engine_without_motors_refuses_the_scene() -> None:
    with pytest.raises(sandbox.Refusal, match="motors"):
        sandbox.start(flywheel(), "exact")
