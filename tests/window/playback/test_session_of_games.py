"""Sessions of games: seeking restores the rules with the state, and a recording replays the same game."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Switch
from sandbox.games.session import GameSession
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.playback.session import ReplayMismatchError, Session
from tests.toy_game import Toy, toy_game, toy_scene

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Toy)


def seek(session: Session, step: int) -> None:
    for _ in session.seek(step):
        pass


def advance_or_reseek(session: Session, steps: int) -> None:
    """Advance as the window does, which seeks again after the mismatch of a checkpoint."""
    try:
        session.advance(steps)
    except ReplayMismatchError:
        session.history.disable_checkpoints()
        seek(session, session.step_number)


def rules_of(session: Session) -> Toy:
    assert session.game is not None
    rules = session.game.rules
    assert isinstance(rules, Toy)
    return rules


def full_state(session: Session) -> tuple[Any, ...]:
    rules = rules_of(session)
    return rules.score, tuple(rules.display_lines()), session.frame.state_hash(), session.game and session.game.presses


def session_of(engine: str = "pymunk") -> Session:
    scene = toy_scene()
    return Session(scene, engine, game=toy_game(scene))


def assert_replays(session: Session) -> None:
    """Assert that state and score at the end are equal in a headless replay and in another session."""
    recording = Recording.from_json(session.recording().to_json())
    if recording.at is None:
        assert recording.score == rules_of(session).score
    else:
        assert recording.at == session.time
    run = rerun(recording, audit=False)
    assert run.info["state_hash"] == recording.state_hash
    assert run.info["game"]["score"] == recording.score
    assert run.info["game"]["otherwise"] is None
    game = GameSession(Toy(recording.scene, recording.scene.bodies), recording.presses)
    other = Session(recording.scene, recording.engine, recording.settings, recording.actions, game, recording.duration)
    seek(other, round(recording.duration / other.scene.solver.dt))
    assert other.recording() == recording
    assert other.game is not None
    assert other.game.diverged_at is None


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_actions_of_rules_are_recorded(engine: str) -> None:
    session = session_of(engine)
    session.advance(300)
    assert rules_of(session).score >= 3
    kinds = [action.kind for action in session.actions]
    assert "spawn" in kinds
    assert len(session.bodies) == 1 + kinds.count("spawn")
    assert_replays(session)


def test_seeking_restores_the_rules() -> None:
    session = session_of()
    states = {0: full_state(session)}
    for k in range(1, 241):
        if k == 50:
            session.apply_input("aim", 0.9)
        if k == 80:
            (kick,) = session.apply_input("kick", 1.0)
            assert kick.time == session.time
        session.advance()
        states[k] = full_state(session)
    for step in (239, 120, 60, 79, 80, 50, 49, 0, 200, 240):
        seek(session, step)
        # A press is repeated at its time, so a seek to steps 49 and 79 includes the press made after that step.
        if step not in (49, 79):
            assert full_state(session) == states[step], step
    assert_replays(session)


def test_checkpoints_hold_the_game() -> None:
    scene = toy_scene(gravity=[0.0, -0.5])  # a long fall without contacts, so checkpoints are made
    session = Session(scene, "pymunk", game=toy_game(scene))
    session.apply_input("aim", 0.25)
    for _ in range(150):
        session.advance()
    assert session.history.keyframe_steps
    session.apply_input("kick", 1.0)
    session.advance(5)
    seek(session, 149)
    assert ("aim", "0.25") in rules_of(session).display_lines()
    session.apply_input("kick", 1.0)  # a different continuation
    session.advance(100)
    assert rules_of(session).score == 0.5
    assert_replays(session)


def test_press_in_the_past_discards_later_presses_also_in_a_replay_on_another_engine() -> None:
    session = session_of()
    session.advance(30)
    session.apply_input("kick", 1.0)
    session.advance(30)
    session.apply_input("kick", 1.0)
    seek(session, 40)
    session.apply_input("aim", 0.1)
    session.advance(60)
    assert session.game is not None
    assert [press.control for press in session.game.presses] == ["kick", "aim"]
    assert_replays(session)
    other = rerun(session.recording(), "reference", audit=False)
    assert other.info["game"]["presses"] == [list(press) for press in session.recording().presses]
    assert other.status == "ok"


def test_user_actions_and_engine_switches_are_part_of_a_game() -> None:
    session = session_of()
    session.advance(30)
    session.apply(Impulse(time=0.0, body="a", impulse=(0.0, 1.0)))  # an action of the user
    session.advance(30)
    session.apply(Switch(time=0.0, engine="reference"))
    session.advance(60)
    score = rules_of(session).score
    assert score % 1.0 == 0.5
    assert_replays(session)


def test_game_that_is_over_ignores_presses() -> None:
    session = session_of()
    rules_of(session).ends_at = 1.0
    # A seek starts from this copy, which needs the same end.
    assert session._initial_game is not None
    session._initial_game.rules.ends_at = 1.0  # type: ignore[attr-defined]
    session.advance(150)
    assert rules_of(session).game_over == "enough"
    assert session.apply_input("kick", 1.0) == ()
    score = rules_of(session).score
    session.advance(100)
    assert rules_of(session).score == score
    seek(session, 10)
    assert rules_of(session).game_over is None


@pytest.mark.parametrize("steps", [0, 40])
def test_refused_press_changes_nothing(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of()
    session.apply_input("aim", 0.3)
    session.advance(30)
    session.apply_input("kick", 1.0)
    session.advance(90)
    session.apply_input("aim", 0.7)  # at the same time as the refused one
    seek(session, 90)
    seek(session, 120 - steps)  # 0: at the end; 40: with later presses and actions

    def everything() -> tuple[Any, ...]:
        return full_state(session), session.actions, session.log.has_future, session.game and session.game.all_presses

    before = everything()
    recording = session.recording()
    original = Toy.on_input

    def kick_twice(rules: Toy, control: str, value: float) -> tuple[Action, ...]:
        if value != 5.0:  # repeated presses are unchanged
            return tuple(original(rules, control, value))
        rules.score += 100.0
        return tuple(Impulse(time=0.0, body=body, impulse=(1.0, 0.0)) for body in ("a", "zzz"))

    monkeypatch.setattr(Toy, "on_input", kick_twice)
    with pytest.raises(ActionError, match="zzz"):
        session.apply_input("kick", 5.0)
    assert everything() == before
    assert session.recording() == recording
    assert_replays(session)
    advance_or_reseek(session, 60)
    assert_replays(session)


def test_press_does_not_copy_the_game(monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of()
    session.advance(10)
    monkeypatch.setattr(GameSession, "copy", lambda _: pytest.fail("copied"))
    session.apply_input("aim", 0.3)
    session.apply_input("kick", 1.0)


def test_forged_action_of_a_recording_is_detected() -> None:
    session = session_of()
    session.advance(150)
    recording = session.recording()
    first = next(action for action in recording.actions if action.kind == "impulse")
    forged = first.model_copy(update={"impulse": (9.0, 9.0)})
    actions = tuple(forged if action is first else action for action in recording.actions)
    forged_recording = Recording.from_json(recording.to_json())
    object.__setattr__(forged_recording, "actions", actions)
    assert rerun(forged_recording, audit=False).info["game"]["otherwise"] == first.time


OPERATIONS = st.lists(
    st.one_of(
        st.tuples(st.just("advance"), st.integers(1, 60)),
        st.tuples(st.just("kick"), st.sampled_from([0.0, 1.0])),
        st.tuples(st.just("aim"), st.floats(0.0, 1.0)),
        st.tuples(st.just("go"), st.integers(0, 250)),
    ),
    max_size=12,
)


@pytest.mark.nightly
@given(operations=OPERATIONS)
def test_any_order_of_operations_replays(operations: list[tuple[str, Any]]) -> None:
    session = session_of()
    for kind, value in operations:
        if kind == "advance":
            advance_or_reseek(session, value)
        elif kind == "go":
            seek(session, value)
        else:
            session.apply_input(kind, value)
    assert_replays(session)


@pytest.mark.parametrize(("kept", "aim"), [((), "0.25"), ((2,), "0.75")])
def test_retract_removes_the_inputs_since_the_action_except_the_stated_ones(kept: tuple[int, ...], aim: str) -> None:
    session = session_of()
    session.apply_input("aim", 0.25)
    session.advance(10)
    session.apply_input("aim", 0.75)
    session.apply_input("kick", 1.0)
    if not kept:  # otherwise at the same step as the kick
        session.advance(10)
        session.apply_input("kick", 0.0)
    assert session.game is not None
    kick = next(k for k, action in enumerate(session.actions) if action.time == pytest.approx(0.1))
    seek(session, session.retract(kick, *kept))
    assert [press.value for press in session.game.all_presses] == [0.25, 0.75][: 1 + len(kept)]
    assert session.game.future_presses == ()  # a kept press is repeated although no action follows
    assert not session.log.has_future
    assert (session.step_number, dict(rules_of(session).display_lines())["aim"]) == (10, aim)
    session.advance(40)
    assert_replays(session)
