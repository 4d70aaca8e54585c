"""Sessions: back and forth through time, the same states every time."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, SetParameter, Spawn, Strike, Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES, UnknownEngineError
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Frame
from sandbox.window.playback import history as history_module
from sandbox.window.playback.history import Keyframe
from sandbox.window.playback.live import switch_engine
from sandbox.window.playback.session import ReplayMismatchError, Session

pytestmark = pytest.mark.full  # property tests with many examples


def shipped(name: str) -> Scene:
    scene = load(find(name))
    if name == "pile":  # as it is, but smaller
        scene = load(find(name), [("grid.ball.rows", 3), ("grid.ball.columns", 10)])
    return scene


SCENES = {name: shipped(name) for name in ("bounce", "gas", "newtons_cradle", "pile")}
FIRST = {"bounce": "ball", "gas": "atom-1", "newtons_cradle": "a", "pile": "ball-1"}


def ball(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"name": name, "position": [x, y], "radius": 0.25, **more}


TABLE = loads('title = "Table"\n[billiards]\ntable = "pool-7ft"\ngame = "9-ball"\n')


def scene_of(*balls: dict[str, Any], **document: Any) -> Scene:
    return from_document({"ball": list(balls), **document})


def go(session: Session, step: int) -> None:
    for share in session.seek(step):
        assert 0.0 < share <= 1.0


def played(session: Session, steps: int) -> Session:
    for _ in range(steps):
        session.advance()
    return session


def hashes(session: Session) -> dict[int, str]:
    kept = {k: session.history.get(k) for k in range(session.history.last_step + 1)}
    return {k: frame.state_hash() for k, frame in kept.items() if frame is not None}


def assert_replays(session: Session) -> None:
    """Assert that the session without its window ends in the same state."""
    recording = session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["bounce", "newtons_cradle"])
def test_recording_keeps_what_came_after_the_moment_it_has_gone_back_to(name: str, engine: str) -> None:
    session = Session(SCENES[name], engine)
    played(session, 40)
    session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(0.1 * float(session.bodies.mass[0]), 0.0)))
    played(session, 40)
    whole = session.recording()
    for step in (60, 20, 0, 50):
        go(session, step)
        assert session.recording() == whole
        assert session.recording().at == pytest.approx(step * session.settings.dt)
        assert Recording.from_json(session.recording().to_json()).at == session.recording().at
    assert whole.at is None
    assert_replays(session)
    assert session.replaced is None
    session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(0.0, 0.0)))
    assert session.replaced is not None
    assert session.replaced.recording == whole
    assert session.replaced.time == pytest.approx(50 * session.settings.dt)
    assert session.recording().duration == pytest.approx(50 * session.settings.dt)
    assert_replays(session)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("acting", [False, True], ids=["untouched", "acted on"])
def test_way_back_and_forth_leads_through_the_same_states(name: str, engine: str, acting: bool) -> None:
    session = Session(SCENES[name], engine)
    part = 2 if (name, engine) == ("pile", "exact") else 20  # rigid balls in a heap soon touch without end
    for k in range(7):
        played(session, part)
        if acting and k in (1, 3, 4):
            kick = float(session.bodies.mass[0]) * 0.3
            session.apply(Impulse(time=0.0, body=FIRST[name], impulse=(kick, kick)))
    end, seen, actions = session.step_number, hashes(session), session.actions
    for step in (end - 1, end, 3, end // 2, 0, 2 * part + 1, 2 * part, 2 * part - 1, end):
        go(session, step)
        assert session.step_number == step
        assert session.frame.state_hash() == seen[step]
        assert session.time == session.frame.time
    assert hashes(session) == seen
    assert [each for each in session.actions if each.kind != "switch"] == list(actions)
    played(session, 5)
    assert_replays(session)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["bounce", "newtons_cradle"])
def test_steps_one_by_one_and_many_at_once_are_the_same(name: str, engine: str) -> None:
    slow, quick = played(Session(SCENES[name], engine), 150), Session(SCENES[name], engine)
    assert quick.advance(150) == 150
    assert quick.frame.state_hash() == slow.frame.state_hash()
    assert quick.previous.state_hash() == slow.previous.state_hash()
    go(quick, 149)
    assert quick.frame.state_hash() == slow.previous.state_hash()


def test_what_is_done_after_going_back_cuts_the_future() -> None:
    session = played(Session(SCENES["bounce"]), 50)
    session.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    played(session, 50)
    go(session, 20)
    assert session.actions == ()
    assert session.history.last_step == 100
    done = session.apply(Impulse(time=0.0, body="ball", impulse=(0.0, 2.0)))
    assert done.time == session.time
    assert session.history.last_step == 20
    assert session.actions == (done,)
    before = session.frame
    played(session, 100)
    assert session.frame.velocity[0, 0] == 0.0  # the kick to the right is forgotten
    go(session, 20)
    assert session.frame.state_hash() == before.state_hash()


def test_refused_action_changes_nothing_and_keeps_the_future() -> None:
    session = played(Session(SCENES["bounce"]), 50)
    seen = hashes(session)
    go(session, 20)
    with pytest.raises(ActionError, match="zzz"):
        session.apply(Remove(time=0.0, body="zzz"))
    assert session.actions == ()
    assert hashes(session) == seen


def test_actions_of_a_recording_are_done_again_on_the_way() -> None:
    first = played(Session(SCENES["gas"]), 20)
    first.apply(Move(time=0.0, body="atom-1", position=(0.6, 0.6), velocity=(0.0, 3.0)))
    played(first, 20)
    first.apply(SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]))
    again = Session(SCENES["gas"], actions=first.actions)
    assert again.advance(40) == 40
    assert again.frame.state_hash() == first.frame.state_hash()
    assert again.actions == first.actions


def test_recorded_action_that_the_engine_cannot_do_ends_the_session_and_says_so() -> None:
    session = Session(SCENES["bounce"], actions=(Remove(time=0.01, body="zzz"),))
    assert session.advance(50) == 10
    assert session.ended is not None
    assert "no body is named 'zzz'" in session.ended
    go(session, 5)
    assert session.ended is None
    session.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    assert session.advance(50) == 50


def test_checkpoints_stand_where_nothing_touches() -> None:
    """A ball that lands now and then: between landings there is room for checkpoints, around them none."""
    scene = scene_of(
        ball("a", 0, 2.25, restitution=1),
        plane=[{"point": [0, 0], "normal": [0, 1], "restitution": 1}],
        world={"gravity": [0, -10]},
    )
    session, touched = Session(scene), []
    for _ in range(800):
        session.advance()
        if len(session.contacts()):
            touched.append(session.step_number)
    assert len(touched) >= 5
    assert len(session.history.keyframe_steps) >= 8
    assert all(step - 8 > max((t for t in touched if t <= step), default=-9) for step in session.history.keyframe_steps)
    floor, world = [{"point": [0, 0], "normal": [0, 1]}], {"gravity": [0, -10]}
    assert played(Session(scene_of(ball("a", 0, 0.25), plane=floor, world=world)), 200).history.keyframe_steps == ()


def test_way_from_a_checkpoint_is_shorter() -> None:
    session = Session(SCENES["bounce"])
    played(session, 400)
    go(session, 399)
    assert 300 < session.simulation.work["substeps"] + session.history.keyframe_steps[-1] <= 400
    assert session.simulation.work["substeps"] < 60


def doctored(mark: Keyframe) -> Keyframe:
    """Return a checkpoint that leads elsewhere: a body is a little faster than it was."""
    frame = mark.point.frame
    faster = Frame(
        frame.time, frame.position, frame.velocity * 1.001, frame.angle, frame.angular_velocity, frame.present
    )
    return mark._replace(point=replace(mark.point, frame=faster))


def test_checkpoint_that_leads_elsewhere_is_not_trusted_again() -> None:
    session = played(Session(SCENES["bounce"]), 200)
    seen = hashes(session)
    mark = session.history.keyframe_before(150)
    assert mark is not None
    session.history.truncate(200)
    session.history._keyframes = [doctored(mark)]
    go(session, 150)
    assert session.frame.state_hash() == seen[150]
    assert session.history.keyframe_steps == ()
    go(session, 199)
    assert hashes(session) == seen
    played(session, 100)
    assert session.history.keyframe_steps == ()
    assert_replays(session)


def test_wrong_way_that_is_noticed_while_playing_is_left_by_seeking_the_same_step() -> None:
    session = played(Session(SCENES["bounce"]), 200)
    seen = hashes(session)
    mark = session.history.keyframe_before(150)
    assert mark is not None
    session.history._keyframes = [doctored(mark)]
    go(session, mark.step)  # nothing can be noticed yet
    with pytest.raises(ReplayMismatchError):
        session.advance(3)
    session.history.disable_checkpoints()
    step = session.step_number
    go(session, step)
    assert session.frame.state_hash() == seen[step]
    go(session, 200)
    assert hashes(session) == seen


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("after", [0, 1, 20])
def test_session_that_goes_on_from_a_checkpoint_can_be_found_again_and_replayed(engine: str, after: int) -> None:
    """`exact` rounds otherwise once it was taken up again; who acts there must not lose the way back."""
    session = played(Session(load(find("fireworks")), engine), 100)
    mark = session.history.keyframe_steps[-1] if session.history.keyframe_steps else 90
    go(session, mark + after if mark + after < 100 else 99)
    here = session.step_number
    session.apply(Impulse(time=0.0, body="spark-1", impulse=(0.1, 0.3)))
    played(session, 60)
    seen = hashes(session)
    assert_replays(session)
    for step in (here + 30, here - 20, here + 30, here, here + 60):
        go(session, step)
        assert session.frame.state_hash() == seen[step]
    assert_replays(session)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_what_nobody_has_seen_is_found_again_also_from_a_checkpoint(engine: str) -> None:
    """Sixty balls fall freely, then pile up: in what order contacts are solved is not in a checkpoint."""
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
    played(session, 3)
    go(session, session.step_number - 1)
    played(session, 300)
    seen = hashes(session)
    assert_replays(session)
    go(session, 20)
    go(session, 300)
    assert session.frame.state_hash() == seen[300]


def test_hand_that_was_to_let_go_later_lets_go_when_that_is_forgotten() -> None:
    session = played(Session(scene_of(ball("a", 0, 0), ball("b", 9, 9))), 5)
    session.apply(Pull(time=0.0, body="a", target=(3.0, 0.0)))
    played(session, 20)
    session.apply(Pull(time=0.0, body="a"))
    played(session, 20)
    go(session, 10)
    session.apply(Impulse(time=0.0, body="b", impulse=(1.0, 0.0)))
    velocity = session.frame.velocity[0].tolist()
    assert velocity[0] > 0.0
    assert played(session, 50).frame.velocity[0].tolist() == velocity
    assert_replays(session)
    go(session, 10)
    session.apply(Pull(time=0.0, body="a", target=(1.0, 0.0)))  # who goes on pulling goes on
    assert played(session, 150).frame.position[0] == pytest.approx([1.0, 0.0], abs=1e-9)  # (1 + ωt)·e^{−ωt}


def test_memory_is_bounded_with_many_bodies_and_the_way_back_is_found_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        history_module, "MAX_BYTES", 20 * (225 * history_module.BYTES_PER_BODY + history_module.BYTES_PER_FRAME)
    )
    session = Session(SCENES["gas"])
    seen = {0: session.frame.state_hash()}
    for _ in range(100):
        session.advance()
        seen[session.step_number] = session.frame.state_hash()
    kept = hashes(session)
    assert len(kept) <= 20
    assert {0, 100} <= set(kept)
    for step in (99, 50, 7):
        go(session, step)
        assert session.frame.state_hash() == seen[step]


def diverging(engine: str) -> Session:
    moving = ball("a", 9.9e15, 0, velocity=[1e12, 0])
    return Session(scene_of(moving, solver={"dt": 10.0}), engine, None)


@pytest.mark.parametrize("engine", ["exact", "reference"])
def test_session_that_diverged_can_go_back_and_elsewhere(engine: str) -> None:
    session = diverging(engine)
    assert session.advance(20_000) == 9011  # the first beyond 1e17 m
    assert session.ended is not None
    assert "out of range" in session.ended
    assert session.advance(5) == 0
    with pytest.raises(ActionError, match="ended"):
        session.apply(Remove(time=0.0, body="a"))
    go(session, 20_000)  # it is still there
    assert session.step_number == 9011
    go(session, 9010)
    assert session.ended is None
    session.apply(Impulse(time=0.0, body="a", impulse=(-2e12, 0.0)))
    assert session.advance(100) == 100
    assert session.frame.position[0, 0] < 1e17


def test_divergence_at_the_first_step_leaves_the_start() -> None:
    """Explicit Euler with drag of 1e9 / m at 1e12 m/s: the first step turns it around at 1e34 m/s."""
    scene = scene_of(ball("a", 0, 0, velocity=[1e12, 0]), world={"quadratic_drag": 1e9}, solver={"dt": 10.0})
    session = Session(scene, "reference", scene.solver.replace(integrator="explicit_euler"))
    begin = session.frame.state_hash()
    assert session.advance(9) == 1
    assert session.ended is not None
    go(session, 9)
    assert session.step_number == 1
    go(session, 0)
    assert session.ended is None
    assert session.frame.state_hash() == begin
    session.apply(SetParameter(time=0.0, path="world.quadratic_drag", value=0.0))
    assert session.advance(9) == 9


def test_exhausted_step_is_none_of_the_sessions_and_it_can_go_back() -> None:
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])  # some 200,000 impacts in 10 s
    session = played(Session(gas, "exact"), 3)
    session.apply(Switch(time=0.0, settings={"dt": 10.0}))
    seen = hashes(session)
    session.simulation.patience = 0.0
    assert session.advance(5) == 0
    assert session.ended is not None
    assert "takes longer" in session.ended
    assert hashes(session) == seen
    assert session.recording().state_hash is None
    assert session.recording().duration == session.history.end_time
    go(session, 1)
    assert session.ended is None
    assert session.frame.state_hash() == seen[1]
    go(session, 3)
    assert session.frame.state_hash() == seen[3]


def test_steps_before_an_exhausted_one_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within the step after them the engine gave up: what it shows then is no state of theirs."""
    gas = load(find("gas"), [("grid.atom.velocity_jitter", 100.0)])
    session = Session(gas, "exact")
    due = Switch(time=session.settings.dt * 3, settings={"dt": 10.0})
    session = Session(gas, "exact", actions=(due,))
    session.simulation.patience = 0.0
    assert session.advance(9) == 3
    assert session.ended is not None
    assert set(hashes(session)) == {0}
    go(session, 2)
    assert session.ended is None
    other = Session(gas, "exact")
    other.advance(2)
    assert session.frame.state_hash() == other.frame.state_hash()
    go(session, 3)
    assert session.step_number == 3


def test_seek_can_be_given_up_for_another() -> None:
    session = played(Session(SCENES["newtons_cradle"]), 300)
    seen = hashes(session)
    first: Iterator[float] = session.seek(5)
    next(first)
    second = session.seek(290)
    next(second)
    go(session, 120)
    assert session.frame.state_hash() == seen[120]
    for _ in second:  # who goes on with what was given up gets there, too
        pass
    assert session.step_number == 290
    assert session.frame.state_hash() == seen[290]
    go(session, -5)
    assert session.step_number == 0


def test_switch_leaves_to_the_other_engine_what_it_does_not_know() -> None:
    scene = SCENES["bounce"]
    session = played(Session(scene, "reference", scene.solver.replace(integrator="rk4", detection="swept")), 9)
    note = switch_engine(session, "pymunk")
    assert note is not None
    assert note.startswith("chosen by pymunk: ")
    assert "integrator" in note
    assert session.engine == "pymunk"
    assert session.settings.dt == scene.solver.dt
    assert switch_engine(session, "exact") is None
    assert_replays(played(session, 9))
    before = session.frame.state_hash()
    with pytest.raises(ActionError, match="zzz"):
        switch_engine(session, "zzz")
    assert session.frame.state_hash() == before


def test_engine_that_cannot_start_is_refused() -> None:
    with pytest.raises(UnknownEngineError):
        Session(SCENES["bounce"], "zzz")
    with pytest.raises(Refusal):
        Session(scene_of(ball("a", 0, 0), ball("b", 0.1, 0)), "exact")


ODD: dict[str, Scene] = {
    "empty": from_document({"title": "nothing"}),
    "planes": from_document({"plane": [{"point": [0, 0], "normal": [0, 1]}], "world": {"gravity": [0, -9.81]}}),
    "fixed": scene_of(ball("a", 0, 0, fixed=True), ball("b", 9, 0, fixed=True)),
    "leaves": scene_of(ball("a", 0, 0, velocity=[99, 0]), world={"bounds": [[-1, -1], [1, 1]]}),
    "long step": scene_of(ball("a", 0, 0, velocity=[1, 0]), world={"duration": 0.1}, solver={"dt": 10.0}),
}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ODD)
def test_odd_scenes_are_played_back_and_forth(name: str, engine: str) -> None:
    session = played(Session(ODD[name], engine), 70)
    seen = hashes(session)
    session.apply(Spawn(time=0.0, ball=Ball(position=(0.0, 0.5), radius=0.1)))
    played(session, 5)
    assert_replays(session)
    go(session, 30)
    assert session.frame.state_hash() == seen[30]
    go(session, 75)
    assert len(session.bodies) == len(ODD[name].bodies) + 1
    assert_replays(session)


def test_hundred_thousand_sparks_go_back() -> None:
    session = Session(load(find("fireworks_100k")))
    session.advance(3)
    before = session.frame.state_hash()
    session.advance(5)
    go(session, 3)
    assert session.frame.state_hash() == before


moves = st.one_of(
    st.tuples(st.just("on"), st.integers(1, 60)),
    st.tuples(st.just("to"), st.integers(0, 150)),
    st.tuples(st.just("act"), st.integers(0, 5)),
    st.tuples(st.just("part"), st.integers(0, 150)),
)
DEEDS: list[Action] = [
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
@given(plan=st.lists(moves, max_size=12))
@example(plan=[("on", 1), ("on", 29), ("to", 29), ("to", 111), ("to", 47), ("on", 15)])  # 62 tells that 47 was unsure
@settings(max_examples=30)
def test_in_any_order_of_moves_a_step_is_what_it_was(engine: str, plan: list[tuple[str, int]]) -> None:
    session = Session(TWO, engine)
    for kind, number in plan:
        seen = {k: v for k, v in hashes(session).items() if k not in session.unconfirmed_steps}
        match kind:
            case "on":
                try:
                    assert session.advance(number) == number
                except ReplayMismatchError:
                    session.history.disable_checkpoints()
                    go(session, session.step_number)
            case "to":
                go(session, number)
                assert session.step_number == number
            case "part":
                next(session.seek(number), None)
            case _:
                try:
                    session.apply(DEEDS[number])
                except ActionError:
                    continue
                seen = {k: v for k, v in seen.items() if k < session.step_number}
        assert session.ended is None
        now = hashes(session)
        assert {k: now[k] for k in seen} == seen
        times = [frame.time for k in now if (frame := session.history.get(k)) is not None]
        assert all(a < b for a, b in pairwise(times))
        assert np.isfinite(session.frame.position).all()
    go(session, session.step_number + 1)
    assert_replays(session)


def struck(aim: float, speed: float, steps: int) -> Session:
    """Return a session of a table in which the cue ball was struck, and some steps made, not all of them looked at."""
    session = Session(TABLE, "exact")
    session.apply(Strike(time=0.0, ball="cue", aim=aim, speed=speed))
    while session.step_number < steps:
        session.advance(3)
    return session


@pytest.mark.parametrize("seed", range(4))
def test_balls_on_a_floor_go_back_and_forth_to_the_same_states(seed: int) -> None:
    random = np.random.default_rng(seed)
    session = struck(1.5708 + random.uniform(-0.2, 0.2), random.uniform(2.0, 6.0), 600)
    before = hashes(session)
    for target in random.integers(0, session.history.last_step, 6).tolist():
        go(session, target)
        assert all(hashes(session)[step] == state for step, state in before.items())
    assert_replays(session)


def test_what_a_wrong_way_has_shown_is_forgotten() -> None:
    session = struck(1.5, 4.0, 300)
    before = hashes(session)
    session.history.add_keyframe(Keyframe(150, 1, session.simulation.checkpoint()))  # of quite another time
    go(session, 200)
    assert all(hashes(session)[step] == state for step, state in before.items())
    go(session, 300)
    assert hashes(session)[300] == before[300]


def test_retracted_action_and_what_it_led_to_are_gone() -> None:
    session = Session(TABLE, "exact")
    untouched = session.simulation.state_hash()
    session.apply(Move(time=0.0, body="cue", position=(0.4, 0.3)))
    moved = session.simulation.state_hash()
    session.apply(Strike(time=0.0, ball="cue", aim=1.5, speed=3.0))
    played(session, 50)
    go(session, session.retract(1))
    assert session.simulation.state_hash() == moved
    assert len(session.actions) == 1
    assert session.history.last_step == 0
    played(session, 10)
    assert not session.frame.velocity.any()
    assert_replays(session)
    go(session, session.retract(0))
    assert session.simulation.state_hash() == untouched
    assert session.actions == ()
