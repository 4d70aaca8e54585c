"""Lifetimes: every engine retires a body at the first frame after its lifetime has ended."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Launch, Remove, Spawn
from sandbox.engines.common.lifetimes import SLACK, Lifetimes
from sandbox.engines.registry import ENGINES, able, start
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

SPARK = {"position": [0.0, 1.0], "velocity_min": [-2.0, 1.0], "velocity_max": [2.0, 5.0], "radius": 0.05}
FLOOR = {"point": [0.0, -0.5], "normal": [0.0, 1.0], "restitution": 0.5}


def scene_of(*emitters: dict[str, object], **tables: object) -> Scene:
    world = {"gravity": [0.0, -9.81], "duration": 1.0, "seed": 3}
    solver = {"dt": 0.01}
    return from_document({"world": world, "solver": solver, "emitter": [{**SPARK, **e} for e in emitters], **tables})


def mixed_scene(**tables: object) -> Scene:
    """Return sparks of 0.2 to 0.6 s that collide with nothing, of 0.3 s that bounce, and some without a lifetime."""
    return scene_of(
        {"name": "free", "count": 300, "lifetime": 0.4, "lifetime_jitter": 0.2},
        {"name": "stay", "count": 3},
        {"name": "bounce", "count": 20, "lifetime": 0.3, "collides": "fixed"},
        plane=[FLOOR],
        **tables,
    )


def bodies_of(born: list[float], lifetime: list[float]) -> Bodies:
    return replace(scene_of({"count": len(born)}).bodies, born=np.asarray(born), lifetime=np.asarray(lifetime))


def retirement_times(scene: Scene, steps: int, engine: str) -> dict[int, float]:
    simulation = start(scene, engine)
    advance(simulation, steps)
    return dict(simulation.retired)


@given(st.lists(st.tuples(st.floats(0, 2), st.floats(1e-9, 3)), min_size=1, max_size=12), st.floats(-1, 1))
def test_each_body_is_due_once_at_the_first_frame_after_its_end(
    lifetimes: list[tuple[float, float]], start_time: float
) -> None:
    born, lifetime = zip(*lifetimes, strict=True)
    expiry = Lifetimes(bodies_of(list(born), list(lifetime)), start_time, 0.1)
    retired: dict[int, float] = {}
    for k in range(1, 70):
        for index in expiry.due(0.1 * k).tolist():
            assert index not in retired
            retired[index] = 0.1 * k
    for index, (birth, duration) in enumerate(lifetimes):
        time = retired[index]
        assert time + SLACK * 0.1 >= birth + duration - start_time
        assert time <= 0.1 or time - 0.1 + SLACK * 0.1 < birth + duration - start_time


def test_no_body_is_due_with_infinite_lifetimes() -> None:
    expiry = Lifetimes(bodies_of([0.0, 1.0], [np.inf, np.inf]), 0.0, 0.1)
    assert not len(expiry.due(1e12))


@pytest.mark.parametrize("engine", ENGINES)
def test_bodies_retire_at_the_first_frame_after_their_lifetime(engine: str) -> None:
    scene = mixed_scene()
    retired, lifetime = retirement_times(scene, 60, engine), scene.bodies.lifetime
    assert sorted(retired) == np.flatnonzero(np.isfinite(lifetime)).tolist()
    for index, time in retired.items():
        assert time == pytest.approx(np.ceil(lifetime[index] / 0.01 - 1e-6) * 0.01, abs=1e-12)  # rounding of k·dt
    assert {retired[n] for n in range(303, 323)} == {30 * 0.01}  # 0.3 < 30·0.01 in binary


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_engines_and_closed_forms_retire_the_same_bodies_at_the_same_frames() -> None:
    scene = scene_of(
        {"count": 200, "lifetime": 0.4, "lifetime_jitter": 0.2},
        world={"gravity": [0.0, -9.81], "duration": 0.55, "bounds": [[-0.5, -9.0], [9.0, 9.0]]},
    )
    truth = solved_run(scene, scene.solver)
    assert truth is not None
    expected = {n: t for n, t in enumerate(truth.retired_time.tolist()) if t == t}
    out_of_bounds = [n for n, time in expected.items() if time < scene.bodies.lifetime[n]]
    assert 150 < len(expected) < 200
    assert len(out_of_bounds) > 20
    for engine in able(scene):
        found = retirement_times(scene, 55, engine)
        # Explicit Euler would cross the top or bottom at another time than the parabola; here all leave by the side.
        assert found.keys() == expected.keys()
        assert [found[n] for n in sorted(found)] == pytest.approx([expected[n] for n in sorted(found)], abs=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_lifetimes_do_not_change_paths_before_they_end(engine: str) -> None:
    finite, infinite = (
        mixed_scene(),
        scene_of(
            {"name": "free", "count": 300},
            {"name": "stay", "count": 3},
            {"count": 20, "collides": "fixed"},
            plane=[FLOOR],
        ),
    )
    first, second = start(finite, engine), start(infinite, engine)
    for _ in range(60):
        first.step()
        second.step()
        a, b = first.frame(), second.frame()
        assert np.array_equal(a.position[a.present], b.position[a.present])
        assert np.array_equal(a.velocity[a.present], b.velocity[a.present])
        assert not a.velocity[~a.present].any()
    assert a.present.sum() == 3


@pytest.mark.parametrize("engine", ENGINES)
def test_launch_gives_new_lifetimes(engine: str) -> None:
    simulation = SwitchableSimulation(mixed_scene(), engine)
    advance(simulation, 50)
    assert len(simulation.retired) > 100
    simulation.apply(Launch(time=0.0, generator="free", seed=8))
    assert simulation.frame().present[:300].all()
    assert (simulation.bodies.born[:300] == simulation.time).all()
    assert (simulation.bodies.born[300:] == 0.0).all()
    lifetimes = simulation.bodies.lifetime[:300].copy()
    assert not np.array_equal(lifetimes, mixed_scene().bodies.lifetime[:300])
    resumed = SwitchableSimulation.resumed(simulation.checkpoint())
    for _ in range(61):
        simulation.step()
        resumed.step()
    for each in (simulation, resumed):
        end = np.asarray([each.retired[n] for n in range(300)])
        delay = end - 0.5 - lifetimes
        # At the first frame after the end: less than dt late, and at most the slack early.
        assert (delay > -SLACK * 0.01 - 1e-12).all()
        assert (delay < 0.01 + 1e-12).all()  # rounding of sums of 1 s
    assert simulation.state_hash() == resumed.state_hash()


@pytest.mark.parametrize("engine", ENGINES)
def test_removed_body_keeps_its_retirement_time_and_spawned_body_stays(engine: str) -> None:
    simulation = SwitchableSimulation(mixed_scene(), engine)
    advance(simulation, 10)
    simulation.apply(Remove(time=0.0, body="free-1"))
    simulation.apply(Spawn(time=0.0, ball=Ball(name="late", position=(5.0, 5.0), radius=0.1)))
    advance(simulation, 60)
    assert simulation.retired[0] == 10 * 0.01
    frame = simulation.frame()
    assert np.flatnonzero(frame.present).tolist() == [300, 301, 302, 323]


@pytest.mark.parametrize("engine", ENGINES)
def test_partial_last_step_ends_lifetimes(engine: str) -> None:
    for part in (0.4, 0.5):
        simulation = start(scene_of({"count": 2, "lifetime": 0.015}), engine)
        simulation.step()
        simulation.finish(part)
        end = 0.02 if simulation.makes_whole_steps else 0.01 + 0.01 * part
        assert dict(simulation.retired) == (dict.fromkeys((0, 1), end) if end >= 0.015 else {})


@pytest.mark.parametrize("others", [0, 12])  # pymunk checks the states of a few bodies in another way
@pytest.mark.parametrize("engine", ENGINES)
def test_body_is_removed_at_the_first_frame_outside_of_the_bounds(engine: str, others: int) -> None:
    resting = [{"position": [0.0, 2.0 + 0.5 * k], "radius": 0.1} for k in range(others)]
    leaving = {"name": "leaving", "position": [0.005, 0.0], "velocity": [1.0, 0.0], "radius": 0.1}
    world = {"gravity": [0.0, 0.0], "duration": 2.0, "bounds": [[-9.0, -9.0], [1.0, 9.0]]}
    simulation = start(from_document({"world": world, "solver": {"dt": 0.01}, "ball": [*resting, leaving]}), engine)
    simulation.contacts()
    for _ in range(99):
        simulation.step()
    assert not simulation.retired
    assert simulation.frame().position[-1, 0] == pytest.approx(0.995, abs=1e-4)  # box2d has single precision
    simulation.step()
    assert dict(simulation.retired) == {others: pytest.approx(1.0, abs=1e-12)}  # rounding of k·dt
