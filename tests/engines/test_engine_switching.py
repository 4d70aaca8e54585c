"""SwitchableSimulation: changes of engine, settings and bodies keep the continuity of the run."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Force, Impulse, Launch, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.registry import start as start_plain
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find, shipped
from sandbox.trajectory import Contacts, Frame
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

SCENES = {each.name: load(each.path) for each in shipped()}
SHORT = ("tutorial/bounce", "tutorial/fireworks", "benchmark/newtons_cradle", "benchmark/gas", "benchmark/incline")
RUNS = [(name, engine) for name in SHORT for engine in able(SCENES[name])]
ENGINE_PAIRS = [(a, b) for a in ENGINES for b in ENGINES if a != b]


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.25, "restitution": 0.5, **more}


def scene_of(*balls: dict[str, Any], **document: Any) -> Scene:
    floor = {"name": "floor", "point": [0, 0], "normal": [0, 1], "restitution": 1, "friction": 0.3}
    world = {"gravity": [0, -9.81], "bounds": [[-50, -50], [50, 50]]}
    return from_document({"plane": [floor], "world": world, "solver": {"dt": 0.01}, "ball": list(balls), **document})


def three_balls(**document: Any) -> Scene:
    """Return three balls in flight, with spin."""
    return scene_of(
        ball("a", -2, 3, velocity=[1, 0], angular_velocity=1.0),
        ball("b", 0, 4, angle=0.5, mass=3),
        ball("c", 2, 5, velocity=[-1, 2]),
        **document,
    )


def same_state(a: Frame, b: Frame) -> bool:
    """Return whether two frames have the same state, apart from their times."""
    columns = ("position", "velocity", "angle", "angular_velocity", "present")
    return all(np.array_equal(getattr(a, column), getattr(b, column)) for column in columns)


@pytest.mark.parametrize(("name", "engine"), RUNS)
def test_simulation_without_switches_is_bit_identical_to_the_plain_engine(name: str, engine: str) -> None:
    simulation, plain = start(SCENES[name], engine), start_plain(SCENES[name], engine)
    found: list[Contacts] = []
    for each in (simulation, plain):
        each.contacts()
    for _ in range(120):
        for each in (simulation, plain):
            each.step()
        assert simulation.state_hash() == plain.state_hash()
    found = [simulation.contacts(), plain.contacts()]
    for column in ("time", "pair", "point", "normal", "impulse"):
        assert np.array_equal(getattr(found[0], column), getattr(found[1], column), equal_nan=True)
    assert simulation.time == plain.time
    assert dict(simulation.work) == dict(plain.work)
    assert dict(simulation.retired) == dict(plain.retired)


@pytest.mark.parametrize("engine", ENGINES)
@given(parts=st.lists(st.tuples(st.integers(1, 12), st.sampled_from([0.01, 0.005, 0.02, 1 / 60])), max_size=5))
@settings(max_examples=15)
def test_free_flight_follows_the_closed_form_through_changes_of_the_step(
    engine: str, parts: list[tuple[int, float]]
) -> None:
    simulation = start(scene_of(ball("a", 0, 9, velocity=[2, 1], collides="none")), engine)
    elapsed, error, h = 0.0, 0.0, 0.01
    for steps, dt in parts:
        simulation.apply(Switch(time=0.0, settings={"dt": dt}))
        advance(simulation, steps)
        elapsed, h = elapsed + steps * dt, max(h, dt)
        error += steps * dt
    frame = simulation.frame()
    assert frame.time == pytest.approx(elapsed, rel=1e-12)  # a few sums
    rounding = 1e-4 if engine == "box2d" else 1e-11  # of up to 60 sums; 32-bit numbers
    assert frame.velocity[0] == pytest.approx([2.0, 1.0 - 9.81 * elapsed], abs=rounding)
    bound = 0.5 * 9.81 * h * error + rounding  # the error of explicit Euler is g·h·T/2; other schemes have less
    assert abs(frame.position[0, 1] - (9.0 + elapsed - 0.5 * 9.81 * elapsed**2)) <= bound
    assert frame.position[0, 0] == pytest.approx(2.0 * elapsed, abs=rounding)  # as above


@pytest.mark.parametrize(("first", "second"), ENGINE_PAIRS)
def test_indices_names_and_times_are_those_of_the_whole_run(first: str, second: str) -> None:
    """Over four segments a is removed, b leaves the bounds and d is spawned."""
    scene = scene_of(
        ball("a", -20, 30, collides="none"),
        ball("b", 49, 30, velocity=[15, 0], collides="none"),
        ball("c", 0, 0.25 + 0.1),
        ball("e", 5, 0.25 + 0.4),
    )
    simulation = start(scene, first)
    simulation.contacts()
    advance(simulation, 3).apply(Remove(time=0.0, body="a"))
    simulation.apply(Switch(time=0.0, engine=second))
    assert simulation.frame().present.tolist() == [False, True, True, True]
    advance(simulation, 7)  # b leaves at 0.07 s
    assert dict(simulation.retired) == {0: pytest.approx(0.03), 1: pytest.approx(0.07)}
    simulation.apply(Spawn(time=0.0, ball=Ball(name="d", position=(10.0, 0.35), radius=0.25, restitution=0.5)))
    simulation.apply(Switch(time=0.0, engine=first))
    simulation.apply(Switch(time=0.0, engine=second))
    assert simulation.bodies.names == ("a", "b", "c", "e", "d")
    before = simulation.frame()
    assert before.present.tolist() == [False, False, True, True, True]
    assert before.position[0].tolist() == pytest.approx([-20.0, 30.0], abs=0.05)  # 0.03 s of free fall
    assert not before.velocity[:2].any()
    advance(simulation, 50)
    assert simulation.frame().position[:2].tolist() == before.position[:2].tolist()
    assert dict(simulation.retired) == {0: pytest.approx(0.03), 1: pytest.approx(0.07)}
    contacts = simulation.contacts()
    assert set(map(tuple, contacts.pair.tolist())) == {(2, -1), (3, -1), (4, -1)}
    first_touch = {pair[0]: time for time, pair in zip(contacts.time[::-1], contacts.pair[::-1].tolist(), strict=True)}
    contact_times = {2: np.sqrt(2 * 0.1 / 9.81), 3: np.sqrt(2 * 0.4 / 9.81), 4: 0.1 + np.sqrt(2 * 0.1 / 9.81)}
    for index, time in contact_times.items():
        assert first_touch[index] == pytest.approx(time, abs=0.021)  # two steps: first-order errors of the engines
    with pytest.raises(ActionError, match="already"):
        simulation.apply(Spawn(time=0.0, ball=Ball(name="a", position=(20.0, 9.0), radius=0.1)))


def test_observer_gets_indices_and_times_of_the_whole_run() -> None:
    observed: list[tuple[float, int, list[bool], set[tuple[int, ...]]]] = []

    def observe(time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        assert start.shape == end.shape
        observed.append((time, len(end), np.isfinite(end[:, 0]).tolist(), set(map(tuple, touching.tolist()))))

    simulation = start(scene_of(ball("a", 0, 9), ball("b", 3, 0.249), ball("c", 6, 9)), "pymunk")
    simulation.watch(observe)
    advance(simulation, 2).apply(Remove(time=0.0, body="a"))
    simulation.apply(Switch(time=0.0, engine="reference"))
    simulation.step()
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(9.0, 9.0), radius=0.25)))
    simulation.apply(Switch(time=0.0, settings={"substeps": 2}))
    simulation.step()
    assert [time for time, *_ in observed] == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.035], abs=1e-15)  # sums
    assert [count for _, count, _, _ in observed] == [3, 3, 3, 4, 4]
    finite_rows = [finite for _, _, finite, _ in observed]
    assert finite_rows == [[True] * 3, [True] * 3, [False, True, True], *[[False, True, True, True]] * 2]
    assert all((1, -1) in touching for *_, touching in observed[:3])  # b rests on the floor from the start
    assert all(pair[0] in (1, 2) for *_, touching in observed for pair in touching)


INVALID_ACTIONS: Mapping[str, Action] = {
    "unknown engine": Switch(time=0.0, engine="zzz"),
    "no setting": Switch(time=0.0, settings={"zzz": 1}),
    "dt of zero": Switch(time=0.0, settings={"dt": 0.0}),
    "dt of text": Switch(time=0.0, settings={"dt": "fast"}),
    "not this engine's": Switch(time=0.0, engine="exact", settings={"response": "penalty"}),
    "no generator": Launch(time=0.0, generator="zzz", seed=1),
    "fixed": Pull(time=0.0, body="post", target=(0.0, 0.0)),
    "missing": Pull(time=0.0, body="zzz", target=(0.0, 0.0)),
    "gone": Pull(time=0.0, body="gone", target=(0.0, 0.0)),
    "name taken": Spawn(time=0.0, ball=Ball(name="a", position=(9.0, 9.0), radius=0.1)),
    "name of the floor": Spawn(time=0.0, ball=Ball(name="floor", position=(9.0, 9.0), radius=0.1)),
}


@pytest.mark.parametrize("engine", ["pymunk", "exact"])
@pytest.mark.parametrize("case", INVALID_ACTIONS)
def test_invalid_action_is_refused_and_changes_nothing(engine: str, case: str) -> None:
    def running_simulation() -> SwitchableSimulation:
        scene = scene_of(ball("a", 0, 2), ball("post", 5, 5, fixed=True), ball("gone", 9, 9))
        simulation = advance(start(scene, engine), 5)
        simulation.apply(Remove(time=0.0, body="gone"))
        return simulation

    simulation, untouched = running_simulation(), running_simulation()
    with pytest.raises(ActionError, match=r"\w"):
        simulation.apply(INVALID_ACTIONS[case])
    assert (simulation.engine, simulation.wanted, simulation.settings) == (
        untouched.engine,
        untouched.wanted,
        untouched.settings,
    )
    assert simulation.state_hash() == untouched.state_hash()
    assert advance(simulation, 30).state_hash() == advance(untouched, 30).state_hash()


def test_switch_to_exact_is_refused_with_an_overlap() -> None:
    simulation = advance(start(scene_of(ball("a", 0, 0.2)), "pymunk"), 1)
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="exact refuses"):
        simulation.apply(Switch(time=0.0, engine="exact"))
    assert (simulation.engine, simulation.state_hash()) == ("pymunk", before)


@pytest.mark.parametrize(("first", "second"), [("pymunk", "reference"), ("reference", "pymunk")])
def test_constant_force_continues_after_a_switch_and_ends_with_its_body(first: str, second: str) -> None:
    scene = make_scene(
        world={"bounds": [[-9, -9], [9, 9]]},
        ball=[ball("a", 0, 0, mass=2), ball("out", 8.99, 0, velocity=[9, 0], collides="none")],
    )
    simulation = start(scene, first)
    simulation.apply(Force(time=0.0, body="a", force=(4.0, -2.0)))
    simulation.apply(Force(time=0.0, body="out", force=(1.0, 0.0)))
    advance(simulation, 50).apply(Switch(time=0.0, engine=second))
    assert simulation.frame().present.tolist() == [True, False]
    advance(simulation, 50)
    assert simulation.frame().velocity[0] == pytest.approx([2.0, -1.0], rel=1e-12)  # a hundred sums
    point = simulation.checkpoint()
    assert set(point.forces) == {"a"}
    assert advance(SwitchableSimulation.resumed(point), 9).state_hash() == advance(simulation, 9).state_hash()


def test_generated_names_are_unique() -> None:
    simulation = start(scene_of(ball("spawned-2", 0, 9), ball("a", 2, 9)), "pymunk")
    for k in range(4):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(4.0 + k, 9.0), radius=0.1)))
        simulation.apply(Switch(time=0.0))
    simulation.apply(Remove(time=0.0, body=simulation.bodies.names[-1]))
    simulation.apply(Switch(time=0.0))
    simulation.apply(Spawn(time=0.0, ball=Ball(position=(9.0, 9.0), radius=0.1)))
    assert len(set(simulation.bodies.names)) == 7
    assert len(simulation.frame().position) == 7


def test_coefficients_set_after_a_switch_persist_through_the_next() -> None:
    simulation = start(scene_of(ball("a", 0, 0.5), ball("b", 3, 9)), "pymunk")
    simulation.apply(Remove(time=0.0, body="b"))
    simulation.apply(Switch(time=0.0, engine="reference"))
    simulation.apply(SetParameter(time=0.0, path="ball.a.restitution", value=0.0))
    simulation.apply(SetParameter(time=0.0, path="plane.floor.restitution", value=0.0))
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]))
    simulation.apply(Switch(time=0.0, engine="exact"))
    assert simulation.bodies.elements[0].restitution == 0.0
    advance(simulation, 200)
    assert simulation.frame().position[0].tolist() == pytest.approx([0.0, 0.25], abs=1e-12)  # no bounce
    assert simulation.scene.world.gravity == (0.0, -1.0)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_checkpoint_in_free_flight_resumes_bit_identically(engine: str) -> None:
    simulation = advance(start(three_balls(solver={"dt": 1 / 60}), engine), 7)
    simulation.apply(Pull(time=0.0, body="b", grip=(0.1, 0.0), target=(1.0, 5.0)))
    simulation.apply(Switch(time=0.0, settings={"dt": 0.003}))
    advance(simulation, 4)
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    for _ in range(25):
        assert resumed.state_hash() == simulation.state_hash()
        simulation.step()
        resumed.step()


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize(  # at 3000 m/s the adapter lengthens pymunk's half-planes during the run
    ("speed", "normal", "switched"), [(1.0, [0.1, 1.0], False), (3000.0, [0.0, 1.0], True), (3000.0, [0.1, 1.0], False)]
)
def test_checkpoint_between_bounces_resumes_bit_identically(
    engine: str, speed: float, normal: list[float], switched: bool
) -> None:
    plane = {"point": [0, 0], "normal": normal, "restitution": 1.0}
    velocity = [speed * normal[1], -speed * normal[0]]
    balls = [ball(f"b{k}", 3 * k, 2 + 0.3 * k, velocity=velocity, restitution=1.0) for k in range(2)]
    simulation = start(from_document({"world": {"gravity": [0, -9.81]}, "plane": [plane], "ball": balls}), engine)
    advance(simulation, 210).contacts()
    while len(simulation.contacts().time):
        simulation.step()
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    if switched:  # as in a recording
        simulation.apply(Switch(time=0.0, resumes=True))
    for _ in range(400):
        simulation.step()
        resumed.step()
        assert resumed.state_hash() == simulation.state_hash()
    assert resumed.plane_reach == simulation.plane_reach


def test_divergence_reports_the_time_of_the_whole_run() -> None:
    scene = from_document({"ball": [ball("a", 9e15, 0, velocity=[1e12, 0])], "solver": {"dt": 1.0}})
    simulation = advance(start(scene, "pymunk"), 10)
    simulation.apply(Switch(time=0.0, engine="reference", settings={"dt": 10.0}))
    with pytest.raises(Divergence) as caught:
        advance(simulation, 10_000)
    assert caught.value.time == simulation.time == simulation.frame().time
    assert caught.value.time > 100.0


def test_patience_is_kept_and_an_exhausted_step_does_not_advance_time() -> None:
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])  # about 200,000 impacts in 10 s
    simulation = advance(start(gas, "exact"), 3)
    simulation.patience = 0.0
    simulation.apply(Switch(time=0.0, settings={"dt": 10.0}))
    assert simulation.patience == 0.0
    time = simulation.time
    with pytest.raises(Exhaustion, match="takes longer"):
        advance(simulation, 10)
    assert (simulation.time - time) % 10.0 == 0.0


ACTIONS: list[Action] = [
    Impulse(time=0.0, body="a", impulse=(1.0, 2.0), angular=0.1),
    Move(time=0.0, body="b", position=(0.0, 8.0)),
    Remove(time=0.0, body="c"),
    Remove(time=0.0, body="b"),
    Spawn(time=0.0, ball=Ball(position=(5.0, 9.0), radius=0.25)),
    Spawn(time=0.0, ball=Ball(position=(-5.0, 9.0), radius=0.25, collides="none")),
    SetParameter(time=0.0, path="world.gravity", value=[0.0, 0.0]),
    SetParameter(time=0.0, path="world.linear_drag", value=0.5),
    Pull(time=0.0, body="a", grip=(0.1, 0.1), target=(0.0, 3.0)),
    Pull(time=0.0, body="a"),
    Switch(time=0.0),
    Switch(time=0.0, engine="pymunk"),
    Switch(time=0.0, engine="reference"),
    Switch(time=0.0, engine="exact"),
    Switch(time=0.0, settings={"dt": 0.004}),
    Switch(time=0.0, settings={"substeps": 3}),
]


@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(ACTIONS)), max_size=14), st.sampled_from(list(ENGINES)))
def test_any_sequence_of_actions_keeps_time_and_bodies(script: list[tuple[int, Action]], engine: str) -> None:
    simulation = start(three_balls(), engine)
    simulation.contacts()
    time, present, count = 0.0, np.ones(3, np.bool_), 3
    for steps, action in script:
        advance(simulation, steps)
        time += steps * simulation.settings.dt
        before = simulation.frame()
        try:
            simulation.apply(action)
        except ActionError as error:
            assert str(error)
            assert same_state(before, simulation.frame())
        frame = simulation.frame()
        assert frame.time == simulation.time == pytest.approx(time, abs=1e-12)  # sums
        count += isinstance(action, Spawn) and len(frame.position) > count
        assert len(frame.position) == len(simulation.bodies) == len(set(simulation.bodies.names)) == count
        assert not (frame.present[: len(present)] & ~present).any()  # no removed body returns
        assert set(simulation.retired) == set(np.flatnonzero(~frame.present).tolist())
        assert np.isfinite(frame.position).all()
        pairs = simulation.contacts().pair
        assert (pairs < count).all()
        present = frame.present


def bouncing(**more: Any) -> Scene:
    """Return a ball that falls on a rough floor and bounces."""
    floor = {"point": [0, 0], "normal": [0, 1], "friction": 0.5}
    return scene_of(ball("a", 0, 2, velocity=[1, 0], radius=0.5), plane=[floor], **more)


def test_ledgers_of_segments_are_summed() -> None:
    simulation = start(bouncing(), "reference")
    initial = total_energy(simulation)
    simulation.account()
    advance(simulation, 60)
    first = simulation.account()
    simulation.apply(Switch(time=0.6, settings={"integrator": "velocity_verlet"}))
    assert simulation.account() == first
    advance(simulation, 60)
    entries = simulation.account()
    assert entries[Cause.RESTITUTION] < first[Cause.RESTITUTION] < 0.0
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # rounding of 20 J


def test_pulls_are_booked_as_drives() -> None:
    simulation = start(bouncing(), "reference")
    initial = total_energy(simulation)
    simulation.account()
    simulation.apply(Pull(time=0.0, body="a", target=(1.0, 4.0)))
    advance(simulation, 30)
    entries = simulation.account()
    assert entries[Cause.ACTIONS] == 0.0
    assert entries[Cause.DRIVES] > 1.0
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # as above


def test_launch_is_booked_as_an_action() -> None:
    rain = {"name": "rain", "count": 3, "lower": [-1, 3], "upper": [1, 5], "radius": 0.1, "collides": "none"}
    simulation = start(bouncing(scatter=[rain]), "reference")
    initial = total_energy(simulation)
    simulation.account()
    advance(simulation, 20)
    simulation.apply(Launch(time=0.2, generator="rain", seed=7))
    advance(simulation, 20)
    entries = simulation.account()
    assert entries[Cause.ACTIONS] != 0.0  # another seed gives other heights
    assert sum(entries.values()) == pytest.approx(total_energy(simulation) - initial, abs=1e-12)  # as above
