"""Launch action: the balls of a generator start again."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Launch, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Frame
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

BOUNDS = [[-3.0, -3.0], [3.0, 30.0]]


def mixed_scene(**world: Any) -> Scene:
    """Return a ball and non-colliding balls of each kind of generator."""
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


def state_rows(frame: Frame, rows: slice) -> list[Any]:
    columns = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.present)
    return [column[rows].tolist() for column in columns]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("generator", ROWS)
def test_launch_with_the_scene_seed_restores_the_initial_state_of_the_generator_only(
    engine: str, generator: str
) -> None:
    simulation = start(mixed_scene(), engine)
    initial = simulation.frame()
    before = advance(simulation, 30).frame()
    simulation.apply(Launch(time=0.0, generator=generator, seed=7))
    after, rows = simulation.frame(), ROWS[generator]
    assert after.time == before.time
    assert state_rows(after, rows) == state_rows(initial, rows)
    for others in (slice(0, rows.start), slice(rows.stop, None)):
        assert state_rows(after, others) == state_rows(before, others)


@pytest.mark.parametrize("generator", ROWS)
def test_another_seed_gives_another_reproducible_layout(generator: str) -> None:
    frames = []
    for seed in (7, 8, 8):
        simulation = advance(start(mixed_scene()), 3)
        simulation.apply(Launch(time=0.0, generator=generator, seed=seed))
        frames.append(simulation.frame())
    original, other, repeated = (state_rows(frame, ROWS[generator]) for frame in frames)
    assert other != original
    assert other == repeated


@pytest.mark.parametrize("engine", ENGINES)
def test_launch_restores_retired_and_removed_sparks(engine: str) -> None:
    simulation = start(mixed_scene(bounds=BOUNDS), engine)
    simulation.apply(Remove(time=0.0, body="s-2"))
    advance(simulation, 300)
    assert not simulation.frame().present.any()
    retired = dict(simulation.retired)
    simulation.apply(Launch(time=0.0, generator="s", seed=3))
    assert np.flatnonzero(simulation.frame().present).tolist() == [6, 7, 8, 9]
    assert {n: t for n, t in retired.items() if n not in (6, 7, 8, 9)} == dict(simulation.retired)
    advance(simulation, 300)
    assert not simulation.frame().present.any()
    assert all(simulation.retired[n] > 3.0 for n in (6, 7, 8, 9))
    assert {n: t for n, t in retired.items() if n not in (6, 7, 8, 9)} == {
        n: t for n, t in simulation.retired.items() if n not in (6, 7, 8, 9)
    }


def test_launch_keeps_changed_parameters_spawned_bodies_and_pulls() -> None:
    simulation = start(mixed_scene())
    simulation.apply(Spawn(time=0.0, ball=Ball(name="new", position=(2.0, 9.0), radius=0.1, collides="none")))
    simulation.apply(Pull(time=0.0, body="own", target=(2.0, 2.0)))
    simulation.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, 0.0]))
    simulation.apply(Switch(time=0.0, engine="exact"))
    simulation.apply(Launch(time=0.0, generator="s", seed=1))
    assert simulation.engine == "exact"
    assert simulation.bodies.names[-1] == "new"
    assert simulation.scene.world.gravity == (0.0, 0.0)
    assert set(simulation.checkpoint().pulls) == {"own"}
    advance(simulation, 100)
    assert simulation.frame().position[0] == pytest.approx([2.0, 2.0], abs=1e-9)  # (1 + ωt)·e^{−ωt} after 1 s


@pytest.mark.parametrize("generator", ["own", "zzz", "s-1", "emitter-1"])
def test_unknown_generator_is_refused(generator: str) -> None:
    """The first emitter has an explicit name, so `emitter-1` is not a generator."""
    simulation = advance(start(mixed_scene()), 3)
    before = simulation.state_hash()
    with pytest.raises(ActionError, match="no generator"):
        simulation.apply(Launch(time=0.0, generator=generator, seed=1))
    assert simulation.state_hash() == before


def test_launch_into_an_overlap_is_refused_by_the_exact_engine_only() -> None:
    grid = {"name": "g", "origin": [0, 2], "columns": 3, "spacing": [1, 1], "radius": 0.3}
    ball = {"name": "own", "position": [9, 2], "radius": 0.3}
    for engine, refuses in (("exact", True), ("pymunk", False)):
        simulation = start(from_document({"grid": [grid], "ball": [ball]}), engine)
        simulation.apply(Remove(time=0.0, body="g-1"))
        simulation.apply(Spawn(time=0.0, ball=Ball(name="new", position=(0.0, 2.1), radius=0.3)))
        before = simulation.state_hash()
        if refuses:
            with pytest.raises(ActionError, match="exact refuses"):
                simulation.apply(Launch(time=0.0, generator="g", seed=1))
            assert simulation.state_hash() == before
        else:
            simulation.apply(Launch(time=0.0, generator="g", seed=1))
            assert simulation.frame().present.all()
