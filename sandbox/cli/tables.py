"""Tables on the terminal: their style and width, and lines of text beside them.

rich is imported when a table is printed: it takes 20 ms that `--json` and `--quiet` do not need.
"""

import shutil
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import click

from sandbox.columns import Column, R
from sandbox.formatting import UNKNOWN

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.table import Column as TableColumn
    from rich.table import Table

WIDTH_WITHOUT_TERMINAL = 240
"""Columns of an output that is no terminal: programs read it line by line, so lines are not wrapped."""
GAP = 2
"""Spaces between two columns"""
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


def terminal_width() -> int | None:
    """Return the width of the terminal in columns; None if the output is no terminal."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else None


def new_console() -> "Console":
    """Return a console of the terminal's width, or `WIDTH_WITHOUT_TERMINAL`."""
    from rich.console import Console

    # With a height too, rich keeps to this width on a terminal of TERM=dumb, whose size it assumes otherwise.
    height = shutil.get_terminal_size().lines
    width = terminal_width() or WIDTH_WITHOUT_TERMINAL
    return Console(width=width, height=height, markup=False, emoji=False)  # names and texts may have brackets


def print_table(table: "Table", keys: int = 1) -> None:
    """Print a table, in which a terminal never folds a number or a word.

    If the terminal is too narrow, heads take two lines. If it is still too narrow, the columns are printed in blocks
    below each other, each of which begins with the columns that name a row. Texts that are longer than a line fold
    between words.

    Args:
        table: the table.
        keys: number of columns, at the left, that name a row.
    """
    console, width = new_console(), terminal_width()
    if width is None:
        console.width = max(console.width, console.measure(table, options=_unbounded(console)).maximum)
        console.print(table)
        return
    for k, part in enumerate(_fitted(table, keys, width)):
        if k:
            click.echo()
        console.print(part)


def print_folded_table(table: "Table") -> None:
    """Print a table whose texts fold to fit a terminal; without a terminal each row is one line."""
    console = new_console()
    if terminal_width() is None:
        console.width = console.measure(table, options=_unbounded(console)).maximum
    console.print(table)


def _unbounded(console: "Console") -> "ConsoleOptions":
    return console.options.update(width=UNBOUNDED)


def _fitted(table: "Table", keys: int, width: int) -> "Iterator[Table]":
    """Yield tables that fit a terminal and together have the columns of a table."""
    columns = [replace(column) for column in table.columns]
    if _total(columns) > width:
        for column in columns:
            column.header = _on_two_lines(str(column.header), max(map(_cell_width, column.cells), default=0))
    for column in columns[:keys]:
        column.max_width, column.no_wrap = width // 2, False
    repeated = [columns[k] for k in range(keys) if _total(columns[: k + 1]) <= width // 2]
    room = width - _total(repeated) - GAP
    block: list[TableColumn] = []
    for column in columns:
        if block and _total([*block, column]) > width:
            yield _part(block)
            block = [*repeated]
        if _width(column) > room and column not in repeated:
            column.no_wrap = False
        block.append(column)
    yield _part(block)


def _part(columns: "Sequence[TableColumn]") -> "Table":
    """Return a table of some columns of another one."""
    part = new_table()
    for each in columns:
        part.add_column(
            each.header, style=each.style, justify=each.justify, no_wrap=each.no_wrap, max_width=each.max_width
        )
    for row in zip(*(each.cells for each in columns), strict=True):
        part.add_row(*row)
    return part


def _width(column: "TableColumn") -> int:
    """Return the width of a column."""
    natural = max(_cell_width(cell) for cell in (column.header, *column.cells))
    return natural if column.max_width is None else min(natural, column.max_width)


def _cell_width(cell: object) -> int:
    from rich.cells import cell_len

    return max(map(cell_len, str(cell).split("\n")))


def _total(columns: "Iterable[TableColumn]") -> int:
    """Return the width of a table of columns."""
    return sum(_width(column) + GAP for column in columns) - GAP


def _on_two_lines(head: str, width: int) -> str:
    """Return a head whose longer line is as short as possible, if it is wider than the cells below it."""
    words = head.split(" ")
    if len(head) <= width or len(words) == 1:
        return head
    splits = ((" ".join(words[:k]), " ".join(words[k:])) for k in range(1, len(words)))
    return "\n".join(min(splits, key=lambda lines: max(map(len, lines))))


def print_line(text: str, style: str = "") -> None:
    """Print text as it is, without markup; a terminal folds it between words."""
    from rich.text import Text

    new_console().print(Text(text, style=style), soft_wrap=terminal_width() is None)


def print_item(text: str, indent: str = "  ") -> None:
    """Print one item of a list; a terminal folds it between words."""
    width, further = terminal_width() or UNBOUNDED, f"{indent}  "
    click.echo(textwrap.fill(text, width, initial_indent=indent, subsequent_indent=further, break_on_hyphens=False))


def print_descriptions(descriptions: Mapping[str, str], indent: str = "") -> None:
    """Print a line for each name and its description, which a terminal folds between words, beside the names."""
    lengths = {name: len(click.unstyle(name)) for name in descriptions}
    width = max(lengths.values(), default=0) + GAP
    room = max((terminal_width() or UNBOUNDED) - len(indent) - width, 1)
    for name, text in descriptions.items():
        for k, line in enumerate(textwrap.wrap(text, room, break_on_hyphens=False)):
            head = name + " " * (width - lengths[name]) if k == 0 else " " * width
            click.echo(f"{indent}{head}{line}")


def print_legend(heads: Sequence[str], meanings: Mapping[str, str]) -> None:
    """Print the meaning of each head that has one."""
    print_descriptions({head: meanings[head] for head in heads if head in meanings}, "  ")
