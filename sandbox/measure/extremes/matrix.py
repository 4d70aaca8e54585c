"""Matrix: every axis, level and setup, each in a process of its own; their boundaries; pairs; and the scores."""

import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Any

from sandbox.measure.extremes.axes import AXES, PAIRS
from sandbox.measure.extremes.axis import Axis, Pair
from sandbox.measure.extremes.boundary import TOLERANCE, Limit
from sandbox.measure.extremes.cell import Cell
from sandbox.measure.extremes.line import Ask, axis_line, pair_line
from sandbox.measure.extremes.scoring import Score, scores
from sandbox.measure.extremes.setup import Setup, of_engines
from sandbox.measure.extremes.warden import Warden
from sandbox.measure.versions import machine, versions

SECONDS, MEMORY = 30.0, 2048
"""What a cell may take, s, and a worker, MiB; its libraries alone take 600 MiB of address space."""


@dataclass(frozen=True)
class Plan:
    """What is to be run."""

    axes: tuple[Axis, ...] = tuple(AXES.values())
    pairs: tuple[Pair, ...] = PAIRS
    engines: tuple[str, ...] | None = None
    """by default all"""
    overrides: tuple[str, ...] = ()
    """`KEY=VALUE`, of every scene"""
    quick: bool = False
    """few levels, and no halving between them"""
    seconds: float = SECONDS
    memory: int = MEMORY
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)

    def levels(self, axis: Axis) -> tuple[float, ...]:
        """Return the levels of an axis that are run."""
        return axis.quick if self.quick else axis.levels

    def setups(self, of: Axis | Pair) -> tuple[Setup, ...]:
        """Return what an axis or a pair is run on; a pair on no setup that differs by what the pair varies itself."""
        setups = of_engines(of.setups, self.engines)
        varied = {of.first.parameter, of.second.parameter} if isinstance(of, Pair) else set()
        return tuple(setup for setup in setups if not varied & set(setup.changes))


@dataclass(frozen=True)
class Extremes:
    """What came of it."""

    plan: Plan
    cells: tuple[Cell, ...]
    probes: tuple[Cell, ...]
    """between the levels, on the way to boundaries"""
    limits: tuple[Limit, ...]
    pairs: tuple[Cell, ...]
    seconds: float
    interrupted: bool = False
    """what was finished by then is there"""

    @property
    def predictions(self) -> tuple[Score, ...]:
        """How good the forecasts were, over the levels of the axes; the probes are where it is hardest to tell."""
        return scores(self.cells, self.plan.axes)

    def document(self) -> dict[str, Any]:
        """Return it as JSON can hold it."""
        return {
            "cells": [cell.document() for cell in self.cells],
            "limits": [limit.document() for limit in self.limits],
            "predictions": [score.document() for score in self.predictions],
            "pairs": [{"axes": cell.axis.split(": ")[1].split(" × "), **cell.document()} for cell in self.pairs],
            "probes": [cell.document() for cell in self.probes],
            "tolerance": None if self.plan.quick else TOLERANCE,
            "quick": self.plan.quick,
            "set": list(self.plan.overrides),
            "interrupted": self.interrupted,
            "timeout": self.plan.seconds,
            "memory": self.plan.memory,
            "workers": self.plan.workers,
            "seconds": self.seconds,
            "versions": dict(versions()),
            "machine": machine(),
        }


@dataclass(frozen=True)
class Progress:
    """How far it is."""

    done: int
    lines: int
    """of an axis or a pair on a setup, how many are done, and how many there are"""
    cells: int
    failed: int
    what: str
    """what was finished last"""


Watch = Callable[[Progress], None]
Job = Callable[[Ask, Callable[[Cell], None]], Limit | None]
Message = Cell | tuple[Limit | None, str] | BaseException


def extremes(plan: Plan, told: Watch | None = None) -> Extremes:
    """Run a plan; Ctrl-C ends it early, with what is finished.

    Raises:
        WorkerError: no worker can be started.
    """
    began = perf_counter()
    jobs = list(_jobs(plan))
    results = _gather(jobs, plan, told)
    cells = [each for each in results.cells if each.axis in AXES]
    order = _order(plan)
    on_levels = {axis.name: set(plan.levels(axis)) for axis in plan.axes}
    return Extremes(
        plan=plan,
        cells=tuple(sorted((c for c in cells if c.level in on_levels[c.axis]), key=order)),
        probes=tuple(sorted((c for c in cells if c.level not in on_levels[c.axis]), key=order)),
        limits=tuple(sorted(results.limits, key=order)),
        pairs=tuple(sorted((c for c in results.cells if c.axis not in AXES), key=order)),
        seconds=perf_counter() - began,
        interrupted=results.interrupted,
    )


def _jobs(plan: Plan) -> Iterator[tuple[str, Job]]:
    """Yield each line, an axis or a pair on a setup, and how it is done."""
    for axis in plan.axes:
        for setup in plan.setups(axis):
            levels = plan.levels(axis)

            def job(
                ask: Ask, keep: Callable[[Cell], None], axis: Axis = axis, setup: Setup = setup,
                levels: Sequence[float] = levels,
            ) -> Limit | None:  # fmt: skip
                return axis_line(axis, setup, levels, plan.overrides, ask, keep, halve=not plan.quick)

            yield f"{axis.name} on {setup.name}", job
    for pair in plan.pairs:
        for setup in plan.setups(pair):

            def both(ask: Ask, keep: Callable[[Cell], None], pair: Pair = pair, setup: Setup = setup) -> Limit | None:
                pair_line(pair, setup, plan.overrides, ask, keep)
                return None

            yield f"{pair.name} on {setup.name}", both


@dataclass
class _Results:
    cells: list[Cell] = field(default_factory=list)
    limits: list[Limit] = field(default_factory=list)
    interrupted: bool = False


def _gather(jobs: list[tuple[str, Job]], plan: Plan, told: Watch | None) -> _Results:
    """Do all jobs in as many threads as there are workers; each thread has a warden, and waits for it."""
    waiting: SimpleQueue[tuple[str, Job]] = SimpleQueue()
    for each in jobs:
        waiting.put(each)
    said: SimpleQueue[Message] = SimpleQueue()
    wardens = [Warden(plan.seconds, plan.memory) for _ in range(min(plan.workers, max(len(jobs), 1)))]
    threads = [threading.Thread(target=_work, args=(warden, waiting, said), daemon=True) for warden in wardens]
    results, done, failed = _Results(), 0, 0
    try:
        for thread in threads:
            thread.start()
        while done < len(jobs):
            try:
                message = said.get(timeout=0.2)  # else a signal would have to wait
            except Empty:
                continue
            if isinstance(message, BaseException):
                raise message
            if isinstance(message, Cell):
                results.cells.append(message)
                failed += message.verdict == "failed"
                continue
            limit, what = message
            done += 1
            if limit is not None:
                results.limits.append(limit)
            if told is not None:
                told(Progress(done, len(jobs), len(results.cells), failed, what))
    except KeyboardInterrupt:
        results.interrupted = True
    finally:
        while not _closed(wardens, threads):
            results.interrupted = True
    return results


def _closed(wardens: Sequence[Warden], threads: Sequence[threading.Thread]) -> bool:
    """End all workers and wait for the threads; return whether that was done, or cut short by another Ctrl-C."""
    try:
        for warden in wardens:
            warden.close()
        for thread in threads:
            if thread.is_alive():
                thread.join(timeout=5.0)
    except KeyboardInterrupt:
        return False
    return True


def _work(warden: Warden, waiting: "SimpleQueue[tuple[str, Job]]", said: "SimpleQueue[Message]") -> None:
    """Do jobs until none is left, or the warden is closed."""
    while True:
        try:
            what, job = waiting.get_nowait()
        except Empty:
            return
        try:
            said.put((job(warden.ask, said.put), what))
        except InterruptedError:
            return
        except BaseException as error:  # noqa: BLE001, whatever it is, it is raised where somebody waits
            said.put(error)
            return


def _order(plan: Plan) -> Callable[[Cell | Limit], tuple[int, ...]]:
    """Return a key that sorts by axis, setup and level as they are listed: threads finish in any order."""
    every: tuple[Axis | Pair, ...] = (*plan.axes, *plan.pairs)
    names = {each.name: k for k, each in enumerate(every)}
    rows: Mapping[tuple[str, str], int] = {
        (each.name, setup.name): k for each in every for k, setup in enumerate(plan.setups(each))
    }
    levels: dict[tuple[str, float | tuple[float, float]], int] = {}
    for axis in plan.axes:
        levels |= {(axis.name, level): k for k, level in enumerate(plan.levels(axis))}
    for pair in plan.pairs:
        levels |= {(pair.name, both): k for k, both in enumerate(pair.levels)}

    def key(each: Cell | Limit) -> tuple[int, ...]:
        place = names[each.axis], rows[each.axis, each.setup]
        return (*place, levels.get((each.axis, each.level), 0)) if isinstance(each, Cell) else place

    return key
