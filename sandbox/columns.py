"""Columns of the tables of a study: the terminal, its legend and the HTML page are views of one list."""

from collections.abc import Callable, Iterable, Sequence
from typing import Generic, Literal, NamedTuple, TypeVar

R = TypeVar("R")

TRUTH = "truth"
"""Text in the place of an error that is 0 because the run is the truth itself"""

Kind = Literal["number", "time", "change", "count", "text"]
"""Format of the values: a number; a time, s, or a cost; a signed fraction; a count; a text"""


class Column(NamedTuple, Generic[R]):
    """Column of a table with a row for each R."""

    head: str
    """head, with the unit"""
    about: str
    """meaning"""
    value: Callable[[R], float | str | None]
    """value of a row; None if it is unknown, a text in the place of a number"""
    kind: Kind = "number"
    is_optional: bool = False
    """left out of a table whose rows all have 0 or no value"""
    is_detail: bool = False
    """left out of a short table"""


def shown(columns: Iterable[Column[R]], rows: Sequence[R], details: bool = True) -> list[Column[R]]:
    """Return the columns that a table of some rows has; a short table is one without details."""
    needed = (column for column in columns if details or not column.is_detail)
    return [column for column in needed if not column.is_optional or any(map(_has_value(column), rows))]


def _has_value(column: Column[R]) -> Callable[[R], bool]:
    return lambda row: column.value(row) not in (None, 0, "", TRUTH)
