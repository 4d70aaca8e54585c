"""Command `report`: one page on many scenes, each compared on every engine."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sandbox.cli.common import (
    collect_errors,
    exit_with_errors,
    expand_folders,
    parse_engines,
    reasons_not_writable,
)
from sandbox.cli.options import (
    NOT_NEGATIVE,
    OutputOptions,
    engines_option,
    json_option,
    quiet_option,
    set_option,
    takes,
    time_limit_option,
)
from sandbox.cli.recordings import read_scene, report_remarks
from sandbox.cli.streams import print_json
from sandbox.echo import MAX_NAMED, shorten
from sandbox.measure.compare import compare
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.tradeoff import Tradeoff, tradeoff
from sandbox.provenance import machine, versions
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.signals import defer_interrupt

if TYPE_CHECKING:
    from sandbox.report.html.overview import Overview

DEFAULT_SCENES = "benchmark/"
"""Prefix of the shipped scenes that are reported if none is named."""
EFFORT = 1.0
"""Default effort of the trade-off search in each scene, about seconds of computing. Runs of the comparison are its
first points, without further cost."""
REPEATS = 2
"""Timings of each setting near a front."""
FILE_NAME = "report.html"
"""Name of the page in a folder."""


@dataclass(frozen=True, kw_only=True)
class _Options(OutputOptions):
    """The command line as typed; None for an option that was left out."""

    scenes: tuple[str, ...]
    engines: str | None
    overrides: tuple[str, ...]
    effort: float
    time_limit: float | None
    why: bool
    out: Path
    quiet: bool


@dataclass
class _Report:
    """Scenes of the command, and the results so far."""

    engines: list[str] | None
    scenes: list[tuple[str, Scene]]
    """name as given, and scene"""
    overview: "Overview"
    documents: list[dict[str, object]] = field(default_factory=list)
    """JSON documents of the scenes"""
    status: int = 0
    """exit status: 1 a scene could not be compared, 130 interrupted"""


@click.command(name="report")
@click.argument("scenes", nargs=-1)
@engines_option("all")
@set_option("set a value of every scene")
@click.option(
    "--effort",
    type=NOT_NEGATIVE,
    default=EFFORT,
    metavar="N",
    help=f"effort of the trade-off search in each scene, about 1 per second of computing; default: {EFFORT:g};"
    " 0 skips the search",
)
@time_limit_option("time limit of the search in each scene, so results depend on the machine; default: no limit")
@click.option("--why", is_flag=True, help="find the setting that matters most to each error; takes many times as long")
@click.option(
    "--out", type=click.Path(path_type=Path), required=True, metavar="PATH", help="file (.html) or folder to write"
)
@json_option
@quiet_option("print no progress and no summary")
@takes(_Options)
def report_command(options: _Options) -> int:
    """Compare many scenes and write one self-contained HTML page.

    SCENES are files, folders of files, names of shipped scenes, or recorded sessions (.json), whose scenes are compared
    without their actions; default: all benchmark scenes. A scene takes about 10 s of processor time (11 benchmarks took
    107 s), a quarter of it with --effort 0.
    """
    faults: list[Fault] = []
    engines = parse_engines(options.engines, faults)
    remarks: dict[str, tuple[str, ...]] = {}
    scenes = _read_scenes(options, remarks, faults)
    out = options.out
    if not faults:
        with collect_errors(faults):
            out = _page_path(out)
    if faults:
        return exit_with_errors(faults, options.as_json, scenes=[], page=None)

    from sandbox.report.html.overview import Overview
    from sandbox.report.html.page import write_page

    report = _Report(engines, scenes, Overview(asked=len(scenes)))
    try:
        for number, (name, scene) in enumerate(scenes, 1):
            if not options.quiet:
                click.echo(f"{number}/{len(scenes)} {name}", err=True)
            _add_scene(report, name, scene, options, remarks[name])
            if remarks[name]:
                report.documents[-1]["remarks"] = [*remarks[name]]
    except KeyboardInterrupt:
        report.status = 130
        click.echo(f"interrupted: {len(report.documents)} of {len(scenes)} scenes are complete and kept", err=True)
    finally:
        with defer_interrupt(), collect_errors(faults, "--out", (OSError,)):
            write_page(report.overview.page(), out)
    if faults:
        click.echo(str(faults[0]), err=True)
        return 2
    if options.as_json:
        answer = {"scenes": report.documents, "page": str(out), "interrupted": report.status == 130}
        print_json({**answer, "machine": machine(), "versions": versions()})
    elif not options.quiet:
        click.echo(f"written: {out} ({out.stat().st_size / 1e6:.2g} MB)")
    return report.status


def _read_scenes(
    options: _Options, remarks: dict[str, tuple[str, ...]], faults: list[Fault]
) -> list[tuple[str, Scene]]:
    """Return the names and scenes; add remarks on recordings, and faults of scenes and numbers out of range."""
    read: list[tuple[str, Scene]] = []
    default = (scene.name for scene in shipped() if scene.name.startswith(DEFAULT_SCENES))
    for name in expand_folders(options.scenes) or default:
        with collect_errors(faults):
            _, scene, remarks[name] = read_scene(name, options.overrides)
            report_remarks(name, remarks[name])
            read.append((name, scene))
    if not read and not faults:
        faults.append(Fault.of("SCENES", "is missing, and there are no shipped benchmark scenes; name some scenes"))
    return read


def _add_scene(report: _Report, name: str, scene: Scene, options: _Options, remarks: tuple[str, ...]) -> None:
    """Compare a scene on all engines, search its trade-off, and add both to the report.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed; completed results are in the report.
    """
    from sandbox.report.html.overview import SceneReport

    searched: Tradeoff | None = None
    try:
        found = compare(scene, report.engines, why=options.why)
        if found.interrupted:
            raise KeyboardInterrupt
        if options.effort:
            searched = tradeoff(
                scene,
                report.engines,
                effort=options.effort,
                time_limit=options.time_limit,
                repeats=REPEATS,
                truth=found.best or found.doubt,
                runs=found.trajectories,
            )
    except (TooLargeError, SceneError) as error:
        report.status = 1
        click.echo(f"{name}: {error}", err=True)
        report.overview.add(SceneReport(name, failure=str(error)))
        failure: dict[str, object] = {
            "scene": name,
            "title": scene.title,
            "status": "failed",
            "reason": str(error),
            "engines": [],
        }
        report.documents.append(failure)
        return
    with defer_interrupt():
        document = None if searched is None else searched.document(name)
        report.overview.add(SceneReport(name, found, tradeoff=document, remarks=remarks))
        report.documents.append({**found.document(name), "status": "ok", "reason": None, "tradeoff": document})
    if searched is not None and searched.interrupted:
        raise KeyboardInterrupt


def _page_path(out: Path) -> Path:
    """Return the file to write: a path that ends in `.html`, or `report.html` in a folder, which is created.

    Raises:
        SceneError: the file cannot be written.
    """
    try:
        if out.suffix.lower() not in {".html", ".htm"} or out.is_dir():
            out.mkdir(parents=True, exist_ok=True)
            out = out / FILE_NAME
        out.parent.mkdir(parents=True, exist_ok=True)
        reasons = reasons_not_writable(out)
    except OSError as error:
        reasons = [error.strerror or str(error)]
    if reasons:
        raise SceneError([Fault.of("--out", f"{shorten(str(out), MAX_NAMED)}: {reasons[0]}")])
    return out
