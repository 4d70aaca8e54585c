"""Pool: 8-ball, 9-ball and free play, with the standard fouls (WPA 6).

8-ball (WPA 3): each player pockets a group, then the eight in the called pocket.

Balls other than the eight need not be called (WPA 1.6: obvious shots need not be). Without a call, every pocketed ball
of the shooter's group counts, and on an open table the first pocketed ball chooses the group. With a call only that
ball counts, and only in the called pocket if one is named.

9-ball (WPA 2): the lowest ball must be hit first; a fair shot that pockets the nine wins.

Free play: turns without further rules. A pocketed ball continues the turn; a pocketed cue ball is in hand.
"""

from dataclasses import dataclass, replace
from typing import Literal

from sandbox.games.billiards.rules.base import (
    Decision,
    GameError,
    Respot,
    Ruleset,
    RulesState,
    Ruling,
    ShotCall,
    ShotChoices,
    ShotSummary,
    checked_players,
    first_ball_hit,
    player_name,
)

MIN_DRIVEN_BALLS = 4
"""number of object balls that a break must drive to a cushion if none is pocketed (WPA 2.3, 3.3)"""


def scratch_fouls(shot: ShotSummary) -> list[str]:
    """Return the foul of a pocketed cue ball (WPA 6.1)."""
    return ["scratch"] if shot.scratched else []


def wrong_ball_fouls(shot: ShotSummary, targets: frozenset[str]) -> list[str]:
    """Return the foul of a wrong first contact (WPA 6.2); of simultaneous contacts, one must be legal."""
    if not shot.first:
        return ["the cue ball hit no ball"]
    if targets.isdisjoint(shot.first):
        return [f"{first_ball_hit(shot)} hit first instead of {_list_targets(targets)}"]
    return []


def no_rail_fouls(shot: ShotSummary) -> list[str]:
    """Return the foul of a shot in which no ball reached a pocket or a cushion after the contact (WPA 6.3)."""
    return ["no rail after contact"] if shot.first and not shot.driven else []


def head_string_fouls(shot: ShotSummary) -> list[str]:
    """Return the foul of playing a cue ball in hand at a ball behind the head string (WPA 6.11)."""
    if not shot.stayed_behind:
        return []
    return [f"{first_ball_hit(shot)} behind the head string, and the cue ball had not crossed it"]


def standard_fouls(shot: ShotSummary, targets: frozenset[str]) -> tuple[str, ...]:
    """Return the standard fouls of a shot."""
    return (*scratch_fouls(shot), *wrong_ball_fouls(shot, targets), *head_string_fouls(shot), *no_rail_fouls(shot))


def is_legal_break(shot: ShotSummary) -> bool:
    """Return whether a break was legal: a ball pocketed, or `MIN_DRIVEN_BALLS` balls driven to a cushion."""
    return bool(shot.down) or len(shot.driven - {shot.cue}) >= MIN_DRIVEN_BALLS


def at_foot(ball: str) -> Respot:
    """Return the respot of a ball on the long string, from the foot spot (WPA 1.4)."""
    return Respot(ball, ("foot",))


def _list_targets(targets: frozenset[str]) -> str:
    named = sorted(targets, key=lambda ball: (len(ball), ball))
    return f"the {named[0]}" if len(named) == 1 else f"one of {', '.join(named)}"


Group = Literal["solids", "stripes"]
EIGHT = "8"
EIGHT_BALL_NAMES = tuple(str(number) for number in range(1, 16))
GROUPS: dict[Group, tuple[str, ...]] = {"solids": EIGHT_BALL_NAMES[:7], "stripes": EIGHT_BALL_NAMES[8:]}


@dataclass(frozen=True, kw_only=True)
class EightBallState(RulesState):
    """State of 8-ball; a score is the number of pocketed balls of the player's group."""

    groups: tuple[Group | None, ...]
    """group of each player; None while the table is open"""


class EightBall(Ruleset[EightBallState]):
    """Rules of 8-ball."""

    name = "8-ball"
    rack = "8-ball"

    def start(self, players: int = 2) -> EightBallState:
        """Return the state before the break."""
        return EightBallState(
            players=checked_players(players),
            scores=(0,) * players,
            table=EIGHT_BALL_NAMES,
            in_hand="behind the head string",
            groups=(None,) * players,
        )

    def legal_targets(self, state: EightBallState) -> frozenset[str]:
        """Return the balls on: all on the break, all but the eight on an open table, own group, then the eight."""
        if state.over:
            return frozenset()
        if state.opening:
            return frozenset(state.table)
        group = state.groups[state.turn]
        own_group = GROUPS[group] if group is not None else tuple(ball for ball in EIGHT_BALL_NAMES if ball != EIGHT)
        return frozenset(own_group).intersection(state.table) or frozenset((EIGHT,))

    def choices(self, state: EightBallState) -> ShotChoices:
        """Return the possible calls; on the eight a pocket must be called (WPA 3.6)."""
        if state.over or state.opening:
            return super().choices(state)
        balls = self.legal_targets(state)
        named = tuple(ball for ball in state.table if ball in balls)
        return ShotChoices(state.decisions, named, pocket=True, needed=named == (EIGHT,), safety=True)

    def _judge(self, state: EightBallState, call: ShotCall, shot: ShotSummary) -> Ruling[EightBallState]:
        return _counted(state, self._shot(state, call, shot))

    def _shot(self, state: EightBallState, call: ShotCall, shot: ShotSummary) -> Ruling[EightBallState]:
        fouls = standard_fouls(shot, self.legal_targets(state))
        if state.opening:
            return self._break(state, shot, fouls)
        if EIGHT in shot.down:
            return self._eight(state, call, shot, fouls)
        after = replace(state, table=state.without(shot.down), in_hand=None)
        if fouls:
            text = f"foul: {fouls[0]}; {player_name(state.other)} has the ball in hand"
            after = replace(after, turn=state.other, in_hand="anywhere")
            return Ruling(after, fouls=fouls, messages=(text,))
        pocketed = self._called_ball_pocketed(state, call, shot)
        if pocketed is None or call.safety:
            return Ruling(replace(after, turn=state.other))
        if state.groups[state.turn] is not None:
            return Ruling(after, continues=True)
        own_group: Group = "solids" if pocketed in GROUPS["solids"] else "stripes"
        other_group: Group = "stripes" if own_group == "solids" else "solids"
        after = replace(
            after, groups=tuple(own_group if each == state.turn else other_group for each in range(state.players))
        )
        return Ruling(after, continues=True, messages=(f"{player_name(state.turn)} plays {own_group}",))

    def _called_ball_pocketed(self, state: EightBallState, call: ShotCall, shot: ShotSummary) -> str | None:
        """Return the pocketed ball that counts, the called one, else the first ball on; None if there is none."""
        countable = (call.ball,) if call.ball is not None else tuple(self.legal_targets(state))
        for ball in shot.down:
            if ball in countable and call.pocket in (None, shot.pocket_of(ball)):
                return ball
        return None

    def _break(self, state: EightBallState, shot: ShotSummary, fouls: tuple[str, ...]) -> Ruling[EightBallState]:
        """Judge a break (WPA 3.3). A weak break is not a foul, but the other player may ask for a rerack."""
        respot = (at_foot(EIGHT),) if EIGHT in shot.down else ()
        table = state.without(tuple(ball for ball in shot.down if ball != EIGHT))
        place: Literal["behind the head string"] | None = "behind the head string" if scratch_fouls(shot) else None
        after = replace(state, table=table, opening=False, in_hand=place)
        weak, continues = not is_legal_break(shot), bool(shot.down) and not fouls
        offered: tuple[Decision, ...] = ()
        if weak:
            also: tuple[Decision, ...] = ("rerack and pass",) if state.players == 2 else ()
            offered = ("play", "rerack", *also)
        elif respot:  # (e), (f): the eight on the break neither wins nor loses
            offered = ("play", "rerack")
        if fouls and not scratch_fouls(shot):  # (h)
            offered = (*(offered or ("play",)), "in hand")
        after = replace(after, turn=state.turn if continues else state.other, decisions=offered)
        reasons = [f"foul: {each}" for each in fouls] + (["illegal break"] if weak else [])
        messages = reasons + (["the 8 was pocketed on the break and is spotted"] if respot else [])
        return Ruling(after, fouls=fouls, respot=respot, continues=continues, messages=tuple(messages))

    def _eight(
        self, state: EightBallState, call: ShotCall, shot: ShotSummary, fouls: tuple[str, ...]
    ) -> Ruling[EightBallState]:
        """Judge a shot that pockets the eight: it wins or loses (WPA 3.8)."""
        lost = None
        if fouls:
            lost = f"the 8 was pocketed on a foul: {fouls[0]}"
        elif EIGHT not in self.legal_targets(state):
            lost = "the 8 was pocketed early"
        elif call.safety or call.pocket is None or call.pocket != shot.pocket_of(EIGHT):
            lost = "the 8 was pocketed in a pocket that was not called"
        winner = state.turn if lost is None else state.opponent
        after = replace(state, table=state.without(shot.down), in_hand=None, over=True, winner=winner)
        ends = f"{player_name(winner)} wins" if winner is not None else "the rack is lost"
        messages = (ends,) if lost is None else (lost, ends)
        return Ruling(after, fouls=fouls, messages=messages)

    def _decide(self, state: EightBallState, decision: Decision) -> Ruling[EightBallState]:
        if decision in ("rerack", "rerack and pass"):
            turn = state.turn if decision == "rerack" else state.other
            return Ruling(replace(self.start(state.players), turn=turn), rerack=True)
        if decision == "in hand":  # offered only after a break
            return Ruling(replace(state, in_hand="behind the head string"))
        return super()._decide(state, decision)


def _counted(before: EightBallState, verdict: Ruling[EightBallState]) -> Ruling[EightBallState]:
    """Return a result with scores and points by the pocketed balls of each group."""
    after = verdict.state
    scores = tuple(
        0 if group is None else sum(ball not in after.table for ball in GROUPS[group]) for group in after.groups
    )
    points = tuple(now - then for now, then in zip(scores, before.scores, strict=True))
    return replace(verdict, state=replace(after, scores=scores), points=points)


NINE = "9"
NINE_BALL_NAMES = tuple(str(number) for number in range(1, 10))
MAX_CONSECUTIVE_FOULS = 3
"""consecutive fouls that lose the rack (WPA 6.14)"""


@dataclass(frozen=True, kw_only=True)
class NineBallState(RulesState):
    """State of 9-ball; a score is the number of balls that the player has pocketed."""

    fouls: tuple[int, ...]
    """consecutive fouls of each player"""
    push_out: bool = False
    """whether the next shot may be a push-out"""


class NineBall(Ruleset[NineBallState]):
    """Rules of 9-ball."""

    name = "9-ball"
    rack = "9-ball"

    def start(self, players: int = 2) -> NineBallState:
        """Return the state before the break."""
        none = (0,) * checked_players(players)
        return NineBallState(
            players=players, scores=none, fouls=none, table=NINE_BALL_NAMES, in_hand="behind the head string"
        )

    def legal_targets(self, state: NineBallState) -> frozenset[str]:
        """Return the lowest ball on the table."""
        return frozenset() if state.over else frozenset((min(state.table, key=int),))

    def choices(self, state: NineBallState) -> ShotChoices:
        """Return the possible calls: only a push-out, on the shot after a fair break (WPA 2.4)."""
        return replace(super().choices(state), push_out=state.push_out and not state.over)

    def _judge(self, state: NineBallState, call: ShotCall, shot: ShotSummary) -> Ruling[NineBallState]:
        fouls = self._fouls(state, call, shot)
        fair = not fouls and not call.push_out
        table = state.without(shot.down if fair else tuple(ball for ball in shot.down if ball != NINE))
        respot = (at_foot(NINE),) if NINE in shot.down and not fair else ()
        consecutive = tuple(
            (count + 1 if fouls else 0) if each == state.turn else count for each, count in enumerate(state.fouls)
        )
        pocketed = len(shot.down) if fair else 0
        points = tuple(pocketed if each == state.turn else 0 for each in range(state.players))
        after = replace(
            state,
            table=table,
            opening=False,
            in_hand=None,
            fouls=consecutive,
            push_out=state.opening and not fouls,
            scores=state.scored(state.turn, pocketed),
        )
        if fouls:
            return replace(_foul(after, fouls), respot=respot, points=points)
        if call.push_out:
            decisions: tuple[Decision, ...] = ("play", "pass") if state.players == 2 else ()
            after = replace(after, turn=state.other, decisions=decisions)
            return Ruling(
                after, respot=respot, points=points, messages=(f"{player_name(state.turn)} played a push-out",)
            )
        if NINE in shot.down:
            after = replace(after, over=True, winner=state.turn)
            return Ruling(after, points=points, messages=(f"{player_name(state.turn)} wins",))
        continues = bool(shot.down)
        return Ruling(after if continues else replace(after, turn=state.other), points=points, continues=continues)

    def _fouls(self, state: NineBallState, call: ShotCall, shot: ShotSummary) -> tuple[str, ...]:
        """Return the fouls: on a push-out only a scratch (WPA 2.4), on a break also a weak break (2.3)."""
        if call.push_out:
            return tuple(scratch_fouls(shot))
        wrong = [*scratch_fouls(shot), *wrong_ball_fouls(shot, self.legal_targets(state))]
        if not state.opening:
            return (*wrong, *no_rail_fouls(shot))
        return (*wrong, *(["illegal break"] if shot.first and not is_legal_break(shot) else []))


def _foul(after: NineBallState, fouls: tuple[str, ...]) -> Ruling[NineBallState]:
    """Return the result of a foul: ball in hand for the other player, or the end of the frame."""
    consecutive, shooter = after.fouls[after.turn], player_name(after.turn)
    if consecutive >= MAX_CONSECUTIVE_FOULS:
        winner = after.opponent
        ends = f"{player_name(winner)} wins" if winner is not None else "the rack is lost"
        lost = replace(after, over=True, winner=winner)
        return Ruling(
            lost,
            fouls,
            messages=(f"foul: {fouls[0]}", f"{shooter} fouled {MAX_CONSECUTIVE_FOULS} times in a row", ends),
        )
    messages = [f"foul: {fouls[0]}; {player_name(after.other)} has the ball in hand"]
    if consecutive == MAX_CONSECUTIVE_FOULS - 1:  # WPA 6.14: the player must be warned
        messages.append(f"{shooter} is on {consecutive} fouls; one more loses the rack")
    return Ruling(replace(after, turn=after.other, in_hand="anywhere"), fouls, messages=tuple(messages))


@dataclass(frozen=True, kw_only=True)
class FreePlayState(RulesState):
    """State of free play; a score is the number of balls that the player has pocketed."""

    rack: tuple[str, ...]
    """object balls at the start"""
    cue: str
    """the cue ball"""


FREE_PLAY_DECISIONS: tuple[Decision, ...] = ("play", "in hand", "rerack")
"""decisions before every shot of free play"""


class FreePlay(Ruleset[FreePlayState]):
    """Rules of free play."""

    name = "free"
    rack = "8-ball"

    def start(self, players: int = 2, balls: tuple[str, ...] = EIGHT_BALL_NAMES, cue: str = "cue") -> FreePlayState:
        """Return the state before the first shot.

        Args:
            players: 1 or 2.
            balls: the object balls, of any rack; on a table without pockets they are never pocketed.
            cue: the cue ball of both players.

        Raises:
            GameError: the number of players is not 1 or 2, or the cue ball is an object ball.
        """
        scores = (0,) * checked_players(players)
        if cue in balls:
            raise GameError(f"{cue!r} cannot be both the cue ball and an object ball")
        return FreePlayState(
            players=players,
            scores=scores,
            table=balls,
            rack=balls,
            cue=cue,
            in_hand="anywhere",
            decisions=FREE_PLAY_DECISIONS,
        )

    def cue_ball(self, state: FreePlayState) -> str:
        """Return the cue ball."""
        return state.cue

    def legal_targets(self, state: FreePlayState) -> frozenset[str]:
        """Return every object ball on the table."""
        return frozenset() if state.over else frozenset(state.table)

    def _judge(self, state: FreePlayState, call: ShotCall, shot: ShotSummary) -> Ruling[FreePlayState]:  # noqa: ARG002
        table, pocketed = state.without(shot.down), len(shot.down)
        continues = pocketed > 0 and not shot.scratched
        points = tuple(pocketed if each == state.turn else 0 for each in range(state.players))
        after = replace(
            state,
            turn=state.turn if continues else state.other,
            scores=state.scored(state.turn, pocketed),
            table=table,
            opening=False,
            in_hand="anywhere" if shot.scratched else None,
            decisions=FREE_PLAY_DECISIONS,
        )
        messages = ("scratch: cue ball in hand",) if shot.scratched else ()
        if table or not state.rack:
            return Ruling(after, points=points, continues=continues, messages=messages)
        top = max(after.scores)
        winner = after.scores.index(top) if after.scores.count(top) == 1 else None
        ends = f"table cleared: {player_name(winner)} wins" if winner is not None else "table cleared: a draw"
        over = replace(after, over=True, winner=winner, in_hand=None, decisions=())
        return Ruling(over, points=points, messages=(*messages, ends))

    def _decide(self, state: FreePlayState, decision: Decision) -> Ruling[FreePlayState]:
        if decision == "rerack":
            return Ruling(replace(self.start(state.players, state.rack, state.cue), turn=state.turn), rerack=True)
        return Ruling(
            replace(
                state, in_hand="anywhere" if decision == "in hand" else state.in_hand, decisions=FREE_PLAY_DECISIONS
            )
        )
