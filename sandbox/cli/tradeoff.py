"""Command `tradeoff` and its tables."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    make_folder,
    parse_engines,
    require_folder,
    require_plot_file,
    write_json,
)
from sandbox.cli.options import (
    NOT_NEGATIVE,
    POSITIVE,
    OutputOptions,
    engines_option,
    json_option,
    out_option,
    plot_option,
    quiet_option,
    set_option,
    takes,
    time_limit_option,
    verbose_option,
)
from sandbox.cli.progress import status_line
from sandbox.cli.recordings import is_recording, read_scene, report_remarks
from sandbox.cli.starts import margin_option, recommendation_starts_option, spread_option, starts_text
from sandbox.cli.streams import print_json
from sandbox.cli.tables import (
    add_columns,
    add_value_columns,
    cell_text,
    heads_of,
    new_table,
    print_legend,
    print_line,
    print_table,
)
from sandbox.columns import TRUTH, Column, shown
from sandbox.echo import shorten
from sandbox.engines.registry import ENGINES, USUAL
from sandbox.formatting import UNKNOWN, format_quantity
from sandbox.measure.compare import compare
from sandbox.measure.compare.columns import END_ABOUT, ends_text
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.fresh_starts import MIN_QUANTILE_STARTS
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.error_budget import ErrorBudget
from sandbox.measure.tradeoff.objective import UnknownMetricError, check_objective
from sandbox.measure.tradeoff.recommendation import FRAME_TOLERANCE, format_value, label, pymunk_lines
from sandbox.measure.tradeoff.result import Tradeoff, shown_of
from sandbox.measure.tradeoff.study import DEFAULT_EFFORT, DEFAULT_REPEATS, MAX_POINTS, tradeoff
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.solver_in_file import write_solver
from sandbox.scene.files.toml_changes import written

ROUNDING = 1e-12
"""m; a part of an error below this is a rounding error, as coordinates of up to 1 km are exact to 1e-13 m."""
MAX_REASONS = 3
"""Failures listed with their reason."""
LEGEND = {
    "scene": "the setting in the scene file",
    "front": "no other setting is both cheaper and more accurate",
    "cheapest": "the cheapest setting within the tolerance",
    "best": "the most accurate setting within the budget",
}
IS_TRUTH = "the engine with this setting gives the truth, so that its error is 0"
"""Meaning of `TRUTH` in place of an error"""
LONG = ">frame"
"""Mark of settings that are not recommended, because their dt is longer than a frame."""


CODE = "    "
"""Indentation of lines to paste into a file, which no terminal folds"""
SETTING_COLUMNS = 4
"""Number of columns that name a setting: engine, dt, substeps, iterations"""


def _columns(found: Tradeoff) -> list[Column[Evaluation]]:
    """Return the columns of the table."""
    unit = f", {found.metric.unit}" if found.metric.unit else ""
    cost = "computing time per simulated second on this machine, ms: the {} of the timings"
    iterations = "iterations of the contact solver per substep"
    return [
        Column("engine", "the physics engine", lambda point: point.engine, "text"),
        Column("dt", "time step of a frame, s", lambda point: point.settings.dt, "time"),
        Column("substeps", "solver steps per frame", lambda point: point.settings.substeps, "count"),
        Column("iterations", iterations, lambda point: point.settings.iterations, "count"),
        Column("other settings", "further changes of [solver]", _other_settings, "text", is_optional=True),
        Column(f"{found.metric.name}{unit}", f"{found.metric.about}{unit}", _error),
        Column(
            f"median{unit}", "median of the errors from fresh starts", _start_error("median_error"), is_optional=True
        ),
        Column(f"95 %{unit}", "95 % quantile of these errors", _start_error("error_95"), is_optional=True),
        Column("starts", "number of these starts", _start_count, "count", is_optional=True, is_detail=True),
        Column("end differs in", END_ABOUT, lambda point: ends_text(point.end_statistics), "text", is_optional=True),
        Column("ms/s minimum", cost.format("smallest"), lambda point: point.cost, "time"),
        Column("ms/s median", cost.format("median"), lambda point: point.cost_median, "time", is_detail=True),
    ]


def print_tradeoff(scene: str, found: Tradeoff, verbose: bool = False) -> None:
    """Print the metric, the front and the error budget of each engine, and the recommended settings.

    Args:
        scene: the scene as the user named it.
        found: the trade-off.
        verbose: print and explain all columns, and explain every mark.
    """
    from rich.text import Text

    table, rows = new_table(), _rows(found)
    columns = shown(_columns(found), rows, verbose)
    add_value_columns(table, columns)
    add_columns(table, [""])
    for point in rows:
        marks = [*_marks(point, found), *([LONG] if point.settings.dt > found.max_dt else [])]
        table.add_row(*(cell_text(column, point) for column in columns), Text(" ".join(marks), style="green"))
    name = f"{scene} ({found.scene.title})" if found.scene.title else scene
    print_line(f"{name}: {found.error_about}")
    if found.margin_about:
        print_line(found.margin_about)
    if found.ends_about:
        print_line(found.ends_about)
    print_line(_about(found))
    print_line(starts_text(found))
    if rows:
        print_table(table, keys=SETTING_COLUMNS)
        if verbose:
            meanings = {column.head: column.about for column in columns} | LEGEND | {TRUTH: IS_TRUTH}
            print_legend([*heads_of(table), *LEGEND, *([TRUTH] if any(p.is_truth for p in rows) else [])], meanings)
        else:
            print_line(_legend(rows, found))
        if found.starts > 1 and not (found.interrupted or found.out_of_time):
            print_line(_starts_legend(rows))
        if any(point.settings.dt > found.max_dt for point in rows):
            print_line(_long_legend(found))
    splits = [_split(each, found) for each in found.splits if each.total >= ROUNDING]
    proposed = [each.sentence for each in found.proposals]
    for line in [*_failures(found), *splits, *found.sentences, *_notes(found), *proposed]:
        print_line(line)
    for line in _solver(found):
        (click.echo if line.startswith(CODE) else print_line)(line)


def _rows(found: Tradeoff) -> list[Evaluation]:
    """Return the settings of the table: of the front of each engine up to `MAX_FRONT`, and those with another mark.

    They are ordered by engine and cost.
    """
    rows = [point for front in found.fronts().values() for point in shown_of(front)]
    marked = (point for point in found.points if point.status == "ok" and set(_marks(point, found)) - {"front"})
    rows += [point for point in marked if not any(point is row for row in rows)]
    order = list(found.fronts())
    return sorted(rows, key=lambda each: (order.index(each.engine), each.cost or 0.0))


def _about(found: Tradeoff) -> str:
    ended = "; the time limit ended the search, so another run may try other settings" if found.out_of_time else ""
    count = len(found.points)
    return f"{count} setting{'s' if count != 1 else ''} tried{ended}"


def _marks(point: Evaluation, found: Tradeoff) -> list[str]:
    picks = {"cheapest": found.within_tolerance, "best": found.within_budget}
    marks = ["scene"] if point.is_own else []
    marks += ["front"] if any(point is each for each in found.pareto) else []
    return marks + [name for name, pick in picks.items() if pick is not None and pick.point is point]


def _legend(rows: Sequence[Evaluation], found: Tradeoff) -> str:
    used = {mark for point in rows for mark in _marks(point, found)}
    repeats = max(point.repeats for point in rows)
    times = f"minimum of {repeats} timings" if repeats else "from the run that was scored"
    marks = "".join(f"; {mark}: {meaning}" for mark, meaning in LEGEND.items() if mark in used)
    marks += f"; {TRUTH}: {IS_TRUTH}" if any(point.is_truth for point in rows) else ""
    return f"ms/s: milliseconds of computing per simulated second on this machine, {times}{marks}"


def _starts_legend(rows: Sequence[Evaluation]) -> str:
    """Return from how many fresh starts the rows were run, and why some were not."""
    counts = sorted(filter(None, map(_start_count, rows)))
    cause = "their runs and truths take more than a part of the effort (--effort)"
    if not counts:
        return f"no errors from fresh starts: {cause}"
    span = f"{counts[0]}" if counts[0] == counts[-1] else f"{counts[0]} to {counts[-1]}"
    text = f"median, 95 %: of the errors from {span} fresh starts"
    text += "" if counts[0] >= MIN_QUANTILE_STARTS else f"; of fewer than {MIN_QUANTILE_STARTS}, 95 % is the largest"
    return text if len(counts) == len(rows) else f"{text}; {UNKNOWN}: {cause}"


def _long_legend(found: Tradeoff) -> str:
    exception = " and than the dt of the scene" if found.max_dt > FRAME_TOLERANCE / found.fps else ""
    return f"{LONG}: dt is longer than a frame at {found.fps:g} fps{exception}, so the setting is not recommended"


def _error(point: Evaluation) -> float | str | None:
    return TRUTH if point.is_truth else point.error


def _start_error(quantile: str) -> Callable[[Evaluation], float | str | None]:
    """Return the value of a column of errors from fresh starts; infinite where too many runs failed."""

    def value(point: Evaluation) -> float | str | None:
        if point.fresh_starts is None:
            return None
        error: float | None = getattr(point.fresh_starts, quantile)
        return TRUTH if point.is_truth and error == 0.0 else math.inf if error is None else error

    return value


def _start_count(point: Evaluation) -> int | None:
    return None if point.fresh_starts is None else point.fresh_starts.held.trials


def _other_settings(point: Evaluation) -> str:
    """Return the changes of a setting that have no column."""
    return ", ".join(
        f"no {key}" if value is None else f"{key} {format_value(value)}"
        for key, value in point.changes.items()
        if key not in {"dt", "substeps", "iterations"}
    )


def _failures(found: Tradeoff) -> list[str]:
    failed = [point for point in found.points if point.status != "ok"]
    counted = Counter(point.status for point in failed)
    lines = [f"{count} {status}" for status, count in counted.items()]
    reasons = [f"{label(p)} {p.status}: {p.reason}" for p in failed[:MAX_REASONS]]
    skipped = [f"{found.untried} skipped because they would have taken too long"] if found.untried else []
    summary = ", ".join([*lines, *skipped])
    return ([summary] if summary else []) + reasons


def _split(each: ErrorBudget, found: Tradeoff) -> str:
    parts = (
        f"{_part(each.time_step)} from the time step and {_part(each.solver)} from the iterations; "
        f"{_part(each.residual)} are left with {each.substep_factor} times the substeps "
        f"({_part(each.residual_before)} with {each.substep_factor // 2} times)"
    )
    trusted = found.scene.world.duration if found.best is None else found.best.trusted_until
    until = f", while the truth is trusted ({trusted:.3g} s)" if trusted < found.scene.world.duration else ""
    return (
        f"position error of {each.engine} with the settings of the scene{until}: {_part(each.total)}, of which {parts}"
    )


def _part(metres: float) -> str:
    """Return a part of an error as text; rounding errors are 0."""
    return "0" if metres < ROUNDING else format_quantity(metres, "m")


def _notes(found: Tradeoff) -> list[str]:
    """Return the warnings for the recommended settings, each once, with the settings that it concerns."""
    picks = [found.within_tolerance or found.nearest_to_tolerance, found.within_budget or found.nearest_to_budget]
    picks += found.cheapest_by_engine.values()
    concerned: dict[str, dict[str, None]] = {}
    for pick in filter(None, picks):
        for warning in pick.warnings:
            concerned.setdefault(warning.message, {})[label(pick.point)] = None
    return [f"note: {' and '.join(names)}: {message}" for message, names in concerned.items()]


def _solver(found: Tradeoff) -> list[str]:
    """Return the recommended `[solver]`, and the lines of Python for the cheapest setting of pymunk."""
    lines = []
    if found.within_tolerance is not None:
        point = found.within_tolerance.point
        values = [f"{key} = {written(value)}" for key, value in point.changes.items() if value is not None]
        dropped = [f"# without {key}" for key, value in point.changes.items() if value is None]
        if values or dropped:
            block = _indented(["[solver]", *values, *dropped])
            lines += ["", f"recommended changes to the scene file, for --engine {point.engine}:", *block]
    pymunk = found.cheapest_by_engine.get("pymunk")
    if pymunk is not None:
        head = "the cheapest pymunk setting within the tolerance, as code for a program that uses pymunk:"
        lines += ["", head, *_indented(pymunk_lines(pymunk.point.settings))]
    return lines


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"{CODE}{line}" for line in lines]


DEFAULT_FPS = 60.0


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scene: str
    engines: str | None
    overrides: tuple[str, ...]
    metric: str | None
    tolerance: float | None
    margin: float
    budget: float | None
    fps: float
    starts: int
    spread: float
    zoom: float | None
    effort: float
    time_limit: float | None
    points: int
    repeats: int
    write: bool
    out: Path | None
    plot: Path | None
    verbose: bool


@click.command(name="tradeoff")
@click.argument("scene")
@engines_option("all", "try")
@set_option()
@click.option(
    "--metric",
    metavar="NAME",
    help=f"measure of the error; default: chosen from the scene. One of {', '.join(METRICS)}",
)
@click.option("--tolerance", type=NOT_NEGATIVE, metavar="X", help="largest allowed error, in the unit of the metric")
@margin_option
@click.option("--budget", type=POSITIVE, metavar="MS", help="computing time per frame that is available, ms")
@click.option(
    "--fps",
    type=POSITIVE,
    default=DEFAULT_FPS,
    metavar="N",
    help="frames per second that --budget refers to; default: 60",
)
@recommendation_starts_option
@spread_option
@click.option("--zoom", type=POSITIVE, metavar="PX", help="pixels per metre, for the metrics in pixels")
@click.option(
    "--effort",
    type=POSITIVE,
    default=DEFAULT_EFFORT,
    metavar="N",
    help="effort of the search, in seconds of counted work, so that every machine tries the same settings; the truth, "
    f"timing and other starts come on top; default: {DEFAULT_EFFORT:g}",
)
@time_limit_option("time limit of the search, s; the settings tried then depend on the machine; default: no limit")
@click.option(
    "--points",
    type=click.IntRange(1, 100_000),
    default=MAX_POINTS,
    metavar="N",
    help=f"largest number of settings to try; default: {MAX_POINTS}",
)
@click.option(
    "--repeats",
    type=click.IntRange(1, 1000),
    default=DEFAULT_REPEATS,
    metavar="N",
    help=f"timings of each setting near the front; default: {DEFAULT_REPEATS}",
)
@click.option("--write", is_flag=True, help="write the recommended [solver] into the scene file")
@out_option("write tradeoff.json and report.html")
@plot_option("draw error against cost to FILE: .png, .svg or .pdf")
@json_option
@verbose_option
@quiet_option()
@takes(_Options)
def tradeoff_command(options: _Options) -> int:
    """Measure error against cost over engines and settings, and recommend a setting.

    SCENE is a file, the name of a shipped scene, or a recorded session (.json), whose scene is measured without its
    actions; `sandbox advise` also runs settings with them. The settings that are tried and their errors are the same on
    every machine; times are those of this machine. If the times of two settings differ by less than the timing noise,
    counted work decides which is cheaper. Exit status 1: no setting is within the tolerance or the budget; the nearest
    is shown.
    """
    faults: list[Fault] = []
    names = parse_engines(options.engines, faults)
    _check_metric(options, faults)
    path, read, remarks = _read(options, faults)
    found: Tradeoff | None = None
    if read is not None and not faults:
        with (
            collect_errors(faults, options.scene, (TooLargeError, ValueError)),
            status_line(options.is_silent) as progress,
        ):
            found = tradeoff(
                read,
                names,
                metric=options.metric,
                tolerance=options.tolerance,
                margin=options.margin,
                budget=options.budget,
                fps=options.fps,
                starts=options.starts,
                spread=options.spread,
                zoom=options.zoom,
                effort=options.effort,
                time_limit=options.time_limit,
                repeats=options.repeats,
                most=options.points,
                on_progress=progress,
            )
    if found is None:
        lists: dict[str, list[object]] = {"points": [], "pareto": []}
        nulls = {"truth": None, "within_tolerance": None, "within_budget": None}
        named = {"scene": options.scene, "metric": options.metric}
        return exit_with_errors(faults, options.as_json, **named, **nulls, **lists)
    document = found.document(options.scene)
    if remarks:
        document["remarks"] = [*remarks]
        report_remarks(options.scene, remarks)
    if options.as_json:
        print_json(document)
    elif not options.quiet:
        print_tradeoff(options.scene, found, options.verbose)
    is_met = found.within_tolerance is not None and (options.budget is None or found.within_budget is not None)
    status = 0 if is_met else 1
    if found.interrupted:
        click.echo(f"interrupted: the {len(found.points)} settings tried so far are kept", err=True)
        status = 130
    return max(status, _write_results(found, document, path, options))


def _check_metric(options: _Options, faults: list[Fault]) -> None:
    """Add an unknown metric, and a tolerance that it cannot have, to the faults."""
    with collect_errors(faults, "--metric", (UnknownMetricError,)):
        check_objective(options.metric, None, None, DEFAULT_FPS)
    known = options.metric if options.metric in METRICS else None
    with collect_errors(faults, "--tolerance", (ValueError,)):
        check_objective(known, options.tolerance, None, DEFAULT_FPS)


def _read(options: _Options, faults: list[Fault]) -> tuple[str, Scene | None, tuple[str, ...]]:
    """Return the file, the scene, and remarks on a recording; add faults, also of files to write, to the faults."""
    read: Scene | None = None
    path = options.scene
    remarks: tuple[str, ...] = ()
    with collect_errors(faults):
        path, read, remarks = read_scene(options.scene, options.overrides)
    if options.write and options.overrides:
        faults.append(
            Fault.of("--write", "cannot be combined with --set, because the file does not contain those changes")
        )
    elif options.write and is_recording(path):
        remedy = f"write its scene with `sandbox export {shorten(options.scene)} --to FILE.toml` first"
        faults.append(Fault.of("--write", f"cannot write into a recording; {remedy}"))
    elif options.write and read is not None:
        with collect_errors(faults):
            write_solver(path, {})  # without changes: raises if the file cannot be written
    with collect_errors(faults):
        require_folder(options.out)
    with collect_errors(faults):
        require_plot_file(options.plot)
    if options.out is not None and not faults:
        with collect_errors(faults):
            make_folder(options.out)
    return path, read, remarks


def _write_results(found: Tradeoff, document: dict[str, object], path: str, options: _Options) -> int:
    """Write the requested scene, plot and folder; return 2 if one of them cannot be written."""
    faults: list[Fault] = []
    if options.write and not found.interrupted:
        with collect_errors(faults):
            _write_scene(found, path, options.is_silent)
    written: list[Path] = []
    with collect_errors(faults):
        _draw(document, options.plot, written)
        _write_folder(found, document, options.out, written)
    for file in written:
        _print(f"written: {file}", options.is_silent)
    for fault in faults:
        click.echo(str(fault), err=True)
    return 2 if faults else 0


def _write_scene(found: Tradeoff, path: str, silent: bool) -> None:
    """Write the recommended `[solver]` into the scene file.

    Raises:
        SceneError: the file cannot be written.
    """
    if found.within_tolerance is None:
        _print(f"not written: no setting is within the tolerance, so {path} is unchanged", silent)
        return
    point = found.within_tolerance.point
    is_changed = write_solver(path, point.changes)
    _print(f"written: {path}" if is_changed else f"{path}: already has the recommended [solver]", silent)
    if point.engine != USUAL:
        _print(f"run it with --engine {point.engine}", silent)


def _draw(document: dict[str, object], plot: Path | None, written: list[Path]) -> None:
    """Draw error against cost to the file of `--plot`, and add it to the written files.

    Raises:
        SceneError: it cannot be written.
    """
    if plot is None:
        return
    from sandbox.report.tradeoff_plot import plot_tradeoff

    try:
        plot_tradeoff(document, plot)
    except OSError as error:
        raise SceneError([Fault.of("--plot", f"{error.filename}: {error.strerror}")]) from None
    written.append(plot)


def _write_folder(found: Tradeoff, document: dict[str, object], out: Path | None, written: list[Path]) -> None:
    """Write the document and the page into the folder of `--out`, and add it to the written files.

    Raises:
        SceneError: they cannot be written.
    """
    if out is None:
        return
    from sandbox.report.html.tradeoff import write_tradeoff

    try:
        write_json(document, out / "tradeoff.json")
        engines = [name for name in ENGINES if any(point.engine == name for point in found.points)]
        replayed = None if found.interrupted else compare(found.scene, engines, truth=found.best)
        if replayed is not None and replayed.interrupted:
            raise KeyboardInterrupt
        write_tradeoff(document, out / "report.html", replayed)
    except OSError as error:
        raise SceneError([Fault.of("--out", f"{error.filename}: {error.strerror}")]) from None
    written.append(out)


def _print(text: str, silent: bool) -> None:
    if not silent:
        click.echo(text)
