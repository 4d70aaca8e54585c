"""Dry runs of `run`: the plan, and an estimate of its time and size from a few of its runs, which are made for it."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Protocol

import click

from sandbox.batch.driver import MAX_MEMBERS
from sandbox.batch.executors import InProcessExecutor, RunTask
from sandbox.batch.job import CompletedRun, RunOptions
from sandbox.batch.plan import Plan, PlannedRun
from sandbox.batch.store import Store
from sandbox.cli.progress import duration_text
from sandbox.cli.streams import print_json
from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.formatting import format_plural
from sandbox.jsonable import in_json, to_json

MAX_SAMPLES = 5
"""Runs that are made for the estimate: the first values of all axes, and the last ones of each"""
MAX_TIME = 10.0
"""s that they take together"""
MAX_LOOKED_UP = 100_000
"""Runs that are looked up in the store"""


class EstimateOptions(Protocol):
    """Options of `run` that an estimate depends on."""

    @property
    def out(self) -> Path | None:
        """Folder of the store."""
        ...

    @property
    def workers(self) -> int | None:
        """Number of worker processes."""
        ...

    @property
    def as_json(self) -> bool:
        """Print a JSON document."""
        ...


@dataclass(frozen=True, kw_only=True)
class EstimateDocument:
    """JSON document of `run --dry-run`."""

    runs: int
    """number of runs; an upper bound where seeds may turn out to give one run"""
    stored: int
    """runs that the store has already"""
    scenes: int
    points: int
    """combinations of swept and sampled values"""
    seeds: int
    engines: int
    measured: int
    """runs that were made for the estimate"""
    seconds_per_run: float | None
    """s, mean computing time of these; None if none could be made"""
    seconds: float | None
    """s, estimated time of all runs that are not stored, with the given workers"""
    bytes: int | None
    """estimated size of their files"""
    first: str | None = field(metadata=in_json(optional=True))
    """first run of the plan"""


def print_estimate(plan: Plan, count: int, options: RunOptions, store: Store | None, command: EstimateOptions) -> int:
    """Print how many runs a plan has, and an estimate of their time and size; return the exit status.

    Args:
        plan: the plan, checked.
        count: number of its runs, or an upper bound.
        options: how they would be run.
        store: where they are looked up; nothing is stored.
        command: options of the command.
    """
    stored = 0 if options.force else _stored_runs(plan, store)
    samples = _samples(plan)
    measured = _measured_members(plan, options) or _measured(samples, options)
    workers = max(min(command.workers or 1, count), 1)
    missing = count - stored
    each = sum(seconds for seconds, _ in measured) / len(measured) if measured else None
    size = sum(size for _, size in measured) / len(measured) if measured else None
    axes = [len(axis.points) for axis in plan.axes]
    points = 1
    for length in axes:
        points *= length
    document = EstimateDocument(
        runs=count,
        stored=stored,
        scenes=len(plan.scenes),
        points=points,
        seeds=plan.seeds or 1,
        engines=len(plan.engines or (1,)),
        measured=len(measured),
        seconds_per_run=each,
        seconds=None if each is None else each * missing / workers,
        bytes=None if size is None else round(size * missing),
        first=_name(samples[0]) if samples else None,
    )
    if command.as_json:
        print_json(to_json(document))
    else:
        _print(document, plan, axes, workers, command.out)
    return 0


def _print(document: EstimateDocument, plan: Plan, axes: Sequence[int], workers: int, out: Path | None) -> None:
    factors = [format_plural(document.scenes, "scene")]
    factors += [f"{length:,} × {', '.join(axis.keys)}" for axis, length in zip(plan.axes, axes, strict=True)]
    factors += [format_plural(document.seeds, "seed")] if document.seeds > 1 else []
    factors += [format_plural(document.engines, "engine")] if document.engines > 1 else []
    click.echo(f"{format_plural(document.runs, 'run')}: {'; '.join(factors)}")
    if document.stored:
        click.echo(f"{document.stored:,} of them are stored in {out} and will not be repeated")
    if document.first is not None:
        click.echo(f"first: {document.first}")
    if document.seconds is None or document.seconds_per_run is None or document.bytes is None:
        click.echo("no estimate: none of the runs that were tried could be made in time")
        return
    made = format_plural(document.measured, "run")
    click.echo(
        f"about {duration_text(document.seconds)} on {format_plural(workers, 'worker')}, "
        f"{duration_text(document.seconds_per_run)} a run; measured on {made}, not stored"
    )
    if out is not None:
        click.echo(f"about {size_text(document.bytes)} in {out}")


def _samples(plan: Plan) -> list[PlannedRun]:
    """Return the first run of the plan, and runs at the end of each axis."""
    chosen = list(islice(plan, 1))
    return chosen + list(plan.last_of_axes())[: MAX_SAMPLES - 1]


def _measured(samples: Sequence[PlannedRun], options: RunOptions) -> list[tuple[float, int]]:
    """Run samples, and return the computing time, s, and the size of the file of each.

    The first one is run twice, as the first run of a process also loads the code of its engine.
    """
    executor, found = InProcessExecutor(), list[tuple[float, int]]()
    began = perf_counter()
    for planned in (*samples[:1], *samples):
        is_first, elapsed = planned is samples[0] and len(found) == 1, perf_counter() - began
        if found and elapsed > (0.5 * MAX_TIME if is_first else MAX_TIME):
            break
        if is_first:
            found.clear()
        job, start = planned.job(), clock_without_compilation()
        (outcome,) = executor.submit(RunTask((job,), options, {})).result()
        if isinstance(outcome, CompletedRun):
            found.append((clock_without_compilation() - start, len(outcome.arrays or b"")))
    return found


def _measured_members(plan: Plan, options: RunOptions) -> list[tuple[float, int]]:
    """Run members of the first family as one task, and return the time of each after the first one, s.

    Empty if they are not computed in one call.
    """
    first = next(iter(plan), None)
    if first is None or first.family is None:
        return []
    members = [run for run in islice(plan, MAX_MEMBERS) if run.family == first.family]
    executor = InProcessExecutor()
    began = clock_without_compilation()
    pilot, *others = executor.submit(plan.member_task(members, options)).result()
    computed = sum(outcome is not None for outcome in others)
    if not isinstance(pilot, CompletedRun) or not computed or computed < len(others):
        return []
    return [((clock_without_compilation() - began - pilot.elapsed) / computed, 0)] * computed


def _stored_runs(plan: Plan, store: Store | None) -> int:
    """Return how many of the first `MAX_LOOKED_UP` runs of a plan a store has."""
    if store is None:
        return 0
    runs = islice(plan, MAX_LOOKED_UP)
    return sum(run.plan_key is not None and store.has_planned(run.plan_key) for run in runs)


def _name(planned: PlannedRun) -> str:
    return " ".join((planned.label, planned.engine, *(f"{key}={value}" for key, value in planned.values)))


def size_text(size: float) -> str:
    """Return a size in bytes as text."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size:.0f} B"
