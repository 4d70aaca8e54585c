"""Pace: how many steps of fixed length each picture needs, and how fast the scene really goes.

The accumulator of G. Fiedler, "Fix Your Timestep!" (2004): real time is saved up and spent in whole steps; what is
left over says how far between two states the picture lies.

Between: the picture that lies between two states.
"""

from collections import deque
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.trajectory import Frame

TELEPORT_FACTOR = 4.0
"""Who is farther on than so many times what its speed explains was put there."""
TELEPORT_MIN_SQUARED = 1e-18
"""m²: who hardly moves is no leaper"""


def interpolate(before: Frame, after: Frame, share: float) -> Frame:
    """Return the state that lies a share (0 to 1) of the way from one to the next, on straight lines.

    A body that is not in both is as in the later one; so is one that was put elsewhere, farther than it flies.
    """
    if share >= 1.0 or before is after:
        return after
    known = min(len(before.position), len(after.position))
    time = before.time + (after.time - before.time) * share
    dt = abs(after.time - before.time)
    with np.errstate(all="ignore"):
        moved = after.position[:known] - before.position[:known]
        fastest = np.maximum(_squared(before.velocity[:known]), _squared(after.velocity[:known]))
        flew = _squared(moved) <= (TELEPORT_FACTOR * dt) ** 2 * fastest + TELEPORT_MIN_SQUARED
        flew &= before.present[:known] & after.present[:known]
        position = after.position.copy()
        position[:known] -= moved * (flew * (1.0 - share))[:, None]
        angle = after.angle
        if before.angle is not after.angle:  # which those share who cannot turn
            angle = after.angle.copy()
            angle[:known] -= (after.angle[:known] - before.angle[:known]) * (flew * (1.0 - share))
    return replace(after, time=time, position=position, angle=angle)


def _squared(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nk,nk->n", vectors, vectors))


STEPS_TO_TENTH = 10
"""Speeds from one decade to the next: 100, 79, 63, 50, 40, 32, 25, 20, 16, 13, 10 %."""
SLOWEST, FASTEST = -30, 10
"""0.1 % to 1000 %"""
MAX_FRAME_TIME = 0.1
"""s of real time that one picture may ask for: after a pause of the machine the scene does not jump"""
WINDOW = 0.5
"""s over which the real speed is measured"""


class FixedStepClock:
    """Turns real time into steps."""

    def __init__(self) -> None:
        self._rung = 0
        self._saved = 0.0
        self._seen: deque[tuple[float, float]] = deque()  # real and simulated time of each picture, s

    @property
    def speed(self) -> float:
        """Asked, as a share of real time."""
        return float(10.0 ** (self._rung / STEPS_TO_TENTH))

    @property
    def real_speed(self) -> float:
        """Reached lately, as a share of real time; as asked, before anything is known."""
        real = sum(each for each, _ in self._seen)
        return sum(each for _, each in self._seen) / real if real > WINDOW / 2.0 else self.speed

    def slower(self) -> None:
        """Go one rung down."""
        self._rung = max(self._rung - 1, SLOWEST)
        self._seen.clear()

    def faster(self) -> None:
        """Go one rung up."""
        self._rung = min(self._rung + 1, FASTEST)
        self._seen.clear()

    def due(self, elapsed: float, dt: float) -> int:
        """Save up real time, s, and return the whole steps of dt, s, that it is enough for."""
        self._saved += min(elapsed, MAX_FRAME_TIME) * self.speed
        return int(self._saved / dt * (1.0 + 1e-12))

    def spent(self, elapsed: float, steps: int, asked: int, dt: float) -> None:
        """Take note of the steps that were made; those that could not be are dropped, and the scene is slower."""
        self._saved = max(self._saved - max(steps, asked) * dt, 0.0)
        self._seen.append((elapsed, steps * dt))
        while len(self._seen) > 1 and sum(each for each, _ in self._seen) > WINDOW:
            self._seen.popleft()

    def flow(self, elapsed: float) -> float:
        """Return how much simulated time, s, real time is, where there are no steps to be made of it."""
        time = min(elapsed, MAX_FRAME_TIME) * self.speed
        self._seen.append((elapsed, time))
        while len(self._seen) > 1 and sum(each for each, _ in self._seen) > WINDOW:
            self._seen.popleft()
        return time

    def between(self, dt: float) -> float:
        """Return how far the picture lies from the last state but one to the last, 0 to 1."""
        return min(max(self._saved / dt, 0.0), 1.0)

    def rest(self) -> None:
        """Forget what was saved up, as in a pause: the picture shows the last state."""
        self._saved = 0.0
        self._seen.clear()
