"""Sessions recorded in the window by an earlier version still replay to the same state.

If a new engine version changes the state, replace the recording by one of the version before the change.
"""

from pathlib import Path

import pytest

from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.app_state import session_of_recording

FOLDER = Path(__file__).parent / "recordings"
FILES = sorted(FOLDER.glob("*.json"))


def test_recordings_exist_for_every_kind() -> None:
    assert {file.stem for file in FILES} == {"9-ball", "curling", "duel", "landing", "pile", "pinball"}


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("file", FILES, ids=[file.stem for file in FILES])
def test_stored_recording_replays_headless_and_in_a_session_of_the_window(file: Path) -> None:
    recording = Recording.load(file)
    run = rerun(recording, audit=False)
    assert recording.state_hash is not None
    assert run.info["state_hash"] == recording.state_hash
    game = run.info.get("game", {})
    assert game.get("score") == recording.score
    assert game.get("otherwise") is None
    live = session_of_recording(recording)
    try:
        live.finish_seek()
        session = live.session
        assert session.time == pytest.approx(recording.duration, abs=1e-9)  # the sum of steps
        assert session.simulation.state_hash() == recording.state_hash
        if recording.has_game:
            assert session.game is not None
            assert session.game.rules.score == recording.score
            assert session.game.presses == recording.presses
            assert session.game.diverged_at is None
    finally:
        live.close()
