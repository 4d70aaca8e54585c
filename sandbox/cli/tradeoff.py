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
from sandbox.scene.faults import Fault
from sandbox.scene.file import load
from sandbox.scene.model import Scene
from sandbox.scene.rewrite import write_solver

USUAL_FPS = 60.0
POSITIVE = click.FloatRange(min=0.0, min_open=True)


@click.command(name="tradeoff")
@click.argument("scene")
@click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help="which engine(s); by default all")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--metric", metavar="NAME", help=f"what the error is counted in: {', '.join(METRICS)}")
@click.option("--tolerance", type=click.FloatRange(min=0.0), metavar="X", help="error that is allowed, in its unit")
@click.option("--budget", type=POSITIVE, metavar="MS", help="milliseconds a frame that may be spent")
@click.option(
    "--fps", type=POSITIVE, default=USUAL_FPS, metavar="N", help="frames a second of the budget; by default 60"
)
@click.option("--seeds", type=click.IntRange(1, 1000), default=1, metavar="N", help="errors are the worst of N seeds")
@click.option("--zoom", type=POSITIVE, metavar="PX", help="pixels a metre, for errors on the screen")
@click.option(
    "--effort",
    type=POSITIVE,
    default=EFFORT,
    metavar="N",
    help="counted work of the search: the same settings are tried on every machine; the whole command takes some 5 s "
    f"for each 1 of it; by default {EFFORT:g}",
)
@click.option(
    "--time-limit",
    "--patience",
    "time_limit",
    type=POSITIVE,
    metavar="S",
    help="s after which nothing more is tried; what is tried then depends on the machine; by default none",
)
@click.option(
    "--points",
    type=click.IntRange(1, 100_000),
    default=POINTS,
    metavar="N",
    help=f"most settings to try; by default {POINTS}",
)
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=REPEATS,
    metavar="N",
    help=f"timings of each setting near the front; by default {REPEATS}",
)
@click.option("--write", is_flag=True, help="put the recommended [solver] into the scene file")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="write tradeoff.json and a report page")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="draw it: .png, .svg or .pdf")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="no table, no progress")
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
    quiet: bool,
) -> int:
    """Measure error against cost over engines and settings. SCENE is a file or a shipped one.

    The settings that are tried and their errors are the same on every machine. The times are of this machine; where two
    settings are within its noise, counted work decides which is the cheaper. Exit status 1: no setting that was tried
    is within the tolerance, or within the budget; the nearest is shown.
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
            faults.append(Fault(flag, None, "", f"is {figure:g}; it is positive and finite"))
    read: Scene | None = None
    path = scene
    with gathering(faults):
        path = path_of(scene)
        read = load(path, overrides)
    if write and overrides:
        faults.append(Fault("--write", None, "", "the file lacks what --set changes; leave one of the two out"))
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
        print_tradeoff(scene, found)
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
        _say(f"not written: {path} stays as it is, as no setting that was tried is within the tolerance", silent)
    elif write and found.within_tolerance is not None:
        with gathering(faults):
            changed = write_solver(path, found.within_tolerance.point.changes)
            _say(f"written: {path}" if changed else f"{path}: has the recommended [solver] already", silent)
            engine = found.within_tolerance.point.engine
            if engine != USUAL:
                _say(f"run it with --engine {engine}", silent)
    asked = "--plot"
    try:
        if plot is not None:
            from sandbox.report.work_precision import plot_tradeoff

            plot_tradeoff(document, plot)
            _say(f"written: {plot}", silent)
        asked = "--out"
        if out is not None:
            from sandbox.report.page.tradeoff_page import write_tradeoff

            write_json(document, out / "tradeoff.json")
            engines = [name for name in ENGINES if any(point.engine == name for point in found.points)]
            replayed = None if found.interrupted else compare(found.scene, engines, truth=found.best)
            write_tradeoff(document, out / "report.html", replayed)
            _say(f"written: {out}", silent)
    except OSError as error:
        faults.append(Fault(asked, None, "", f"{error.filename}: {error.strerror}"))
    for fault in faults:
        click.echo(str(fault), err=True)
    return 2 if faults else 0


def _say(text: str, silent: bool) -> None:
    if not silent:
        click.echo(text)
