"""Reshape: walls that take another course while a scene runs, on every engine."""

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
FALLING = math.sqrt(2.0 * 1.0 / 10.0)  # s, from a height of 1 m


@pytest.mark.parametrize("engine", ENGINES)
def test_who_stood_on_a_wall_falls_to_where_it_now_is(engine: str) -> None:
    simulation = start(loads(GROUND), engine)
    for _ in range(40):
        simulation.step()
    simulation.contacts()
    simulation.apply(LOWER)
    for _ in range(70):
        simulation.step()
    fallen = 1.25 - 0.5 * 10.0 * 0.35**2
    # The first order of a step: explicit Euler's g·h·T/2, and pymunk's slop, by which what rests lies deeper.
    assert simulation.frame().position[0, 1] == pytest.approx(fallen, abs=10.0 * 0.005 * 0.35 + 1e-2)
    for _ in range(60):
        simulation.step()
    frame = simulation.frame()
    assert frame.position[0].tolist() == pytest.approx([1.0, 0.25], abs=2e-2)  # slop, 1e-2 m, and rounding
    struck = [each for each in simulation.contacts() if each.pair == (0, -1) and each.time > 0.3]
    assert struck[0].time == pytest.approx(0.2 + FALLING, abs=0.02)  # steps, and the slop's share of the speed


@pytest.mark.parametrize("engine", ENGINES)
def test_a_reshaped_wall_is_the_wall_that_a_file_would_state(engine: str) -> None:
    """A scene that begins with the course, and one that is given it at time 0, go the same way, bit for bit."""
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
def test_it_outlives_checkpoints_switches_and_recordings(engine: str) -> None:
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

    at = LOWER.model_copy(update={"time": 0.5})
    made = run(scene, engine, actions=[at])
    recording = Recording(scene, engine, scene.solver, (at,), 2.0, made.info["state_hash"])
    again = Recording.from_json(recording.to_json())
    assert again.actions == (at,)
    assert run(again.scene, engine, actions=again.actions).info["state_hash"] == made.info["state_hash"]
    assert made.missed_contacts == 0


def test_the_audit_sees_the_walls_that_are() -> None:
    """A ball so fast that it passes a wall within a step is missed by the new wall, and not by the old one."""
    text = GROUND.replace("[1.0, 1.25]", "[1.0, 30.0]").replace(
        "radius = 0.25", "radius = 0.05\nvelocity = [0.0, -90.0]"
    )
    away = Reshape(time=0.0, thing="hill", points=((-5.0, -60.2), (5.0, -60.2)))
    missed = [run(loads(text), "pymunk", actions=actions).missed_time.tolist() for actions in ([], [away])]
    # 90 t + 5 t² is 29 m and 90.2 m; each miss is told by when its step of 5 ms began.
    assert [len(each) for each in missed] == [1, 1]
    assert [each[0] for each in missed] == pytest.approx([0.3167, 0.9518], abs=0.0075)


@pytest.mark.parametrize("engine", ENGINES)
def test_what_cannot_be_changes_nothing(engine: str) -> None:
    simulation = start(loads(GROUND), engine)
    walls = simulation.scene.walls
    for action, told in (
        (LOWER.model_copy(update={"thing": "hull"}), "no wall is named 'hull'"),
        (
            LOWER.model_copy(update={"points": ((0.0, 0.0), (0.0, 0.0))}),
            "the wall 'hill': points.0 is at the same place",
        ),
    ):
        with pytest.raises(ActionError, match=told):
            simulation.apply(action)
    assert simulation.scene.walls is walls


def test_exact_refuses_a_wall_through_a_ball() -> None:
    simulation = start(loads(GROUND), "exact")
    with pytest.raises(ActionError, match="'a' and 'hill' overlap"):
        simulation.apply(LOWER.model_copy(update={"points": ((-5.0, 1.2), (5.0, 1.2))}))


def test_cushions_keep_their_course() -> None:
    scene = loads(
        GROUND.replace("gravity = [0.0, -10.0]", "").replace("[[ball]]", "[surface]\nsliding_friction = 0.2\n[[ball]]")
    )
    simulation = start(scene, "pymunk")
    with pytest.raises(ActionError, match="'hill' is a cushion"):
        simulation.apply(LOWER)
