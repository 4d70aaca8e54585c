"""The player who watches the ball: what is pressed, and when."""

import pytest

from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.games.pinball.bot import HELD, PULL, PinballBot
from sandbox.games.players import POLICIES
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
from tests.games.pinball.pinball_by_hand import OPEN, Table, table

BAT = "left bat"


def watch(game: Table, hand: PinballBot, seconds: float) -> list[tuple[float, str, float]]:
    """Let a hand play, and return what it presses, and when."""
    found = []
    for _ in range(round(seconds / 0.01)):
        time = game.time
        game.look()
        for control, value in hand.decide(StepInfo(time, game.frame(), Contacts.none(), ()), game.game):
            game.press(control, value)
            found.append((time, control, value))
    return found


def at_bat(velocity: tuple[float, float] = (0.0, -0.1)) -> Table:
    """A table with its ball on the left flipper, which by hand is a point."""
    game = Table(table())
    game.play()
    (bat,) = game.game.board.flippers("left")
    game.put(0, bat.where, velocity)
    return game


def test_ball_within_reach_is_flipped_once_and_the_flipper_let_go() -> None:
    pressed = watch(at_bat(), PinballBot(1, 1.0), 1.0)
    (down, *_), (up, *_) = pressed
    assert [(control, value) for _, control, value in pressed] == [("left flipper", 1.0), ("left flipper", 0.0)]
    assert up - down == pytest.approx(HELD, abs=0.0101)  # the first step after it


@pytest.mark.parametrize(("where", "velocity"), [(None, (0.0, 1.0)), (OPEN, (0.0, -0.1))], ids=["rising", "far"])
def test_other_balls_are_let_be(where: tuple[float, float] | None, velocity: tuple[float, float]) -> None:
    game = at_bat(velocity)
    if where is not None:
        game.put(0, where, velocity)
    assert not watch(game, PinballBot(1, 1.0), 1.0)


def test_skill_is_the_part_of_balls_that_is_seen() -> None:
    seen = 0
    for seed in range(60):
        pressed = watch(at_bat(), PinballBot(seed, 0.5), 0.2)
        seen += any(control == "left flipper" for _, control, _ in pressed)
    assert 18 <= seen <= 46  # of 60 at a half, with 7 % at most for nothing; 3 sigma


def test_waiting_ball_is_plunged() -> None:
    game = Table(table())
    pressed = watch(game, PinballBot(1, 1.0), PULL + 0.9)
    (down, control, strength), (up, *_) = pressed[:2]
    assert control == "plunger"
    assert 0.85 <= strength <= 1.0
    assert up - down == pytest.approx(PULL, abs=0.0101)  # the first step after it
    assert len(pressed) == 2  # the spring gets time


def test_hand_is_by_its_seed_alone() -> None:
    def plays(seed: int) -> list[tuple[float, str, float]]:
        return watch(at_bat(), PinballBot(seed, 0.3), 3.0)

    assert plays(1) == plays(1)
    assert plays(1) != plays(2)


def test_skilled_does_not_play_what_it_does_not_know() -> None:
    assert isinstance(POLICIES["skilled"](table()), PinballBot)
    ship = loads('[play]\ngame = "landing"\n[[ball]]\nposition = [0.0, 0.0]\nradius = 0.1\n')
    with pytest.raises(UnsuitableSceneError, match="not landing"):
        POLICIES["skilled"](ship)
