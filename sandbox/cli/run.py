"""`sandbox run`: headless runs, a table on the terminal, a folder of stored runs."""

import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import click

from sandbox.action import Spawn
from sandbox.batch.crew import CrewError, Making, MakingError, make
from sandbox.batch.outcome import Outcome, execute
from sandbox.batch.plan import Job, parse_sweep, plan, repeated_keys
from sandbox.batch.store import Store, StoreError
from sandbox.cli.engine_choice import EngineChoice, only_engine
from sandbox.cli.ledger_table import print_ledgers
from sandbox.cli.naming import engines_in, meant_or_known, plural, with_other_engine
from sandbox.cli.output import require_picture
from sandbox.cli.reading import gathering, paths_of, print_json, refused, scenes_of
from sandbox.cli.scores_table import print_scores, score_rows
from sandbox.cli.table import Row, print_runs
from sandbox.cli.telling import telling
from sandbox.echo import short_repr
from sandbox.engines.registry import able
from sandbox.games.players import PlayerSpec
from sandbox.measure.recorder import TooLargeError, require_memory
from sandbox.measure.seeds import same_chances
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.overrides import AddressError

MAX_MISSED = 3
"""Missed contacts that are named below the table of a single run."""


@click.command(name="run")
@click.argument("scenes", nargs=-1, required=True)
@click.option(
    "--engine",
    "--engines",
    "engines",
    metavar="NAME[,NAME]",
    help="engine or engines to run; default: pymunk, the engine of the session, or the only engine that has a setting "
    "of --set or --sweep",
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=A,B,C",
    help="run once per value; a range is KEY=LOW:HIGH:N[:log]; several sweeps multiply",
)
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
@click.option(
    "--workers", type=click.IntRange(1, 256), default=1, metavar="N", help="number of worker processes; default: 1"
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="store the runs in a folder; runs that are already there are not repeated",
)
@click.option(
    "--plot", type=click.Path(path_type=Path), metavar="FILE", help="draw the run to FILE: .png, .svg or .pdf"
)
@click.option(
    "--body", "bodies", multiple=True, metavar="NAME", help="body to draw with --plot; may be repeated; default: all"
)
@click.option("--audit/--no-audit", default=True, help="count the contacts that the engine misses (tunnelling)")
@click.option(
    "--ledger", "ledger", is_flag=True, help="account for energy by cause; a pymunk run takes 3 to 12 times as long"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("-v", "--verbose", is_flag=True, help="explain every column of the table")
@click.option("--quiet", is_flag=True, help="print no table and no progress")
def command(
    scenes: tuple[str, ...],
    engines: str | None,
    overrides: tuple[str, ...],
    sweeps: tuple[str, ...],
    seeds: int | None,
    player: str | None,
    workers: int,
    out: Path | None,
    plot: Path | None,
    bodies: tuple[str, ...],
    audit: bool,
    ledger: bool,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> int:
    """Run scenes without a window and print the results.

    SCENES are files, folders of files, names of shipped scenes, or recorded sessions (.json). Exit status 1: a run
    diverged or failed, or the engine refused the scene.
    """
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    found: list[tuple[str, str]] = []
    for scene in scenes_of(scenes):
        with gathering(faults):
            found += _runnable(paths_of([scene]))
    sound: list[str] = []
    for sweep in sweeps:
        with gathering(faults, "--sweep", (AddressError,)):
            parse_sweep(sweep)
            sound.append(sweep)
    faults += repeated_keys(overrides, sound, seeds)
    plays: PlayerSpec | None = None
    with gathering(faults):
        plays = None if player is None else PlayerSpec.parse(player)
    jobs: list[Job] = []
    with gathering(faults, "--sweep", (AddressError,)), telling(quiet or as_json) as told:
        jobs = plan(found, names, overrides, sound, seeds, plays, told)
    if names is None and not faults:
        jobs = _on_engines_found(jobs, overrides, sound, quiet)
    if plays is not None and jobs and not any(job.player == plays for job in jobs):
        faults.append(Fault("--player", None, "", "has no use: none of the scenes has a game with rules"))
    if not faults:
        with gathering(faults):
            _check_drawing(plot, bodies, jobs)
            _check_memory(jobs)
    store = None
    if out is not None and not faults:
        with gathering(faults, "--out", (StoreError,)):
            store = Store(out, _give_notice)
    if faults:
        return refused(faults, as_json, runs=[])

    if not quiet:
        _tell_if_nothing_is_random(jobs)
    status, was_interrupted = 0, False
    is_single = all(len(job.scene.bodies) == 1 for job in jobs)  # then the table can show the final position
    making = Making(out, audit, ledger, as_json or is_single)
    made: dict[int, Row] = {}
    drawn: Outcome | None = None
    try:
        with _progress(jobs, quiet or as_json) as heard:
            drawn = _make(jobs, workers, making, store, made, heard)
    except KeyboardInterrupt:
        status, was_interrupted = 130, True
        click.echo(f"interrupted: {len(made)} of {len(jobs)} runs are complete and kept", err=True)
    except MakingError as error:
        status = 2
        click.echo(str(error), err=True)
    except CrewError as error:
        status = 1
        click.echo(f"--workers: {error}; {len(made)} of {len(jobs)} runs are complete and kept", err=True)
    finally:
        if store is not None:
            store.close()
    rows = [made[k] for k in sorted(made)]

    for k, row in sorted(made.items()):
        if row["status"] != "ok":
            status = status or 1
            advice = with_other_engine(jobs[k].scene, names is not None) if row["status"] == "refused" else ""
            click.echo(f"{row['scene']}: {row['status']}: {row['reason']}{advice}", err=True)
        if "damaged" in row:
            click.echo(f"{row['damaged']}; the run was repeated", err=True)
        if row.get("replayed") is False:
            status = status or 1
            what = "state" if row.get("otherwise") is None else f"game, from {row['otherwise']:g} s on,"
            message = f"ended in a different {what} than the session; a possible cause is another version of an engine"
            click.echo(f"{row['scene']}: {message}", err=True)
    if as_json:
        spread = score_rows(rows) if seeds is not None else []
        print_json({"runs": rows, **({"scores": spread} if spread else {}), "interrupted": was_interrupted})
    elif not quiet and rows:
        print_runs(rows, verbose)
        if drawn is not None:
            _print_missed(drawn)
        if seeds is not None:
            print_scores(score_rows(rows))
        if ledger:
            print_ledgers(rows)
        if out is not None:
            click.echo(f"stored: {out}")
        if len(rows) == 1 and not (overrides or sweeps or plot or out or verbose or status):
            _suggest_next(rows[0]["scene"])
    if plot is not None and drawn is not None and len(drawn.trajectory.time):
        from sandbox.report.plots import plot_run

        try:
            plot_run(drawn.trajectory, jobs[0].scene, plot, list(bodies) or None)
        except OSError as error:
            click.echo(f"--plot: {plot}: {error.strerror or error}", err=True)
            return status or 2
        if not quiet and not as_json:
            click.echo(f"drawn: {plot}")
    return status


def _runnable(paths: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return names and files of scenes.

    Raises:
        SceneError: one is a stored run.
    """
    reason = "is a stored run, not a scene; `sandbox export` and `sandbox replay` read it"
    stored = [Fault(name, None, "", reason) for name, path in paths if path.lower().endswith(".npz")]
    if stored:
        raise SceneError(stored)
    return paths


def _on_engines_found(jobs: list[Job], overrides: Sequence[str], sweeps: Sequence[str], quiet: bool) -> list[Job]:
    """Return the runs, each on the one engine that can make it where the usual one lacks a setting that was given.

    All runs of a scene stay on one engine. A recorded session stays on its own.
    """
    axes = [parse_sweep(sweep) for sweep in sweeps]
    found: dict[str, EngineChoice] = {}
    for label in dict.fromkeys(job.label for job in jobs if not job.recorded):
        own = [job for job in jobs if job.label == label]
        if all(own[0].engine in able(job.scene) for job in own):
            continue
        choice = only_engine([job.scene for job in own], overrides, axes)
        if choice is not None:
            found[label] = choice
    if not quiet:
        for sentence in dict.fromkeys(choice.sentence for choice in found.values()):
            click.echo(sentence, err=True)
    return [replace(job, engine=found[job.label].engine) if job.label in found else job for job in jobs]


def _print_missed(outcome: Outcome) -> None:
    """Print the first contacts that the engine missed, and the number of the others."""
    run, fixed = outcome.trajectory, outcome.job.scene.fixed_names
    missed = list(zip(run.missed_time.tolist(), run.missed_pair.tolist(), strict=True))
    for time, pair in missed[:MAX_MISSED]:
        one, other = (short_repr(str(run.names[k]) if k >= 0 else fixed[-1 - k]) for k in pair)
        click.echo(f"missed: contact of {one} with {other} at {time:.4g} s")
    if len(missed) > MAX_MISSED:
        click.echo(f"missed: and {len(missed) - MAX_MISSED:,} more")


def _suggest_next(scene: str) -> None:
    """Print what may follow a plain run of one scene, on a terminal only."""
    if sys.stdout.isatty() and not scene.endswith(".json"):
        name = shlex.quote(scene)
        click.secho(f"next: sandbox compare {name} (error of each engine), sandbox play {name} (window)", dim=True)


def _check_drawing(plot: Path | None, bodies: tuple[str, ...], jobs: list[Job]) -> None:
    """Refuse before the run what could not be drawn after it."""
    faults: list[Fault] = []

    def fault(option: str, message: str) -> None:
        faults.append(Fault(option, None, "", message))

    if plot is None and bodies:
        fault("--body", "works only together with --plot FILE")
    if plot is not None:
        if len(jobs) != 1:
            remedy = "run one scene on one --engine, without --sweep and --seeds"
            several = "sandbox compare SCENE --out DIR plots several engines"
            fault("--plot", f"draws a single run, but this command makes {len(jobs):,}; {remedy}; {several}")
        with gathering(faults):
            require_picture(plot)
        names = jobs[0].scene.bodies.names
        for name in bodies:
            if name not in names:
                fault("--body", f"no body is named {short_repr(name)}; {meant_or_known(name, names)}")
    if faults:
        raise SceneError(faults)


def _tell_if_nothing_is_random(jobs: list[Job]) -> None:
    """Say so where runs of several seeds will all be the same."""
    for label in dict.fromkeys(job.label for job in jobs):
        # Seeds change fastest: the first two that differ in it have every other value in common.
        if any(job.label == label and job.player is not None for job in jobs):
            continue  # the game and who plays it have chances of their own
        alike = max(job.seeds for job in jobs if job.label == label)
        if alike > 1:
            where = "" if all(job.seeds > 1 for job in jobs if job.label == label) else "for some of the swept values, "
            click.echo(
                f"{label}: {where}nothing is random, so the seeds 1 to {alike} give one and the same run, "
                "which is made once",
                err=True,
            )
            continue
        first, *others = (job.scene for job in jobs if job.label == label)
        other = next((scene for scene in others if scene.world.seed != first.world.seed), first)
        if other is first:
            continue
        if same_chances(first, other):
            click.echo(f"{label}: nothing is random, so all seeds give the same run", err=True)


def _check_memory(jobs: list[Job]) -> None:
    """Refuse all runs where one would not fit, rather than find out after the others."""
    faults = []
    for job in jobs:
        try:
            spawned = sum(isinstance(action, Spawn) for action in job.actions)
            require_memory(job.scene, job.scene.solver, len(job.scene.bodies) + spawned, job.actions)
        except TooLargeError as error:
            faults.append(Fault(job.label, None, "solver.record_every", str(error)))
    if faults:
        raise SceneError(tuple(dict.fromkeys(faults)))


def _give_notice(message: str) -> None:
    click.echo(message, err=True)


Told = Callable[[int, Job, float], None]
"""Called with how many runs are done, the job that is under way, and the share of it that is done."""


def _make(
    jobs: list[Job], workers: int, making: Making, store: Store | None, made: dict[int, Row], told: Told
) -> Outcome | None:
    """Make all runs, and enter each into `made` by its place as it is done; return the outcome of a single one.

    Raises:
        MakingError: a run could not be made.
        CrewError: no worker can be started.
    """
    if min(workers, len(jobs)) > 1:

        def done(place: int, row: Row) -> None:
            made[place] = row
            told(len(made), jobs[place], 0.0)

        make(jobs, workers, making, done, _give_notice)
        return None
    outcome: Outcome | None = None
    for k, job in enumerate(jobs):

        def keep(finished: Outcome, k: int = k) -> None:
            made[k] = finished.row(making.final, making.ledger)

        def under_way(share: float, k: int = k, job: Job = job) -> None:
            told(k, job, share)

        under_way(0.0)
        try:
            outcome = execute(job, store, under_way, making.audit, making.ledger, keep)
        except (TooLargeError, StoreError) as error:
            raise MakingError(job, error) from error
    return outcome if len(jobs) == 1 else None


@contextmanager
def _progress(jobs: list[Job], silent: bool) -> Iterator[Told]:
    """Yield who is told how far the runs are: a bar on a terminal, nothing elsewhere."""
    if silent or not sys.stderr.isatty():
        yield lambda *_: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn()
    with Bars(*columns, console=Console(stderr=True), transient=True) as bars:
        whole = bars.add_task(plural(len(jobs), "run"), total=float(len(jobs)))

        def told(done: int, job: Job, share: float) -> None:
            at = min(done + 1, len(jobs))
            bars.update(whole, description=f"{at}/{len(jobs)} {job.label}", completed=done + share)

        yield told
