"""A game with rules in a real window: played by real keys, saved, started again."""

import pytest

from sandbox.measure.run.sessions import rerun
from tests.driven.driving import Play

pytestmark = pytest.mark.slow  # a real window in real time


def test_keys_fly_the_ship_and_the_session_keeps_the_game(drive: Play) -> None:
    window = drive("play", "landing")
    assert window.step_number() == 0
    window.hold("Up")  # the game has not begun: that is not played
    window.let_go("Up")
    window.key("space")
    window.wait_for(window.step_number, "the game")
    assert not window.session().presses
    window.hold("Up")
    window.wait_for(lambda: window.session().presses, "the engine")
    window.let_go("Up")
    window.wait_for(lambda: len(window.session().presses) == 2, "the engine stopped")
    session = window.session()
    assert [(press.control, press.value) for press in session.presses] == [("engine", 1.0), ("engine", 0.0)]
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    assert run.info["game"]["score"] == session.score == 0
    assert run.info["game"]["otherwise"] is None
    window.key("r")
    window.wait_for(lambda: not window.session().presses, "a new game")
