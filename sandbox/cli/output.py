"""Where results go: folders, documents, pictures. What could not be written is refused before anything runs."""

import json
import os
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from sandbox.echo import MAX_NAMED, shorten
from sandbox.scene.errors import Fault, SceneError
from sandbox.whole import whole

PICTURES = (".png", ".svg", ".pdf")


def require_folder(out: Path | None) -> None:
    """Make sure that what `--out` names is no file; nothing is made yet.

    Raises:
        SceneError: it is one.
    """
    try:
        reason = "is not a folder" if out is not None and out.exists() and not out.is_dir() else ""
    except OSError as error:  # such as a name longer than any file's
        reason = error.strerror or str(error)
    if reason:
        raise SceneError([Fault("--out", None, "", f"{shorten(str(out), MAX_NAMED)}: {reason}")])


def make_folder(out: Path) -> None:
    """Make the folder of `--out` before the runs, so that what could not be written is refused first.

    Raises:
        SceneError: it cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):  # a folder that is there may still not be written to
            pass
    except OSError as error:
        reason = error.strerror or error
        raise SceneError([Fault("--out", None, "", f"{shorten(str(out), MAX_NAMED)}: {reason}")]) from None


def require_picture(plot: Path | None) -> None:
    """Make sure that a picture can be written where `--plot` says.

    Raises:
        SceneError: there is no such folder, or the name ends otherwise than pictures do.
    """
    if plot is None:
        return
    faults = []
    if plot.suffix.lower() not in PICTURES:
        faults.append("the name must end in .png, .svg or .pdf")
    faults += reasons_against(plot)
    if faults:
        raise SceneError([Fault("--plot", None, "", f"{shorten(str(plot), MAX_NAMED)}: {each}") for each in faults])


def reasons_against(path: Path) -> list[str]:
    """Return why a file cannot be written, or replaced, where a path says; nothing where it can.

    A device or a pipe is not replaced: what reads from it would no longer find it by that name.
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
    except OSError as error:  # such as a name longer than any file's
        return [error.strerror or str(error)]
    return []


def write_json(document: Any, file: Path) -> None:
    """Write a document as JSON, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    with whole(file) as temporary:
        temporary.write_text(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1), encoding="utf-8")
