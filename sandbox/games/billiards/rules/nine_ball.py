"""9-ball (WPA 2): the lowest ball first; who makes the nine fairly wins."""

from dataclasses import dataclass, replace

from sandbox.games.billiards.rules.call import Call, Choices, Decision
from sandbox.games.billiards.rules.happening import Shot
from sandbox.games.billiards.rules.pool import at_foot, broke, no_rail, scratch, wrong_ball
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.state import State, counted
from sandbox.games.billiards.rules.verdict import Verdict, player

NINE = "9"
BALLS = tuple(str(number) for number in range(1, 10))
FOULS = 3
"""in a row that lose the rack (WPA 6.14)"""


@dataclass(frozen=True, kw_only=True)
class NineBallState(State):
    """A score is the number of balls that the player has made."""

    fouls: tuple[int, ...]
    """of each player, without a fair shot between"""
    push_out: bool = False
    """whether the next shot may be a push-out"""


class NineBall(Rules[NineBallState]):
    """9-ball."""

    name = "9-ball"
    rack = "9-ball"
    kind = NineBallState

    def start(self, players: int = 2) -> NineBallState:
        """Return the state before the break."""
        none = (0,) * counted(players)
        return NineBallState(players=players, scores=none, fouls=none, table=BALLS, in_hand="behind the head string")

    def legal_targets(self, state: NineBallState) -> frozenset[str]:
        """Return the lowest ball on the table."""
        return frozenset() if state.over else frozenset((min(state.table, key=int),))

    def choices(self, state: NineBallState) -> Choices:
        """Return what may be said: nothing but a push-out, on the shot after a fair break (WPA 2.4)."""
        return replace(super().choices(state), push_out=state.push_out and not state.over)

    def _judge(self, state: NineBallState, call: Call, shot: Shot) -> Verdict[NineBallState]:
        fouls = self._fouls(state, call, shot)
        fair = not fouls and not call.push_out
        table = state.without(shot.down if fair else tuple(ball for ball in shot.down if ball != NINE))
        respot = (at_foot(NINE),) if NINE in shot.down and not fair else ()
        row = tuple(
            (count + 1 if fouls else 0) if each == state.turn else count for each, count in enumerate(state.fouls)
        )
        made = len(shot.down) if fair else 0
        points = tuple(made if each == state.turn else 0 for each in range(state.players))
        after = replace(
            state,
            table=table,
            opening=False,
            in_hand=None,
            fouls=row,
            push_out=state.opening and not fouls,
            scores=state.scored(state.turn, made),
        )
        if fouls:
            return replace(_foul(after, fouls), respot=respot, points=points)
        if call.push_out:
            decisions: tuple[Decision, ...] = ("play", "pass") if state.players == 2 else ()
            after = replace(after, turn=state.other, decisions=decisions)
            return Verdict(after, respot=respot, points=points, messages=(f"{player(state.turn)} played a push-out",))
        if NINE in shot.down:
            after = replace(after, over=True, winner=state.turn)
            return Verdict(after, points=points, messages=(f"{player(state.turn)} wins",))
        goes_on = bool(shot.down)
        return Verdict(after if goes_on else replace(after, turn=state.other), points=points, goes_on=goes_on)

    def _fouls(self, state: NineBallState, call: Call, shot: Shot) -> tuple[str, ...]:
        """Return what was foul: of a push-out a scratch alone (WPA 2.4), of a break also that it was too weak (2.3)."""
        if call.push_out:
            return tuple(scratch(shot))
        wrong = [*scratch(shot), *wrong_ball(shot, self.legal_targets(state))]
        if not state.opening:
            return (*wrong, *no_rail(shot))
        return (*wrong, *(["illegal break"] if shot.first and not broke(shot) else []))


def _foul(after: NineBallState, fouls: tuple[str, ...]) -> Verdict[NineBallState]:
    """Return what a foul leads to: the ball in hand for the other, or the end."""
    row, who = after.fouls[after.turn], player(after.turn)
    if row >= FOULS:
        winner = after.opponent
        ends = f"{player(winner)} wins" if winner is not None else "the rack is lost"
        lost = replace(after, over=True, winner=winner)
        return Verdict(lost, fouls, messages=(f"foul: {fouls[0]}", f"{who} fouled {FOULS} times in a row", ends))
    told = [f"foul: {fouls[0]}; {player(after.other)} has the ball in hand"]
    if row == FOULS - 1:  # WPA 6.14: a player is to be told
        told.append(f"{who} is on {row} fouls; one more loses the rack")
    return Verdict(replace(after, turn=after.other, in_hand="anywhere"), fouls, messages=tuple(told))
