"""`sandbox shots`: how likely a shot is, what it hangs on, and until when anybody could tell."""

import math
import os
from pathlib import Path
from typing import Any

import click

from sandbox.cli.output import make_folder, require_folder, write_json
from sandbox.cli.reading import gathering, path_of, print_json, refused
from sandbox.cli.shots_table import print_study
from sandbox.cli.telling import telling
from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.measure.shots.attempt import Attempt, NoSuchShotError, attempt_of
from sandbox.measure.shots.horizon import NUDGE, TOLERANCE, By
from sandbox.measure.shots.odds import COUNT
from sandbox.measure.shots.spread import Spread
from sandbox.measure.shots.study import Study, pot_of, study
from sandbox.scene.errors import Fault
from sandbox.scene.files.load import load

USUAL = Spread()
SHARE = click.FloatRange(min=0.0, max=1.0)
POSITIVE = click.FloatRange(min=0.0, min_open=True, max=1.0)


@click.command(name="shots")
@click.argument("scene")
@click.option("--shot", "name", metavar="NAME", help="name of the [[shot]]; default: the first")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option(
    "--aim-error",
    type=SHARE,
    default=USUAL.aim,
    metavar="RAD",
    help="standard deviation of the aim, rad; default: 0.002",
)
@click.option(
    "--speed-error",
    type=SHARE,
    default=USUAL.speed,
    metavar="FRACTION",
    help="standard deviation of the speed, as a fraction; default: 0.03",
)
@click.option(
    "--side-error",
    type=SHARE,
    default=USUAL.side,
    metavar="R",
    help="standard deviation of the tip to the side, ball radii; default: 0",
)
@click.option(
    "--height-error",
    type=SHARE,
    default=USUAL.height,
    metavar="R",
    help="standard deviation of the tip's height, ball radii; default: 0",
)
@click.option(
    "--count", type=click.IntRange(1, 1_000_000), default=COUNT, metavar="N", help="number of shots; default: 10,000"
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
    "--nudge", type=POSITIVE, default=NUDGE, metavar="X", help="perturbation for --horizon, rad or m; default: 1e-9"
)
@click.option(
    "--by",
    type=click.Choice(["aim", "place"]),
    default="aim",
    help="quantity that --horizon perturbs: the aim or the position of the ball",
)
@click.option(
    "--tolerance",
    type=POSITIVE,
    default=TOLERANCE,
    metavar="M",
    help="position difference that ends the horizon, m; default: 0.001",
)
@click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help="write shots.json, rests.png and aims.png")
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="no table, no progress")
def command(
    scene: str,
    name: str | None,
    overrides: tuple[str, ...],
    aim_error: float,
    speed_error: float,
    side_error: float,
    height_error: float,
    count: int,
    seed: int | None,
    threads: int | None,
    slopes: bool,
    pots: tuple[str, ...],
    foretold: bool,
    nudge: float,
    by: By,
    tolerance: float,
    out: Path | None,
    as_json: bool,
    quiet: bool,
) -> int:
    """Play a shot many times with random errors of the player, and print the odds of each outcome.

    SCENE is a file or the name of a shipped scene, with a [surface] and a [[shot]]. Errors are normally distributed.
    """
    faults: list[Fault] = []
    spread = USUAL
    with gathering(faults, "--aim-error, --speed-error, --side-error, --height-error", (ValueError,)):
        spread = Spread(aim_error, speed_error, side_error, height_error)
    for flag, figure in (("--nudge", nudge), ("--tolerance", tolerance)):
        if math.isnan(figure):
            faults.append(Fault(flag, None, "", "is not a number; it must be positive and finite"))
    attempt: Attempt | None = None
    wanted: list[tuple[str, str]] = []
    reason = ""
    with gathering(faults), gathering(faults, scene, (NoSuchShotError,)):
        try:
            attempt = attempt_of(load(path_of(scene), overrides), name)
        except Refusal as refusal:
            reason = str(refusal)
    if attempt is not None:
        for pot in pots:
            with gathering(faults, "--window", (NoSuchShotError,)):
                wanted.append(pot_of(attempt, pot))
    with gathering(faults):
        require_folder(out)
    if faults:
        return refused(faults, as_json, scene=scene, status="refused", odds=None)
    if attempt is None:
        return _failed(scene, "refused", reason, as_json)
    if out is not None:
        with gathering(faults):
            make_folder(out)
        if faults:
            return refused(faults, as_json, scene=scene, status="refused", odds=None)
    try:
        with telling(quiet or as_json) as told:
            say = None if told is None else lambda share: told(f"playing {count:,} shots: {100.0 * share:.0f} %")
            found = study(
                attempt, spread, count=count, seed=seed, threads=threads or os.cpu_count() or 1, slopes=slopes,
                pots=wanted, foretold=foretold, nudge=nudge, by=by, tolerance=tolerance,
                progress=say,
            )  # fmt: skip
    except Exhaustion as error:
        return _failed(scene, "failed", str(error), as_json)
    document = {"scene": scene, "status": "ok", "reason": None, **found.document()}
    if as_json:
        print_json(document)
    elif not quiet:
        print_study(scene, found)
    status = 0 if found.answered else 1
    if found.odds.interrupted:
        click.echo(f"interrupted: {found.odds.count:,} of {count:,} shots were played and are counted", err=True)
        status = 130
    elif found.interrupted:
        click.echo("interrupted: the odds and all other completed results are kept", err=True)
        status = 130
    return max(status, _kept(found, document, out, quiet or as_json))


def _failed(scene: str, status: str, reason: str, as_json: bool) -> int:
    click.echo(f"{scene}: {status}: {reason}", err=True)
    if as_json:
        print_json({"scene": scene, "status": status, "reason": reason, "odds": None})
    return 1


def _kept(found: Study, document: dict[str, Any], out: Path | None, silent: bool) -> int:
    """Write what was asked for, and say so; return 2 where something cannot be written."""
    if out is None:
        return 0
    from sandbox.report.shots import plot_shots

    try:
        write_json(document, out / "shots.json")
        plot_shots(found, out)
    except OSError as error:
        return refused([Fault("--out", None, "", f"{error.filename}: {error.strerror}")])
    if not silent:
        click.echo(f"written: {out}")
    return 0
