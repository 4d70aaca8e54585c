"""Headless frames between bots, and their recordings, for `sandbox match`.

`play_frame` runs `BilliardsRules` in a `SteppedGame`. Time advances only during shots, and each player receives the
`Match` at its turn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from sandbox.action import Action, Move
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.games.billiards.game import BilliardsRules
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall
from sandbox.games.session import SteppedGame
from sandbox.recording import Recording
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke

MAX_SHOT_TIME = 300.0
"""s, simulated; a longer shot is abandoned"""

MAX_TURNS = 1000
"""decisions and shots; a longer frame is abandoned without a winner"""


class NoRestError(GameError):
    """A shot does not come to rest within `MAX_SHOT_TIME`."""


@dataclass(frozen=True)
class FramePlan:
    """Next shot of a player."""

    stroke: Stroke
    call: ShotCall = field(default_factory=ShotCall)
    place: Point | None = None
    """place of a cue ball in hand, m; None leaves it where it is"""


class FramePlayer(Protocol):
    """Player of a frame."""

    def decide(self, match: Match) -> Decision:
        """Return one of `match.choices.decisions`; called if there are any."""

    def plan(self, match: Match) -> FramePlan:
        """Return the next shot."""


@dataclass(frozen=True)
class FrameTurn:
    """Decision or shot of a player, and its result."""

    player: int
    """index, from 0"""
    decision: Decision | None
    plan: FramePlan | None
    """None for a decision"""
    fouls: tuple[str, ...]
    points: tuple[int, ...]
    """points gained by each player"""
    messages: tuple[str, ...]


@dataclass(frozen=True)
class FrameRecord:
    """Played frame, as an immutable value."""

    match: Match
    """match at the end"""
    turns: tuple[FrameTurn, ...]
    session: Recording
    """scene and actions; a replay on the same engine and versions ends in the same state, bit for bit"""
    unfinished: str | None = None
    """reason why the frame was abandoned; None if it is complete"""

    @property
    def shots(self) -> tuple[FrameTurn, ...]:
        """The turns with a shot."""
        return tuple(turn for turn in self.turns if turn.plan is not None)


def play_frame(
    match: Match,
    players: Sequence[FramePlayer],
    engine: str = "exact",
    *,
    most: int = MAX_TURNS,
    time_limit: float | None = None,
    on_turn: Callable[[FrameTurn, Match], None] | None = None,
) -> FrameRecord:
    """Play a match to its end.

    Args:
        match: match at the start, with the balls at their positions in the scene.
        players: one for each player of the match.
        engine: name of the engine.
        most: maximum number of turns.
        time_limit: wall time, s, after which no further turn begins; default: no limit.
        on_turn: callback after every turn, with the turn and the match.

    Returns:
        The frame. It is `unfinished` if a limit was reached, or if a shot did not come to rest, diverged, or exceeded
        a limit of the engine.

    Raises:
        GameError: a player does something that the rules do not allow.
        Refusal: the engine cannot play this table.
    """
    if len(players) != match.state.players:
        raise GameError(f"the match has {match.state.players} players, not {len(players)}")
    rules = BilliardsRules(match)
    game = SteppedGame(match.scene, engine, rules)
    turns: list[FrameTurn] = []
    unfinished: str | None = None
    start_time = perf_counter()
    while not rules.match.over:
        if len(turns) >= most:
            unfinished = f"not finished after {len(turns):,} turns"
        elif time_limit is not None and perf_counter() - start_time > time_limit:
            unfinished = f"not finished after {time_limit:g} s and {len(turns):,} turns"
        if unfinished is not None:
            break
        match = rules.match
        player, number = players[match.turn], match.turn
        decision: Decision | None = None
        plan: FramePlan | None = None
        if match.choices.decisions and not (turns and turns[-1].decision is not None and turns[-1].player == number):
            decision = player.decide(match)
            _decide(game, rules, decision)
        else:
            plan = player.plan(match)
            try:
                play_shot(game, rules, plan)
            except (NoRestError, Divergence, Exhaustion) as error:
                unfinished = f"turn {len(turns) + 1}: {error}"
                break
        verdict = rules.match.verdict
        outcome = ((), (), ()) if verdict is None else (verdict.fouls, verdict.points, verdict.messages)
        turns.append(FrameTurn(number, decision, plan, *outcome))
        if on_turn is not None:
            on_turn(turns[-1], rules.match)
    recording = game.recording()
    game.close()
    return FrameRecord(rules.match, tuple(turns), recording, unfinished)


def _decide(game: SteppedGame, rules: BilliardsRules, decision: Decision) -> None:
    """Take a decision.

    Raises:
        GameError: the decision is not offered now.
    """
    options = rules.match.choices.decisions
    if decision not in options:
        raise GameError(f"{decision!r} is not offered now; options: {', '.join(options) or 'none'}")
    game.set_control(*rules.decision_input(decision))


def play_shot(game: SteppedGame, rules: BilliardsRules, plan: FramePlan) -> None:
    """Place the cue ball, make the call, play the stroke, and step until every ball is at rest.

    Raises:
        GameError: the place or the call is not allowed.
        NoRestError: the balls do not come to rest.
        Divergence: the simulation diverged.
        Exhaustion: the engine cannot continue.
    """
    time, match = game.time, rules.match
    match.choices.check(plan.call)
    actions: list[Action] = []
    if plan.place is not None:
        match = match.place(plan.place)
        actions.append(Move(time=time, body=match.cue, position=plan.place, velocity=(0.0, 0.0)))
    actions.append(match.strike(plan.stroke, time))
    for control in rules.call_inputs(plan.call):
        game.set_control(*control)
    game.act(actions)
    while True:
        game.step()
        if rules.waiting or rules.match.over:
            return
        if game.time > time + MAX_SHOT_TIME:
            raise NoRestError(f"a shot does not come to rest within {MAX_SHOT_TIME:g} s")
