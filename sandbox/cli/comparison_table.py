"""The table that `sandbox compare` prints: a row for each engine and swept value, and what its figures mean below."""

import sys
from collections.abc import Iterator, Sequence

import click

from sandbox.cli.table import WIDE, print_legend
from sandbox.measure.compare import Comparison, Row
from sandbox.measure.compare.alignment import Event
from sandbox.measure.compare.sweep import short_key, value_text
from sandbox.measure.joint_error import HOLDING

MOST_NAMED = 5
"""Contacts of the truth only, and of the run only, that are named for each engine; `--json` has more."""
ONE_SIDED = {"missed": "truth only", "phantom": "run only"}
"""Contacts without a partner: their heads by their JSON names. In `run`, a missed contact means tunnelling."""


NO_EFFECT = 1e-6
"""A change that alters the error by no more than this fraction has none."""
HEADS = (
    "max error, m", "rms error, m", "max error, m/s", "diverges, s", "energy", "momentum", "contacts",
    *ONE_SIDED.values(), "after", "seconds",
)  # fmt: skip
LEGEND = (
    "error: the largest, and the root mean square, of all bodies' distances from the truth while that is trusted",
    "diverges: when a distance first exceeds the tolerance; energy, momentum: change without a cause, as a fraction",
    "contacts: also in the truth; truth only, run only: in one of the two alone; "
    "after: either, once a body has diverged",
)
"""What the heads mean, in short."""
COLUMNS = {
    "engine": "the physics engine",
    "dt": "time step of a frame, s",
    "status": "ok; diverged: a state is not finite; refused: the engine cannot model the scene; failed: it stopped",
    "max error, m": "largest distance of any body from the truth, while the truth is trusted, m",
    "rms error, m": "root mean square of these distances, m",
    "max error, m/s": "largest difference of any body's velocity from the truth, m/s",
    "diverges, s": "time at which a distance first exceeds the tolerance, s",
    "energy": "change of the energy without a cause, as a fraction; + is a gain",
    "momentum": "change of the momentum without a cause, as a fraction",
    "contacts": "contacts that the truth has too",
    "truth only": "contacts of the truth that the run does not have",
    "run only": "contacts of the run that the truth does not have",
    "after": "contacts of either after one of their bodies has diverged; these are not matched",
    "seconds": "computing time of the run, without compilation, s",
}
"""Columns of the table and their meaning, for `--verbose`."""


def print_comparison(scene: str, comparison: Comparison, why: bool, refusals: bool, verbose: bool = False) -> None:
    """Print the truth, a line for each engine and swept value, and below what there is to say of each.

    Args:
        scene: what it is called.
        comparison: what to print.
        why: whether to say which knob matters.
        refusals: whether to say why an engine refuses.
        verbose: whether to explain every column, instead of some in short.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("engine", no_wrap=True)
    swept = [key for key in comparison.rows[0].set if key != "solver.dt"]
    for key in swept:
        table.add_column(short_key(key), justify="right", no_wrap=True)
    table.add_column("dt", justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    for head in HEADS:
        table.add_column(head, justify="right", no_wrap=True)
    for row in comparison.rows:
        table.add_row(
            row.engine,
            *(Text(value_text(row.set[key])) for key in swept),
            f"{row.settings['dt']:.4g}",
            Text(row.status, style="green" if row.status == "ok" else "bold red"),
            _figure(row.score.max_position),
            _figure(row.score.rms_position),
            _figure(row.score.max_velocity),
            _divergence(row),
            _share(row.energy_drift),
            _share(row.momentum_drift),
            *(_count(row.count(kind)) for kind in ("matched", *ONE_SIDED, "after_divergence")),
            _figure(row.seconds),
        )
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.width = max(console.width, Console(width=10_000).measure(table).maximum)
    console.print(Text(f"{scene}: {comparison.scene.title}" if comparison.scene.title else scene), soft_wrap=True)
    console.print(Text(comparison.sentence()), soft_wrap=True)
    console.print(table)
    if verbose:
        meanings = COLUMNS | {short_key(key): f"value of {key!r}" for key in swept}
        print_legend([str(column.header) for column in table.columns], meanings)
    for line in _below(comparison, why, refusals, not verbose):
        click.echo(line)


def _below(comparison: Comparison, why: bool, refusals: bool, legend: bool) -> list[str]:
    lines = [*LEGEND] if legend and any(row.status != "refused" for row in comparison.rows) else []
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        lines.append(
            "energy: change since the start, which includes correct losses, because the truth ends before the run does"
        )
    lines += [*_below_accuracy(comparison), *_joint_order(comparison)]
    for row in comparison.rows:
        if refusals and row.status == "refused":
            lines.append(str(row.reason))
        for kind, head in ONE_SIDED.items():
            events = [event for event in row.events or () if event.kind == kind]
            if events:
                lines.append(f"{row.name}: {head}: {_named(events)}")
        if why and row.status != "refused":
            lines += _explained(row)
    return lines


def _below_accuracy(comparison: Comparison) -> Iterator[str]:
    """Yield which errors are too small for the truth to tell them from 0."""
    for row in comparison.rows:
        best, error = comparison.truth_of(row.name), row.score.max_position
        if best is not None and error is not None and best.difference > 0.0 and error <= best.difference:
            accuracy = f"the accuracy of the truth, {best.difference:.1g} m"
            yield f"{row.name}: its max error is below {accuracy}; it may be smaller"


def _joint_order(comparison: Comparison) -> Iterator[str]:
    """Yield what limits the order where integrators are compared on rigid joints, whose solver has an order too."""
    rows = [row for row in comparison.rows if "solver.integrator" in row.set and row.status != "refused"]
    if not rows or not len(comparison.scene.links.of(*HOLDING)):
        return
    for method in sorted({str(row.settings["joints"]) for row in rows}):
        order = 2 if method == "rattle" else 1
        other = "" if order == 2 else "; `--set solver.joints=rattle` gives order 2"
        yield f"rigid joints by {method} limit every integrator to order {order}{other}"


def _named(events: Sequence[Event]) -> str:
    named = [f"{' and '.join(event.between)} at {event.when:.4g} s" for event in events[:MOST_NAMED]]
    more = len(events) - len(named)
    return "; ".join(named) + (f"; and {more:,} more" if more else "")


def _explained(row: Row) -> list[str]:
    """Return the verdict, a table of the changes that matter, and those that do not or that the engine refuses."""
    if row.verdict is None:
        return [f"{row.name}: no error to explain"]
    found = sorted((knob for knob in row.why if knob.ratio is not None), key=lambda knob: knob.ratio or 0.0)
    idle = [knob for knob in found if abs((knob.ratio or 0.0) - 1.0) < NO_EFFECT]
    heads = ("change", "max error, m", "of the original")
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
