"""Billiards as the game of a session: recording, replay, reopening, and high scores."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from sandbox.cli.window import _shown
from sandbox.games.billiards.game import BilliardsRules
from sandbox.games.billiards.rules.base import ShotCall
from sandbox.games.billiards.view.controls import BilliardsControls
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Press, Recording
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState, session_of_recording
from sandbox.window.playback.live import LiveView
from tests.toml_text import toml
from tests.window.billiards.seated import FREE, NINE, controls_at, roll_out

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

PLAIN = (
    toml(title="Plain")
    + toml("surface")
    + toml("wall", points=[[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]], closed=True)
    + toml("ball", name="cue", position=[0.3, 0.5], radius=0.03)
    + toml("ball", name="1", position=[0.5, 1.0], radius=0.03)
)
"""A surface with balls, without a game."""
SCRATCH = -2.3
"""Aim of a stroke away from the rack, which is a foul, rad."""


def play_two_strokes(table: BilliardsControls) -> Recording:
    """Play two strokes with a foul and a ball in hand, and return the recording."""
    player = table.player
    player.cue.aim = SCRATCH
    player.shoot(3.0)
    roll_out(table)
    assert player.match.verdict is not None
    assert player.match.verdict.fouls
    player.toggle_in_hand()
    player.carry((0.4, 0.4))
    player.put_down()
    player.cue.aim = 1.2
    player.shoot(4.0)
    roll_out(table)
    assert player.match.shots == 2
    return Recording.from_json(player.live.session.recording().to_json())


def rules_in(live: LiveView) -> BilliardsRules:
    assert live.session.game is not None
    assert isinstance(live.session.game.rules, BilliardsRules)
    return live.session.game.rules


@pytest.mark.parametrize("reopen", ["restored", "replayed"])
def test_reopened_session_restores_the_match(reopen: str) -> None:
    table = controls_at(NINE, "you vs bot")
    table.player.opponent = None  # the test plays both players
    recording = play_two_strokes(table)
    assert recording.score == table.player.rules.score
    run = rerun(recording, audit=False)
    assert run.info["state_hash"] == recording.state_hash
    assert (run.info["game"]["score"], run.info["game"]["otherwise"]) == (recording.score, None)
    assert run.info["game"]["log"] == [list(entry) for entry in table.player.rules.log]
    view = session_of_recording(recording) if reopen == "restored" else _shown(recording, None)
    assert isinstance(view, LiveView)
    view.seek(round(recording.duration / recording.settings.dt))
    view.finish_seek()
    assert rules_in(view).match == table.player.match
    assert view.session.simulation.state_hash() == recording.state_hash
    assert view.session.game is not None
    assert view.session.game.diverged_at is None
    assert view.session.waiting
    view.close()


def test_players_are_inputs_of_the_recording() -> None:
    table = controls_at(NINE, "one player")
    recording = table.player.live.session.recording()
    assert [press[:2] for press in recording.presses] == [(0.0, "players")]
    view = session_of_recording(recording)
    assert rules_in(view).match.state.players == 1
    view.close()


def test_surface_with_a_cue_ball_is_playable_without_a_game_in_its_file() -> None:
    table = controls_at(PLAIN)
    player = table.player
    assert player.players == "one player"
    assert player.match.rules.name == "free"
    player.cue.aim = 0.5
    player.shoot(2.0)
    roll_out(table)
    recording = Recording.from_json(player.live.session.recording().to_json())
    assert recording.scene.play.game is None
    view = session_of_recording(recording)
    view.finish_seek()
    assert rules_in(view).match == player.match
    view.close()


def test_session_of_a_table_too_small_for_rules_reopens_without_them(tmp_path: Path) -> None:
    path = tmp_path / "narrow.toml"
    path.write_text('title = "Narrow"\n[surface]\n[[ball]]\nname = "cue"\nposition = [0.0, 0.0]\nradius = 0.03\n')
    state = AppState()
    assert state.open(path)
    assert state.host is None
    assert "no room" in state.messages.visible()[-1][1]
    assert state.live is not None
    state.live.step()
    recording = state.live.session.recording()
    for view in (session_of_recording(recording), _shown(recording, None)):
        assert isinstance(view, LiveView)
        assert view.session.game is None
        view.close()
    state.close()


def test_undo_keeps_decisions_and_calls_before_the_stroke() -> None:
    table = controls_at(NINE)
    player = table.player
    player.shoot(6.0)
    roll_out(table)
    time = player.live.session.time
    inputs = tuple(player.rules.call_inputs(ShotCall(safety=True)))
    for control, value in inputs:
        player.host.set_control(control, value)
    before, called = player.match, player.call
    player.shoot(1.0)
    roll_out(table)
    player.undo()
    player.live.finish_seek()
    assert (player.live.session.time, player.match, player.call) == (time, before, called)
    assert player.live.session.game is not None
    assert player.live.session.game.all_presses == tuple(Press(time, *each) for each in inputs)
    assert player.host.waiting


def test_undo_removes_the_control_inputs_of_a_stroke() -> None:
    table = controls_at(FREE)
    player, session = table.player, table.player.live.session
    for control, value in player.rules.stroke_inputs(player.cue.stroke):
        player.host.set_control(control, value)
    roll_out(table)
    assert session.game is not None
    assert len(session.game.all_presses) == 7
    player.undo()
    player.live.finish_seek()
    assert (session.game.all_presses, session.actions, session.time) == ((), (), 0.0)


@pytest.fixture
def window(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[App]:
    monkeypatch.setenv("SANDBOX_DATA", str(tmp_path))
    window = App(AppState(), size=(1000, 620), folder=tmp_path, say=lambda _: None)
    assert window.app_state.open(find("9-ball"))
    window.run_frame(0.02)
    yield window
    window.close()


@pytest.mark.parametrize(("winner", "asked"), [(0, True), (1, False)])
def test_high_score_is_offered_only_when_the_human_player_wins(window: App, winner: int, asked: bool) -> None:
    window.app_state.set_parameter("players", "you vs bot")
    controls, host = window.app_state.controls, window.app_state.host
    assert isinstance(controls, BilliardsControls)
    assert host is not None
    host.touched = True
    match = controls.player.match
    state = match.state.__class__(**{**vars(match.state), "over": True, "winner": winner, "scores": (9, 9)})
    controls.player.rules.match = match.__class__(match.layout, match.rules, state, match.position)
    window.run_frame(0.02)
    assert (window.context.gui._high_scores.entry is not None) == asked
