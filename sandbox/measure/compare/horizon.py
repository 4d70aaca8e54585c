"""Horizon: until when a truth is one, told by moving a single body by 1e-12 m."""

import math
from dataclasses import replace

import numpy as np

from sandbox.measure.compare.errors import errors
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.trajectory import Trajectory

NUDGE = 1e-12
"""m"""
ULPS = 4.0
"""Where a coordinate is so large that 1e-12 m vanishes beside it, it is moved by so many of its last digits."""


def nudged(scene: Scene) -> Scene | None:
    """Return the scene with its first body that can meet, or is drawn by, something moved by `NUDGE`, along x and y.

    None where there is no such body: nothing can grow then. Joints stay as they were.
    """
    bodies = scene.bodies
    able = np.flatnonzero(~bodies.fixed & (~meetings(scene).free | bool(scene.attractions)))
    if not len(able):
        return None
    position = bodies.position.copy()
    position[able[0]] = [_nudge(x) for x in position[able[0]].tolist()]
    return scene.placed(replace(bodies, position=position), scene.began)


def _nudge(x: float) -> float:
    return x + max(NUDGE * math.sqrt(0.5), ULPS * math.ulp(x))


def agree_until(a: Trajectory, b: Trajectory, scene: Scene, tolerance: float) -> float:
    """Return the last time up to which two runs of a scene agree in every position; its duration, if throughout.

    Where a run ended early, they agree no longer than to its last frame.
    """
    found = errors(a, b, ~scene.bodies.fixed)
    apart = np.flatnonzero(found.position > tolerance)
    if len(apart):
        return float(found.time[apart[0] - 1]) if apart[0] else 0.0
    if a.status == b.status == "ok":
        return scene.world.duration
    return float(found.time[-1]) if len(found.time) else 0.0
