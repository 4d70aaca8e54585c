"""Rolling: how balls on a floor lie, worked out from their spins; for their drawing alone."""

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.trajectory import Frame

LONGEST = 0.5
"""s between two pictures over which balls are seen to roll; over more they were put where they are"""


class Rolling:
    """The orientations of balls, from picture to picture. Balls lie at random at first, their faces upwards."""

    def __init__(self) -> None:
        self.turned: FloatArray = np.empty((0, 3, 3))
        """(N, 3, 3) from a ball's own frame to the world's"""
        self.version: IntArray = np.empty(0, np.int64)
        """(N,) which grows when a ball turns"""
        self._time: float | None = None
        self.goes_on = False
        """whether the last picture was of a moment before"""

    def go_on(self, frame: Frame) -> None:
        """Let the balls roll on to a frame. Time that runs backwards rolls nothing back."""
        count, known = len(frame.position), len(self.turned)
        if count > known:
            self.turned = np.concatenate((self.turned, [_thrown(k) for k in range(known, count)]))
            self.version = np.append(self.version, np.zeros(count - known, np.int64))
        dt = 0.0 if self._time is None else frame.time - self._time
        self._time, self.goes_on = frame.time, 0.0 < dt < LONGEST
        if not self.goes_on:
            return
        spin = np.zeros((count, 3))
        spin[:, 2] = frame.angular_velocity
        if frame.roll is not None:
            spin[:, :2] = frame.roll
        who = np.flatnonzero(np.isfinite(spin).all(axis=1) & (spin != 0.0).any(axis=1))
        if len(who):
            self.turned[who] = _squared_up(_rotations(spin[who] * dt) @ self.turned[who])
            self.version[who] += 1


def _thrown(number: int) -> FloatArray:
    """Return how a ball lies at first: about its own number, and always the same."""
    random = np.random.default_rng(number)
    tilt = random.uniform(-0.45, 0.45, 3)
    tilt[2] = random.uniform(-0.9, 0.9)
    return np.asarray(_rotations(tilt[None])[0])


def _rotations(vectors: FloatArray) -> FloatArray:
    """Return the rotations (K, 3, 3) about vectors (K, 3) by their lengths, rad (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=1)
    axis = vectors / np.maximum(angle, 1e-300)[:, None]
    x, y, z = axis.T
    zero = np.zeros_like(x)
    cross = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), 1).reshape(-1, 3, 3)
    sin, cos = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + sin * cross + (1.0 - cos) * (cross @ cross))


def _squared_up(matrices: FloatArray) -> FloatArray:
    """Return rotations without what rounding has added to them."""
    x = matrices[:, :, 0] / np.linalg.norm(matrices[:, :, 0], axis=1)[:, None]
    z = np.cross(x, matrices[:, :, 1])
    z /= np.linalg.norm(z, axis=1)[:, None]
    return np.stack((x, np.cross(z, x), z), 2)
