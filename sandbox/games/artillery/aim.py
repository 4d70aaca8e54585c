"""Aim: the angle and speed at which a shot hits, by shooting in thought: a fan of shells, then finer fans.

All shells of a fan fly at once, as the bodies of one state, by the engine `reference`'s Runge–Kutta method. Between two
neighbours of which one falls short and the other far, the fan is laid anew, closer; the last step is the secant's.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.motion import transition
from sandbox.games.artillery.flight import inputs_of, landing
from sandbox.games.artillery.ground import Ground
from sandbox.scene.artillery.described import Edges
from sandbox.scene.model import World
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray

COARSE, CLOSE = 0.08, 0.04
"""s, steps of the first fan and of the finer ones: 2.4 m at 60 m/s, two columns or so"""
LONGEST = 30.0
"""s, of a flight in thought"""
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

Muzzle = Callable[[FloatArray], FloatArray]
"""Where shells begin, (K, 2) m, by angles (K,), rad."""


class Aim(NamedTuple):
    """A shot in thought."""

    angle: float
    """rad, anticlockwise from the right"""
    speed: float
    """m/s"""
    miss: float
    """m along the ground, from the target to where it comes down"""


def ranges(
    world: World,
    position: FloatArray,
    velocity: FloatArray,
    ground: Ground,
    edges: Edges,
    h: float,
) -> tuple[FloatArray, FloatArray]:
    """Return where along the ground K shots come down, (K,) m, and when, (K,) s; beside it or never: nan.

    Between steps the way is straight: (g h²)/8 off at most, 2 mm at a step of 40 ms. Peaks between steps are not seen.
    """
    step, inputs = INTEGRATORS["rk4"].step, inputs_of(world, len(position))
    state = np.stack((position, velocity))
    place, when = np.full(len(position), np.nan), np.full(len(position), np.nan)
    flying = np.ones(len(position), np.bool_)
    gap = state[0, :, 1] - ground.surface(state[0, :, 0])
    place[gap < 0.0], when[gap < 0.0], flying[gap < 0.0] = state[0, gap < 0.0, 0], 0.0, False
    for k in range(int(LONGEST / h)):
        if not flying.any():
            break
        before, state = state, step(transition, 0.0, state, inputs, h)
        x, was = state[0, :, 0], before[0, :, 0]
        now = state[0, :, 1] - ground.surface(np.clip(x, 0.0, ground.width) if edges != "open" else x)
        down = flying & (now <= 0.0) & np.isfinite(now)
        share = gap[down] / (gap[down] - now[down])
        share[~np.isfinite(share)] = 1.0  # through the ground's side
        place[down], when[down] = was[down] + share * (x[down] - was[down]), (k + share) * h
        flying &= ~down
        flying &= ~((state[0, :, 1] < 0.0) & ((x < 0.0) | (x > ground.width)) & (edges == "open"))
        gap = now
        if edges != "open":
            for side, wall in ((-1.0, 0.0), (1.0, ground.width)):
                out = side * (x - wall) > 0.0
                if edges == "wrap":
                    state[0, out, 0] -= side * ground.width
                else:
                    state[0, out, 0] = 2.0 * wall - state[0, out, 0]
                    state[1, out, 0] *= -1.0
                gap[out] = state[0, out, 1] - ground.surface(state[0, out, 0])
    return place, when


def best_aim(
    world: World, muzzle: Muzzle, ground: Ground, edges: Edges, full: float, target: Point, near: float
) -> Aim:
    """Return the shot that comes down next to a target.

    Args:
        world: gives gravity, drag and wind.
        muzzle: where shells begin.
        ground: as it lies.
        edges: what becomes of a shell at the ground's sides.
        full: the greatest speed, m/s.
        target: m.
        near: m; among shots that come down as near as this, those that hardly miss when aimed a little otherwise come
            first, of these the slowest, and then those that are in the air for the shortest time.
    """
    range_ = _Range(world, muzzle, ground, edges, target[0])
    angle, share = (each.reshape(-1) for each in np.meshgrid(ANGLES, SHARES))
    brackets, nearest = range_.bracketed(angle, full * share)
    shots = range_.closed_in(brackets)
    turned = (shots[:, 0] + np.array([[0.0], [-SHAKE], [SHAKE]])).reshape(-1)
    missed, flown = range_.misses(turned, np.tile(shots[:, 1], 3), CLOSE)
    shaken = missed.reshape(3, -1)
    miss, when = shaken[0], flown[: len(shots)]
    unsure = ~(np.abs(shaken).max(axis=0, initial=0.0) <= STEADY * near)  # where nan, too
    order = np.lexsort((when, shots[:, 1], unsure, ~(np.abs(miss) <= near)))
    best = nearest
    for k in order[:CHECKED].tolist():
        aim = range_.checked(Aim(float(shots[k, 0]), float(shots[k, 1]), float(miss[k])))
        if abs(aim.miss) <= near:
            return aim
        if abs(aim.miss) < abs(best.miss):
            best = aim
    return best


class _Range(NamedTuple):
    """What a target is shot at on."""

    world: World
    muzzle: Muzzle
    ground: Ground
    edges: Edges
    at: float
    """m, where along the ground the target stands"""

    def misses(self, angle: FloatArray, speed: FloatArray, h: float) -> tuple[FloatArray, FloatArray]:
        """Return by how much K shots miss along the ground, (K,) m, and when they come down, (K,) s."""
        velocity = speed[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
        place, when = ranges(self.world, self.muzzle(angle), velocity, self.ground, self.edges, h)
        return place - self.at, when

    def bracketed(self, angle: FloatArray, speed: FloatArray) -> tuple[FloatArray, Aim]:
        """Return pairs of neighbours in a fan, one short and one far, as (B, 3) two angles and a speed; and the best.

        Those come first that are close to each other, or soon there.
        """
        miss, when = self.misses(angle, speed, COARSE)
        at = np.flatnonzero((miss[1:] * miss[:-1] <= 0.0) & (speed[1:] == speed[:-1]))
        jump = np.abs(miss[at + 1] - miss[at])
        at = at[np.argsort(jump + 0.5 * when[at], kind="stable")][:TRIED]
        k = int(np.argmin(np.where(np.isnan(miss), np.inf, np.abs(miss))))
        best = self.checked(Aim(float(angle[k]), float(speed[k]), float(miss[k])))
        return np.column_stack((angle[at], angle[at + 1], speed[at])), best

    def closed_in(self, brackets: FloatArray) -> FloatArray:
        """Return a shot of each bracket, (B, 2) angle and speed, at which the change of sign is."""
        ends = np.zeros((2, len(brackets)))
        row = np.arange(len(brackets))
        for _ in range(FINER if len(brackets) else 0):
            low, high, speed = brackets.T
            fan = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, PARTS + 1)
            miss = self.misses(fan.reshape(-1), np.repeat(speed, PARTS + 1), CLOSE)[0].reshape(fan.shape)
            jump = np.abs(miss[:, 1:] - miss[:, :-1])
            jump[~(miss[:, 1:] * miss[:, :-1] <= 0.0)] = np.inf
            k = np.argmin(jump, axis=1)
            brackets = np.column_stack((fan[row, k], fan[row, k + 1], speed))
            ends = np.stack((miss[row, k], miss[row, k + 1]))
        between = ends[0] - ends[1]
        share = np.where(np.isfinite(between) & (between != 0.0), ends[0] / np.where(between == 0.0, 1.0, between), 0.0)
        low, high, speed = brackets.T
        return np.column_stack((low + np.clip(share, 0.0, 1.0) * (high - low), speed))

    def checked(self, aim: Aim) -> Aim:
        """Return a shot with the miss that it has in truth; inf where it comes down nowhere."""
        muzzle = self.muzzle(np.array([aim.angle]))[0]
        velocity = aim.speed * np.array([math.cos(aim.angle), math.sin(aim.angle)])
        down = landing(self.world, muzzle, velocity, self.ground, self.edges)
        return aim._replace(miss=math.inf if down is None else down.place[0] - self.at)
