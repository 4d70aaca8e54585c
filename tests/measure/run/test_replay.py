"""Replays: a recorded session ends in the same state, bit for bit, on every engine that supports it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Launch, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

SCENE = from_document(
    {
        "world": {"gravity": [0, -9.81], "seed": 3, "bounds": [[-9, -1], [9, 30]], "duration": 1.0},
        "solver": {"dt": 1 / 60},
        "plane": [{"name": "floor", "point": [0, 0], "normal": [0, 1], "restitution": 1, "friction": 0.3}],
        "wall": [{"points": [[3, 0], [3, 3]], "restitution": 1}],
        "ball": [
            {"name": "a", "position": [-2, 2], "velocity": [3, 0], "radius": 0.25, "restitution": 0.6},
            {"name": "b", "position": [0, 0.6], "radius": 0.5, "mass": 3, "restitution": 0.6},
            {"name": "post", "position": [1.5, 3], "radius": 0.2, "fixed": True, "restitution": 1},
        ],
        "grid": [
            {"name": "g", "origin": [-1, 5], "columns": 3, "rows": 2, "spacing": [0.6, 0.6], "jitter": 0.02,
             "radius": 0.2, "restitution": 0.6},
        ],
        "emitter": [{"name": "s", "position": [0, 0], "count": 5, "velocity_min": [-4, 1], "velocity_max": [4, 9]}],
    }
)  # fmt: skip

small = st.floats(-5.0, 5.0)
bodies = st.sampled_from(["a", "b", "post", "g-1", "g-4", "s-2", "new", "spawned-15", "zzz"])


def actions() -> st.SearchStrategy[Action]:
    """Return actions of every kind that all engines support, with values far from the limits."""
    positions = st.tuples(st.floats(-4.0, 2.0), st.floats(1.0, 8.0))
    pairs = st.tuples(small, small)
    balls = st.builds(
        Ball, position=positions, radius=st.sampled_from([0.1, 0.3]), name=st.sampled_from([None, "new"]),
        restitution=st.just(0.6), collides=st.sampled_from(["all", "none"]),
    )  # fmt: skip
    paths = st.sampled_from(["ball.*.restitution", "plane.floor.friction", "grid.g.restitution", "world.linear_drag"])
    values: dict[str, Any] = {"dt": st.sampled_from([0.005, 0.01, 1 / 60, 0.02]), "substeps": st.integers(1, 3)}
    kinds: list[st.SearchStrategy[Action]] = [
        st.builds(Impulse, time=st.just(0.0), body=bodies, impulse=pairs, angular=small),
        st.builds(Move, time=st.just(0.0), body=bodies, position=positions, velocity=st.none() | pairs),
        st.builds(Pull, time=st.just(0.0), body=bodies, grip=st.just((0.05, 0.0)), target=st.none() | positions),
        st.builds(Remove, time=st.just(0.0), body=bodies),
        st.builds(Spawn, time=st.just(0.0), ball=balls),
        st.builds(SetParameter, time=st.just(0.0), path=paths, value=st.floats(0.0, 1.0)),
        st.builds(SetParameter, time=st.just(0.0), path=st.just("world.gravity"), value=pairs.map(list)),
        st.builds(Launch, time=st.just(0.0), generator=st.sampled_from(["g", "s", "zzz"]), seed=st.integers(0, 9)),
        st.builds(Switch, time=st.just(0.0), engine=st.sampled_from([None, *ENGINES]), settings=st.just({})),
        st.builds(Switch, time=st.just(0.0), settings=st.fixed_dictionaries({}, optional=values)),
    ]
    return st.one_of(kinds)


Plan = list[tuple[int, int | None, Action]]
"""Steps to advance, steps to seek back or None, and an action."""


def play(engine: str, plan: Plan, last: int = 5) -> Session:
    """Return a session with all possible actions of a plan applied, and some steps after them."""
    session = Session(SCENE, engine)
    for steps, back, action in plan:
        session.advance(steps)
        if back is not None:
            for _ in session.seek(session.step_number - back):
                pass
        if session.ended is None:
            try:
                session.apply(action)
            except ActionError as error:
                assert str(error)
    session.advance(last)
    for _ in session.seek(session.history.last_step):  # a recording ends at the last step, even after seeking back
        pass
    return session


plans = st.lists(st.tuples(st.integers(0, 25), st.none() | st.integers(0, 30), actions()), max_size=10)
EVERY_KIND: Plan = [
    (10, None, Impulse(time=0.0, body="a", impulse=(0.5, 1.0), angular=0.1)),
    (5, None, Pull(time=0.0, body="b", grip=(0.1, 0.2), target=(0.5, 1.5))),
    (20, None, Switch(time=0.0, engine="exact")),
    (5, None, Pull(time=0.0, body="b")),
    (5, 7, Move(time=0.0, body="a", position=(-4.0, 9.0), velocity=(0.0, 0.0))),
    (1, None, Spawn(time=0.0, ball=Ball(position=(-6.0, 8.0), radius=0.2, restitution=0.6))),
    (1, None, SetParameter(time=0.0, path="plane.*.restitution", value=0.4)),
    (3, None, Switch(time=0.0, engine="reference", settings={"dt": 0.01})),
    (9, None, Remove(time=0.0, body="g-1")),
    (9, None, Launch(time=0.0, generator="s", seed=8)),
    (9, None, Switch(time=0.0, engine="pymunk", settings={"substeps": 2})),
]
"""Actions that every engine supports in any state."""
NO_STEPS: Plan = [
    (0, None, Impulse(time=0.0, body="a", impulse=(1.0, 0.0))),
    (0, None, SetParameter(time=0.0, path="world.gravity", value=[0.0, 1.0])),
]


@pytest.mark.parametrize("engine", ENGINES)
@given(plan=plans, last=st.sampled_from([0, 5]))
@example(plan=EVERY_KIND, last=5)
@example(plan=NO_STEPS[:1], last=0)
@example(plan=NO_STEPS, last=0)
@example(plan=[], last=0)
@settings(max_examples=12)
def test_session_replays_to_the_same_state_through_json(engine: str, plan: Plan, last: int) -> None:
    session = play(engine, plan, last)
    recording = session.recording()
    again = Recording.from_json(recording.to_json())
    assert again == recording
    found = rerun(again, audit=False)
    if session.ended is None:
        assert (found.status, found.reason) == ("ok", None)
    if recording.state_hash is not None:
        assert found.info["state_hash"] == recording.state_hash
    assert tuple(found.names.tolist()) == session.bodies.names
    assert set(np.flatnonzero(~np.isnan(found.retired_time)).tolist()) == set(session.simulation.retired)


def test_session_with_every_kind_of_action_runs_on_every_engine() -> None:
    recording = play("pymunk", EVERY_KIND).recording()
    assert [action.kind for action in recording.actions if action.kind != "switch"] == [
        "impulse", "pull", "pull", "move", "spawn", "set", "remove", "launch",
    ]  # fmt: skip
    replayed = rerun(recording)
    assert replayed.info["state_hash"] == recording.state_hash
    for other in ENGINES:
        found = rerun(recording, other)
        assert (found.status, found.reason) == ("ok", None)
        assert found.info["engine"] == other
        assert found.time[-1] == recording.duration
        assert found.names.tolist() == replayed.names.tolist()
        assert found.number("g-1") in np.flatnonzero(~np.isnan(found.retired_time))


def test_replay_ends_with_a_reason_at_an_action_the_engine_cannot_apply() -> None:
    session = Session(SCENE, "reference")
    session.advance(10)
    session.apply(Switch(time=0.0, settings={"detection": "swept"}))
    session.advance(10)
    found = rerun(session.recording(), "exact")
    assert found.status == "failed"
    assert "exact refuses" in str(found.reason)
    assert found.time[-1] == pytest.approx(10 / 60, rel=1e-12)  # rounding


@pytest.mark.parametrize("engine", ["exact", "reference"])
def test_session_that_diverged_replays_to_its_end(engine: str) -> None:
    ball = {"name": "a", "position": [9.9e15, 0], "radius": 1, "velocity": [1e12, 0]}
    session = Session(from_document({"ball": [ball], "solver": {"dt": 10.0}}), engine)
    session.advance(10_000)
    assert session.ended is not None
    assert session.step_number == 9011  # 9.9e15 + 9011 · 1e13 is the first position beyond 1e17
    recording = session.recording()
    found = rerun(recording)
    assert found.status == "diverged"
    assert found.reason == session.ended
    assert found.info["state_hash"] == recording.state_hash
