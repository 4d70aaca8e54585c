"""Frame: a game played out between players, on any engine, and the session that it leaves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from pydantic import TypeAdapter

from sandbox.action import Action
from sandbox.engines.contract import Divergence, Exhaustion, Simulation
from sandbox.engines.switching import start
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall
from sandbox.recording import Recording
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.trajectory import Contacts

MAX_SHOT_TIME = 300.0
"""s, that a shot may take"""

MAX_TURNS = 1000
"""of a frame, decisions and shots: one that has no end by then is given up, without a winner"""

REST_SPEED = 1e-9
"""m/s and rad/s: what is slower rests"""


class NoRestError(GameError):
    """A shot does not come to rest."""


@dataclass(frozen=True)
class FramePlan:
    """What a player does at the table."""

    stroke: Stroke
    call: ShotCall = field(default_factory=ShotCall)
    place: Point | None = None
    """where a cue ball in hand is put, m; without one it stays"""


class FramePlayer(Protocol):
    """Whoever decides and shoots: a bot, or a script."""

    def decide(self, match: Match) -> Decision:
        """Return one of `match.choices.decisions`; asked for where there are some."""

    def plan(self, match: Match) -> FramePlan:
        """Return the next shot."""


@dataclass(frozen=True)
class FrameTurn:
    """What a player decided or played, and what came of it."""

    player: int
    """from 0"""
    decision: Decision | None
    plan: FramePlan | None
    """where nothing was decided"""
    fouls: tuple[str, ...]
    points: tuple[int, ...]
    """what each player gained"""
    messages: tuple[str, ...]


@dataclass(frozen=True)
class FrameRecord:
    """A frame that was played."""

    first: Match
    """how it began"""
    match: Match
    """how it ended"""
    turns: tuple[FrameTurn, ...]
    session: Recording
    """scene and actions: the same engine gets to the same state again, bit for bit"""
    unfinished: str | None = None
    """why it was given up; none where it came to its end"""

    @property
    def shots(self) -> tuple[FrameTurn, ...]:
        """The turns in which somebody shot."""
        return tuple(turn for turn in self.turns if turn.plan is not None)

    def replayed(self) -> "FrameRecord":
        """Return the frame as a fresh simulation and the same turns lead to it.

        Raises:
            GameError: what was done cannot be done again: the versions differ.
        """
        script = FrameScript(self.turns)
        return play_frame(self.first, (script, script), self.session.engine, most=len(self.turns))

    def document(self) -> dict[str, Any]:
        """Return the frame as a JSON object, without the session."""
        plain: list[dict[str, Any]] = _TURNS.dump_python(self.turns, mode="json", exclude_defaults=True)
        state = self.match.state
        return {
            "game": self.match.rules.name,
            "winner": state.winner,
            "over": state.over,
            "unfinished": self.unfinished,
            "scores": list(state.scores),
            "shots": len(self.shots),
            "duration": self.session.duration,
            "state_hash": self.session.state_hash,
            "turns": plain,
        }


class FrameScript:
    """A player who does what was done."""

    def __init__(self, turns: Sequence[FrameTurn]) -> None:
        self._turns = iter(turns)

    def decide(self, match: Match) -> Decision:
        """Return the next decision."""
        turn = next(self._turns, None)
        if turn is None or turn.decision is None or turn.player != match.turn:
            raise GameError("the frame does not reach this decision")
        return turn.decision

    def plan(self, match: Match) -> FramePlan:
        """Return the next shot."""
        turn = next(self._turns, None)
        if turn is None or turn.plan is None or turn.player != match.turn:
            raise GameError("the frame does not reach this shot")
        return turn.plan


def play_frame(
    match: Match,
    players: Sequence[FramePlayer],
    engine: str = "exact",
    *,
    most: int = MAX_TURNS,
    time_limit: float | None = None,
    told: Callable[[FrameTurn, Match], None] | None = None,
) -> FrameRecord:
    """Play a match to its end.

    Args:
        match: how it begins; the balls lie where its scene has them.
        players: one for each.
        engine: by name.
        most: how many turns.
        time_limit: s of the clock after which no further turn is begun; none by default.
        told: called after every turn.

    Returns:
        The frame, `unfinished` where it was given up: by one of the two limits, or as a shot did not come to rest, left
        all bounds, or was too much for the engine.

    Raises:
        GameError: a player does what may not be done.
        Refusal: the engine cannot play this table.
    """
    if len(players) != match.state.players:
        raise GameError(f"the match has {match.state.players} players, not {len(players)}")
    simulation = start(match.scene, engine)
    simulation.contacts()  # the recording begins
    first, actions, turns = match, list[Action](), list[FrameTurn]()

    def act(some: Sequence[Action]) -> None:
        for action in some:
            simulation.apply(action)
        actions.extend(some)

    unfinished: str | None = None
    began_at = perf_counter()
    while not match.over:
        if len(turns) >= most:
            unfinished = f"not finished after {len(turns):,} turns"
        elif time_limit is not None and perf_counter() - began_at > time_limit:
            unfinished = f"not finished after {time_limit:g} s and {len(turns):,} turns"
        if unfinished is not None:
            break
        player, who = players[match.turn], match.turn
        decision: Decision | None = None
        plan: FramePlan | None = None
        if match.choices.decisions and not (turns and turns[-1].decision is not None and turns[-1].player == who):
            decision = player.decide(match)
            match = match.decide(decision)
        else:
            plan = player.plan(match)
            if plan.place is not None:
                match = match.place(plan.place)
            # Not before: an action counts from the step that it is followed by.
            act(match.moves(simulation.frame().position, simulation.time))
            began = simulation.time
            act((match.strike(plan.stroke, began),))
            try:
                contacts = run_until_rest(simulation)
            except (NoRestError, Divergence, Exhaustion) as error:
                unfinished = f"turn {len(turns) + 1}: {error}"
                break
            match = match.played(contacts, simulation.frame().position, plan.call, began)
        verdict = match.verdict
        told_of = ((), (), ()) if verdict is None else (verdict.fouls, verdict.points, verdict.messages)
        turns.append(FrameTurn(who, decision, plan, *told_of))
        if told is not None:
            told(turns[-1], match)
    session = Recording(
        match.scene, engine, match.scene.solver, tuple(actions), simulation.time, simulation.state_hash()
    )
    simulation.close()
    return FrameRecord(first, match, tuple(turns), session, unfinished)


def run_until_rest(simulation: Simulation) -> Contacts:
    """Step until everything rests; return the contacts since they were last asked for.

    Raises:
        NoRestError: it does not come to rest.
        Divergence: a ball left all bounds.
        Exhaustion: the engine cannot go on.
    """
    until = simulation.time + MAX_SHOT_TIME
    while True:
        simulation.step()
        frame = simulation.frame()
        roll = 0.0 if frame.roll is None else float(np.abs(frame.roll).max(initial=0.0))
        fastest = max(float(np.abs(frame.velocity).max(initial=0.0)), float(np.abs(frame.angular_velocity).max()), roll)
        if fastest <= REST_SPEED:
            break
        if simulation.time > until:
            raise NoRestError(f"a shot does not come to rest within {MAX_SHOT_TIME:g} s")
    return simulation.contacts()


_TURNS = TypeAdapter(tuple[FrameTurn, ...])
