"""Scoring: what was forecast against what happened, by kind of warning."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from sandbox.measure.extremes.axis import Axis
from sandbox.measure.extremes.cell import Cell


@dataclass(frozen=True)
class Score:
    """How often warnings of a kind were right, over the cells of the axes that are about it.

    What was refused is left out, and what was stopped as it took too long: nobody knows what would have come.
    """

    kind: str
    true_positives: int = 0
    false_positives: int = 0
    false_negatives: int = 0
    true_negatives: int = 0

    @property
    def precision(self) -> float | None:
        """The share of warnings after which it came; None without warnings."""
        warned = self.true_positives + self.false_positives
        return self.true_positives / warned if warned else None

    @property
    def recall(self) -> float | None:
        """The share of what came that was warned of; None where nothing came."""
        came = self.true_positives + self.false_negatives
        return self.true_positives / came if came else None

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {
            "kind": self.kind,
            "true_positives": self.true_positives,
            "false_positives": self.false_positives,
            "false_negatives": self.false_negatives,
            "true_negatives": self.true_negatives,
            "precision": self.precision,
            "recall": self.recall,
        }


def scores(cells: Iterable[Cell], axes: Iterable[Axis]) -> tuple[Score, ...]:
    """Return a score for each kind that an axis is about, in the order of the axes."""
    about = {axis.name: axis for axis in axes if axis.kind is not None}
    counts: dict[str, dict[tuple[bool, bool], int]] = {}
    for axis in about.values():
        counts.setdefault(str(axis.kind), {})
    for cell in cells:
        its = about.get(cell.axis)
        if its is None or cell.verdict == "refused" or cell.outcome.slow:
            continue
        key = (its.kind in cell.outcome.predicted, its.came(cell))
        count = counts[str(its.kind)]
        count[key] = count.get(key, 0) + 1
    return tuple(
        Score(
            kind,
            true_positives=count.get((True, True), 0),
            false_positives=count.get((True, False), 0),
            false_negatives=count.get((False, True), 0),
            true_negatives=count.get((False, False), 0),
        )
        for kind, count in counts.items()
    )
