"""Measures of the end of a run, which describe it without the position of each body.

Positions of single bodies cannot be compared after the predictability horizon, but how high a pile rests, how wide it
is and how many bodies have left can, as distributions over many starts.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import BoolArray
from sandbox.measure.compare.metrics import EvaluationContext, times_of_leaving
from sandbox.trajectory import Trajectory


@dataclass(frozen=True)
class EndMeasure:
    """Number that describes the last frame of a run."""

    name: str
    unit: str
    """unit; empty for a count"""
    about: str
    """description"""
    measure: Callable[[Trajectory, EvaluationContext], float]
    applies: Callable[[EvaluationContext], bool]
    """whether a scene has it"""


def height(run: Trajectory, context: EvaluationContext) -> float:
    """Return the mean height of the bodies that count, against gravity, m; nan without any."""
    assert context.down is not None
    staying = _staying(run, context)
    return -float((run.position[-1, staying] @ context.down).mean()) if staying.any() else math.nan


def extent(run: Trajectory, context: EvaluationContext) -> float:
    """Return the root mean square distance of the bodies that count from their mean position, m; nan without any."""
    position = run.position[-1, _staying(run, context)]
    return math.sqrt(float(position.var(axis=0).sum())) if len(position) else math.nan


def speed(run: Trajectory, context: EvaluationContext) -> float:
    """Return the root mean square speed of the bodies that count, m/s; nan without any."""
    velocity = run.velocity[-1, _staying(run, context)]
    return math.sqrt(float(np.square(velocity).sum(axis=1).mean())) if len(velocity) else math.nan


def at_rest(run: Trajectory, context: EvaluationContext) -> float:
    """Return the number of bodies that count and are slower than `EvaluationContext.rest_speed`."""
    staying = _staying(run, context)
    return float((np.hypot(*run.velocity[-1, staying].T) <= context.rest_speed[staying]).sum())


def removed(run: Trajectory, context: EvaluationContext) -> float:
    """Return the number of moving bodies that zones or their lifetime have removed, such as pocketed balls."""
    return float((context.moving & ~run.present()[-1]).sum())


def fallen(run: Trajectory, context: EvaluationContext) -> float:
    """Return the number of bodies that have fallen below everything that could stop them."""
    assert context.down is not None
    return float(np.isfinite(times_of_leaving(context.scene, run, context.down)).sum())


def broken(run: Trajectory, context: EvaluationContext) -> float:
    """Return the number of broken joints."""
    joints = context.scene.joint_arrays
    return float(joints.count_among(np.flatnonzero(np.isfinite(run.breaks(len(joints))))))


def _staying(run: Trajectory, context: EvaluationContext) -> BoolArray:
    """Return the moving bodies that are present at the end and have not fallen out of the scene, (N,)."""
    present = context.moving & run.present()[-1]
    if context.down is None:
        return np.asarray(present)
    return np.asarray(present & np.isinf(times_of_leaving(context.scene, run, context.down)))


def _has_gravity(context: EvaluationContext) -> bool:
    return context.down is not None


def _always(_: EvaluationContext) -> bool:
    return True


END_MEASURES = (
    EndMeasure("height", "m", "mean height of the bodies", height, _has_gravity),
    EndMeasure(
        "extent",
        "m",
        "root mean square distance of the bodies from their mean position",
        extent,
        lambda context: int(context.moving.sum()) > 1,
    ),
    EndMeasure("speed", "m/s", "root mean square speed of the bodies", speed, _always),
    EndMeasure("at_rest", "", "bodies at rest", at_rest, _always),
    EndMeasure("removed", "", "bodies removed by zones or at the end of their life", removed, _always),
    EndMeasure("fallen", "", "bodies below everything that could stop them", fallen, _has_gravity),
    EndMeasure(
        "broken",
        "",
        "broken joints",
        broken,
        lambda context: bool(np.isfinite(context.scene.joint_arrays.strength).any()),
    ),
)
"""Measures of every scene, in the order in which they are shown"""
