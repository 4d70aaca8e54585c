"""Where results go: folders, documents, pictures. What could not be written is refused before anything runs."""

import json
from pathlib import Path
from typing import Any

from sandbox.scene.faults import Fault, SceneError
from sandbox.whole import whole

PICTURES = (".png", ".svg", ".pdf")


def require_folder(out: Path | None) -> None:
    """Make sure that what `--out` names is no file; nothing is made yet.

    Raises:
        SceneError: it is one.
    """
    if out is not None and out.exists() and not out.is_dir():
        raise SceneError([Fault("--out", None, "", f"{out}: is no folder")])


def make_folder(out: Path) -> None:
    """Make the folder of `--out` before the runs, so that what could not be written is refused first.

    Raises:
        SceneError: it cannot be made.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SceneError([Fault("--out", None, "", f"{out}: {error.strerror or error}")]) from None


def require_picture(plot: Path | None) -> None:
    """Make sure that a picture can be written where `--plot` says.

    Raises:
        SceneError: there is no such folder, or the name ends otherwise than pictures do.
    """
    if plot is None:
        return
    faults = []
    if plot.suffix.lower() not in PICTURES:
        faults.append(f"{plot}: the name ends in .png, .svg or .pdf")
    try:
        if not plot.absolute().parent.is_dir():
            faults.append(f"{plot}: there is no folder {plot.parent}")
        elif plot.is_dir():
            faults.append(f"{plot}: is a folder")
    except OSError as error:  # such as a name longer than any file's
        faults.append(f"{plot}: {error.strerror or error}")
    if faults:
        raise SceneError([Fault("--plot", None, "", message) for message in faults])


def write_json(document: Any, file: Path) -> None:
    """Write a document as JSON, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    with whole(file) as temporary:
        temporary.write_text(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1), encoding="utf-8")
