"""`sandbox export`: a stored run as csv, parquet, gif, mp4 or png."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from sandbox.cli.exporting import TABLES, Options, check_options, check_times
from sandbox.cli.reading import fault_rows, gathering, print_json, refused
from sandbox.cli.stored import find_run, read_run
from sandbox.measure.run import Progress
from sandbox.recording import Recording
from sandbox.scene.errors import Fault, SceneError
from sandbox.trajectory import Trajectory

if TYPE_CHECKING:
    from sandbox.window.playback.recorded import RecordedRun


@click.command(name="export")
@click.argument("run")
@click.option(
    "--to",
    "targets",
    multiple=True,
    metavar="FILE",
    help="file to write: .csv, .parquet, .gif, .mp4 or .png; may be repeated",
)
@click.option("--runs", is_flag=True, help="write a table of all runs of the folder DIR, one row per run")
@click.option("--contacts", is_flag=True, help="write tables of contacts instead of states")
@click.option("--fps", type=float, metavar="N", help="frames per second of a film; default: 30")
@click.option("--width", type=int, metavar="PX", help="width of the picture in pixels, at 16:9; default: 960")
@click.option("--size", metavar="WxH", help="size of the picture in pixels, such as 960x540")
@click.option("--speed", type=float, metavar="X", help="speed of a film; default: 1, real time")
@click.option(
    "--from", "start", type=float, metavar="SECONDS", help="start of the export; default: the start of the run"
)
@click.option("--until", type=float, metavar="SECONDS", help="end of the export; default: the end of the run")
@click.option("--at", type=float, metavar="SECONDS", help="time of a png; default: the end of the run")
@click.option(
    "--overlay", "overlays", multiple=True, metavar="NAME", help="overlay to draw, such as velocities; may be repeated"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="print no file names and no progress")
def command(run: str, as_json: bool, quiet: bool, **given: Any) -> int:
    """Export a stored run or a recorded session as csv, parquet, gif, mp4 or png.

    RUN is DIR/ID, a folder that holds one run, a .npz file, or a session (.json). With --runs it is a folder with any
    number of runs.
    """
    options = Options(**given)
    faults: list[Fault] = []
    with gathering(faults):
        check_options(options)
    if options.runs:
        return _export_runs(run, options, faults, as_json, quiet)
    source: Trajectory | Recording | None = None
    with gathering(faults):
        source = read_run(find_run(run), run)
    if source is not None:
        end = source.duration if isinstance(source, Recording) else float(source.time[-1]) if len(source.time) else None
        with gathering(faults):
            check_times(options, end)
    if source is None or faults:
        return refused(faults, as_json, run=run, files=[])

    files: list[dict[str, Any]] = []
    status = 0
    try:
        with gathering(faults), _progress(quiet or as_json) as told:
            status, trajectory = _trajectory(run, source, told)
            if len(trajectory.time):
                _export(run, options, trajectory, files, told)
            else:
                click.echo(
                    f"{run}: {trajectory.status}: {trajectory.reason}; the run has no frames to export", err=True
                )
                status = 1
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(files)} of {len(options.targets)} files are complete and kept", err=True)
    for fault in faults:
        click.echo(str(fault), err=True)
    _print_files(run, files, faults, as_json, quiet)
    return 2 if faults else status


def _print_files(run: str, files: list[dict[str, Any]], faults: list[Fault], as_json: bool, quiet: bool) -> None:
    if as_json:
        print_json({"run": run, "files": files} | ({"faults": fault_rows(faults)} if faults else {}))
    elif not quiet:
        for file in files:
            count = f"{file['rows']:,} rows" if "rows" in file else f"{file['frames']:,} frames"
            click.echo(f"written: {file['path']} ({count.removesuffix('s') if count[:2] == '1 ' else count})")


def _export_runs(folder: str, options: Options, faults: list[Fault], as_json: bool, quiet: bool) -> int:
    """Write a table of all runs of a folder, and return the exit status."""
    from sandbox.batch.run_table import run_table
    from sandbox.batch.store import DATABASE, Store, StoreError
    from sandbox.report.tables import write_rows

    if not (Path(folder) / DATABASE).is_file():
        message = "is no folder of stored runs; `sandbox run SCENE --out DIR` makes one"
        faults.append(Fault(folder, None, "", message))
    if faults:
        return refused(faults, as_json, run=folder, files=[])
    files: list[dict[str, Any]] = []
    try:
        with Store(folder, notice=lambda message: click.echo(message, err=True)) as store:
            rows = run_table(store)
    except StoreError as error:
        rows = []
        faults.append(Fault(folder, None, "", str(error).removeprefix(f"{folder}: ")))
    if not rows and not faults:
        faults.append(Fault(folder, None, "", "contains no run"))
    for target in options.targets if rows else ():
        try:
            count = write_rows(rows, Path(target))
        except OSError as error:
            faults.append(Fault("--to", None, "", f"{target}: {error.strerror or error}"))
        else:
            files.append({"path": target, "format": Path(target).suffix.lower()[1:], "rows": count})
    for fault in faults:
        click.echo(str(fault), err=True)
    _print_files(folder, files, faults, as_json, quiet)
    return 2 if faults else 0


def _trajectory(run: str, source: Trajectory | Recording, told: "Told") -> tuple[int, Trajectory]:
    """Return a stored run, or run a session; and status 1 where that did not go well.

    Raises:
        SceneError: the session cannot be run here.
    """
    if isinstance(source, Trajectory):
        return 0, source
    from sandbox.engines.registry import UnknownEngineError
    from sandbox.games.contract import UnsuitableSceneError
    from sandbox.measure.recorder import TooLargeError
    from sandbox.measure.replay import rerun

    try:
        trajectory = rerun(source, audit=False, progress=told(f"running {run}"))
    except (UnknownEngineError, TooLargeError, UnsuitableSceneError) as error:
        raise SceneError([Fault(run, None, "", str(error))]) from None
    if trajectory.status == "ok" or not len(trajectory.time):
        return 0, trajectory
    click.echo(f"{run}: {trajectory.status}: {trajectory.reason}", err=True)
    return 1, trajectory


def _export(run: str, options: Options, trajectory: Trajectory, files: list[dict[str, Any]], told: "Told") -> None:
    """Write every file, and enter each in the list once it is complete.

    Raises:
        SceneError: one cannot be written, or the run is damaged.
    """
    film: RecordedRun | None = None
    for target in options.targets:
        path = Path(target)
        kind = path.suffix.lower()
        if kind in TABLES:
            rows = _write_table(run, options, trajectory, path)
            files.append({"path": target, "format": kind[1:], "rows": rows})
            continue
        film = film or _film(run, trajectory)
        frames = _shoot(options, film, path, told(f"drawing {target}"))
        files.append({"path": target, "format": kind[1:], "frames": frames})


def _write_table(run: str, options: Options, trajectory: Trajectory, path: Path) -> int:
    from sandbox.report.tables import write_contacts, write_states

    part = _between(trajectory, options)
    try:
        if not options.contacts:
            return write_states(part, path)
        return write_contacts(part, _fixed_names(run, trajectory), path)
    except OSError as error:
        raise SceneError([Fault("--to", None, "", f"{path}: {error.strerror or error}")]) from None


def _fixed_names(run: str, trajectory: Trajectory) -> tuple[str, ...]:
    """Return the names of a run's fixed things."""
    from sandbox.scene.files.load import from_session

    return from_session(trajectory.info["scene"], run).fixed_names


def _between(run: Trajectory, options: Options) -> Trajectory:
    """Return the frames and contacts of the time asked for, without copying them."""
    if options.start is None and options.until is None:
        return run
    limits = options.start or 0.0, np.inf if options.until is None else options.until

    def part(times: np.ndarray[Any, np.dtype[np.float64]], *names: str) -> dict[str, Any]:
        begin, end = np.searchsorted(times, limits[0], "left"), np.searchsorted(times, limits[1], "right")
        return {name: getattr(run, name)[begin:end] for name in names}

    states = part(run.time, "time", "position", "velocity", "angle", "angular_velocity")
    touches = part(
        run.contact_time, "contact_time", "contact_pair", "contact_point", "contact_normal", "contact_impulse"
    )
    return replace(run, **states, **touches)


def _film(run: str, trajectory: Trajectory) -> "RecordedRun":
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # standard output is for what was asked
    from sandbox.window.playback.recorded import RecordedRun

    return RecordedRun(trajectory, run)


def _shoot(options: Options, film: "RecordedRun", path: Path, progress: Progress | None) -> int:
    from sandbox.window.capture.export import ExportOptions, export_images
    from sandbox.window.capture.image_files import CaptureError

    still = path.suffix.lower() == ".png"
    last = film.duration if options.until is None else min(options.until, film.duration)
    if still and options.at is not None:
        last = min(options.at, film.duration)
    shot = ExportOptions(
        start=min(options.start or 0.0, last),
        end=last,
        size=options.picture_size,
        fps=options.fps or 30.0,
        speed=options.speed or 1.0,
        overlays=frozenset({"shapes", *options.overlays}),
    )
    try:
        return export_images(film, shot, path, progress)
    except CaptureError as error:
        raise SceneError([Fault("--to", None, "", f"{path}: {error}")]) from None


class Told:
    """Who is told how far each part of the work is."""

    def __init__(self, bars: Any = None) -> None:
        self._bars = bars

    def __call__(self, what: str) -> Progress | None:
        """Begin a part of the work; return whom to tell its progress."""
        if self._bars is None:
            return None
        bar = self._bars.add_task(what, total=1.0)
        return lambda share: self._bars.update(bar, completed=share)


@contextmanager
def _progress(silent: bool) -> Iterator[Told]:
    """Yield who is told: bars on a terminal, nobody elsewhere."""
    if silent or not sys.stderr.isatty():
        yield Told()
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn()
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        yield Told(bars)
