"""Command `import`: convert a level of another program to a scene file."""

import math
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import click
from click.core import ParameterSource

from sandbox.atomic_write import atomic_write
from sandbox.cli.common import exit_with_errors, reasons_not_writable
from sandbox.cli.options import json_option, quiet_option
from sandbox.cli.streams import print_json
from sandbox.echo import MAX_NAMED, short_repr, shorten
from sandbox.formatting import format_plural
from sandbox.jsonable import to_json
from sandbox.levels.builder import ORIGINS, ImportedLevel, LevelOptions, Origin
from sandbox.scene.errors import Fault, SceneError

OTHER_FORMATS = {
    ".svgz": "is compressed; save it as plain SVG (.svg)",
    ".tmj": "is a map in JSON; save it as .tmx",
    ".msgpack": "is binary; save the shot as .json",
    ".tsx": "is a tileset; import the map (.tmx) that uses it",
    ".toml": "is a scene already; use `sandbox run`",
}
"""Messages for files of related formats, by suffix."""
SUFFIXES = (".svg", ".tmx", ".json")
OF_DRAWINGS = ("scale", "tolerance", "gravity", "origin")
"""Options that do not apply to a shot, which is in metres and has a gravity."""

MAX_WARNINGS = 100
"""Warnings that are printed, one per line."""


@dataclass(frozen=True, kw_only=True)
class ImportDocument:
    """JSON document of an import."""

    level: str
    """as the user named it"""
    scene: str | None
    """file that was written; None if there is none"""
    title: str | None = None
    toml: str | None = None
    """text of the scene, if no file was written"""
    scale: float
    """m for each user unit or pixel; 1 for a shot"""
    counts: Mapping[str, int] = field(default_factory=dict)
    """elements by table of the scene"""
    warnings: Sequence[Fault] = ()


@click.command(name="import")
@click.argument("level")
@click.option("--to", "target", metavar="FILE", help="scene file to write; default: standard output")
@click.option("--force", is_flag=True, help="replace an existing file")
@click.option("--scale", type=float, default=0.01, metavar="M", help="metres per user unit or pixel; default: 0.01")
@click.option(
    "--tolerance",
    type=float,
    default=0.25,
    metavar="PX",
    help="distance of a polygon from its curve, in user units or pixels; default: 0.25",
)
@click.option("--gravity", metavar="X,Y", help="gravity, m/s²; default: the level's own, else 0,-9.81")
@click.option(
    "--origin",
    metavar="|".join(ORIGINS),
    default="lower-left",
    help="point of the page or map at (0, 0) of the scene; default: lower-left",
)
@json_option
@quiet_option("print no summary; warnings and the scene are printed")
def import_command(
    level: str,
    target: str | None,
    force: bool,
    scale: float,
    tolerance: float,
    gravity: str | None,
    origin: Origin,
    as_json: bool,
    quiet: bool,
) -> int:
    """Convert a level of another program to a scene file.

    LEVEL is a drawing (.svg, as of Inkscape), a map of Tiled (.tmx), or a saved shot of pooltool (.json). Shapes of
    drawings and maps are static unless they, or a layer or group around them, are marked: by data-body="dynamic" or a
    label with the word "dynamic" in a drawing, by the property dynamic or the class "dynamic" in a map. Further words
    are "zone" and "ignore". Keys of a scene, such as friction, are attributes data-friction in a drawing, and
    properties in a map. Parts that cannot be imported are listed on standard error.
    """
    faults: list[Fault] = []
    options = LevelOptions(scale=scale, tolerance=tolerance, gravity=_gravity(gravity, faults), origin=origin)
    faults += options.faults()
    suffix = Path(level).suffix.lower()
    if suffix not in SUFFIXES:
        message = OTHER_FORMATS.get(suffix, "is no level; its name must end in .svg, .tmx or .json")
        faults.append(Fault.of(level, message))
    if suffix == ".json":
        faults += _faults_for_a_shot()
        scale = 1.0
    faults += _target_faults(level, target, force)
    imported: ImportedLevel | None = None
    if not faults:
        try:
            imported = _import(level, suffix, options)
        except SceneError as error:
            faults += error.faults
    if imported is not None and target is not None:
        faults += _write(imported.text, Path(target))
    if imported is None or faults:
        shown = scale if math.isfinite(scale) else 0.0
        return exit_with_errors(faults, as_json, **to_json(ImportDocument(level=level, scene=None, scale=shown)))
    if as_json:
        document = ImportDocument(
            level=level,
            scene=target,
            title=imported.scene.title,
            toml=imported.text if target is None else None,
            scale=scale,
            counts=imported.counts,
            warnings=imported.warnings,
        )
        print_json(to_json(document))
    elif target is None:
        click.echo(imported.text, nl=False)
    elif not quiet:
        click.echo(f"written: {shorten(target, MAX_NAMED)} ({_summary(imported)})")
    for warning in imported.warnings[:MAX_WARNINGS]:  # last, where a long scene on a terminal does not hide them
        click.echo(str(warning), err=True)
    if len(imported.warnings) > MAX_WARNINGS:
        click.echo(f"… and {len(imported.warnings) - MAX_WARNINGS:,} more warnings", err=True)
    return 0


def _import(level: str, suffix: str, options: LevelOptions) -> ImportedLevel:
    if suffix == ".svg":
        from sandbox.levels.svg import import_svg

        return import_svg(Path(level), options)
    if suffix == ".tmx":
        from sandbox.levels.tiled import import_tmx

        return import_tmx(level, options)
    from sandbox.levels.pooltool import import_pooltool

    return import_pooltool(Path(level))


def _faults_for_a_shot() -> list[Fault]:
    """Return a fault for each option of the command line that does not apply to a shot."""
    source_of = click.get_current_context().get_parameter_source
    given = [name for name in OF_DRAWINGS if source_of(name) is ParameterSource.COMMANDLINE]
    return [Fault.of(f"--{name}", "does not apply to a shot of pooltool; leave it out") for name in given]


def _summary(imported: ImportedLevel) -> str:
    """Return the number of elements by table, and of warnings."""
    parts = [f"{count:,} [[{table}]]" for table, count in imported.counts.items()]
    if imported.warnings:
        parts.append(format_plural(len(imported.warnings), "warning"))
    return ", ".join(parts)


def _gravity(text: str | None, faults: list[Fault]) -> tuple[float, float] | None:
    """Return the vector of `--gravity`."""
    if text is None:
        return None
    words = [word for word in re.split(r"[\s,\[\]]+", text[:100]) if word]
    try:
        x, y = map(float, words)
    except ValueError:
        faults.append(Fault.of("--gravity", f"must be two numbers, such as 0,-9.81; is {short_repr(text)}"))
        return None
    return x, y


def _target_faults(level: str, target: str | None, force: bool) -> list[Fault]:
    """Return the reasons why the file of `--to` cannot be written."""
    if target is None:
        return []
    path, name = Path(target), shorten(target, MAX_NAMED)
    reasons = reasons_not_writable(path)
    if not reasons and path.exists():
        with suppress(OSError):  # the level does not exist
            if path.samefile(level):
                reasons = ["is the level itself; choose another name"]
        if not reasons and not force:
            reasons = ["exists already; use --force to replace it"]
    return [Fault.of("--to", f"{name}: {reason}") for reason in reasons]


def _write(text: str, path: Path) -> list[Fault]:
    """Write the scene, completely or not at all; return the fault."""
    try:
        with atomic_write(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        return [Fault.of("--to", f"{shorten(str(path), MAX_NAMED)}: {error.strerror or error}")]
    return []
