"""Curling in a real window: the broom is held and a stone thrown by real keys, and the session keeps the match."""

import pytest

from sandbox.action import Action, Move
from sandbox.measure.run.sessions import rerun
from tests.driven.driving import Play
from tests.driven.looking import differ

pytestmark = pytest.mark.slow  # a real window in real time


def moves(actions: tuple[Action, ...], body: str) -> list[Move]:
    return [action for action in actions if isinstance(action, Move) and action.body == body]


def test_keys_hold_the_broom_and_throw(drive: Play) -> None:
    window = drive("play", "curling")
    window.wait_for(lambda: moves(window.session().actions, "broom"), "the first stone being brought")
    window.hold("Left")
    window.wait_for(lambda: moves(window.session().actions, "broom")[-1].position[1] > 0.2, "the broom held aside")
    window.let_go("Left")
    window.hold("Up")
    window.wait_for(lambda: any(press.control == "harder" for press in window.session().presses), "more weight")
    window.let_go("Up")
    before = window.settled()
    window.key("space")
    window.wait_for(lambda: thrown(window.session().actions), "the throw")
    window.wait_until(lambda shot: differ(shot, before), "the stone on its way")
    window.key("p")
    session = window.session()
    ((along, aside),) = thrown(session.actions)
    broom = moves(session.actions, "broom")[-1].position[1]
    assert 0.0 < aside < along  # to the left, where the broom is
    assert broom > 0.2
    again = rerun(session)
    assert again.info["state_hash"] == session.state_hash
    assert again.info["game"]["score"] == session.score == 0
    assert again.info["game"]["otherwise"] is None


def thrown(actions: tuple[Action, ...]) -> list[tuple[float, float]]:
    """Return the velocities of red's first stone whenever it was put somewhere to move on, m/s."""
    return [move.velocity for move in moves(actions, "red-1") if move.velocity is not None and any(move.velocity)]
