"""Pinball bot: which controls it presses, and when."""

import pytest

from sandbox import game_names
from sandbox.game_spec import GameSpec
from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.games.pinball.bot import HOLD_TIME, PULL_TIME, PinballBot
from sandbox.games.players import POLICIES
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
from tests.games.pinball.pinball_by_hand import OPEN, Table, table

BAT = "left bat"


def let_play(game: Table, bot: PinballBot, seconds: float) -> list[tuple[float, str, float]]:
    """Let a bot play, and return its presses as time, control and value."""
    found = []
    for _ in range(round(seconds / 0.01)):
        time = game.time
        game.advance()
        for control, value in bot.decide(StepInfo(time, game.frame(), Contacts.none(), ()), game.game):
            game.press(control, value)
            found.append((time, control, value))
    return found


def ball_at_flipper(velocity: tuple[float, float] = (0.0, -0.1)) -> Table:
    """Return a table with its ball on the left flipper, which is a point in these tests."""
    game = Table(table())
    game.play()
    (flipper,) = game.game.board.flippers("left")
    game.put(0, flipper.position, velocity)
    return game


def test_ball_within_reach_is_flipped_once_and_the_flipper_released() -> None:
    pressed = let_play(ball_at_flipper(), PinballBot(1, 1.0), 1.0)
    (down, *_), (up, *_) = pressed
    assert [(control, value) for _, control, value in pressed] == [("left flipper", 1.0), ("left flipper", 0.0)]
    assert up - down == pytest.approx(HOLD_TIME, abs=0.0101)  # the first step after that time


@pytest.mark.parametrize(("position", "velocity"), [(None, (0.0, 1.0)), (OPEN, (0.0, -0.1))], ids=["rising", "far"])
def test_rising_and_far_balls_are_ignored(position: tuple[float, float] | None, velocity: tuple[float, float]) -> None:
    game = ball_at_flipper(velocity)
    if position is not None:
        game.put(0, position, velocity)
    assert not let_play(game, PinballBot(1, 1.0), 1.0)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_skill_is_the_fraction_of_balls_that_are_flipped() -> None:
    flipped = 0
    for seed in range(60):
        pressed = let_play(ball_at_flipper(), PinballBot(seed, 0.5), 0.2)
        flipped += any(control == "left flipper" for _, control, _ in pressed)
    assert 18 <= flipped <= 46  # 3 σ of 60 balls at a half, plus at most 7 % of presses without a ball


def test_ball_in_the_lane_is_plunged() -> None:
    game = Table(table())
    pressed = let_play(game, PinballBot(1, 1.0), PULL_TIME + 0.9)
    (down, control, strength), (up, *_) = pressed[:2]
    assert control == "plunger"
    assert 0.85 <= strength <= 1.0
    assert up - down == pytest.approx(PULL_TIME, abs=0.0101)  # the first step after that time
    assert len(pressed) == 2  # the bot waits for the spring


@pytest.mark.fail_slow(60)  # takes over half a second
def test_bot_depends_only_on_its_seed() -> None:
    def plays(seed: int) -> list[tuple[float, str, float]]:
        return let_play(ball_at_flipper(), PinballBot(seed, 0.3), 3.0)

    assert plays(1) == plays(1)
    assert plays(1) != plays(2)


def test_skilled_player_of_a_game_without_a_bot_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    assert isinstance(POLICIES["skilled"](table()), PinballBot)
    monkeypatch.setitem(game_names._ADDED, "darts", GameSpec(names=("darts",)))
    darts = loads('[play]\ngame = "darts"\n[[ball]]\nposition = [0.0, 0.0]\nradius = 0.1\n')
    with pytest.raises(UnsuitableSceneError, match="not darts"):
        POLICIES["skilled"](darts)
