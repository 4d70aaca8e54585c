"""Aim: what is asked of a trade-off: in which metric, how right, how cheap."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.echo import short_repr
from sandbox.measure.compare.errors import usual_tolerance
from sandbox.measure.joint_error import HOLDING
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS, Metric
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.scene import Scene

USUAL = {"px": 1.0, "s": 0.05, "": 0.01}
"""Tolerances by unit where none is given; of lengths it is `compare`'s: 1 % of the smallest radius."""
COUNTED = frozenset({"missed_contacts"})
"""Metrics that count: none is tolerated."""
AUDITED = frozenset({"missed_contacts", "passes"})
"""Metrics of which only an audited run has a value."""


class UnknownMetricError(ValueError):
    """No metric has that name."""


class Aim(NamedTuple):
    """What is asked."""

    metric: Metric
    tolerance: float
    """in its unit"""
    budget: float | None
    """ms a frame"""
    fps: float
    """frames a second"""
    step: float = math.inf
    """s that a step of what is recommended may last: in between its error is not known"""
    reason: str = "it was requested"
    """why this metric"""

    @property
    def hurry(self) -> float | None:
        """The budget in s per simulated second."""
        return None if self.budget is None else 1e-3 * self.budget * self.fps


def metric_named(name: str) -> Metric:
    """Return a metric.

    Raises:
        UnknownMetricError: with the names there are.
    """
    try:
        return METRICS[name]
    except KeyError:
        raise UnknownMetricError(f"unknown metric {short_repr(name)}; metrics: {', '.join(METRICS)}") from None


def choose_metric(judge: Judge) -> tuple[Metric, str]:
    """Return the metric that a scene is scored by where none is asked for, and why, as a clause.

    The distance from the truth, if it is trusted to the end. Else an invariant: how well joints hold, where there are
    some; energy, where nothing takes any; how far bodies move that lie still in the truth, as in a stack; the depth of
    overlaps, where bodies can meet. Where there is none of these, the distance from the truth as far as it is
    trusted, or at last energy; that too where nothing moves.
    """
    scene, duration = judge.scene, judge.scene.world.duration
    if not judge.moving.any():
        return METRICS["energy"], "no body in the scene can move"
    if judge.truth is not None and judge.until >= duration:
        kind = judge.truth.kind.replace("_", " ")
        return METRICS["max_position"], f"the truth ({kind}) is trusted to the end, {duration:.4g} s"
    if judge.truth is None:
        doubt = f"no truth is known{f' ({judge.doubt})' if judge.doubt else ''}"
    else:
        doubt = f"positions are predictable for {judge.until:.3g} s of {duration:.4g} s only"
    if np.isin(scene.links.kind, HOLDING).any():
        return METRICS["joint_error"], f"{doubt}, and the scene has joints"
    if keeps_energy(scene):
        return METRICS["energy"], f"{doubt}, and energy is conserved"
    if judge.still.any():
        return METRICS["drift"], f"{doubt}, and {int(judge.still.sum())} bodies should stay at rest"
    if contact_matrix(scene).touches.any():
        return METRICS["penetration"], f"{doubt}, and bodies can collide"
    if judge.truth is None:
        return METRICS["energy"], doubt
    return METRICS["max_position"], f"{doubt}; errors count up to that time"


def keeps_energy(scene: Scene) -> bool:
    """Tell whether nothing in a scene takes energy: no drag, friction, damper, thrust or drive, elastic contacts."""
    if scene.world.linear_drag or scene.world.quadratic_drag or scene.thrusts or scene.drives:
        return False
    if scene.links.figures[:, 2].any():
        return False
    meet = contact_matrix(scene)
    elastic = (meet.surfaces.restitution == 1.0) & meet.surfaces.fixed_coefficients
    return bool(elastic[meet.touching].all() and meet.friction == 0.0)


def require_aim(metric: str | None, tolerance: float | None, budget: float | None, fps: float) -> None:
    """Make sure that what is asked makes sense, before anything is run.

    Raises:
        UnknownMetricError: no metric has that name.
        ValueError: a figure is not positive and finite; of what is counted, none may be tolerated.
    """
    counted = metric is not None and metric_named(metric).name in COUNTED
    if tolerance is not None and not (0.0 < tolerance < math.inf or (tolerance == 0.0 and counted)):
        raise ValueError(f"the tolerance is {tolerance:g}; it must be positive and finite")
    for what, value in (("budget", budget), ("fps", fps)):
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"the {what} is {value:g}; it must be positive and finite")


def aim_at(judge: Judge, metric: str | None, tolerance: float | None, budget: float | None, fps: float) -> Aim:
    """Return what is asked, which makes sense (`require_aim`), with what was left open filled in."""
    chosen, reason = choose_metric(judge) if metric is None else (metric_named(metric), "it was requested")
    if tolerance is None:
        tolerance = 0.0 if chosen.name in COUNTED else USUAL.get(chosen.unit, usual_tolerance(judge.scene))
    return Aim(chosen, tolerance, budget, fps, reason=reason)
