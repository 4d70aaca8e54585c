"""Reading what a user names: scenes and engines. What is wrong becomes lines, and exit status 2."""

import json
from collections.abc import Sequence
from typing import Any, NoReturn

import click

from sandbox.scene.faults import Fault, SceneError
from sandbox.scene.shipped import UnknownSceneError, find


class InputError(click.ClickException):
    """Wrong input: one line a fault on standard error, exit status 2."""

    exit_code = 2


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


def fault_rows(faults: Sequence[Fault]) -> list[dict[str, Any]]:
    """Return faults as JSON objects."""
    return [{"file": f.file, "line": f.line, "path": f.path, "message": f.message} for f in faults]


def print_json(document: Any) -> None:
    """Print the one document that `--json` puts on standard output."""
    click.echo(json.dumps(document, ensure_ascii=False, allow_nan=False))


def leave(status: int) -> NoReturn:
    """End the command with an exit status, all having been said."""
    raise click.exceptions.Exit(status)
