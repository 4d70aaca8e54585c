"""Base of the rules of billiards games: `Ruleset`, its states and results, shot events, calls and decisions."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Generic, Literal, Self, TypeVar


class GameError(ValueError):
    """Invalid input of a game; `str()` has the reason. The state is unchanged."""


@dataclass(frozen=True)
class BallEvent:
    """Contact of a ball with a ball or a cushion, or its fall into a pocket.

    A cushion is a wall or a jaw. A cushion to which a ball is frozen when the shot begins counts only after the ball
    has left it and returned (WPA 8.4). The same holds for a ball that the cue ball touches at the start.
    """

    time: float
    """s since the stroke"""
    ball: str
    kind: Literal["ball", "cushion", "pocket"]
    other: str
    """name of the ball, cushion or pocket"""


@dataclass(frozen=True)
class ShotSummary:
    """Summary of a shot for the rules."""

    cue: str
    events: tuple[BallEvent, ...]
    """in order of time"""
    first: tuple[str, ...]
    """balls that the cue ball touched first; several if it touched them at the same time"""
    fell: tuple[tuple[str, str], ...]
    """pocketed balls with their pockets, in order of time, including the cue ball"""
    driven: frozenset[str]
    """balls that reached a cushion or a pocket after the first contact of the cue ball"""
    stayed_behind: bool = False
    """whether a cue ball in hand behind the head string hit a ball there before it crossed the string"""

    @property
    def scratched(self) -> bool:
        """Whether the cue ball was pocketed."""
        return any(ball == self.cue for ball, _ in self.fell)

    @property
    def down(self) -> tuple[str, ...]:
        """The pocketed object balls, in order of time."""
        return tuple(ball for ball, _ in self.fell if ball != self.cue)

    def pocket_of(self, ball: str) -> str | None:
        """Return the pocket into which a ball fell; None if it is not pocketed."""
        return dict(self.fell).get(ball)


def summarise(
    events: Iterable[BallEvent], cue: str, table: tuple[str, ...], stayed_behind: bool = False
) -> ShotSummary:
    """Return the summary of a shot.

    Args:
        events: of the shot, in any order.
        cue: name of the ball that was struck.
        table: the other balls on the table.
        stayed_behind: as in `ShotSummary`.

    Raises:
        GameError: an event names a ball that is not on the table.
    """
    ordered = tuple(sorted(events, key=lambda each: each.time))
    on_table_balls = {cue, *table}
    named = {each.ball for each in ordered} | {each.other for each in ordered if each.kind == "ball"}
    if not named <= on_table_balls:
        raise GameError(f"not on the table: {', '.join(sorted(named - on_table_balls))}")
    touches = [(each.time, touched) for each in ordered if (touched := balls_touched_by(cue, each)) is not None]
    start = touches[0][0] if touches else float("inf")
    first = tuple(dict.fromkeys(ball for time, ball in touches if time == start))
    fell: dict[str, str] = {}
    for each in ordered:
        if each.kind == "pocket":
            fell.setdefault(each.ball, each.other)
    driven = frozenset(each.ball for each in ordered if each.kind != "ball" and each.time >= start)
    return ShotSummary(cue, ordered, first, tuple(fell.items()), driven, stayed_behind)


def balls_touched_by(cue: str, each: BallEvent) -> str | None:
    """Return the ball that a cue ball touched in an event; None for other events."""
    if each.kind != "ball" or cue not in (each.ball, each.other) or each.ball == each.other:
        return None
    return each.other if each.ball == cue else each.ball


def first_ball_hit(shot: ShotSummary) -> str:
    """Return the start of a message about the first contact, such as `the 8 was`."""
    return f"the {' and the '.join(shot.first)} {'was' if len(shot.first) == 1 else 'were'}"


Decision = Literal["play", "pass", "in hand", "rerack", "rerack and pass", "spot", "restore", "claim"]
"""Decision before a shot.

play: accept the table · pass: the other player plays · in hand: accept the table, with the cue ball in hand ·
rerack: rerack and break · rerack and pass: rerack, and the other player breaks · spot: respot touching balls ·
restore: restore the positions, and the player who missed plays again · claim: claim the frame.
"""


@dataclass(frozen=True)
class ShotCall:
    """Call before a shot."""

    ball: str | None = None
    """ball to be pocketed; in snooker the nominated colour, or the free ball"""
    pocket: str | None = None
    """pocket for the ball"""
    safety: bool = False
    """the turn ends even if a ball is pocketed"""
    push_out: bool = False


@dataclass(frozen=True)
class ShotChoices:
    """Decisions and calls that are possible now."""

    decisions: tuple[Decision, ...] = ()
    """decisions before the shot; a shot without a decision implies `play`"""
    balls: tuple[str, ...] = ()
    """balls that may be called or nominated"""
    pocket: bool = False
    """whether a pocket may be called"""
    needed: bool = False
    """whether a pocket must be called for a ball to count"""
    safety: bool = False
    push_out: bool = False

    def check(self, call: ShotCall) -> None:
        """Check a call.

        Raises:
            GameError: the call cannot be made now; the message names every reason.
        """
        faults = [
            *(
                [f"{call.ball!r} cannot be called now{_list_choices(self.balls)}"]
                if call.ball not in (None, *self.balls)
                else []
            ),
            *(["no pocket can be called now"] if call.pocket is not None and not self.pocket else []),
            *(["no safety can be called now"] if call.safety and not self.safety else []),
            *(["no push-out can be called now"] if call.push_out and not self.push_out else []),
        ]
        if faults:
            raise GameError("; ".join(faults))


def _list_choices(balls: Iterable[str]) -> str:
    named = ", ".join(balls)
    return f"; possible: {named}" if named else ""


PlacementRegion = Literal["anywhere", "behind the head string", "in the D"]


@dataclass(frozen=True, kw_only=True)
class RulesState:
    """State common to all games.

    Raises:
        GameError: the number of players is not 1 or 2, or does not fit turn and scores.
    """

    players: int
    """1 or 2"""
    turn: int = 0
    """index of the player to shoot"""
    scores: tuple[int, ...]
    table: tuple[str, ...]
    """object balls that are not pocketed"""
    opening: bool = True
    """whether the next shot opens the frame"""
    in_hand: PlacementRegion | None = None
    """area in which the cue ball may be placed before the shot; None if it is not in hand"""
    decisions: tuple[Decision, ...] = ()
    """decisions that are offered before the shot; the first is always `play`"""
    over: bool = False
    winner: int | None = None
    """index of the winner; None for a draw, or if a single player has lost"""

    def __post_init__(self) -> None:
        checked_players(self.players)
        if not 0 <= self.turn < self.players == len(self.scores):
            raise GameError(f"turn {self.turn} and {len(self.scores)} scores do not fit {self.players} players")

    @property
    def other(self) -> int:
        """The next player; with one player, that player."""
        return (self.turn + 1) % self.players

    @property
    def opponent(self) -> int | None:
        """The other player; None with one player."""
        return None if self.players == 1 else self.other

    def scored(self, player: int | None, points: int) -> tuple[int, ...]:
        """Return the scores with points added for a player, or unchanged if `player` is None."""
        return tuple(score + points if each == player else score for each, score in enumerate(self.scores))

    def without(self, balls: tuple[str, ...]) -> tuple[str, ...]:
        """Return the object balls on the table without some balls."""
        return tuple(ball for ball in self.table if ball not in balls)


def checked_players(players: int) -> int:
    """Return a valid number of players unchanged.

    Raises:
        GameError: the number is not 1 or 2.
    """
    if players not in (1, 2):
        raise GameError(f"{players} players cannot play; 1 or 2 can")
    return players


S = TypeVar("S", bound=RulesState)


@dataclass(frozen=True)
class Respot:
    """Ball to respot: on its first free spot, else as near as possible to the first spot."""

    ball: str
    spots: tuple[str, ...]
    """`foot`, `head`, `centre`; in snooker the names of the colours"""


@dataclass(frozen=True)
class Ruling(Generic[S]):
    """Result of a shot or a decision: the new state, the reasons for it, and the changes of the table."""

    state: S
    fouls: tuple[str, ...] = ()
    """descriptions of the fouls; empty for a fair shot"""
    points: tuple[int, ...] = ()
    """points gained by each player; empty for a decision"""
    respot: tuple[Respot, ...] = ()
    """balls to respot, in order"""
    rerack: bool = False
    """whether all balls return to their initial positions"""
    restore: bool = False
    """whether all balls return to their positions before the last shot"""
    continues: bool = False
    """whether the turn of the player continues"""
    messages: tuple[str, ...] = ()
    """messages for the players"""

    def followed_by(self, settled: Self) -> Self:
        """Return the result combined with that of `Ruleset.settle`."""
        return replace(
            self,
            state=settled.state,
            fouls=(*self.fouls, *settled.fouls),
            points=_summed(self.points, settled.points),
            messages=(*self.messages, *settled.messages),
        )


@dataclass(frozen=True)
class Situation:
    """Situation after all balls are at rest and respotted; for a ball in hand, the situation at its best place."""

    touching: tuple[str, ...] = ()
    """object balls that touch the cue ball of the player to shoot"""
    snookered: bool = False
    """whether no ball on touches the cue ball, and other balls block the straight path to an edge of each ball on"""
    by: tuple[str, ...] = ()
    """nearest blocking ball, if it is the same for all balls on"""


def _summed(one: tuple[int, ...], other: tuple[int, ...]) -> tuple[int, ...]:
    if not one or not other:
        return one or other
    return tuple(a + b for a, b in zip(one, other, strict=True))


def player_name(number: int) -> str:
    """Return the name of a player, as messages use it."""
    return f"player {number + 1}"


def renamed(message: str, names: tuple[str, ...]) -> str:
    """Return a message with other names for the players."""
    for number, name in enumerate(names):
        message = message.replace(player_name(number), name)
    return message


class Ruleset(ABC, Generic[S]):
    """Rules of a game. Stateless; the state of a frame is a `RulesState`."""

    name: str
    rack: str
    """name of the rack: `8-ball`, `9-ball`, `carom`, `snooker`"""
    cue_balls: tuple[str, ...] = ("cue",)

    @abstractmethod
    def start(self, players: int = 2) -> S:
        """Return the state at the start of a frame.

        Raises:
            GameError: the number of players is not 1 or 2.
        """

    @abstractmethod
    def legal_targets(self, state: S) -> frozenset[str]:
        """Return the balls that the cue ball may touch first; none after the end of the frame."""

    def cue_ball(self, state: S) -> str:
        """Return the ball that is struck next."""
        return self.cue_balls[state.turn % len(self.cue_balls)]

    def choices(self, state: S) -> ShotChoices:
        """Return the decisions and calls that are possible before the next shot."""
        return ShotChoices(decisions=() if state.over else state.decisions)

    def judge(self, state: S, call: ShotCall, events: Iterable[BallEvent], stayed_behind: bool = False) -> Ruling[S]:
        """Return the result of a shot. Without a decision, `play` is implied.

        Args:
            state: state before the shot.
            call: call before the shot.
            events: of the shot, in any order.
            stayed_behind: whether a cue ball in hand behind the head string hit a ball there before it crossed the
                string.

        Raises:
            GameError: the frame is over, the call cannot be made now, or a ball is not on the table.
        """
        if state.over:
            raise GameError("the frame is over")
        self.choices(state).check(call)
        cue = self.cue_ball(state)
        shot = summarise(events, cue, state.without((cue,)), stayed_behind)
        return self._judge(replace(state, decisions=()), call, shot)

    def decide(self, state: S, decision: Decision) -> Ruling[S]:
        """Return the result of a decision.

        Raises:
            GameError: the decision is not offered now.
        """
        offered = self.choices(state).decisions
        if decision not in offered:
            raise GameError(f"{decision!r} is not offered now; options: {', '.join(offered) or 'none'}")
        return self._decide(replace(state, decisions=()), decision)

    def settle(self, state: S, situation: Situation) -> Ruling[S]:  # noqa: ARG002
        """Return the result of the situation after a shot or decision and respotting."""
        return Ruling(state)

    @abstractmethod
    def _judge(self, state: S, call: ShotCall, shot: ShotSummary) -> Ruling[S]: ...

    def _decide(self, state: S, decision: Decision) -> Ruling[S]:
        if decision == "pass":
            return Ruling(replace(state, turn=state.other))
        return Ruling(state)
