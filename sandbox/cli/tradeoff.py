"""`sandbox tradeoff`: error against cost over engines and settings, and the setting to take."""

import math
from pathlib import Path

import click

from sandbox.batch.plan import USUAL
from sandbox.cli.naming import engines_in
from sandbox.cli.output import make_folder, require_folder, require_picture, write_json
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.cli.telling import telling
from sandbox.cli.tradeoff_table import print_tradeoff
from sandbox.engines.registry import ENGINES
from sandbox.measure.compare import compare
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.tradeoff.aim import UnknownMetricError, require_aim
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.measure.tradeoff.weighed import Tradeoff
from sandbox.measure.tradeoff.weighing import EFFORT, POINTS, REPEATS, tradeoff
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import load
from sandbox.scene.files.toml_edit import write_solver
from sandbox.scene.scene import Scene

USUAL_FPS = 60.0
POSITIVE = click.FloatRange(min=0.0, min_open=True)


@click.command(name="tradeoff")
@click.argument("scene")
@click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help="engine or engines to try; default: all")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--metric",
    metavar="NAME",
    help=f"measure of the error; default: chosen from the scene. One of {', '.join(METRICS)}",
)
@click.option(
    "--tolerance", type=click.FloatRange(min=0.0), metavar="X", help="largest allowed error, in the unit of the metric"
)
@click.option("--budget", type=POSITIVE, metavar="MS", help="computing time per frame that is available, ms")
@click.option(
    "--fps",
    type=POSITIVE,
    default=USUAL_FPS,
    metavar="N",
    help="frames per second that --budget refers to; default: 60",
)
@click.option(
    "--seeds",
    type=click.IntRange(1, 1000),
    default=1,
    metavar="N",
    help="take the largest error over N seeds; default: 1",
)
@click.option("--zoom", type=POSITIVE, metavar="PX", help="pixels per metre, for the metrics in pixels")
@click.option(
    "--effort",
    type=POSITIVE,
    default=EFFORT,
    metavar="N",
    help="effort of the search, in seconds of counted work, so that every machine tries the same settings; the truth, "
    f"timing and other seeds come on top; default: {EFFORT:g}",
)
@click.option(
    "--time-limit",
    "--patience",
    "time_limit",
    type=POSITIVE,
    metavar="S",
    help="time limit of the search, s; the settings tried then depend on the machine; default: no limit",
)
@click.option(
    "--points",
    type=click.IntRange(1, 100_000),
    default=POINTS,
    metavar="N",
    help=f"largest number of settings to try; default: {POINTS}",
)
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=REPEATS,
    metavar="N",
    help=f"timings of each setting near the front; default: {REPEATS}",
)
@click.option("--write", is_flag=True, help="write the recommended [solver] into the scene file")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="write tradeoff.json and report.html")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="draw error against cost to FILE: .png, .svg or .pdf",
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("-v", "--verbose", is_flag=True, help="explain every column of the table")
@click.option("--quiet", is_flag=True, help="print no table and no progress")
def command(
    scene: str,
    engines: str | None,
    overrides: tuple[str, ...],
    metric: str | None,
    tolerance: float | None,
    budget: float | None,
    fps: float,
    seeds: int,
    zoom: float | None,
    effort: float,
    time_limit: float | None,
    points: int,
    repeats: int,
    write: bool,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Measure error against cost over engines and settings, and recommend a setting.

    SCENE is a file or the name of a shipped scene. The settings that are tried and their errors are the same on every
    machine; times are those of this machine. If the times of two settings differ by less than the timing noise, counted
    work decides which is cheaper. Exit status 1: no setting is within the tolerance or the
    budget; the nearest is shown.
    """
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    with gathering(faults, "--metric", (UnknownMetricError,)):
        require_aim(metric, None, None, USUAL_FPS)
    for flag, figures in (
        ("--tolerance", (metric if metric in METRICS else None, tolerance, None, USUAL_FPS)),
        ("--budget", (None, None, budget, USUAL_FPS)),
        ("--fps", (None, None, None, fps)),
    ):
        with gathering(faults, flag, (ValueError,)):
            require_aim(*figures)
    for flag, figure in (("--zoom", zoom), ("--effort", effort), ("--time-limit", time_limit)):
        if figure is not None and not math.isfinite(figure):
            faults.append(Fault(flag, None, "", f"is {figure:g}; it must be positive and finite"))
    read: Scene | None = None
    path = scene
    with gathering(faults):
        path = path_of(scene)
        read = load(path, overrides)
    if write and overrides:
        faults.append(
            Fault("--write", None, "", "cannot be combined with --set, because the file does not contain those changes")
        )
    elif write and read is not None:
        with gathering(faults):
            write_solver(path, {})  # changes nothing, but tells whether it could
    with gathering(faults):
        require_folder(out)
    with gathering(faults):
        require_picture(plot)
    if out is not None and not faults:
        with gathering(faults):
            make_folder(out)
    found: Tradeoff | None = None
    if read is not None and not faults:
        with gathering(faults, scene, (TooLargeError, ValueError)), telling(quiet or as_json) as told:
            found = tradeoff(
                read,
                names,
                metric=metric,
                tolerance=tolerance,
                budget=budget,
                fps=fps,
                seeds=seeds,
                zoom=zoom,
                effort=effort,
                time_limit=time_limit,
                repeats=repeats,
                most=points,
                told=told,
            )
    if found is None:
        picks = {"within_tolerance": None, "within_budget": None}
        return refused(faults, as_json, scene=scene, truth=None, metric=metric, points=[], pareto=[], **picks)
    document = found.document(scene)
    if as_json:
        print_json(document)
    elif not quiet:
        print_tradeoff(scene, found, verbose)
    status = 1 if found.within_tolerance is None or (budget is not None and found.within_budget is None) else 0
    if found.interrupted:
        click.echo(f"interrupted: the {len(found.points)} settings tried so far are kept", err=True)
        status, write = 130, False
    return max(status, _kept(found, document, path, write, out, plot, quiet or as_json))


def _kept(
    found: Tradeoff,
    document: dict[str, object],
    path: str,
    write: bool,
    out: Path | None,
    plot: Path | None,
    silent: bool,
) -> int:
    """Write what was asked for, and say so; return 2 where something cannot be written."""
    faults: list[Fault] = []
    if write and found.within_tolerance is None:
        _say(f"not written: no setting is within the tolerance, so {path} is unchanged", silent)
    elif write and found.within_tolerance is not None:
        with gathering(faults):
            changed = write_solver(path, found.within_tolerance.point.changes)
            _say(f"written: {path}" if changed else f"{path}: already has the recommended [solver]", silent)
            engine = found.within_tolerance.point.engine
            if engine != USUAL:
                _say(f"run it with --engine {engine}", silent)
    asked, written = "--plot", list[Path]()
    try:
        if plot is not None:
            from sandbox.report.work_precision import plot_tradeoff

            plot_tradeoff(document, plot)
            written.append(plot)
        asked = "--out"
        if out is not None:
            from sandbox.report.page.tradeoff_page import write_tradeoff

            write_json(document, out / "tradeoff.json")
            engines = [name for name in ENGINES if any(point.engine == name for point in found.points)]
            replayed = None if found.interrupted else compare(found.scene, engines, truth=found.best)
            if replayed is not None and replayed.interrupted:
                raise KeyboardInterrupt
            write_tradeoff(document, out / "report.html", replayed)
            written.append(out)
    except OSError as error:
        faults.append(Fault(asked, None, "", f"{error.filename}: {error.strerror}"))
    for file in written:
        _say(f"written: {file}", silent)
    for fault in faults:
        click.echo(str(fault), err=True)
    return 2 if faults else 0


def _say(text: str, silent: bool) -> None:
    if not silent:
        click.echo(text)
