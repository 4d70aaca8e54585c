"""The tables that `sandbox extremes` prints: boundaries, and how good the forecasts were."""

import sys
from collections import Counter
from collections.abc import Iterator

from sandbox.cli.naming import plural
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
    first = max((len(limit.axis) for limit in result.limits), default=0)
    second = max((len(limit.setup) for limit in result.limits), default=0)
    across = max((len(list(_row(result, limit))) for limit in result.limits), default=0)
    last = ""
    for limit in result.limits:
        line = Text(f"{limit.axis if limit.axis != last else '':<{first}}  {limit.setup:<{second}}  ")
        cells = list(_row(result, limit))
        for cell in cells:
            line.append(LETTERS[cell.verdict], STYLES[cell.verdict])
        line.append(f"{'':<{across - len(cells)}}  {_reached(limit)}")
        line.truncate(max(console.width, 60), overflow="ellipsis")
        console.print(line, soft_wrap=True)
        last = limit.axis
    if result.limits:
        legend = ", ".join(f"{letter} {word}" for word, letter in LETTERS.items())
        console.print(f"one letter per level, from the easiest to the hardest: {legend}", style="dim", soft_wrap=True)
    scores = [score for score in result.predictions if score.precision is not None or score.recall is not None]
    if scores:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("forecast", no_wrap=True)
        for head in ("true alarms", "false alarms", "missed", "true negatives", "precision", "recall"):
            table.add_column(head, justify="right", no_wrap=True)
        for score in scores:
            counts = (score.true_positives, score.false_positives, score.false_negatives, score.true_negatives)
            shares = (_share(score.precision), _share(score.recall))
            table.add_row(score.kind, *map(str, counts), *shares)
        console.print(table)
    for told in _sums(result):
        console.print(told, soft_wrap=True)


def _row(result: Extremes, limit: Limit) -> Iterator[Cell]:
    return (cell for cell in result.cells if (cell.axis, cell.setup) == (limit.axis, limit.setup))


def _sums(result: Extremes) -> Iterator[str]:
    for what, cells in (("single axes", result.cells), ("boundaries", result.probes), ("pairs", result.pairs)):
        if cells:
            count = Counter(cell.verdict for cell in cells)
            told = ", ".join(f"{count[word]:,} {word}" for word in WORDS if count[word])
            yield f"{what}: {len(cells):,} cells: {told}"
    yield f"{result.seconds:.0f} s on {plural(result.plan.workers, 'worker')}"


def _reached(limit: Limit) -> str:
    """Say how far it goes."""
    if limit.refused:
        return f"refused: {limit.reason}"
    if limit.first_failure is None:
        return f"all levels pass, up to {_level(limit.limit)}"
    if limit.limit is None:
        return f"no level passes: {limit.rule}: {limit.reason}"
    beyond = "" if limit.monotone else " (levels beyond pass and fail in turn)"
    return f"up to {_level(limit.limit)}, fails at {_level(limit.first_failure)}{beyond}: {limit.rule}: {limit.reason}"


def _level(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:.0%}"
