"""Limits of speeds: at the end of a substep a velocity above that of its body is reduced to it, in its direction."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies


class SpeedLimits(NamedTuple):
    """Limits of L bodies."""

    body: IntArray
    """(L,) index of each"""
    speed: FloatArray
    """(L,) m/s; inf if unlimited"""
    spin: FloatArray
    """(L,) rad/s; inf if unlimited"""

    @classmethod
    def of(cls, bodies: Bodies, present: BoolArray) -> "SpeedLimits | None":
        """Return the limits of the bodies that are present; None if there are none."""
        body = np.flatnonzero(bodies.limited & present)
        return cls(body, bodies.max_speed[body], bodies.max_angular_velocity[body]) if len(body) else None

    def reduced(self, rate: FloatArray) -> FloatArray:
        """Return rates (N, D), m/s and rad/s, within the limits; the same array if all are."""
        own = rate[self.body]
        speed = np.hypot(own[:, 0], own[:, 1])
        spin = np.abs(own[:, 2]) if rate.shape[1] == 3 else np.zeros(len(own))
        is_fast, is_spinning = speed > self.speed, spin > self.spin
        if not (is_fast.any() or is_spinning.any()):
            return rate
        own[is_fast, :2] *= (self.speed[is_fast] / speed[is_fast])[:, None]
        if rate.shape[1] == 3:
            own[is_spinning, 2] = np.copysign(self.spin[is_spinning], own[is_spinning, 2])
        out = rate.copy()
        out[self.body] = own
        return out
