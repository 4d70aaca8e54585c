"""Players by name, as a command line tells them: `bot:0.5`."""

from sandbox.echo import short_repr
from sandbox.games.billiards.bot.bot import Bot
from sandbox.games.billiards.rules.happening import GameError

USUAL = 0.7
"""skill of a bot of which none is told"""


def bots_in(text: str, seed: int = 0) -> tuple[Bot, ...]:
    """Return the players of `bot:SKILL,bot:SKILL`, one or two, each with chances of its own.

    Raises:
        GameError: it names something else.
    """
    found = []
    for number, each in enumerate(text.split(",")):
        kind, colon, skill = each.strip().partition(":")
        try:
            value = float(skill) if colon else USUAL
        except ValueError:
            value = -1.0
        if kind != "bot" or not 0.0 <= value <= 1.0:
            raise GameError(f"unknown player {short_repr(each.strip())}; use bot or bot:SKILL, skill 0 to 1")
        found.append(Bot(value, 2 * seed + number))
    if len(found) > 2:
        raise GameError(f"{len(found)} players cannot play; 1 or 2 can")
    return tuple(found)
