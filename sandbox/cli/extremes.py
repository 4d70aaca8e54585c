"""Command `extremes` and its tables."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click

from sandbox.cli.common import (
    MAX_UNKNOWN,
    collect_errors,
    exit_with_errors,
    make_folder,
    more_unknown,
    parse_engines,
    parse_names,
    require_folder,
    write_json,
)
from sandbox.cli.options import (
    FiniteRange,
    OutputOptions,
    engines_option,
    json_option,
    out_option,
    quiet_option,
    set_option,
    takes,
    workers_option,
)
from sandbox.cli.progress import ProgressBar, progress_bars
from sandbox.cli.starts import spread_option
from sandbox.cli.streams import print_json
from sandbox.cli.tables import add_columns, format_optional, new_console, new_table, print_line, print_table
from sandbox.echo import short_repr
from sandbox.formatting import format_plural
from sandbox.jsonable import to_json
from sandbox.measure.extremes import Extremes, ExtremesPlan, Sample, extremes
from sandbox.measure.extremes.baseline import BoundaryChange, StoredError, changes, read
from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.extremes.experiment import Axis, check_overrides
from sandbox.measure.extremes.isolation import WorkerError
from sandbox.measure.extremes.outcome import VERDICTS, survived_tenths
from sandbox.measure.extremes.runner import COST_REFERENCE, SAMPLE_SECONDS, WORKER_MEMORY
from sandbox.measure.extremes.scenarios import AXES, PAIRS
from sandbox.measure.extremes.survival import LEVEL_STARTS, MIN_STARTS
from sandbox.measure.starts import MAX_STARTS
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.errors import Fault

MIN_WIDTH = 60
"""Smallest width to which a line of results is cut on a narrow terminal."""
LARGE_ERROR = 0.01
"""Error, as a fraction, from which a level that passes is named with its error"""
LETTERS = {"exact": "E", "degraded": "d", "refused": "–", "failed": "✗"}
STYLES = {"exact": "bold green", "degraded": "yellow", "refused": "dim", "failed": "bold red"}


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    axes: str | None
    engines: str | None
    overrides: tuple[str, ...]
    quick: bool
    pairs: bool
    starts: int | None
    spread: float
    timeout: float
    memory: int
    workers: int | None
    out: Path | None
    against: Path | None


def print_extremes(result: Extremes) -> None:
    """Print a line for each axis and setup, the quality of the predictions, and the number of cells by verdict."""
    _print_limits(result)
    scores = [score for score in result.predictions if score.precision is not None or score.recall is not None]
    if scores:
        table = new_table()
        add_columns(table, ["forecast"])
        add_columns(table, ("true alarms", "false alarms", "missed", "true negatives", "precision", "recall"), "right")
        for score in scores:
            counts = (score.true_positives, score.false_positives, score.false_negatives, score.true_negatives)
            table.add_row(
                score.kind,
                *map(str, counts),
                format_optional(score.precision, ".0%"),
                format_optional(score.recall, ".0%"),
            )
        print_table(table)
    for line in _summary(result):
        print_line(line)


def _print_limits(result: Extremes) -> None:
    """Print a line for each axis and setup: a letter per level, the cost, and the boundary."""
    from rich.text import Text

    console = new_console()
    axis_width = max((len(limit.axis) for limit in result.limits), default=0)
    setup_width = max((len(limit.setup) for limit in result.limits), default=0)
    levels = max((len(list(_row(result, limit))) for limit in result.limits), default=0)
    cost_width = max((len(_cost(limit)) for limit in result.limits), default=0)
    previous_axis = ""
    for limit in result.limits:
        line = Text(
            f"{limit.axis if limit.axis != previous_axis else '':<{axis_width}}  {limit.setup:<{setup_width}}  "
        )
        cells = list(_row(result, limit))
        for cell in cells:
            line.append(_letter(cell), STYLES[cell.verdict])
        cost = f"{_cost(limit):>{cost_width}}  " if cost_width else ""
        line.append(f"{'':<{levels - len(cells)}}  {cost}{_reached(limit)}{_worst(cells)}")
        line.truncate(max(console.width, MIN_WIDTH), overflow="ellipsis")
        console.print(line, soft_wrap=True)
        previous_axis = limit.axis
    if result.limits:
        for text in _legend(result):
            print_line(text, "dim")


def _letter(cell: Sample) -> str:
    """Return the sign of a cell: the letter of its verdict, or the tenths of the starts that survived."""
    tenths = survived_tenths(cell)
    return LETTERS[cell.verdict] if tenths is None else str(tenths)


def _cost(limit: Boundary) -> str:
    return "" if limit.cost_ratio is None else f"×{limit.cost_ratio:.3g}"


def _legend(result: Extremes) -> Iterator[str]:
    letters = ", ".join(f"{letter} {word}" for word, letter in LETTERS.items())
    yield f"one letter per level, from the easiest to the hardest: {letters}"
    if result.plan.starts > 1:
        yield (
            f"from up to {result.plan.starts} starts, of which 95 % must survive; a digit is a failed level, in tenths "
            "of the starts that survived; (A to B): levels between which survival falls below 95 %"
        )
    if any(limit.cost_ratio is not None for limit in result.limits):
        yield f"×: counted cost at the easiest level, in that of {COST_REFERENCE} with its default settings"


def _worst(cells: Sequence[Sample]) -> str:
    """Return the largest error of the levels that pass, where it is more than `LARGE_ERROR`; empty otherwise."""
    degraded = [(cell.outcome.error, cell) for cell in cells if cell.verdict == "degraded" and cell.outcome.error]
    error, worst = max(degraded, key=lambda each: each[0], default=(0.0, None))
    return "" if worst is None or error < LARGE_ERROR else f"; at {_level(worst)} {worst.outcome.reason}"


def _level(cell: Sample) -> str:
    return format_optional(cell.level, ".4g") if isinstance(cell.level, float | int) else str(cell.level)


def _row(result: Extremes, limit: Boundary) -> Iterator[Sample]:
    return (cell for cell in result.cells if (cell.axis, cell.setup) == (limit.axis, limit.setup))


def _summary(result: Extremes) -> Iterator[str]:
    """Yield the number of cells by verdict, and the computing time."""
    for group, cells in (("single axes", result.cells), ("boundaries", result.probes), ("pairs", result.pairs)):
        if cells:
            count = Counter(cell.verdict for cell in cells)
            verdicts = ", ".join(f"{count[word]:,} {word}" for word in VERDICTS if count[word])
            yield f"{group}: {len(cells):,} cells: {verdicts}"
    yield f"{result.seconds:.0f} s on {format_plural(result.plan.workers, 'worker')}"


def _reached(limit: Boundary) -> str:
    """Return the level up to which a setup passes, and the reason for the first failure."""
    if limit.refused:
        return f"refused: {limit.reason}"
    reached, failed = format_optional(limit.limit, ".4g"), format_optional(limit.first_failure, ".4g")
    equal = limit.limit_at_equal_cost
    at_equal_cost = "" if equal is None or limit.cost_ratio == 1.0 else f", {equal:.4g} at equal cost"
    if limit.first_failure is None:
        return f"all levels pass, up to {reached}{at_equal_cost}"
    if limit.limit is None:
        return f"no level passes: {limit.rule}: {limit.reason}"
    beyond = "" if limit.monotone else " (levels beyond pass and fail in turn)"
    limits = f"up to {reached}{_bounds(limit)}{at_equal_cost}, fails at {failed}{beyond}"
    return f"{limits}: {limit.rule}: {limit.reason}"


def _bounds(limit: Boundary) -> str:
    """Return the levels between which survival falls below 95 %, unless they are the two at the boundary."""
    if limit.bounds in (None, (limit.limit, limit.first_failure)):
        return ""
    low, high = (format_optional(level, ".4g") for level in limit.bounds)
    return f" ({low} to {high})"


MIN_MEMORY = 1024
"""MiB, more than the libraries of a worker need."""


@click.command(name="extremes")
@click.option("--axes", metavar="NAME[,NAME]", help=f"axes to vary; default: all, which are {', '.join(AXES)}")
@engines_option("all", "test")
@set_option("set a value of every scene")
@click.option("--quick", is_flag=True, help="few levels, no pairs, boundaries only as fine as the levels")
@click.option("--pairs/--no-pairs", default=True, help="also vary two axes at once")
@click.option(
    "--starts",
    type=click.IntRange(1, MAX_STARTS),
    metavar="N",
    help="run each level of an axis from N perturbed starts, every second one of boxes rotated as a whole, of which 95 "
    "% must pass; fewer where runs cost much; "
    f"1: only the start of the scene; default: {LEVEL_STARTS}, with --quick {MIN_STARTS}",
)
@spread_option
@click.option(
    "--timeout",
    type=FiniteRange(0.1, 86_400.0),
    default=SAMPLE_SECONDS,
    metavar="S",
    help="time limit of each run, s",
)
@click.option(
    "--memory",
    type=click.IntRange(MIN_MEMORY),
    default=WORKER_MEMORY,
    metavar="MB",
    help="memory limit of each worker, MiB",
)
@workers_option(None, "one per core")
@out_option("write report.html, heat maps, extremes.json")
@click.option(
    "--against",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="compare the boundaries with those stored in FILE, an extremes.json of the same --starts, --spread and --set",
)
@json_option
@quiet_option("print no tables and no progress")
@takes(_Options)
def extremes_command(options: _Options) -> int:
    """Increase one parameter at a time, and pairs of them, until each engine fails, and report the boundaries.

    Each cell runs in a worker process with a time and a memory limit, so a crash does not stop the command.
    """
    faults: list[Fault] = []
    plan = _plan(options, faults)
    stored = None
    if options.against is not None:
        with collect_errors(faults, "--against", (StoredError,)):
            stored = read(options.against, plan)
    with collect_errors(faults):
        require_folder(options.out)
    if options.out is not None and not faults:
        with collect_errors(faults):
            make_folder(options.out)
    if faults:
        return exit_with_errors(faults, options.as_json, cells=[], limits=[])
    try:
        with progress_bars(options.is_silent, has_estimate=False) as bars:
            result = extremes(plan, None if not bars.is_shown else _progress_callback(bars.add("starting")))
    except WorkerError as error:
        click.echo(str(error) if error.was_killed else f"--memory: {error}", err=True)
        return 1 if error.was_killed else 2
    return _report(result, stored, options)


def _plan(options: _Options, faults: list[Fault]) -> ExtremesPlan:
    """Return the plan of the command line; add its errors to the faults."""
    chosen = _axes(options.axes, faults)
    names = parse_engines(options.engines, faults)
    with collect_errors(faults):
        check_overrides(options.overrides, chosen)
    cases = {axis.case.name for axis in chosen}
    has_pairs = options.pairs and not options.quick
    pairs = tuple(pair for pair in PAIRS if pair.case.name in cases) if has_pairs else ()
    engines = None if names is None else tuple(names)
    plan = ExtremesPlan(
        chosen,
        pairs,
        engines,
        options.overrides,
        quick=options.quick,
        starts=options.starts or (MIN_STARTS if options.quick else LEVEL_STARTS),
        spread=options.spread,
        seconds=options.timeout,
        memory=options.memory,
    )
    return plan if options.workers is None else replace(plan, workers=options.workers)


def _progress_callback(bar: ProgressBar) -> ProgressCallback:
    def show(progress: Progress) -> None:
        bar.update(progress.fraction or 0.0, progress.message, 1.0)

    return show


def _axes(text: str | None, faults: list[Fault]) -> tuple[Axis, ...]:
    """Return the axes that `--axes` names, all without it; add unknown names to the faults."""
    if text is None:
        return tuple(AXES.values())
    names = parse_names(text)
    unknown = [name for name in names if name not in AXES]
    axes = ", ".join(AXES)
    faults += [Fault.of("--axes", f"no axis {short_repr(name)}; axes: {axes}") for name in unknown[:MAX_UNKNOWN]]
    faults += more_unknown("--axes", len(unknown))
    return tuple(AXES[name] for name in names if name in AXES)


def _report(result: Extremes, stored: Sequence[dict[str, object]] | None, options: _Options) -> int:
    """Print and write the result, and return the exit status.

    Args:
        result: the result.
        stored: boundaries of an earlier result, to be compared with; None for no comparison.
        options: the command line.
    """
    status = 0
    document = result.document()
    found = [] if stored is None else changes(stored, result.limits)
    if stored is not None:
        document["changes"] = to_json(found)
    for change in found:
        if change.worse:
            click.echo(str(change), err=True)
            status = 1
    if result.interrupted:
        click.echo(f"interrupted: {len(result.cells) + len(result.pairs)} cells are complete and kept", err=True)
        status = 130
    if options.as_json:
        print_json(document)
    elif not options.quiet:
        print_extremes(result)
        _print_improvements(found, stored is not None)
    if options.out is not None:
        try:
            _write(result, document, options.out)
        except OSError as error:
            click.echo(f"--out: {options.out}: {error.strerror or error}", err=True)
            return status or 2
        if not options.is_silent:
            click.echo(f"written: {options.out}")
    return status


def _print_improvements(found: Sequence[BoundaryChange], is_compared: bool) -> None:
    for change in found:
        if not change.worse:
            click.echo(str(change))
    if is_compared and not found:
        click.echo("no boundary has moved")


def _write(result: Extremes, document: dict[str, object], out: Path) -> None:
    """Write heat maps, a page and the document into a folder, each atomically."""
    from sandbox.report.extremes_plot import plot_extremes
    from sandbox.report.html.extremes import write_extremes

    plot_extremes(result, out)
    write_extremes(document, out / "report.html")
    write_json(document, out / "extremes.json")
