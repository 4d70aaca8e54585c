"""Command `shots`: success odds, sensitivity and predictability horizon of a billiard shot."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    make_folder,
    require_folder,
    scene_path,
    write_json,
)
from sandbox.cli.options import (
    FiniteRange,
    OutputOptions,
    json_option,
    out_option,
    quiet_option,
    set_option,
    takes,
    verbose_option,
)
from sandbox.cli.progress import status_line
from sandbox.cli.shots_table import print_study
from sandbox.cli.streams import print_json
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.jsonable import to_json
from sandbox.measure.shots.monte_carlo import DEFAULT_COUNT
from sandbox.measure.shots.predictability import PERTURBATION, TOLERANCE, By
from sandbox.measure.shots.shot import NoSuchShotError, ShotSetup, Spread, shot_setup
from sandbox.measure.shots.study import ShotStudy, pot_of, study_shot
from sandbox.progress import Progress
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import load

DEFAULT = Spread()
FRACTION = FiniteRange(min=0.0, max=1.0)
LENGTH = FiniteRange(min=0.0, min_open=True, max=1.0)


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scene: str
    name: str | None
    overrides: tuple[str, ...]
    aim_error: float
    speed_error: float
    side_error: float
    height_error: float
    count: int
    seed: int | None
    threads: int | None
    slopes: bool
    pots: tuple[str, ...]
    foretold: bool
    nudge: float
    by: By
    tolerance: float
    out: Path | None
    verbose: bool


@dataclass
class _Request:
    """Checked command line: shot, errors and pots to analyse."""

    spread: Spread
    shot: ShotSetup | None
    """None if the scene has faults or is refused"""
    pots: list[tuple[str, str]]
    """ball and pocket of each `--window`"""
    refusal: str = ""
    """reason why the exact engine cannot run the scene"""


@click.command(name="shots")
@click.argument("scene")
@click.option("--shot", "name", metavar="NAME", help="name of the [[shot]]; default: the first")
@set_option()
@click.option(
    "--aim-error",
    type=FRACTION,
    default=DEFAULT.aim,
    metavar="RAD",
    help="standard deviation of the aim, rad; default: 0.002",
)
@click.option(
    "--speed-error",
    type=FRACTION,
    default=DEFAULT.speed,
    metavar="FRACTION",
    help="standard deviation of the speed, as a fraction; default: 0.03",
)
@click.option(
    "--side-error",
    type=FRACTION,
    default=DEFAULT.side,
    metavar="R",
    help="standard deviation of the tip to the side, ball radii; default: 0",
)
@click.option(
    "--height-error",
    type=FRACTION,
    default=DEFAULT.height,
    metavar="R",
    help="standard deviation of the tip's height, ball radii; default: 0",
)
@click.option(
    "--count",
    type=click.IntRange(1, 1_000_000),
    default=DEFAULT_COUNT,
    metavar="N",
    help="number of shots; default: 10,000",
)
@click.option(
    "--seed",
    type=click.IntRange(0, 2**63 - 1),
    metavar="N",
    help="random seed of the errors; default: the seed of the scene",
)
@click.option(
    "--threads",
    type=click.IntRange(1, 1024),
    metavar="N",
    help="number of threads; default: one per core; results do not depend on it",
)
@click.option(
    "--sensitivity", "slopes", is_flag=True, help="derivatives of the rest positions by aim, speed, side and height"
)
@click.option(
    "--window",
    "pots",
    multiple=True,
    metavar="BALL:POCKET",
    help="interval of aims for which BALL falls into POCKET; may be repeated",
)
@click.option("--horizon", "foretold", is_flag=True, help="time after which the shot cannot be predicted")
@click.option(
    "--nudge",
    type=LENGTH,
    default=PERTURBATION,
    metavar="X",
    help="perturbation for --horizon, rad or m; default: 1e-9",
)
@click.option(
    "--by",
    type=click.Choice(["aim", "place"]),
    default="aim",
    help="quantity that --horizon perturbs: the aim or the position of the ball",
)
@click.option(
    "--tolerance",
    type=LENGTH,
    default=TOLERANCE,
    metavar="M",
    help="position difference that ends the horizon, m; default: 0.001",
)
@out_option("write shots.json, rests.png and aims.png")
@verbose_option
@json_option
@quiet_option()
@takes(_Options)
def shots_command(options: _Options) -> int:
    """Play a shot many times with random errors of the player, and print the odds of each outcome.

    SCENE is a file or the name of a shipped scene, with a [surface] and a [[shot]]. Errors are normally distributed.
    """
    faults: list[Fault] = []
    request = _checked(options, faults)
    if options.out is not None and request.shot is not None and not faults:
        with collect_errors(faults):
            make_folder(options.out)
    if faults:
        return exit_with_errors(faults, options.as_json, scene=options.scene, status="refused", odds=None)
    if request.shot is None:
        return _failed(options, "refused", request.refusal)
    try:
        found = _study(request.shot, request, options)
    except Exhaustion as error:
        return _failed(options, "failed", str(error))
    document = {"scene": options.scene, "status": "ok", "reason": None, **to_json(found)}
    if options.as_json:
        print_json(document)
    elif not options.quiet:
        print_study(options.scene, found, options.verbose)
    status = 0 if found.answered else 1
    if found.odds.interrupted:
        played = f"{found.odds.count:,} of {options.count:,} shots were played and are counted"
        click.echo(f"interrupted: {played}", err=True)
        status = 130
    elif found.interrupted:
        click.echo("interrupted: the odds and all other completed results are kept", err=True)
        status = 130
    return max(status, _write(found, document, options))


def _checked(options: _Options, faults: list[Fault]) -> _Request:
    """Return the request of the command line; add its errors to the faults."""
    request = _Request(DEFAULT, None, [])
    with collect_errors(faults, "--aim-error, --speed-error, --side-error, --height-error", (ValueError,)):
        request.spread = Spread(options.aim_error, options.speed_error, options.side_error, options.height_error)
    for flag, value in (("--nudge", options.nudge), ("--tolerance", options.tolerance)):
        if math.isnan(value):
            faults.append(Fault.of(flag, "is not a number; it must be positive and finite"))
    with collect_errors(faults), collect_errors(faults, options.scene, (NoSuchShotError,)):
        try:
            request.shot = shot_setup(load(scene_path(options.scene), options.overrides), options.name)
        except Refusal as refusal:
            request.refusal = str(refusal)
    if request.shot is not None:
        for pot in options.pots:
            with collect_errors(faults, "--window", (NoSuchShotError,)):
                request.pots.append(pot_of(request.shot, pot))
    with collect_errors(faults):
        require_folder(options.out)
    return request


def _study(attempt: ShotSetup, request: _Request, options: _Options) -> ShotStudy:
    """Play the shots.

    Raises:
        Exhaustion: the shot without error does not come to rest.
    """
    with status_line(options.is_silent) as show:

        def report(progress: Progress) -> None:
            assert show is not None
            percent = 100.0 * (progress.fraction or 0.0)
            show(Progress(f"playing {options.count:,} shots: {percent:.0f} %", progress.fraction))

        return study_shot(
            attempt,
            request.spread,
            count=options.count,
            seed=options.seed,
            threads=options.threads or os.cpu_count() or 1,
            slopes=options.slopes,
            pots=request.pots,
            foretold=options.foretold,
            nudge=options.nudge,
            by=options.by,
            tolerance=options.tolerance,
            on_progress=None if show is None else report,
        )


def _failed(options: _Options, status: str, reason: str) -> int:
    """Print the reason why there are no odds, and return the exit status."""
    click.echo(f"{options.scene}: {status}: {reason}", err=True)
    if options.as_json:
        print_json({"scene": options.scene, "status": status, "reason": reason, "odds": None})
    return 1


def _write(found: ShotStudy, document: dict[str, Any], options: _Options) -> int:
    """Write the document and the plots into the folder of `--out`; return 2 if they cannot be written."""
    if options.out is None:
        return 0
    from sandbox.report.shots_plot import plot_shots

    try:
        write_json(document, options.out / "shots.json")
        plot_shots(found, options.out)
    except OSError as error:
        return exit_with_errors([Fault.of("--out", f"{error.filename}: {error.strerror}")])
    if not options.is_silent:
        click.echo(f"written: {options.out}")
    return 0
