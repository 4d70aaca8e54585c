"""Launches: a generator's balls start anew."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Launch, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Frame

BOUNDS = [[-3.0, -3.0], [3.0, 30.0]]


def mixed(**world: Any) -> Scene:
    """A ball, and balls of each kind of generator, which nothing can stop."""
    return from_document(
        {
            "world": {"gravity": [0, -9.81], "seed": 7, **world},
            "ball": [{"name": "own", "position": [1, 1], "radius": 0.1, "velocity": [0, 1], "collides": "none"}],
            "grid": [
                {"name": "g", "origin": [0, 2], "columns": 2, "spacing": [0.5, 0.5], "radius": 0.1, "jitter": 0.1,
                 "velocity_jitter": 1.0, "angle": 0.5, "angular_velocity": 2.0, "collides": "none"},
            ],
            "scatter": [{"count": 3, "lower": [-1, 3], "upper": [1, 5], "radius": 0.1, "collides": "none"}],
            "emitter": [
                {"name": "s", "position": [0, 0], "count": 4, "velocity_min": [-1, 4], "velocity_max": [1, 6]},
                {"position": [1, 0], "count": 2, "velocity_min": [-1, 4], "velocity_max": [1, 6]},
            ],
        }
    )  # fmt: skip


ROWS = {"g": slice(1, 3), "scatter-1": slice(3, 6), "s": slice(6, 10), "emitter-2": slice(10, 12)}


def stepped(relay: SwitchableSimulation, steps: int) -> SwitchableSimulation:
    for _ in range(steps):
        relay.step()
    return relay


def rows(frame: Frame, which: slice) -> list[Any]:
    columns = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.present)
    return [column[which].tolist() for column in columns]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("generator", ROWS)
def test_scenes_own_seed_gives_the_starting_state_bit_for_bit_and_moves_nobody_else(
    engine: str, generator: str
) -> None:
    relay = start(mixed(), engine)
    begin = relay.frame()
    before = stepped(relay, 30).frame()
    relay.apply(Launch(time=0.0, generator=generator, seed=7))
    after, which = relay.frame(), ROWS[generator]
    assert after.time == before.time
    assert rows(after, which) == rows(begin, which)
    for others in (slice(0, which.start), slice(which.stop, None)):
        assert rows(after, others) == rows(before, others)


@pytest.mark.parametrize("generator", ROWS)
def test_another_seed_is_another_layout_the_same_each_time(generator: str) -> None:
    frames = []
    for seed in (7, 8, 8):
        relay = stepped(start(mixed()), 3)
        relay.apply(Launch(time=0.0, generator=generator, seed=seed))
        frames.append(relay.frame())
    own, other, again = (rows(frame, ROWS[generator]) for frame in frames)
    assert other != own
    assert other == again


def test_layout_is_that_of_a_scene_with_that_seed() -> None:
    relay, scene = start(mixed()), mixed(seed=99)
    for generator in ROWS:
        relay.apply(Launch(time=0.0, generator=generator, seed=99))
    assert relay.frame().position.tolist() == scene.bodies.position.tolist()
    assert relay.frame().velocity.tolist() == scene.bodies.velocity.tolist()


@pytest.mark.parametrize("engine", ENGINES)
def test_retired_and_removed_sparks_come_back_and_leave_again(engine: str) -> None:
    relay = start(mixed(bounds=BOUNDS), engine)
    relay.apply(Remove(time=0.0, body="s-2"))
    stepped(relay, 300)
    assert not relay.frame().present.any()
    gone = dict(relay.retired)
    relay.apply(Launch(time=0.0, generator="s", seed=3))
    assert np.flatnonzero(relay.frame().present).tolist() == [6, 7, 8, 9]
    assert {n: t for n, t in gone.items() if n not in (6, 7, 8, 9)} == dict(relay.retired)
    stepped(relay, 300)
    assert not relay.frame().present.any()
    assert all(relay.retired[n] > 3.0 for n in (6, 7, 8, 9))
    assert {n: t for n, t in gone.items() if n not in (6, 7, 8, 9)} == {
        n: t for n, t in relay.retired.items() if n not in (6, 7, 8, 9)
    }


@pytest.mark.parametrize("engine", ENGINES)
def test_launched_sparks_fly_as_those_of_the_start(engine: str) -> None:
    scene = load(find("fireworks"))
    relay, fresh = stepped(start(scene, engine), 40), start(scene, engine)
    relay.apply(Launch(time=0.0, generator="spark", seed=scene.world.seed))
    for _ in range(20):
        relay.step()
        fresh.step()
        assert rows(relay.frame(), slice(None)) == rows(fresh.frame(), slice(None))


def test_launch_knows_the_scene_and_the_bodies_of_now() -> None:
    relay = start(mixed())
    relay.apply(Spawn(time=0.0, ball=Ball(name="new", position=(2.0, 9.0), radius=0.1, collides="none")))
    relay.apply(Pull(time=0.0, body="own", target=(2.0, 2.0)))
    relay.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, 0.0]))
    relay.apply(Switch(time=0.0, engine="exact"))
    relay.apply(Launch(time=0.0, generator="s", seed=1))
    assert relay.engine == "exact"
    assert relay.bodies.names[-1] == "new"
    assert relay.scene.world.gravity == (0.0, 0.0)
    assert set(relay.checkpoint().pulls) == {"own"}
    stepped(relay, 100)
    assert relay.frame().position[0] == pytest.approx([2.0, 2.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s


@pytest.mark.parametrize("generator", ["own", "zzz", "s-1", "emitter-1"])
def test_unknown_generator_is_refused(generator: str) -> None:
    """The first emitter has a name of its own, so that it is not called `emitter-1`."""
    relay = stepped(start(mixed()), 3)
    before = relay.state_hash()
    with pytest.raises(ActionError, match="no generator"):
        relay.apply(Launch(time=0.0, generator=generator, seed=1))
    assert relay.state_hash() == before


def test_launch_into_what_has_come_to_lie_there_is_refused_where_the_engine_must() -> None:
    grid = {"name": "g", "origin": [0, 2], "columns": 3, "spacing": [1, 1], "radius": 0.3}
    ball = {"name": "own", "position": [9, 2], "radius": 0.3}
    for engine, refuses in (("exact", True), ("pymunk", False)):
        relay = start(from_document({"grid": [grid], "ball": [ball]}), engine)
        relay.apply(Remove(time=0.0, body="g-1"))
        relay.apply(Spawn(time=0.0, ball=Ball(name="new", position=(0.0, 2.1), radius=0.3)))
        before = relay.state_hash()
        if refuses:
            with pytest.raises(ActionError, match="exact refuses"):
                relay.apply(Launch(time=0.0, generator="g", seed=1))
            assert relay.state_hash() == before
        else:
            relay.apply(Launch(time=0.0, generator="g", seed=1))
            assert relay.frame().present.all()
