"""Sessions of games: rules go back and forth in time with the state, and a recording leads to the same game."""

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Remove, Switch
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games import registry
from sandbox.games.session import GameSession
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.playback.session import ReplayMismatchError, Session
from tests.toy_game import Toy, toy_game, toy_scene

pytestmark = pytest.mark.full  # property tests with many examples


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Toy)


def go(session: Session, step: int) -> None:
    for _ in session.seek(step):
        pass


def on(session: Session, steps: int) -> None:
    """Make steps as the window does, which finds the way where a checkpoint has led astray."""
    try:
        session.advance(steps)
    except ReplayMismatchError:
        session.history.disable_checkpoints()
        go(session, session.step_number)


def rules_of(session: Session) -> Toy:
    assert session.game is not None
    rules = session.game.rules
    assert isinstance(rules, Toy)
    return rules


def told(session: Session) -> tuple[Any, ...]:
    rules = rules_of(session)
    return rules.score, tuple(rules.display_lines()), session.frame.state_hash(), session.game and session.game.presses


def session_of(engine: str = "pymunk") -> Session:
    scene = toy_scene()
    return Session(scene, engine, game=toy_game(scene))


def again(recording: Recording, engine: str | None = None) -> Session:
    session = recording if engine is None else recording.on(engine)
    game = GameSession(Toy(session.scene, session.scene.bodies), session.presses)
    return Session(session.scene, session.engine, session.settings, session.actions, game, session.duration)


def assert_replays(session: Session) -> None:
    """Assert that state and score at its end are the same without a window, and in another one."""
    recording = Recording.from_json(session.recording().to_json())
    if recording.at is None:
        assert recording.score == rules_of(session).score
    else:
        assert recording.at == session.time
    run = rerun(recording, audit=False)
    assert run.info["state_hash"] == recording.state_hash
    assert run.info["game"]["score"] == recording.score
    assert run.info["game"]["otherwise"] is None
    other = again(recording)
    go(other, round(recording.duration / other.scene.solver.dt))
    assert other.recording() == recording
    assert other.game is not None
    assert other.game.diverged_at is None


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_rules_act_and_are_recorded(engine: str) -> None:
    session = session_of(engine)
    session.advance(300)
    assert rules_of(session).score >= 3
    kinds = [action.kind for action in session.actions]
    assert "spawn" in kinds
    assert len(session.bodies) == 1 + kinds.count("spawn")
    assert_replays(session)


def test_presses_without_actions_are_part_of_the_session() -> None:
    session = session_of()
    session.advance(20)
    session.press("aim", 1.0)
    session.advance(20)
    (kick,) = session.press("kick", 1.0)
    assert isinstance(kick, Impulse)
    assert kick.impulse == (0.0, 3.0)  # by the aim that nothing in the actions tells of
    assert kick.time == session.time
    session.advance(40)
    assert rules_of(session).score >= 0.5
    assert_replays(session)


def test_way_back_restores_the_rules() -> None:
    session = session_of()
    seen = {0: told(session)}
    for k in range(1, 241):
        if k == 50:
            session.press("aim", 0.9)
        if k == 80:
            session.press("kick", 1.0)
        session.advance()
        seen[k] = told(session)
    for step in (239, 120, 60, 79, 80, 50, 49, 0, 200, 240):
        go(session, step)
        # What was pressed after a step is pressed there again on the way, as it belongs to the time it was pressed at.
        if step not in (49, 79):
            assert told(session) == seen[step], step
    assert_replays(session)


def test_checkpoints_hold_the_game() -> None:
    scene = toy_scene(gravity=[0.0, -0.5])  # a long fall: nothing touches, so checkpoints are made
    session = Session(scene, "pymunk", game=toy_game(scene))
    session.press("aim", 0.25)
    for _ in range(150):
        session.advance()
    assert session.history.keyframe_steps
    session.press("kick", 1.0)
    session.advance(5)
    go(session, 149)
    assert ("aim", "0.25") in rules_of(session).display_lines()
    session.press("kick", 1.0)  # another way
    session.advance(100)
    assert rules_of(session).score == 0.5
    assert_replays(session)


def test_who_acts_in_the_past_forgets_what_was_pressed_later() -> None:
    session = session_of()
    session.advance(30)
    session.press("kick", 1.0)
    session.advance(30)
    session.press("kick", 1.0)
    go(session, 40)
    session.press("aim", 0.1)
    session.advance(60)
    assert session.game is not None
    assert [press.control for press in session.game.presses] == ["kick", "aim"]
    assert_replays(session)


def test_hands_and_engines_are_part_of_a_game() -> None:
    session = session_of()
    session.advance(30)
    session.apply(Impulse(time=0.0, body="a", impulse=(0.0, 1.0)))  # what a hand does
    session.advance(30)
    session.apply(Switch(time=0.0, engine="reference"))
    session.advance(60)
    score = rules_of(session).score
    assert score % 1.0 == 0.5
    assert_replays(session)


def test_game_that_is_over_stays_so() -> None:
    session = session_of()
    rules_of(session).ends_at = 1.0
    # The copy that a way back begins from has the same end.
    assert session._initial_game is not None
    session._initial_game.rules.ends_at = 1.0  # type: ignore[attr-defined]
    session.advance(150)
    assert rules_of(session).game_over == "enough"
    assert session.press("kick", 1.0) == ()
    score = rules_of(session).score
    session.advance(100)
    assert rules_of(session).score == score
    go(session, 10)
    assert rules_of(session).game_over is None


@pytest.mark.parametrize("steps", [0, 40])
def test_refused_press_changes_nothing(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of()
    session.press("aim", 0.3)
    session.advance(30)
    session.press("kick", 1.0)
    session.advance(90)
    session.press("aim", 0.7)  # at the same time as the refused one
    go(session, 90)
    go(session, 120 - steps)  # 0: the present; 40: with presses and actions later than now
    before = told(session), session.actions, session.has_future, session.game and session.game.all_presses
    recording = session.recording()
    engine_applies = type(session.simulation).apply

    def refuse(simulation: SwitchableSimulation, action: Action) -> None:
        if isinstance(action, Impulse) and action.impulse == (9.0, 0.0):
            raise ActionError("refused")
        engine_applies(simulation, action)

    def kick_twice(rules: Toy, control: str, value: float) -> tuple[Action, ...]:
        rules.score += 100.0
        return tuple(Impulse(time=0.0, body="a", impulse=(size, 0.0)) for size in (1.0, 9.0))

    with monkeypatch.context() as patch:
        patch.setattr(SwitchableSimulation, "apply", refuse)
        rules_before = Toy.on_input
        # Only the press below asks for the refused action: presses repeated in the replay are as they were.
        patch.setattr(
            Toy,
            "on_input",
            lambda self, control, value: (
                kick_twice(self, control, value) if value == 5.0 else rules_before(self, control, value)
            ),
        )
        with pytest.raises(ActionError, match="refused"):
            session.press("kick", 5.0)
    assert (told(session), session.actions, session.has_future, session.game and session.game.all_presses) == before
    assert session.recording() == recording
    assert_replays(session)
    on(session, 60)
    assert_replays(session)


def test_press_copies_no_game(monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of()
    session.advance(10)
    monkeypatch.setattr(GameSession, "copy", lambda _: pytest.fail("copied"))
    session.press("aim", 0.3)
    session.press("kick", 1.0)


def test_press_that_cannot_be_done_was_not_pressed() -> None:
    session = session_of()
    session.apply(Remove(time=0.0, body="a"))
    with pytest.raises(ActionError):
        session.press("kick", 1.0)
    assert session.game is not None
    assert session.game.presses == ()
    assert_replays(session)


def test_other_engine_sees_the_same_presses() -> None:
    session = session_of()
    session.advance(20)
    session.press("kick", 1.0)
    session.advance(100)
    recording = session.recording()
    run = rerun(recording, "reference", audit=False)
    assert run.info["game"]["presses"] == [list(press) for press in recording.presses]
    assert run.status == "ok"


def test_recording_that_the_rules_would_not_have_made_is_told() -> None:
    session = session_of()
    session.advance(150)
    recording = session.recording()
    first = next(action for action in recording.actions if action.kind == "impulse")
    forged = first.model_copy(update={"impulse": (9.0, 9.0)})
    actions = tuple(forged if action is first else action for action in recording.actions)
    faked = Recording.from_json(recording.to_json())
    object.__setattr__(faked, "actions", actions)
    assert rerun(faked, audit=False).info["game"]["otherwise"] == first.time


DEEDS = st.lists(
    st.one_of(
        st.tuples(st.just("advance"), st.integers(1, 60)),
        st.tuples(st.just("kick"), st.sampled_from([0.0, 1.0])),
        st.tuples(st.just("aim"), st.floats(0.0, 1.0)),
        st.tuples(st.just("go"), st.integers(0, 250)),
    ),
    max_size=12,
)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(deeds=DEEDS)
def test_whatever_is_done_replays(deeds: list[tuple[str, Any]]) -> None:
    session = session_of()
    for what, value in deeds:
        if what == "advance":
            on(session, value)
        elif what == "go":
            go(session, value)
        else:
            session.press(what, value)
    assert_replays(session)


def test_retract_removes_the_inputs_since_the_action() -> None:
    session = session_of()
    session.press("aim", 0.25)
    session.advance(10)
    session.press("aim", 0.75)
    session.press("kick", 1.0)
    session.advance(10)
    session.press("kick", 0.0)
    assert session.game is not None
    kick = next(k for k, action in enumerate(session.actions) if action.time == pytest.approx(0.1))
    go(session, session.retract(kick))
    assert [(press.control, press.value) for press in session.game.all_presses] == [("aim", 0.25)]
    assert not session.has_future
    assert (session.step_number, dict(rules_of(session).display_lines())["aim"]) == (10, "0.25")
    session.advance(40)
    assert_replays(session)


def test_retract_keeps_the_stated_inputs() -> None:
    session = session_of()
    session.advance(10)
    session.press("aim", 0.75)
    session.press("kick", 1.0)
    session.advance(5)
    kick = next(k for k, action in enumerate(session.actions) if action.time == pytest.approx(0.1))
    go(session, session.retract(kick, 1))
    assert session.game is not None
    assert [press.control for press in session.game.all_presses] == ["aim"]
    assert (session.step_number, dict(rules_of(session).display_lines())["aim"]) == (10, "0.75")
    assert session.game.future_presses == ()  # it is repeated, though no action follows
    session.advance(40)
    assert_replays(session)
