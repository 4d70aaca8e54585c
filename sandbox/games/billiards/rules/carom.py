"""Carom: three-cushion and straight rail (UMB): touch both other balls, for a point and another shot.

A miss is not a foul; it ends the turn. If the player who began reaches the distance first, the other player has one
last turn from the starting position, so that both have the same number of turns. Equal scores are a draw.
"""

from dataclasses import dataclass, replace

from sandbox.games.billiards.rules.base import (
    Decision,
    GameError,
    Respot,
    Ruleset,
    RulesState,
    Ruling,
    ShotCall,
    ShotSummary,
    Situation,
    balls_touched_by,
    checked_players,
    player_name,
)

RED = "red"
WHITES = ("white", "yellow")
CAROM_NAMES = (*WHITES, RED)


@dataclass(frozen=True, kw_only=True)
class CaromState(RulesState):
    """State of carom. A score is the number of caroms; `table` has all three balls."""

    distance: int
    """points to win"""
    innings: tuple[int, ...]
    """completed turns of each player"""
    run: int = 0
    """points of this turn so far"""
    touching: tuple[str, ...] = ()
    """balls that touch the cue ball"""
    last: bool = False
    """whether the frame ends with this turn"""


class Carom(Ruleset[CaromState]):
    """Rules of a carom game."""

    rack = "carom"
    cue_balls = WHITES

    def __init__(self, name: str, cushions: int, distance: int) -> None:
        """Define a game.

        Args:
            name: name of the game.
            cushions: number of cushion contacts of the cue ball before it touches the second ball.
            distance: default points to win.
        """
        self.name, self.cushions, self.distance = name, cushions, distance

    def start(self, players: int = 2, distance: int | None = None) -> CaromState:
        """Return the state before the opening shot.

        Raises:
            GameError: the number of players is not 1 or 2, or the distance is less than 1.
        """
        points = self.distance if distance is None else distance
        if points < 1:
            raise GameError(f"distance {points} is out of range; it should be 1 or more")
        none = (0,) * checked_players(players)
        return CaromState(players=players, scores=none, innings=none, table=CAROM_NAMES, distance=points)

    def legal_targets(self, state: CaromState) -> frozenset[str]:
        """Return both other balls; on the opening shot the red (UMB 23)."""
        if state.over:
            return frozenset()
        return frozenset((RED,) if state.opening else state.without((self.cue_ball(state),)))

    def settle(self, state: CaromState, situation: Situation) -> Ruling[CaromState]:
        """Return the state with the touching balls; the player may have them spotted, or play away (UMB 27)."""
        if state.over:
            return Ruling(state)
        decisions: tuple[Decision, ...] = ("play", "spot") if situation.touching else ()
        messages = (
            (f"the cue ball is frozen to the {' and the '.join(situation.touching)}",) if situation.touching else ()
        )
        return Ruling(replace(state, touching=situation.touching, decisions=decisions), messages=messages)

    def _decide(self, state: CaromState, decision: Decision) -> Ruling[CaromState]:
        after = replace(state, touching=())
        if decision != "spot":
            return Ruling(after)
        if self.cushions == 0:  # in straight rail all three balls return to the starting position
            return Ruling(replace(after, opening=True), rerack=True)
        # UMB 83: the red goes to the foot spot, the cue ball to the head spot, the other white to the centre. A ball
        # whose spot is occupied by the third ball goes to the spot of the third ball.
        cue = self.cue_ball(state)
        spots = {RED: "foot", cue: "head", next(ball for ball in WHITES if ball != cue): "centre"}
        lifted = [ball for ball in CAROM_NAMES if ball == cue or ball in state.touching]
        rest = tuple(spots[ball] for ball in CAROM_NAMES if ball not in lifted)
        return Ruling(after, respot=tuple(Respot(ball, (spots[ball], *rest)) for ball in lifted))

    def _judge(self, state: CaromState, call: ShotCall, shot: ShotSummary) -> Ruling[CaromState]:  # noqa: ARG002
        if any(each.kind == "pocket" for each in shot.events):
            raise GameError("a carom table has no pockets")
        after = replace(state, opening=False, touching=())
        if state.opening and shot.first and RED not in shot.first:
            fouls = ("the opening shot must hit the red first",)
            return self._ended(after, fouls)
        if not self._is_scored(shot):
            return self._ended(after, ())
        after = replace(after, scores=state.scored(state.turn, 1), run=state.run + 1)
        points = tuple(int(each == state.turn) for each in range(state.players))
        if after.scores[state.turn] >= state.distance:
            text = f"{player_name(state.turn)} has reached {state.distance}"
            verdict = self._ended(replace(after, last=after.last or state.turn == state.players - 1), (), full=True)
            return replace(verdict, points=points, messages=(text, *verdict.messages))
        return Ruling(after, points=points, continues=True)

    def _is_scored(self, shot: ShotSummary) -> bool:
        """Return whether the cue ball touched both balls, after enough cushion contacts, repeated ones included."""
        touched: set[str] = set()
        cushions = 0
        for each in shot.events:
            if each.kind == "cushion" and each.ball == shot.cue:
                cushions += 1
            ball = balls_touched_by(shot.cue, each)
            if ball is not None and ball not in touched:
                touched.add(ball)
                if len(touched) == 2:
                    return cushions >= self.cushions
        return False

    def _ended(self, state: CaromState, fouls: tuple[str, ...], full: bool = False) -> Ruling[CaromState]:
        """Return the result of the end of a turn: the other player's turn, the last turn, or the end of the frame."""
        none = (0,) * state.players
        messages = tuple(f"foul: {each}" for each in fouls)
        innings = tuple(count + (each == state.turn) for each, count in enumerate(state.innings))
        after = replace(state, innings=innings, run=0)
        if state.last:
            top = max(state.scores)
            winner = state.scores.index(top) if state.scores.count(top) == 1 else None
            ends = f"{player_name(winner)} wins" if winner is not None else "the frame is drawn"
            over = replace(after, over=True, winner=winner)
            return Ruling(over, fouls, none, messages=(*messages, ends))
        after = replace(after, turn=state.other, last=full, opening=full)
        if not full:
            return Ruling(after, fouls, none, messages=messages)
        ends = f"{player_name(state.other)} has a last turn, from the starting position"
        return Ruling(after, fouls, none, rerack=True, messages=(*messages, ends))
