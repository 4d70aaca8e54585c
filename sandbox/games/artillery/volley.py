"""Volley: shells in thought, all flying at once as the bodies of one state, by the engine `reference`'s Runge–Kutta.

It flies by and by: whoever asks for a part of the way, and then for the next, gets the same as who asks for all of it.
"""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.reference.integrators import INTEGRATORS, transition
from sandbox.games.artillery.flight import inputs_of
from sandbox.games.artillery.ground import Ground
from sandbox.games.artillery.terrain import Edges
from sandbox.scene.description.world import World

LONGEST = 30.0
"""s, of a flight in thought"""
STEP_WORK = 300
"""A step takes about as long as numpy takes for so many shells, and besides that some time for each shell."""


class Volley:
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
        self._k, self._steps = 0, int(LONGEST / h)
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
