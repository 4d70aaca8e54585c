"""Bot of curling: chooses a shot from the positions of the stones, and adds a random error to the delivery.

It aims by the closed-form path of a stone without collisions. It takes out the opponent's best stone if a path to it is
free; otherwise it draws to the tee, with the turn whose path has more clearance.
"""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.games.curling.delivery import Delivery, Ice
from sandbox.games.curling.sheet import RELEASE, STONE, end_score, in_house
from sandbox.scene.description.base import Point
from sandbox.scene.random_streams import Stream, draws

SPEED_ERROR, HEADING_ERROR = 0.006, 0.0025
"""relative, and rad: standard deviations of the errors of speed and heading at `error = 1`"""
TAKE_OUT_DISTANCE = 7.0
"""m, distance past the target at which the stone of a take-out would stop without the collision"""
MIN_CLEARANCE = 0.04
"""m between the path of a stone and other stones"""
PATH_POINTS = 400
"""number of points at which the clearance of a path is tested, about 7 cm apart"""
DRAW: Point = (-0.15, 0.0)
"""m, target of a draw: slightly short of the tee, which is harder to hit"""
GUARD: Point = (-3.2, 0.0)
"""m, target of a guard"""
GUARD_DELIVERIES = 2
"""first deliveries of an end, in which the bot lays guards if the other team has the hammer"""

Stones = Sequence[tuple[int, Point]]
"""team, and position, m, of each stone in play"""


class CurlingBot:
    """Bot that plays one team."""

    def __init__(self, team: int, ice: Ice, error: float, seed: int) -> None:
        self._team, self._ice, self._error = team, ice, error
        self._rng = draws(Stream.CURLER, seed, team)

    def delivery(self, stones: Stones, thrown: int, last: bool) -> Delivery:
        """Return the next delivery, with its error.

        Args:
            stones: stones in play.
            thrown: number of stones delivered in this end.
            last: whether the team has the hammer.
        """
        chosen = self.choice(stones, thrown, last)
        speed, sideways = self._rng.normal(0.0, self._error, 2).tolist()
        return chosen._replace(
            speed=chosen.speed * (1.0 + SPEED_ERROR * speed), heading=chosen.heading + HEADING_ERROR * sideways
        )

    def choice(self, stones: Stones, thrown: int, last: bool) -> Delivery:
        """Return the intended delivery, without error."""
        winner, _ = end_score(stones)
        if winner is not None and winner != self._team and (hit := self._take_out(stones)) is not None:
            return hit
        if not last and thrown < GUARD_DELIVERIES:
            return self._draw_to(GUARD, stones)
        return self._draw_to(DRAW, stones)

    def _take_out(self, stones: Stones) -> Delivery | None:
        """Return a delivery that takes out the opponent's best stone with a free path to it; None without one."""
        theirs = [position for team, position in stones if team != self._team and in_house(position)]
        for target in sorted(theirs, key=lambda position: math.hypot(*position)):
            speed = self._ice.speed_for(math.dist(target, (RELEASE, 0.0)) + TAKE_OUT_DISTANCE)
            for turn in (1, -1):
                delivery = self._ice.through(target, turn, speed)
                if self._clearance(delivery, stones, target) > MIN_CLEARANCE:
                    return delivery
        return None

    def _draw_to(self, target: Point, stones: Stones) -> Delivery:
        """Return the delivery to a target with the larger clearance."""
        deliveries = [self._ice.to_rest(target, turn) for turn in (1, -1)]
        return max(deliveries, key=lambda delivery: min(self._clearance(delivery, stones, None), MIN_CLEARANCE))

    def _clearance(self, delivery: Delivery, stones: Stones, target: Point | None) -> float:
        """Return the clearance, m, between the path of a stone and the other stones; with a target, only up to it."""
        others = np.asarray([complex(*position) for _, position in stones if position != target])
        if not len(others):
            return math.inf
        fractions = np.linspace(1.0, 0.0, PATH_POINTS)
        path = np.asarray([RELEASE + self._ice.displacement(delivery, fraction) for fraction in fractions.tolist()])
        if target is not None:
            path = path[path.real < target[0] - 2.0 * STONE]
        return float(np.abs(path[:, None] - others).min(initial=math.inf)) - 2.0 * STONE
