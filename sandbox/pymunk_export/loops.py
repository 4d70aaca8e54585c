"""Blocks of statements: similar consecutive blocks become one loop over a table of their values."""

import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from sandbox.echo import MAX_ECHO, printable, shorten

MIN_LOOP = 3
"""Number of similar blocks from which on they become a loop."""

MAX_INLINE = 12
"""Rows of a loop's table that stand in the loop; a longer one becomes a constant of the module."""

UNSTATED = {"velocity": "(0.0, 0.0)", "angle": "0.0", "angular_velocity": "0.0"}
"""pymunk's own values: a statement that sets only these is left out."""


@dataclass(frozen=True)
class Block:
    """Statements that create one object of the space."""

    kind: str
    """plural noun, which names the table of a loop"""
    title: str
    """comment on one object; any text"""
    lines: tuple[str, ...]
    """statements; `{radius}` stands for the value of the column `radius`"""
    values: dict[str, str] = field(default_factory=dict)
    """expression of each column: a literal"""

    @property
    def form(self) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
        """Key that is the same for blocks that one loop can replace."""
        return self.kind, self.lines, tuple(self.values)


class Loops:
    """Writer of blocks, with the tables that its loops need."""

    def __init__(self) -> None:
        self.tables: list[str] = []
        """definitions of the constants"""
        self._counts: dict[str, int] = {}

    def write(self, blocks: Sequence[Block]) -> list[str]:
        """Return the statements of blocks, in order."""
        lines: list[str] = []
        for _, group in groupby(blocks, key=lambda each: each.form):
            similar = list(group)
            if len(similar) >= MIN_LOOP:
                lines += self._loop(similar)
            else:
                for block in similar:
                    lines += [*comment(block.title), *_statements(block.lines, block.values, block.values)]
        return lines

    def _loop(self, blocks: list[Block]) -> list[str]:
        first = blocks[0]
        names = first.values
        same = {key: value for key, value in names.items() if all(each.values[key] == value for each in blocks)}
        varying = [key for key in names if key not in same]
        title = comment(f"{len(blocks):,} {first.kind}: {first.title} to {blocks[-1].title}")
        body = [f"    {line}" for line in _statements(first.lines, {key: same.get(key, key) for key in names}, same)]
        if not varying:
            return [*title, f"for _ in range({len(blocks)}):", *body]
        rows = [_row([each.values[key] for key in varying]) for each in blocks]
        target = ", ".join(varying)
        if len(rows) > MAX_INLINE:
            return [*title, f"for {target} in {self._table(first.kind, target, rows)}:", *body]
        return [*title, f"for {target} in [", *(f"    {row}," for row in rows), "]:", *body]

    def _table(self, kind: str, columns: str, rows: Sequence[str]) -> str:
        """Add a table of rows; return its name."""
        stem = kind.upper().replace(" ", "_")
        self._counts[stem] = number = self._counts.get(stem, 0) + 1
        name = stem if number == 1 else f"{stem}_{number}"
        self.tables += [f"# Rows: {columns}.", f"{name} = [", *(f"    {row}," for row in rows), "]", ""]
        return name


def comment(text: str, width: int = 116) -> list[str]:
    """Return a text as comment lines; characters that could end or disguise a line are escaped."""
    words = [shorten(word, MAX_ECHO) for word in printable(text).split(" ")]
    lines, line = [], "#"
    for word in words:
        if len(line) + 1 + len(word) > width and line != "#":
            lines.append(line)
            line = "#"
        line += f" {word}"
    return [*lines, line.rstrip()]


def _statements(lines: Sequence[str], values: dict[str, str], same: dict[str, str]) -> Iterator[str]:
    """Yield statements with their values, except those that set pymunk's own values in all blocks of a group."""
    for line in lines:
        columns = [name for _, name, _, _ in string.Formatter().parse(line) if name]
        unstated = [name for name in columns if name in UNSTATED and same.get(name) == UNSTATED[name]]
        if not (columns and unstated == columns):
            yield line.format_map(values)


def _row(values: Sequence[str]) -> str:
    return values[0] if len(values) == 1 else f"({', '.join(values)})"
