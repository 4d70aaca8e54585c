"""`sandbox run`: headless runs, a table on the terminal, a folder of stored runs."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from sandbox.action import Spawn
from sandbox.batch.crew import Making, MakingError, make
from sandbox.batch.outcome import Outcome, execute
from sandbox.batch.plan import Job, parse_sweep, plan
from sandbox.batch.store import Store, StoreError
from sandbox.cli.ledger_table import print_ledgers
from sandbox.cli.naming import engines_in, meant_or_known, with_other_engine
from sandbox.cli.output import require_picture
from sandbox.cli.reading import gathering, paths_of, print_json, refused, scenes_of
from sandbox.cli.scores_table import print_scores, score_rows
from sandbox.cli.table import Row, print_runs
from sandbox.games.player import Player
from sandbox.measure.recorder import TooLargeError, require_memory
from sandbox.measure.seeds import same_chances
from sandbox.scene.address import AddressError
from sandbox.scene.faults import Fault, SceneError


@click.command(name="run")
@click.argument("scenes", nargs=-1, required=True)
@click.option(
    "--engine",
    "--engines",
    "engines",
    metavar="NAME[,NAME]",
    help="which engine(s); by default pymunk, or a session's own",
)
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--sweep", "sweeps", multiple=True, metavar="KEY=A,B,C", help="run each value; or KEY=LOW:HIGH:N[:log]")
@click.option(
    "--seeds", type=click.IntRange(1, 1_000_000), metavar="N", help="run the seeds 1 to N; once where nothing is random"
)
@click.option(
    "--player",
    metavar="WHO",
    help="who plays a game: random, skilled, none, or a script file",
)
@click.option("--workers", type=click.IntRange(1, 256), default=1, metavar="N", help="run so many at the same time")
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="store every run in a folder, once")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="draw the run: .png, .svg or .pdf")
@click.option("--body", "bodies", multiple=True, metavar="NAME", help="which bodies to draw")
@click.option("--audit/--no-audit", default=True, help="count the contacts that the engine misses")
@click.option("--ledger", "ledger", is_flag=True, help="account for energy, by cause")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="no table, no progress")
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
    quiet: bool,
) -> int:
    """Run scenes headless and print the results.

    SCENES are files, folders of files, names of shipped scenes, or sessions that the window has recorded (.json).
    """
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    found: list[tuple[str, str]] = []
    for scene in scenes_of(scenes):
        with gathering(faults):
            found += paths_of([scene])
    sound: list[str] = []
    for sweep in sweeps:
        with gathering(faults, "--sweep", (AddressError,)):
            parse_sweep(sweep)
            sound.append(sweep)
    plays: Player | None = None
    with gathering(faults):
        plays = None if player is None else Player.named(player)
    jobs: list[Job] = []
    with gathering(faults, "--sweep", (AddressError,)):
        jobs = plan(found, names, overrides, sound, seeds, plays)
    if plays is not None and jobs and not any(job.player == plays for job in jobs):
        faults.append(Fault("--player", None, "", "no scene given has a game with rules"))
    if not faults:
        with gathering(faults):
            _check_drawing(plot, bodies, jobs)
            _check_memory(jobs)
    store = None
    if out is not None and not faults:
        with gathering(faults, "--out", (StoreError,)):
            store = Store(out)
    if faults:
        return refused(faults, as_json, runs=[])

    if not quiet:
        _tell_if_nothing_is_random(jobs)
    status = 0
    making = Making(out, audit, ledger, as_json)
    made: dict[int, Row] = {}
    drawn: Outcome | None = None
    try:
        with _progress(jobs, quiet or as_json) as told:
            drawn = _make(jobs, workers, making, store, made, told)
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(made)} of {len(jobs)} runs are finished and kept", err=True)
    except MakingError as error:
        status = 2
        click.echo(str(error), err=True)
    finally:
        if store is not None:
            store.close()
    rows = [made[k] for k in sorted(made)]

    for k, row in sorted(made.items()):
        if row["status"] != "ok":
            status = status or 1
            advice = with_other_engine(jobs[k].scene) if row["status"] == "refused" else ""
            click.echo(f"{row['scene']}: {row['status']}: {row['reason']}{advice}", err=True)
        if row.get("replayed") is False:
            status = status or 1
            what = "state" if row.get("otherwise") is None else f"game, from {row['otherwise']:g} s on,"
            message = f"ended in another {what} than the session did; other versions of the engines lead elsewhere"
            click.echo(f"{row['scene']}: {message}", err=True)
    if as_json:
        spread = score_rows(rows) if seeds is not None else []
        print_json({"runs": rows, **({"scores": spread} if spread else {})})
    elif not quiet and rows:
        print_runs(rows)
        if seeds is not None:
            print_scores(score_rows(rows))
        if ledger:
            print_ledgers(rows)
        if out is not None:
            click.echo(f"stored: {out}")
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


def _check_drawing(plot: Path | None, bodies: tuple[str, ...], jobs: list[Job]) -> None:
    """Refuse before the run what could not be drawn after it."""
    faults: list[Fault] = []

    def fault(option: str, message: str) -> None:
        faults.append(Fault(option, None, "", message))

    if plot is None and bodies:
        fault("--body", "says what is drawn, but nothing is; give --plot FILE too")
    if plot is not None:
        if len(jobs) != 1:
            fault("--plot", f"draws one run, but this makes {len(jobs)}")
        with gathering(faults):
            require_picture(plot)
        names = jobs[0].scene.bodies.names
        for name in bodies:
            if name not in names:
                fault("--body", f"no body is named {name!r}; {meant_or_known(name, names)}")
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
            where = (
                "" if all(job.seeds > 1 for job in jobs if job.label == label) else "with some of the swept values, "
            )
            click.echo(f"{label}: {where}nothing in it is random: seeds 1 to {alike} are one run, made once", err=True)
            continue
        first, *others = (job.scene for job in jobs if job.label == label)
        other = next((scene for scene in others if scene.world.seed != first.world.seed), first)
        if other is first:
            continue
        if same_chances(first, other):
            click.echo(f"{label}: nothing in it is random: all seeds are the same run", err=True)


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


Told = Callable[[int, Job, float], None]
"""Called with how many runs are done, the job that is under way, and the share of it that is done."""


def _make(
    jobs: list[Job], workers: int, making: Making, store: Store | None, made: dict[int, Row], told: Told
) -> Outcome | None:
    """Make all runs, and enter each into `made` by its place as it is done; return the outcome of a single one.

    Raises:
        MakingError: a run could not be made.
    """
    if min(workers, len(jobs)) > 1:

        def done(place: int, row: Row) -> None:
            made[place] = row
            told(len(made), jobs[place], 0.0)

        make(jobs, workers, making, done)
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
        whole = bars.add_task(f"{len(jobs)} run(s)", total=float(len(jobs)))

        def told(done: int, job: Job, share: float) -> None:
            at = min(done + 1, len(jobs))
            bars.update(whole, description=f"{at}/{len(jobs)} {job.label}", completed=done + share)

        yield told
