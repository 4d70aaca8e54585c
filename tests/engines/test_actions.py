"""Actions on a running simulation: each takes effect at once, or is refused with a reason and changes nothing."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.contract import Simulation
from sandbox.engines.registry import ENGINES, start
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Frame
from tests.engines.stepping import advance

FLOOR = {"name": "floor", "point": [0, 0], "normal": [0, 1]}


each_engine = pytest.mark.parametrize("engine", ["pymunk", "reference"])


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 1, **more}


def simulation_of(*balls: dict[str, Any], steps: int = 0, engine: str = "pymunk", **document: Any) -> Simulation:
    """Return a simulation of some balls after some steps."""
    return advance(start(from_document({"ball": list(balls), **document}), engine), steps)


def spawn_ball(name: str | None, x: float, y: float, **more: Any) -> Spawn:
    return Spawn(time=0, ball=Ball(name=name, position=(x, y), radius=1.0, **more))


def same_rows(a: Frame, b: Frame, rows: slice) -> bool:
    pairs = ((a.position, b.position), (a.velocity, b.velocity), (a.angle, b.angle))
    spins = (a.angular_velocity, b.angular_velocity)
    return all(np.array_equal(one[rows], other[rows]) for one, other in (*pairs, spins))


INVALID_ACTIONS: list[Action] = [
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
    Move(time=0, body="fixed", position=(0.0, -1001.0)),
    Remove(time=0, body="zzz"),
    Remove(time=0, body="gone"),
    Remove(time=0, body="floor"),
    spawn_ball("a", 5.0, 5.0),
    spawn_ball("gone", 5.0, 5.0),
    spawn_ball("floor", 5.0, 5.0),
    spawn_ball("new", 5.0, 5.0, material="zzz"),
    spawn_ball("new", 5.0, -1001.0),
    spawn_ball("new", 1e16, 1.0),
    spawn_ball("new", 5.0, 5.0, mass=1.0, density=1.0),
    spawn_ball("new", 5.0, 5.0, fixed=True, velocity=(1.0, 0.0)),
    spawn_ball("new", 999.0, 5.0),
    Spawn(time=0, ball=Ball(position=(5.0, 5.0), radius=1e9, density=1e30)),
    SetParameter(time=0, path="world.gravity", value=[0.0]),
    SetParameter(time=0, path="world.linear_drag", value=-1.0),
    SetParameter(time=0, path="world.duration", value=1.0),
    SetParameter(time=0, path="solver.dt", value=0.5),
    SetParameter(time=0, path="ball.new.friction", value=0.5),
]


@pytest.mark.parametrize(
    ("engine", "action"),
    [(engine, action) for engine in ("pymunk", "reference") for action in INVALID_ACTIONS]
    + [("pymunk", Move(time=0, body="a", position=(1e16, 1.0)))],  # beyond the reach of its half-planes
)
def test_invalid_action_is_refused_and_changes_nothing(engine: str, action: Action) -> None:
    def running_simulation() -> Simulation:
        simulation = simulation_of(
            ball("a", 0, 1),
            ball("fixed", 4, 1, fixed=True),
            ball("gone", -4, 1),
            ball("flying", 0, 9, collides="none"),
            world={"gravity": [0, -9.81], "bounds": [[-99, -99], [99, 99]]},
            plane=[FLOOR],
            steps=3,
            engine=engine,
        )
        simulation.apply(Remove(time=0, body="gone"))
        return simulation

    simulation, untouched = running_simulation(), running_simulation()
    before, known = simulation.state_hash(), len(simulation.bodies)
    with pytest.raises(ActionError, match=r"\S"):
        simulation.apply(action)
    assert simulation.state_hash() == before
    assert len(simulation.bodies) == known
    assert advance(simulation, 10).state_hash() == advance(untouched, 10).state_hash()


@pytest.mark.parametrize("thing", [None, "remove", 3, {"kind": "remove", "body": "a"}])
def test_object_that_is_no_action_is_refused(thing: Any) -> None:
    simulation = simulation_of(ball("a", 0, 0))
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="is not an action"):
        simulation.apply(thing)
    assert simulation.state_hash() == before


@each_engine
def test_body_that_left_the_bounds_accepts_no_action(engine: str) -> None:
    bounds = {"bounds": [[-1, -1], [1, 1]]}
    simulation = simulation_of(ball("a", 0, 0, velocity=[200, 0]), world=bounds, steps=1, engine=engine)
    assert dict(simulation.retired) == {0: 0.01}
    for action in (Remove(time=0, body="a"), Force(time=0, body="a", force=(1.0, 0.0))):
        with pytest.raises(ActionError, match="removed"):
            simulation.apply(action)


@pytest.mark.parametrize("others", [[], [ball("b", 9, 0)]], ids=["in flight", "in the space"])
def test_impulses_add_up_and_take_effect_at_once(others: list[dict[str, Any]]) -> None:
    simulation = simulation_of(ball("a", 0, 0, mass=2, velocity=[1, 0], angular_velocity=1), *others, steps=2)
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
def test_constant_force_and_torque_act_until_reset(others: list[dict[str, Any]]) -> None:
    """Without friction the adapter gives pymunk no moment of inertia until a torque needs one."""
    simulation = simulation_of(ball("a", 0, 0, mass=2), *others)
    simulation.apply(Force(time=0, body="a", force=(4.0, -2.0), torque=3.0))
    advance(simulation, 100)
    frame = simulation.frame()
    assert frame.velocity[0] == pytest.approx([2.0, -1.0], rel=1e-13)  # 100 sums
    assert frame.angular_velocity[0] == pytest.approx(3.0 / (0.5 * 2 * 1**2), rel=1e-13)  # as above
    simulation.apply(Force(time=0, body="a", force=(0.0, 0.0)))
    advance(simulation, 10)
    assert np.array_equal(simulation.frame().velocity, frame.velocity)
    assert np.array_equal(simulation.frame().angular_velocity, frame.angular_velocity)


def test_force_and_torque_persist_when_a_body_joins_the_space() -> None:
    simulation, undisturbed = simulation_of(ball("a", 0, 0)), simulation_of(ball("a", 0, 0))
    for each in (simulation, undisturbed):
        each.apply(Force(time=0, body="a", force=(1.0, 2.0), torque=3.0))
        advance(each, 5)
    simulation.apply(spawn_ball("b", 90.0, 0.0))
    assert same_rows(advance(simulation, 20).frame(), advance(undisturbed, 20).frame(), slice(1))
    simulation.apply(Force(time=0, body="a", force=(0.0, 0.0)))
    before = simulation.frame()
    assert np.array_equal(advance(simulation, 3).frame().angular_velocity, before.angular_velocity)


def test_moved_body_continues_from_its_new_position() -> None:
    for others in ([], [ball("b", 0, 90)]):
        simulation = simulation_of(ball("a", 0, 0, velocity=[1, 0]), *others, steps=3)
        simulation.apply(Move(time=0, body="a", position=(5.0, 7.0)))
        assert simulation.frame().position[0].tolist() == [5.0, 7.0]
        assert simulation.frame().velocity[0].tolist() == [1.0, 0.0]
        simulation.apply(Move(time=0, body="a", position=(5.0, 7.0), velocity=(0.0, 2.0)))
        assert simulation.frame().velocity[0].tolist() == [0.0, 2.0]
        assert advance(simulation, 1).frame().position[0].tolist() == [5.0, 7.0 + 2.0 * 0.01]


@pytest.mark.parametrize("engine", ["pymunk", "reference", "box2d"])
def test_body_that_is_turned_touches_by_its_new_shape(engine: str) -> None:
    """A plank that is set upright stands with its centre at half its length; a fixed one that is turned is a ramp."""
    box = {"name": "plank", "position": [0.0, 0.5], "size": [4.0, 1.0]}
    ramp = {"name": "ramp", "position": [10.0, 0.0], "size": [4.0, 0.2], "fixed": True}
    document = {"box": [box, ramp], "plane": [FLOOR], "world": {"gravity": [0, -9.81]}}
    simulation = advance(start(from_document({**document, "ball": [ball("a", 10.0, 5.0)]}), engine), 3)
    simulation.apply(Move(time=0, body="plank", position=(0.0, 2.0), angle=math.pi / 2, angular_velocity=0.0))
    simulation.apply(Move(time=0, body="ramp", position=(10.0, 1.0), angle=0.5))
    rows = [simulation.bodies.names.index(name) for name in ("plank", "ramp", "a")]
    assert simulation.frame().angle[rows[:2]] == pytest.approx([math.pi / 2, 0.5], abs=1e-6)  # box2d has 32 bits
    frame = advance(simulation, 100).frame()
    assert frame.position[rows[0]] == pytest.approx([0.0, 2.0], abs=0.02)  # the slop is 0.01 of the half width
    assert frame.angle[rows[:2]] == pytest.approx([math.pi / 2, 0.5], abs=1e-3)
    assert frame.velocity[rows[2], 0] < -1.0  # down the ramp, which falls to the left


@pytest.mark.parametrize("engine", ENGINES)
def test_angle_of_a_free_body_is_set(engine: str) -> None:
    simulation = advance(start(from_document({"ball": [ball("a", 0, 0, angular_velocity=2.0)]}), engine), 3)
    simulation.apply(Move(time=0, body="a", position=(1.0, 0.0), angle=-40.0))
    assert simulation.frame().angle[0] == pytest.approx(-40.0, rel=1e-6)  # box2d has 32 bits
    assert advance(simulation, 5).frame().angle[0] == pytest.approx(-40.0 + 0.05 * 2.0, rel=1e-5)


def test_body_moved_into_a_wall_is_pushed_out_and_stays_bounded() -> None:
    wall = {"points": [[-9, 0], [9, 0]], "thickness": 0.5}
    simulation = simulation_of(ball("a", 0, 9), wall=[wall], world={"gravity": [0, -9.81]}, steps=2)
    simulation.apply(Move(time=0, body="a", position=(0.0, 0.25)))
    frame = advance(simulation, 300).frame()
    assert frame.position[0, 1] == pytest.approx(1.25, abs=0.02)  # the slop is 0.01 of the radius
    assert np.abs(frame.velocity).max() < 0.01  # at rest: less than a tenth of a step's g·h


def test_moved_fixed_ball_collides_at_its_new_position() -> None:
    scene = (ball("wall", 50, 0, fixed=True), ball("a", 0, 0, velocity=[10, 0], restitution=1))
    simulation = simulation_of(*scene, steps=2)
    simulation.apply(Move(time=0, body="wall", position=(4.0, 0.0)))
    frame = advance(simulation, 50).frame()
    assert frame.position[0].tolist() == [4.0, 0.0]
    assert frame.velocity[1].tolist() == [-10.0, 0.0]


def test_single_fixed_ball_can_be_moved_and_removed() -> None:
    simulation = simulation_of(ball("a", 0, 0, fixed=True), steps=1)
    simulation.apply(Move(time=0, body="a", position=(1.0, 2.0)))
    assert simulation.frame().position[0].tolist() == [1.0, 2.0]
    simulation.apply(Remove(time=0, body="a"))
    assert not advance(simulation, 1).frame().present[0]


def test_single_fixed_ball_collides_with_a_spawned_ball() -> None:
    simulation = simulation_of(ball("a", 0, 0, fixed=True), steps=1)
    simulation.apply(Move(time=0, body="a", position=(1.0, 0.0)))
    simulation.apply(spawn_ball("b", -3.0, 0.0, velocity=(10.0, 0.0), restitution=1.0))
    frame = advance(simulation, 100).frame()
    assert frame.position[0].tolist() == [1.0, 0.0]
    assert frame.velocity[1].tolist() == [-10.0, 0.0]


@each_engine
def test_removed_body_keeps_index_and_position_and_no_longer_collides(engine: str) -> None:
    simulation = simulation_of(ball("a", 0, 0), ball("b", 5, 0, velocity=[-10, 0], restitution=1), engine=engine)
    simulation.apply(Remove(time=0, body="a"))
    frame = advance(simulation, 100).frame()
    assert frame.present.tolist() == [False, True]
    assert frame.position[0].tolist() == [0.0, 0.0]
    assert frame.velocity.tolist() == [[0.0, 0.0], [-10.0, 0.0]]
    assert dict(simulation.retired) == {0: 0.0}


def test_contacts_end_when_the_touching_body_is_removed() -> None:
    simulation = simulation_of(ball("a", 0, 0.99), plane=[FLOOR], world={"gravity": [0, -9.81]})
    simulation.contacts()
    assert len(advance(simulation, 5).contacts()) == 1
    simulation.apply(Remove(time=0, body="a"))
    assert len(advance(simulation, 1).contacts()) == 1  # it was active since the last call
    assert len(advance(simulation, 1).contacts()) == 0


AIR = {"gravity": [0.3, -9.81], "linear_drag": 0.1, "quadratic_drag": 0.02, "wind": [2, 1]}


@pytest.mark.parametrize("world", [{}, {"gravity": [0, -9.81]}, AIR], ids=["nothing", "gravity", "air"])
@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_spawned_collider_does_not_change_flights_that_miss_it(world: dict[str, Any], collides: str) -> None:
    """Particles that can now collide join the space; their flight stays bit-identical."""
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
    simulation, undisturbed = (start(from_document(document)) for _ in range(2))
    for each in (simulation, undisturbed):
        each.apply(Force(time=0, body="e-3", force=(0.1, 0.2), torque=0.001))
        advance(each, 7)
    simulation.apply(spawn_ball("post", 0.0, -900.0, fixed=True))
    for _ in range(30):
        assert same_rows(advance(simulation, 1).frame(), advance(undisturbed, 1).frame(), slice(40))


@each_engine
def test_spawned_collider_is_hit_by_a_flying_ball(engine: str) -> None:
    simulation = simulation_of(ball("a", 0, 0, velocity=[10, 0], restitution=1), steps=3, engine=engine)
    simulation.apply(spawn_ball(None, 5.0, 0.0))
    frame = advance(simulation, 100).frame()
    # Equal masses exchange velocities; some ten roundings of the iterations.
    assert frame.velocity[:, 0] == pytest.approx([0.0, 10.0], abs=1e-13)
    assert simulation.bodies.names == ("a", "spawned-2")


def test_gravity_set_during_the_run_takes_effect_from_the_next_step() -> None:
    for half_kick in (False, True):
        for others in ([], [ball("b", 0, 900)]):
            simulation = simulation_of(
                ball("a", 0, 0), *others, world={"gravity": [0, -10]}, solver={"half_kick": half_kick}, steps=50
            )
            simulation.apply(SetParameter(time=0, path="world.gravity", value=[6.0, 0.0]))
            assert simulation.frame().velocity[0] == pytest.approx([0.0, -5.0], rel=1e-13)  # 50 sums
            frame = advance(simulation, 50).frame()
            assert frame.velocity[0] == pytest.approx([3.0, -5.0], rel=1e-13)  # as above
            if half_kick:
                # x = ½·6·0.5², y = −½·10·0.5² − 5·0.5, exact but for 100 sums.
                assert frame.position[0] == pytest.approx([0.75, -3.75], rel=1e-13)


def test_drag_is_refused_during_a_half_kick_run() -> None:
    simulation = simulation_of(ball("a", 0, 0), solver={"half_kick": True})
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="half_kick"):
        simulation.apply(SetParameter(time=0, path="world.quadratic_drag", value=0.1))
    assert simulation.state_hash() == before


def test_friction_set_during_the_run_turns_a_sliding_ball() -> None:
    floor = {**FLOOR, "friction": 0.0}
    simulation = simulation_of(
        ball("a", 0, 1, velocity=[3, 0], friction=0.0), plane=[floor], world={"gravity": [0, -9.81]}, steps=50
    )
    assert simulation.frame().angular_velocity[0] == 0.0
    simulation.apply(SetParameter(time=0, path="plane.floor.friction", value=0.9))
    simulation.apply(SetParameter(time=0, path="ball.a.friction", value=0.9))
    frame = advance(simulation, 300).frame()
    # A sliding disc comes to roll at two thirds of its speed; slip ends within a step's μ·g·h·3.
    assert frame.velocity[0, 0] == pytest.approx(2.0, abs=0.3 * 0.81 * 9.81 * 0.01)
    assert frame.angular_velocity[0] == pytest.approx(-frame.velocity[0, 0], abs=1e-6)  # rolling; residue of the solver


def test_half_kick_is_preserved_through_spawns_moves_and_impulses() -> None:
    """Velocities are reported as set, and positions stay exact: y = v₀·t − ½g·t²."""
    simulation = simulation_of(ball("a", 0, 0), world={"gravity": [0, -10]}, solver={"half_kick": True}, steps=20)
    simulation.apply(Move(time=0, body="a", position=(0.0, 0.0), velocity=(0.0, 3.0)))
    simulation.apply(spawn_ball("b", 0.0, 50.0, velocity=(0.0, 1.0)))
    simulation.apply(Impulse(time=0, body="b", impulse=(0.0, math.pi)))
    assert simulation.frame().velocity[:, 1] == pytest.approx([3.0, 1 + math.pi], rel=1e-14)  # ± half a kick
    y = advance(simulation, 30).frame().position[:, 1]
    t = 0.3
    expected = [3.0 * t - 5 * t**2, 50 + (1 + math.pi) * t - 5 * t**2]
    assert y == pytest.approx(expected, rel=1e-13)  # 30 sums
