"""`sandbox report`: one page over many scenes, each compared on every engine."""

import math
from pathlib import Path

import click

from sandbox.cli.naming import engines_in
from sandbox.cli.output import reasons_against
from sandbox.cli.reading import gathering, path_of, print_json, refused, scenes_of
from sandbox.echo import MAX_NAMED, shorten
from sandbox.interrupt import uninterrupted
from sandbox.measure.compare import compare
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.tradeoff import tradeoff
from sandbox.measure.versions import machine, versions
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.scene.scene import Scene

USUAL = "benchmark/"
"""Shipped scenes whose names begin so are reported where none is named."""
EFFORT = 1.0
"""Counted work of the search for a trade-off in each scene, about seconds of computing; the runs of the comparison are
its first points and cost nothing more."""
REPEATS = 2
"""Timings of each setting near a front."""
NAME = "report.html"
"""Of the page, where a folder is given."""


@click.command(name="report")
@click.argument("scenes", nargs=-1)
@click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help="engine or engines to run; default: all")
@click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help="set a value of every scene")
@click.option(
    "--effort",
    type=click.FloatRange(min=0.0),
    default=EFFORT,
    metavar="N",
    help=f"effort of the trade-off search in each scene, about 1 per second of computing; default: {EFFORT:g};"
    " 0 skips the search",
)
@click.option(
    "--time-limit",
    "--patience",
    "time_limit",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="S",
    help="time limit of the search in each scene, so results depend on the machine; default: no limit",
)
@click.option("--why", is_flag=True, help="find the setting that matters most to each error; takes many times as long")
@click.option(
    "--out", type=click.Path(path_type=Path), required=True, metavar="PATH", help="file (.html) or folder to write"
)
@click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
@click.option("--quiet", is_flag=True, help="print no progress and no summary")
def command(
    scenes: tuple[str, ...],
    engines: str | None,
    overrides: tuple[str, ...],
    effort: float,
    time_limit: float | None,
    why: bool,
    out: Path,
    as_json: bool,
    quiet: bool,
) -> int:
    """Compare many scenes and write one self-contained HTML page.

    SCENES are files, folders of files, or names of shipped scenes; default: all benchmark scenes. A scene takes about
    10 s of processor time (11 benchmarks took 107 s), a quarter of it with --effort 0.
    """
    faults: list[Fault] = []
    names = engines_in(engines, faults)
    read: list[tuple[str, Scene]] = []
    for name in scenes_of(scenes) or [scene.name for scene in shipped() if scene.name.startswith(USUAL)]:
        with gathering(faults):
            read.append((name, load(path_of(name), overrides)))
    for flag, figure in (("--effort", effort), ("--time-limit", time_limit)):
        if figure is not None and not math.isfinite(figure):
            faults.append(Fault(flag, None, "", f"is {figure:g}; it must be finite"))
    if not read and not faults:
        faults.append(
            Fault("SCENES", None, "", "is missing, and there are no shipped benchmark scenes; name some scenes")
        )
    if not faults:
        with gathering(faults):
            out = _page_path(out)
    if faults:
        return refused(faults, as_json, scenes=[], page=None)

    from sandbox.report.page.document import write_page
    from sandbox.report.page.overview import Overview, SceneReport

    overview, status = Overview(asked=len(read)), 0
    told: list[dict[str, object]] = []
    try:
        for k, (name, scene) in enumerate(read):
            if not quiet:
                click.echo(f"{k + 1}/{len(read)} {name}", err=True)
            try:
                found = compare(scene, names, why=why)
                if found.interrupted:
                    raise KeyboardInterrupt
                weighed = None
                if effort:
                    weighed = tradeoff(
                        scene,
                        names,
                        effort=effort,
                        time_limit=time_limit,
                        repeats=REPEATS,
                        truth=found.best or found.doubt,
                        runs=found.trajectories,
                    )
            except (TooLargeError, SceneError) as error:
                status = 1
                click.echo(f"{name}: {error}", err=True)
                overview.add(SceneReport(name, failure=str(error)))
                told.append(
                    {"scene": name, "title": scene.title, "status": "failed", "reason": str(error), "engines": []}
                )
                continue
            with uninterrupted():
                document = None if weighed is None else weighed.document(name)
                overview.add(SceneReport(name, found, tradeoff=document))
                told.append({**found.document(name), "status": "ok", "reason": None, "tradeoff": document})
            if weighed is not None and weighed.interrupted:
                raise KeyboardInterrupt
    except KeyboardInterrupt:
        status = 130
        click.echo(f"interrupted: {len(told)} of {len(read)} scenes are complete and kept", err=True)
    finally:
        with uninterrupted(), gathering(faults, "--out", (OSError,)):
            write_page(overview.page(), out)
    if faults:
        click.echo(str(faults[0]), err=True)
        return 2
    if as_json:
        answer = {"scenes": told, "page": str(out), "interrupted": status == 130}
        print_json({**answer, "machine": machine(), "versions": versions()})
    elif not quiet:
        click.echo(f"written: {out} ({out.stat().st_size / 1e6:.2g} MB)")
    return status


def _page_path(out: Path) -> Path:
    """Return the file to write: what ends in `.html`, or `report.html` in a folder, which is made.

    Raises:
        SceneError: it cannot be written there.
    """
    try:
        if out.suffix.lower() not in {".html", ".htm"} or out.is_dir():
            out.mkdir(parents=True, exist_ok=True)
            out = out / NAME
        out.parent.mkdir(parents=True, exist_ok=True)
        reasons = reasons_against(out)
    except OSError as error:
        reasons = [error.strerror or str(error)]
    if reasons:
        raise SceneError([Fault("--out", None, "", f"{shorten(str(out), MAX_NAMED)}: {reasons[0]}")])
    return out
