"""The table that `sandbox compare` prints: a row an engine, and what its figures mean below."""

import sys
from collections.abc import Sequence

import click

from sandbox.cli.table import WIDE
from sandbox.measure.compare import Comparison, Row
from sandbox.measure.compare.alignment import Event

MOST_NAMED = 5
"""Missed and phantom contacts that are named of each engine; `--json` has more."""


NO_EFFECT = 1e-6
"""A change that alters the error by no more than this fraction has none."""
HEADS = (
    "max error, m", "rms error, m", "max error, m/s", "diverges, s", "energy", "momentum", "contacts", "missed",
    "phantom", "after", "seconds",
)  # fmt: skip
LEGEND = (
    "error: the largest, and the root mean square, of all bodies' distances from the truth while that is trusted",
    "diverges: when a distance first exceeds the tolerance; energy, momentum: change without a cause, as a fraction",
    "contacts: also in the truth; missed: in the truth alone; phantom: in this run alone; "
    "after: either, once a body has diverged",
)
"""What the heads mean."""


def print_comparison(scene: str, comparison: Comparison, why: bool, refusals: bool) -> None:
    """Print the truth, a line for each engine, and below what there is to say of each.

    Args:
        scene: what it is called.
        comparison: what to print.
        why: whether to say which knob matters.
        refusals: whether to say why an engine refuses.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("engine", no_wrap=True)
    table.add_column("dt", justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for head in HEADS:
        table.add_column(head, justify="right", no_wrap=True)
    for row in comparison.rows:
        table.add_row(
            row.engine,
            f"{row.settings['dt']:.4g}",
            Text(row.status, style="green" if row.status == "ok" else "bold red"),
            _figure(row.score.max_position),
            _figure(row.score.rms_position),
            _figure(row.score.max_velocity),
            _divergence(row),
            _share(row.energy_drift),
            _share(row.momentum_drift),
            *(_count(row.count(kind)) for kind in ("matched", "missed", "phantom", "after_divergence")),
            _figure(row.seconds),
        )
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.width = max(console.width, Console(width=10_000).measure(table).maximum)
    console.print(Text(f"{scene}: {comparison.scene.title}" if comparison.scene.title else scene), soft_wrap=True)
    console.print(Text(comparison.sentence()), soft_wrap=True)
    console.print(table)
    for line in _below(comparison, why, refusals):
        click.echo(line)


def _below(comparison: Comparison, why: bool, refusals: bool) -> list[str]:
    lines = [*LEGEND] if any(row.status != "refused" for row in comparison.rows) else []
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        lines.append("energy: the change from the start, losses that are right included; the truth ends before the run")
    for row in comparison.rows:
        if refusals and row.status == "refused":
            lines.append(str(row.reason))
        for kind in ("missed", "phantom"):
            events = [event for event in row.events or () if event.kind == kind]
            if events:
                lines.append(f"{row.engine}: {kind} {_named(events)}")
        if why and row.status != "refused":
            lines += _explained(row)
    return lines


def _named(events: Sequence[Event]) -> str:
    named = [f"{' and '.join(event.between)} at {event.when:.4g} s" for event in events[:MOST_NAMED]]
    more = len(events) - len(named)
    return "; ".join(named) + (f"; and {more:,} more" if more else "")


def _explained(row: Row) -> list[str]:
    """Return the verdict, a table of the changes that matter, and those that do not or that the engine refuses."""
    if row.verdict is None:
        return [f"{row.engine}: nothing to explain"]
    found = sorted((knob for knob in row.why if knob.ratio is not None), key=lambda knob: knob.ratio or 0.0)
    idle = [knob for knob in found if abs((knob.ratio or 0.0) - 1.0) < NO_EFFECT]
    heads = ("change", "max error, m", "of the error")
    cells = [heads, *((k.label, _figure(k.max_position_error), f"×{k.ratio:.3g}") for k in found if k not in idle)]
    wide = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [row.verdict]
    lines += [f"  {a:<{wide[0]}}  {b:>{wide[1]}}  {c:>{wide[2]}}" for a, b, c in cells] if len(cells) > 1 else []
    for what, some in (
        ("no effect", idle),
        ("failed", [knob for knob in row.why if knob.ratio is None and knob.status != "refused"]),
        ("refused", [knob for knob in row.why if knob.status == "refused"]),
    ):
        if some:
            named = (f"{knob.label} ({knob.status})" if what == "failed" else knob.label for knob in some)
            lines.append(f"  {what}: {', '.join(named)}")
    return lines


def _divergence(row: Row) -> str:
    if row.first_divergence is not None:
        return f"{row.first_divergence:.4g}"
    return "–" if row.score.max_position is None else "never"


def _figure(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{value:+.2g}" if value else "0"


def _count(value: int | None) -> str:
    return "–" if value is None else f"{value:,}"
