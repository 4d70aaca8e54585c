"""Aim: the angle and speed at which a shot hits, by shooting in thought: a fan of shells, then finer fans.

Between two neighbours of which one falls short and the other far, the fan is laid anew, closer; the last step is the
secant's. A search can be made in one go or by and by, between the steps of a game: it comes to the same.

Volley: shells in thought, all flying at once as the bodies of one state, by the engine `reference`'s Runge–Kutta.

It flies by and by: whoever asks for a part of the way, and then for the next, gets the same as who asks for all of it.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.reference.integrators import INTEGRATORS, transition
from sandbox.games.artillery.ballistics import inputs_of, landing
from sandbox.games.artillery.battlefield import Muzzle
from sandbox.games.artillery.scene import Edges
from sandbox.games.artillery.terrain import Ground
from sandbox.scene.description.world import World

MAX_TRIAL_TIME = 30.0
"""s, of a flight in thought"""
STEP_WORK = 300
"""A step takes about as long as numpy takes for so many shells, and besides that some time for each shell."""


class TrialShots:
    """K shells in the air.

    Between steps their ways are straight: (g h²)/8 off at most, 2 mm at a step of 40 ms. Peaks between steps are not
    seen.
    """

    def __init__(
        self, world: World, position: FloatArray, velocity: FloatArray, ground: Ground, edges: Edges, h: float
    ) -> None:
        """Fire.

        Args:
            world: gives gravity, drag and wind.
            position: (K, 2) m, of the muzzles.
            velocity: (K, 2) m/s.
            ground: as it lies.
            edges: what becomes of shells at the ground's sides.
            h: step, s.
        """
        self._world, self._ground, self._edges, self._h = world, ground, edges, h
        self.place = np.full(len(position), np.nan)
        """(K,) m along the ground, where each came down; beside it or never: nan"""
        self.when = np.full(len(position), np.nan)
        """(K,) s, when it did"""
        self._k, self._steps = 0, int(MAX_TRIAL_TIME / h)
        self._number = np.arange(len(position))  # of those in the air
        self._state = np.stack((position, velocity))
        self._gap = self._state[0, :, 1] - ground.surface(self._state[0, :, 0])
        below = self._gap < 0.0
        self.place[below], self.when[below] = position[below, 0], 0.0
        self._keep(~below)

    @property
    def done(self) -> bool:
        """Whether nothing flies any more."""
        return not len(self._number) or self._k >= self._steps

    def fly(self, work: int) -> int:
        """Go on for so much work, counted in shells × steps, or a step at least; return how much was done."""
        did = 0
        while not self.done and did < work:
            did += STEP_WORK + len(self._number)
            self._step()
        return did

    def _step(self) -> None:
        step, inputs, ground = INTEGRATORS["rk4"].step, inputs_of(self._world, len(self._number)), self._ground
        before, gap = self._state, self._gap
        self._state = state = step(transition, 0.0, before, inputs, self._h)
        x, was = state[0, :, 0], before[0, :, 0]
        open_ = self._edges == "open"
        self._gap = now = state[0, :, 1] - ground.surface(x if open_ else np.clip(x, 0.0, ground.width))
        down = (now <= 0.0) & np.isfinite(now)
        share = gap[down] / (gap[down] - now[down])
        share[~np.isfinite(share)] = 1.0  # through the ground's side
        self.place[self._number[down]] = was[down] + share * (x[down] - was[down])
        self.when[self._number[down]] = (self._k + share) * self._h
        self._k += 1
        if open_:
            self._keep(~(down | ((state[0, :, 1] < 0.0) & ((x < 0.0) | (x > ground.width)))))
        else:
            self._keep(~down)
            self._return()

    def _keep(self, flying: BoolArray) -> None:
        """Go on with those that fly."""
        if not flying.all():
            self._number, self._state, self._gap = self._number[flying], self._state[:, flying], self._gap[flying]

    def _return(self) -> None:
        """Let those that have passed a side come in again."""
        state, ground = self._state, self._ground
        for side, wall in ((-1.0, 0.0), (1.0, ground.width)):
            out = side * (state[0, :, 0] - wall) > 0.0
            if not out.any():
                continue
            if self._edges == "wrap":
                state[0, out, 0] -= side * ground.width
            else:
                state[0, out, 0] = 2.0 * wall - state[0, out, 0]
                state[1, out, 0] *= -1.0
            self._gap[out] = state[0, out, 1] - ground.surface(state[0, out, 0])


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


class FiringSolution(NamedTuple):
    """A shot in thought."""

    angle: float
    """rad, anticlockwise from the right"""
    speed: float
    """m/s"""
    miss: float
    """m along the ground, from the target to where it comes down"""


class TargetingProblem(NamedTuple):
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

    def volley(self, angle: FloatArray, speed: FloatArray, h: float) -> TrialShots:
        """Fire at angles, rad, and speeds, m/s, (K,) each."""
        velocity = speed[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        return TrialShots(self.world, self.muzzle.at(angle), velocity, self.ground, self.edges, h)

    def checked(self, aim: FiringSolution) -> FiringSolution:
        """Return a shot with the miss that it has in truth; inf where it comes down nowhere."""
        muzzle = self.muzzle.at(np.array([aim.angle]))[0]
        velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
        down = landing(self.world, muzzle, velocity, self.ground, self.edges)
        return aim._replace(miss=math.inf if down is None else down.place[0] - self.at)


class AimSolver:
    """The search for the shot that comes down next to a target. A copy goes on by itself."""

    def __init__(self, range_: TargetingProblem) -> None:
        self.found: FiringSolution | None = None
        """the shot, once the search is done"""
        self._range = range_
        self._stage: Stage = "fan"
        angle, share = (each.reshape(-1) for each in np.meshgrid(ANGLES, SHARES))
        self._angle, self._speed = angle, range_.full * share  # of the shells that fly
        self._volley = range_.volley(self._angle, self._speed, COARSE)
        self._brackets = np.empty((0, 3))  # two angles, of a shot that is short and of one that is far, and a speed
        self._closer = 0
        self._left: list[FiringSolution] = []  # to be followed
        self._best: FiringSolution | None = None  # of those that were

    def go_on(self, work: int) -> FiringSolution | None:
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

    def all(self) -> FiringSolution:
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
        self._best = FiringSolution(float(angle[k]), float(speed[k]), math.inf)
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
        shots = [
            FiringSolution(float(self._angle[k]), float(speed[k]), float(miss[k])) for k in order[:CHECKED].tolist()
        ]
        self._left, self._stage = [*shots, *self._left], "checked"

    def _check(self) -> None:
        """Follow the next shot; the first that comes down near is taken, else the nearest."""
        assert self._best is not None
        aim = self._range.checked(self._left.pop(0))
        if abs(aim.miss) < abs(self._best.miss):
            self._best = aim
        if abs(aim.miss) <= self._range.near or not self._left:
            self.found = self._best
