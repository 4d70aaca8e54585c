"""Reading what a user names: scenes and engines. What is wrong becomes lines, and exit status 2."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import click

from sandbox.cli.streams import can_write_unicode
from sandbox.echo import MAX_MESSAGE, shorten
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.shipped_scenes import UnknownSceneError, find, scenes_in

MAX_FAULTS = 100
"""Faults that are printed, a line each."""


def scenes_of(names: Sequence[str]) -> list[str]:
    """Return the names of scenes that a user gave, in place of each folder the files of its scenes."""
    return [scene for name in names for scene in scenes_in(name) or (name,)]


def paths_of(names: Sequence[str]) -> list[tuple[str, str]]:
    """Return each scene's name as given, and its file.

    Raises:
        SceneError: a name is neither a file nor a shipped scene; every such name is told.
    """
    found, faults = [], []
    for name in names:
        try:
            found.append((name, str(find(name))))
        except UnknownSceneError as error:
            faults.append(Fault(name, None, "", str(error)))
    if faults:
        raise SceneError(faults)
    return found


def path_of(name: str) -> str:
    """Return the file of what is to be a scene, by its ending, not what `sandbox replay` shows.

    Raises:
        SceneError: the name is no file's nor a shipped scene's, or it is a recorded session or a stored run; the fault
            names the command for it.
    """
    path = paths_of([name])[0][1]
    for ending, what in ((".json", "a recorded session"), (".npz", "a stored run")):
        if path.lower().endswith(ending):
            raise SceneError([Fault(name, None, "", f"is {what}, not a scene; use `sandbox replay {shorten(name)}`")])
    return path


@contextmanager
def gathering(faults: list[Fault], place: str = "", also: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Add what is wrong to a list of faults and go on, so that all are told at once.

    Args:
        faults: the list.
        place: what the user typed wrongly, such as `--engine`, where it is no scene.
        also: what is such a fault, besides a `SceneError`.
    """
    try:
        yield
    except SceneError as error:
        faults += error.faults
    except also as error:
        faults.append(Fault(place, None, "", str(error)))


def fault_rows(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Return faults as JSON objects."""
    return [
        {"file": f.file, "line": f.line, "path": f.path, "message": shorten(f.message, MAX_MESSAGE)} for f in faults
    ]


def print_faults(faults: Sequence[Fault]) -> None:
    """Print faults on standard error, a line each, up to `MAX_FAULTS`, and then how many there are more."""
    for fault in faults[:MAX_FAULTS]:
        click.echo(str(fault), err=True)
    if len(faults) > MAX_FAULTS:
        click.echo(f"… and {len(faults) - MAX_FAULTS:,} more faults", err=True)


def refused(faults: Sequence[Fault], as_json: bool = False, **empty: Any) -> int:
    """Tell all that is wrong, a line each, and return the exit status.

    Args:
        faults: what is wrong.
        as_json: also print a document.
        empty: what else is in it.
    """
    print_faults(faults)
    if as_json:
        print_json({**empty, "faults": fault_rows(faults)})
    return 2


def print_json(document: Any) -> None:
    """Print the one document that `--json` puts on standard output."""
    click.echo(json.dumps(document, ensure_ascii=not can_write_unicode(), allow_nan=False))
