"""Curling in a real window: keys move the broom and throw a stone, and the session records the match."""

import pytest

from sandbox.action import Action, Move
from sandbox.measure.run.sessions import rerun
from tests.driven.driving import OpenWindow
from tests.driven.looking import are_different

pytestmark = pytest.mark.slow  # a real window in real time


def moves(actions: tuple[Action, ...], body: str) -> list[Move]:
    return [action for action in actions if isinstance(action, Move) and action.body == body]


def test_keys_aim_the_broom_and_throw_the_stone(drive: OpenWindow) -> None:
    window = drive("play", "curling")
    window.wait_for(lambda: moves(window.session().actions, "broom"), "the first stone in position")
    window.hold("Left")
    window.wait_for(
        lambda: moves(window.session().actions, "broom")[-1].position[1] > 0.2, "the broom off the centre line"
    )
    window.release_key("Left")
    window.hold("Up")
    window.wait_for(lambda: any(press.control == "harder" for press in window.session().presses), "more weight")
    window.release_key("Up")
    before = window.settled_shot()
    window.key("space")
    window.wait_for(lambda: throws(window.session().actions), "the throw")
    window.wait_until(lambda shot: are_different(shot, before), "the stone moving")
    window.key("p")
    session = window.session()
    ((along, aside),) = throws(session.actions)
    broom = moves(session.actions, "broom")[-1].position[1]
    assert 0.0 < aside < along  # to the left, where the broom is
    assert broom > 0.2
    replay = rerun(session)
    assert replay.info["state_hash"] == session.state_hash
    assert replay.info["game"]["score"] == session.score == 0
    assert replay.info["game"]["otherwise"] is None


def throws(actions: tuple[Action, ...]) -> list[tuple[float, float]]:
    """Return the non-zero velocities with which red's first stone was placed, m/s."""
    return [move.velocity for move in moves(actions, "red-1") if move.velocity is not None and any(move.velocity)]
