"""Team: one that plays by itself. It looks at the stones, chooses a shot, and delivers it with some error.

It aims by the closed form of a stone that nothing is in the way of: takes out what counts against it, where a way
there is free, else comes to the tee, on the side on which less is in the way.
"""

import math
from collections.abc import Sequence

import numpy as np

from sandbox.games.curling.delivery import Delivery, Ice
from sandbox.games.curling.sheet import RELEASE, STONE, end_score, in_house
from sandbox.scene.description.base import Point
from sandbox.scene.random_streams import Stream, draws

LENGTH, LINE = 0.006, 0.0025
"""Of the speed, and rad: standard errors of a delivery at error 1."""
PAST = 7.0
"""m beyond a stone that is taken out, to which the thrown one would go by itself"""
GAP = 0.04
"""m that there has to be between the way of a stone and others"""
LOOKS = 400
"""Places of a way that are looked at: one each 7 cm."""
DRAW: Point = (-0.15, 0.0)
"""m: a little short of the tee, where others have to come round"""
GUARD: Point = (-3.2, 0.0)
FIRST = 2
"""Deliveries of an end in which it lays a guard, where the other team has the last stone."""

Stones = Sequence[tuple[int, Point]]
"""team and place of each in play"""


class CurlingBot:
    """One that chooses and delivers."""

    def __init__(self, team: int, ice: Ice, error: float, seed: int) -> None:
        self._team, self._ice, self._error = team, ice, error
        self._chance = draws(Stream.CURLER, seed, team)

    def delivery(self, stones: Stones, thrown: int, last: bool) -> Delivery:
        """Return how the next stone is let go.

        Args:
            stones: that are in play.
            thrown: how many of this end have been.
            last: whether this team has the last stone of the end.
        """
        chosen = self.choice(stones, thrown, last)
        speed, aside = self._chance.normal(0.0, self._error, 2).tolist()
        return chosen._replace(speed=chosen.speed * (1.0 + LENGTH * speed), heading=chosen.heading + LINE * aside)

    def choice(self, stones: Stones, thrown: int, last: bool) -> Delivery:
        """Return the delivery that it means, without error."""
        winner, _ = end_score(stones)
        if winner is not None and winner != self._team and (hit := self._hit(stones)) is not None:
            return hit
        if not last and thrown < FIRST:
            return self._freest(GUARD, stones)
        return self._freest(DRAW, stones)

    def _hit(self, stones: Stones) -> Delivery | None:
        """Return a free way to the stone that counts most against it of those that there is one to."""
        theirs = [place for team, place in stones if team != self._team and in_house(place)]
        for target in sorted(theirs, key=lambda place: math.hypot(*place)):
            speed = self._ice.speed_for(math.dist(target, (RELEASE, 0.0)) + PAST)
            for turn in (1, -1):
                way = self._ice.through(target, turn, speed)
                if self._room(way, stones, target) > GAP:
                    return way
        return None

    def _freest(self, target: Point, stones: Stones) -> Delivery:
        """Return the delivery to a place on whose way there is most room."""
        ways = [self._ice.to_rest(target, turn) for turn in (1, -1)]
        return max(ways, key=lambda way: min(self._room(way, stones, None), GAP))

    def _room(self, way: Delivery, stones: Stones, target: Point | None) -> float:
        """Return how much room a way leaves between the stone and others before it is at the target, m."""
        others = np.asarray([complex(*place) for _, place in stones if place != target])
        if not len(others):
            return math.inf
        shares = np.linspace(1.0, 0.0, LOOKS)
        places = np.asarray([RELEASE + self._ice.way(way, share) for share in shares.tolist()])
        if target is not None:
            places = places[places.real < target[0] - 2.0 * STONE]
        return float(np.abs(places[:, None] - others).min(initial=math.inf)) - 2.0 * STONE
