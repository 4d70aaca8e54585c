"""Columns of a comparison."""

from collections.abc import Callable
from dataclasses import fields

from sandbox.columns import TRUTH, Column
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.compare.result import Row, Score


def _error(name: str) -> Column[Row]:
    """Return the column of a metric."""
    metric = METRICS[name]
    about = f"{metric.about}, while that is trusted; {TRUTH}: the run is the truth itself"
    return Column(
        f"{metric.head}, {metric.unit}",
        about,
        lambda row: TRUTH if row.is_truth else getattr(row.score, name),
        is_optional=metric.unit == "rad",  # nothing turns in many scenes
        is_detail=name not in ("max_position", "max_angle"),
    )


def _count(kind: str) -> Callable[[Row], int | None]:
    return lambda row: row.count(kind)


def _divergence(row: Row) -> float | str | None:
    known = row.first_divergence is None and row.score.max_position is not None
    return "never" if known else row.first_divergence


DIVERGENCE: Column[Row] = Column(
    "diverges, s", "time at which a distance first exceeds the tolerance, s", _divergence, "time"
)
COLUMNS: tuple[Column[Row], ...] = (
    *(_error(each.name) for each in fields(Score) if METRICS[each.name].head is not None),
    DIVERGENCE,
    Column(
        "energy",
        "change of the energy without a cause, as a fraction; + is a gain",
        lambda row: row.energy_drift,
        "change",
    ),
    Column(
        "momentum",
        "change of the momentum without a cause, as a fraction",
        lambda row: row.momentum_drift,
        "change",
        is_detail=True,
    ),
    Column("contacts", "contacts that the truth has too", _count("matched"), "count"),
    Column("truth only", "contacts of the truth that the run does not have", _count("missed"), "count"),
    Column("run only", "contacts of the run that the truth does not have", _count("phantom"), "count"),
    Column(
        "after",
        "contacts of either after one of their bodies has diverged; these are not matched",
        _count("after_divergence"),
        "count",
        is_detail=True,
    ),
)
"""Columns of the table and of the page of a comparison, but for those that name a row."""
ONE_SIDED = {"missed": "truth only", "phantom": "run only"}
"""Heads of unmatched contacts by their JSON names. `run` has another meaning of missed: tunnelling."""
