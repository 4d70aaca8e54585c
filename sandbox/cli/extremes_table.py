"""The tables that `sandbox extremes` prints: boundaries, and how good the forecasts were."""

import sys
from collections import Counter
from collections.abc import Iterator

from sandbox.measure.extremes import Cell, Extremes
from sandbox.measure.extremes.boundary import Limit
from sandbox.measure.extremes.cell import WORDS

WIDE = 200
"""Columns where the output is no terminal, as of the runs' table."""
LETTERS = {"exact": "E", "degraded": "d", "refused": "–", "failed": "✗"}
STYLES = {"exact": "bold green", "degraded": "yellow", "refused": "dim", "failed": "bold red"}


def print_extremes(result: Extremes) -> None:
    """Print a line for each axis and setup, one for each kind of forecast, and how many cells came out how."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(width=None if sys.stdout.isatty() else WIDE)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in ("axis", "setup", "levels"):
        table.add_column(head, no_wrap=True)
    for head in ("passes up to", "fails at"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("why", no_wrap=True, overflow="ellipsis")
    for limit in result.limits:
        levels = Text()
        for cell in _row(result, limit):
            levels.append(LETTERS[cell.verdict], STYLES[cell.verdict])
        what = f"{limit.rule}: {limit.reason}" if limit.rule else limit.reason
        note = "" if limit.monotone else " (not the last: it passes again beyond)"
        table.add_row(limit.axis, limit.setup, levels, _level(limit.limit), _level(limit.first_failure), what + note)
    if result.limits:
        console.print(table)
        legend = ", ".join(f"{letter} {word}" for word, letter in LETTERS.items())
        console.print(f"levels, from the easiest to the hardest: {legend}", style="dim", soft_wrap=True)
    scores = [score for score in result.predictions if score.precision is not None or score.recall is not None]
    if scores:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("forecast", no_wrap=True)
        for head in ("came", "did not", "unforeseen", "rightly silent", "precision", "recall"):
            table.add_column(head, justify="right", no_wrap=True)
        for score in scores:
            counts = (score.true_positives, score.false_positives, score.false_negatives, score.true_negatives)
            shares = (_share(score.precision), _share(score.recall))
            table.add_row(score.kind, *map(str, counts), *shares)
        console.print(table)
    for line in _sums(result):
        console.print(line, soft_wrap=True)


def _row(result: Extremes, limit: Limit) -> Iterator[Cell]:
    return (cell for cell in result.cells if (cell.axis, cell.setup) == (limit.axis, limit.setup))


def _sums(result: Extremes) -> Iterator[str]:
    for what, cells in (("one at a time", result.cells), ("boundaries", result.probes), ("pairs", result.pairs)):
        if cells:
            count = Counter(cell.verdict for cell in cells)
            told = ", ".join(f"{count[word]:,} {word}" for word in WORDS if count[word])
            yield f"{what}: {len(cells):,} cells: {told}"
    yield f"{result.seconds:.0f} s on {result.plan.workers} worker(s)"


def _level(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.0%}"
