"""A game in a real window: played by keys, saved and restarted."""

import pytest

from sandbox.measure.run.sessions import rerun
from tests.driven.driving import OpenWindow

pytestmark = pytest.mark.slow  # a real window in real time


def test_keys_fly_the_lander_and_the_session_replays_the_game(drive: OpenWindow) -> None:
    window = drive("play", "landing")
    assert window.step_number() == 0
    window.hold("Up")  # ignored: the game has not begun
    window.release_key("Up")
    window.key("space")
    window.wait_for(window.step_number, "the game")
    assert not window.session().presses
    window.hold("Up")
    window.wait_for(lambda: window.session().presses, "the engine")
    window.release_key("Up")
    window.wait_for(lambda: len(window.session().presses) == 2, "the engine stopped")
    session = window.session()
    assert [(press.control, press.value) for press in session.presses] == [("engine", 1.0), ("engine", 0.0)]
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    assert run.info["game"]["score"] == session.score == 0
    assert run.info["game"]["otherwise"] is None
    window.key("r")
    window.wait_for(lambda: not window.session().presses, "a new game")
