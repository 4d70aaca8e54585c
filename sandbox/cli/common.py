"""Parts that commands share: scene arguments, names of engines, output folders, JSON, engine choice."""

import difflib
import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, NamedTuple

import click

from sandbox.atomic_write import atomic_write
from sandbox.cli.streams import print_json
from sandbox.echo import MAX_MESSAGE, MAX_NAMED, short_repr, shorten
from sandbox.engines.registry import ENGINES, UnknownEngineError, able, engine_named
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import COMMON
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.overrides import AddressError, parse_assignment
from sandbox.scene.files.shipped_scenes import UnknownSceneError, find, scenes_in

MAX_UNKNOWN = 5
"""Unknown names of an option that are listed."""


def parse_names(text: str) -> list[str]:
    """Return the distinct names in `NAME,NAME`."""
    return list(dict.fromkeys(name.strip() for name in text.split(",")))


def suggest_names(name: str, known: Sequence[str], count: int = 5) -> str:
    """Return the known name closest to an unknown one as a question; without a close one, the first known names."""
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f"did you mean {short_repr(close[0])}?"
    return f"known names: {', '.join(map(repr, known[:count])) or 'none'}{' …' if len(known) > count else ''}"


def engine_advice(scene: Scene, is_chosen: bool = False) -> str:
    """Return the option to use after an engine has refused a scene; empty if no engine can run it.

    Args:
        scene: the scene, with all values set.
        is_chosen: the command line has an option --engine already.
    """
    names = able(scene)
    return f"; {'use' if is_chosen else 'add'} --engine {names[0]}" if names else ""


def parse_engines(text: str | None, faults: list[Fault]) -> list[str] | None:
    """Return the engines named by `--engine`, None without it; add unknown names to the faults."""
    names = None if text is None else parse_names(text)
    unknown = [name for name in names or () if name not in ENGINES]
    for name in unknown[:MAX_UNKNOWN]:
        with collect_errors(faults, "--engine", (UnknownEngineError,)):
            engine_named(name)
    faults += more_unknown("--engine", len(unknown))
    return names


def more_unknown(option: str, count: int) -> list[Fault]:
    """Return a fault with the number of unknown names of an option beyond `MAX_UNKNOWN`; empty if there are none."""
    more = count - MAX_UNKNOWN
    return [Fault.of(option, f"{more:,} more names are unknown")] if more > 0 else []


PLOT_SUFFIXES = (".png", ".svg", ".pdf")


def require_folder(out: Path | None) -> None:
    """Check that `--out` does not name a file; nothing is created.

    Raises:
        SceneError: it does.
    """
    try:
        reason = "is not a folder" if out is not None and out.exists() and not out.is_dir() else ""
    except OSError as error:  # the name is too long for the file system
        reason = error.strerror or str(error)
    if reason:
        raise SceneError([Fault.of("--out", f"{shorten(str(out), MAX_NAMED)}: {reason}")])


def make_folder(out: Path) -> None:
    """Create the folder of `--out`. Called before the runs, so that their results can be written.

    Raises:
        SceneError: it cannot be created or written to.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):  # an existing folder may lack write permission
            pass
    except OSError as error:
        reason = error.strerror or error
        raise SceneError([Fault.of("--out", f"{shorten(str(out), MAX_NAMED)}: {reason}")]) from None


def require_plot_file(plot: Path | None, option: str = "--plot") -> None:
    """Check that the file of a plot can be written.

    Args:
        plot: path of the file.
        option: option that names it.

    Raises:
        SceneError: it cannot, or its suffix is not one of `PLOT_SUFFIXES`.
    """
    if plot is None:
        return
    faults = []
    if plot.suffix.lower() not in PLOT_SUFFIXES:
        faults.append("the name must end in .png, .svg or .pdf")
    faults += reasons_not_writable(plot)
    if faults:
        raise SceneError([Fault.of(option, f"{shorten(str(plot), MAX_NAMED)}: {each}") for each in faults])


def reasons_not_writable(path: Path) -> list[str]:
    """Return the reasons why a file cannot be written or replaced at a path; empty if it can.

    A device or a pipe is not replaced, because its readers would lose it.
    """
    try:
        folder = path.absolute().parent
        if not folder.is_dir():
            return [f"no such folder: {shorten(str(path.parent), MAX_NAMED)}"]
        if path.is_dir():
            return ["is a folder"]
        if path.exists() and not path.is_file():
            return ["is a device or a pipe, not a file"]
        if not os.access(folder, os.W_OK):
            return [f"no permission to write to the folder {shorten(str(path.parent), MAX_NAMED)}"]
    except OSError as error:  # the name is too long for the file system
        return [error.strerror or str(error)]
    return []


def write_json(document: Any, file: Path) -> None:
    """Write a document as JSON, atomically.

    Raises:
        OSError: it cannot be written.
    """
    with atomic_write(file) as temporary:
        temporary.write_text(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1), encoding="utf-8")


MAX_FAULTS = 100
"""Faults that are printed, one per line."""


def expand_folders(names: Sequence[str]) -> list[str]:
    """Return the names of scenes as given, with each folder replaced by its scene files."""
    return [scene for name in names for scene in scenes_in(name) or (name,)]


def scene_paths(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return the name of each scene as given, and its file.

    Raises:
        SceneError: some names are neither files nor shipped scenes; there is a fault for each.
    """
    found, faults = [], []
    for name in names:
        try:
            found.append((name, str(find(name))))
        except UnknownSceneError as error:
            faults.append(Fault.of(name, str(error)))
    if faults:
        raise SceneError(faults)
    return found


def scene_path(name: str) -> str:
    """Return the file of a scene.

    Raises:
        SceneError: the name is neither a file nor a shipped scene, or by its suffix it is a recorded session or a
            stored run; the fault then names the command for it.
    """
    path = scene_paths([name])[0][1]
    for ending, kind in ((".json", "a recorded session"), (".npz", "a stored run")):
        if path.lower().endswith(ending):
            remedy = f"`sandbox replay {shorten(name)}` shows it"
            if ending == ".json":
                remedy += f", `sandbox export {shorten(name)} --to FILE.toml` writes its scene"
            raise SceneError([Fault.of(name, f"is {kind}, not a scene; {remedy}")])
    return path


@contextmanager
def collect_errors(faults: list[Fault], source: str = "", also: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Add errors to a list of faults instead of raising them, so that all faults are reported at once.

    Args:
        faults: the list.
        source: option or argument at fault, for errors other than a `SceneError`.
        also: exceptions to collect besides `SceneError`.
    """
    try:
        yield
    except SceneError as error:
        faults += error.faults
    except also as error:
        faults.append(Fault.of(source, str(error)))


def fault_rows(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Return faults as JSON objects."""
    return [
        {"file": f.file, "line": f.line, "path": f.path, "message": shorten(f.message, MAX_MESSAGE)} for f in faults
    ]


def print_faults(faults: Sequence[Fault]) -> None:
    """Print faults on standard error, one per line, up to `MAX_FAULTS`, and the number of further ones."""
    for fault in faults[:MAX_FAULTS]:
        click.echo(str(fault), err=True)
    if len(faults) > MAX_FAULTS:
        click.echo(f"… and {len(faults) - MAX_FAULTS:,} more faults", err=True)


def exit_with_errors(faults: Sequence[Fault], as_json: bool = False, **empty: Any) -> int:
    """Print all faults and return exit status 2.

    Args:
        faults: the faults.
        as_json: also print a JSON document.
        empty: further keys of the document.
    """
    print_faults(faults)
    if as_json:
        print_json({**empty, "faults": fault_rows(faults)})
    return 2


_SOLVER = "solver."


class EngineChoice(NamedTuple):
    """An engine that was chosen, and one line with the reason."""

    engine: str
    sentence: str


def only_engine(
    scenes: Sequence[Scene], overrides: Sequence[str], sweeps: Sequence[tuple[str, Sequence[Any]]] = ()
) -> EngineChoice | None:
    """Return the only engine that can run all scenes, if a setting that not all engines have is set or swept.

    Args:
        scenes: the scenes, with all values set.
        overrides: `KEY=VALUE`, as given to `--set`.
        sweeps: keys and their values, as given to `--sweep`.

    Returns:
        None if no such setting is set or swept, or if no or several engines can run all scenes.
    """
    assigned = [*filter(None, map(_assignment, overrides)), *((key, list(values)) for key, values in sweeps)]
    special = {key.removeprefix(_SOLVER): values for key, values in assigned if _is_special(key)}
    if not special or not scenes:
        return None
    engines = set(ENGINES).intersection(*(able(scene) for scene in scenes))
    if len(engines) != 1:
        return None
    (engine,) = engines
    settings = " and ".join(f"{key.replace('_', ' ')} {', '.join(map(str, values))}" for key, values in special.items())
    return EngineChoice(engine, f"engine: {engine}, the only one that has {settings}")


def _is_special(key: str) -> bool:
    return key.startswith(_SOLVER) and key.removeprefix(_SOLVER) not in COMMON


def _assignment(text: str) -> tuple[str, list[Any]] | None:
    try:
        key, value = parse_assignment(text)
    except AddressError:  # reported with the other faults of the command line
        return None
    return key, [value]
