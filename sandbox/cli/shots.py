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
from sandbox.scene.faults import Fault
from sandbox.scene.file import load

USUAL = Spread()
SHARE = click.FloatRange(min=0.0, max=1.0)
POSITIVE = click.FloatRange(min=0.0, min_open=True, max=1.0)


@click.command(name="shots")
@click.argument("scene")
@click.option("--shot", "name", metavar="NAME", help="which [[shot]]; by default the first")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of the scene")
@click.option("--aim-error", type=SHARE, default=USUAL.aim, metavar="RAD", help="how far aim strays; by default 0.002")
@click.option(
    "--speed-error", type=SHARE, default=USUAL.speed, metavar="SHARE", help="how far speed strays; by default 0.03"
)
@click.option("--side-error", type=SHARE, default=USUAL.side, metavar="R", help="of the tip, in radii; by default 0")
@click.option("--height-error", type=SHARE, default=USUAL.height, metavar="R", help="likewise, up and down")
@click.option("--count", type=click.IntRange(1, 1_000_000), default=COUNT, metavar="N", help="shots; by default 10,000")
@click.option("--seed", type=click.IntRange(0, 2**63 - 1), metavar="N", help="of the errors; by default the scene's")
@click.option("--threads", type=click.IntRange(1, 1024), metavar="N", help="by default one a core; changes no figure")
@click.option("--sensitivity", "slopes", is_flag=True, help="how far rests move with aim, speed, side and height")
@click.option(
    "--window", "pots", multiple=True, metavar="BALL:POCKET", help="between which aims a ball falls into a pocket"
)
@click.option("--horizon", "foretold", is_flag=True, help="the time from which the shot cannot be predicted")
@click.option("--nudge", type=POSITIVE, default=NUDGE, metavar="X", help="of the horizon, rad or m; by default 1e-9")
@click.option(
    "--by", type=click.Choice(["aim", "place"]), default="aim", help="what is nudged: the aim, or the ball's place"
)
@click.option("--tolerance", type=POSITIVE, default=TOLERANCE, metavar="M", help="of the horizon, m; by default 0.001")
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
    """Play a shot many times with a player's errors, and print the odds of each outcome.

    SCENE is a file or a shipped one, with a [surface] and a [[shot]]. Errors are standard deviations of normal ones.
    """
    faults: list[Fault] = []
    spread = USUAL
    with gathering(faults, "--aim-error, --speed-error, --side-error, --height-error", (ValueError,)):
        spread = Spread(aim_error, speed_error, side_error, height_error)
    for flag, figure in (("--nudge", nudge), ("--tolerance", tolerance)):
        if math.isnan(figure):
            faults.append(Fault(flag, None, "", "is no number; it is positive and finite"))
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
        click.echo(f"interrupted: {found.odds.count:,} of {count:,} shots are played and counted", err=True)
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
