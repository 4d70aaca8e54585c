"""State: where a frame stands, as a frozen value."""

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeVar

from pydantic import ConfigDict

from sandbox.games.billiards.rules.call import Decision
from sandbox.games.billiards.rules.happening import GameError

Place = Literal["anywhere", "behind the head string", "in the D"]


@dataclass(frozen=True, kw_only=True)
class State:
    """What every game keeps.

    Raises:
        GameError: neither one nor two play, or it is nobody's turn.
    """

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")

    players: int
    """1 or 2"""
    turn: int = 0
    """the player to shoot, from 0"""
    scores: tuple[int, ...]
    table: tuple[str, ...]
    """the object balls that are not down"""
    opening: bool = True
    """whether the next shot opens the frame"""
    in_hand: Place | None = None
    """where the cue ball may be put before the shot"""
    decisions: tuple[Decision, ...] = ()
    """one of which is to be taken before the shot; the first is always to play"""
    over: bool = False
    winner: int | None = None
    """nobody's where it is a draw, or where one who plays alone has lost"""

    def __post_init__(self) -> None:
        counted(self.players)
        if not 0 <= self.turn < self.players == len(self.scores):
            raise GameError(f"turn {self.turn} and {len(self.scores)} scores do not fit {self.players} players")

    @property
    def other(self) -> int:
        """The player who is next; the same, where one plays alone."""
        return (self.turn + 1) % self.players

    @property
    def opponent(self) -> int | None:
        """The other player, or None where one plays alone."""
        return None if self.players == 1 else self.other

    def scored(self, player: int | None, points: int) -> tuple[int, ...]:
        """Return the scores with points added for a player; nobody's points go nowhere."""
        return tuple(score + points if each == player else score for each, score in enumerate(self.scores))

    def without(self, balls: tuple[str, ...]) -> tuple[str, ...]:
        """Return the object balls left once some are down."""
        return tuple(ball for ball in self.table if ball not in balls)


def counted(players: int) -> int:
    """Return how many play.

    Raises:
        GameError: neither one nor two.
    """
    if players not in (1, 2):
        raise GameError(f"{players} players cannot play; 1 or 2 can")
    return players


S = TypeVar("S", bound=State)
