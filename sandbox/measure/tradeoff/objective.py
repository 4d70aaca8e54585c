"""Objective of a trade-off: metric, tolerance and budget, and the Pareto front of error and cost."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, TypeVar

from sandbox.echo import short_repr
from sandbox.measure.compare.metrics import METRICS, EvaluationContext, Metric
from sandbox.measure.metrics.invariants import conserves_energy, has_constraints
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.scene.compile.contacts import contact_matrix

T = TypeVar("T")

DEFAULT_TOLERANCES = {"px": 1.0, "s": 0.05, "rad": 0.01, "": 0.01}
"""Default tolerances by unit; those of lengths and speeds depend on the scene."""
FRAMES_PER_SECOND = 60.0
"""1/s; the default tolerance of a speed is that of a length in such a frame."""
COUNT_METRICS = frozenset({"missed_contacts"})
"""Metrics that are counts: their default tolerance is 0."""
AUDIT_METRICS = frozenset({"missed_contacts", "passes"})
"""Metrics that only an audited run has."""


REQUESTED = "it was requested"
"""Reason for a metric that the caller chose"""


def less_margin(tolerance: float, margin: float) -> float:
    """Return a tolerance without the fraction of it that is left as a margin."""
    return (1.0 - margin) * tolerance


class UnknownMetricError(ValueError):
    """No metric has that name."""


class Objective(NamedTuple):
    """Metric of the error, largest accepted error, and computing time available."""

    metric: Metric
    """metric of the error"""
    tolerance: float
    """largest accepted error, in the unit of the metric"""
    budget: float | None
    """ms, computing time per frame; None if not given"""
    fps: float
    """frames per second of the budget"""
    max_dt: float = math.inf
    """s, longest dt of a recommended configuration: between its steps the error is unknown"""
    reason: str = REQUESTED
    """reason for the choice of the metric, as a clause"""
    margin: float = 0.0
    """fraction of the tolerance that a recommended setting leaves unused"""

    @property
    def max_error(self) -> float:
        """Largest error of a recommended setting: the tolerance less the margin."""
        return less_margin(self.tolerance, self.margin)

    @property
    def seconds_budget(self) -> float | None:
        """The budget in s per simulated second."""
        return None if self.budget is None else 1e-3 * self.budget * self.fps


def check_objective(
    metric: str | None, tolerance: float | None, budget: float | None, fps: float, margin: float = 0.0
) -> None:
    """Check an objective before anything is run.

    Raises:
        UnknownMetricError: no metric has that name.
        ValueError: a number is not positive and finite; only the tolerance of a count may be 0. The margin is not from
            0 to less than 1.
    """
    if not 0.0 <= margin < 1.0:
        raise ValueError(f"the margin is {margin:g}; it must be at least 0 and less than 1, such as 0.2 for 20 %")
    counted = metric is not None and metric_named(metric).name in COUNT_METRICS
    if tolerance is not None and not (0.0 < tolerance < math.inf or (tolerance == 0.0 and counted)):
        raise ValueError(f"the tolerance is {tolerance:g}; it must be positive and finite")
    for what, value in (("budget", budget), ("fps", fps)):
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"the {what} is {value:g}; it must be positive and finite")


def complete_objective(
    context: EvaluationContext,
    metric: str | None,
    tolerance: float | None,
    budget: float | None,
    fps: float,
    margin: float = 0.0,
) -> Objective:
    """Return an objective that passed `check_objective`, with defaults for the values not given."""
    chosen, reason = choose_metric(context) if metric is None else (metric_named(metric), REQUESTED)
    if tolerance is None:
        tolerance = default_metric_tolerance(chosen, default_tolerance(context.scene))
    return Objective(chosen, tolerance, budget, fps, reason=reason, margin=margin)


def default_metric_tolerance(metric: Metric, length: float) -> float:
    """Return the default tolerance of a metric, in its unit; 0 for a count.

    Args:
        metric: the metric.
        length: tolerance of a position, m.

    Raises:
        ValueError: no tolerance is known for the unit of the metric.
    """
    if metric.name in COUNT_METRICS:
        return 0.0
    known = DEFAULT_TOLERANCES | {"m": length, "m/s": length * FRAMES_PER_SECOND}
    if metric.unit not in known:
        raise ValueError(f"{metric.name}: no default tolerance is known in {metric.unit}; units: {', '.join(known)}")
    return known[metric.unit]


def metric_named(name: str) -> Metric:
    """Return the metric with a name.

    Raises:
        UnknownMetricError: no metric has that name; the message lists the names.
    """
    try:
        return METRICS[name]
    except KeyError:
        raise UnknownMetricError(f"unknown metric {short_repr(name)}; metrics: {', '.join(METRICS)}") from None


def choose_metric(context: EvaluationContext) -> tuple[Metric, str]:
    """Return the default metric of a scene, and the reason for it as a clause.

    It is the distance from the truth if that is trusted to the end. Otherwise it is the first invariant that applies:
    the joint error if there are joints; energy if it is conserved; the displacement of bodies that the truth has at
    rest, as in a stack; the penetration if bodies can collide. If none applies, it is the distance from the truth up to
    the trusted time, or energy if there is no truth or nothing moves.
    """
    scene, duration = context.scene, context.scene.world.duration
    if not context.moving.any():
        return METRICS["energy"], "no body in the scene can move"
    if context.truth is not None and context.until >= duration:
        kind = context.truth.kind.replace("_", " ")
        return METRICS["max_position"], f"the truth ({kind}) is trusted to the end, {duration:.4g} s"
    if context.truth is None:
        doubt = f"no truth is known{f' ({context.doubt})' if context.doubt else ''}"
    else:
        doubt = f"the truth of positions is trusted for {context.until:.3g} s of {duration:.4g} s only"
    if has_constraints(scene.joint_arrays):
        return METRICS["joint_error"], f"{doubt}, and the scene has joints"
    if conserves_energy(scene):
        return METRICS["energy"], f"{doubt}, and energy is conserved"
    if context.at_rest.any():
        return METRICS["drift"], f"{doubt}, and {int(context.at_rest.sum())} bodies should stay at rest"
    if contact_matrix(scene).touches.any():
        return METRICS["penetration"], f"{doubt}, and bodies can collide"
    if context.truth is None:
        return METRICS["energy"], doubt
    return METRICS["max_position"], f"{doubt}; errors count up to that time"


def pareto(items: Iterable[T], cost: Callable[[T], float], error: Callable[[T], float]) -> list[T]:
    """Return the items that no other item beats in both cost and error, cheapest first; of equal items the first.

    Args:
        items: the items.
        cost: cost of an item.
        error: error of an item.
    """
    found: list[T] = []
    for item in sorted(items, key=lambda each: (cost(each), error(each))):
        if not found or error(item) < error(found[-1]):
            found.append(item)
    return found


def is_dominated(cost: float, error: float, others: Sequence[tuple[float, float]], margin: float) -> bool:
    """Return whether another (cost, error) is at least as accurate and costs less than `margin` times as much.

    Args:
        cost: cost of the item.
        error: error of the item.
        others: (cost, error) of the other items.
        margin: factor of the cost, such as 0.8.
    """
    return any(its_cost < margin * cost and its_error <= error for its_cost, its_error in others)
