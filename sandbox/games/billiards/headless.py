"""Headless frames between bots, and their recordings, for `sandbox match`.

`play_frame` runs `BilliardsRules` in a `GameSession`, like every headless game, with two differences: time advances
only during shots, and each player receives the `Match` at its turn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from sandbox.action import Action, Move
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.switching import start
from sandbox.games.billiards.game import BilliardsRules
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.trajectory import Contacts

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
    table = MatchTable(match, engine)
    turns: list[FrameTurn] = []
    unfinished: str | None = None
    start_time = perf_counter()
    while not table.match.over:
        if len(turns) >= most:
            unfinished = f"not finished after {len(turns):,} turns"
        elif time_limit is not None and perf_counter() - start_time > time_limit:
            unfinished = f"not finished after {time_limit:g} s and {len(turns):,} turns"
        if unfinished is not None:
            break
        match = table.match
        player, number = players[match.turn], match.turn
        decision: Decision | None = None
        plan: FramePlan | None = None
        if match.choices.decisions and not (turns and turns[-1].decision is not None and turns[-1].player == number):
            decision = player.decide(match)
            table.decide(decision)
        else:
            plan = player.plan(match)
            try:
                table.play(plan)
            except (NoRestError, Divergence, Exhaustion) as error:
                unfinished = f"turn {len(turns) + 1}: {error}"
                break
        verdict = table.match.verdict
        outcome = ((), (), ()) if verdict is None else (verdict.fouls, verdict.points, verdict.messages)
        turns.append(FrameTurn(number, decision, plan, *outcome))
        if on_turn is not None:
            on_turn(turns[-1], table.match)
    recording = table.recording()
    table.close()
    return FrameRecord(table.match, tuple(turns), recording, unfinished)


class MatchTable:
    """Simulation of a table with its game. Time advances only while a shot is in progress."""

    def __init__(self, match: Match, engine: str) -> None:
        self._scene, self._engine = match.scene, engine
        self._simulation = start(match.scene, engine)
        self._simulation.contacts()  # the recording begins
        self._rules = BilliardsRules(match)
        self._game = GameSession(self._rules)
        self._actions: list[Action] = []
        self._pending = list(
            self._run_rules(Contacts.none())
        )  # actions of the rules that are applied with the next shot

    @property
    def match(self) -> Match:
        """The match between two shots."""
        return self._rules.match

    def decide(self, decision: Decision) -> None:
        """Take a decision.

        Raises:
            GameError: the decision is not offered now.
        """
        options = self.match.choices.decisions
        if decision not in options:
            raise GameError(f"{decision!r} is not offered now; options: {', '.join(options) or 'none'}")
        self._press(self._rules.decision_input(decision))

    def play(self, plan: FramePlan) -> None:
        """Place the cue ball, make the call, play the stroke, and step until every ball is at rest.

        Raises:
            GameError: the place or the call is not allowed.
            NoRestError: the balls do not come to rest.
            Divergence: the simulation diverged.
            Exhaustion: the engine cannot continue.
        """
        time, match = self._simulation.time, self.match
        match.choices.check(plan.call)
        acts: list[Action] = []
        if plan.place is not None:
            match = match.place(plan.place)
            acts.append(Move(time=time, body=match.cue, position=plan.place, velocity=(0.0, 0.0)))
        for control in self._rules.call_inputs(plan.call):
            self._press(control)
        acts.append(match.strike(plan.stroke, time))
        # Applied only now, because an action is recorded with the step that follows it.
        self._pending += acts
        self._apply_pending()
        self._game.note_actions(acts)
        limit = time + MAX_SHOT_TIME
        while True:
            self._simulation.step()
            self._pending = list(self._run_rules(self._simulation.contacts()))
            if self._rules.waiting or self.match.over:
                break
            if self._simulation.time > limit:
                raise NoRestError(f"a shot does not come to rest within {MAX_SHOT_TIME:g} s")

    def recording(self) -> Recording:
        """Apply the actions of the rules that are due, and return the scene, and the actions and inputs up to now."""
        scene, simulation = self._scene, self._simulation
        self._apply_pending()
        return Recording(
            scene=scene,
            engine=self._engine,
            settings=scene.solver,
            actions=tuple(self._actions),
            duration=simulation.time,
            state_hash=simulation.state_hash(),
            presses=self._game.presses,
            score=self._rules.score,
        )

    def close(self) -> None:
        """Release the engine."""
        self._simulation.close()

    def _apply_pending(self) -> None:
        for action in self._pending:
            self._simulation.apply(action)
        self._actions += self._pending
        self._pending = []

    def _press(self, control: tuple[str, float]) -> None:
        self._pending += self._game.press(self._simulation.time, *control)

    def _run_rules(self, contacts: Contacts) -> Sequence[Action]:
        return self._game.on_step(self._simulation.time, self._simulation.frame(), contacts)
