"""Trial: what strokes lead to, on the exact engine and by the rules."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Exhaustion
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.bot.ease import Pots, pots
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.call import Call
from sandbox.games.billiards.rules.happening import Happening, touched_by
from sandbox.scene.description.surface import Stroke

IN_HAND = 0.9
"""the chance of a pot that a player with the ball in hand is taken to have"""


@dataclass(frozen=True, eq=False)
class Trial:
    """A match as a player looks at it who is to shoot."""

    match: Match
    table: Table
    """the same on the exact engine"""
    sigma: float
    """rad, the error of the player's aim"""

    @cached_property
    def radius(self) -> float:
        """Of the cue ball, m."""
        return self.match.layout.radius[self.match.layout.number[self.match.cue]]

    @cached_property
    def place(self) -> FloatArray:
        """(2,) m, where the cue ball lies."""
        return np.array(self.match.position[self.match.layout.number[self.match.cue]])

    def outcome(self, stroke: Stroke, call: Call | None = None) -> tuple[Match, Call] | None:
        """Return what a stroke leads to, and the call that goes with it; None where it cannot be computed.

        Args:
            stroke: as it is played, without an error.
            call: what was said; without one, what this very stroke would do is called.
        """
        match = self.match
        try:
            outcome = self.table.shoot(stroke, match.cue)
        except Exhaustion:
            return None
        contacts = outcome.contacts
        if call is None:
            call = called(match, match.happenings(contacts))
        return match.played(contacts, outcome.position, call), call

    def worth(self, made: tuple[Match, Call] | None) -> float:
        """Return how good what a stroke led to is for the player, −1 to 1 and a little more for points."""
        if made is None:
            return -1.0
        me, after = self.match.turn, made[0]
        if after.over:
            return 0.0 if after.state.winner is None else (1.5 if after.state.winner == me else -1.5)
        gained = 0.0
        if after.verdict is not None and after.verdict.points:
            gained = sum(p if each == me else -p for each, p in enumerate(after.verdict.points))
        points = UNIT.get(after.rules.name, 0.0) * gained
        again = after.turn == me
        return points + (0.3 + 0.5 * ease(after, self.sigma) if again else -0.1 - 0.6 * ease(after, self.sigma))


UNIT = {"snooker": 0.04, "three-cushion": 0.5, "straight-rail": 0.4, "free": 0.1}
"""what a point is worth, against the table"""


def ease(match: Match, sigma: float) -> float:
    """Return the chance of the best straight shot for whoever is to shoot, 0 to 1; in carom a guess by distances."""
    if match.state.in_hand is not None:
        return IN_HAND
    cue, targets, others = standing(match)
    if not len(targets):
        return 0.0
    if not match.layout.pockets:
        ways = np.hypot(*(others - cue).T)
        between = float(np.hypot(*(others[0] - others[-1])))
        return math.exp(-float(ways.min()) - between)
    return float(straight(match, sigma).chance.max(initial=0.0))


def straight(match: Match, sigma: float) -> Pots:
    """Return the straight shots of whoever is to shoot, at the balls on in the order of `match.state.table`."""
    cue, targets, others = standing(match)
    radius = match.layout.radius[match.layout.number[match.cue]]
    return pots(match.layout, radius, cue, targets, others, max(sigma, 1e-3))


def standing(match: Match) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where the cue ball, the balls on and all object balls lie, (2,), (T, 2) and (B, 2) m."""
    number, position, on = match.layout.number, match.position, match.targets
    cue = match.cue
    balls = [ball for ball in match.state.table if ball != cue]
    targets = [position[number[ball]] for ball in balls if ball in on]
    others = [position[number[ball]] for ball in balls]
    return np.array(position[number[cue]]), np.array(targets).reshape(-1, 2), np.array(others).reshape(-1, 2)


def called(match: Match, happenings: tuple[Happening, ...]) -> Call:
    """Return the call that goes with what is meant to happen: the ball touched first, the last ball's pocket."""
    choices = match.choices
    if not choices.balls:
        return Call()
    if choices.pocket:
        if not choices.needed:
            return Call()
        fell = {each.ball: each.other for each in happenings if each.kind == "pocket"}
        last = choices.balls[0]
        return Call(ball=last, pocket=fell.get(last, next(iter(match.layout.pockets))))
    first = next((ball for each in happenings if (ball := touched_by(match.cue, each)) is not None), None)
    if first in choices.balls:
        return Call(ball=first)
    return Call() if match.state.table and first in match.targets else Call(ball=choices.balls[0])
