"""Registry of the rules of all games, by name."""

from typing import Any

from sandbox.echo import short_repr
from sandbox.games.billiards.rules.base import GameError, Ruleset
from sandbox.games.billiards.rules.carom import Carom
from sandbox.games.billiards.rules.pool import EightBall, FreePlay, NineBall
from sandbox.games.billiards.rules.snooker import Snooker

RULESETS: dict[str, Ruleset[Any]] = {
    "8-ball": EightBall(),
    "9-ball": NineBall(),
    "three-cushion": Carom("three-cushion", cushions=3, distance=15),
    "straight-rail": Carom("straight-rail", cushions=0, distance=50),
    "snooker": Snooker(),
    "free": FreePlay(),
}


def ruleset_named(name: str) -> Ruleset[Any]:
    """Return the rules of a game.

    Raises:
        GameError: the game does not exist; the message lists the names.
    """
    try:
        return RULESETS[name]
    except KeyError:
        raise GameError(f"unknown game {short_repr(name)}; games: {', '.join(RULESETS)}") from None
