"""Fixed-step clock: number of due steps per frame, playback speed, and interpolation between two states.

Accumulator of G. Fiedler, "Fix Your Timestep!" (2004): real time is accumulated and spent in whole steps; the remainder
is the interpolation parameter between two states.
"""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.description.play import MIN_PLAYBACK_SPEED
from sandbox.trajectory import Frame

TELEPORT_FACTOR = 4.0
"""Teleport threshold: a body that moved more than this times speed × dt was placed, not simulated; not interpolated."""
TELEPORT_MIN_SQUARED = 1e-18
"""m², squared displacement below which a body never counts as teleported"""


def interpolate(before: Frame, after: Frame, alpha: float) -> Frame:
    """Return the state at a fraction `alpha` (0 to 1) between two states, by linear interpolation.

    A body that is not present in both states, or was teleported between them, keeps its later state.
    """
    if alpha >= 1.0 or before is after:
        return after
    known = min(len(before.position), len(after.position))
    time = before.time + (after.time - before.time) * alpha
    dt = abs(after.time - before.time)
    with np.errstate(all="ignore"):
        moved = after.position[:known] - before.position[:known]
        fastest = np.maximum(_squared(before.velocity[:known]), _squared(after.velocity[:known]))
        continuous = _squared(moved) <= (TELEPORT_FACTOR * dt) ** 2 * fastest + TELEPORT_MIN_SQUARED
        continuous &= before.present[:known] & after.present[:known]
        position = after.position.copy()
        position[:known] -= moved * (continuous * (1.0 - alpha))[:, None]
        angle = after.angle
        if before.angle is not after.angle:  # states of non-rotating bodies share one array
            angle = after.angle.copy()
            angle[:known] -= (after.angle[:known] - before.angle[:known]) * (continuous * (1.0 - alpha))
    return replace(after, time=time, position=position, angle=angle)


def _squared(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nk,nk->n", vectors, vectors))


SPEEDS_PER_DECADE = 10
"""100, 79, 63, 50, 40, 32, 25, 20, 16, 13, 10 %"""
MIN_SPEED_LEVEL, MAX_SPEED_LEVEL = -30, 10
"""0.1 % to 1000 %; a scene may start slower"""
SHORTEST_PLAY = 3.0
"""s of real time that a scene lasts at least at the speed that is chosen for it"""
LEVEL_ROUNDING = 0.02
"""Fraction of a level: 5e-1 and 2e-1 are 0.01 levels from those of 50 and 20 %"""
MAX_FRAME_TIME = 0.1
"""s, largest real time credited per frame, so that the scene does not jump after the computer was suspended"""
SPEED_WINDOW = 0.5
"""s over which the real speed is measured"""


def speed_for(duration: float) -> float:
    """Return the largest speed of 1, 0.5, 0.2, 0.1, … at which a duration, s, takes `SHORTEST_PLAY` or more."""
    largest = min(max(duration / SHORTEST_PLAY * (1.0 + 1e-9), MIN_PLAYBACK_SPEED), 1.0)  # tolerance for rounding
    power = math.floor(math.log10(largest))
    return next(speed for digit in (5, 2, 1) if (speed := float(f"{digit}e{power}")) <= largest or digit == 1)


def _speed_of_level(level: int) -> float:
    return float(10.0 ** (level / SPEEDS_PER_DECADE))


class FixedStepClock:
    """Converts real time to a number of steps."""

    def __init__(self) -> None:
        self._speed = 1.0
        self._accumulated = 0.0  # s
        self._samples: deque[tuple[float, float]] = deque()  # real and simulated time of each frame, s

    @property
    def speed(self) -> float:
        """Requested speed, as a multiple of real time."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._speed = speed
        self._samples.clear()

    @property
    def real_speed(self) -> float:
        """Recently measured speed, as a multiple of real time; the requested speed until enough samples exist."""
        real = sum(each for each, _ in self._samples)
        return sum(each for _, each in self._samples) / real if real > SPEED_WINDOW / 2.0 else self.speed

    def slower(self) -> None:
        """Decrease the speed to the next level, if there is one below it."""
        level = math.ceil(self._level - LEVEL_ROUNDING) - 1
        self.speed = min(self.speed, _speed_of_level(max(level, MIN_SPEED_LEVEL)))

    def faster(self) -> None:
        """Increase the speed to the next level, if there is one above it."""
        level = math.floor(self._level + LEVEL_ROUNDING) + 1
        self.speed = _speed_of_level(min(level, MAX_SPEED_LEVEL))

    @property
    def _level(self) -> float:
        """Speed in levels; between two of them for a speed that a scene or the user has stated."""
        return SPEEDS_PER_DECADE * math.log10(self.speed)

    def steps_due(self, elapsed: float, dt: float) -> int:
        """Accumulate real time, s, and return how many whole steps of dt, s, are due."""
        self._accumulated += min(elapsed, MAX_FRAME_TIME) * self.speed
        return int(self._accumulated / dt * (1.0 + 1e-12))  # tolerance for rounding errors of summed dt

    def record_steps(self, elapsed: float, steps: int, asked: int, dt: float) -> None:
        """Subtract the executed steps. Due steps beyond them are dropped, so the scene runs slower than requested."""
        self._accumulated = max(self._accumulated - max(steps, asked) * dt, 0.0)
        # Time that waits for the next step counts, or the speed of few steps a second would seem to change.
        self._add_sample(elapsed, min(elapsed, MAX_FRAME_TIME) * self.speed + (steps - asked) * dt)

    def scale_time(self, elapsed: float) -> float:
        """Return the simulated time, s, for a real time, s, for playback without steps."""
        time = min(elapsed, MAX_FRAME_TIME) * self.speed
        self._add_sample(elapsed, time)
        return time

    def _add_sample(self, real: float, simulated: float) -> None:
        self._samples.append((real, simulated))
        while len(self._samples) > 1 and sum(each for each, _ in self._samples) > SPEED_WINDOW:
            self._samples.popleft()

    def alpha(self, dt: float) -> float:
        """Return the interpolation parameter between the last two states, 0 to 1."""
        return min(max(self._accumulated / dt, 0.0), 1.0)

    def reset(self) -> None:
        """Discard the accumulated time, as on pause: the last state is shown."""
        self._accumulated = 0.0
        self._samples.clear()
