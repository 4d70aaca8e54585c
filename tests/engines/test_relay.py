"""Relays: a scene that changes engine, settings and cast on the way is still one scene."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import (
    Action,
    ActionError,
    Force,
    Impulse,
    Launch,
    Move,
    Pull,
    Remove,
    SetParameter,
    Spawn,
    Switch,
)
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.registry import start as start_alone
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find, shipped
from sandbox.trajectory import Contacts, Frame

pytestmark = pytest.mark.full  # property tests with many examples

SCENES = {each.name: load(each.path) for each in shipped()}
SHORT = ("tutorial/bounce", "tutorial/fireworks", "benchmark/newtons_cradle", "benchmark/gas", "benchmark/incline")
RUNS = [(name, engine) for name in SHORT for engine in able(SCENES[name])]
OTHERS = [(a, b) for a in ENGINES for b in ENGINES if a != b]


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.25, "restitution": 0.5, **more}


def scene_of(*balls: dict[str, Any], **document: Any) -> Scene:
    floor = {"name": "floor", "point": [0, 0], "normal": [0, 1], "restitution": 1, "friction": 0.3}
    world = {"gravity": [0, -9.81], "bounds": [[-50, -50], [50, 50]]}
    return from_document({"plane": [floor], "world": world, "solver": {"dt": 0.01}, "ball": list(balls), **document})


def three(**document: Any) -> Scene:
    """Three balls in flight, with spin."""
    return scene_of(
        ball("a", -2, 3, velocity=[1, 0], angular_velocity=1.0),
        ball("b", 0, 4, angle=0.5, mass=3),
        ball("c", 2, 5, velocity=[-1, 2]),
        **document,
    )


def stepped(relay: SwitchableSimulation, steps: int) -> SwitchableSimulation:
    for _ in range(steps):
        relay.step()
    return relay


def same(a: Frame, b: Frame) -> bool:
    """Tell whether two frames are the same but for the last digits of their times."""
    columns = ("position", "velocity", "angle", "angular_velocity", "present")
    return all(np.array_equal(getattr(a, column), getattr(b, column)) for column in columns)


@pytest.mark.parametrize(("name", "engine"), RUNS)
def test_relay_without_switches_is_the_engine_alone_bit_for_bit(name: str, engine: str) -> None:
    relay, alone = start(SCENES[name], engine), start_alone(SCENES[name], engine)
    found: list[Contacts] = []
    for each in (relay, alone):
        each.contacts()
    for _ in range(120):
        for each in (relay, alone):
            each.step()
        assert relay.state_hash() == alone.state_hash()
    found = [relay.contacts(), alone.contacts()]
    for column in ("time", "pair", "point", "normal", "impulse"):
        assert np.array_equal(getattr(found[0], column), getattr(found[1], column))
    assert relay.time == alone.time
    assert dict(relay.work) == dict(alone.work)
    assert dict(relay.retired) == dict(alone.retired)


@pytest.mark.parametrize(("first", "second"), OTHERS)
def test_switch_of_engine_keeps_the_state_and_all_that_is_known(first: str, second: str) -> None:
    relay = stepped(start(three(), first), 20)
    before, time = relay.frame(), relay.time
    relay.apply(Switch(time=0.0, engine=second))
    assert relay.engine == second
    assert relay.time == time == 20 * 0.01
    assert relay.state_hash() == before.state_hash()
    assert relay.bodies.names == ("a", "b", "c")
    assert relay.setup.bodies.position.tolist() == before.position.tolist()
    stepped(relay, 20)
    assert relay.frame().time == 40 * 0.01  # not 20·dt + 20·dt, which rounds otherwise


@pytest.mark.parametrize("engine", ENGINES)
@given(parts=st.lists(st.tuples(st.integers(1, 12), st.sampled_from([0.01, 0.005, 0.02, 1 / 60])), max_size=5))
@settings(max_examples=15)
def test_free_flight_is_closed_form_through_any_change_of_step(engine: str, parts: list[tuple[int, float]]) -> None:
    relay = start(scene_of(ball("a", 0, 9, velocity=[2, 1], collides="none")), engine)
    elapsed, error, h = 0.0, 0.0, 0.01
    for steps, dt in parts:
        relay.apply(Switch(time=0.0, settings={"dt": dt}))
        stepped(relay, steps)
        elapsed, h = elapsed + steps * dt, max(h, dt)
        error += steps * dt
    frame = relay.frame()
    assert frame.time == pytest.approx(elapsed, rel=1e-12)  # a few sums
    assert frame.velocity[0] == pytest.approx([2.0, 1.0 - 9.81 * elapsed], abs=1e-11)  # rounding of up to 60 sums
    bound = 0.5 * 9.81 * h * error + 1e-11  # explicit Euler's is g·h·T/2; other schemes have less
    assert abs(frame.position[0, 1] - (9.0 + elapsed - 0.5 * 9.81 * elapsed**2)) <= bound
    assert frame.position[0, 0] == pytest.approx(2.0 * elapsed, abs=1e-11)  # as above


@pytest.mark.parametrize(("first", "second"), OTHERS)
def test_numbers_names_and_times_are_those_of_the_whole(first: str, second: str) -> None:
    """A is removed, b flies out of the bounds, d comes, then c: through four legs."""
    scene = scene_of(
        ball("a", -20, 30, collides="none"),
        ball("b", 49, 30, velocity=[15, 0], collides="none"),
        ball("c", 0, 0.25 + 0.1),
        ball("e", 5, 0.25 + 0.4),
    )
    relay = start(scene, first)
    relay.contacts()
    stepped(relay, 3).apply(Remove(time=0.0, body="a"))
    relay.apply(Switch(time=0.0, engine=second))
    assert relay.frame().present.tolist() == [False, True, True, True]
    stepped(relay, 7)  # b is gone at 0.07 s
    assert dict(relay.retired) == {0: pytest.approx(0.03), 1: pytest.approx(0.07)}
    relay.apply(Spawn(time=0.0, ball=Ball(name="d", position=(10.0, 0.35), radius=0.25, restitution=0.5)))
    relay.apply(Switch(time=0.0, engine=first))
    relay.apply(Switch(time=0.0, engine=second))
    assert relay.bodies.names == ("a", "b", "c", "e", "d")
    before = relay.frame()
    assert before.present.tolist() == [False, False, True, True, True]
    assert before.position[0].tolist() == pytest.approx([-20.0, 30.0], abs=0.05)  # 0.03 s of falling
    assert not before.velocity[:2].any()
    stepped(relay, 50)
    assert relay.frame().position[:2].tolist() == before.position[:2].tolist()
    assert dict(relay.retired) == {0: pytest.approx(0.03), 1: pytest.approx(0.07)}
    contacts = relay.contacts()
    assert set(map(tuple, contacts.pair.tolist())) == {(2, -1), (3, -1), (4, -1)}
    first_touch = {pair[0]: time for time, pair in zip(contacts.time[::-1], contacts.pair[::-1].tolist(), strict=True)}
    falls = {2: np.sqrt(2 * 0.1 / 9.81), 3: np.sqrt(2 * 0.4 / 9.81), 4: 0.1 + np.sqrt(2 * 0.1 / 9.81)}
    for number, time in falls.items():
        assert first_touch[number] == pytest.approx(time, abs=0.021)  # two steps: the engines' first-order errors
    with pytest.raises(ActionError, match="already"):
        relay.apply(Spawn(time=0.0, ball=Ball(name="a", position=(20.0, 9.0), radius=0.1)))


def test_observer_hears_of_every_leg_by_the_numbers_and_times_of_the_whole() -> None:
    told: list[tuple[float, int, list[bool], set[tuple[int, ...]]]] = []

    def listen(time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        assert start.shape == end.shape
        told.append((time, len(end), np.isfinite(end[:, 0]).tolist(), set(map(tuple, touching.tolist()))))

    relay = start(scene_of(ball("a", 0, 9), ball("b", 3, 0.249), ball("c", 6, 9)), "pymunk")
    relay.watch(listen)
    stepped(relay, 2).apply(Remove(time=0.0, body="a"))
    relay.apply(Switch(time=0.0, engine="reference"))
    relay.step()
    relay.apply(Spawn(time=0.0, ball=Ball(position=(9.0, 9.0), radius=0.25)))
    relay.apply(Switch(time=0.0, settings={"substeps": 2}))
    relay.step()
    assert [time for time, *_ in told] == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.035], abs=1e-15)  # sums
    assert [count for _, count, _, _ in told] == [3, 3, 3, 4, 4]
    there = [finite for _, _, finite, _ in told]
    assert there == [[True] * 3, [True] * 3, [False, True, True], *[[False, True, True, True]] * 2]
    assert all((1, -1) in touching for *_, touching in told[:3])  # b lies on the floor from the start
    assert all(pair[0] in (1, 2) for *_, touching in told for pair in touching)


REFUSED: Mapping[str, Action] = {
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


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("which", REFUSED)
def test_what_is_refused_says_why_and_changes_nothing(engine: str, which: str) -> None:
    def between() -> SwitchableSimulation:
        scene = scene_of(ball("a", 0, 2), ball("post", 5, 5, fixed=True), ball("gone", 9, 9))
        relay = stepped(start(scene, engine), 5)
        relay.apply(Remove(time=0.0, body="gone"))
        return relay

    relay, untouched = between(), between()
    with pytest.raises(ActionError, match=r"\w"):
        relay.apply(REFUSED[which])
    assert (relay.engine, relay.wanted, relay.settings) == (untouched.engine, untouched.wanted, untouched.settings)
    assert relay.state_hash() == untouched.state_hash()
    assert stepped(relay, 30).state_hash() == stepped(untouched, 30).state_hash()


def test_exact_refuses_to_go_on_from_an_overlap() -> None:
    relay = stepped(start(scene_of(ball("a", 0, 0.2)), "pymunk"), 1)
    before = relay.state_hash()
    with pytest.raises(ActionError, match="exact refuses"):
        relay.apply(Switch(time=0.0, engine="exact"))
    assert (relay.engine, relay.state_hash()) == ("pymunk", before)


@pytest.mark.parametrize(("first", "second"), [("pymunk", "reference"), ("reference", "pymunk")])
def test_steady_force_goes_on_after_a_switch_and_ends_with_its_body(first: str, second: str) -> None:
    scene = from_document(
        {
            "world": {"bounds": [[-9, -9], [9, 9]]},
            "ball": [ball("a", 0, 0, mass=2), ball("out", 8.99, 0, velocity=[9, 0], collides="none")],
        }
    )
    relay = start(scene, first)
    relay.apply(Force(time=0.0, body="a", force=(4.0, -2.0)))
    relay.apply(Force(time=0.0, body="out", force=(1.0, 0.0)))
    stepped(relay, 50).apply(Switch(time=0.0, engine=second))
    assert relay.frame().present.tolist() == [True, False]
    stepped(relay, 50)
    assert relay.frame().velocity[0] == pytest.approx([2.0, -1.0], rel=1e-12)  # a hundred sums
    point = relay.checkpoint()
    assert set(point.forces) == {"a"}
    assert stepped(SwitchableSimulation.resumed(point), 9).state_hash() == stepped(relay, 9).state_hash()


def test_pull_goes_on_after_a_switch_and_ends_with_its_body() -> None:
    relay = start(from_document({"ball": [ball("a", 0, 0), ball("b", 9, 9)]}), "pymunk")
    relay.apply(Pull(time=0.0, body="a", target=(1.0, 0.0)))
    stepped(relay, 5).apply(Switch(time=0.0, engine="exact"))
    stepped(relay, 95)
    assert relay.frame().position[0] == pytest.approx([1.0, 0.0], abs=1e-9)  # e^{−ωt}·(1 + ωt) after 1 s
    relay.apply(Remove(time=0.0, body="a"))
    stepped(relay, 2).apply(Switch(time=0.0, engine="reference"))
    assert not stepped(relay, 2).frame().present[0]
    assert not relay.checkpoint().pulls
    with pytest.raises(ActionError, match="a"):
        relay.apply(Pull(time=0.0, body="a", target=(1.0, 0.0)))


def test_names_of_the_nameless_never_collide() -> None:
    relay = start(scene_of(ball("spawned-2", 0, 9), ball("a", 2, 9)), "pymunk")
    for k in range(4):
        relay.apply(Spawn(time=0.0, ball=Ball(position=(4.0 + k, 9.0), radius=0.1)))
        relay.apply(Switch(time=0.0))
    relay.apply(Remove(time=0.0, body=relay.bodies.names[-1]))
    relay.apply(Switch(time=0.0))
    relay.apply(Spawn(time=0.0, ball=Ball(position=(9.0, 9.0), radius=0.1)))
    assert len(set(relay.bodies.names)) == 7
    assert len(relay.frame().position) == 7


def test_coefficients_set_in_a_later_leg_last_and_reach_the_next() -> None:
    relay = start(scene_of(ball("a", 0, 0.5), ball("b", 3, 9)), "pymunk")
    relay.apply(Remove(time=0.0, body="b"))
    relay.apply(Switch(time=0.0, engine="reference"))
    relay.apply(SetParameter(time=0.0, path="ball.a.restitution", value=0.0))
    relay.apply(SetParameter(time=0.0, path="plane.floor.restitution", value=0.0))
    relay.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]))
    relay.apply(Switch(time=0.0, engine="exact"))
    assert relay.bodies.elements[0].restitution == 0.0
    stepped(relay, 200)
    assert relay.frame().position[0].tolist() == pytest.approx([0.0, 0.25], abs=1e-12)  # it does not bounce
    assert relay.scene.world.gravity == (0.0, -1.0)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_taken_up_in_free_flight_it_goes_on_bit_for_bit(engine: str) -> None:
    relay = stepped(start(three(solver={"dt": 1 / 60}), engine), 7)
    relay.apply(Pull(time=0.0, body="b", grip=(0.1, 0.0), target=(1.0, 5.0)))
    relay.apply(Switch(time=0.0, settings={"dt": 0.003}))
    stepped(relay, 4)
    again = SwitchableSimulation.resumed(relay.checkpoint())
    for _ in range(25):
        assert again.state_hash() == relay.state_hash()
        relay.step()
        again.step()


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("speed", [1.0, 3000.0])  # m/s; at 3000 pymunk's half-planes are lengthened on the way
@pytest.mark.parametrize("normal", [[0.0, 1.0], [0.1, 1.0]])
@pytest.mark.parametrize("switched", [False, True])
def test_taken_up_between_bounces_off_a_plane_it_goes_on_bit_for_bit(
    engine: str, speed: float, normal: list[float], switched: bool
) -> None:
    plane = {"point": [0, 0], "normal": normal, "restitution": 1.0}
    velocity = [speed * normal[1], -speed * normal[0]]
    balls = [ball(f"b{k}", 3 * k, 2 + 0.3 * k, velocity=velocity, restitution=1.0) for k in range(2)]
    relay = start(from_document({"world": {"gravity": [0, -9.81]}, "plane": [plane], "ball": balls}), engine)
    stepped(relay, 210).contacts()
    while len(relay.contacts().time):
        relay.step()
    again = SwitchableSimulation.resumed(relay.checkpoint())
    if switched:  # as a recording has it
        relay.apply(Switch(time=0.0, resumes=True))
    for _ in range(400):
        relay.step()
        again.step()
        assert again.state_hash() == relay.state_hash()
    assert again.plane_reach == relay.plane_reach


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["tutorial/bounce", "benchmark/newtons_cradle", "benchmark/gas"])
def test_switch_of_nothing_and_taking_up_a_checkpoint_are_the_same(name: str, engine: str) -> None:
    """Whatever there is in contact: a session that went back hands over in this way to be played again."""
    relay = stepped(start(SCENES[name], engine), 60)
    again = SwitchableSimulation.resumed(relay.checkpoint())
    relay.apply(Switch(time=0.0, resumes=True))
    for _ in range(60):
        assert again.state_hash() == relay.state_hash()
        relay.step()
        again.step()


def test_divergence_tells_the_time_of_the_whole() -> None:
    scene = from_document({"ball": [ball("a", 9e15, 0, velocity=[1e12, 0])], "solver": {"dt": 1.0}})
    relay = stepped(start(scene, "pymunk"), 10)
    relay.apply(Switch(time=0.0, engine="reference", settings={"dt": 10.0}))
    with pytest.raises(Divergence) as caught:
        stepped(relay, 10_000)
    assert caught.value.time == relay.time == relay.frame().time
    assert caught.value.time > 100.0


def test_patience_goes_on_and_an_exhausted_step_does_not_count() -> None:
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])  # some 200,000 impacts in 10 s
    relay = stepped(start(gas, "exact"), 3)
    relay.patience = 0.0
    relay.apply(Switch(time=0.0, settings={"dt": 10.0}))
    assert relay.patience == 0.0
    time = relay.time
    with pytest.raises(Exhaustion, match="takes longer"):
        stepped(relay, 10)
    assert (relay.time - time) % 10.0 == 0.0


def test_scene_that_an_engine_cannot_run_is_refused_at_once() -> None:
    with pytest.raises(Refusal, match="engines that can: reference"):
        start(scene_of(ball("a", 0, 1)), "exact", Settings(detection="swept"))


ACTS: list[Action] = [
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


@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(ACTS)), max_size=14), st.sampled_from(list(ENGINES)))
def test_in_any_order_of_actions_time_goes_on_and_nobody_is_lost(done: list[tuple[int, Action]], engine: str) -> None:
    relay = start(three(), engine)
    relay.contacts()
    time, present, count = 0.0, np.ones(3, np.bool_), 3
    for steps, action in done:
        stepped(relay, steps)
        time += steps * relay.settings.dt
        before = relay.frame()
        try:
            relay.apply(action)
        except ActionError as error:
            assert str(error)
            assert same(before, relay.frame())
        frame = relay.frame()
        assert frame.time == relay.time == pytest.approx(time, abs=1e-12)  # sums
        count += isinstance(action, Spawn) and len(frame.position) > count
        assert len(frame.position) == len(relay.bodies) == len(set(relay.bodies.names)) == count
        assert not (frame.present[: len(present)] & ~present).any()  # nobody comes back by himself
        assert set(relay.retired) == set(np.flatnonzero(~frame.present).tolist())
        assert np.isfinite(frame.position).all()
        pairs = relay.contacts().pair
        assert (pairs < count).all()
        present = frame.present
