"""Stroke: how a body turns about a hinge at a rate, and stops on its stops."""

import math
from typing import NamedTuple

from sandbox.scene.drives import StrokeDrive


class Struck(NamedTuple):
    """Where a substep brings a body."""

    angle: float
    """rad"""
    spin: float
    """rad/s, for as long as it goes"""
    arrives: bool
    """It stands still from the end of the substep on."""


def struck(drive: StrokeDrive, level: float, angle: float, h: float) -> Struck:
    """Turn a body from an angle, rad, for h, s."""
    pressed = level > 0.0
    stop = drive.stops[pressed]
    left = stop - angle
    rate = drive.rate if pressed or drive.return_rate is None else drive.return_rate
    arrives = abs(left) <= rate * h
    if not left or not rate:
        return Struck(angle, 0.0, arrives)
    spin = math.copysign(rate, left)
    return Struck(stop if arrives else angle + spin * h, spin, arrives)
