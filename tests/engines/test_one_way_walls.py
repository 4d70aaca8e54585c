"""One-way walls: solid from the left and open from the right until a body has passed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Remove, Spawn, Switch
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

every_engine = pytest.mark.parametrize("engine", ["pymunk", "reference"])

R = 0.1


def gate(ball: dict[str, Any], points: list[list[float]] | None = None, **more: Any) -> Scene:
    """Return a ball and a gate that runs upwards: its left is x < 0, and bodies that move towards −x pass."""
    wall = {"name": "gate", "points": points or [[0.0, -1.0], [0.0, 1.0]], "thickness": 0.02, "restitution": 1.0}
    return make_scene(
        solver={"dt": 0.005},
        world={"duration": 2.0, **more},
        ball=[{"name": "ball", "radius": R, "mass": 1.0, **ball}],
        wall=[{**wall, "one_way": True}],
    )


def start_on(engine: str, scene: Scene, settings: Settings | None = None) -> SwitchableSimulation:
    return start(scene, engine, settings)


def record_velocity(simulation: SwitchableSimulation, steps: int) -> np.ndarray[Any, Any]:
    """Run some steps and return the velocity after each, (steps, 2)."""
    found = []
    for _ in range(steps):
        simulation.step()
        found.append(simulation.frame().velocity[0])
    return np.asarray(found)


@every_engine
@pytest.mark.parametrize("speed", [0.01, 1.0, 15.0])
def test_ball_from_the_left_rebounds(engine: str, speed: float) -> None:
    scene = gate({"position": [-R - 0.01 - 0.05 * speed, 0.0], "velocity": [speed, 0.0]})
    velocity = record_velocity(start_on(engine, scene), 40)
    assert velocity[-1, 0] == pytest.approx(-speed, rel=1e-12)  # rounding


@every_engine
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 30.0])
def test_ball_from_the_right_passes_without_contact(engine: str, speed: float) -> None:
    simulation = start_on(engine, gate({"position": [R + 0.01 + 0.05 * speed, 0.0], "velocity": [-speed, 0.0]}))
    simulation.contacts()
    velocity = record_velocity(simulation, 1000 if speed < 1.0 else 200)
    assert (velocity == [-speed, 0.0]).all()
    assert simulation.frame().position[0, 0] < -R - 0.01
    assert not len(simulation.contacts().time)


@every_engine
def test_ball_that_turns_round_inside_the_gate_returns_freely(engine: str) -> None:
    # It turns round while it overlaps with its centre beyond the line: no contact pushes it to either side.
    start_x = 0.5
    gravity = 2.0
    speed = float(np.sqrt(2.0 * gravity * (start_x + 0.04)))  # reaches x = −0.04
    simulation = start_on(engine, gate({"position": [start_x, 0.0], "velocity": [-speed, 0.0]}, gravity=[gravity, 0.0]))
    velocity = record_velocity(simulation, 300)
    assert np.diff(velocity[:, 0]) == pytest.approx(np.full(299, gravity * 0.005), rel=1e-9)  # free fall throughout
    assert simulation.frame().position[0, 0] > 0.5


@every_engine
def test_ball_rests_on_the_left_side_and_falls_through_from_the_right(engine: str) -> None:
    # The left side is up; with reversed points it is down.
    points = [[-1.0, 0.0], [1.0, 0.0]]
    resting = start_on(engine, gate({"position": [0.0, R + 0.01]}, points, gravity=[0.0, -9.81]))
    advance(resting, 200)
    assert resting.frame().position[0, 1] == pytest.approx(R + 0.01, abs=2e-3)  # pymunk's slop
    falling = start_on(engine, gate({"position": [0.0, R + 0.01]}, points[::-1], gravity=[0.0, -9.81]))
    advance(falling, 200)
    assert falling.frame().position[0, 1] < -4.0


@every_engine
def test_polyline_gate_is_passed_at_a_corner(engine: str) -> None:
    for points in ([[0.0, -1.0], [0.0, 0.0], [0.0, 1.0]], [[-0.3, -1.0], [0.0, 0.0], [-0.3, 1.0]]):
        simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-1.0, 0.0]}, points))
        assert (record_velocity(simulation, 200) == [-1.0, 0.0]).all()
        returning = start_on(engine, gate({"position": [-0.8, 0.0], "velocity": [1.0, 0.0]}, points))
        # two contacts at once in a corner: ten iterations
        assert record_velocity(returning, 200)[-1, 0] == pytest.approx(-1.0, rel=0.02)


@every_engine
def test_box_passes_without_contact(engine: str) -> None:
    document = {
        "solver": {"dt": 0.005},
        "box": [{"position": [0.5, 0.3], "velocity": [-1.0, 0.0], "angular_velocity": 2.0, "size": [0.3, 0.1]}],
        "wall": [{"points": [[0.0, -1.0], [0.0, 1.0]], "one_way": True, "friction": 1.0}],
    }
    simulation = start_on(engine, from_document(document))
    assert (record_velocity(simulation, 200) == [-1.0, 0.0]).all()
    assert simulation.frame().angular_velocity[0] == 2.0


@pytest.mark.fail_slow(60)  # takes over half a second
@every_engine
@given(st.floats(-1.2, 1.2), st.floats(-0.5, 0.5), st.floats(0.2, 20.0))
def test_no_ball_passes_from_left_to_right_or_loses_energy(engine: str, y: float, up: float, speed: float) -> None:
    # Elastic and frictionless: contacts with sides and ends conserve its speed.
    for side in (-1.0, 1.0):
        scene = gate({"position": [side * 0.6, y], "velocity": [-side * speed, up * speed]})
        simulation = start_on(engine, scene, settings=scene.solver.replace(dt=0.5 * R / (20.0 * 1.2)))
        for _ in range(200):
            simulation.step()
            velocity = simulation.frame().velocity[0]
            assert np.hypot(*velocity) == pytest.approx(speed * np.hypot(1.0, up), rel=1e-9)  # rounding
        if side > 0.0 and abs(y) + 0.6 * abs(up) < 0.9:  # it hits no end
            assert velocity[0] == -speed
        if side < 0.0 and abs(y) + 0.6 * abs(up) < 0.9:
            assert velocity[0] <= speed
            assert simulation.frame().position[0, 0] < 0.0 or velocity[0] == speed


@every_engine
@pytest.mark.parametrize(("slope", "time"), [(0.0, 0.13), (0.2, 0.31), (0.0, 0.77)])
def test_resting_ball_does_not_fall_through_after_an_engine_switch(engine: str, slope: float, time: float) -> None:
    # The speed of a resting ball is rounding of either sign.
    ball = {"position": [0.1, 0.15 + 0.1 * slope], "restitution": 0.3}
    simulation = start_on(engine, gate(ball, [[-1.0, -slope], [1.0, slope]], gravity=[0.3, -9.81]))
    while simulation.time < time - 1e-9:
        simulation.step()
    simulation.apply(Switch(time=time))
    advance(simulation, 60)
    x, y = simulation.frame().position[0]
    assert y > slope * x + R


@every_engine
def test_checkpoint_after_turning_round_inside_the_gate_lets_the_ball_return(engine: str) -> None:
    # Its centre is beyond the line and it moves back: by position and velocity alone it would be stopped.
    gravity = 2.0
    scene = gate(
        {"position": [0.5, 0.0], "velocity": [-float(np.sqrt(2.0 * gravity * 0.54)), 0.0]}, gravity=[gravity, 0.0]
    )
    simulation = start_on(engine, scene)
    while simulation.frame().velocity[0, 0] <= 0.0:
        simulation.step()
    assert -R < simulation.frame().position[0, 0] < 0.0
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    assert resumed.state_hash() == simulation.state_hash()
    for each in (simulation, resumed):
        record_velocity(each, 150)
        assert each.frame().passing is None
    assert resumed.state_hash() == simulation.state_hash()
    assert resumed.frame().position[0, 0] > R


@every_engine
def test_passing_bodies_keep_their_index_after_others_are_removed(engine: str) -> None:
    simulation = start_on(engine, gate({"position": [3.0, 0.0]}))
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(0.5, 0.0), velocity=(-1.0, 0.0), radius=R)))
    recorded = []
    for k in range(150):
        if k == 105:
            simulation.apply(Remove(time=simulation.time, body="ball"))
            simulation.apply(Switch(time=simulation.time))
        passing = simulation.frame().passing
        recorded.append(None if passing is None else passing.tolist())
        simulation.step()
    # It overlaps from x = 0.11 to −0.11 m, at 1 m/s and 5 ms a step; before and after, no body passes.
    assert recorded[:78] == [None] * 78
    assert recorded[80:122] == [[[1, -1]]] * 42
    assert recorded[124:] == [None] * 26


@every_engine
def test_audit_reports_no_missed_contact_at_a_gate(engine: str) -> None:
    scene = gate({"position": [0.5, 0.0], "velocity": [-60.0, 0.0]})
    assert run(scene, engine).missed_contacts == 0


@every_engine
def test_renumbered_surfaces_do_not_change_the_gate(engine: str) -> None:
    simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-1.0, 0.0]}))
    for k in range(3):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(3.0 + k, 0.5), radius=R, restitution=0.1 * k + 0.05)))
    ball = Ball(position=(-0.5, 0.5), velocity=(1.0, 0.0), radius=R, restitution=0.9)
    simulation.apply(Spawn(time=0.0, ball=ball))
    record_velocity(simulation, 180)
    velocity = simulation.frame().velocity
    assert velocity[0].tolist() == [-1.0, 0.0]
    assert velocity[-1, 0] == pytest.approx(-0.9, rel=1e-12)  # rounding
