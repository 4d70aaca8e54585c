"""The table of `sandbox tradeoff`: the front, what failed, where the error comes from, and the answers."""

import sys
from collections import Counter

import click

from sandbox.cli.table import WIDE
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.picking import called, shown
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.split import Split
from sandbox.measure.tradeoff.weighed import Tradeoff

NOTHING = 1e-12
"""m"""
MOST_REASONS = 3
"""Failures told of by their reason."""


def print_tradeoff(scene: str, found: Tradeoff) -> None:
    """Print what the truth is, the front, each engine's split, and the answers.

    Args:
        scene: what it is called.
        found: what to print.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    unit = f", {found.metric.unit}" if found.metric.unit else ""
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("engine", no_wrap=True)
    for head in ("dt", "substeps", "iterations"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("otherwise", no_wrap=True)
    table.add_column(f"{found.metric.name}{unit}", justify="right", no_wrap=True)
    for head in ("ms per s", "median"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    picked = found.within_tolerance.point if found.within_tolerance else None
    affordable = found.within_budget.point if found.within_budget else None
    for point in found.pareto:
        marks = [name for name, one in (("cheapest", picked), ("best", affordable)) if one is point]
        table.add_row(*_cells(point), Text(" ".join(marks), style="green"))
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.width = max(console.width, Console(width=10_000).measure(table).maximum)
    console.print(Text(f"{scene}: {found.scene.title}" if found.scene.title else scene), soft_wrap=True)
    console.print(Text(_about(found)), soft_wrap=True)
    if found.pareto:
        console.print(table)
    splits = [_split(each) for each in found.splits if each.total >= NOTHING]
    for line in [*_failures(found), *splits, *found.answers(), *_cheaper(found)]:
        click.echo(line)


def _about(found: Tradeoff) -> str:
    truth = "none is known" if found.best is None else str(found.truth).replace("_", " ")
    whole = found.scene.world.duration
    until = "" if found.best is None else f", trusted until {found.best.trusted_until:.4g} s of {whole:.4g} s"
    seeds = f", the worst of {len(found.seeds)} seeds" if len(found.seeds) > 1 else ""
    metric = f"{found.metric.name}: {found.metric.about}{seeds}"
    tried = f"{len(found.points)} settings tried, {len(found.pareto)} that nothing beats"
    return f"{metric}; truth: {truth}{until}; {tried}"


def _cells(point: Point) -> list[str]:
    assert point.error is not None and point.cost is not None and point.cost_median is not None
    steps = {"dt", "substeps", "iterations"}
    words = ", ".join(
        f"no {key}" if value is None else f"{key} {shown(value)}"
        for key, value in point.changes.items()
        if key not in steps
    )
    own = point.settings
    return [
        point.engine,
        f"{own.dt:.4g}",
        str(own.substeps),
        str(own.iterations),
        words,
        f"{point.error:.3g}",
        f"{point.cost:.4g}",
        f"{point.cost_median:.4g}",
    ]


def _failures(found: Tradeoff) -> list[str]:
    failed = [point for point in found.points if point.status != "ok"]
    counted = Counter(point.status for point in failed)
    lines = [f"{count} {status}" for status, count in counted.items()]
    told = [f"{called(p)} {p.status}: {p.reason}" for p in failed[:MOST_REASONS]]
    left = [f"{found.untried} left out, as they would have taken too long"] if found.untried else []
    summary = ", ".join([*lines, *left])
    return ([summary] if summary else []) + told


def _split(each: Split) -> str:
    left = f"at most {_part(each.left)} the model, as is left at {each.finest} times the substeps"
    model = left if each.model is None else f"{_part(each.model)} the model"
    parts = f"{_part(each.time_step)} the time step, {_part(each.solver)} the iterations, {model}"
    return f"{each.engine} as the scene has it is {_part(each.total)} off: {parts}"


def _part(metres: float) -> str:
    """Write a part of an error; nobody cares how much rounding it is."""
    return "nothing" if metres < NOTHING else figure(metres, "m")


def _cheaper(found: Tradeoff) -> list[str]:
    return [f"cheaper: {each.sentence}" for each in found.proposals]
