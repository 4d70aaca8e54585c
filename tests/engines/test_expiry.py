"""Lives: every engine retires at the first frame at which a life is over, whatever happens on the way."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Launch, Remove, Spawn, Switch
from sandbox.engines.common.lifetimes import SLACK, Lifetimes
from sandbox.engines.registry import ENGINES, able, start
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document

SPARK = {"position": [0.0, 1.0], "velocity_min": [-2.0, 1.0], "velocity_max": [2.0, 5.0], "radius": 0.05}
FLOOR = {"point": [0.0, -0.5], "normal": [0.0, 1.0], "restitution": 0.5}


def scene_of(*emitters: dict[str, object], **tables: object) -> Scene:
    world = {"gravity": [0.0, -9.81], "duration": 1.0, "seed": 3}
    solver = {"dt": 0.01}
    return from_document({"world": world, "solver": solver, "emitter": [{**SPARK, **e} for e in emitters], **tables})


def mixed(**tables: object) -> Scene:
    """Sparks of 0.2 to 0.6 s that touch nothing, of 0.3 s that bounce, and some that stay."""
    return scene_of(
        {"name": "free", "count": 300, "lifetime": 0.4, "lifetime_jitter": 0.2},
        {"name": "stay", "count": 3},
        {"name": "bounce", "count": 20, "lifetime": 0.3, "collides": "fixed"},
        plane=[FLOOR],
        **tables,
    )


def bodies_of(born: list[float], lifetime: list[float]) -> Bodies:
    return replace(scene_of({"count": len(born)}).bodies, born=np.asarray(born), lifetime=np.asarray(lifetime))


def ends(scene: Scene, steps: int, engine: str) -> dict[int, float]:
    simulation = start(scene, engine)
    for _ in range(steps):
        simulation.step()
    return dict(simulation.retired)


@given(st.lists(st.tuples(st.floats(0, 2), st.floats(1e-9, 3)), min_size=1, max_size=12), st.floats(-1, 1))
def test_each_is_told_once_at_the_first_frame_after_its_end(lives: list[tuple[float, float]], began: float) -> None:
    born, lifetime = zip(*lives, strict=True)
    expiry = Lifetimes(bodies_of(list(born), list(lifetime)), began, 0.1)
    told: dict[int, float] = {}
    for k in range(1, 70):
        for number in expiry.due(0.1 * k).tolist():
            assert number not in told
            told[number] = 0.1 * k
    for number, (birth, life) in enumerate(lives):
        time = told[number]
        assert time + SLACK * 0.1 >= birth + life - began
        assert time <= 0.1 or time - 0.1 + SLACK * 0.1 < birth + life - began


def test_nobody_is_due_where_lives_do_not_end() -> None:
    expiry = Lifetimes(bodies_of([0.0, 1.0], [np.inf, np.inf]), 0.0, 0.1)
    assert not len(expiry.due(1e12))


@pytest.mark.parametrize("engine", ENGINES)
def test_lives_end_at_the_first_frame_at_which_they_are_over(engine: str) -> None:
    scene = mixed()
    retired, lifetime = ends(scene, 60, engine), scene.bodies.lifetime
    assert sorted(retired) == np.flatnonzero(np.isfinite(lifetime)).tolist()
    for number, time in retired.items():
        assert time == pytest.approx(np.ceil(lifetime[number] / 0.01 - 1e-6) * 0.01, abs=1e-12)  # rounding of k·dt
    assert {retired[n] for n in range(303, 323)} == {30 * 0.01}  # 0.3 is less than 30·0.01, in binary


def test_engines_and_formulas_retire_the_same_at_the_same_frames() -> None:
    scene = scene_of(
        {"count": 200, "lifetime": 0.4, "lifetime_jitter": 0.2},
        world={"gravity": [0.0, -9.81], "duration": 0.55, "bounds": [[-0.5, -9.0], [9.0, 9.0]]},
    )
    truth = solved_run(scene, scene.solver)
    assert truth is not None
    expected = {n: t for n, t in enumerate(truth.retired_time.tolist()) if t == t}
    aside = [n for n, time in expected.items() if time < scene.bodies.lifetime[n]]
    assert 150 < len(expected) < 200
    assert len(aside) > 20
    for engine in able(scene):
        found = ends(scene, 55, engine)
        # Explicit Euler leaves by the top or bottom at another time than the parabola; here all leave by the side.
        assert found.keys() == expected.keys()
        assert [found[n] for n in sorted(found)] == pytest.approx([expected[n] for n in sorted(found)], abs=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_lives_change_no_path_before_they_end(engine: str) -> None:
    mortal, immortal = (
        mixed(),
        scene_of(
            {"name": "free", "count": 300},
            {"name": "stay", "count": 3},
            {"count": 20, "collides": "fixed"},
            plane=[FLOOR],
        ),
    )
    first, second = start(mortal, engine), start(immortal, engine)
    for _ in range(60):
        first.step()
        second.step()
        a, b = first.frame(), second.frame()
        assert np.array_equal(a.position[a.present], b.position[a.present])
        assert np.array_equal(a.velocity[a.present], b.velocity[a.present])
        assert not a.velocity[~a.present].any()
    assert a.present.sum() == 3


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("cut", [0, 7, 29, 30, 31, 45])
def test_a_leg_that_begins_later_retires_at_the_same_frames(engine: str, cut: int) -> None:
    scene = mixed()
    through, other = SwitchableSimulation(scene, engine), SwitchableSimulation(scene, engine)
    for k in range(60):
        if k == cut:
            other.apply(Switch(time=0.0))
            other = SwitchableSimulation.resumed(other.checkpoint())
        through.step()
        other.step()
        a, b = through.frame(), other.frame()
        assert np.array_equal(a.present, b.present)
        if engine == "pymunk":  # the reference remembers contacts, exact its events: not bit for bit
            assert np.array_equal(a.position[:303], b.position[:303])
    assert through.retired.keys() == other.retired.keys()
    assert list(through.retired.values()) == pytest.approx(list(other.retired.values()), abs=1e-12)  # as of k·dt


@pytest.mark.parametrize("engine", ENGINES)
def test_a_launch_gives_new_lives(engine: str) -> None:
    relay = SwitchableSimulation(mixed(), engine)
    for _ in range(50):
        relay.step()
    assert len(relay.retired) > 100
    relay.apply(Launch(time=0.0, generator="free", seed=8))
    assert relay.frame().present[:300].all()
    assert (relay.bodies.born[:300] == relay.time).all()
    assert (relay.bodies.born[300:] == 0.0).all()
    lives = relay.bodies.lifetime[:300].copy()
    assert not np.array_equal(lives, mixed().bodies.lifetime[:300])
    again = SwitchableSimulation.resumed(relay.checkpoint())
    for _ in range(61):
        relay.step()
        again.step()
    for each in (relay, again):
        ended = np.asarray([each.retired[n] for n in range(300)])
        late = ended - 0.5 - lives
        # At the first frame after: less than dt later, and no more than the slack before.
        assert (late > -SLACK * 0.01 - 1e-12).all()
        assert (late < 0.01 + 1e-12).all()  # rounding of sums of 1 s
    assert relay.state_hash() == again.state_hash()


@pytest.mark.parametrize("engine", ENGINES)
def test_who_is_gone_already_is_not_retired_again_and_who_joins_stays(engine: str) -> None:
    relay = SwitchableSimulation(mixed(), engine)
    for _ in range(10):
        relay.step()
    relay.apply(Remove(time=0.0, body="free-1"))
    relay.apply(Spawn(time=0.0, ball=Ball(name="late", position=(5.0, 5.0), radius=0.1)))
    for _ in range(60):
        relay.step()
    assert relay.retired[0] == 10 * 0.01
    frame = relay.frame()
    assert np.flatnonzero(frame.present).tolist() == [300, 301, 302, 323]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_last_part_of_a_step_ends_lives_too(engine: str) -> None:
    simulation = start(scene_of({"count": 2, "lifetime": 0.015}), engine)
    simulation.step()
    simulation.finish(0.4)
    assert simulation.retired == {}
    simulation = start(scene_of({"count": 2, "lifetime": 0.015}), engine)
    simulation.step()
    simulation.finish(0.5)
    assert dict(simulation.retired) == {0: 0.015, 1: 0.015}
