"""Tables on the terminal: their style and width, and lines of text beside them.

rich is imported when a table is printed: it takes 20 ms that `--json` and `--quiet` do not need.
"""

import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import click

from sandbox.columns import Column, R
from sandbox.formatting import UNKNOWN

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDTH_WITHOUT_TERMINAL = 240
"""Columns of an output that is no terminal: programs read it line by line, so lines are not wrapped."""
UNBOUNDED = 10_000
"""Width for measuring a table, in columns: larger than any table."""


def new_table() -> "Table":
    """Return a table without lines, with bold heads."""
    from rich.table import Table

    return Table(box=None, pad_edge=False, header_style="bold")


def add_columns(table: "Table", heads: Iterable[str], justify: Literal["left", "right"] = "left") -> None:
    """Add columns that are never wrapped; numbers are justified to the right."""
    for head in heads:
        table.add_column(head, justify=justify, no_wrap=True)


def add_value_columns(table: "Table", columns: Iterable[Column[R]]) -> None:
    """Add columns of values; all but texts are justified to the right."""
    for column in columns:
        add_columns(table, [column.head], "left" if column.kind == "text" else "right")


def heads_of(table: "Table") -> list[str]:
    """Return the heads of the columns."""
    return [str(column.header) for column in table.columns]


def format_optional(value: float | None, spec: str = ".3g") -> str:
    """Return a number by a format specification; a dash for None, an unknown value."""
    return UNKNOWN if value is None else format(value, spec)


def cell_text(column: Column[R], row: R) -> str:
    """Return the value of a row in a column as text."""
    value = column.value(row)
    if value is None or isinstance(value, str):
        return UNKNOWN if value is None else value
    if column.kind == "change":
        return f"{value:+.2g}" if value else "0"
    return format(value, {"number": ".3g", "time": ".4g", "count": ",", "text": ""}[column.kind])


def new_console() -> "Console":
    """Return a console of the terminal's width, or `WIDE` without a terminal."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else WIDTH_WITHOUT_TERMINAL)


def print_table(table: "Table", foldable: int = 0) -> None:
    """Print a table at its full width: a narrower terminal wraps the lines, and no cell is cut off.

    Args:
        table: the table.
        foldable: columns by which it may be narrower, because one of its columns folds its text.
    """
    from rich.console import Console

    console = new_console()
    console.width = max(console.width, Console(width=UNBOUNDED).measure(table).maximum - foldable)
    console.print(table)


def print_folded_table(table: "Table") -> None:
    """Print a table whose texts fold to fit a terminal; without a terminal each row is one line."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console.width = Console(width=UNBOUNDED).measure(table).maximum
    console.print(table)


def print_line(text: str, style: str = "", fold: bool = False) -> None:
    """Print text as it is, without markup: as one line, which the terminal wraps, or folded between words."""
    from rich.text import Text

    new_console().print(Text(text, style=style), soft_wrap=not fold)


def print_legend(heads: Sequence[str], meanings: Mapping[str, str]) -> None:
    """Print the meaning of each head that has one, a line each."""
    known = [head for head in heads if head in meanings]
    width = max(map(len, known), default=0)
    for head in known:
        click.echo(f"  {head:<{width}}  {meanings[head]}")
