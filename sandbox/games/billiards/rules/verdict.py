"""Verdict: what came of a shot."""

from dataclasses import dataclass, replace
from typing import Generic, Self

from sandbox.games.billiards.rules.state import S


@dataclass(frozen=True)
class Respot:
    """A ball to be put back: on the first of its spots that is free, else as near to the first as it can be."""

    ball: str
    spots: tuple[str, ...]
    """`foot`, `head`, `centre`; in snooker the colours' own, by their names"""


@dataclass(frozen=True)
class Verdict(Generic[S]):
    """A new state, why it is so, and what is to be done at the table."""

    state: S
    fouls: tuple[str, ...] = ()
    """why it was foul, in plain words; none where it was fair"""
    points: tuple[int, ...] = ()
    """what each player gained; none where nothing was played"""
    respot: tuple[Respot, ...] = ()
    """in the order in which they are put back"""
    rerack: bool = False
    """all balls go to where the game begins"""
    restore: bool = False
    """all balls go back to where they were before the last shot"""
    goes_on: bool = False
    """whether the one who shot shoots again by right"""
    messages: tuple[str, ...] = ()
    """lines for the players"""

    def followed_by(self, settled: Self) -> Self:
        """Return it with what the lie of the balls, looked at after it, has brought besides."""
        return replace(
            self,
            state=settled.state,
            fouls=(*self.fouls, *settled.fouls),
            points=_summed(self.points, settled.points),
            messages=(*self.messages, *settled.messages),
        )


@dataclass(frozen=True)
class Lie:
    """How the balls lie, once all are at rest and spotted; for a cue ball in hand, what its best place would give."""

    touching: tuple[str, ...] = ()
    """object balls that the cue ball of the player to shoot touches"""
    snookered: bool = False
    """whether no legal target touches or can be hit straight at both its edges, for balls that are no targets"""
    by: tuple[str, ...] = ()
    """the nearest of the balls in the way, if it is one for all targets"""


def _summed(one: tuple[int, ...], other: tuple[int, ...]) -> tuple[int, ...]:
    if not one or not other:
        return one or other
    return tuple(a + b for a, b in zip(one, other, strict=True))


def player(number: int) -> str:
    """Return what a player is called in messages."""
    return f"player {number + 1}"


def renamed(message: str, names: tuple[str, ...]) -> str:
    """Return a message with the players called by names of their own."""
    for number, name in enumerate(names):
        message = message.replace(player(number), name)
    return message
