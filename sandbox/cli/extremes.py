"""`sandbox extremes`: how far each engine and setting goes before it breaks, and whether the forecast saw it coming."""

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import click

from sandbox.cli.extremes_table import print_extremes
from sandbox.cli.naming import MAX_UNKNOWN, engines_in, further_unknown, names_in
from sandbox.cli.output import make_folder, require_folder, write_json
from sandbox.cli.reading import gathering, print_json, refused
from sandbox.echo import short_repr
from sandbox.measure.extremes import Extremes, Plan, extremes
from sandbox.measure.extremes.axes import AXES, PAIRS
from sandbox.measure.extremes.axis import Axis
from sandbox.measure.extremes.checking import check_overrides
from sandbox.measure.extremes.matrix import MEMORY, SECONDS, Progress, Watch
from sandbox.measure.extremes.stored import Change, StoredError, changes, read
from sandbox.measure.extremes.warden import WorkerError
from sandbox.scene.errors import Fault

LEAST_MEMORY = 1024
"""MiB: what the libraries of a worker take, and some more."""


@click.command(name="extremes")
@click.option("--axes", metavar="NAME[,NAME]", help=f"axes to vary; default: all, which are {', '.join(AXES)}")
@click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help="engine or engines to test; default: all")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of every scene")
@click.option("--quick", is_flag=True, help="few levels, no pairs, boundaries only as fine as the levels")
@click.option("--pairs/--no-pairs", default=True, help="also vary two axes at once")
@click.option(
    "--timeout", type=click.FloatRange(0.1, 86_400.0), default=SECONDS, metavar="S", help="time limit of each cell, s"
)
@click.option(
    "--memory", type=click.IntRange(LEAST_MEMORY), default=MEMORY, metavar="MB", help="memory limit of each worker, MiB"
)
@click.option(
    "--workers", type=click.IntRange(1, 256), metavar="N", help="number of worker processes; default: one per core"
)
@click.option(
    "--out", type=click.Path(path_type=Path), metavar="DIR", help="write report.html, heat maps, extremes.json"
)
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="compare the boundaries with those stored in FILE (an extremes.json)",
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="print no tables and no progress")
def command(
    axes: str | None,
    engines: str | None,
    overrides: tuple[str, ...],
    quick: bool,
    pairs: bool,
    timeout: float,
    memory: int,
    workers: int | None,
    out: Path | None,
    against: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Increase one parameter at a time, and pairs of them, until each engine fails, and report the boundaries.

    Each cell runs in a worker process with a time and a memory limit, so a crash does not stop the command.
    """
    faults: list[Fault] = []
    chosen = _axes(axes, faults)
    names = engines_in(engines, faults)
    stored = None
    if against is not None:
        with gathering(faults, "--against", (StoredError,)):
            stored = read(against)
    if not math.isfinite(timeout):
        faults.append(Fault("--timeout", None, "", f"is {timeout} s; it must be finite"))
    with gathering(faults):
        check_overrides(overrides, chosen)
    with gathering(faults):
        require_folder(out)
    if out is not None and not faults:
        with gathering(faults):
            make_folder(out)
    if faults:
        return refused(faults, as_json, cells=[], limits=[])

    cases = {axis.case.name for axis in chosen}
    both = tuple(pair for pair in PAIRS if pair.case.name in cases) if pairs and not quick else ()
    plan = Plan(chosen, both, None if names is None else tuple(names), overrides, quick, timeout, memory)
    if workers is not None:
        plan = replace(plan, workers=workers)
    try:
        with _telling(quiet or as_json) as told:
            result = extremes(plan, told)
    except WorkerError as error:
        click.echo(f"--memory: {error}", err=True)
        return 2
    return _tell(result, out, stored, as_json, quiet)


def _axes(text: str | None, faults: list[Fault]) -> tuple[Axis, ...]:
    if text is None:
        return tuple(AXES.values())
    names = names_in(text)
    unknown = [name for name in names if name not in AXES]
    axes = ", ".join(AXES)
    faults += [Fault("--axes", None, "", f"no axis {short_repr(name)}; axes: {axes}") for name in unknown[:MAX_UNKNOWN]]
    faults += further_unknown("--axes", len(unknown))
    return tuple(AXES[name] for name in names if name in AXES)


def _tell(
    result: Extremes, out: Path | None, stored: Sequence[dict[str, object]] | None, as_json: bool, quiet: bool
) -> int:
    """Print what came of it, write it down, and return the exit status."""
    status = 0
    document = result.document()
    found = [] if stored is None else changes(stored, result.limits)
    worse = [change for change in found if change.worse]
    if stored is not None:
        document["changes"] = [change.document() for change in found]
    for change in worse:
        click.echo(str(change), err=True)
        status = 1
    if result.interrupted:
        click.echo(f"interrupted: {len(result.cells) + len(result.pairs)} cells are complete and kept", err=True)
        status = 130
    if as_json:
        print_json(document)
    elif not quiet:
        print_extremes(result)
        _tell_changes(found, stored is not None)
    if out is not None:
        try:
            _write(result, document, out)
        except OSError as error:
            click.echo(f"--out: {out}: {error.strerror or error}", err=True)
            return status or 2
        if not quiet and not as_json:
            click.echo(f"written: {out}")
    return status


def _tell_changes(found: Sequence[Change], held: bool) -> None:
    for change in found:
        if not change.worse:
            click.echo(str(change))
    if held and not found:
        click.echo("no boundary has moved")


def _write(result: Extremes, document: dict[str, object], out: Path) -> None:
    """Write heat maps, a page and the document into a folder, each to a temporary name first."""
    from sandbox.report.heatmap import plot_extremes
    from sandbox.report.page.extremes_page import write_extremes

    plot_extremes(result, out)
    write_extremes(document, out / "report.html")
    write_json(document, out / "extremes.json")


@contextmanager
def _telling(silent: bool) -> Iterator[Watch | None]:
    """Yield who is told how far it is: a bar on a terminal, nobody elsewhere."""
    if silent or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn()
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        bar = bars.add_task("starting")

        def told(progress: Progress) -> None:
            text = f"{progress.cells} cells, {progress.failed} failed; {progress.what}"
            bars.update(bar, description=text, completed=progress.done, total=progress.lines)

        yield told
