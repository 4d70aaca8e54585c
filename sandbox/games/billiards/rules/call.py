"""Calls: what a player says before a shot, and what may be said now."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from sandbox.games.billiards.rules.happening import GameError

Decision = Literal["play", "pass", "in hand", "rerack", "rerack and pass", "spot", "restore", "claim"]
"""What is settled before a shot.

play: take the table as it is · pass: the other player plays · in hand: as it is, but with the cue ball in hand ·
rerack: all anew, and break · rerack and pass: all anew, and the other breaks · spot: balls that touch go to their
spots · restore: the balls go back to where they were, and the one who missed plays again · claim: the frame is won.
"""


@dataclass(frozen=True)
class Call:
    """What is said of one shot."""

    ball: str | None = None
    """meant to fall; in snooker the colour that is nominated, or the free ball"""
    pocket: str | None = None
    """in which it is to fall"""
    safety: bool = False
    """the turn is to end, whatever falls"""
    push_out: bool = False


@dataclass(frozen=True)
class Choices:
    """What a player may say now."""

    decisions: tuple[Decision, ...] = ()
    """before the shot; who shoots without having decided plays"""
    balls: tuple[str, ...] = ()
    """that may be called or nominated"""
    pocket: bool = False
    """whether a pocket may be called"""
    needed: bool = False
    """whether a pocket must be, for a ball to count"""
    safety: bool = False
    push_out: bool = False

    def check(self, call: Call) -> None:
        """Refuse a call that cannot be made now.

        Raises:
            GameError: with all that is wrong.
        """
        wrong = [
            *(
                [f"{call.ball!r} cannot be called now{_those(self.balls)}"]
                if call.ball not in (None, *self.balls)
                else []
            ),
            *(["no pocket can be called now"] if call.pocket is not None and not self.pocket else []),
            *(["no safety can be called now"] if call.safety and not self.safety else []),
            *(["no push-out can be called now"] if call.push_out and not self.push_out else []),
        ]
        if wrong:
            raise GameError("; ".join(wrong))


def _those(balls: Iterable[str]) -> str:
    named = ", ".join(balls)
    return f"; possible: {named}" if named else ""
