"""One-way walls: solid from the left, open from the right, for as long as it takes to pass."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Remove, Spawn, Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document

both = pytest.mark.parametrize("engine", ["pymunk", "reference"])

R = 0.1


def gate(ball: dict[str, Any], points: list[list[float]] | None = None, **more: Any) -> Scene:
    """Return a ball, and a gate that runs upwards, so that its left is where x < 0; what goes to −x passes."""
    wall = {"name": "gate", "points": points or [[0.0, -1.0], [0.0, 1.0]], "thickness": 0.02, "restitution": 1.0}
    return from_document(
        {
            "solver": {"dt": 0.005},
            "world": {"duration": 2.0, **more},
            "ball": [{"name": "ball", "radius": R, "mass": 1.0, **ball}],
            "wall": [{**wall, "one_way": True}],
        }
    )


def start_on(engine: str, scene: Scene, settings: Settings | None = None) -> SwitchableSimulation:
    return start(scene, engine, settings)


def gone(simulation: SwitchableSimulation, steps: int) -> np.ndarray[Any, Any]:
    """Return the velocities (steps, 2) while a simulation goes on."""
    found = []
    for _ in range(steps):
        simulation.step()
        found.append(simulation.frame().velocity[0])
    return np.asarray(found)


@both
@pytest.mark.parametrize("speed", [0.01, 1.0, 15.0])
def test_what_comes_from_the_left_rebounds(engine: str, speed: float) -> None:
    scene = gate({"position": [-R - 0.01 - 0.05 * speed, 0.0], "velocity": [speed, 0.0]})
    velocity = gone(start_on(engine, scene), 40)
    assert velocity[-1, 0] == pytest.approx(-speed, rel=1e-12)  # rounding


@both
@pytest.mark.parametrize("speed", [0.1, 1.0, 10.0, 30.0])
def test_what_comes_from_the_right_passes_without_a_trace(engine: str, speed: float) -> None:
    simulation = start_on(engine, gate({"position": [R + 0.01 + 0.05 * speed, 0.0], "velocity": [-speed, 0.0]}))
    simulation.contacts()
    velocity = gone(simulation, 1000 if speed < 1.0 else 200)
    assert (velocity == [-speed, 0.0]).all()
    assert simulation.frame().position[0, 0] < -R - 0.01
    assert not len(simulation.contacts().time)


@both
def test_it_rebounds_from_the_left_once_it_has_passed(engine: str) -> None:
    # Thrown through against a pull to the right: it turns round beyond the gate and comes back to it.
    simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-3.0, 0.0]}, gravity=[4.0, 0.0]))
    x = []
    for _ in range(400):
        simulation.step()
        x.append(float(simulation.frame().position[0, 0]))
    passed = next(k for k, place in enumerate(x) if place < -R - 0.01)
    assert max(x[passed:]) < -R - 0.01 + 0.03  # m: the way of one step, 0.005 s at 4 m/s, and rounding
    assert min(x) == pytest.approx(0.5 - 9.0 / 8.0, abs=0.02)  # v²/2a: it lost nothing on the way through


@both
def test_what_turns_round_within_goes_back_unhindered(engine: str) -> None:
    # It turns round while it overlaps, its centre beyond the line: nothing snaps it to either side.
    start_x = 0.5
    pull = 2.0
    speed = float(np.sqrt(2.0 * pull * (start_x + 0.04)))  # it reaches x = −0.04
    simulation = start_on(engine, gate({"position": [start_x, 0.0], "velocity": [-speed, 0.0]}, gravity=[pull, 0.0]))
    velocity = gone(simulation, 300)
    assert np.diff(velocity[:, 0]) == pytest.approx(np.full(299, pull * 0.005), rel=1e-9)  # free fall throughout
    assert simulation.frame().position[0, 0] > 0.5


@both
def test_what_rests_on_it_stays_there_and_what_hangs_below_falls_up_through(engine: str) -> None:
    # Its left is above: first point to the right, last to the left, would be below.
    points = [[-1.0, 0.0], [1.0, 0.0]]
    lying = start_on(engine, gate({"position": [0.0, R + 0.01]}, points, gravity=[0.0, -9.81]))
    for _ in range(200):
        lying.step()
    assert lying.frame().position[0, 1] == pytest.approx(R + 0.01, abs=2e-3)  # pymunk's slop
    turned = start_on(engine, gate({"position": [0.0, R + 0.01]}, points[::-1], gravity=[0.0, -9.81]))
    for _ in range(200):
        turned.step()
    assert turned.frame().position[0, 1] < -4.0


@both
def test_polyline_lets_pass_where_its_segments_join(engine: str) -> None:
    for points in ([[0.0, -1.0], [0.0, 0.0], [0.0, 1.0]], [[-0.3, -1.0], [0.0, 0.0], [-0.3, 1.0]]):
        simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-1.0, 0.0]}, points))
        assert (gone(simulation, 200) == [-1.0, 0.0]).all()
        back = start_on(engine, gate({"position": [-0.8, 0.0], "velocity": [1.0, 0.0]}, points))
        assert gone(back, 200)[-1, 0] == pytest.approx(-1.0, rel=0.02)  # two at once in a corner: ten passes


@both
def test_box_passes_too(engine: str) -> None:
    document = {
        "solver": {"dt": 0.005},
        "box": [{"position": [0.5, 0.3], "velocity": [-1.0, 0.0], "angular_velocity": 2.0, "size": [0.3, 0.1]}],
        "wall": [{"points": [[0.0, -1.0], [0.0, 1.0]], "one_way": True, "friction": 1.0}],
    }
    simulation = start_on(engine, from_document(document))
    assert (gone(simulation, 200) == [-1.0, 0.0]).all()
    assert simulation.frame().angular_velocity[0] == 2.0


@both
@settings(max_examples=25, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-0.5, 0.5), st.floats(0.2, 20.0))
def test_nothing_gets_from_left_to_right_nor_loses_energy(engine: str, y: float, up: float, speed: float) -> None:
    # Elastic and without friction: whatever it meets, sides or ends, its speed stays.
    for side in (-1.0, 1.0):
        scene = gate({"position": [side * 0.6, y], "velocity": [-side * speed, up * speed]})
        simulation = start_on(engine, scene, settings=scene.solver.replace(dt=0.5 * R / (20.0 * 1.2)))
        for _ in range(200):
            simulation.step()
            velocity = simulation.frame().velocity[0]
            assert np.hypot(*velocity) == pytest.approx(speed * np.hypot(1.0, up), rel=1e-9)  # rounding
        if side > 0.0 and abs(y) + 0.6 * abs(up) < 0.9:  # it meets no end
            assert velocity[0] == -speed
        if side < 0.0 and abs(y) + 0.6 * abs(up) < 0.9:
            assert velocity[0] <= speed
            assert simulation.frame().position[0, 0] < 0.0 or velocity[0] == speed


@both
def test_checkpoint_within_the_gate_goes_on_through(engine: str) -> None:
    simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-1.0, 0.0]}))
    for _ in range(110):  # its centre is beyond the line by now, and it still overlaps
        simulation.step()
    assert -R < simulation.frame().position[0, 0] < 0.0
    taken_up = SwitchableSimulation.resumed(simulation.checkpoint())
    for each in (simulation, taken_up):
        gone(each, 100)
    assert taken_up.state_hash() == simulation.state_hash()


@both
@pytest.mark.parametrize("moment", [0.13, 0.31, 0.5, 0.77])
@pytest.mark.parametrize("steep", [0.0, 0.2])
def test_what_lies_on_it_does_not_fall_through_where_another_engine_goes_on(
    engine: str, steep: float, moment: float
) -> None:
    # What rests touches it at no speed but rounding, of either sign.
    ball = {"position": [0.1, 0.15 + 0.1 * steep], "restitution": 0.3}
    simulation = start_on(engine, gate(ball, [[-1.0, -steep], [1.0, steep]], gravity=[0.3, -9.81]))
    while simulation.time < moment - 1e-9:
        simulation.step()
    simulation.apply(Switch(time=moment))
    for _ in range(60):
        simulation.step()
    x, y = simulation.frame().position[0]
    assert y > steep * x + R


@both
def test_checkpoint_where_it_has_turned_round_within_lets_it_go_back(engine: str) -> None:
    # Its centre beyond the line, and on its way back: by place and speed alone it would be one to turn away.
    pull = 2.0
    scene = gate({"position": [0.5, 0.0], "velocity": [-float(np.sqrt(2.0 * pull * 0.54)), 0.0]}, gravity=[pull, 0.0])
    simulation = start_on(engine, scene)
    while simulation.frame().velocity[0, 0] <= 0.0:
        simulation.step()
    assert -R < simulation.frame().position[0, 0] < 0.0
    taken_up = SwitchableSimulation.resumed(simulation.checkpoint())
    assert taken_up.state_hash() == simulation.state_hash()
    for each in (simulation, taken_up):
        gone(each, 150)
        assert each.frame().passing is None
    assert taken_up.state_hash() == simulation.state_hash()
    assert taken_up.frame().position[0, 0] > R


@both
def test_who_passes_is_told_by_the_numbers_of_all_also_after_some_are_gone(engine: str) -> None:
    simulation = start_on(engine, gate({"position": [3.0, 0.0]}))
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(0.5, 0.0), velocity=(-1.0, 0.0), radius=R)))
    told = []
    for k in range(150):
        if k == 105:
            simulation.apply(Remove(time=simulation.time, body="ball"))
            simulation.apply(Switch(time=simulation.time))
        passing = simulation.frame().passing
        told.append(None if passing is None else passing.tolist())
        simulation.step()
    # It overlaps from x = 0.11 to −0.11 m, at 1 m/s and 5 ms a step; before and after, nobody passes.
    assert told[:78] == [None] * 78
    assert told[80:122] == [[[1, -1]]] * 42
    assert told[124:] == [None] * 26


@both
def test_audit_misses_nothing_at_a_gate(engine: str) -> None:
    scene = gate({"position": [0.5, 0.0], "velocity": [-60.0, 0.0]})
    assert run(scene, engine).missed_contacts == 0


def test_exact_engine_refuses_gates() -> None:
    with pytest.raises(Refusal, match=r"does not model one-way walls; engines that can: pymunk, reference"):
        start(gate({"position": [0.5, 0.0]}), "exact")


@both
def test_surfaces_numbered_anew_leave_the_gate_what_it_is(engine: str) -> None:
    simulation = start_on(engine, gate({"position": [0.5, 0.0], "velocity": [-1.0, 0.0]}))
    for k in range(3):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(3.0 + k, 0.5), radius=R, restitution=0.1 * k + 0.05)))
    ball = Ball(position=(-0.5, 0.5), velocity=(1.0, 0.0), radius=R, restitution=0.9)
    simulation.apply(Spawn(time=0.0, ball=ball))
    gone(simulation, 180)
    velocity = simulation.frame().velocity
    assert velocity[0].tolist() == [-1.0, 0.0]
    assert velocity[-1, 0] == pytest.approx(-0.9, rel=1e-12)  # rounding
