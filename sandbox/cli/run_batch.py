"""Batch of the command `run`: the runs that were asked for, those that are completed, and what went wrong with them."""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace

import click

from sandbox.batch.job import RunOptions, RunRecord
from sandbox.batch.observables import Observable
from sandbox.batch.plan import Plan
from sandbox.batch.run_row import RunRow
from sandbox.batch.study import Study
from sandbox.cli.common import engine_advice, print_faults
from sandbox.cli.streams import JsonSpool
from sandbox.jsonable import to_json
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError

MAX_TABLE = 1_000
"""Runs in a table; of more runs, only their number is printed."""
MAX_PROBLEMS = 100
"""Runs that are not ok and have a line each"""


@dataclass
class RunBatch:
    """Runs of the command: what was asked for, and the completed runs."""

    plan: Plan
    study: Study
    count: int
    """number of runs; an upper bound in a large plan"""
    scene: Scene | None = None
    """of the run, if there is only one"""
    observable: Observable | None = None
    """function of `--observe`"""
    rows: dict[int, RunRow] = field(default_factory=dict)
    """rows of completed runs by their number, if there are few; without those that only JSON prints"""
    spool: JsonSpool | None = None
    """rows of completed runs as JSON, if there are many and --json is given"""
    statuses: Counter[str] = field(default_factory=Counter)
    """number of completed runs by status"""
    warnings: dict[str, None] = field(default_factory=dict)
    """different warnings about runs that are ok, in order"""
    problems: dict[int, str] = field(default_factory=dict)
    """lines about the first runs that are not ok, by their number"""
    games: dict[int, RunRow] = field(default_factory=dict)
    """rows of games over several seeds, whose scores are summarised"""
    faults: list[Fault] = field(default_factory=list)
    """of scenes that were not checked before"""
    record: RunRecord | None = None
    """the run, if there is only one"""
    status: int = 0
    """exit status: 130 interrupted, 2 a job could not be run, 1 no worker could be started"""

    @property
    def is_large(self) -> bool:
        """Whether there are too many runs for a table."""
        return self.count > MAX_TABLE

    @property
    def done(self) -> int:
        """Number of completed runs."""
        return self.statuses.total()

    def add(self, index: int, record: RunRecord, options: RunOptions, is_engine_chosen: bool) -> None:
        """Add a completed run, by its index in the plan."""
        self.statuses[record.stored.status] += 1
        if self.is_large and self.spool is None and record.is_plain:
            return
        row = record.row(options.final, options.ledger)  # takes as long as storing it
        if len(self.warnings) < MAX_PROBLEMS:
            # Of runs that differ in their seeds or values only, each warning is printed once.
            self.warnings |= dict.fromkeys(f"{row.scene}: {each}" for each in row.warnings)
        problem = _problem(row, self, is_engine_chosen)
        if problem and len(self.problems) < MAX_PROBLEMS:
            self.problems[index] = problem
        if not self.is_large:
            self.rows[index] = row
        elif self.spool is not None:
            self.spool.add(index, to_json(row))
        if self.is_large and self.study.seeds is not None and row.game is not None:
            self.games[index] = replace(row, final=None, settings={}, work={})
        if self.count == 1 and record.has_trajectory:
            self.record = record

    @property
    def ordered_rows(self) -> list[RunRow]:
        """Rows of completed runs in the order of the plan."""
        return [self.rows[index] for index in sorted(self.rows)]


def _problem(row: RunRow, batch: RunBatch, is_engine_chosen: bool) -> str:
    """Return the lines about a run that is not ok, was damaged, or ended otherwise than its recording; or nothing."""
    lines = []
    if row.status != "ok":
        advice = ""
        if row.status == "refused":
            with suppress(SceneError):  # of a scene that is stored and was changed since
                advice = engine_advice(batch.scene or batch.plan.scene_of(row.scene), is_engine_chosen)
        lines.append(f"{row.scene}: {row.status}: {row.reason}{advice}")
    if row.damaged is not None:
        lines.append(f"{row.damaged}; the run was repeated")
    if _is_different_replay(row):
        otherwise = None if row.game is None else row.game.otherwise
        subject = "state" if otherwise is None else f"game, from {otherwise:g} s on,"
        lines.append(
            f"{row.scene}: ended in a different {subject} than the session; a possible cause is another version of an "
            "engine"
        )
    return "\n".join(lines)


def _is_different_replay(row: RunRow) -> bool:
    return row.replay is not None and row.replay.replayed is False


def report_problems(batch: RunBatch) -> int:
    """Print the warnings, and the lines about runs that are not ok, and return the exit status."""
    for warning in batch.warnings:
        click.echo(f"* {warning}", err=True)
    for _, problem in sorted(batch.problems.items()):
        click.echo(problem, err=True)
    print_faults(list(dict.fromkeys(batch.faults)))
    not_ok = batch.done - batch.statuses["ok"]
    if not_ok > len(batch.problems):
        click.echo(f"… and {not_ok - len(batch.problems):,} more runs that are not ok", err=True)
    is_wrong = not_ok or batch.faults or any(map(_is_different_replay, batch.rows.values()))
    return batch.status or int(bool(is_wrong))
