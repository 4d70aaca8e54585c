"""Reading what a user names: scenes and engines. What is wrong becomes lines, and exit status 2."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import click

from sandbox.scene.faults import Fault, SceneError
from sandbox.scene.shipped import UnknownSceneError, find


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


def require_scene(name: str, path: str) -> None:
    """Make sure by a file's ending that it is to be a scene, not what `sandbox replay` shows.

    Raises:
        SceneError: it is a recorded session or a stored run; the fault names the command for it.
    """
    for ending, what in ((".json", "a recorded session"), (".npz", "a stored run")):
        if path.lower().endswith(ending):
            raise SceneError([Fault(name, None, "", f"is {what}, no scene; `sandbox replay {name}` shows it")])


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
    return [{"file": f.file, "line": f.line, "path": f.path, "message": f.message} for f in faults]


def print_json(document: Any) -> None:
    """Print the one document that `--json` puts on standard output."""
    click.echo(json.dumps(document, ensure_ascii=False, allow_nan=False))
