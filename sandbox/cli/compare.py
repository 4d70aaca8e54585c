"""Command `compare` and its table."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import click

from sandbox.batch.plan import MAX_FAILED
from sandbox.batch.sweep import parse_sweep, relabelled, repeated_keys
from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    make_folder,
    only_engine,
    parse_engines,
    require_folder,
    write_json,
)
from sandbox.cli.minimise import faults_of, minimised
from sandbox.cli.options import (
    POSITIVE,
    OutputOptions,
    engines_option,
    json_option,
    out_option,
    quiet_option,
    set_option,
    sweep_option,
    takes,
    verbose_option,
)
from sandbox.cli.progress import status_line
from sandbox.cli.recordings import read_scene, report_remarks
from sandbox.cli.starts import spread_option, starts_option
from sandbox.cli.streams import print_json
from sandbox.cli.tables import (
    add_columns,
    add_value_columns,
    cell_text,
    format_optional,
    heads_of,
    new_table,
    print_legend,
    print_line,
    print_table,
)
from sandbox.columns import TRUTH, Column, shown
from sandbox.formatting import format_plural
from sandbox.measure.compare import Comparison, Row, Variant, compare_variants
from sandbox.measure.compare.columns import COLUMNS, END_LEGEND, ONE_SIDED, end_table
from sandbox.measure.compare.contact_matching import ContactMatch
from sandbox.measure.compare.result import short_key, value_text
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.run_warnings import joint_order_limit
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.overrides import AddressError, combinations

MAX_LISTED = 5
"""Unmatched contacts that are listed for each engine; `--json` has more."""
NO_EFFECT = 1e-6
"""Relative change of the error below which a setting counts as without effect."""
LEGEND = (
    "max error: largest distance of a body from the truth, while that is trusted",
    "diverges: when it first exceeds the tolerance; energy: change without a cause, as a fraction",
    "contacts: also in the truth; truth only, run only: in one of the two alone; -v: more columns",
)
"""Short meanings of the columns."""
NAMES = {
    "engine": "the physics engine",
    "dt": "time step of a frame, s",
    "status": "ok; diverged: a state is not finite; refused: the engine cannot model the scene; failed: it stopped",
}
"""Meanings of the columns that name a row."""
SECONDS: Column[Row] = Column("seconds", "computing time of the run, without compilation, s", lambda row: row.seconds)


def print_comparison(scene: str, comparison: Comparison, why: bool, refusals: bool, verbose: bool = False) -> None:
    """Print the truth, a table with a line for each engine and swept value, and notes below it.

    Args:
        scene: the scene as the user named it.
        comparison: the comparison.
        why: print the settings with the largest effect.
        refusals: print the reasons of refusals.
        verbose: print and explain all columns.
    """
    from rich.text import Text

    table = new_table()
    add_columns(table, ["engine"])
    swept = [key for key in comparison.rows[0].set if key != "solver.dt"]
    add_columns(table, (*map(short_key, swept), "dt"), "right")
    has_status = verbose or any(row.status != "ok" for row in comparison.rows)
    add_columns(table, ["status"] if has_status else [])
    columns = shown((*COLUMNS, SECONDS), comparison.rows, verbose)
    add_value_columns(table, columns)
    for row in comparison.rows:
        table.add_row(
            row.engine,
            *(Text(value_text(row.set[key])) for key in swept),
            f"{row.settings['dt']:.4g}",
            *([Text(row.status, style="green" if row.status == "ok" else "bold red")] if has_status else []),
            *(cell_text(column, row) for column in columns),
        )
    print_line(f"{scene}: {comparison.scene.title}" if comparison.scene.title else scene)
    print_line(comparison.sentence())
    print_table(table, keys=2 + len(swept))
    if verbose:
        meanings = {column.head: column.about for column in columns}
        meanings |= {short_key(key): f"value of {key!r}" for key in swept}
        print_legend(heads_of(table), NAMES | meanings)
    for line in _lines_below_table(comparison, why, refusals, not verbose):
        print_line(line)
    _print_ends(comparison)


def _print_ends(comparison: Comparison) -> None:
    """Print the measures of the end over perturbed starts, of the truth and of each row, if they were compared."""
    heads, rows = end_table(comparison)
    if rows:
        table = new_table()
        add_columns(table, heads[:1])
        add_columns(table, heads[1:], "right")
        for row in rows:
            table.add_row(*row)
        print_table(table, keys=2)
        print_line(END_LEGEND)


def _lines_below_table(comparison: Comparison, why: bool, refusals: bool, legend: bool) -> list[str]:
    """Return the lines below the table."""
    lines = [*LEGEND] if legend and any(row.status != "refused" for row in comparison.rows) else []
    if legend and (own := [row.name for row in comparison.rows if row.is_truth]):
        lines.append(f"{TRUTH}: the run of {' and '.join(own)} is the truth itself, so that its errors are 0")
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        lines.append(
            "energy: change since the start, which includes correct losses, because the truth ends before the run does"
        )
    after = {row.name: count for row in comparison.rows if (count := row.count("after_divergence"))}
    if legend and after:
        counts = ", ".join(f"{name} {count:,}" for name, count in after.items())
        lines.append(f"contacts after one of their bodies has diverged, which are not matched: {counts}")
    if comparison.starts_about is not None:
        lines.append(comparison.starts_about)
    lines += [*_accuracy_lines(comparison), *_joint_order(comparison)]
    for row in comparison.rows:
        if refusals and row.status == "refused":
            lines.append(str(row.reason))
        for kind, head in ONE_SIDED.items():
            if events := row.contacts(kind):
                lines.append(f"{row.name}: {head}: {_named(events)}")
        if why and row.status != "refused":
            lines += _explained(row)
    return lines


def _accuracy_lines(comparison: Comparison) -> Iterator[str]:
    """Yield a line for each error that is smaller than the accuracy of the truth."""
    for row in comparison.rows:
        best, error = comparison.truth_of(row.name), row.score.max_position
        if best is not None and error is not None and best.difference > 0.0 and error <= best.difference:
            accuracy = f"the accuracy of the truth, {best.difference:.1g} m"
            yield f"{row.name}: its max error is below {accuracy}; it may be smaller"


def _joint_order(comparison: Comparison) -> Iterator[str]:
    """Yield the order to which the solver of rigid joints limits integrators, if integrators are compared."""
    rows = [row for row in comparison.rows if "solver.integrator" in row.set and row.status != "refused"]
    for method in sorted({str(row.settings["joints"]) for row in rows}):
        limit = joint_order_limit(comparison.scene, method)
        if limit is not None:
            yield limit.text


def _named(events: Sequence[ContactMatch]) -> str:
    named = [f"{' and '.join(event.between)} at {event.when:.4g} s" for event in events[:MAX_LISTED]]
    more = len(events) - len(named)
    return "; ".join(named) + (f"; and {more:,} more" if more else "")


def _explained(row: Row) -> list[str]:
    """Return the verdict, a table of the changes with an effect, and the changes without one or that failed."""
    if row.verdict is None:
        return [f"{row.name}: no error to explain"]
    found = sorted((knob for knob in row.why if knob.ratio is not None), key=lambda knob: knob.ratio or 0.0)
    without_effect = [knob for knob in found if abs((knob.ratio or 0.0) - 1.0) < NO_EFFECT]
    heads = ("change", "max error, m", "of the original")
    cells = [
        heads,
        *(
            (k.label, format_optional(k.max_position_error), f"×{k.ratio:.3g}")
            for k in found
            if k not in without_effect
        ),
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [row.verdict]
    lines += [f"  {a:<{widths[0]}}  {b:>{widths[1]}}  {c:>{widths[2]}}" for a, b, c in cells] if len(cells) > 1 else []
    for heading, knobs in (
        ("no effect", without_effect),
        ("failed", [knob for knob in row.why if knob.ratio is None and knob.status != "refused"]),
        ("refused", [knob for knob in row.why if knob.status == "refused"]),
    ):
        if knobs:
            named = (f"{knob.label} ({knob.status})" if heading == "failed" else knob.label for knob in knobs)
            lines.append(f"  {heading}: {', '.join(named)}")
    return lines


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scene: str
    engines: str | None
    overrides: tuple[str, ...]
    sweeps: tuple[str, ...]
    tolerance: float | None
    starts: int
    spread: float
    why: bool
    out: Path | None
    minimise: str | None
    force: bool
    verbose: bool


class _Request(NamedTuple):
    """Checked command line: engines, sweeps and variants to compare."""

    engines: list[str] | None
    axes: list[tuple[str, Sequence[Any]]]
    """keys and values of the sweeps"""
    variants: list[Variant]
    smallest: Path | None
    """file of `--minimise`"""
    remarks: tuple[str, ...]
    """on a recording"""


@click.command(name="compare")
@click.argument("scene")
@engines_option("all, or with --sweep those that can run every value")
@set_option()
@sweep_option
@click.option(
    "--tolerance",
    type=POSITIVE,
    metavar="M",
    help="position error at which a run counts as diverged, m; default: 1 % of the smallest ball's radius",
)
@starts_option(
    "also run from N perturbed starts: errors over them, or where the truth ends early, statistics of the ends",
    default=1,
)
@spread_option
@click.option(
    "--why",
    is_flag=True,
    help="rerun with one or two settings changed at a time, and list the changes that lower the error",
)
@click.option(
    "--minimise",
    is_flag=False,
    flag_value="",
    metavar="[FILE]",
    help="remove bodies while the engines (or an engine and the truth) still diverge, and write the smallest scene; "
    "default: SCENE.min.toml in the current folder",
)
@click.option("--force", is_flag=True, help="allow --minimise to replace an existing file")
@out_option("write report.html, plots and comparison.json")
@json_option
@verbose_option
@quiet_option()
@takes(_Options)
def compare_command(options: _Options) -> int:
    """Run a scene on several engines, or with several values, and measure each error against the best known truth.

    SCENE is a file, the name of a shipped scene, or a recorded session (.json), whose scene is compared without its
    actions, because no truth with actions is known; `sandbox run --engine` applies them. The truth is a closed form,
    the event-driven engine, or a run with ever smaller steps. Exit status 1: an engine failed, diverged, or refused the
    scene although it was named.
    """
    faults: list[Fault] = []
    request = _checked(options, faults)
    comparison: Comparison | None = None
    if not faults:
        request = _choose_engine(request, options)
        with (
            collect_errors(faults, options.scene, (TooLargeError,)),
            status_line(options.is_silent) as progress,
        ):
            comparison = compare_variants(
                request.variants,
                request.engines,
                tolerance=options.tolerance,
                why=options.why,
                starts=options.starts,
                spread=options.spread,
                on_progress=progress,
            )
    if comparison is None:
        return exit_with_errors(faults, options.as_json, scene=options.scene, truth=None, engines=[])

    is_engine_chosen = request.engines is not None or bool(request.axes)
    status = _report_problems(options.scene, comparison, is_engine_chosen)
    document = comparison.document(options.scene)
    if request.remarks:
        document["remarks"] = [*request.remarks]
        report_remarks(options.scene, request.remarks)
    if not options.is_silent:
        print_comparison(options.scene, comparison, options.why, not is_engine_chosen, options.verbose)
    if comparison.interrupted:
        complete = format_plural(len(comparison.rows), "run")
        click.echo(f"interrupted: {complete} complete; the results are kept", err=True)
        status = 130
    elif request.smallest is not None:
        status = _minimise(comparison, request, options, document) or status
    if options.as_json:
        print_json(document)
    return _write(comparison, document, options, status, request.remarks)


def _checked(options: _Options, faults: list[Fault]) -> _Request:
    """Return the request of the command line; add its errors to the faults."""
    names = parse_engines(options.engines, faults)
    axes: list[tuple[str, Sequence[Any]]] = []
    for sweep in options.sweeps:
        with collect_errors(faults, "--sweep", (AddressError,)):
            axes.append(parse_sweep(sweep))
    faults += repeated_keys(options.overrides, options.sweeps)
    variants: list[Variant] = []
    path = ""
    remarks: tuple[str, ...] = ()
    with collect_errors(faults), collect_errors(faults, "--sweep", (AddressError,)):
        read = read_scene(options.scene)
        path, remarks = read.path, read.remarks
        variants = _variants(options.scene, options.overrides, axes)
    with collect_errors(faults):
        require_folder(options.out)
    smallest = None
    if options.minimise is not None:
        smallest = Path(options.minimise or f"{Path(path or options.scene).stem}.min.toml")
        faults += faults_of(smallest, path, options.force)
        if options.sweeps:
            faults.append(Fault.of("--minimise", "works on a single scene; leave out --sweep"))
    elif options.force:
        faults.append(Fault.of("--force", "works only together with --minimise"))
    if options.out is not None and any(not key.startswith("solver.") for key, _ in axes):
        faults.append(Fault.of("--out", "draws a single scene; sweep only keys of solver, or leave out --out"))
    if options.out is not None and not faults:
        with collect_errors(faults):
            make_folder(options.out)
    return _Request(names, axes, variants, smallest, remarks)


def _choose_engine(request: _Request, options: _Options) -> _Request:
    """Return the request; if only one engine has a setting that is given, on that engine."""
    if request.engines is not None:
        return request
    chosen = only_engine([each.scene for each in request.variants], options.overrides, request.axes)
    if chosen is None:
        return request
    if not options.quiet:
        click.echo(chosen.sentence, err=True)
    return request._replace(engines=[chosen.engine])


def _report_problems(scene: str, comparison: Comparison, is_engine_chosen: bool) -> int:
    """Print a line for each run that failed, and return the exit status.

    A refusal is a failure only if the engine was chosen.
    """
    status = 0
    for row in comparison.rows:
        if row.status != "ok" and (row.status != "refused" or is_engine_chosen):
            status = 1
            problem = row.reason if row.status == "refused" else f"{row.name} {row.status}: {row.reason}"
            click.echo(f"{scene}: {problem}", err=True)
    return status


def _minimise(comparison: Comparison, request: _Request, options: _Options, document: dict[str, Any]) -> int:
    """Reduce the scene, enter the result into the document, and return the exit status."""
    assert request.smallest is not None
    with status_line(options.is_silent) as progress:
        minimised_scene = minimised(options.scene, comparison, request.engines, request.smallest, progress)
    document["minimised"] = minimised_scene.document
    if minimised_scene.status:
        click.echo(minimised_scene.sentence, err=True)
    elif not options.is_silent:
        click.echo(minimised_scene.sentence)
    return minimised_scene.status


def _variants(name: str, overrides: Sequence[str], axes: Sequence[tuple[str, Sequence[Any]]]) -> list[Variant]:
    """Return the scene with each combination of swept values, the last sweep changing fastest.

    Raises:
        SceneError: the scene has faults, with or without the values set.
        AddressError: there are too many combinations.
    """
    keys = [key for key, _ in axes]
    found: list[Variant] = []
    faults: dict[Fault, None] = {}
    failed = 0
    for point in combinations(axes):
        try:
            found.append(Variant(read_scene(name, (*overrides, *point)).scene, dict(point)))
        except SceneError as error:
            faults |= dict.fromkeys(relabelled(fault, keys) for fault in error.faults)
            failed += 1
            if failed == MAX_FAILED:
                break
    if faults:
        raise SceneError(tuple(faults))
    return found


def _write(
    comparison: Comparison, document: dict[str, object], options: _Options, status: int, remarks: Sequence[str]
) -> int:
    """Write the page, the plots and the document into the folder of `--out`, and return the exit status."""
    out = options.out
    if out is None:
        return status
    from sandbox.report.comparison_plot import plot_comparison
    from sandbox.report.html.comparison import write_comparison

    try:
        plot_comparison(comparison, out)
        write_comparison(comparison, out / "report.html", remarks)
        write_json(document, out / "comparison.json")
    except OSError as error:
        click.echo(f"--out: {out}: {error.strerror or error}", err=True)
        return 2
    if not options.is_silent:
        click.echo(f"written: {out}")
    return status
