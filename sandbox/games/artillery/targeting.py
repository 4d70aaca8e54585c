"""Firing solution by the shooting method: angle and speed of a shot that hits a target.

1. A coarse grid of trial shots over angles and speeds.
2. Brackets: neighbouring angles at one speed, of which one shot falls short and the other goes too far. Each bracket is
   subdivided twice; a secant step then gives the angle.
3. The candidates are ordered: shots within the tolerance first, among these shots that are insensitive to a small error
   of the angle, then the slowest, then the shortest in flight.
4. The best candidates are checked on the exact trajectory of `sandbox.games.artillery.ballistics`.

All trial shots of a stage fly at once, as rows of one array, by the Runge–Kutta method of the engine `reference`. The
search is incremental, so that it can be spread over the steps of a game; the result does not depend on the increments.
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
"""s, limit of the time of flight of a trial shot"""
STEP_WORK = 300
"""Overhead of a step in units of work: it takes as long as the computation of this number of shells."""


class TrialShots:
    """Simultaneous flight of K shells.

    The paths between steps are straight: the error is at most g·h²/8, 2 mm at a step of 40 ms. Peaks of the terrain
    between steps are missed.
    """

    def __init__(
        self, world: World, position: FloatArray, velocity: FloatArray, ground: Ground, edges: Edges, h: float
    ) -> None:
        """Start the flight.

        Args:
            world: gravity, drag and wind.
            position: (K, 2) m, of the muzzles.
            velocity: (K, 2) m/s.
            ground: terrain.
            edges: behaviour at the left and right end of the terrain.
            h: step, s.
        """
        self._world, self._ground, self._edges, self._h = world, ground, edges, h
        self.landing_x = np.full(len(position), np.nan)
        """(K,) m, x of each impact; nan without one"""
        self.when = np.full(len(position), np.nan)
        """(K,) s, time of each impact; nan without one"""
        self._k, self._steps = 0, int(MAX_TRIAL_TIME / h)
        self._indices = np.arange(len(position))  # indices of the shells in flight
        self._state = np.stack((position, velocity))
        self._gap = self._state[0, :, 1] - ground.surface(self._state[0, :, 0])
        below = self._gap < 0.0
        self.landing_x[below], self.when[below] = position[below, 0], 0.0
        self._keep_flying(~below)

    @property
    def done(self) -> bool:
        """Whether no shell is in flight any more, or the limit of time has been reached."""
        return not len(self._indices) or self._k >= self._steps

    def fly(self, work: int) -> int:
        """Advance by an amount of work, in shells × steps, and at least one step; return the work done."""
        work_done = 0
        while not self.done and work_done < work:
            work_done += STEP_WORK + len(self._indices)
            self._step()
        return work_done

    def _step(self) -> None:
        step, inputs, ground = INTEGRATORS["rk4"].step, inputs_of(self._world, len(self._indices)), self._ground
        before, gap = self._state, self._gap
        self._state = state = step(transition, 0.0, before, inputs, self._h)
        x, x_before = state[0, :, 0], before[0, :, 0]
        is_open = self._edges == "open"
        self._gap = now = state[0, :, 1] - ground.surface(x if is_open else np.clip(x, 0.0, ground.width))
        landed = (now <= 0.0) & np.isfinite(now)
        fraction = gap[landed] / (gap[landed] - now[landed])
        fraction[~np.isfinite(fraction)] = 1.0  # through a side of the terrain
        self.landing_x[self._indices[landed]] = x_before[landed] + fraction * (x[landed] - x_before[landed])
        self.when[self._indices[landed]] = (self._k + fraction) * self._h
        self._k += 1
        if is_open:
            self._keep_flying(~(landed | ((state[0, :, 1] < 0.0) & ((x < 0.0) | (x > ground.width)))))
        else:
            self._keep_flying(~landed)
            self._apply_edges()

    def _keep_flying(self, flying: BoolArray) -> None:
        """Restrict the arrays to the shells in flight."""
        if not flying.all():
            self._indices, self._state, self._gap = self._indices[flying], self._state[:, flying], self._gap[flying]

    def _apply_edges(self) -> None:
        """Move shells that have passed an end of the terrain back inside."""
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


COARSE_STEP, FINE_STEP = 0.08, 0.04
"""s, steps of the coarse grid and of the subdivisions: 4.8 m and 2.4 m at 60 m/s"""
ANGLES = np.radians(np.arange(3.0, 178.0, 1.5))
"""rad, angles of the coarse grid"""
SPEED_FRACTIONS = np.linspace(0.3, 1.0, 8)
"""speeds of the coarse grid, as fractions of full speed"""
MAX_BRACKETS, BRACKET_PARTS = 16, 16
"""number of brackets that are subdivided, and of parts of each"""
SUBDIVISIONS = 2
"""number of subdivisions"""
ANGLE_PERTURBATION, INSENSITIVE_FACTOR = math.radians(0.1), 2.0
"""rad, and multiple of the tolerance: a shot is insensitive if it lands within INSENSITIVE_FACTOR × tolerance of the
target with its angle changed by ±ANGLE_PERTURBATION."""
MAX_CHECKS = 6
"""number of candidates that are checked on the exact trajectory"""
CHECK_WORK = 10_000
"""work of one check, in the unit of `TrialShots.fly`"""

Stage = Literal["coarse", "refine", "perturb", "verify"]
"""Stages of the search: coarse grid; subdivision of brackets; candidates and their perturbations; checks of the best
candidates."""


class FiringSolution(NamedTuple):
    """Angle and speed of a shot, and its miss distance."""

    angle: float
    """rad, anticlockwise from the right"""
    speed: float
    """m/s"""
    miss: float
    """m, signed, from the target to the impact along x"""


class TargetingProblem(NamedTuple):
    """Gun, target and conditions of a shot."""

    world: World
    """gravity, drag and wind"""
    muzzle: Muzzle
    ground: Ground
    """terrain"""
    edges: Edges
    """behaviour of a shell at the left and right end of the terrain"""
    full_speed: float
    """m/s, full speed"""
    target_x: float
    """m, x of the target"""
    tolerance: float
    """m, tolerance: shots that land within this distance of the target are hits"""

    def trial_shots(self, angle: FloatArray, speed: FloatArray, h: float) -> TrialShots:
        """Start trial shots at angles, rad, and speeds, m/s, (K,) each, with a step h, s."""
        velocity = speed[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        return TrialShots(self.world, self.muzzle.at(angle), velocity, self.ground, self.edges, h)

    def with_exact_miss(self, aim: FiringSolution) -> FiringSolution:
        """Return a shot with the miss distance of its exact trajectory; inf without an impact."""
        muzzle = self.muzzle.at(np.array([aim.angle]))[0]
        velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
        landed = landing(self.world, muzzle, velocity, self.ground, self.edges)
        return aim._replace(miss=math.inf if landed is None else landed.position[0] - self.target_x)


class AimSolver:
    """Incremental search for a shot that hits a target. A copy is independent of the original."""

    def __init__(self, problem: TargetingProblem) -> None:
        self.found: FiringSolution | None = None
        """the shot; None until the search is complete"""
        self._problem = problem
        self._stage: Stage = "coarse"
        angle, fraction = (each.reshape(-1) for each in np.meshgrid(ANGLES, SPEED_FRACTIONS))
        self._angle, self._speed = angle, problem.full_speed * fraction  # of the trial shots
        self._trials = problem.trial_shots(self._angle, self._speed, COARSE_STEP)
        self._brackets = np.empty((0, 3))  # two angles, between which the miss changes sign, and the speed
        self._subdivisions = 0
        self._candidates: list[FiringSolution] = []  # candidates to check
        self._best: FiringSolution | None = None  # best checked candidate

    def advance(self, work: int) -> FiringSolution | None:
        """Continue the search by an amount of work; return the shot once it is found.

        Args:
            work: in the unit of `TrialShots.fly`; exceeded to complete a step or a check.
        """
        while self.found is None and work > 0:
            if self._stage == "verify":
                work -= CHECK_WORK
                self._check_next()
            elif not self._trials.done:
                work -= self._trials.fly(work)
            elif self._stage == "coarse":
                self._choose_brackets()
            elif self._stage == "refine":
                self._refine_brackets()
            else:
                self._order_candidates()
        return self.found

    def solve(self) -> FiringSolution:
        """Complete the search, and return the shot."""
        while self.found is None:
            self.advance(CHECK_WORK)
        return self.found

    def _choose_brackets(self) -> None:
        """Choose brackets from the coarse grid: those with the closest impacts and the shortest flights first."""
        trial_shots, angle, speed = self._trials, self._angle, self._speed
        miss = trial_shots.landing_x - self._problem.target_x
        at = np.flatnonzero((miss[1:] * miss[:-1] <= 0.0) & (speed[1:] == speed[:-1]))
        jump = np.abs(miss[at + 1] - miss[at])
        at = at[np.argsort(jump + 0.5 * trial_shots.when[at], kind="stable")][:MAX_BRACKETS]
        k = int(np.argmin(np.where(np.isnan(miss), np.inf, np.abs(miss))))
        self._best = FiringSolution(float(angle[k]), float(speed[k]), math.inf)
        self._candidates = [self._best]  # fallback if no bracket leads to a hit
        self._brackets = np.column_stack((angle[at], angle[at + 1], speed[at]))
        self._subdivide()

    def _subdivide(self) -> None:
        """Subdivide each bracket by trial shots; without brackets, check the best shot of the grid."""
        if not len(self._brackets):
            self._stage = "verify"
            return
        low, high, speed = self._brackets.T
        fan = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, BRACKET_PARTS + 1)
        self._angle, self._speed, self._stage = fan.reshape(-1), np.repeat(speed, BRACKET_PARTS + 1), "refine"
        self._trials = self._problem.trial_shots(self._angle, self._speed, FINE_STEP)

    def _refine_brackets(self) -> None:
        """Replace each bracket by its part with the change of sign; after the last subdivision, do the secant step."""
        row = np.arange(len(self._brackets))
        fan = self._angle.reshape(len(row), -1)
        miss = (self._trials.landing_x - self._problem.target_x).reshape(fan.shape)
        jump = np.abs(miss[:, 1:] - miss[:, :-1])
        jump[~(miss[:, 1:] * miss[:, :-1] <= 0.0)] = np.inf
        k = np.argmin(jump, axis=1)
        self._brackets = np.column_stack((fan[row, k], fan[row, k + 1], self._brackets[:, 2]))
        self._subdivisions += 1
        if self._subdivisions < SUBDIVISIONS:
            self._subdivide()
            return
        short, long = miss[row, k], miss[row, k + 1]
        between = short - long
        fraction = np.where(
            np.isfinite(between) & (between != 0.0), short / np.where(between == 0.0, 1.0, between), 0.0
        )
        low, high, speed = self._brackets.T
        angle = low + np.clip(fraction, 0.0, 1.0) * (high - low)
        self._angle = (angle + np.array([[0.0], [-ANGLE_PERTURBATION], [ANGLE_PERTURBATION]])).reshape(-1)
        self._speed, self._stage = np.tile(speed, 3), "perturb"
        self._trials = self._problem.trial_shots(self._angle, self._speed, FINE_STEP)

    def _order_candidates(self) -> None:
        """Order the candidates for the checks."""
        trial_shots, tolerance, count = self._trials, self._problem.tolerance, len(self._brackets)
        perturbed = (trial_shots.landing_x - self._problem.target_x).reshape(3, -1)
        miss, when, speed = perturbed[0], trial_shots.when[:count], self._speed[:count]
        is_sensitive = ~(
            np.abs(perturbed).max(axis=0, initial=0.0) <= INSENSITIVE_FACTOR * tolerance
        )  # also true for nan
        order = np.lexsort((when, speed, is_sensitive, ~(np.abs(miss) <= tolerance)))
        shots = [
            FiringSolution(float(self._angle[k]), float(speed[k]), float(miss[k])) for k in order[:MAX_CHECKS].tolist()
        ]
        self._candidates, self._stage = [*shots, *self._candidates], "verify"

    def _check_next(self) -> None:
        """Check the next candidate; take the first within the tolerance, else the nearest of all."""
        assert self._best is not None
        aim = self._problem.with_exact_miss(self._candidates.pop(0))
        if abs(aim.miss) < abs(self._best.miss):
            self._best = aim
        if abs(aim.miss) <= self._problem.tolerance or not self._candidates:
            self.found = self._best
