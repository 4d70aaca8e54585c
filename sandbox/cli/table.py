"""The table that `sandbox run` prints: a row a run, and columns for what differs between them."""

import sys
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from sandbox.batch.outcome import Outcome

WIDE = 200
"""Columns where the output is no terminal: rows are for reading by line then, and must not be folded."""


def print_runs(outcomes: Sequence[Outcome]) -> None:
    """Print a row for each run."""
    rows = [outcome.row() for outcome in outcomes]
    differing = [key for key in rows[0]["settings"] if key != "dt" and _differs(rows, key)]
    seeds = len({row["seed"] for row in rows}) > 1

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scene", overflow="fold", min_width=8)
    table.add_column("engine", no_wrap=True)
    for head in ("dt", *differing, *(["seed"] if seeds else [])):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for head in ("× real", "energy, J", "contacts", "missed"):
        table.add_column(head, justify="right", no_wrap=True)

    for outcome, row in zip(outcomes, rows, strict=True):
        status = Text(row["status"], style="green" if row["status"] == "ok" else "bold red")
        if outcome.repeated:
            status.append(" stored", style="dim")
        table.add_row(
            Text(row["scene"]),
            row["engine"],
            f"{row['settings']['dt']:.4g}",
            *(_setting(row["settings"][key]) for key in differing),
            *([str(row["seed"])] if seeds else []),
            status,
            _figure(row["realtime_factor"], 3),
            f"{_figure(row['energy_start'])} → {_figure(row['energy_end'])}",
            f"{row['contacts']:,}",
            "?" if row["missed_contacts"] is None else f"{row['missed_contacts']:,}",
        )
    Console(width=None if sys.stdout.isatty() else WIDE).print(table)


def _differs(rows: Sequence[dict[str, Any]], key: str) -> bool:
    """Tell whether a setting differs between runs of one scene; between scenes an engine's own choices do anyway."""
    values: dict[str, set[str]] = {}
    for row in rows:
        values.setdefault(row["scene"], set()).add(str(row["settings"][key]))
    return any(len(each) > 1 for each in values.values())


def _setting(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _figure(value: float | None, digits: int = 4) -> str:
    if value is None:
        return "–"
    return f"{value:,.0f}" if 10 ** (digits - 1) <= abs(value) < 1e6 else f"{value:.{digits}g}"
