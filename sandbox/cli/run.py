"""Command `run`: headless runs, their table, and a folder of stored runs."""

import json
import shlex
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from shutil import disk_usage
from typing import Any

import click

from sandbox.action import Spawn
from sandbox.batch.driver import Driver, JobError
from sandbox.batch.executors import Executor, ExecutorError, InProcessExecutor
from sandbox.batch.job import KEEP, Job, KeptParts, RunOptions, RunRecord
from sandbox.batch.observables import Observable, ObservableError
from sandbox.batch.plan import Plan
from sandbox.batch.process_pool import ProcessExecutor
from sandbox.batch.sampling import Sampling
from sandbox.batch.store import DATABASE, Store, StoreError
from sandbox.batch.study import MAX_SEEDS, Study, is_study, key_of
from sandbox.batch.sweep import repeated_keys
from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    expand_folders,
    only_engine,
    parse_engines,
    require_plot_file,
    scene_paths,
    suggest_names,
)
from sandbox.cli.estimate import print_estimate, size_text
from sandbox.cli.options import (
    OutputOptions,
    engines_option,
    json_option,
    out_option,
    plot_option,
    quiet_option,
    set_option,
    sweep_option,
    takes,
    time_limit_option,
    verbose_option,
    workers_option,
)
from sandbox.cli.progress import RunMonitor, status_line
from sandbox.cli.recordings import is_recording, report_remarks
from sandbox.cli.run_batch import MAX_PROBLEMS, RunBatch, report_problems
from sandbox.cli.run_tables import MAX_TIMED, RunsDocument, print_ledgers, print_runs, print_scores, score_rows
from sandbox.cli.streams import JsonSpool, print_json
from sandbox.cli.tables import print_line
from sandbox.echo import short_repr
from sandbox.engines.registry import able
from sandbox.games.players import PlayerSpec
from sandbox.jsonable import to_json
from sandbox.measure.preflight import likely_mistakes
from sandbox.measure.run.recorder import TooLargeError, require_memory
from sandbox.recording_remarks import remarks_on
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.overrides import AddressError

MAX_STATED = 5
"""Swept values that a message states"""
LARGE_STORE = 1e9
"""bytes of a study that are reported after its first run"""
MAX_MISSED = 3
"""Missed contacts that are listed below the table of a single run."""


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scenes: tuple[str, ...]
    engines: str | None
    overrides: tuple[str, ...]
    sweeps: tuple[str, ...]
    sample: str | None
    seeds: int | None
    player: str | None
    workers: int | None
    cluster: str | None
    out: Path | None
    keep: KeptParts | None
    force: bool
    time_limit: float | None
    dry_run: bool
    plot: Path | None
    bodies: tuple[str, ...]
    audit: bool | None
    ledger: bool | None
    observe: str | None
    verbose: bool


@click.command(name="run")
@click.argument("scenes", nargs=-1, required=True)
@engines_option(
    "pymunk, the engine of the session, or the only engine that has a setting of --set or --sweep",
)
@set_option()
@sweep_option
@click.option(
    "--sample",
    metavar="N[:sobol]",
    help="draw N points from the ranges KEY=LOW:HIGH[:log][:int] of --sweep: a Latin hypercube or Sobol points; "
    "N:METHOD:SEED gives a seed",
)
@click.option(
    "--seeds",
    type=click.IntRange(1, MAX_SEEDS),
    metavar="N",
    help="run with the seeds 1 to N; once if nothing in the scene is random",
)
@click.option(
    "--player",
    metavar="WHO",
    help="player of a game: random, skilled, none, or a script file",
)
@workers_option(None, "1")
@click.option(
    "--on", "cluster", metavar="ADDRESS", help="run on the Dask cluster whose scheduler is at tcp://HOST:PORT"
)
@out_option("store the runs in a folder; runs that are already there are not repeated")
@click.option(
    "--keep",
    type=click.Choice(KEEP),
    help="what is stored of a run: all; a summary (figures and final states) without arrays; or only what follows from "
    "its end, without contacts, which lets engines compute many runs in one call; default: all",
)
@click.option("--force", is_flag=True, help="run again, and replace, what is stored already")
@time_limit_option("stop a run after S seconds of computing, and record it as failed")
@click.option("--dry-run", is_flag=True, help="print the number of runs, and estimates of their time and size")
@plot_option("draw the run to FILE: .png, .svg or .pdf")
@click.option(
    "--body", "bodies", multiple=True, metavar="NAME", help="body to draw with --plot; may be repeated; default: all"
)
@click.option(
    "--audit/--no-audit", default=None, help="count the contacts that the engine misses (tunnelling); default: count"
)
@click.option(
    "--ledger",
    "ledger",
    is_flag=True,
    default=None,
    help="account for energy by cause; a pymunk run takes 3 to 12 times as long",
)
@click.option(
    "--observe",
    metavar="FILE.py:FUNCTION",
    help="compute figures of your own: FUNCTION gets the Trajectory of each run and returns a number, a text, or a "
    "dict of them, which become columns",
)
@json_option
@verbose_option
@quiet_option()
@takes(_Options)
def run_command(options: _Options) -> int:
    """Run scenes without a window and print the results.

    SCENES are files, folders of files, names of shipped scenes, recorded sessions (.json), or one study file, which
    names scenes and sweeps. Exit status 1: a run diverged or failed, or the engine refused the scene.
    """
    faults: list[Fault] = []
    study = _study(options, faults)
    plan = None if study is None else _plan(study, options, faults)
    store, batch = None, None
    try:
        if options.out is not None and not faults and _has_store(options.out):
            store = _open_store(options.out, faults)
        if plan is not None and study is not None:
            batch = _checked_batch(plan, study, options, store, faults)
        if options.out is not None and store is None and not (faults or options.dry_run):
            store = _open_store(options.out, faults)
        if faults or batch is None:
            return exit_with_errors(faults, options.as_json, runs=[])
        if not options.quiet:
            _report_equal_seeds(batch.plan)
            _report_unbalanced_sample(study)
        if options.dry_run:
            return print_estimate(batch.plan, batch.count, _run_options(batch, options), store, options)
        _run_all(batch, options, store)
    finally:
        if store is not None:
            store.close()
    for name, remarks in _remarks(batch).items():
        report_remarks(name, remarks)
    _report_mistakes(batch)
    status = report_problems(batch)
    _print_results(batch, options, status)
    return _draw(batch, options, status)


def _has_store(out: Path) -> bool:
    """Return whether a folder has a store; opening reports a path that cannot be used."""
    try:
        return (out / DATABASE).is_file()
    except OSError:  # a name that is too long
        return False


def _open_store(out: Path, faults: list[Fault]) -> Store | None:
    """Open the store of `--out`; add its errors to the faults, and return None if there are any."""
    with collect_errors(faults, "--out", (StoreError,)):
        return Store(out, _print_notice)
    return None


def _study(options: _Options, faults: list[Fault]) -> Study | None:
    """Return what is to be run, from a study file or the command line; None if there are faults."""
    given = Study(
        scenes=options.scenes,
        overrides=options.overrides,
        sweeps=options.sweeps,
        sample=options.sample,
        seeds=options.seeds,
        player=options.player,
        keep=options.keep,
        time_limit=options.time_limit,
        audit=options.audit,
        ledger=options.ledger,
        observe=options.observe,
    )
    if not any(map(is_study, options.scenes)):
        return given
    if len(options.scenes) > 1:
        faults.append(Fault.of(options.scenes[0], "give a study file alone: it names its scenes"))
        return None
    with collect_errors(faults):
        return Study.read(options.scenes[0]).with_options(given)
    return None


def _plan(study: Study, options: _Options, faults: list[Fault]) -> Plan | None:
    """Return the plan of the command; add its errors to the faults, and return None if there are any."""
    stated = ",".join(study.engines) if study.engines and options.engines is None else options.engines
    names = parse_engines(stated, faults)
    found: list[tuple[str, str]] = []
    for scene in expand_folders(study.scenes):
        with collect_errors(faults):
            found += _runnable(scene_paths([scene]))
    axes, wrong = study.axes()
    faults += wrong
    faults += repeated_keys(
        [each if isinstance(each, str) else f"{each[0]}=0" for each in study.overrides],
        [f"{key_of(each)}=0" for each in study.sweeps],
        study.seeds,
    )
    if study.keep == "end" and study.audit:
        faults.append(Fault.of("--audit", "counts contacts, which --keep end leaves out; leave out one of them"))
    player: PlayerSpec | None = None
    with collect_errors(faults):
        player = None if study.player is None else PlayerSpec.parse(study.player)
    if options.cluster is not None and options.workers is not None:
        faults.append(Fault.of("--workers", "is given with --on too; leave out one of them"))
    with collect_errors(faults, "--sweep", (AddressError,)):
        keeps_ends = study.keep == "end" and study.time_limit is None and not study.ledger and not study.audit
        keeps_ends = keeps_ends and study.observe is None
        return Plan(found, names, study.overrides, axes, study.seeds, player, keeps_ends)
    return None


def _checked_batch(
    plan: Plan, study: Study, options: _Options, store: Store | None, faults: list[Fault]
) -> RunBatch | None:
    """Check the plan before its first run; add its errors to the faults, and return None if there are any."""
    memory: dict[Fault, None] = {}
    scenes: list[Scene] = []

    def visit(job: Job) -> None:
        if len(scenes) < 2:
            scenes.append(job.scene)
        fault = _memory_fault(job)
        if fault is not None and len(memory) < MAX_PROBLEMS:
            memory[fault] = None

    def is_stored(plan_key: str) -> bool:
        return store is not None and not options.force and store.has_planned(plan_key)

    if plan.engines is None and not faults:
        _choose_engines(plan, study, options.quiet)
    with collect_errors(faults), status_line(options.is_silent) as progress:
        plan.check(is_stored, visit, progress)
    if plan.player is not None and not plan.has_player and not faults:
        faults.append(Fault.of("--player", "has no use: none of the scenes has a game with rules"))
    observable: Observable | None = None
    with collect_errors(faults, "--observe", (ObservableError,)):
        observable = None if study.observe is None else Observable.read(study.observe)
    count = len(plan)
    scene = scenes[0] if count == 1 and scenes else None
    if not faults:
        if count == 1 and scene is None:  # stored, so that it was not checked
            scene = plan.scene_of(plan.scenes[0][0])
        with collect_errors(faults):
            _check_drawing(options.plot, options.bodies, count, scene)
    faults += memory
    return None if faults else RunBatch(plan, study, count, scene, observable)


def _run_options(batch: RunBatch, options: _Options) -> RunOptions:
    study = batch.study
    return RunOptions(
        audit=study.audit is not False and study.keep != "end",
        ledger=study.ledger is True,
        final=options.as_json or batch.count <= MAX_TIMED,
        keep=study.keep or "all",
        time_limit=study.time_limit,
        force=options.force,
        observable=batch.observable,
    )


def _run_all(batch: RunBatch, options: _Options, store: Store | None) -> None:
    """Run all jobs, and add each run to the batch when it completes; an interrupt or error ends the batch."""
    kept = f"of {batch.count} runs are complete and kept"
    if batch.is_large and options.as_json:
        batch.spool = JsonSpool()
    is_chosen = options.engines is not None
    run_options, compiled = _run_options(batch, options), set[tuple[str, str]]()
    try:
        with RunMonitor(batch.count, options.is_silent) as monitor:

            def done(index: int, record: RunRecord) -> None:
                stored = record.stored
                if not batch.done and not options.is_silent:
                    _note_size(record, batch.count, options)
                batch.add(index, record, run_options, is_chosen)
                name = _name(record.label, stored.engine, dict(record.values))
                monitor.add(name, seconds=stored.seconds, is_ok=stored.status == "ok", is_stored=record.repeated)

            executor = _executor(batch, options, monitor)
            driver = Driver(
                batch.plan,
                batch.count,
                executor,
                run_options,
                store,
                done,
                monitor.start,
                lambda error: batch.faults.extend(error.faults),
                lambda label, engine: _report_members(label, engine, compiled, options),
            )
            driver.run()
    except KeyboardInterrupt:
        batch.status = 130
        click.echo(f"interrupted: {batch.done} {kept}", err=True)
    except JobError as error:
        batch.status = 2
        click.echo(str(error), err=True)
    except ExecutorError as error:
        batch.status = 1
        option = "--on" if options.cluster is not None else "--workers"
        click.echo(f"{option}: {error}; {batch.done} {kept}", err=True)


def _note_size(record: RunRecord, count: int, options: _Options) -> None:
    """After the first run, say how much space all of them take, if it is much."""
    size = (record.stored.size or 0) * count
    if options.out is None or size < LARGE_STORE:
        return
    free = disk_usage(options.out).free
    click.echo(
        f"{count:,} runs of this size take {size_text(size)} in {options.out}, where {size_text(free)} are free; "
        "--keep summary stores figures and final states without arrays",
        err=True,
    )


def _report_members(label: str, engine: str, reported: set[tuple[str, str]], options: _Options) -> None:
    """Report, once, that many runs of a scene are computed in one call."""
    if (label, engine) not in reported and not options.is_silent:
        click.echo(f"{label}: {engine} computes many runs in one compiled call (--keep end)", err=True)
    reported.add((label, engine))


def _executor(batch: RunBatch, options: _Options, monitor: RunMonitor) -> Executor:
    """Return the executor of the command.

    Raises:
        ExecutorError: the cluster cannot be used.
    """
    if options.cluster is not None:
        from sandbox.batch.cluster import ClusterExecutor

        return ClusterExecutor(options.cluster, _print_notice)
    if min(options.workers or 1, batch.count) > 1:
        return ProcessExecutor(min(options.workers or 1, batch.count))
    return InProcessExecutor(monitor.show_fraction)


def _name(scene: str, engine: str, values: Mapping[str, Any]) -> str:
    """Return a run as progress shows it."""
    return " ".join((scene, engine, *(f"{key}={value}" for key, value in values.items())))


def _print_results(batch: RunBatch, options: _Options, status: int) -> None:
    """Print the JSON document, or the tables."""
    rows = batch.ordered_rows
    scores = [] if batch.study.seeds is None else score_rows(rows or [batch.games[k] for k in sorted(batch.games)])
    if options.as_json:
        remarks = _remarks(batch) or None
        document = RunsDocument(runs=rows, scores=scores or None, remarks=remarks, interrupted=batch.status == 130)
        if batch.spool is None:
            print_json(to_json(document))
        else:
            batch.spool.print("runs", {key: value for key, value in to_json(document).items() if key != "runs"})
    elif not options.quiet and batch.done:
        if batch.is_large:
            _print_summary(batch)
        else:
            print_runs(rows, options.verbose)
        if batch.record is not None:
            _print_missed(batch.record, batch.scene)
        print_scores(scores)
        if batch.study.ledger:
            print_ledgers(rows)
        if options.out is not None:
            click.echo(f"stored: {options.out}")
        is_plain = not (options.overrides or options.sweeps or options.plot or options.out or options.verbose)
        if len(rows) == 1 and is_plain and not status:
            _suggest_next(rows[0].scene)


def _remarks(batch: RunBatch) -> dict[str, tuple[str, ...]]:
    """Return the remarks on each recording that has some."""
    found = {label: remarks_on(recording) for label, recording in batch.plan.recordings()}
    return {label: remarks for label, remarks in found.items() if remarks}


def _report_mistakes(batch: RunBatch) -> None:
    """Print the likely mistakes of the first scenes; recordings, which were captured, have none."""
    for label, path in batch.plan.scenes[:MAX_PROBLEMS]:
        if not is_recording(path):
            with suppress(SceneError):  # of a scene that is stored and was changed since
                for mistake in likely_mistakes(batch.scene or batch.plan.scene_of(label)):
                    click.echo(f"* {label}: {mistake.message}", err=True)


def _print_summary(batch: RunBatch) -> None:
    """Print the number of runs by status, for more runs than a table shows."""
    counts = ", ".join(f"{count:,} {status}" for status, count in batch.statuses.most_common())
    click.echo(f"{batch.done:,} runs: {counts}; `sandbox runs DIR` lists and summarises the stored ones")


def _draw(batch: RunBatch, options: _Options, status: int) -> int:
    """Draw the single run to the file of `--plot`, and return the exit status."""
    if options.plot is None or batch.status or batch.record is None or batch.scene is None:
        return status
    from sandbox.report.run_plot import plot_run

    trajectory = batch.record.trajectory
    if not len(trajectory.time):
        return status
    try:
        plot_run(trajectory, batch.scene, options.plot, list(options.bodies) or None)
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
    stored = [Fault.of(name, reason) for name, path in paths if path.lower().endswith(".npz")]
    if stored:
        raise SceneError(stored)
    return paths


def _choose_engines(plan: Plan, study: Study, quiet: bool) -> None:
    """Where the default engine lacks a given setting, let the plan use the only engine that has it.

    All runs of a scene are on one engine. The engine of a recorded session is not changed. Scenes with faults are left
    out; `Plan.check` reports them.
    """
    overrides = [each if isinstance(each, str) else f"{each[0]}={json.dumps(each[1])}" for each in study.overrides]
    if not any(key_of(each).startswith("solver.") for each in (*study.overrides, *study.sweeps)):
        return
    axes = [
        (key, list(dict.fromkeys(str(point[k]) for point in islice(axis.points, MAX_STATED))))
        for axis in plan.axes
        for k, key in enumerate(axis.keys)
    ]
    found: dict[str, Job] = {}
    scenes: dict[str, list[Scene]] = {}
    for planned in plan.representatives():
        with suppress(SceneError):
            job = planned.job()
            if not job.recorded:
                found.setdefault(job.label, job)
                scenes.setdefault(job.label, []).append(job.scene)
    sentences: dict[str, None] = {}
    for label, job in found.items():
        if all(job.engine in able(scene) for scene in scenes[label]):
            continue
        choice = only_engine(scenes[label], overrides, axes)
        if choice is not None:
            plan.chosen[label] = choice.engine
            sentences[choice.sentence] = None
    if not quiet:
        for sentence in sentences:
            click.echo(sentence, err=True)


def _print_missed(record: RunRecord, scene: Scene | None) -> None:
    """Print the first contacts that the engine missed, and the number of the others."""
    if scene is None or not record.stored.missed_contacts or not record.has_trajectory:
        return
    run, fixed = record.trajectory, scene.fixed_names
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
        print_line(f"next: sandbox compare {name} (error of each engine), sandbox play {name} (window)", "dim")


def _check_drawing(plot: Path | None, bodies: tuple[str, ...], count: int, scene: Scene | None) -> None:
    """Check, before the run, that `--plot` can draw it.

    Raises:
        SceneError: it cannot.
    """
    faults: list[Fault] = []

    def fault(option: str, message: str) -> None:
        faults.append(Fault.of(option, message))

    if plot is None and bodies:
        fault("--body", "works only together with --plot FILE")
    if plot is not None:
        if count != 1:
            remedy = "run one scene on one --engine, without --sweep and --seeds"
            alternative = "sandbox compare SCENE --out DIR plots several engines"
            fault("--plot", f"draws a single run, but this command makes {count:,}; {remedy}; {alternative}")
        with collect_errors(faults):
            require_plot_file(plot)
        names = () if scene is None else scene.bodies.names
        for name in bodies if scene is not None else ():
            if name not in names:
                fault("--body", f"no body is named {short_repr(name)}; {suggest_names(name, names)}")
    if faults:
        raise SceneError(faults)


def _report_equal_seeds(plan: Plan) -> None:
    """Report scenes without randomness, in which several seeds give the same run."""
    for label, _ in plan.scenes:
        alike, points = plan.alike_points(label)
        if alike:
            prefix = "" if alike == points else "for some of the swept values, "
            click.echo(
                f"{label}: {prefix}nothing is random, so the seeds 1 to {plan.seeds} give one and the same run, "
                "which is made once",
                err=True,
            )
        elif plan.has_useless_seeds(label):
            click.echo(f"{label}: nothing is random, so all seeds give the same run", err=True)


def _report_unbalanced_sample(study: Study | None) -> None:
    """Report a number of Sobol points that do not fill the ranges evenly."""
    if study is None or study.sample is None or (sampling := Sampling.parse(study.sample)).is_balanced:
        return
    lower = 1 << (sampling.count.bit_length() - 1)
    click.echo(
        f"--sample: Sobol points fill the ranges evenly for powers of two, such as {lower} or {2 * lower}", err=True
    )


def _memory_fault(job: Job) -> Fault | None:
    """Return a fault if the frames of a run do not fit into memory."""
    try:
        spawned = job.scene.spawned_by_events + sum(isinstance(action, Spawn) for action in job.actions)
        require_memory(job.scene, job.scene.solver, len(job.scene.bodies) + spawned, job.actions)
    except TooLargeError as error:
        return Fault(job.label, None, "solver.record_every", str(error))
    return None


def _print_notice(message: str) -> None:
    click.echo(message, err=True)
