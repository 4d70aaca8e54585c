"""Rules: what every game answers.

What rules see of one shot: who touched whom, by names, in time.

Calls: what a player says before a shot, and what may be said now.

State: where a frame stands, as a frozen value.

Verdict: what came of a shot.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Generic, Literal, Self, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError


class GameError(ValueError):
    """What no game can take; `str()` says why. The state is as it was."""


@dataclass(frozen=True)
class ShotEvent:
    """A ball touched a ball or a cushion, or fell into a pocket.

    A cushion is a wall or a jaw. One that a ball is frozen to when the shot begins counts only once the ball has left
    it and come back (WPA 8.4); so does a ball that the cue ball touches from the start.
    """

    time: float
    """s, of the shot"""
    ball: str
    kind: Literal["ball", "cushion", "pocket"]
    other: str
    """the name of the ball, cushion or pocket"""


@dataclass(frozen=True)
class ShotSummary:
    """A shot as rules ask about it."""

    cue: str
    happenings: tuple[ShotEvent, ...]
    """in order of time"""
    first: tuple[str, ...]
    """what the cue ball touched first: several, where it touched them at one time"""
    fell: tuple[tuple[str, str], ...]
    """balls and their pockets, in order of time, the cue ball too"""
    driven: frozenset[str]
    """balls that came to a cushion or fell once the cue ball had touched one"""
    stayed_behind: bool = False
    """whether a cue ball in hand behind the head string first touched a ball there without having crossed it"""

    @property
    def scratched(self) -> bool:
        """Whether the cue ball fell."""
        return any(ball == self.cue for ball, _ in self.fell)

    @property
    def down(self) -> tuple[str, ...]:
        """The object balls that fell, in order of time."""
        return tuple(ball for ball, _ in self.fell if ball != self.cue)

    def pocket_of(self, ball: str) -> str | None:
        """Return the pocket into which a ball fell."""
        return dict(self.fell).get(ball)


def summarise(
    happenings: Iterable[ShotEvent], cue: str, table: tuple[str, ...], stayed_behind: bool = False
) -> ShotSummary:
    """Read a shot.

    Args:
        happenings: in any order.
        cue: the ball that was struck.
        table: the other balls on the table.
        stayed_behind: as in `Shot`.

    Raises:
        GameError: a happening names a ball that is not on the table.
    """
    ordered = tuple(sorted(happenings, key=lambda each: each.time))
    here = {cue, *table}
    named = {each.ball for each in ordered} | {each.other for each in ordered if each.kind == "ball"}
    if not named <= here:
        raise GameError(f"not on the table: {', '.join(sorted(named - here))}")
    touches = [(each.time, touched) for each in ordered if (touched := balls_touched_by(cue, each)) is not None]
    start = touches[0][0] if touches else float("inf")
    first = tuple(dict.fromkeys(ball for time, ball in touches if time == start))
    fell: dict[str, str] = {}
    for each in ordered:
        if each.kind == "pocket":
            fell.setdefault(each.ball, each.other)
    driven = frozenset(each.ball for each in ordered if each.kind != "ball" and each.time >= start)
    return ShotSummary(cue, ordered, first, tuple(fell.items()), driven, stayed_behind)


def balls_touched_by(cue: str, each: ShotEvent) -> str | None:
    """Return the ball that a cue ball touched in a happening, whichever of the two it names first."""
    if each.kind != "ball" or cue not in (each.ball, each.other) or each.ball == each.other:
        return None
    return each.other if each.ball == cue else each.ball


def first_ball_hit(shot: ShotSummary) -> str:
    """Return what the cue ball touched first as the beginning of a sentence."""
    return f"the {' and the '.join(shot.first)} {'was' if len(shot.first) == 1 else 'were'}"


Decision = Literal["play", "pass", "in hand", "rerack", "rerack and pass", "spot", "restore", "claim"]
"""What is settled before a shot.

play: take the table as it is · pass: the other player plays · in hand: as it is, but with the cue ball in hand ·
rerack: all anew, and break · rerack and pass: all anew, and the other breaks · spot: balls that touch go to their
spots · restore: the balls go back to where they were, and the one who missed plays again · claim: the frame is won.
"""


@dataclass(frozen=True)
class ShotCall:
    """What is said of one shot."""

    ball: str | None = None
    """meant to fall; in snooker the colour that is nominated, or the free ball"""
    pocket: str | None = None
    """in which it is to fall"""
    safety: bool = False
    """the turn is to end, whatever falls"""
    push_out: bool = False


@dataclass(frozen=True)
class ShotChoices:
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

    def check(self, call: ShotCall) -> None:
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


Place = Literal["anywhere", "behind the head string", "in the D"]


@dataclass(frozen=True, kw_only=True)
class RulesState:
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


S = TypeVar("S", bound=RulesState)


@dataclass(frozen=True)
class Respot:
    """A ball to be put back: on the first of its spots that is free, else as near to the first as it can be."""

    ball: str
    spots: tuple[str, ...]
    """`foot`, `head`, `centre`; in snooker the colours' own, by their names"""


@dataclass(frozen=True)
class ShotResult(Generic[S]):
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
class Situation:
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


def player_name(number: int) -> str:
    """Return what a player is called in messages."""
    return f"player {number + 1}"


def renamed(message: str, names: tuple[str, ...]) -> str:
    """Return a message with the players called by names of their own."""
    for number, name in enumerate(names):
        message = message.replace(player_name(number), name)
    return message


class Ruleset(ABC, Generic[S]):
    """A game. It keeps nothing: all there is to know of a frame is in its state."""

    name: str
    rack: str
    """how the balls lie at the start: `8-ball`, `9-ball`, `carom`, `snooker`"""
    cue_balls: tuple[str, ...] = ("cue",)
    kind: type[S]
    """of its states"""

    @abstractmethod
    def start(self, players: int = 2) -> S:
        """Return the state in which a frame begins.

        Raises:
            GameError: neither one nor two play.
        """

    @abstractmethod
    def legal_targets(self, state: S) -> frozenset[str]:
        """Return the balls that the cue ball may touch first; none once the frame is over."""

    def cue_ball(self, state: S) -> str:
        """Return the ball that is struck next."""
        return self.cue_balls[state.turn % len(self.cue_balls)]

    def choices(self, state: S) -> ShotChoices:
        """Return what may be decided and called before the next shot."""
        return ShotChoices(decisions=() if state.over else state.decisions)

    def judge(
        self, state: S, call: ShotCall, happenings: Iterable[ShotEvent], stayed_behind: bool = False
    ) -> ShotResult[S]:
        """Return what came of a shot. What was still to be decided is taken as `play`.

        Args:
            state: before the shot.
            call: what was said of it.
            happenings: in any order.
            stayed_behind: whether a cue ball in hand behind the head string first touched a ball there, and had not
                crossed the head string before.

        Raises:
            GameError: the frame is over, the call cannot be made now, or a ball is not on the table.
        """
        if state.over:
            raise GameError("the frame is over")
        self.choices(state).check(call)
        cue = self.cue_ball(state)
        shot = summarise(happenings, cue, state.without((cue,)), stayed_behind)
        return self._judge(replace(state, decisions=()), call, shot)

    def decide(self, state: S, decision: Decision) -> ShotResult[S]:
        """Return what a decision leads to.

        Raises:
            GameError: it is not to be had now.
        """
        offered = self.choices(state).decisions
        if decision not in offered:
            raise GameError(f"{decision!r} is not offered now; options: {', '.join(offered) or 'none'}")
        return self._decide(replace(state, decisions=()), decision)

    def settle(self, state: S, lie: Situation) -> ShotResult[S]:  # noqa: ARG002
        """Return the state with what follows from how the balls lie now, called after each shot and each spotting."""
        return ShotResult(state)

    def document(self, state: S) -> dict[str, Any]:
        """Return a state as a JSON object."""
        plain: dict[str, Any] = self._adapter.dump_python(state, mode="json")
        return plain

    def restored(self, plain: Any) -> S:
        """Return the state of a JSON object, the inverse of `document`.

        Raises:
            GameError: it is not a state of this game, with all that is wrong.
        """
        try:
            return self._adapter.validate_python(plain)
        except ValidationError as error:
            lines = [f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()]
            raise GameError("\n".join(lines)) from None

    @cached_property
    def _adapter(self) -> TypeAdapter[S]:
        return TypeAdapter(self.kind)

    @abstractmethod
    def _judge(self, state: S, call: ShotCall, shot: ShotSummary) -> ShotResult[S]: ...

    def _decide(self, state: S, decision: Decision) -> ShotResult[S]:
        if decision == "pass":
            return ShotResult(replace(state, turn=state.other))
        return ShotResult(state)
