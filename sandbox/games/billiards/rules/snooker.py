"""Snooker (WPBSA 3): a red, a colour, a red …, then the colours in order.

A single player scores for pocketed balls; foul points are not awarded then. With the foul-and-a-miss rule, a miss is
called for every wrong first contact, unless a player needed foul points before or after (Foul and a Miss); the quality
of the attempt is not judged.
"""

from dataclasses import dataclass, replace
from typing import Literal

from sandbox.games.billiards.rules.base import (
    Decision,
    Respot,
    Ruleset,
    RulesState,
    Ruling,
    ShotCall,
    ShotChoices,
    ShotSummary,
    Situation,
    checked_players,
    first_ball_hit,
    player_name,
)

REDS = tuple(f"red-{number}" for number in range(1, 16))
COLOUR_VALUES = {"yellow": 2, "green": 3, "brown": 4, "blue": 5, "pink": 6, "black": 7}
"""values of the colours, in the order of play after the reds"""
COLOURS = tuple(COLOUR_VALUES)
SNOOKER_NAMES = (*REDS, *COLOURS)
MIN_FOUL_POINTS = 4
"""minimum points of a foul"""


def value(ball: str) -> int:
    """Return the value of a ball; 1 for a red."""
    return COLOUR_VALUES.get(ball, 1)


def reds(table: tuple[str, ...]) -> tuple[str, ...]:
    """Return the reds among some balls."""
    return tuple(ball for ball in table if ball not in COLOUR_VALUES)


def colours(table: tuple[str, ...]) -> tuple[str, ...]:
    """Return the colours among some balls, the lowest first."""
    return tuple(ball for ball in COLOURS if ball in table)


def respots(balls: tuple[str, ...]) -> tuple[Respot, ...]:
    """Return the respots of colours, the highest first: on its own spot, else on the highest free spot."""
    down = COLOURS[::-1]
    return tuple(Respot(ball, (ball, *(spot for spot in down if spot != ball))) for ball in down if ball in balls)


@dataclass(frozen=True)
class SnookerShot:
    """A shot with the balls on."""

    shot: ShotSummary
    on: frozenset[str]
    """the balls on, without a free ball; empty if no colour was nominated"""
    worth: int
    """points of a ball on"""
    free: str | None
    """the free ball, which counts as a ball on"""
    touching: tuple[str, ...]
    """balls that touched the cue ball before the shot"""

    @property
    def fair(self) -> frozenset[str]:
        """Balls that may be pocketed: the balls on and the free ball."""
        return self.on if self.free is None else self.on | {self.free}

    @property
    def hit(self) -> bool:
        """Whether the first contact was legal.

        Playing away from a touching ball on counts as hitting it (Touching Ball). A free ball must be hit first, or at
        the same time as a ball on (Snookered after a Foul).
        """
        if self.free is None and not self.on.isdisjoint(self.touching):
            return True
        first = frozenset(self.shot.first)
        return bool(first) and first <= self.fair and (self.free is None or self.free in first)

    def value(self, ball: str) -> int:
        """Return the points of a ball; a free ball has the value of the ball on."""
        return self.worth if ball == self.free else value(ball)

    @property
    def fouls(self) -> tuple[tuple[int, str], ...]:
        """Fouls with their points (Penalties): the value of the ball on or concerned, at least 4."""
        shot, min_points = self.shot, max(MIN_FOUL_POINTS, self.worth)
        found: list[tuple[int, str]] = []
        if shot.scratched:
            found.append((min_points, "in-off"))
        if not self.hit:
            if not shot.first:
                found.append((min_points, "the cue ball hit no ball"))
            else:
                points_hit = max(min_points, *(self.value(ball) for ball in shot.first))
                found.append((points_hit, f"{first_ball_hit(shot)} hit first"))
        found += [
            (max(min_points, self.value(ball)), f"the {ball} was potted but not on")
            for ball in shot.down
            if ball not in self.fair
        ]
        if found and not self.on:  # Penalties: a foul after a red before a colour was nominated
            found = [(COLOUR_VALUES["black"], reason) for _, reason in found]
        return tuple(found)

    @property
    def points(self) -> int:
        """Points of a fair shot: one for each ball if a red is on, else the value of the ball on, once."""
        made = [ball for ball in self.shot.down if ball in self.fair]
        if not made:
            return 0
        return len(made) if self.worth == 1 else self.worth


def snooker_shot(
    shot: ShotSummary, on: str, table: tuple[str, ...], named: str | None, free: bool, touching: tuple[str, ...]
) -> SnookerShot:
    """Return a shot with the balls on.

    Args:
        shot: summary of the shot.
        on: `red`, `colour`, or the name of the colour on.
        table: the balls that were on the table.
        named: the nominated colour, or the free ball. Without it, the colour that is hit first, or that the cue ball
            is played away from, counts as nominated.
        free: whether a free ball might be nominated.
        touching: balls that touched the cue ball before the shot.
    """
    if on == "red":
        return SnookerShot(shot, frozenset(reds(table)), 1, named if free else None, touching)
    if on != "colour":
        return SnookerShot(shot, frozenset((on,)), value(on), named if free else None, touching)
    plain = colours(shot.first) if len(shot.first) == 1 else ()
    nominated = (named,) if named is not None else plain or colours(touching)
    if len(nominated) != 1 or nominated[0] not in COLOURS:
        return SnookerShot(shot, frozenset(), 1, None, touching)
    return SnookerShot(shot, frozenset(nominated), value(nominated[0]), None, touching)


On = Literal["red", "colour", "yellow", "green", "brown", "blue", "pink", "black"]


@dataclass(frozen=True, kw_only=True)
class SnookerState(RulesState):
    """State of snooker."""

    on: On = "red"
    """ball on; `colour` stands for any colour, after a red"""
    run: int = 0
    """points of this turn so far, called the break"""
    misses: bool = False
    """whether the foul-and-a-miss rule applies"""
    fouled: bool = False
    """whether the last stroke was foul"""
    free: bool = False
    """whether any ball may be nominated as a ball on"""
    freed: str | None = None
    """free ball of the last stroke, if no ball scored"""
    touching: tuple[str, ...] = ()
    """balls that touch the cue ball"""
    before: "SnookerState | None" = None
    """state that can be restored after a miss"""


def remaining(state: SnookerState) -> int:
    """Return the points that can still be made without fouls and free balls, with a black after each red."""
    black = COLOUR_VALUES["black"]
    points = sum(value(ball) for ball in colours(state.table)) + (1 + black) * len(reds(state.table))
    return points + (black if state.on == "colour" else 0)


class Snooker(Ruleset[SnookerState]):
    """Rules of snooker."""

    name = "snooker"
    rack = "snooker"

    def start(self, players: int = 2, misses: bool = False) -> SnookerState:
        """Return the state before the first stroke.

        Args:
            players: 1 or 2.
            misses: whether the foul-and-a-miss rule applies.
        """
        scores = (0,) * checked_players(players)
        return SnookerState(players=players, scores=scores, table=SNOOKER_NAMES, in_hand="in the D", misses=misses)

    def legal_targets(self, state: SnookerState) -> frozenset[str]:
        """Return the balls on; all balls if any may be nominated as a free ball."""
        if state.over:
            return frozenset()
        return frozenset(state.table) if state.free else balls_on(state)

    def choices(self, state: SnookerState) -> ShotChoices:
        """Return the possible decisions and nominations."""
        base = super().choices(state)
        if state.over or not (state.free or state.on == "colour"):
            return base
        on = balls_on(state)
        named = tuple(ball for ball in state.table if (ball in on) != state.free)
        return replace(base, balls=named)

    def settle(self, state: SnookerState, situation: Situation) -> Ruling[SnookerState]:
        """Return the state with the touching balls, and with a free ball or a foul if the player is snookered.

        After a foul that leaves a snooker, any ball is free. A snooker behind the free ball itself is a foul, unless
        only pink and black are left.
        """
        after = replace(state, touching=situation.touching, freed=None)
        if state.over or not situation.snookered:
            return Ruling(after)
        if state.freed is not None and state.freed in situation.by and set(state.table) != {"pink", "black"}:
            penalty = max(MIN_FOUL_POINTS, COLOUR_VALUES.get(state.on, 1))
            reason = f"the free ball, {state.freed}, snookers the opponent"
            points = tuple(penalty * (each == state.turn) for each in range(state.players))
            scores = state.scored(state.turn if state.players == 2 else None, penalty)
            after = replace(after, scores=scores, fouled=True, free=True, decisions=_replies(state, False))
            messages = (f"foul: {reason}; {penalty} points", "free ball")
            return Ruling(after, (reason,), points if state.players == 2 else (0,), messages=messages)
        if not state.fouled:
            return Ruling(after)
        return Ruling(replace(after, free=True), messages=("free ball",))

    def _judge(self, state: SnookerState, call: ShotCall, shot: ShotSummary) -> Ruling[SnookerState]:
        played = snooker_shot(shot, state.on, state.table, call.ball, state.free, state.touching)
        clean = replace(
            state,
            opening=False,
            in_hand="in the D" if shot.scratched else None,
            fouled=False,
            free=False,
            freed=None,
            touching=(),
            before=None,
        )
        fouls = played.fouls
        return self._foul(state, clean, played, fouls) if fouls else self._fair(clean, played)

    def _fair(self, state: SnookerState, played: SnookerShot) -> Ruling[SnookerState]:
        """Return the result of a fair stroke."""
        down, points = played.shot.down, played.points
        last = state.on not in ("red", "colour")
        removed = tuple(ball for ball in down if ball not in COLOUR_VALUES or (last and ball == state.on))
        respotted = tuple(ball for ball in down if ball not in removed)
        table = state.without(removed)
        gained = tuple(points * (each == state.turn) for each in range(state.players))
        after = replace(state, table=table, scores=state.scored(state.turn, points), run=state.run + points)
        if not points:
            after = replace(after, turn=state.other, on=_next_ball_on(table), run=0, freed=played.free)
            return Ruling(_claimable(after), points=gained)
        if not table:
            return replace(_ended(after), points=gained)
        after = replace(after, on="colour" if state.on == "red" else _next_ball_on(table))
        return Ruling(_claimable(after), points=gained, respot=respots(respotted), continues=True)

    def _foul(
        self, state: SnookerState, clean: SnookerState, played: SnookerShot, fouls: tuple[tuple[int, str], ...]
    ) -> Ruling[SnookerState]:
        """Return the result of a foul: the highest penalty counts, reds stay down, colours are respotted (Fouls)."""
        penalty, down = max(fouls)[0], played.shot.down
        reasons = tuple(each for _, each in fouls)
        table = state.without(reds(down))
        after = replace(clean, table=table, scores=state.scored(state.opponent, penalty), run=0, fouled=True)
        gained = tuple(penalty * (each == state.opponent) for each in range(state.players))
        text = f"foul: {reasons[0]}; {penalty} points"
        if state.table == ("black",):  # End of Frame: the first score or foul ends the frame
            ended = _ended(after)
            return replace(ended, fouls=reasons, points=gained, messages=(text, *ended.messages))
        after = replace(after, turn=state.other, on=_next_ball_on(table))
        missed = state.misses and not played.hit and not _needed(state) and not _needed(after)
        after = replace(
            after, decisions=_replies(after, missed), before=replace(state, before=None) if missed else None
        )
        messages = (text, "foul and a miss: the shot may be replayed from the same position") if missed else (text,)
        colours_down = tuple(ball for ball in down if ball in COLOUR_VALUES)
        return Ruling(after, reasons, gained, respot=respots(colours_down), messages=messages)

    def _decide(self, state: SnookerState, decision: Decision) -> Ruling[SnookerState]:
        after = replace(state, before=None)
        if decision == "pass":  # there is no free ball if the offender plays again
            return Ruling(replace(after, turn=state.other, free=False, fouled=False))
        if decision == "restore" and state.before is not None:
            return Ruling(replace(state.before, scores=state.scores), restore=True)
        if decision == "claim":
            return Ruling(replace(after, over=True, winner=state.turn), messages=(f"{player_name(state.turn)} wins",))
        return Ruling(after)


def balls_on(state: SnookerState) -> frozenset[str]:
    """Return the balls on, without a free ball."""
    if state.on == "red":
        return frozenset(reds(state.table))
    return frozenset(colours(state.table) if state.on == "colour" else (state.on,))


def _next_ball_on(table: tuple[str, ...]) -> On:
    """Return the ball on at the start of a turn: red, else the lowest colour."""
    order: tuple[On, ...] = ("yellow", "green", "brown", "blue", "pink", "black")
    return "red" if reds(table) else next(ball for ball in order if ball in table)


def _replies(state: SnookerState, missed: bool) -> tuple[Decision, ...]:
    """Return the decisions of the other player after a foul."""
    if state.players == 1:
        return ()
    return ("play", "pass", "restore") if missed else ("play", "pass")


def _needed(state: SnookerState) -> bool:
    """Return whether a player needs foul points to draw level."""
    return max(state.scores) - min(state.scores) > remaining(state)


def _claimable(state: SnookerState) -> SnookerState:
    """Return the state, with a `claim` offered if only the black is left and the lead exceeds its value."""
    if state.table != ("black",) or state.players == 1:
        return state
    if state.scores[state.turn] - state.scores[state.other] <= COLOUR_VALUES["black"]:
        return state
    return replace(state, decisions=("play", "claim"))


def _ended(state: SnookerState) -> Ruling[SnookerState]:
    """Return the end of the frame. At level scores the black is respotted, and the other player may play or pass."""
    if state.players == 2 and state.scores[0] == state.scores[1]:
        after = replace(
            state, table=("black",), on="black", turn=state.other, in_hand="in the D", run=0, decisions=("play", "pass")
        )
        after = replace(after, fouled=False)
        return Ruling(after, respot=respots(("black",)), messages=("scores level: the black is respotted",))
    winner = state.scores.index(max(state.scores))
    return Ruling(replace(state, over=True, winner=winner), messages=(f"{player_name(winner)} wins",))
