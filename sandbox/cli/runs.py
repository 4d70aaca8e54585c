"""Command `runs`: list, filter, group and plot the stored runs of a folder."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from sandbox.batch.query import (
    Columns,
    QuantityStatistics,
    QueryError,
    RunGroup,
    StoredRuns,
    cell_rows,
    open_store,
)
from sandbox.batch.store import StoreError
from sandbox.cli.common import collect_errors, exit_with_errors, parse_names, require_plot_file
from sandbox.cli.options import OutputOptions, json_option, quiet_option, takes
from sandbox.cli.streams import print_json
from sandbox.cli.tables import new_table, print_line, print_table
from sandbox.formatting import format_plural
from sandbox.jsonable import in_json, to_json
from sandbox.scene.errors import Fault

DEFAULT_LIMIT = 50
"""Rows of a list"""
IS_OK = "status = 'ok'"
DEFAULT_QUANTITIES = ("energy_end", "contacts", "missed_contacts")
QUANTILES = (0.1, 0.5, 0.9)
TEXTS = ("id", "scene", "title", "engine", "status", "reason", "versions")
"""Columns that are justified to the left"""
MAX_CELLS = 100_000
"""Cells of a heat map"""
UNITS = {
    "seconds": "s", "energy_start": "J", "energy_end": "J", "first_contact": "s", "solver.dt": "s",
    "world.duration": "s", "score": "points",
}  # fmt: skip
"""Units of columns for axes; others are counts, or have units of the scene"""


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    folder: str
    wheres: tuple[str, ...]
    sort: str | None
    limit: int
    columns: str | None
    by: str | None
    of: str | None
    success: str
    as_csv: bool
    plot: str | None
    target: Path | None

    @property
    def where(self) -> str | None:
        """All filters together."""
        return " AND ".join(f"({each}\n)" for each in self.wheres) or None

    @property
    def keys(self) -> list[str]:
        """Keys of the groups."""
        return [] if self.by is None else parse_names(self.by)


@dataclass(frozen=True, kw_only=True)
class StoredRunsDocument:
    """JSON document of `runs`."""

    folder: str
    count: int
    """runs that the filter selects"""
    statuses: Mapping[str, int]
    """number of these runs by status"""
    runs: Sequence[Mapping[str, object]] | None = field(metadata=in_json(optional=True))
    """the listed runs, by column"""
    groups: Sequence[RunGroup] | None = field(metadata=in_json(optional=True))
    """with `--by`: statistics of runs with equal values"""


@click.command(name="runs")
@click.argument("folder")
@click.option(
    "--where",
    "wheres",
    multiple=True,
    metavar="EXPR",
    help="only runs for which an SQL expression holds, such as \"solver.dt < 0.01 and status = 'ok'\"; may be repeated",
)
@click.option("--sort", metavar="KEY[,KEY]", help="sort by columns; -KEY sorts in descending order")
@click.option(
    "--limit", type=click.IntRange(min=0), default=DEFAULT_LIMIT, metavar="N", help="rows to list; 0: all; default: 50"
)
@click.option("--columns", metavar="NAME[,NAME]", help="columns to list; default: those in which the runs differ")
@click.option("--by", metavar="KEY[,KEY]", help="group runs by columns, and print statistics of each group")
@click.option(
    "--of",
    metavar="NAME[,NAME]",
    help="columns to compute mean, deviation and quantiles of; default: energy_end, contacts, missed_contacts",
)
@click.option(
    "--success",
    metavar="EXPR",
    default=IS_OK,
    help="SQL expression of a run that succeeds, for the success rate of groups; default: status = 'ok'",
)
@click.option(
    "--plot", metavar="NAME", help="draw a column over one or two keys of --by: lines with bands, or a heat map"
)
@click.option(
    "--to",
    "target",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="file of --plot: .png, .svg or .pdf; default: NAME-by-KEY.png",
)
@click.option("--csv", "as_csv", is_flag=True, help="print comma-separated values on standard output")
@json_option
@quiet_option("print nothing but errors")
@takes(_Options)
def runs_command(options: _Options) -> int:
    """List, filter, group and plot the runs that `sandbox run … --out FOLDER` has stored.

    KEY, NAME: columns, such as status, seconds or contacts, and the paths of values that were set or swept, such as
    solver.dt or ball.cue.velocity.
    """
    faults = _option_faults(options)
    runs: StoredRuns | None = None
    if not faults:
        with collect_errors(faults, options.folder, (StoreError,)):
            runs = open_store(options.folder)
    if runs is None:
        return exit_with_errors(_shortened(options.folder, faults), options.as_json)
    try:
        with runs, collect_errors(faults, options.folder, (StoreError,)):
            _check_names(runs, options, faults)
            if not faults:
                return _answer(runs, options)
    except QueryError as error:
        faults.append(Fault.of("--where" if options.wheres else "--success", str(error)))
    return exit_with_errors(_shortened(options.folder, faults), options.as_json)


def _option_faults(options: _Options) -> list[Fault]:
    """Return the faults of options that do not go together."""
    faults: list[Fault] = []

    def fault(option: str, message: str) -> None:
        faults.append(Fault.of(option, message))

    if options.plot is not None and not 1 <= len(options.keys) <= 2:
        fault("--plot", "draws over one or two keys: --by KEY or --by KEY,KEY")
    if options.target is not None and options.plot is None:
        fault("--to", "names the file of --plot; --csv and --json print tables")
    if options.target is not None and options.plot is not None:
        with collect_errors(faults):
            require_plot_file(options.target, "--to")
    if options.as_csv and options.as_json:
        fault("--csv", "is given with --json too; leave out one of them")
    if options.by is None and options.of is not None:
        fault("--of", "works only together with --by KEY")
    if options.by is not None and options.columns is not None:
        fault("--columns", "is for lists; with --by, use --of NAME[,NAME]")
    return faults


def _check_names(runs: StoredRuns, options: _Options, faults: list[Fault]) -> None:
    """Add a fault for each name that is no column, and for wrong expressions."""
    for option, text in (
        ("--by", options.by),
        ("--of", options.of),
        ("--columns", options.columns),
        ("--plot", options.plot),
        ("--sort", options.sort),
    ):
        for name in [] if text is None else parse_names(text):
            with collect_errors(faults, option, (QueryError,)):
                runs.column(name.removeprefix("-") if option == "--sort" else name)
    for where in options.wheres:
        with collect_errors(faults, "--where", (QueryError,)):
            runs.statuses(where)
    with collect_errors(faults, "--success", (QueryError,)):
        runs.statuses(options.success)


def _shortened(folder: str, faults: Sequence[Fault]) -> list[Fault]:
    """Return faults without the folder repeated in their messages."""
    return [Fault(f.file, f.line, f.path, f.message.removeprefix(f"{folder}: ")) for f in faults]


def _answer(runs: StoredRuns, options: _Options) -> int:
    """Print or draw what was asked for, and return the exit status."""
    if options.plot is not None:
        return _plot(runs, options, options.plot)
    statuses = runs.statuses(options.where)
    count = sum(statuses.values())
    if options.by is not None:
        quantities = DEFAULT_QUANTITIES if options.of is None else tuple(parse_names(options.of))
        groups = runs.group(options.keys, quantities, options.where, options.success, QUANTILES)
        if any(group.versions > 1 for group in groups):
            _note_mixture(runs, options)
        _print_groups(
            groups,
            quantities,
            options,
            StoredRunsDocument(folder=options.folder, count=count, statuses=statuses, runs=None, groups=groups),
        )
        return 0
    sort = [] if options.sort is None else parse_names(options.sort)
    columns = None if options.columns is None else parse_names(options.columns)
    limit = None if options.limit == 0 or options.as_json or options.as_csv else options.limit
    table = runs.arrays(options.where, columns, sort, limit)
    if options.as_json:
        rows = [dict(zip(table, row, strict=True)) for row in cell_rows(table)]
        document = StoredRunsDocument(folder=options.folder, count=count, statuses=statuses, runs=rows, groups=None)
        print_json(to_json(document))
    elif options.as_csv:
        _print_csv(list(table), cell_rows(table))
    elif not options.quiet:
        end = "first" if sort else "last"
        _print_list(table if columns is not None else _informative(table), count, statuses, end)
        has_warnings = " AND ".join(f"({each}\n)" for each in (*options.wheres, "warnings IS NOT NULL"))
        if columns is None and (warned := sum(runs.statuses(has_warnings).values())):
            print_line(f"runs with warnings: {warned:,}; --columns id,warnings lists them", "dim")
    return 0


def _note_mixture(runs: StoredRuns, options: _Options) -> None:
    """Say on standard error that groups have runs of different versions of one engine, and how many of each."""
    for engine, counts in runs.versions(options.where).items():
        if len(counts) > 1:
            names = _differing(list(counts))
            parts = ", ".join(f"{count:,} of {names[text]}" for text, count in counts.items())
            click.echo(
                f"note: runs of {engine} by several versions are taken together: {parts}; --by versions separates them",
                err=True,
            )


def _differing(texts: Sequence[str]) -> dict[str, str]:
    """Return versions, JSON objects, as short texts of the parts in which they differ."""
    read = {text: json.loads(text) for text in dict.fromkeys(texts)}
    keys = dict.fromkeys(key for each in read.values() for key in each)
    differing = [key for key in keys if len({each[key] for each in read.values() if key in each}) > 1]
    return {
        text: ", ".join(f"{key} {each[key]}" for key in differing if key in each) or "–" for text, each in read.items()
    }


def _informative(table: Columns) -> Columns:
    """Return the columns of a list in which the runs differ, and the few that are always of interest."""
    always = ("id", "engine", "status", "seconds", "contacts")
    found = {}
    for name, values in table.items():
        cells = {None if cell != cell else cell for cell in values.tolist()}
        if name in always or len(cells) > 1:
            found[name] = values
    found.pop("state_hash", None)
    pairs = list(zip(table["engine"].tolist(), found.pop("versions", table["engine"]).tolist(), strict=True))
    if len(set(pairs)) > len({engine for engine, _ in pairs}):
        import numpy as np

        names = {engine: _differing([text for each, text in pairs if each == engine]) for engine in dict(pairs)}
        found["versions"] = np.asarray([names[engine][text] for engine, text in pairs], object)
    return found


def _print_list(table: Columns, count: int, statuses: Mapping[str, int], end: str) -> None:
    """Print runs as a table, and how many there are; `end` says which are listed: the first, or the last added."""
    shown = len(next(iter(table.values()), ()))
    if shown:
        printed = new_table()
        for name in table:
            printed.add_column(name, justify="left" if name in TEXTS else "right", no_wrap=True)
        for row in cell_rows(table):
            printed.add_row(*(_cell(cell) for cell in row))
        print_table(printed)
    counts = ", ".join(f"{number:,} {status}" for status, number in statuses.items())
    part = f"; the {end} {shown:,} are listed (--limit 0 lists all)" if shown < count else ""
    print_line(f"{format_plural(count, 'run')}: {counts}{part}" if count else "no runs")


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.5g}"
    return f"{value:,}" if isinstance(value, int) and abs(value) >= 10_000 else str(value)


def _print_groups(
    groups: Sequence[RunGroup], quantities: Sequence[str], options: _Options, document: StoredRunsDocument
) -> None:
    """Print the statistics of groups in the asked form."""
    if options.as_json:
        print_json(to_json(document))
        return
    parts = ("mean", "deviation", *(f"q{fraction:g}" for fraction in QUANTILES))
    heads = [*options.keys, "runs", "ok", "success", "low", "high"]
    heads += [f"{name} {part}" for name in quantities for part in parts]
    rows = [
        [*g.keys.values(), g.runs, g.ok, g.success_rate, g.success_low, g.success_high]
        + [number for name in quantities for number in _numbers(g.quantities[name])]
        for g in groups
    ]
    if options.as_csv:
        _print_csv(heads, [[None if cell != cell else cell for cell in row] for row in rows])
        return
    if options.quiet:
        return
    table = new_table()
    for k, name in enumerate([*options.keys, "runs", "success", *quantities]):
        table.add_column(name, justify="left" if k < len(options.keys) else "right", no_wrap=True)
    for g in groups:
        success = f"{100 * g.success_rate:.3g} % [{100 * g.success_low:.3g}, {100 * g.success_high:.3g}]"
        cells = [_statistics(g.quantities[name]) for name in quantities]
        table.add_row(*(_cell(value) for value in g.keys.values()), f"{g.runs:,}", success, *cells)
    print_table(table)
    rule = "" if options.success == IS_OK else f" of {options.success}"
    print_line(f"success{rule}: of all runs, with 95 % bounds (Wilson)", "dim")
    print_line("quantities: mean ± deviation [10 %, median, 90 %] of the runs that are ok", "dim")


def _numbers(found: QuantityStatistics) -> list[float]:
    return [found.mean, found.deviation, *found.quantiles.values()]


def _statistics(found: QuantityStatistics) -> str:
    if not found.count:
        return "–"
    deviation = "" if math.isnan(found.deviation) else f" ± {found.deviation:.2g}"
    return f"{found.mean:.4g}{deviation} [{', '.join(f'{value:.4g}' for value in found.quantiles.values())}]"


def _print_csv(heads: Sequence[str], rows: Any) -> None:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    click.echo(stream.getvalue(), nl=False)


def _plot(runs: StoredRuns, options: _Options, quantity: str) -> int:
    """Draw a quantity over the keys to a file, and return the exit status."""
    target = options.target or Path(f"{_file_name(quantity)}-by-{_file_name('-'.join(options.keys))}.png")
    try:
        if len(options.keys) == 1:
            message = _draw_lines(runs, options.keys[0], quantity, options.where, target)
        else:
            message = _draw_heat_map(runs, options.keys, quantity, options.where, target)
    except OSError as error:
        click.echo(f"--to: {target}: {error.strerror or error}", err=True)
        return 2
    if message is not None:
        click.echo(f"--plot: {message}", err=True)
        return 2
    if "versions" not in options.keys:
        _note_mixture(runs, options)
    if not options.is_silent:
        click.echo(f"drawn: {target}")
    return 0


def _draw_lines(runs: StoredRuns, key: str, quantity: str, where: str | None, target: Path) -> str | None:
    """Draw the median of a quantity over a key, a line per engine; return why that cannot be done, or None."""
    import numpy as np

    from sandbox.report.sweep_plot import SweepSeries, plot_lines

    by = [key] if key == "engine" else ["engine", key]
    groups = [group for group in runs.group(by, [quantity], where, quantiles=QUANTILES) if _is_drawn(group, quantity)]
    if not groups:
        return _nothing(quantity)
    values = list(dict.fromkeys(group.keys[key] for group in groups if group.keys[key] is not None))
    is_numeric = all(isinstance(value, int | float) for value in values)
    places = {value: value if is_numeric else index for index, value in enumerate(values)}
    engines = [""] if key == "engine" else list(dict.fromkeys(group.keys["engine"] for group in groups))
    series = []
    for engine in engines:
        own = [g for g in groups if g.keys[key] is not None and (key == "engine" or g.keys["engine"] == engine)]
        own.sort(key=lambda group: float(places[group.keys[key]]))
        bands = np.array([list(group.quantities[quantity].quantiles.values()) for group in own])
        x = np.array([float(places[group.keys[key]]) for group in own])
        if len(own):
            series.append(SweepSeries(engine if len(engines) > 1 else "", x, bands[:, 0], bands[:, 1], bands[:, 2]))
    if not series:
        return f"no run has a value of {key}"
    count = sum(group.quantities[quantity].count for group in groups)
    band = f"median and 10 % to 90 % of {format_plural(count, 'run')}"
    names = [] if is_numeric else [_cell(value) for value in values]
    plot_lines(series, _with_unit(key), _with_unit(quantity), target, band=band, categories=names)
    return None


def _draw_heat_map(runs: StoredRuns, keys: Sequence[str], quantity: str, where: str | None, target: Path) -> str | None:
    """Draw the median of a quantity over two keys; return why that cannot be done, or None."""
    import numpy as np

    from sandbox.report.sweep_plot import plot_heat_map

    groups = [g for g in runs.group(keys, [quantity], where, quantiles=(0.5,)) if _is_drawn(g, quantity)]
    groups = [group for group in groups if None not in group.keys.values()]
    if not groups:
        return _nothing(quantity)
    columns, rows = ({group.keys[key]: None for group in groups} for key in keys)
    horizontal, vertical = (sorted(values, key=_order) for values in (columns, rows))
    if len(horizontal) * len(vertical) > MAX_CELLS:
        return f"{len(horizontal):,} × {len(vertical):,} values are more than the {MAX_CELLS:,} cells of a heat map"
    cells = np.full((len(vertical), len(horizontal)), np.nan)
    for group in groups:
        x, y = (group.keys[key] for key in keys)
        cells[vertical.index(y), horizontal.index(x)] = group.quantities[quantity].quantiles["0.5"]
    labels = _with_unit(keys[0]), _with_unit(keys[1]), f"median of {_with_unit(quantity)}"
    plot_heat_map(list(map(_cell, horizontal)), list(map(_cell, vertical)), cells, labels, target)
    return None


def _order(value: Any) -> tuple[bool, Any]:
    """Return a key that sorts numbers before texts."""
    return (False, value) if isinstance(value, int | float) else (True, str(value))


def _is_drawn(group: RunGroup, quantity: str) -> bool:
    return group.quantities[quantity].count > 0


def _nothing(quantity: str) -> str:
    return f"no run that is ok has a value of {quantity}"


def _with_unit(name: str) -> str:
    return f"{name}, {UNITS[name]}" if name in UNITS else name


def _file_name(text: str) -> str:
    """Return a text as part of a file name."""
    return "".join(letter if letter.isalnum() or letter in "-._" else "-" for letter in text)[:80]
