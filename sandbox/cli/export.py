"""Command `export`: write a stored run as csv, parquet, gif, mp4 or png, or a scene as a pymunk program or as TOML."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from sandbox.atomic_write import atomic_write
from sandbox.batch.find_run import find_run, read_run
from sandbox.cli.common import collect_errors, exit_with_errors, fault_rows
from sandbox.cli.export_options import TABLES, Options, check_options, check_times
from sandbox.cli.options import json_option, quiet_option, set_option, takes
from sandbox.cli.progress import ProgressBars, progress_bars
from sandbox.cli.recordings import read_scene, report_remarks
from sandbox.cli.streams import print_json
from sandbox.echo import short_repr
from sandbox.formatting import format_plural
from sandbox.progress import ProgressCallback
from sandbox.recording import Recording
from sandbox.recording_remarks import remarks_on
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import dumps
from sandbox.trajectory import Trajectory

if TYPE_CHECKING:
    from sandbox.scene.compile.scene import Scene
    from sandbox.window.playback.recorded import RecordedRun


@click.command(name="export")
@click.argument("run")
@click.option(
    "--to",
    "targets",
    multiple=True,
    metavar="FILE",
    help="file to write: .csv, .parquet, .gif, .mp4 or .png, or .py or .toml from a scene; may be repeated",
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
@set_option("set a value of the scene first; for a .py or .toml only")
@click.option("--force", is_flag=True, help="replace an existing .py or .toml")
@json_option
@quiet_option("print no file names and no progress")
@takes(Options)
def export_command(options: Options) -> int:
    """Export a stored run or a recorded session as csv, parquet, gif, mp4 or png; or a scene as .py or .toml.

    RUN is DIR/ID, a folder that holds one run, a .npz file, or a session (.json). With --runs it is a folder with any
    number of runs. For a .py or .toml it is a scene, or a session, whose scene is written without its actions. The .py
    is a program that needs only pymunk, with make_space() and step() to use in a game, which computes the same states
    as the engine pymunk.
    """
    run, faults = options.run, list[Fault]()
    with collect_errors(faults):
        check_options(options)
    if options.has_program:
        return _export_program(options, faults)
    if options.runs:
        return _export_runs(options, faults)
    source: Trajectory | Recording | None = None
    with collect_errors(faults):
        source = read_run(find_run(run), run)
    if source is not None:
        end = source.duration if isinstance(source, Recording) else float(source.time[-1]) if len(source.time) else None
        with collect_errors(faults):
            check_times(options, end)
    if source is None or faults:
        return exit_with_errors(faults, options.as_json, run=run, files=[])

    files: list[dict[str, Any]] = []
    status = 0
    try:
        with collect_errors(faults), progress_bars(options.is_silent) as bars:
            status, trajectory = _trajectory(run, source, bars)
            if len(trajectory.time):
                _export(run, options, trajectory, files, bars)
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
    remarks = remarks_on(source) if isinstance(source, Recording) else ()
    report_remarks(run, remarks)
    _print_files(options, files, faults, remarks)
    return 2 if faults else status


def _print_files(
    options: Options,
    files: list[dict[str, Any]],
    faults: list[Fault],
    remarks: Sequence[str] = (),
) -> None:
    if options.as_json:
        more: dict[str, Any] = {"faults": fault_rows(faults)} if faults else {}
        print_json({"run": options.run, "files": files} | more | ({"remarks": remarks} if remarks else {}))
    elif not options.quiet:
        for file in files:
            counts = [format_plural(file[f"{noun}s"], noun) for noun in ("row", "frame", "line") if f"{noun}s" in file]
            click.echo(f"written: {file['path']} ({counts[0]})")


def _export_program(options: Options, faults: list[Fault]) -> int:
    """Write a scene as a program or as TOML, and return the exit status."""
    name, texts = options.run, dict[str, str]()
    remarks: tuple[str, ...] = ()
    divided: tuple[str, ...] = ()
    with collect_errors(faults):
        _, scene, remarks = read_scene(name, options.overrides)
        if not faults:
            for kind in options.suffixes:
                if kind == ".py":
                    texts[kind], divided = _program_text(name, scene)
                else:
                    texts[kind] = dumps(scene)
    if faults:
        return exit_with_errors(faults, options.as_json, run=name, files=[])
    files: list[dict[str, Any]] = []
    for target in options.targets:
        kind = Path(target).suffix.lower()
        text = texts[kind]
        try:
            with atomic_write(Path(target)) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            faults.append(Fault.of("--to", f"{target}: {error.strerror or error}"))
            click.echo(str(faults[-1]), err=True)
        else:
            files.append({"path": target, "format": kind[1:], "lines": text.count("\n")})
            if divided and kind == ".py":
                files[-1]["divided_walls"] = list(divided)
    report_remarks(name, remarks)
    _print_files(options, files, faults, remarks)
    if files and divided and not options.is_silent:
        click.echo(f"note: {_note_of_division(divided)}")
    return 2 if faults else 0


def _note_of_division(names: Sequence[str]) -> str:
    """Return how the states of a program with divided walls differ from those of its scene."""
    walls = f"wall{'s' if len(names) > 1 else ''} {', '.join(map(short_repr, names))}"
    return (
        f"{walls}: divided into walls of two points. The states are those of the scene with divided walls, bit for "
        "bit. In the scene itself, the sandbox corrects the normals of contacts where segments join, which pymunk "
        "cannot: its states differ after the first contact there, and in the program a box may catch on a joint."
    )


def _program_text(name: str, scene: "Scene") -> tuple[str, tuple[str, ...]]:
    """Return the program of a scene, with the warnings of `check`, and the names of the walls that it divides.

    Raises:
        SceneError: a program cannot express the scene; the error has all reasons.
    """
    from sandbox.measure.preflight import floor_3_digits, largest_safe_dt, run_preflight
    from sandbox.pymunk_export import obstacles, program_text, with_divided_walls

    found = obstacles(scene, divides_walls=True)
    if found:
        raise SceneError([Fault(name, None, each.path, each.message) for each in found])
    scene, divided = with_divided_walls(scene)
    _hide_pygame_prompt()
    from sandbox.window.view_bounds import predict_bounds, view_bounds

    warnings = [each.message for each in run_preflight(scene, engine="pymunk").warnings]
    safe_dt, reason = largest_safe_dt(scene, engine="pymunk"), ""
    if safe_dt is not None and np.isfinite(safe_dt):
        reason = f"With this number of substeps, no body of the scene can do so up to DT = {floor_3_digits(safe_dt)}."
    view = view_bounds(scene, predict_bounds(scene, "pymunk"))
    note = f"Note: {_note_of_division(divided)}" if divided else ""
    return program_text(scene, view=view, step_reason=reason, warnings=warnings, note=note), divided


def _export_runs(options: Options, faults: list[Fault]) -> int:
    """Write a table of all runs of a folder, and return the exit status."""
    from sandbox.batch.query import open_store
    from sandbox.batch.store import StoreError

    folder = options.run
    if faults:
        return exit_with_errors(faults, options.as_json, run=folder, files=[])
    files: list[dict[str, Any]] = []
    with collect_errors(faults, folder, (StoreError,)), open_store(folder) as runs:
        if not len(runs):
            faults.append(Fault.of(folder, "contains no run"))
        for target in options.targets if len(runs) else ():
            is_csv = Path(target).suffix.lower() == ".csv"
            try:
                count = runs.to_csv(target) if is_csv else runs.to_parquet(target)
            except OSError as error:
                faults.append(Fault.of("--to", f"{target}: {error.strerror or error}"))
            else:
                files.append({"path": target, "format": Path(target).suffix.lower()[1:], "rows": count})
    faults = [replace(fault, message=fault.message.removeprefix(f"{folder}: ")) for fault in faults]
    for fault in faults:
        click.echo(str(fault), err=True)
    _print_files(options, files, faults)
    return 2 if faults else 0


def _trajectory(run: str, source: Trajectory | Recording, bars: ProgressBars) -> tuple[int, Trajectory]:
    """Return the exit status, 1 if the run failed, and the stored run, or a new run of the session.

    Raises:
        SceneError: the session cannot be run here.
    """
    if isinstance(source, Trajectory):
        return 0, source
    from sandbox.engines.registry import UnknownEngineError
    from sandbox.games.contract import UnsuitableSceneError
    from sandbox.measure.run.recorder import TooLargeError
    from sandbox.measure.run.sessions import rerun

    try:
        trajectory = rerun(source, audit=False, on_progress=bars.callback(f"running {run}"))
    except (UnknownEngineError, TooLargeError, UnsuitableSceneError) as error:
        raise SceneError([Fault.of(run, str(error))]) from None
    if trajectory.status == "ok" or not len(trajectory.time):
        return 0, trajectory
    click.echo(f"{run}: {trajectory.status}: {trajectory.reason}", err=True)
    return 1, trajectory


def _export(
    run: str, options: Options, trajectory: Trajectory, files: list[dict[str, Any]], bars: ProgressBars
) -> None:
    """Write all files, and add each to the list when it is complete.

    Raises:
        SceneError: a file cannot be written, or the run is damaged.
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
        frames = _export_images(options, film, path, bars.callback(f"drawing {target}"))
        files.append({"path": target, "format": kind[1:], "frames": frames})


def _write_table(run: str, options: Options, trajectory: Trajectory, path: Path) -> int:
    from sandbox.report.table_export import write_contacts, write_states

    part = _between(trajectory, options)
    try:
        if not options.contacts:
            return write_states(part, path)
        return write_contacts(part, _fixed_names(run, trajectory), path)
    except OSError as error:
        raise SceneError([Fault.of("--to", f"{path}: {error.strerror or error}")]) from None


def _fixed_names(run: str, trajectory: Trajectory) -> tuple[str, ...]:
    """Return the names of the static bodies of a run."""
    from sandbox.scene.files.load import from_session

    return from_session(trajectory.info["scene"], run).fixed_names


def _between(run: Trajectory, options: Options) -> Trajectory:
    """Return the frames and contacts within the requested interval of time, as views."""
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
    _hide_pygame_prompt()
    from sandbox.window.playback.recorded import RecordedRun

    return RecordedRun(trajectory, run)


def _hide_pygame_prompt() -> None:
    """Keep pygame from printing: only results are on standard output."""
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")


def _export_images(options: Options, film: "RecordedRun", path: Path, on_progress: ProgressCallback | None) -> int:
    from sandbox.window.capture.export import ExportOptions, export_images
    from sandbox.window.capture.image_files import PictureError

    is_png = path.suffix.lower() == ".png"
    last = film.duration if options.until is None else min(options.until, film.duration)
    if is_png and options.at is not None:
        last = min(options.at, film.duration)
    export_options = ExportOptions(
        start=min(options.start or 0.0, last),
        end=last,
        size=options.picture_size,
        fps=options.fps or 30.0,
        speed=options.speed or 1.0,
        overlays=frozenset({"shapes", *options.overlays}),
    )
    try:
        return export_images(film, export_options, path, on_progress)
    except PictureError as error:
        raise SceneError([Fault.of("--to", f"{path}: {error}")]) from None
