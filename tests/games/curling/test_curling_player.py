"""Player `skilled` of curling: it makes the deliveries of the bot by the controls of a person."""

import math

import pytest

from sandbox.action import Move
from sandbox.games.contract import UnsuitableSceneError
from sandbox.games.curling.bot import CurlingBot
from sandbox.games.curling.delivery import Ice
from sandbox.games.curling.player import CurlingPlayer
from sandbox.games.curling.rules import HARDER, MAX_BROOM_OFFSET, SIDEWAYS, WEIGHT_LIMITS, CurlingAim, broom_offset
from sandbox.games.curling.sheet import RELEASE
from sandbox.games.players import POLICIES
from sandbox.measure.run.sessions import play_out
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

SCENE = load(find("curling"))


def ice() -> Ice:
    assert SCENE.surface is not None
    return Ice.of(SCENE.surface)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_first_stone_is_delivered_as_the_bot_intends() -> None:
    scene = load(find("curling"), [("world.duration", 15.0)])
    game = play_out(scene, CurlingPlayer(1, 1.0))
    released = [
        action
        for action in game.recording.actions
        if isinstance(action, Move) and action.velocity is not None and any(action.velocity)
    ]
    vx, vy = released[0].velocity or (0.0, 0.0)
    intended = CurlingBot(0, ice(), 0.0, 1).choice([], 0, False)
    # The broom and the weight move by a step at a time, and are released within half of one.
    step = scene.solver.dt
    assert broom_offset(math.atan2(vy, vx)) == pytest.approx(broom_offset(intended.heading), abs=0.51 * SIDEWAYS * step)
    weight = ice().distance_for(math.hypot(vx, vy))
    assert weight == pytest.approx(ice().distance_for(intended.speed), abs=0.51 * HARDER * step)


@pytest.mark.parametrize("distance", [0.5, 20.0, 40.0])
def test_distance_of_a_speed_is_the_inverse_of_the_speed_of_a_distance(distance: float) -> None:
    assert ice().distance_for(ice().speed_for(distance)) == pytest.approx(distance, rel=1e-12)  # rounding


def test_broom_lies_on_the_line_of_aim() -> None:
    heading = 0.03
    assert broom_offset(heading) == pytest.approx(-RELEASE * math.tan(heading))


def test_aim_is_limited_to_what_the_controls_reach() -> None:
    assert CurlingAim(9.0, 99.0, 1).limited() == (MAX_BROOM_OFFSET, WEIGHT_LIMITS[1], 1)
    assert CurlingAim(-9.0, -99.0, -1).limited() == (-MAX_BROOM_OFFSET, WEIGHT_LIMITS[0], -1)


@pytest.mark.nightly
def test_player_finishes_a_match() -> None:
    game = play_out(SCENE, CurlingPlayer(1))
    assert game.over is not None
    assert "wins" in game.over
    assert {press.control for press in game.recording.presses} >= {"left", "right", "turn", "throw"}


def test_player_is_the_skilled_player_of_curling_alone() -> None:
    assert isinstance(POLICIES["skilled"](SCENE), CurlingPlayer)
    with pytest.raises(UnsuitableSceneError, match="curling"):
        play_out(load(find("landing")), CurlingPlayer(1))
