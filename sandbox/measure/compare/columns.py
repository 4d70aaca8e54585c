"""Columns of a comparison."""

import math
from collections.abc import Callable
from dataclasses import fields

from sandbox.columns import TRUTH, Column
from sandbox.formatting import UNKNOWN
from sandbox.measure.compare.end_statistics import EndStatistics
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.compare.result import Comparison, Row, Score


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


def _start_error(quantile: str) -> Callable[[Row], float | None]:
    """Return the value of a column of errors from perturbed starts; infinite where too many runs failed."""

    def value(row: Row) -> float | None:
        if row.start_errors is None or not row.start_errors.held.trials:
            return None
        error: float | None = getattr(row.start_errors, quantile)
        return math.inf if error is None else error

    return value


END_ABOUT = (
    "measures of the end whose distribution over perturbed starts differs from that of the truth; in brackets the "
    "number of starts"
)


def ends_text(ends: EndStatistics | None) -> str | None:
    """Return the measures of the end that differ from the truth's over perturbed starts, and the number of starts."""
    if ends is None:
        return None
    names = [f"{ends.failed} failed"] if ends.failed else []
    names += [each.name.replace("_", " ") for each in ends.differing]
    return f"{', '.join(names) or 'nothing'} ({ends.starts})"


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
    Column(
        "median, m", "median of the max errors from perturbed starts", _start_error("median_error"), is_optional=True
    ),
    Column(
        "95 %, m", "95 % quantile of the max errors from perturbed starts", _start_error("error_95"), is_optional=True
    ),
    Column("end differs in", END_ABOUT, lambda row: ends_text(row.end_statistics), "text", True),
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

END_HEAD = "end, mean ± deviation"
"""Head of the first column of `end_table`"""
END_LEGEND = "≠: differs from the truth in distribution (exchange test, 5 %), by more than the tolerance"


def end_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Return the heads and rows of a table of the ends of runs over perturbed starts: each measure that varies.

    There are none without other starts, or of a sweep, whose values have truths of their own.
    """
    compared = [(row.name, row.end_statistics) for row in comparison.rows if row.end_statistics is not None]
    if any(row.set for row in comparison.rows):
        return [], []
    names = dict.fromkeys(
        each.name for _, ends in compared for each in ends.statistics if not each.compared.is_constant
    )
    rows: list[list[str]] = []
    for name in names:
        found = [next((each for each in ends.statistics if each.name == name), None) for _, ends in compared]
        known = next(each for each in found if each is not None)
        head = name.replace("_", " ") + (f", {known.unit}" if known.unit else "")
        rows.append([head, known.truth_text, *(UNKNOWN if each is None else each.text for each in found)])
    return [END_HEAD, TRUTH, *(name for name, _ in compared)] if rows else [], rows
