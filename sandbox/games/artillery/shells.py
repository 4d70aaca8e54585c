"""Shells: what flies, as the engine moves it, and where it enters the ground or strikes a tank between two frames.

A shell meets nothing in the engine. Where it strikes is read off its way, which between two frames is the cubic through
both states: so an engine lets no shell through thin ground, whatever the step, and what a landing misses by is the
integrator's error and nothing else.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.flight import Landing, crossing, past, strike
from sandbox.games.artillery.ground import Ground
from sandbox.games.artillery.roots import bracketed
from sandbox.games.artillery.tanks import Tank
from sandbox.games.artillery.terrain import Edges
from sandbox.games.artillery.weapons import Weapon

RADIUS = 0.25
"""m"""
MASS = 10.0
"""kg"""


@dataclass
class Shell:
    """A shell in the air, or rolling."""

    name: str
    shooter: Tank
    weapon: Weapon
    place: FloatArray
    """(2,) m, as seen last"""
    velocity: FloatArray
    """(2,) m/s"""
    number: int | None = None
    """of its body, once that is there"""
    fired: float = 0.0
    """s, when it left the muzzle"""
    exact: Landing | None = None
    """where the exact flight comes down"""
    disturbed: bool = False
    """Air or gravity became others on its way."""
    whole: bool = True
    """It is what was fired, no fragment of it."""
    rolling: float | None = None
    """s, since when"""
    slow: float | None = None
    """s, since when it hardly rolls on"""


class Step:
    """The way of a shell between two frames: the cubic through both states (Hermite)."""

    def __init__(self, start: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray], time: float) -> None:
        """Take places, m, and velocities, m/s, and the time between them, s."""
        self._start, self._end, self._time = start, end, time

    def at(self, share: float) -> FloatArray:
        """Return the place (2,), m, at a share of the time."""
        s, (a, v), (b, w), h = share, self._start, self._end, self._time
        level = s * s * (3.0 - 2.0 * s)
        return np.asarray(
            a + level * (b - a) + h * (s * (1.0 - s) ** 2 * v - s * s * (1.0 - s) * w),
        )

    def velocity(self, share: float) -> FloatArray:
        """Return about how fast it goes there, (2,) m/s."""
        return np.asarray(self._start[1] + share * (self._end[1] - self._start[1]))

    def meets(self, ground: Ground, discs: FloatArray, until: float) -> tuple[float, int | None] | None:
        """Return when it enters the ground or strikes a disc, as a share of the time up to `until`, and which disc."""
        a, b = self._start[0], self.at(until)
        found, struck = crossing(ground, a, b), strike(discs, a, b)
        if struck is not None and (found is None or struck[0] < found.here):
            disc = discs[struck[1]]
            share = self._root(lambda s: math.dist(self.at(s), disc[:2]) - float(disc[2]), 0.0, struck[0] * until)
            return share, struck[1]
        if found is None:
            return None

        def gap(share: float) -> float:
            place = self.at(share)
            return float(place[1] - ground.surface(place[0]))

        return self._root(gap, found.before * until, found.here * until, found.after * until), None

    @staticmethod
    def _root(f: Callable[[float], float], low: float, here: float, high: float | None = None) -> float:
        """Return a root near `here`, where one is bracketed; else `here`, which the straight way says."""
        high = here if high is None else high
        for until in (high, min(high + 0.05, 1.0)):
            if low < until and f(low) > 0.0 >= f(until):
                return bracketed(f, low, until, 1e-12)
        return here


def returned(
    place: FloatArray, velocity: FloatArray, ground: Ground, edges: Edges
) -> tuple[FloatArray, FloatArray] | None:
    """Return place and velocity of a shell beyond a side as it goes on within; none where it is not, or may leave."""
    if edges == "open" or 0.0 <= place[0] <= ground.width:
        return None
    return past(place, velocity, 1 if place[0] > 0.0 else -1, ground.width, edges)
