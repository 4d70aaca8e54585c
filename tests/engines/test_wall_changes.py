"""Walls in a running scene: they change between solid and non-solid, and get new points."""

import math
from typing import Any

import pytest

from sandbox.action import ActionError, Remove, Reshape, Spawn, Toggle
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.registry import ENGINES as ALL_ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

ENGINES = ("pymunk", "exact", "reference")
R = 0.05
G = 9.81


def shelf(**more: Any) -> Scene:
    """Return a ball at rest on a shelf, 1 m above a floor, beside a post."""
    return make_scene(
        world={"gravity": [0.0, -G], "duration": 1.0},
        solver={"dt": 0.001},
        ball=[{"name": "ball", "position": [0.0, 1.0 + R], "radius": R}],
        wall=[
            {"name": "shelf", "points": [[-0.5, 1.0], [0.5, 1.0]], "friction": 0.5, **more},
            {"name": "floor", "points": [[-0.5, 0.0], [0.5, 0.0]]},
        ],
        post=[{"name": "peg", "position": [0.3, 0.5], "radius": 0.1}],
    )


def height_after(simulation: SwitchableSimulation, steps: int) -> float:
    """Run some steps and return the height of the ball, m."""
    return float(advance(simulation, steps).frame().position[0, 1])


def toggle(simulation: SwitchableSimulation, thing: str, solid: bool) -> None:
    simulation.apply(Toggle(time=0.0, thing=thing, solid=solid))


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_falls_when_its_shelf_becomes_non_solid(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.account()
    before = total_energy(simulation)
    assert height_after(simulation, 100) == pytest.approx(1.0 + R, abs=2e-3)  # slop of pymunk
    initial = float(simulation.frame().position[0, 1])
    toggle(simulation, "shelf", False)
    drop = initial - height_after(simulation, 300)
    assert drop == pytest.approx(0.5 * G * 0.3**2, abs=0.01)  # explicit Euler lags by g·h·t/2, and one step of rest
    assert height_after(simulation, 600) == pytest.approx(R, abs=2e-3)  # it rests on the floor
    assert simulation.scene.walls[0].solid is False
    booked = sum(simulation.account().values())
    assert total_energy(simulation) - before == pytest.approx(booked, rel=1e-9, abs=1e-9)  # rounding of about 10 J


@pytest.mark.parametrize("engine", ENGINES)
def test_non_solid_wall_is_passed_until_it_becomes_solid(engine: str) -> None:
    simulation = start(shelf(solid=False), engine)
    assert height_after(simulation, 300) < 1.0
    supported = start(shelf(solid=False), engine)
    toggle(supported, "shelf", True)
    assert height_after(supported, 300) == pytest.approx(1.0 + R, abs=2e-3)  # as above


@pytest.mark.parametrize("engine", ENGINES)
def test_contacts_end_with_the_solid_state(engine: str) -> None:
    simulation = start(shelf(), engine)
    simulation.contacts()
    height_after(simulation, 50)
    assert {*map(tuple, simulation.contacts().pair.tolist())} == {(0, -1)}
    toggle(simulation, "shelf", False)
    height_after(simulation, 2)
    simulation.contacts()  # it was active since the last call
    height_after(simulation, 50)
    assert not len(simulation.contacts().time)


def test_ball_inside_a_wall_that_becomes_solid_is_pushed_out_or_refused() -> None:
    simulation = start(shelf(solid=False), "exact")
    advance(simulation, 30)  # halfway through the shelf
    with pytest.raises(ActionError, match="shelf"):
        toggle(simulation, "shelf", True)
    assert simulation.scene.walls[0].solid is False
    assert height_after(simulation, 200) < 1.0 - R
    on_pymunk = start(shelf(solid=False))
    height_after(on_pymunk, 30)
    toggle(on_pymunk, "shelf", True)
    assert height_after(on_pymunk, 900) == pytest.approx(1.0 + R, abs=2e-3)


@pytest.mark.parametrize(
    "how",
    [
        {"response": "penalty", "substeps": 20, "damping": 0.5},
        {"detection": "bisect", "integrator": "velocity_verlet"},
        {"detection": "swept", "integrator": "velocity_verlet"},
        {"detection": "shrink"},
        {"broad_phase": "grid"},
    ],
)
def test_toggle_works_with_every_setting_of_the_reference(how: dict[str, Any]) -> None:
    scene = shelf()
    simulation = start(scene, "reference", scene.solver.replace(**how))
    height_after(simulation, 50)
    toggle(simulation, "shelf", False)
    assert height_after(simulation, 250) < 0.8
    toggle(simulation, "shelf", True)
    assert height_after(simulation, 600) == pytest.approx(R, abs=0.01)  # penalty springs yield by some mm


def test_toggle_of_an_unknown_wall_is_refused() -> None:
    simulation = start(shelf())
    for name in ("ball", "shelves"):
        with pytest.raises(ActionError, match=rf"no wall or post is named '{name}'; known names: shelf, floor, peg"):
            toggle(simulation, name, False)
    plane = {"plane": [{"name": "ground", "point": [0, 0], "normal": [0, 1]}]}
    plane_only = start(from_document(plane))
    with pytest.raises(ActionError, match="no wall or post is named 'ground'"):
        toggle(plane_only, "ground", False)
    table = start(from_document({"surface": {}, "wall": [{"name": "w", "points": [[0, 0], [1, 0]]}]}))
    with pytest.raises(ActionError, match="cushions of a billiard table"):
        toggle(table, "w", False)


def test_toggle_to_the_same_state_changes_nothing() -> None:
    simulation = start(shelf())
    scene = simulation.scene
    toggle(simulation, "shelf", True)
    assert simulation.scene is scene


def test_spawns_and_removals_keep_the_solid_state() -> None:
    for engine in ENGINES:
        simulation = start(shelf(), engine)
        toggle(simulation, "shelf", False)
        simulation.apply(Spawn(time=0.0, ball=Ball(name="more", position=(0.2, 1.5), radius=R, restitution=0.3)))
        simulation.apply(Remove(time=0.0, body="ball"))
        height_after(simulation, 400)
        assert simulation.frame().position[1, 1] < 0.9


def hill(ball: dict[str, Any] | None = None, points: Any = ((-5.0, 1.0), (0.0, 1.0), (5.0, 1.0))) -> Scene:
    """Return a ball at rest on a wall."""
    return make_scene(
        world={"gravity": [0.0, -10.0], "duration": 2.0},
        solver={"dt": 0.005},
        wall=[{"name": "hill", "points": points}, {"name": "post", "points": [[9.0, 0.0], [9.0, 1.0]]}],
        ball=[{"name": "a", "position": [1.0, 1.25], "radius": 0.25, **(ball or {})}],
    )


LOWER = Reshape(time=0.0, thing="hill", points=((-5.0, 0.0), (-1.0, 0.0), (2.0, 0.0), (5.0, 0.0)))
FALL_TIME = math.sqrt(2.0 * 1.0 / 10.0)  # s, from a height of 1 m


@pytest.mark.parametrize("engine", ALL_ENGINES)
def test_ball_on_a_reshaped_wall_falls_to_its_new_position(engine: str) -> None:
    simulation = start(hill(), engine)
    advance(simulation, 40)
    simulation.contacts()
    simulation.apply(LOWER)
    advance(simulation, 70)
    expected = 1.25 - 0.5 * 10.0 * 0.35**2
    # First order in the step: g·h·T/2 of explicit Euler, and the slop of pymunk, by which a resting ball is lower.
    assert simulation.frame().position[0, 1] == pytest.approx(expected, abs=10.0 * 0.005 * 0.35 + 1e-2)
    frame = advance(simulation, 60).frame()
    assert frame.position[0].tolist() == pytest.approx([1.0, 0.25], abs=2e-2)  # slop, 1e-2 m, and rounding
    struck = [each for each in simulation.contacts() if each.pair == (0, -1) and each.time > 0.3]
    assert struck[0].time == pytest.approx(0.2 + FALL_TIME, abs=0.02)  # steps, and the effect of the slop


@pytest.mark.parametrize("engine", ALL_ENGINES)
def test_reshaped_wall_equals_a_wall_from_a_file(engine: str) -> None:
    """A scene with the new points and one reshaped at time 0 run bit-identically."""
    simulation = start(hill(), engine)
    simulation.apply(LOWER)
    other = start(hill(points=LOWER.points), engine)
    assert simulation.scene.walls == other.scene.walls
    for _ in range(150):
        simulation.step()
        other.step()
    assert simulation.state_hash() == other.state_hash()


def test_audit_uses_the_current_walls() -> None:
    """A ball that tunnels through a wall within a step is reported for the new wall and not for the old one."""
    scene = hill({"position": [1.0, 30.0], "radius": 0.05, "velocity": [0.0, -90.0]})
    lowered = Reshape(time=0.0, thing="hill", points=((-5.0, -60.2), (5.0, -60.2)))
    missed = [run(scene, "pymunk", actions=actions).missed_time.tolist() for actions in ([], [lowered])]
    # 90 t + 5 t² is 29 m and 90.2 m; each missed contact has the start time of its step of 5 ms.
    assert [len(each) for each in missed] == [1, 1]
    assert [each[0] for each in missed] == pytest.approx([0.3167, 0.9518], abs=0.0075)


@pytest.mark.parametrize("engine", ALL_ENGINES)
def test_invalid_reshape_changes_nothing(engine: str) -> None:
    simulation = start(hill(), engine)
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
    simulation = start(hill(), "exact")
    with pytest.raises(ActionError, match="'a' and 'hill' overlap"):
        simulation.apply(LOWER.model_copy(update={"points": ((-5.0, 1.2), (5.0, 1.2))}))
