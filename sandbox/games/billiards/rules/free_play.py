"""Free play: no rules but turns. Who makes a ball goes on; a cue ball that fell is in hand."""

from dataclasses import dataclass, replace

from sandbox.games.billiards.rules.call import Call, Decision
from sandbox.games.billiards.rules.eight_ball import BALLS
from sandbox.games.billiards.rules.happening import GameError, Shot
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.state import State, counted
from sandbox.games.billiards.rules.verdict import Verdict, player


@dataclass(frozen=True, kw_only=True)
class FreeState(State):
    """A score is the number of balls that the player has made."""

    rack: tuple[str, ...]
    """the object balls at the start"""
    cue: str
    """the ball that is struck"""


ALWAYS: tuple[Decision, ...] = ("play", "in hand", "rerack")


class FreePlay(Rules[FreeState]):
    """Free play."""

    name = "free"
    rack = "8-ball"
    kind = FreeState

    def start(self, players: int = 2, balls: tuple[str, ...] = BALLS, cue: str = "cue") -> FreeState:
        """Return the state before the first shot.

        Args:
            players: 1 or 2.
            balls: the object balls, of any rack; on a table without pockets they are never made.
            cue: the ball that both strike.

        Raises:
            GameError: neither one nor two play, or the cue ball is one of the others.
        """
        scores = (0,) * counted(players)
        if cue in balls:
            raise GameError(f"{cue!r} cannot be both the cue ball and an object ball")
        return FreeState(
            players=players, scores=scores, table=balls, rack=balls, cue=cue, in_hand="anywhere", decisions=ALWAYS
        )

    def cue_ball(self, state: FreeState) -> str:
        """Return the ball that is struck."""
        return state.cue

    def legal_targets(self, state: FreeState) -> frozenset[str]:
        """Return every ball."""
        return frozenset() if state.over else frozenset(state.table)

    def _judge(self, state: FreeState, call: Call, shot: Shot) -> Verdict[FreeState]:  # noqa: ARG002
        table, made = state.without(shot.down), len(shot.down)
        goes_on = made > 0 and not shot.scratched
        points = tuple(made if each == state.turn else 0 for each in range(state.players))
        after = replace(
            state,
            turn=state.turn if goes_on else state.other,
            scores=state.scored(state.turn, made),
            table=table,
            opening=False,
            in_hand="anywhere" if shot.scratched else None,
            decisions=ALWAYS,
        )
        told = ("scratch: cue ball in hand",) if shot.scratched else ()
        if table or not state.rack:
            return Verdict(after, points=points, goes_on=goes_on, messages=told)
        top = max(after.scores)
        winner = after.scores.index(top) if after.scores.count(top) == 1 else None
        ends = f"table cleared: {player(winner)} wins" if winner is not None else "table cleared: a draw"
        over = replace(after, over=True, winner=winner, in_hand=None, decisions=())
        return Verdict(over, points=points, messages=(*told, ends))

    def _decide(self, state: FreeState, decision: Decision) -> Verdict[FreeState]:
        if decision == "rerack":
            return Verdict(replace(self.start(state.players, state.rack, state.cue), turn=state.turn), rerack=True)
        return Verdict(replace(state, in_hand="anywhere" if decision == "in hand" else state.in_hand, decisions=ALWAYS))
