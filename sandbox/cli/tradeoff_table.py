"""The table of `sandbox tradeoff`: each engine's front, what failed, where the error comes from, and the answers."""

import sys
from collections import Counter
from collections.abc import Sequence

import click

from sandbox.cli.table import WIDE, print_legend
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.picking import LONGER, called, pymunk_lines, shown
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.split import Split
from sandbox.measure.tradeoff.weighed import Tradeoff
from sandbox.scene.files.toml_edit import written

NOTHING = 1e-12
"""m"""
MOST_REASONS = 3
"""Failures listed with their reason."""
MOST_ROWS = 8
"""Rows of one engine's front; where it has more, some that answer no question are left out."""
LEGEND = {
    "scene": "the setting in the scene file",
    "front": "no other setting is both cheaper and more accurate",
    "cheapest": "the cheapest setting within the tolerance",
    "best": "the most accurate setting within the budget",
}
LONG = ">frame"
"""Mark of settings that are not recommended, because their dt is longer than a frame."""


COLUMNS = {
    "engine": "the physics engine",
    "dt": "time step of a frame, s",
    "substeps": "solver steps per frame",
    "iterations": "iterations of the contact solver per substep",
    "other settings": "further changes of [solver]",
    "ms/s minimum": "computing time per simulated second on this machine, ms: the smallest of the timings",
    "ms/s median": "the same: the median of the timings",
}
"""Columns of the table and their meaning, for `--verbose`; the column of the error is added."""


def print_tradeoff(scene: str, found: Tradeoff, verbose: bool = False) -> None:
    """Print what errors are counted in and why, each engine's front, each engine's split, and the answers.

    Args:
        scene: what it is called.
        found: what to print.
        verbose: explain every column and mark below the table.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    unit = f", {found.metric.unit}" if found.metric.unit else ""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("engine", no_wrap=True)
    for head in ("dt", "substeps", "iterations"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("other settings", no_wrap=True)
    table.add_column(f"{found.metric.name}{unit}", justify="right", no_wrap=True)
    for head in ("ms/s minimum", "ms/s median"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    rows = [point for front in found.fronts().values() for point in _thinned(front, found)]
    shown_already = {id(point) for point in rows}
    asked = (point for point in found.points if point.status == "ok" and _marks(point, found))
    rows += [point for point in asked if id(point) not in shown_already]
    order = list(found.fronts())
    rows.sort(key=lambda each: (order.index(each.engine), each.cost or 0.0))
    for point in rows:
        marks = [*_marks(point, found), *([LONG] if point.settings.dt > found.max_dt else [])]
        table.add_row(*_cells(point), Text(" ".join(marks), style="green"))
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.width = max(console.width, Console(width=10_000).measure(table).maximum)
    name = f"{scene} ({found.scene.title})" if found.scene.title else scene
    console.print(Text(f"{name}: {found.error_about}"), soft_wrap=True)
    console.print(Text(_about(found)), soft_wrap=True)
    if rows:
        console.print(table)
        if verbose:
            error = f"{found.metric.about}{', ' + found.metric.unit if found.metric.unit else ''}"
            heads = [str(column.header) for column in table.columns]
            print_legend([*heads, *LEGEND], COLUMNS | {f"{found.metric.name}{unit}": error} | LEGEND)
        else:
            click.echo(_legend(rows, found))
        if any(point.settings.dt > found.max_dt for point in rows):
            click.echo(_long_legend(found))
    splits = [_split(each, found) for each in found.splits if each.total >= NOTHING]
    proposed = [each.sentence for each in found.proposals]
    for line in [*_failures(found), *splits, *found.answers(), *_notes(found), *proposed, *_solver(found)]:
        click.echo(line)


def _about(found: Tradeoff) -> str:
    seeds = f"; each error is the largest over {len(found.seeds)} seeds" if len(found.seeds) > 1 else ""
    ended = "; the time limit ended the search, so another run may try other settings" if found.out_of_time else ""
    count = len(found.points)
    return f"{count} setting{'s' if count != 1 else ''} tried{seeds}{ended}"


def _thinned(front: Sequence[Point], found: Tradeoff) -> list[Point]:
    """Return at most `MOST_ROWS` of an engine's front, and what answers a question."""
    asked = [point for point in front if set(_marks(point, found)) - {"front"}]
    if len(front) <= MOST_ROWS:
        return list(front)
    evenly = [front[round(k * (len(front) - 1) / (MOST_ROWS - 1))] for k in range(MOST_ROWS)]
    return [point for point in front if point in evenly or point in asked]


def _marks(point: Point, found: Tradeoff) -> list[str]:
    picks = {"cheapest": found.within_tolerance, "best": found.within_budget}
    marks = ["scene"] if point.is_own else []
    marks += ["front"] if any(point is each for each in found.pareto) else []
    return marks + [name for name, pick in picks.items() if pick is not None and pick.point is point]


def _legend(rows: Sequence[Point], found: Tradeoff) -> str:
    used = {mark for point in rows for mark in _marks(point, found)}
    repeats = max(point.repeats for point in rows)
    times = f"minimum and median of {repeats} timings" if repeats else "from the run that was scored"
    marks = "".join(f"; {mark}: {meaning}" for mark, meaning in LEGEND.items() if mark in used)
    return f"ms/s: milliseconds of computing per simulated second on this machine, {times}{marks}"


def _long_legend(found: Tradeoff) -> str:
    own = " and than the dt of the scene" if found.max_dt > LONGER / found.fps else ""
    return f"{LONG}: dt is longer than a frame at {found.fps:g} fps{own}, so the setting is not recommended"


def _cells(point: Point) -> list[str]:
    steps = {"dt", "substeps", "iterations"}
    words = ", ".join(
        f"no {key}" if value is None else f"{key} {shown(value)}"
        for key, value in point.changes.items()
        if key not in steps
    )
    own = point.settings
    figures = (("3", point.error), ("4", point.cost), ("4", point.cost_median))
    return [
        point.engine,
        f"{own.dt:.4g}",
        str(own.substeps),
        str(own.iterations),
        words,
        *("–" if value is None else f"{value:.{digits}g}" for digits, value in figures),
    ]


def _failures(found: Tradeoff) -> list[str]:
    failed = [point for point in found.points if point.status != "ok"]
    counted = Counter(point.status for point in failed)
    lines = [f"{count} {status}" for status, count in counted.items()]
    told = [f"{called(p)} {p.status}: {p.reason}" for p in failed[:MOST_REASONS]]
    left = [f"{found.untried} skipped because they would have taken too long"] if found.untried else []
    summary = ", ".join([*lines, *left])
    return ([summary] if summary else []) + told


def _split(each: Split, found: Tradeoff) -> str:
    left = f"at most {_part(each.left)} from the model (the error left with {each.finest} times the substeps)"
    model = left if each.model is None else f"{_part(each.model)} from the model"
    parts = f"{_part(each.time_step)} from the time step, {_part(each.solver)} from the iterations, {model}"
    trusted = found.scene.world.duration if found.best is None else found.best.trusted_until
    until = f", while the truth is trusted ({trusted:.3g} s)" if trusted < found.scene.world.duration else ""
    return (
        f"position error of {each.engine} with the settings of the scene{until}: {_part(each.total)}, of which {parts}"
    )


def _part(metres: float) -> str:
    """Write a part of an error; of rounding, that it is nothing."""
    return "0" if metres < NOTHING else figure(metres, "m")


def _notes(found: Tradeoff) -> list[str]:
    """Return the warnings for the recommended settings, each once, with the settings that it concerns."""
    picks = [found.within_tolerance or found.nearest_to_tolerance, found.within_budget or found.nearest_to_budget]
    picks += found.cheapest_by_engine.values()
    concerned: dict[str, dict[str, None]] = {}
    for pick in filter(None, picks):
        for warning in pick.warnings:
            concerned.setdefault(warning.message, {})[called(pick.point)] = None
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
    return [f"    {line}" for line in lines]
