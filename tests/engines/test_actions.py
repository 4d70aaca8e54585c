"""Actions on a running simulation: each does what it says at once, or says why not and changes nothing."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Simulation
from sandbox.engines.registry import start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Frame

FLOOR = {"name": "floor", "point": [0, 0], "normal": [0, 1]}


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 1, **more}


def started(*balls: dict[str, Any], steps: int = 0, **document: Any) -> Simulation:
    """Return a simulation of some balls, after some steps."""
    return stepped(start(from_document({"ball": list(balls), **document})), steps)


def stepped(simulation: Simulation, steps: int) -> Simulation:
    for _ in range(steps):
        simulation.step()
    return simulation


def spawned(name: str | None, x: float, y: float, **more: Any) -> Spawn:
    return Spawn(time=0, ball=Ball(name=name, position=(x, y), radius=1.0, **more))


def same(a: Frame, b: Frame, rows: slice) -> bool:
    pairs = ((a.position, b.position), (a.velocity, b.velocity), (a.angle, b.angle))
    spins = (a.angular_velocity, b.angular_velocity)
    return all(np.array_equal(one[rows], other[rows]) for one, other in (*pairs, spins))


HOSTILE: list[Action] = [
    Impulse(time=0, body="zzz", impulse=(1.0, 0.0)),
    Impulse(time=0, body="gone", impulse=(1.0, 0.0)),
    Impulse(time=0, body="fixed", impulse=(1.0, 0.0)),
    Impulse(time=0, body="floor", impulse=(1.0, 0.0)),
    Impulse(time=0, body="a", impulse=(1e42, 0.0)),
    Impulse(time=0, body="a", impulse=(8e11, 8e11)),
    Impulse(time=0, body="flying", impulse=(0.0, 0.0), angular=-1e42),
    Force(time=0, body="zzz", force=(1.0, 0.0)),
    Force(time=0, body="gone", force=(1.0, 0.0)),
    Force(time=0, body="fixed", force=(1.0, 0.0)),
    Force(time=0, body="a", force=(1e42, -1e42)),
    Force(time=0, body="flying", force=(1e42, -1e42)),
    Force(time=0, body="a", force=(0.0, 0.0), torque=1e42),
    Move(time=0, body="zzz", position=(0.0, 0.0)),
    Move(time=0, body="gone", position=(0.0, 0.0)),
    Move(time=0, body="fixed", position=(0.0, 9.0), velocity=(1.0, 0.0)),
    Move(time=0, body="a", position=(0.0, -1001.0)),
    Move(time=0, body="a", position=(1e16, 1.0)),
    Move(time=0, body="fixed", position=(0.0, -1001.0)),
    Remove(time=0, body="zzz"),
    Remove(time=0, body="gone"),
    Remove(time=0, body="floor"),
    spawned("a", 5.0, 5.0),
    spawned("gone", 5.0, 5.0),
    spawned("floor", 5.0, 5.0),
    spawned("new", 5.0, 5.0, material="zzz"),
    spawned("new", 5.0, -1001.0),
    spawned("new", 1e16, 1.0),
    spawned("new", 5.0, 5.0, mass=1.0, density=1.0),
    spawned("new", 5.0, 5.0, fixed=True, velocity=(1.0, 0.0)),
    spawned("new", 999.0, 5.0),
    Spawn(time=0, ball=Ball(position=(5.0, 5.0), radius=1e9, density=1e30)),
    SetParameter(time=0, path="world.gravity", value=[0.0]),
    SetParameter(time=0, path="world.linear_drag", value=-1.0),
    SetParameter(time=0, path="world.duration", value=1.0),
    SetParameter(time=0, path="solver.dt", value=0.5),
    SetParameter(time=0, path="ball.new.friction", value=0.5),
]


@pytest.mark.parametrize("action", HOSTILE, ids=lambda action: action.kind)
def test_action_that_cannot_be_done_says_why_and_changes_nothing(action: Action) -> None:
    def between() -> Simulation:
        simulation = started(
            ball("a", 0, 1),
            ball("fixed", 4, 1, fixed=True),
            ball("gone", -4, 1),
            ball("flying", 0, 9, collides="none"),
            world={"gravity": [0, -9.81], "bounds": [[-99, -99], [99, 99]]},
            plane=[FLOOR],
            steps=3,
        )
        simulation.apply(Remove(time=0, body="gone"))
        return simulation

    simulation, untouched = between(), between()
    before, known = simulation.state_hash(), len(simulation.bodies)
    with pytest.raises(ActionError, match=r"\S"):
        simulation.apply(action)
    assert simulation.state_hash() == before
    assert len(simulation.bodies) == known
    assert stepped(simulation, 10).state_hash() == stepped(untouched, 10).state_hash()


@pytest.mark.parametrize("thing", [None, "remove", 3, {"kind": "remove", "body": "a"}])
def test_what_is_no_action_is_refused(thing: Any) -> None:
    simulation = started(ball("a", 0, 0))
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="is not an action"):
        simulation.apply(thing)
    assert simulation.state_hash() == before


def test_body_that_left_the_bounds_is_no_longer_there() -> None:
    simulation = started(ball("a", 0, 0, velocity=[200, 0]), world={"bounds": [[-1, -1], [1, 1]]}, steps=1)
    assert dict(simulation.retired) == {0: 0.01}
    for action in (Remove(time=0, body="a"), Force(time=0, body="a", force=(1.0, 0.0))):
        with pytest.raises(ActionError, match="removed"):
            simulation.apply(action)


@pytest.mark.parametrize("others", [[], [ball("b", 9, 0)]], ids=["in flight", "in the space"])
def test_impulses_add_up_and_show_at_once(others: list[dict[str, Any]]) -> None:
    simulation = started(ball("a", 0, 0, mass=2, velocity=[1, 0], angular_velocity=1), *others, steps=2)
    moment = 0.5 * 2 * 1**2
    for k in range(1, 4):
        simulation.apply(Impulse(time=0, body="a", impulse=(2.0, -1.0), angular=3.0))
        assert simulation.frame().velocity[0].tolist() == [1 + k, -0.5 * k]
        assert simulation.frame().angular_velocity[0] == 1 + k * 3 / moment
    before = simulation.frame()
    simulation.step()
    assert np.array_equal(simulation.frame().velocity, before.velocity)
    assert simulation.frame().position[0].tolist() == (before.position[0] + before.velocity[0] * 0.01).tolist()
    assert simulation.frame().angle[0] == before.angle[0] + before.angular_velocity[0] * 0.01


@pytest.mark.parametrize("others", [[], [ball("b", 0, 90)]], ids=["in flight", "in the space"])
def test_steady_force_and_torque_act_until_they_are_ended(others: list[dict[str, Any]]) -> None:
    """Nothing rubs in this scene, so that pymunk is given no moment, until the torque asks for one."""
    simulation = started(ball("a", 0, 0, mass=2), *others)
    simulation.apply(Force(time=0, body="a", force=(4.0, -2.0), torque=3.0))
    stepped(simulation, 100)
    frame = simulation.frame()
    assert frame.velocity[0] == pytest.approx([2.0, -1.0], rel=1e-13)  # 100 sums
    assert frame.angular_velocity[0] == pytest.approx(3.0 / (0.5 * 2 * 1**2), rel=1e-13)  # as above
    simulation.apply(Force(time=0, body="a", force=(0.0, 0.0)))
    stepped(simulation, 10)
    assert np.array_equal(simulation.frame().velocity, frame.velocity)
    assert np.array_equal(simulation.frame().angular_velocity, frame.angular_velocity)


def test_force_and_torque_go_on_when_a_body_joins_the_space() -> None:
    simulation, alone = started(ball("a", 0, 0)), started(ball("a", 0, 0))
    for each in (simulation, alone):
        each.apply(Force(time=0, body="a", force=(1.0, 2.0), torque=3.0))
        stepped(each, 5)
    simulation.apply(spawned("b", 90.0, 0.0))
    assert same(stepped(simulation, 20).frame(), stepped(alone, 20).frame(), slice(1))
    simulation.apply(Force(time=0, body="a", force=(0.0, 0.0)))
    before = simulation.frame()
    assert np.array_equal(stepped(simulation, 3).frame().angular_velocity, before.angular_velocity)


def test_moved_body_is_there_at_once_and_goes_on_from_there() -> None:
    for others in ([], [ball("b", 0, 90)]):
        simulation = started(ball("a", 0, 0, velocity=[1, 0]), *others, steps=3)
        simulation.apply(Move(time=0, body="a", position=(5.0, 7.0)))
        assert simulation.frame().position[0].tolist() == [5.0, 7.0]
        assert simulation.frame().velocity[0].tolist() == [1.0, 0.0]
        simulation.apply(Move(time=0, body="a", position=(5.0, 7.0), velocity=(0.0, 2.0)))
        assert simulation.frame().velocity[0].tolist() == [0.0, 2.0]
        assert stepped(simulation, 1).frame().position[0].tolist() == [5.0, 7.0 + 2.0 * 0.01]


def test_body_moved_into_a_wall_is_pushed_out_and_stays_bounded() -> None:
    wall = {"points": [[-9, 0], [9, 0]], "thickness": 0.5}
    simulation = started(ball("a", 0, 9), wall=[wall], world={"gravity": [0, -9.81]}, steps=2)
    simulation.apply(Move(time=0, body="a", position=(0.0, 0.25)))
    frame = stepped(simulation, 300).frame()
    assert frame.position[0, 1] == pytest.approx(1.25, abs=0.02)  # the slop: 0.01 of the radius, and some
    assert np.abs(frame.velocity).max() < 0.01  # at rest: less than a tenth of a step's g·h


def test_fixed_ball_that_is_moved_is_met_where_it_is_now() -> None:
    scene = (ball("wall", 50, 0, fixed=True), ball("a", 0, 0, velocity=[10, 0], restitution=1))
    simulation = started(*scene, steps=2)
    simulation.apply(Move(time=0, body="wall", position=(4.0, 0.0)))
    frame = stepped(simulation, 50).frame()
    assert frame.position[0].tolist() == [4.0, 0.0]
    assert frame.velocity[1].tolist() == [-10.0, 0.0]


def test_fixed_ball_that_meets_nothing_can_be_moved_and_removed() -> None:
    simulation = started(ball("a", 0, 0, fixed=True), steps=1)
    simulation.apply(Move(time=0, body="a", position=(1.0, 2.0)))
    assert simulation.frame().position[0].tolist() == [1.0, 2.0]
    simulation.apply(Remove(time=0, body="a"))
    assert not stepped(simulation, 1).frame().present[0]


def test_fixed_ball_that_met_nothing_is_met_by_one_that_is_spawned() -> None:
    simulation = started(ball("a", 0, 0, fixed=True), steps=1)
    simulation.apply(Move(time=0, body="a", position=(1.0, 0.0)))
    simulation.apply(spawned("b", -3.0, 0.0, velocity=(10.0, 0.0), restitution=1.0))
    frame = stepped(simulation, 100).frame()
    assert frame.position[0].tolist() == [1.0, 0.0]
    assert frame.velocity[1].tolist() == [-10.0, 0.0]


def test_removed_body_keeps_number_and_place_and_is_met_no_more() -> None:
    simulation = started(ball("a", 0, 0), ball("b", 5, 0, velocity=[-10, 0], restitution=1))
    simulation.apply(Remove(time=0, body="a"))
    frame = stepped(simulation, 100).frame()
    assert frame.present.tolist() == [False, True]
    assert frame.position[0].tolist() == [0.0, 0.0]
    assert frame.velocity.tolist() == [[0.0, 0.0], [-10.0, 0.0]]
    assert dict(simulation.retired) == {0: 0.0}


def test_contacts_end_with_the_last_body_that_touches() -> None:
    simulation = started(ball("a", 0, 0.99), plane=[FLOOR], world={"gravity": [0, -9.81]})
    simulation.contacts()
    assert len(stepped(simulation, 5).contacts()) == 1
    simulation.apply(Remove(time=0, body="a"))
    assert len(stepped(simulation, 1).contacts()) == 1  # it was open since the last call
    assert len(stepped(simulation, 1).contacts()) == 0


AIR = {"gravity": [0.3, -9.81], "linear_drag": 0.1, "quadratic_drag": 0.02, "wind": [2, 1]}


@pytest.mark.parametrize("world", [{}, {"gravity": [0, -9.81]}, AIR], ids=["nothing", "gravity", "air"])
@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_spawned_collider_changes_no_flight_that_does_not_meet_it(world: dict[str, Any], collides: str) -> None:
    """Particles that can now meet something join the space, and fly on as before to the last bit."""
    burst = {
        "position": [0, 0],
        "count": 40,
        "velocity_min": [-9, 5],
        "velocity_max": [9, 30],
        "radius": 0.05,
        "angular_velocity": 3,
        "collides": collides,
    }
    document = {"world": {"seed": 7, **world}, "emitter": [{"name": "e", **burst}]}
    simulation, alone = (start(from_document(document)) for _ in range(2))
    for each in (simulation, alone):
        each.apply(Force(time=0, body="e-3", force=(0.1, 0.2), torque=0.001))
        stepped(each, 7)
    simulation.apply(spawned("post", 0.0, -900.0, fixed=True))
    for _ in range(30):
        assert same(stepped(simulation, 1).frame(), stepped(alone, 1).frame(), slice(40))


def test_spawned_collider_is_met_by_what_flew_before() -> None:
    simulation = started(ball("a", 0, 0, velocity=[10, 0], restitution=1), steps=3)
    simulation.apply(spawned(None, 5.0, 0.0))
    frame = stepped(simulation, 100).frame()
    # Equal masses exchange velocities; some ten roundings of the iterations.
    assert frame.velocity[:, 0] == pytest.approx([0.0, 10.0], abs=1e-13)
    assert simulation.bodies.names == ("a", "spawned-2")


def test_gravity_set_on_the_way_takes_effect_from_the_next_step() -> None:
    for half_kick in (False, True):
        for others in ([], [ball("b", 0, 900)]):
            simulation = started(
                ball("a", 0, 0), *others, world={"gravity": [0, -10]}, solver={"half_kick": half_kick}, steps=50
            )
            simulation.apply(SetParameter(time=0, path="world.gravity", value=[6.0, 0.0]))
            assert simulation.frame().velocity[0] == pytest.approx([0.0, -5.0], rel=1e-13)  # 50 sums
            frame = stepped(simulation, 50).frame()
            assert frame.velocity[0] == pytest.approx([3.0, -5.0], rel=1e-13)  # as above
            if half_kick:
                # x = ½·6·0.5², y = −½·10·0.5² − 5·0.5, exact but for 100 sums.
                assert frame.position[0] == pytest.approx([0.75, -3.75], rel=1e-13)


def test_drag_cannot_come_up_where_positions_were_to_be_exact() -> None:
    simulation = started(ball("a", 0, 0), solver={"half_kick": True})
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="half_kick"):
        simulation.apply(SetParameter(time=0, path="world.quadratic_drag", value=0.1))
    assert simulation.state_hash() == before


def test_friction_set_on_the_way_turns_what_nothing_could_turn() -> None:
    floor = {**FLOOR, "friction": 0.0}
    simulation = started(
        ball("a", 0, 1, velocity=[3, 0], friction=0.0), plane=[floor], world={"gravity": [0, -9.81]}, steps=50
    )
    assert simulation.frame().angular_velocity[0] == 0.0
    simulation.apply(SetParameter(time=0, path="plane.floor.friction", value=0.9))
    simulation.apply(SetParameter(time=0, path="ball.a.friction", value=0.9))
    frame = stepped(simulation, 300).frame()
    # A sliding disc comes to roll at two thirds of its speed; slip ends within a step's μ·g·h·3.
    assert frame.velocity[0, 0] == pytest.approx(2.0, abs=0.3 * 0.81 * 9.81 * 0.01)
    assert frame.angular_velocity[0] == pytest.approx(-frame.velocity[0, 0], abs=1e-6)  # rolling; the solver's residue


def test_half_kick_is_kept_through_spawns_moves_and_impulses() -> None:
    """Velocities are reported as asked for, and positions stay exact: y = v₀·t − ½g·t²."""
    simulation = started(ball("a", 0, 0), world={"gravity": [0, -10]}, solver={"half_kick": True}, steps=20)
    simulation.apply(Move(time=0, body="a", position=(0.0, 0.0), velocity=(0.0, 3.0)))
    simulation.apply(spawned("b", 0.0, 50.0, velocity=(0.0, 1.0)))
    simulation.apply(Impulse(time=0, body="b", impulse=(0.0, math.pi)))
    assert simulation.frame().velocity[:, 1] == pytest.approx([3.0, 1 + math.pi], rel=1e-14)  # ± half a kick
    y = stepped(simulation, 30).frame().position[:, 1]
    t = 0.3
    expected = [3.0 * t - 5 * t**2, 50 + (1 + math.pi) * t - 5 * t**2]
    assert y == pytest.approx(expected, rel=1e-13)  # 30 sums
