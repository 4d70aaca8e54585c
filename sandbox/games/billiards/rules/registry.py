"""RULES: every game by name."""

from typing import Any

from sandbox.echo import short_repr
from sandbox.games.billiards.rules.carom import Carom
from sandbox.games.billiards.rules.eight_ball import EightBall
from sandbox.games.billiards.rules.free_play import FreePlay
from sandbox.games.billiards.rules.happening import GameError
from sandbox.games.billiards.rules.nine_ball import NineBall
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.snooker import Snooker

RULES: dict[str, Rules[Any]] = {
    "8-ball": EightBall(),
    "9-ball": NineBall(),
    "three-cushion": Carom("three-cushion", cushions=3, distance=15),
    "straight-rail": Carom("straight-rail", cushions=0, distance=50),
    "snooker": Snooker(),
    "free": FreePlay(),
}


def rules_named(name: str) -> Rules[Any]:
    """Return a game by name.

    Raises:
        GameError: with the names there are.
    """
    try:
        return RULES[name]
    except KeyError:
        raise GameError(f"unknown game {short_repr(name)}; games: {', '.join(RULES)}") from None
