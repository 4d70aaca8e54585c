"""Sessions: seeking in time reproduces the same states."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Pull, Remove, SetParameter, Spawn, Strike, Switch
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import switch_engine
from sandbox.measure.run.sessions import rerun
from sandbox.recording import RecordedGame, Recording, ReplayCheck
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Frame
from sandbox.window.playback import follower as follower_module
from sandbox.window.playback import history as history_module
from sandbox.window.playback.follower import Follower
from sandbox.window.playback.history import Keyframe
from sandbox.window.playback.session import ReplayMismatchError, Session

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


SCENES = {name: load(find(name)) for name in ("bounce", "gas", "newtons_cradle")}
SCENES["pile"] = load(find("pile"), [("grid.ball.rows", 3), ("grid.ball.columns", 10)])  # smaller, for speed
FIRST = {"bounce": "ball", "gas": "atom-1", "newtons_cradle": "a", "pile": "ball-1"}


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.25, **more}


TABLE = loads('title = "Table"\n[billiards]\ntable = "pool-7ft"\ngame = "9-ball"\n')


def scene_of(*balls: dict[str, Any], **document: Any) -> Scene:
    return from_document({"ball": list(balls), **document})


def seek(session: Session, step: int) -> None:
    for fraction in session.seek(step):
        assert 0.0 < fraction <= 1.0


def step_times(session: Session, steps: int) -> Session:
    for _ in range(steps):
        session.advance()
    return session


def hashes(session: Session) -> dict[int, str]:
    stored = {k: session.history.get(k) for k in range(session.history.last_step + 1)}
    return {k: frame.state_hash() for k, frame in stored.items() if frame is not None}


def assert_replays(session: Session) -> None:
    """Assert that a headless replay of the session ends in the same state."""
    recording = session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("name", "after"), [("bounce", 0), ("bounce", 7), ("newtons_cradle", 0)])
def test_recording_keeps_the_future_after_seeking_back_until_an_action(name: str, after: int, engine: str) -> None:
    """`exact` rounds differently after a restart from a checkpoint; actions there must stay replayable."""
    session = Session(SCENES[name], engine)
    step_times(session, 40)
    session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(0.1 * float(session.bodies.mass[0]), 0.0)))
    step_times(session, 40)
    full_recording = session.recording()
    assert session.history.keyframe_steps or name != "bounce"
    current = max((step for step in session.history.keyframe_steps if step <= 60), default=50) + after
    for step in (60, 20, 0, current):
        seek(session, step)
        assert session.recording() == full_recording
        assert session.recording().at == pytest.approx(step * session.settings.dt)
        assert Recording.from_json(session.recording().to_json()).at == session.recording().at
    assert full_recording.at is None
    assert_replays(session)
    assert session.replaced is None
    session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(0.0, 0.0)))
    assert session.replaced is not None
    assert session.replaced.recording == full_recording
    assert session.replaced.time == pytest.approx(current * session.settings.dt)
    assert session.recording().duration == pytest.approx(current * session.settings.dt)
    assert_replays(session)
    step_times(session, 60)
    expected = hashes(session)
    for step in (current + 30, current - 10, current + 30, current, current + 60):
        seek(session, step)
        assert session.frame.state_hash() == expected[step]
    assert_replays(session)


@pytest.mark.parametrize(
    ("name", "engine", "with_actions"),
    [
        *(("bounce", engine, True) for engine in ENGINES),
        ("bounce", "exact", False),
        ("gas", "pymunk", True),
        ("newtons_cradle", "exact", True),
        ("newtons_cradle", "reference", False),
        ("pile", "pymunk", False),
        ("pile", "exact", True),
        ("pile", "reference", True),
    ],
)
def test_seeking_back_and_forth_reproduces_the_same_states(name: str, engine: str, with_actions: bool) -> None:
    session = Session(SCENES[name], engine)
    part = 2 if (name, engine) == ("pile", "exact") else 20  # rigid balls in a heap soon collide without end
    for k in range(7):
        step_times(session, part)
        if with_actions and k in (1, 3, 4):
            kick = float(session.bodies.mass[0]) * 0.3
            session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(kick, kick)))
    end, expected, actions = session.step_number, hashes(session), session.actions
    for step in (end - 1, end, 3, end // 2, 0, 2 * part + 1, 2 * part, 2 * part - 1, end):
        seek(session, step)
        assert session.step_number == step
        assert session.frame.state_hash() == expected[step]
        assert session.time == session.frame.time
    assert hashes(session) == expected
    assert [each for each in session.actions if each.kind != "switch"] == list(actions)
    step_times(session, 5)
    assert_replays(session)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["bounce", "newtons_cradle"])
def test_single_steps_and_a_batch_give_the_same_state(name: str, engine: str) -> None:
    slow, quick = step_times(Session(SCENES[name], engine), 150), Session(SCENES[name], engine)
    assert quick.advance(150) == 150
    assert quick.frame.state_hash() == slow.frame.state_hash()
    assert quick.previous.state_hash() == slow.previous.state_hash()
    seek(quick, 149)
    assert quick.frame.state_hash() == slow.previous.state_hash()


def test_action_after_seeking_back_discards_the_future() -> None:
    session = step_times(Session(SCENES["bounce"]), 50)
    session.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    step_times(session, 50)
    seek(session, 20)
    expected = hashes(session)
    with pytest.raises(ActionError, match="zzz"):
        session.apply(Remove(time=0.0, body="zzz"))
    assert session.actions == ()
    assert session.history.last_step == 100
    assert hashes(session) == expected  # a refused action keeps the future
    done = session.apply(Impulse(time=0.0, body="ball", impulse=(0.0, 2.0)))
    assert done.time == session.time
    assert session.history.last_step == 20
    assert session.actions == (done,)
    before = session.frame
    step_times(session, 100)
    assert session.frame.velocity[0, 0] == 0.0  # the kick to the right is discarded
    seek(session, 20)
    assert session.frame.state_hash() == before.state_hash()


def test_recorded_action_that_fails_ends_the_session_with_its_reason() -> None:
    session = Session(SCENES["bounce"], actions=(Remove(time=0.01, body="zzz"),))
    assert session.advance(50) == 10
    assert "no body is named 'zzz'" in (session.ended or "")
    seek(session, 5)
    assert session.ended is None
    session.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    assert session.advance(50) == 50


def test_saved_replay_of_a_game_keeps_what_the_recording_lacks() -> None:
    """Also a session that was changed lacks it; but the end of the program is that of the whole recording only."""
    impulse = Impulse(time=0.1, body="ball", impulse=(1.0, 0.0))
    played = step_times(Session(SCENES["bounce"], actions=(impulse,)), 30).recording()
    game = RecordedGame(("a joint",), ("a callback",), {"ball": (0.0,) * 6}, "hash", ReplayCheck(is_equal=True))
    session = Session.of_recording(replace(played, game=game), None)
    rest = replace(game, end={}, state_hash=None, replay=None)
    assert step_times(session, 29).recording().game == rest
    assert step_times(session, 1).recording() == replace(played, game=game)
    assert step_times(session, 1).recording().game == rest
    seek(session, 30)
    session.apply(impulse)
    assert session.recording().game == rest


def test_checkpoints_are_made_only_without_contacts() -> None:
    """A bouncing ball: checkpoints are made between landings, and not around them."""
    scene = scene_of(
        ball("a", 0, 2.25, restitution=1),
        plane=[{"point": [0, 0], "normal": [0, 1], "restitution": 1}],
        world={"gravity": [0, -10]},
    )
    session, contact_steps = Session(scene), []
    for _ in range(800):
        session.advance()
        if len(session.contacts()):
            contact_steps.append(session.step_number)
    assert len(contact_steps) >= 5
    assert len(session.history.keyframe_steps) >= 8
    assert all(
        step - 8 > max((t for t in contact_steps if t <= step), default=-9) for step in session.history.keyframe_steps
    )
    floor, world = [{"point": [0, 0], "normal": [0, 1]}], {"gravity": [0, -10]}
    assert step_times(Session(scene_of(ball("a", 0, 0.25), plane=floor, world=world)), 200).history.keyframe_steps == ()


def test_seek_from_a_checkpoint_makes_fewer_steps() -> None:
    session = Session(SCENES["bounce"])
    step_times(session, 400)
    seek(session, 399)
    assert 300 < session.simulation.work["substeps"] + session.history.keyframe_steps[-1] <= 400
    assert session.simulation.work["substeps"] < 60


@pytest.mark.parametrize("engine", ["exact", "reference"])
def test_snapshots_are_taken_in_the_midst_of_contacts(engine: str) -> None:
    floor, world = [{"point": [0, 0], "normal": [0, 1]}], {"gravity": [0, -10]}
    scene = scene_of(ball("a", 0, 0.25), ball("b", 0.6, 0.4, restitution=0.5), plane=floor, world=world)
    session = step_times(Session(scene, engine), 200)
    expected = hashes(session)
    assert len(session.history.keyframe_steps) >= 5
    for step in (150, 40, 199):
        seek(session, step)
        assert session.frame.state_hash() == expected[step]
    seek(session, 100)
    session.apply(Impulse(time=0.0, body="b", impulse=(0.0, 1.0)))
    step_times(session, 50)
    # A continuation from a snapshot is the session itself: no restart has to be recorded.
    assert [type(action) for action in session.recording().actions] == [Impulse]
    assert_replays(session)


def perturbed(keyframe: Keyframe) -> Keyframe:
    """Return a keyframe that replays differently: its bodies are slightly faster."""
    frame = keyframe.state.frame
    faster = Frame(
        frame.time, frame.position, frame.velocity * 1.001, frame.angle, frame.angular_velocity, frame.present
    )
    return keyframe._replace(state=replace(keyframe.state, frame=faster))


@pytest.mark.parametrize("while_playing", [False, True])
def test_checkpoint_that_replays_differently_disables_checkpoints(while_playing: bool) -> None:
    session = step_times(Session(SCENES["bounce"]), 200)
    expected = hashes(session)
    keyframe = session.history.keyframe_before(150)
    assert keyframe is not None
    session.history._keyframes = [perturbed(keyframe)]
    if while_playing:
        seek(session, keyframe.step)  # no mismatch can be detected yet
        with pytest.raises(ReplayMismatchError):
            session.advance(3)
        session.history.disable_checkpoints()
        seek(session, session.step_number)
    else:
        seek(session, 150)
    assert session.frame.state_hash() == expected[session.step_number]
    assert session.history.keyframe_steps == ()
    seek(session, 200)
    assert hashes(session) == expected
    step_times(session, 100)
    assert session.history.keyframe_steps == ()
    assert_replays(session)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_new_steps_after_a_checkpoint_are_reproduced(engine: str) -> None:
    """Balls fall freely, then pile up; a checkpoint does not hold the order in which contacts are solved."""
    scene = from_document(
        {
            "world": {"gravity": [0, -9.81]},
            "solver": {"dt": 0.005},
            "plane": [
                {"point": [0, 0], "normal": [0, 1], "restitution": 0.5, "friction": 0.5},
                {"point": [-3, 0], "normal": [1, 0.1]},
                {"point": [3, 0], "normal": [-1, 0.1]},
            ],
            "scatter": [
                {"count": 40, "lower": [-2.5, 3], "upper": [2.5, 9], "radius": 0.15, "velocity_jitter": 0.2,
                 "friction": 0.5, "restitution": 0.3},
            ],
        }
    )  # fmt: skip
    session = Session(scene, engine)
    while not session.history.keyframe_steps and session.step_number < 100:
        session.advance()
    step_times(session, 3)
    seek(session, session.step_number - 1)
    step_times(session, 300)
    expected = hashes(session)
    assert_replays(session)
    seek(session, 20)
    seek(session, 300)
    assert session.frame.state_hash() == expected[300]


def test_pull_is_released_when_its_later_release_is_discarded() -> None:
    session = step_times(Session(scene_of(ball("a", 0, 0), ball("b", 9, 9))), 5)
    session.apply(Pull(time=0.0, body="a", target=(3.0, 0.0)))
    step_times(session, 20)
    session.apply(Pull(time=0.0, body="a"))
    step_times(session, 20)
    seek(session, 10)
    session.apply(Impulse(time=0.0, body="b", impulse=(1.0, 0.0)))
    velocity = session.frame.velocity[0].tolist()
    assert velocity[0] > 0.0
    assert step_times(session, 50).frame.velocity[0].tolist() == velocity
    assert_replays(session)
    seek(session, 10)
    session.apply(Pull(time=0.0, body="a", target=(1.0, 0.0)))  # a continued pull stays active
    assert step_times(session, 150).frame.position[0] == pytest.approx([1.0, 0.0], abs=1e-9)  # (1 + ωt)·e^{−ωt}


def test_seek_works_with_a_history_limited_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        history_module, "MAX_BYTES", 20 * (225 * history_module.BYTES_PER_BODY + history_module.BYTES_PER_FRAME)
    )
    session = Session(SCENES["gas"])
    expected = {0: session.frame.state_hash()}
    for _ in range(100):
        session.advance()
        expected[session.step_number] = session.frame.state_hash()
    stored = hashes(session)
    assert len(stored) <= 20
    assert {0, 100} <= set(stored)
    for step in (99, 50, 7):
        seek(session, step)
        assert session.frame.state_hash() == expected[step]


FAST = scene_of(ball("a", 9.9e15, 0, velocity=[1e12, 0]), solver={"dt": 10.0})
"""It is beyond 1e17 m after 9011 steps."""
DRAGGED = scene_of(
    ball("a", 0, 0, velocity=[1e12, 0]),
    world={"quadratic_drag": 1e9},
    solver={"dt": 10.0, "integrator": "explicit_euler"},
)
"""The first step reverses the ball, at 1e34 m/s."""


@pytest.mark.parametrize(
    ("scene", "engine", "end", "remedy"),
    [
        (FAST, "exact", 9011, Impulse(time=0.0, body="a", impulse=(-2e12, 0.0))),
        (FAST, "reference", 9011, Impulse(time=0.0, body="a", impulse=(-2e12, 0.0))),
        (DRAGGED, "reference", 1, SetParameter(time=0.0, path="world.quadratic_drag", value=0.0)),
    ],
)
def test_diverged_session_can_be_sought_back_and_changed(scene: Scene, engine: str, end: int, remedy: Action) -> None:
    session = Session(scene, engine)
    begin = session.frame.state_hash()
    assert session.advance(20_000) == end
    assert "out of range" in (session.ended or "")
    assert session.advance(5) == 0
    with pytest.raises(ActionError, match="ended"):
        session.apply(Remove(time=0.0, body="a"))
    seek(session, 20_000)  # it stays at its end
    assert session.step_number == end
    seek(session, end - 1)
    assert session.ended is None
    assert (session.frame.state_hash() == begin) == (end == 1)
    session.apply(remedy)
    assert session.advance(100) == 100
    assert abs(session.frame.position[0, 0]) < 1e17


def test_step_that_exceeds_the_time_limit_is_not_recorded() -> None:
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])  # some 200,000 impacts in 10 s
    session = step_times(Session(gas, "exact"), 3)
    session.apply(Switch(time=0.0, settings={"dt": 10.0}))
    expected = hashes(session)
    session.simulation.patience = 0.0
    assert session.advance(5) == 0
    assert "takes longer" in (session.ended or "")
    assert hashes(session) == expected
    assert session.recording().state_hash is None
    assert session.recording().duration == session.history.end_time
    seek(session, 1)
    assert session.ended is None
    assert session.frame.state_hash() == expected[1]
    seek(session, 3)
    assert session.frame.state_hash() == expected[3]


def test_steps_before_one_that_exceeds_the_time_limit_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The engine stopped within the following step, so its current state is not the state of a step."""
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])
    session = Session(gas, "exact")
    due = Switch(time=session.settings.dt * 3, settings={"dt": 10.0})
    session = Session(gas, "exact", actions=(due,))
    session.simulation.patience = 0.0
    assert session.advance(9) == 3
    assert session.ended is not None
    assert set(hashes(session)) == {0}
    seek(session, 2)
    assert session.ended is None
    other = Session(gas, "exact")
    other.advance(2)
    assert session.frame.state_hash() == other.frame.state_hash()
    seek(session, 3)
    assert session.step_number == 3


def test_seek_can_be_replaced_by_another() -> None:
    session = step_times(Session(SCENES["newtons_cradle"]), 300)
    expected = hashes(session)
    first: Iterator[float] = session.seek(5)
    next(first)
    second = session.seek(290)
    next(second)
    seek(session, 120)
    assert session.frame.state_hash() == expected[120]
    for _ in second:  # an abandoned seek still reaches its target when continued
        pass
    assert session.step_number == 290
    assert session.frame.state_hash() == expected[290]
    seek(session, -5)
    assert session.step_number == 0


def test_switch_reports_settings_that_the_other_engine_chooses() -> None:
    scene = SCENES["bounce"]
    session = step_times(Session(scene, "reference", scene.solver.replace(integrator="rk4", detection="swept")), 9)
    note = switch_engine(session, "pymunk")
    assert note is not None
    assert note.startswith("chosen by pymunk: ")
    assert "integrator" in note
    assert session.engine == "pymunk"
    assert session.settings.dt == scene.solver.dt
    assert switch_engine(session, "exact") is None
    assert_replays(step_times(session, 9))
    before = session.frame.state_hash()
    with pytest.raises(ActionError, match="zzz"):
        switch_engine(session, "zzz")
    assert session.frame.state_hash() == before


operations = st.one_of(
    st.tuples(st.just("on"), st.integers(1, 60)),
    st.tuples(st.just("to"), st.integers(0, 150)),
    st.tuples(st.just("act"), st.integers(0, 5)),
    st.tuples(st.just("part"), st.integers(0, 150)),
    st.tuples(st.just("follow"), st.integers(1, 40)),
)
ACTIONS: list[Action] = [
    Impulse(time=0.0, body="a", impulse=(0.1, 0.4)),
    Pull(time=0.0, body="a", target=(0.5, 2.0)),
    Pull(time=0.0, body="a"),
    Switch(time=0.0, settings={"dt": 0.013}),
    Spawn(time=0.0, ball=Ball(position=(4.0, 9.0), radius=0.2, restitution=0.5)),
    Remove(time=0.0, body="b"),
]
TWO = scene_of(
    ball("a", 0, 3, restitution=0.9, mass=0.1), ball("b", 2, 2, velocity=[-1, 3], restitution=0.9),
    plane=[{"point": [0, 0], "normal": [0, 1], "restitution": 1}],
    world={"gravity": [0, -9.81]},
)  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
@given(plan=st.lists(operations, max_size=12))
# Step 62 of this example reveals that step 47 was unconfirmed.
@example(plan=[("on", 60), ("act", 0), ("on", 20), ("follow", 5), ("to", 79), ("act", 1), ("on", 9), ("to", 85)])
@example(plan=[("on", 1), ("on", 29), ("to", 29), ("to", 111), ("to", 47), ("on", 15)])
def test_confirmed_steps_are_unchanged_by_any_order_of_operations(engine: str, plan: list[tuple[str, int]]) -> None:
    session = Session(TWO, engine)
    for kind, number in plan:
        expected = {k: v for k, v in hashes(session).items() if k not in session.replay.unconfirmed}
        match kind:
            case "on":
                try:
                    assert session.advance(number) == number
                except ReplayMismatchError:
                    session.history.disable_checkpoints()
                    seek(session, session.step_number)
            case "to":
                seek(session, number)
                assert session.step_number == number
            case "part":
                next(session.seek(number), None)
            case "follow":
                with pytest.MonkeyPatch.context() as patch:
                    patch.setattr(follower_module, "MIN_FOLLOWED", 1)
                    patch.setattr(Follower, "lag", number)
                    for _ in range(2):  # the follower starts, and moves
                        session.follow(perf_counter() + 1e9, is_idle=True)
            case _:
                try:
                    session.apply(ACTIONS[number])
                except ActionError:
                    continue
                expected = {k: v for k, v in expected.items() if k < session.step_number}
        assert session.ended is None
        now = hashes(session)
        assert {k: now[k] for k in expected} == expected
        times = [frame.time for k in now if (frame := session.history.get(k)) is not None]
        assert all(a < b for a, b in pairwise(times))
        assert np.isfinite(session.frame.position).all()
    seek(session, session.step_number + 1)
    assert_replays(session)


def test_frames_of_a_mismatched_replay_are_discarded() -> None:
    session = Session(TABLE, "exact")
    session.apply(Strike(time=0.0, ball="cue", aim=1.5, speed=4.0))
    while session.step_number < 300:
        session.advance(3)
    before = hashes(session)
    seek(session, 250)
    assert all(hashes(session)[step] == state for step, state in before.items())
    assert_replays(session)
    session.history.add_keyframe(Keyframe(150, 1, session.simulation.checkpoint()))  # of another time
    seek(session, 200)
    assert all(hashes(session)[step] == state for step, state in before.items())
    seek(session, 300)
    assert hashes(session)[300] == before[300]
