"""State: where a frame stands, as a frozen value and as a JSON document."""

from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from pydantic import TypeAdapter, ValidationError

from sandbox.games.billiards.rules.call import Decision
from sandbox.games.billiards.rules.happening import GameError

Place = Literal["anywhere", "behind the head string", "in the D"]


@dataclass(frozen=True, kw_only=True)
class State:
    """What every game keeps."""

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


S = TypeVar("S", bound=State)


def document(state: State) -> dict[str, Any]:
    """Return a state as a JSON object."""
    plain: dict[str, Any] = TypeAdapter(type(state)).dump_python(state, mode="json")
    return plain


def restored(kind: type[S], plain: Any) -> S:
    """Return the state of a JSON object, the inverse of `document`.

    Raises:
        GameError: it is not a state of that game.
    """
    try:
        return TypeAdapter(kind).validate_python(plain)
    except ValidationError as error:
        lines = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
        raise GameError("\n".join(lines)) from None
