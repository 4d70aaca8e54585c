"""The balls of snooker: their names, values and spots."""

from sandbox.games.billiards.rules.verdict import Respot

REDS = tuple(f"red-{number}" for number in range(1, 16))
VALUES = {"yellow": 2, "green": 3, "brown": 4, "blue": 5, "pink": 6, "black": 7}
"""of the colours, in the order in which they are played once the reds are gone"""
COLOURS = tuple(VALUES)
BALLS = (*REDS, *COLOURS)
LEAST = 4
"""points of a foul, at least"""


def value(ball: str) -> int:
    """Return the points of a ball; 1 of a red."""
    return VALUES.get(ball, 1)


def reds(table: tuple[str, ...]) -> tuple[str, ...]:
    """Return the reds of some balls."""
    return tuple(ball for ball in table if ball not in VALUES)


def colours(table: tuple[str, ...]) -> tuple[str, ...]:
    """Return the colours of some balls, the lowest first."""
    return tuple(ball for ball in COLOURS if ball in table)


def respots(balls: tuple[str, ...]) -> tuple[Respot, ...]:
    """Return colours to be spotted, the highest first, each on its own spot, else on the highest that is free."""
    down = COLOURS[::-1]
    return tuple(Respot(ball, (ball, *(spot for spot in down if spot != ball))) for ball in down if ball in balls)
