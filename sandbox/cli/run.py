"""Command `run`: headless runs, their table, and a folder of stored runs."""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from sandbox.action import Spawn
from sandbox.batch.executors import Executor, ExecutorError, InProcessExecutor, JobError, ProcessExecutor, Result
from sandbox.batch.job import RunOptions, RunRecord
from sandbox.batch.plan import Job, plan
from sandbox.batch.run_row import RunRow
from sandbox.batch.store import Store, StoreError
from sandbox.batch.sweep import parse_sweep, repeated_keys
from sandbox.cli.common import (
    EngineChoice,
    collect_errors,
    engine_advice,
    exit_with_errors,
    expand_folders,
    only_engine,
    parse_engines,
    plural,
    require_plot_file,
    scene_paths,
    suggest_names,
)
from sandbox.cli.options import (
    OutputOptions,
    engines_option,
    json_option,
    out_option,
    plot_option,
    quiet_option,
    set_option,
    sweep_option,
    verbose_option,
    workers_option,
)
from sandbox.cli.progress import progress_bars, status_line
from sandbox.cli.run_tables import RunsDocument, print_ledgers, print_runs, print_scores, score_rows
from sandbox.cli.streams import print_json
from sandbox.echo import short_repr
from sandbox.engines.registry import able
from sandbox.games.players import PlayerSpec
from sandbox.jsonable import to_json
from sandbox.measure.run.recorder import TooLargeError, require_memory
from sandbox.measure.seeds import same_random_state
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.overrides import AddressError

MAX_MISSED = 3
"""Missed contacts that are listed below the table of a single run."""


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scenes: tuple[str, ...]
    engines: str | None
    overrides: tuple[str, ...]
    sweeps: tuple[str, ...]
    seeds: int | None
    player: str | None
    workers: int
    out: Path | None
    plot: Path | None
    bodies: tuple[str, ...]
    audit: bool
    ledger: bool
    verbose: bool


@dataclass
class _Batch:
    """Runs of the command: jobs and completed runs."""

    jobs: list[Job]
    rows: dict[int, RunRow] = field(default_factory=dict)
    """rows of completed runs by the index of their job"""
    single: RunRecord | None = None
    """the run, if there is only one and it was made in this process"""
    status: int = 0
    """exit status: 130 interrupted, 2 a job could not be run, 1 no worker could be started"""

    def add(self, result: Result) -> None:
        """Add a completed run."""
        self.rows[result.index] = result.row
        if len(self.jobs) == 1:
            self.single = result.record

    @property
    def ordered_rows(self) -> list[RunRow]:
        """Rows of completed runs in the order of the jobs."""
        return [self.rows[index] for index in sorted(self.rows)]


@click.command(name="run")
@click.argument("scenes", nargs=-1, required=True)
@engines_option(
    "pymunk, the engine of the session, or the only engine that has a setting of --set or --sweep",
)
@set_option()
@sweep_option
@click.option(
    "--seeds",
    type=click.IntRange(1, 1_000_000),
    metavar="N",
    help="run with the seeds 1 to N; once if nothing in the scene is random",
)
@click.option(
    "--player",
    metavar="WHO",
    help="player of a game: random, skilled, none, or a script file",
)
@workers_option(1, "1")
@out_option("store the runs in a folder; runs that are already there are not repeated")
@plot_option("draw the run to FILE: .png, .svg or .pdf")
@click.option(
    "--body", "bodies", multiple=True, metavar="NAME", help="body to draw with --plot; may be repeated; default: all"
)
@click.option("--audit/--no-audit", default=True, help="count the contacts that the engine misses (tunnelling)")
@click.option(
    "--ledger", "ledger", is_flag=True, help="account for energy by cause; a pymunk run takes 3 to 12 times as long"
)
@json_option
@verbose_option
@quiet_option()
def run_command(**given: Any) -> int:
    """Run scenes without a window and print the results.

    SCENES are files, folders of files, names of shipped scenes, or recorded sessions (.json). Exit status 1: a run
    diverged or failed, or the engine refused the scene.
    """
    options = _Options(**given)
    faults: list[Fault] = []
    jobs = _planned_jobs(options, faults)
    store = None
    if options.out is not None and not faults:
        with collect_errors(faults, "--out", (StoreError,)):
            store = Store(options.out, _print_notice)
    if faults:
        return exit_with_errors(faults, options.as_json, runs=[])
    if not options.quiet:
        _report_equal_seeds(jobs)
    batch = _Batch(jobs)
    try:
        _run_all(batch, options, store)
    finally:
        if store is not None:
            store.close()
    status = _report_problems(batch, is_engine_chosen=options.engines is not None)
    _print_results(batch, options, status)
    return _draw(batch, options, status)


def _planned_jobs(options: _Options, faults: list[Fault]) -> list[Job]:
    """Return all jobs of the command; add its errors to the faults."""
    names = parse_engines(options.engines, faults)
    found: list[tuple[str, str]] = []
    for scene in expand_folders(options.scenes):
        with collect_errors(faults):
            found += _runnable(scene_paths([scene]))
    sweeps: list[str] = []
    for sweep in options.sweeps:
        with collect_errors(faults, "--sweep", (AddressError,)):
            parse_sweep(sweep)
            sweeps.append(sweep)
    faults += repeated_keys(options.overrides, sweeps, options.seeds)
    player: PlayerSpec | None = None
    with collect_errors(faults):
        player = None if options.player is None else PlayerSpec.parse(options.player)
    jobs: list[Job] = []
    with collect_errors(faults, "--sweep", (AddressError,)), status_line(options.is_silent) as progress:
        jobs = plan(found, names, options.overrides, sweeps, options.seeds, player, progress)
    if names is None and not faults:
        jobs = _choose_engines(jobs, options.overrides, sweeps, options.quiet)
    if player is not None and jobs and not any(job.player == player for job in jobs):
        faults.append(Fault("--player", None, "", "has no use: none of the scenes has a game with rules"))
    if not faults:
        with collect_errors(faults):
            _check_drawing(options.plot, options.bodies, jobs)
            _check_memory(jobs)
    return jobs


def _run_all(batch: _Batch, options: _Options, store: Store | None) -> None:
    """Run all jobs, and add each run to the batch when it completes; an interrupt or error ends the batch."""
    jobs = batch.jobs
    is_single = all(len(job.scene.bodies) == 1 for job in jobs)  # then the table can show the final position
    run_options = RunOptions(options.out, options.audit, options.ledger, options.as_json or is_single)
    kept = "of {} runs are complete and kept"
    try:
        with progress_bars(options.is_silent) as bars:
            bar = bars.add(plural(len(jobs), "run"), float(len(jobs)))

            def show(index: int, fraction: float = 0.0) -> None:
                done = len(batch.rows)
                bar.update(done + fraction, f"{min(done + 1, len(jobs))}/{len(jobs)} {jobs[index].label}")

            def done(result: Result) -> None:
                batch.add(result)
                show(result.index)

            executor: Executor
            if min(options.workers, len(jobs)) > 1:
                executor = ProcessExecutor(run_options, options.workers, _print_notice)
            else:
                executor = InProcessExecutor(run_options, store, show)
            for job in jobs:
                executor.submit(job)
            executor.wait(done)
    except KeyboardInterrupt:
        batch.status = 130
        click.echo(f"interrupted: {len(batch.rows)} {kept.format(len(jobs))}", err=True)
    except JobError as error:
        batch.status = 2
        click.echo(str(error), err=True)
    except ExecutorError as error:
        batch.status = 1
        click.echo(f"--workers: {error}; {len(batch.rows)} {kept.format(len(jobs))}", err=True)


def _report_problems(batch: _Batch, is_engine_chosen: bool) -> int:
    """Print a line for each failed or repeated run, and return the exit status."""
    status = batch.status
    for index, row in sorted(batch.rows.items()):
        if row.status != "ok":
            status = status or 1
            advice = engine_advice(batch.jobs[index].scene, is_engine_chosen) if row.status == "refused" else ""
            click.echo(f"{row.scene}: {row.status}: {row.reason}{advice}", err=True)
        if row.damaged is not None:
            click.echo(f"{row.damaged}; the run was repeated", err=True)
        if row.replay is not None and row.replay.replayed is False:
            status = status or 1
            otherwise = None if row.game is None else row.game.otherwise
            subject = "state" if otherwise is None else f"game, from {otherwise:g} s on,"
            message = (
                f"ended in a different {subject} than the session; a possible cause is another version of an engine"
            )
            click.echo(f"{row.scene}: {message}", err=True)
    return status


def _print_results(batch: _Batch, options: _Options, status: int) -> None:
    """Print the JSON document, or the tables."""
    rows = batch.ordered_rows
    if options.as_json:
        scores = score_rows(rows) if options.seeds is not None else []
        print_json(to_json(RunsDocument(runs=rows, scores=scores or None, interrupted=batch.status == 130)))
    elif not options.quiet and rows:
        print_runs(rows, options.verbose)
        if batch.single is not None:
            _print_missed(batch.single)
        if options.seeds is not None:
            print_scores(score_rows(rows))
        if options.ledger:
            print_ledgers(rows)
        if options.out is not None:
            click.echo(f"stored: {options.out}")
        is_plain = not (options.overrides or options.sweeps or options.plot or options.out or options.verbose)
        if len(rows) == 1 and is_plain and not status:
            _suggest_next(rows[0].scene)


def _draw(batch: _Batch, options: _Options, status: int) -> int:
    """Draw the single run to the file of `--plot`, and return the exit status."""
    if options.plot is None or batch.status or batch.single is None or not len(batch.single.trajectory.time):
        return status
    from sandbox.report.run_plot import plot_run

    try:
        plot_run(batch.single.trajectory, batch.jobs[0].scene, options.plot, list(options.bodies) or None)
    except OSError as error:
        click.echo(f"--plot: {options.plot}: {error.strerror or error}", err=True)
        return status or 2
    if not options.is_silent:
        click.echo(f"drawn: {options.plot}")
    return status


def _runnable(paths: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the names and files of scenes and sessions unchanged.

    Raises:
        SceneError: one is a stored run.
    """
    reason = "is a stored run, not a scene; `sandbox export` and `sandbox replay` read it"
    stored = [Fault(name, None, "", reason) for name, path in paths if path.lower().endswith(".npz")]
    if stored:
        raise SceneError(stored)
    return paths


def _choose_engines(jobs: list[Job], overrides: Sequence[str], sweeps: Sequence[str], quiet: bool) -> list[Job]:
    """Return the jobs; if the default engine lacks a given setting, on the only engine that has it.

    All runs of a scene are on one engine. The engine of a recorded session is not changed.
    """
    axes = [parse_sweep(sweep) for sweep in sweeps]
    found: dict[str, EngineChoice] = {}
    for label in dict.fromkeys(job.label for job in jobs if not job.recorded):
        scene_jobs = [job for job in jobs if job.label == label]
        if all(scene_jobs[0].engine in able(job.scene) for job in scene_jobs):
            continue
        choice = only_engine([job.scene for job in scene_jobs], overrides, axes)
        if choice is not None:
            found[label] = choice
    if not quiet:
        for sentence in dict.fromkeys(choice.sentence for choice in found.values()):
            click.echo(sentence, err=True)
    return [replace(job, engine=found[job.label].engine) if job.label in found else job for job in jobs]


def _print_missed(record: RunRecord) -> None:
    """Print the first contacts that the engine missed, and the number of the others."""
    run, fixed = record.trajectory, record.job.scene.fixed_names
    missed = list(zip(run.missed_time.tolist(), run.missed_pair.tolist(), strict=True))
    for time, pair in missed[:MAX_MISSED]:
        one, other = (short_repr(str(run.names[k]) if k >= 0 else fixed[-1 - k]) for k in pair)
        click.echo(f"missed: contact of {one} with {other} at {time:.4g} s")
    if len(missed) > MAX_MISSED:
        click.echo(f"missed: and {len(missed) - MAX_MISSED:,} more")


def _suggest_next(scene: str) -> None:
    """Suggest further commands after a plain run of one scene, on a terminal only."""
    if sys.stdout.isatty() and not scene.endswith(".json"):
        name = shlex.quote(scene)
        click.secho(f"next: sandbox compare {name} (error of each engine), sandbox play {name} (window)", dim=True)


def _check_drawing(plot: Path | None, bodies: tuple[str, ...], jobs: list[Job]) -> None:
    """Check, before the run, that `--plot` can draw it.

    Raises:
        SceneError: it cannot.
    """
    faults: list[Fault] = []

    def fault(option: str, message: str) -> None:
        faults.append(Fault(option, None, "", message))

    if plot is None and bodies:
        fault("--body", "works only together with --plot FILE")
    if plot is not None:
        if len(jobs) != 1:
            remedy = "run one scene on one --engine, without --sweep and --seeds"
            alternative = "sandbox compare SCENE --out DIR plots several engines"
            fault("--plot", f"draws a single run, but this command makes {len(jobs):,}; {remedy}; {alternative}")
        with collect_errors(faults):
            require_plot_file(plot)
        names = jobs[0].scene.bodies.names
        for name in bodies:
            if name not in names:
                fault("--body", f"no body is named {short_repr(name)}; {suggest_names(name, names)}")
    if faults:
        raise SceneError(faults)


def _report_equal_seeds(jobs: list[Job]) -> None:
    """Report scenes without randomness, in which several seeds give the same run."""
    for label in dict.fromkeys(job.label for job in jobs):
        if any(job.label == label and job.player is not None for job in jobs):
            continue  # the game and its player are random
        seed_count = max(job.seeds for job in jobs if job.label == label)
        if seed_count > 1:
            prefix = (
                "" if all(job.seeds > 1 for job in jobs if job.label == label) else "for some of the swept values, "
            )
            click.echo(
                f"{label}: {prefix}nothing is random, so the seeds 1 to {seed_count} give one and the same run, "
                "which is made once",
                err=True,
            )
            continue
        # Seeds change fastest: the first two jobs with different seeds are equal in every other value.
        first, *others = (job.scene for job in jobs if job.label == label)
        other = next((scene for scene in others if scene.world.seed != first.world.seed), first)
        if other is first:
            continue
        if same_random_state(first, other):
            click.echo(f"{label}: nothing is random, so all seeds give the same run", err=True)


def _check_memory(jobs: list[Job]) -> None:
    """Check that every run fits into memory, before the first one.

    Raises:
        SceneError: some do not.
    """
    faults = []
    for job in jobs:
        try:
            spawned = sum(isinstance(action, Spawn) for action in job.actions)
            require_memory(job.scene, job.scene.solver, len(job.scene.bodies) + spawned, job.actions)
        except TooLargeError as error:
            faults.append(Fault(job.label, None, "solver.record_every", str(error)))
    if faults:
        raise SceneError(tuple(dict.fromkeys(faults)))


def _print_notice(message: str) -> None:
    click.echo(message, err=True)
