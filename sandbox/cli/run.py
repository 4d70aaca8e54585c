"""`sandbox run`: headless runs, a table on the terminal, a folder of stored runs."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from sandbox.batch.outcome import Outcome, execute
from sandbox.batch.plan import Job, plan
from sandbox.batch.store import Store, StoreError
from sandbox.cli.reading import InputError, fault_rows, paths_of, print_json
from sandbox.engines.registry import UnknownEngineError
from sandbox.engines.registry import engine as engine_named
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.run import Progress
from sandbox.scene.address import AddressError
from sandbox.scene.faults import SceneError


@click.command(name="run")
@click.argument("scenes", nargs=-1, required=True)
@click.option("--engine", "--engines", "engines", default="pymunk", metavar="NAME[,NAME]", help="which engine(s)")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--sweep", "sweeps", multiple=True, metavar="KEY=A,B,C", help="run each value; or KEY=LOW:HIGH:N[:log]")
@click.option("--seeds", type=click.IntRange(1, 1_000_000), metavar="N", help="run the seeds 1 to N")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="store every run in a folder, once")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="draw the run: .png, .svg or .pdf")
@click.option("--body", "bodies", multiple=True, metavar="NAME", help="which bodies to draw")
@click.option("--audit/--no-audit", default=True, help="count the contacts that the engine misses")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="no table, no progress")
def command(
    scenes: tuple[str, ...],
    engines: str,
    overrides: tuple[str, ...],
    sweeps: tuple[str, ...],
    seeds: int | None,
    out: Path | None,
    plot: Path | None,
    bodies: tuple[str, ...],
    audit: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Run scenes headless and tell how they went. SCENES are files, or names of shipped scenes."""
    try:
        names = list(dict.fromkeys(name.strip() for name in engines.split(",")))
        for name in names:
            engine_named(name)
        jobs = plan(paths_of(scenes), names, overrides, sweeps, seeds)
        if plot is not None:
            _check_plot(plot, bodies, jobs)
        store = Store(out) if out is not None else None
    except SceneError as error:
        if as_json:
            print_json({"runs": [], "faults": fault_rows(error.faults)})
        click.echo(str(error), err=True)
        return 2
    except (UnknownEngineError, AddressError, StoreError, ValueError) as error:
        raise InputError(str(error)) from None

    outcomes: list[Outcome] = []
    status = 0
    try:
        with _progress(jobs, quiet or as_json) as told:
            for job, progress in zip(jobs, told, strict=True):
                outcomes.append(execute(job, store, progress, audit))
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(outcomes)} of {len(jobs)} runs are finished and kept", err=True)
    except TooLargeError as error:
        status = 2
        click.echo(f"{jobs[len(outcomes)].label}: {error}", err=True)
    except StoreError as error:
        status = 2
        click.echo(str(error), err=True)
    finally:
        if store is not None:
            store.close()

    for outcome in outcomes:
        if outcome.trajectory.status != "ok":
            status = status or 1
            click.echo(f"{outcome.job.label}: {outcome.trajectory.status}: {outcome.trajectory.reason}", err=True)
    if as_json:
        print_json({"runs": [outcome.row() for outcome in outcomes]})
    elif not quiet and outcomes:
        from sandbox.cli.table import print_runs

        print_runs(outcomes)
    if plot is not None and outcomes and len(outcomes[0].trajectory.time):
        from sandbox.report.plots import plot_run

        plot_run(outcomes[0].trajectory, jobs[0].scene, plot, list(bodies) or None)
        if not quiet and not as_json:
            click.echo(f"drawn: {plot}")
    return status


def _check_plot(plot: Path, bodies: tuple[str, ...], jobs: list[Job]) -> None:
    """Refuse before the run what could not be drawn after it."""
    if len(jobs) != 1:
        raise ValueError(f"--plot draws one run, but this makes {len(jobs)}")
    if plot.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise ValueError(f"--plot {plot}: the name ends in .png, .svg or .pdf")
    if not plot.absolute().parent.is_dir():
        raise ValueError(f"--plot {plot}: there is no folder {plot.parent}")
    unknown = [name for name in bodies if name not in jobs[0].scene.bodies.names]
    if unknown:
        raise ValueError(f"--body: no body is named {', '.join(map(repr, unknown))}")


@contextmanager
def _progress(jobs: list[Job], silent: bool) -> Iterator[Iterator[Progress | None]]:
    """Yield a progress callback for each job: bars on a terminal, nothing elsewhere."""
    if silent or not sys.stderr.isatty():
        yield iter([None] * len(jobs))
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn()
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        whole = bars.add_task(f"{len(jobs)} run(s)", total=float(len(jobs)))

        def callbacks() -> Iterator[Progress]:
            for k, job in enumerate(jobs):
                bars.update(whole, description=f"{k + 1}/{len(jobs)} {job.label}", completed=float(k))
                yield lambda share, k=k: bars.update(whole, completed=k + share)  # type: ignore[misc]

        yield callbacks()
