"""Aim: the angle and speed at which a shot hits, by shooting in thought: a fan of shells, then finer fans.

Between two neighbours of which one falls short and the other far, the fan is laid anew, closer; the last step is the
secant's. A search can be made in one go or by and by, between the steps of a game: it comes to the same.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.flight import landing
from sandbox.games.artillery.ground import Ground
from sandbox.games.artillery.tanks import Muzzle
from sandbox.games.artillery.terrain import Edges
from sandbox.games.artillery.volley import Volley
from sandbox.scene.description.world import World

COARSE, CLOSE = 0.08, 0.04
"""s, steps of the first fan and of the finer ones: 2.4 m at 60 m/s, two columns or so"""
ANGLES = np.radians(np.arange(3.0, 178.0, 1.5))
"""of the first fan"""
SHARES = np.linspace(0.3, 1.0, 8)
"""of full speed, of the first fan"""
TRIED, PARTS = 16, 16
"""brackets looked at more closely, and into how many parts each"""
FINER = 2
"""how often"""
SHAKE, STEADY = math.radians(0.1), 2.0
"""A shot is steady that misses by no more than so many times what is near, when it is aimed so much otherwise."""
CHECKED = 6
"""shots that are followed to the end"""
CHECK_WORK = 10_000
"""of following one, in what a volley counts"""

Stage = Literal["fan", "finer", "shaken", "checked"]
"""The first fan flies; the brackets found in it; what came of these, and the same aimed a little otherwise; the best of
them are followed to the end."""


class Aim(NamedTuple):
    """A shot in thought."""

    angle: float
    """rad, anticlockwise from the right"""
    speed: float
    """m/s"""
    miss: float
    """m along the ground, from the target to where it comes down"""


class Range(NamedTuple):
    """What a target is shot at on."""

    world: World
    """gives gravity, drag and wind"""
    muzzle: Muzzle
    ground: Ground
    """as it lies"""
    edges: Edges
    full: float
    """m/s, the greatest speed"""
    at: float
    """m, where along the ground the target stands"""
    near: float
    """m; among shots that come down as near as this, those that hardly miss when aimed a little otherwise come first,
    of these the slowest, and then those that are in the air for the shortest time"""

    def volley(self, angle: FloatArray, speed: FloatArray, h: float) -> Volley:
        """Fire at angles, rad, and speeds, m/s, (K,) each."""
        velocity = speed[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        return Volley(self.world, self.muzzle.at(angle), velocity, self.ground, self.edges, h)

    def checked(self, aim: Aim) -> Aim:
        """Return a shot with the miss that it has in truth; inf where it comes down nowhere."""
        muzzle = self.muzzle.at(np.array([aim.angle]))[0]
        velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
        down = landing(self.world, muzzle, velocity, self.ground, self.edges)
        return aim._replace(miss=math.inf if down is None else down.place[0] - self.at)


class Search:
    """The search for the shot that comes down next to a target. A copy goes on by itself."""

    def __init__(self, range_: Range) -> None:
        self.found: Aim | None = None
        """the shot, once the search is done"""
        self._range = range_
        self._stage: Stage = "fan"
        angle, share = (each.reshape(-1) for each in np.meshgrid(ANGLES, SHARES))
        self._angle, self._speed = angle, range_.full * share  # of the shells that fly
        self._volley = range_.volley(self._angle, self._speed, COARSE)
        self._brackets = np.empty((0, 3))  # two angles, of a shot that is short and of one that is far, and a speed
        self._closer = 0
        self._left: list[Aim] = []  # to be followed
        self._best: Aim | None = None  # of those that were

    def go_on(self, work: int) -> Aim | None:
        """Search on for so much work, or a little more; return the shot once it is found.

        Args:
            work: in what a volley counts; a step of its few shells or a shot that is followed is done to the end.
        """
        while self.found is None and work > 0:
            if self._stage == "checked":
                work -= CHECK_WORK
                self._check()
            elif not self._volley.done:
                work -= self._volley.fly(work)
            elif self._stage == "fan":
                self._bracket()
            elif self._stage == "finer":
                self._close_in()
            else:
                self._order()
        return self.found

    def all(self) -> Aim:
        """Search to the end."""
        while self.found is None:
            self.go_on(CHECK_WORK)
        return self.found

    def _bracket(self) -> None:
        """Choose pairs of neighbours, one short and one far: first those close to each other, or soon there."""
        volley, angle, speed = self._volley, self._angle, self._speed
        miss = volley.place - self._range.at
        at = np.flatnonzero((miss[1:] * miss[:-1] <= 0.0) & (speed[1:] == speed[:-1]))
        jump = np.abs(miss[at + 1] - miss[at])
        at = at[np.argsort(jump + 0.5 * volley.when[at], kind="stable")][:TRIED]
        k = int(np.argmin(np.where(np.isnan(miss), np.inf, np.abs(miss))))
        self._best = Aim(float(angle[k]), float(speed[k]), math.inf)
        self._left = [self._best]  # should no pair lead to a hit
        self._brackets = np.column_stack((angle[at], angle[at + 1], speed[at]))
        self._fan()

    def _fan(self) -> None:
        """Fire between the shots of each bracket; where there is none, the best shot has to do."""
        if not len(self._brackets):
            self._stage = "checked"
            return
        low, high, speed = self._brackets.T
        fan = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, PARTS + 1)
        self._angle, self._speed, self._stage = fan.reshape(-1), np.repeat(speed, PARTS + 1), "finer"
        self._volley = self._range.volley(self._angle, self._speed, CLOSE)

    def _close_in(self) -> None:
        """Take of each bracket the part in which the change of sign is; at last, the shot by the secant."""
        row = np.arange(len(self._brackets))
        fan = self._angle.reshape(len(row), -1)
        miss = (self._volley.place - self._range.at).reshape(fan.shape)
        jump = np.abs(miss[:, 1:] - miss[:, :-1])
        jump[~(miss[:, 1:] * miss[:, :-1] <= 0.0)] = np.inf
        k = np.argmin(jump, axis=1)
        self._brackets = np.column_stack((fan[row, k], fan[row, k + 1], self._brackets[:, 2]))
        self._closer += 1
        if self._closer < FINER:
            self._fan()
            return
        short, far = miss[row, k], miss[row, k + 1]
        between = short - far
        share = np.where(np.isfinite(between) & (between != 0.0), short / np.where(between == 0.0, 1.0, between), 0.0)
        low, high, speed = self._brackets.T
        angle = low + np.clip(share, 0.0, 1.0) * (high - low)
        self._angle = (angle + np.array([[0.0], [-SHAKE], [SHAKE]])).reshape(-1)
        self._speed, self._stage = np.tile(speed, 3), "shaken"
        self._volley = self._range.volley(self._angle, self._speed, CLOSE)

    def _order(self) -> None:
        """Put the shots in the order in which they are followed."""
        volley, near, count = self._volley, self._range.near, len(self._brackets)
        shaken = (volley.place - self._range.at).reshape(3, -1)
        miss, when, speed = shaken[0], volley.when[:count], self._speed[:count]
        unsure = ~(np.abs(shaken).max(axis=0, initial=0.0) <= STEADY * near)  # where nan, too
        order = np.lexsort((when, speed, unsure, ~(np.abs(miss) <= near)))
        shots = [Aim(float(self._angle[k]), float(speed[k]), float(miss[k])) for k in order[:CHECKED].tolist()]
        self._left, self._stage = [*shots, *self._left], "checked"

    def _check(self) -> None:
        """Follow the next shot; the first that comes down near is taken, else the nearest."""
        assert self._best is not None
        aim = self._range.checked(self._left.pop(0))
        if abs(aim.miss) < abs(self._best.miss):
            self._best = aim
        if abs(aim.miss) <= self._range.near or not self._left:
            self.found = self._best
