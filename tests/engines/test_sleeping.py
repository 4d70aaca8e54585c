"""Sleeping bodies on pymunk: they stop, wake, stay in their rows, and cost no energy."""

import json
from functools import partial
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import Force, Move, SetParameter, Spawn
from sandbox.engines.pymunk_adapter.simulation import PymunkSimulation
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import accounts

pytestmark = pytest.mark.fail_slow(60)  # long runs

# Rounding of sums of energies up to 1e3 times the kinetic energy.
closed_account = partial(accounts.closed_account, engine="pymunk", closes=1e-11)

FLOOR = {"point": [0, 0], "normal": [0, 1], "friction": 0.6}
G, DT = 10.0, 0.01


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.1, "mass": 1.0, "friction": 1.0, **more}


def scene_of(solver: dict[str, Any] | None = None, **tables: Any) -> Scene:
    world = {"gravity": [0.0, -G], "duration": 4.0, **tables.pop("world", {})}
    return from_document(
        {"world": world, "solver": {"dt": DT, "sleeping": True, **(solver or {})}, "plane": [FLOOR], **tables}
    )


def tower() -> Scene:
    """Return a scene of two piles of boxes at rest; a ball falls onto one of them after they have fallen asleep."""
    boxes = [
        {"name": f"{side}-{row}", "position": [x, 0.25 + 0.5 * row], "size": [0.5, 0.5], "friction": 0.8}
        for side, x in (("left", -2.0), ("right", 2.0))
        for row in range(3)
    ]
    return scene_of(box=boxes, ball=[ball("late", 2.0, 12.0)])


def started(scene: Scene) -> PymunkSimulation:
    simulation = start(scene, "pymunk")
    assert isinstance(simulation, PymunkSimulation)
    return simulation


def asleep(simulation: PymunkSimulation) -> set[str]:
    """Return the names of the bodies that are asleep."""
    rows = simulation._store.space_bodies.asleep
    assert rows is not None
    return {simulation.bodies.names[n] for n in np.flatnonzero(rows).tolist()}


def advance(simulation: PymunkSimulation, time: float) -> None:
    for _ in range(round(time / DT)):
        simulation.step()


@pytest.mark.parametrize(("idle_speed", "falls_asleep"), [(0.0, False), (0.29, False), (0.31, True)])
def test_idle_speed_is_the_speed_below_which_bodies_fall_asleep(idle_speed: float, falls_asleep: bool) -> None:
    """Without gravity bodies need an `idle_speed`; the kinetic energy of a disc that does not turn is m v²/2."""
    solver = {"sleep_time": 0.2, "idle_speed": idle_speed}
    scene = scene_of(solver, world={"gravity": [0.0, 0.0]}, ball=[ball("a", 0.0, 5.0, velocity=[0.3, 0.0])])
    simulation = started(scene)
    advance(simulation, 1.0)
    assert asleep(simulation) == ({"a"} if falls_asleep else set())


def test_a_body_that_hits_a_pile_wakes_it_and_no_other() -> None:
    simulation, names = started(tower()), {f"{side}-{row}" for side in ("left", "right") for row in range(3)}
    advance(simulation, 1.0)
    assert asleep(simulation) == names  # the ball still falls
    before = simulation.frame().position
    while "right-0" in asleep(simulation):
        simulation.step()
    assert simulation.time == pytest.approx(np.sqrt(2.0 * (12.0 - 1.6) / G), abs=2 * DT)
    assert asleep(simulation) == {"left-0", "left-1", "left-2"}
    moved = np.abs(simulation.frame().position - before).max(axis=1)
    left = [simulation.bodies.names.index(f"left-{row}") for row in range(3)]
    assert (moved[left] == 0.0).all()


def test_batches_of_steps_give_the_same_states_and_contacts() -> None:
    """`run` makes many steps at once; bodies that fall asleep change the order in which pymunk lists them."""
    scene = tower()
    whole = sandbox.run(scene, "pymunk")
    simulation, frames = started(scene), []
    simulation.contacts()
    for _ in range(len(whole.time) - 1):
        simulation.step()
        frames.append(simulation.frame())
    assert (np.asarray([frame.position for frame in frames]) == whole.position[1:]).all()
    assert (np.asarray([frame.velocity for frame in frames]) == whole.velocity[1:]).all()
    contacts = simulation.contacts()
    assert (contacts.time == whole.contact_time).all()
    assert (contacts.impulse == whole.contact_impulse).all()


def test_states_are_those_of_a_run_without_sleep_until_the_first_falls_asleep() -> None:
    scene = tower()
    asleep_run, awake = (sandbox.run(scene, "pymunk", sleeping=flag) for flag in (True, False))
    equal = (asleep_run.position == awake.position).all(axis=(1, 2))
    assert asleep_run.time[~equal][0] >= 0.5
    # boxes that are at rest creep by less than 1 mm
    left = slice(0, 3)
    names = asleep_run.names.tolist()
    rows = [names.index(f"left-{row}") for row in range(3)][left]
    assert asleep_run.position[-1, rows] == pytest.approx(awake.position[-1, rows], abs=1e-3)


def test_account_of_bodies_that_fall_asleep_and_wake_closes() -> None:
    closed_account(tower(), 400)


def test_account_of_joined_bodies_that_fall_asleep_and_wake_closes() -> None:
    """A chain of discs, a spring and a motor fall asleep on the floor, and are hit."""
    discs = [ball(f"d{k}", 0.25 * k - 1.0, 0.1) for k in range(6)]
    joints = [{"kind": "rod", "between": [f"d{k}", f"d{k + 1}"], "length": 0.25} for k in range(3)]
    joints += [
        {"kind": "spring", "between": ["d3", "d4"], "rest_length": 0.25, "stiffness": 300.0, "damping": 2.0},
        {"kind": "motor", "between": ["d4", "d5"], "rate": 0.5, "max_torque": 1e-3},
    ]
    scene = scene_of({"idle_speed": 0.15}, ball=[*discs, ball("late", -0.6, 6.0)], joint=joints)
    simulation = started(scene)
    advance(simulation, 1.0)
    assert "d0" in asleep(simulation)
    advance(simulation, 0.5)
    assert "d0" not in asleep(simulation)
    closed_account(scene, 300)


def test_actions_wake_the_body_that_they_change_and_no_other() -> None:
    simulation = started(scene_of(ball=[ball("a", -1.0, 0.1), ball("b", 1.0, 0.1), ball("c", -2.0, 0.1)]))
    advance(simulation, 1.0)
    assert asleep(simulation) == {"a", "b", "c"}
    simulation.apply(Spawn.model_validate_json(json.dumps({"time": 0.0, "ball": ball("d", -5.0, 3.0)})))
    assert asleep(simulation) == {"a", "b", "c"}
    simulation.apply(Move(time=0.0, body="a", position=(-1.0, 1.0)))
    assert asleep(simulation) == {"b", "c"}
    simulation.apply(Force(time=0.0, body="b", force=(5.0, 0.0)))
    advance(simulation, 1.5)
    assert asleep(simulation) == {"a", "c", "d"}
    assert simulation.frame().velocity[1, 0] > 1.0
    simulation.apply(Move(time=0.0, body="a", position=(-1.0, 0.11)))
    assert asleep(simulation) == {"c", "d"}


def test_a_change_of_gravity_wakes() -> None:
    simulation = started(scene_of(ball=[ball("a", 0.0, 0.1)]))
    advance(simulation, 1.0)
    assert asleep(simulation) == {"a"}
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, 10.0]))
    advance(simulation, 0.5)
    assert simulation.frame().velocity[0, 1] == pytest.approx(5.0, abs=2 * G * DT)  # less the first, downward, step


@pytest.mark.parametrize(
    ("tables", "part"),
    [
        ({"solver": {"half_kick": True}}, "half_kick"),
        ({"world": {"linear_drag": 0.1}}, "drag"),
        ({"attraction": [{"toward": [0, 0], "strength": 1.0}]}, "attraction"),
        ({"thrust": [{"body": "a", "force": [1.0, 0.0]}]}, "thrusts"),
        ({"zone": [{"position": [0.0, 2.5], "radius": 2.0}]}, "zones"),
        ({"wall": [{"points": [[0, 1], [1, 1]], "one_way": True}]}, "one-way walls"),
        ({"joint": [{"kind": "rod", "between": ["a"], "length": 1.0, "strength": 5.0}]}, "joints that can break"),
    ],
)
def test_what_acts_on_bodies_in_each_step_is_refused(tables: dict[str, Any], part: str) -> None:
    result = sandbox.run(scene_of(**tables, ball=[ball("a", 0.0, 2.0)]), "pymunk")
    assert result.status == "refused"
    assert f"sleeping does not support {part}" in result.reason


@pytest.mark.parametrize("key", ["sleep_time", "idle_speed"])
def test_settings_of_sleep_need_sleep(key: str) -> None:
    result = sandbox.run(scene_of(ball=[ball("a", 0.0, 2.0)]), "pymunk", sleeping=None, **{key: 0.1})
    assert result.status == "refused"
    assert f"{key} applies to sleeping = true only" in result.reason


@pytest.mark.parametrize("engine", ["reference", "exact", "box2d"])
def test_other_engines_refuse_what_they_do_not_have(engine: str) -> None:
    result = sandbox.run(scene_of({"sleep_time": 0.3}, ball=[ball("a", 0.0, 2.0)]), engine)
    assert result.status == "refused"
    assert "sleep_time" in result.reason
