"""Reshape: new points of a wall in a running scene, on every engine."""

import math

import pytest

from sandbox.action import ActionError, Reshape, Switch
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.recording import Recording
from sandbox.scene.files.load import loads

GROUND = """
[world]
gravity = [0.0, -10.0]
duration = 2.0
[solver]
dt = 0.005
[[wall]]
name = "hill"
points = [[-5.0, 1.0], [0.0, 1.0], [5.0, 1.0]]
[[wall]]
name = "post"
points = [[9.0, 0.0], [9.0, 1.0]]
[[ball]]
name = "a"
position = [1.0, 1.25]
radius = 0.25
"""

LOWER = Reshape(time=0.0, thing="hill", points=((-5.0, 0.0), (-1.0, 0.0), (2.0, 0.0), (5.0, 0.0)))
FALL_TIME = math.sqrt(2.0 * 1.0 / 10.0)  # s, from a height of 1 m


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_on_a_reshaped_wall_falls_to_its_new_position(engine: str) -> None:
    simulation = start(loads(GROUND), engine)
    for _ in range(40):
        simulation.step()
    simulation.contacts()
    simulation.apply(LOWER)
    for _ in range(70):
        simulation.step()
    expected = 1.25 - 0.5 * 10.0 * 0.35**2
    # First order in the step: g·h·T/2 of explicit Euler, and the slop of pymunk, by which a resting ball is lower.
    assert simulation.frame().position[0, 1] == pytest.approx(expected, abs=10.0 * 0.005 * 0.35 + 1e-2)
    for _ in range(60):
        simulation.step()
    frame = simulation.frame()
    assert frame.position[0].tolist() == pytest.approx([1.0, 0.25], abs=2e-2)  # slop, 1e-2 m, and rounding
    struck = [each for each in simulation.contacts() if each.pair == (0, -1) and each.time > 0.3]
    assert struck[0].time == pytest.approx(0.2 + FALL_TIME, abs=0.02)  # steps, and the effect of the slop


@pytest.mark.parametrize("engine", ENGINES)
def test_reshaped_wall_equals_a_wall_from_a_file(engine: str) -> None:
    """A scene with the new points and one reshaped at time 0 run bit-identically."""
    simulation = start(loads(GROUND), engine)
    simulation.apply(LOWER)
    other = start(
        loads(GROUND.replace("[[-5.0, 1.0], [0.0, 1.0], [5.0, 1.0]]", str(list(map(list, LOWER.points))))), engine
    )
    assert simulation.scene.walls == other.scene.walls
    for _ in range(150):
        simulation.step()
        other.step()
    assert simulation.state_hash() == other.state_hash()


@pytest.mark.parametrize("engine", ENGINES)
def test_reshaped_wall_persists_through_checkpoints_switches_and_recordings(engine: str) -> None:
    scene = loads(GROUND)
    simulation = start(scene, engine)
    simulation.step()
    simulation.apply(LOWER)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    assert resumed.scene.walls[0].points == LOWER.points
    switched = start(scene, engine)
    switched.apply(LOWER)
    switched.apply(Switch(time=0.0, engine="reference"))
    for each in (resumed, switched):
        for _ in range(200):
            each.step()
        assert each.frame().position[0, 1] == pytest.approx(0.25, abs=2e-2)  # as above

    timed_action = LOWER.model_copy(update={"time": 0.5})
    trajectory = run(scene, engine, actions=[timed_action])
    recording = Recording(scene, engine, scene.solver, (timed_action,), 2.0, trajectory.info["state_hash"])
    loaded = Recording.from_json(recording.to_json())
    assert loaded.actions == (timed_action,)
    assert run(loaded.scene, engine, actions=loaded.actions).info["state_hash"] == trajectory.info["state_hash"]
    assert trajectory.missed_contacts == 0


def test_audit_uses_the_current_walls() -> None:
    """A ball that tunnels through a wall within a step is reported for the new wall and not for the old one."""
    text = GROUND.replace("[1.0, 1.25]", "[1.0, 30.0]").replace(
        "radius = 0.25", "radius = 0.05\nvelocity = [0.0, -90.0]"
    )
    lowered = Reshape(time=0.0, thing="hill", points=((-5.0, -60.2), (5.0, -60.2)))
    missed = [run(loads(text), "pymunk", actions=actions).missed_time.tolist() for actions in ([], [lowered])]
    # 90 t + 5 t² is 29 m and 90.2 m; each missed contact has the start time of its step of 5 ms.
    assert [len(each) for each in missed] == [1, 1]
    assert [each[0] for each in missed] == pytest.approx([0.3167, 0.9518], abs=0.0075)


@pytest.mark.parametrize("engine", ENGINES)
def test_invalid_reshape_changes_nothing(engine: str) -> None:
    simulation = start(loads(GROUND), engine)
    walls = simulation.scene.walls
    for action, reason in (
        (LOWER.model_copy(update={"thing": "hull"}), "no wall is named 'hull'"),
        (
            LOWER.model_copy(update={"points": ((0.0, 0.0), (0.0, 0.0))}),
            "the wall 'hill': points.0 is at the same place",
        ),
    ):
        with pytest.raises(ActionError, match=reason):
            simulation.apply(action)
    assert simulation.scene.walls is walls


def test_exact_refuses_a_wall_through_a_ball() -> None:
    simulation = start(loads(GROUND), "exact")
    with pytest.raises(ActionError, match="'a' and 'hill' overlap"):
        simulation.apply(LOWER.model_copy(update={"points": ((-5.0, 1.2), (5.0, 1.2))}))


def test_cushions_cannot_be_reshaped() -> None:
    scene = loads(
        GROUND.replace("gravity = [0.0, -10.0]", "").replace("[[ball]]", "[surface]\nsliding_friction = 0.2\n[[ball]]")
    )
    simulation = start(scene, "pymunk")
    with pytest.raises(ActionError, match="'hill' is a cushion"):
        simulation.apply(LOWER)
