"""Thrusts: forces that turn with their body, at a level and within a span of time."""

from typing import NamedTuple

from sandbox.arrays import FloatArray, IntArray


class ThrustColumns(NamedTuple):
    """T thrusts."""

    body: IntArray
    """(T,) index of the body that each acts on"""
    point: FloatArray
    """(T, 2) m, point of application, in the body's frame about its centre of mass"""
    force: FloatArray
    """(T, 2) N, in that frame, at full level"""
    begin: FloatArray
    """(T,) s, time of the scene from which on it acts"""
    end: FloatArray
    """(T,) s, time until which it acts"""


def load(level: float, fx: float, fy: float, px: float, py: float) -> tuple[float, float, float]:
    """Return the force (x, y), N, in the frame of the body, and the torque about its centre of mass, N·m.

    Args:
        level: fraction of the force that acts.
        fx: force in the frame of the body at full level, N.
        fy: likewise.
        px: point of application in that frame, m.
        py: likewise.
    """
    x, y = level * fx, level * fy
    return x, y, px * y - py * x
