"""The tables that `sandbox run --ledger` prints: where energy went, a row a cause, a column a run."""

import sys
from collections.abc import Iterator, Sequence
from typing import Any

from sandbox.cli.table import WIDE, Row
from sandbox.engines.energy_ledger import Cause

ABREAST = 5
"""Runs in one table; more stand below."""

NOTHING = 1e-12
"""Less than this share of the scale is rounding, and no line of its own."""


def print_ledgers(rows: Sequence[Row]) -> None:
    """Print the ledgers of runs, those of one scene side by side."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(width=None if sys.stdout.isatty() else WIDE)
    kept = [row for row in rows if row["ledger"] is not None]
    for those in _abreast(kept):
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column(Text(f"energy of {those[0]['scene']}, J"), overflow="fold")
        for row in those:
            table.add_column(Text(_label(row, those)), justify="right", no_wrap=True)
            table.add_column("", justify="right", style="dim", no_wrap=True)
        books = [row["ledger"] for row in those]
        table.add_row("start", *_cells(books, [book["start"] for book in books], shares=False))
        for cause in books[0]["causes"]:
            if cause == Cause.PHANTOM or any(_tells(book, book["causes"].get(cause)) for book in books):
                table.add_row(f"  {cause}", *_cells(books, [book["causes"].get(cause) for book in books]))
        table.add_row("sum", *_cells(books, [_sum(book) for book in books]))
        table.add_row("end", *_cells(books, [book["end"] for book in books], shares=False))
        table.add_row("residual", *_cells(books, [book["residual"] for book in books], least=0.0))
        console.width = max(console.width, Console(width=10_000).measure(table).maximum)
        console.print()
        console.print(table)
    if kept:
        console.print(Text("%: of the largest kinetic energy or the largest entry, whichever is greater", style="dim"))


def _abreast(rows: Sequence[Row]) -> Iterator[list[Row]]:
    """Yield the runs of one scene, at most so many at once."""
    for scene in dict.fromkeys(row["scene"] for row in rows):
        own = [row for row in rows if row["scene"] == scene]
        for first in range(0, len(own), ABREAST):
            yield own[first : first + ABREAST]


def _label(row: Row, those: Sequence[Row]) -> str:
    """Return a run's engine, and what was set in it alone."""
    differing = [key for key in row["set"] if len({str(other["set"].get(key)) for other in those}) > 1]
    values = (f"{key.rpartition('.')[2]}={row['set'][key]}" for key in differing)
    return " ".join((row["engine"], *values))


def _cells(
    books: Sequence[dict[str, Any]], values: Sequence[float | None], shares: bool = True, least: float = NOTHING
) -> Iterator[str]:
    """Yield a figure and its share of the scale for each run."""
    for book, value in zip(books, values, strict=True):
        if value is None or (shares and not _tells(book, value, least)):
            yield from ("?" if value is None else "0", "")
        else:
            yield f"{value:.5g}"
            yield _percent(value / book["scale"]) if shares and book["scale"] else ""


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %" if abs(share) >= 0.001 else f"{100.0 * share:.1g} %"


def _tells(book: dict[str, Any], value: float | None, least: float = NOTHING) -> bool:
    """Tell whether a figure is more than rounding."""
    return value is None or abs(value) > least * (book["scale"] or 0.0)


def _sum(book: dict[str, Any]) -> float | None:
    values = list(book["causes"].values())
    return None if None in values else sum(values)
