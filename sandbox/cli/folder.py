"""Folders that results are written into."""

import json
from pathlib import Path
from typing import Any

from sandbox.scene.faults import Fault, SceneError
from sandbox.whole import whole


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


def write_json(document: Any, file: Path) -> None:
    """Write a document as JSON, whole or not at all.

    Raises:
        OSError: it cannot be written.
    """
    with whole(file) as temporary:
        temporary.write_text(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1), encoding="utf-8")
