"""The table that `sandbox run` prints."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from sandbox.batch.outcome import Outcome

HEADS = ("scene", "engine", "dt", "seed", "status", "steps", "seconds", "× real time", "energy J", "contacts", "missed")
LEFT = 2  # columns of words


def print_runs(outcomes: Sequence[Outcome]) -> None:
    """Print a row for each run."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for k, head in enumerate(HEADS):
        table.add_column(head, justify="left" if k < LEFT or head == "status" else "right", overflow="fold")
    for outcome in outcomes:
        row = outcome.row()
        status = Text(row["status"], style="green" if row["status"] == "ok" else "bold red")
        if outcome.repeated:
            status.append(" (stored)", style="dim")
        table.add_row(
            Text(row["scene"]),
            row["engine"],
            f"{row['settings']['dt']:g}",
            str(row["seed"]),
            status,
            f"{row['steps']:,}",
            _figure(row["seconds"]),
            _figure(row["realtime_factor"]),
            f"{_figure(row['energy_start'])} → {_figure(row['energy_end'])}",
            f"{row['contacts']:,}",
            "?" if row["missed_contacts"] is None else f"{row['missed_contacts']:,}",
        )
    Console().print(table)


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
