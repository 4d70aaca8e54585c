"""8-ball (WPA 3): one group each, then the eight, in the pocket that was called.

A ball other than the eight need not be called (WPA 1.6: what is obvious need not be): without a call whatever falls of
the shooter's own group counts, and on an open table the first ball to fall chooses the group. With a call only that
ball counts, in that pocket where one is named.
"""

from dataclasses import dataclass, replace
from typing import Literal

from sandbox.games.billiards.rules.call import Call, Choices, Decision
from sandbox.games.billiards.rules.happening import Shot
from sandbox.games.billiards.rules.pool import at_foot, broke, scratch, standard
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.state import State, counted
from sandbox.games.billiards.rules.verdict import Verdict, player

Group = Literal["solids", "stripes"]
EIGHT = "8"
BALLS = tuple(str(number) for number in range(1, 16))
GROUPS: dict[Group, tuple[str, ...]] = {"solids": BALLS[:7], "stripes": BALLS[8:]}


@dataclass(frozen=True, kw_only=True)
class EightBallState(State):
    """A score is the number of the player's own balls that are down."""

    groups: tuple[Group | None, ...]
    """each player's; none while the table is open"""


class EightBall(Rules[EightBallState]):
    """8-ball."""

    name = "8-ball"
    rack = "8-ball"
    kind = EightBallState

    def start(self, players: int = 2) -> EightBallState:
        """Return the state before the break."""
        return EightBallState(
            players=counted(players),
            scores=(0,) * players,
            table=BALLS,
            in_hand="behind the head string",
            groups=(None,) * players,
        )

    def legal_targets(self, state: EightBallState) -> frozenset[str]:
        """Return what is on: any ball on the break, any but the eight on an open table, one's own, then the eight."""
        if state.over:
            return frozenset()
        if state.opening:
            return frozenset(state.table)
        group = state.groups[state.turn]
        mine = GROUPS[group] if group is not None else tuple(ball for ball in BALLS if ball != EIGHT)
        return frozenset(mine).intersection(state.table) or frozenset((EIGHT,))

    def choices(self, state: EightBallState) -> Choices:
        """Return what may be said; on the eight a pocket must be (WPA 3.6)."""
        if state.over or state.opening:
            return super().choices(state)
        balls = self.legal_targets(state)
        named = tuple(ball for ball in state.table if ball in balls)
        return Choices(state.decisions, named, pocket=True, needed=named == (EIGHT,), safety=True)

    def _judge(self, state: EightBallState, call: Call, shot: Shot) -> Verdict[EightBallState]:
        return _counted(state, self._shot(state, call, shot))

    def _shot(self, state: EightBallState, call: Call, shot: Shot) -> Verdict[EightBallState]:
        fouls = standard(shot, self.legal_targets(state))
        if state.opening:
            return self._break(state, shot, fouls)
        if EIGHT in shot.down:
            return self._eight(state, call, shot, fouls)
        after = replace(state, table=state.without(shot.down), in_hand=None)
        if fouls:
            told = f"foul: {fouls[0]}; {player(state.other)} has the ball in hand"
            after = replace(after, turn=state.other, in_hand="anywhere")
            return Verdict(after, fouls=fouls, messages=(told,))
        made = self._made(state, call, shot)
        if made is None or call.safety:
            return Verdict(replace(after, turn=state.other))
        if state.groups[state.turn] is not None:
            return Verdict(after, goes_on=True)
        mine: Group = "solids" if made in GROUPS["solids"] else "stripes"
        its: Group = "stripes" if mine == "solids" else "solids"
        after = replace(after, groups=tuple(mine if each == state.turn else its for each in range(state.players)))
        return Verdict(after, goes_on=True, messages=(f"{player(state.turn)} plays {mine}",))

    def _made(self, state: EightBallState, call: Call, shot: Shot) -> str | None:
        """Return a ball that fell as it was to: the one that was called, else the first of one's own."""
        able = (call.ball,) if call.ball is not None else tuple(self.legal_targets(state))
        for ball in shot.down:
            if ball in able and call.pocket in (None, shot.pocket_of(ball)):
                return ball
        return None

    def _break(self, state: EightBallState, shot: Shot, fouls: tuple[str, ...]) -> Verdict[EightBallState]:
        """Judge a break (WPA 3.3). Too weak a break is no foul, but the other player may have all racked anew."""
        respot = (at_foot(EIGHT),) if EIGHT in shot.down else ()
        table = state.without(tuple(ball for ball in shot.down if ball != EIGHT))
        place: Literal["behind the head string"] | None = "behind the head string" if scratch(shot) else None
        after = replace(state, table=table, opening=False, in_hand=place)
        weak, goes_on = not broke(shot), bool(shot.down) and not fouls
        offered: tuple[Decision, ...] = ()
        if weak:
            also: tuple[Decision, ...] = ("rerack and pass",) if state.players == 2 else ()
            offered = ("play", "rerack", *also)
        elif respot:  # (e), (f): the eight on the break neither wins nor loses
            offered = ("play", "rerack")
        if fouls and not scratch(shot):  # (h)
            offered = (*(offered or ("play",)), "in hand")
        after = replace(after, turn=state.turn if goes_on else state.other, decisions=offered)
        why = [f"foul: {each}" for each in fouls] + (["illegal break"] if weak else [])
        told = why + (["the 8 was pocketed on the break and is spotted"] if respot else [])
        return Verdict(after, fouls=fouls, respot=respot, goes_on=goes_on, messages=tuple(told))

    def _eight(self, state: EightBallState, call: Call, shot: Shot, fouls: tuple[str, ...]) -> Verdict[EightBallState]:
        """Judge a shot on which the eight fell: it wins, or it loses (WPA 3.8)."""
        lost = None
        if fouls:
            lost = f"the 8 was pocketed on a foul: {fouls[0]}"
        elif EIGHT not in self.legal_targets(state):
            lost = "the 8 was pocketed early"
        elif call.safety or call.pocket is None or call.pocket != shot.pocket_of(EIGHT):
            lost = "the 8 was pocketed in a pocket that was not called"
        winner = state.turn if lost is None else state.opponent
        after = replace(state, table=state.without(shot.down), in_hand=None, over=True, winner=winner)
        ends = f"{player(winner)} wins" if winner is not None else "the rack is lost"
        told = (ends,) if lost is None else (lost, ends)
        return Verdict(after, fouls=fouls, messages=told)

    def _decide(self, state: EightBallState, decision: Decision) -> Verdict[EightBallState]:
        if decision in ("rerack", "rerack and pass"):
            turn = state.turn if decision == "rerack" else state.other
            return Verdict(replace(self.start(state.players), turn=turn), rerack=True)
        if decision == "in hand":  # of a break alone
            return Verdict(replace(state, in_hand="behind the head string"))
        return super()._decide(state, decision)


def _counted(before: EightBallState, verdict: Verdict[EightBallState]) -> Verdict[EightBallState]:
    """Return a verdict with the scores that follow from the table."""
    after = verdict.state
    scores = tuple(
        0 if group is None else sum(ball not in after.table for ball in GROUPS[group]) for group in after.groups
    )
    points = tuple(now - then for now, then in zip(scores, before.scores, strict=True))
    return replace(verdict, state=replace(after, scores=scores), points=points)
