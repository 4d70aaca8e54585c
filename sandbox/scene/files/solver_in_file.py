"""Settings written into the `[solver]` of a scene file; the rest of the file is not modified."""

import os
import shutil
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sandbox.atomic_write import atomic_write
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import loads, too_large
from sandbox.scene.files.shipped_scenes import PACKAGE
from sandbox.scene.files.toml_changes import RemoveValue, SetValue, TextEditError, with_changes


def with_solver(text: str, settings: Mapping[str, Any], file: str = "<scene>") -> str:
    """Return the text of a scene file with settings put into its `[solver]`.

    A value that is already equal is not modified. Comments and the form of the table are kept; see `toml_changes`.

    Args:
        text: text of the file, with or without byte order mark, with either kind of line endings.
        settings: a value for each key of `[solver]`; None removes the key and the comment on its line.
        file: name of the file in faults.

    Raises:
        SceneError: the text is no valid scene, or has faults with these settings.
        ValueError: the format of the file cannot be changed without changing its meaning.
    """
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    text = text.removeprefix(mark)
    loads(text, file)
    solver = tomllib.loads(text).get("solver", {})
    changes = [
        RemoveValue(("solver", key)) if value is None else SetValue(("solver", key), value)
        for key, value in settings.items()
        if (key in solver if value is None else not _is_equal(solver.get(key), value))
    ]
    if not changes:
        return mark + text
    try:
        result = with_changes(text, changes)
    except TextEditError as error:
        raise ValueError(f"{file}: {error}") from None
    loads(result, file)
    return mark + result


def write_solver(path: str | Path, settings: Mapping[str, Any]) -> bool:
    """Put settings into the `[solver]` of a scene file, atomically; its permissions are kept.

    Returns:
        Whether the file changed.

    Raises:
        SceneError: it is no scene file, cannot be read or written, or has faults with these settings.
    """
    file = str(path)
    target = _writable(Path(path), file)
    try:
        text = target.read_bytes().decode("utf-8")
        result = with_solver(text, settings, file)
        if result == text:
            return False
        with atomic_write(target) as temporary:
            temporary.write_bytes(result.encode("utf-8"))
            shutil.copymode(target, temporary)
    except UnicodeDecodeError:
        raise SceneError([Fault.of(file, "is not UTF-8 text; a scene is a TOML file")]) from None
    except ValueError as error:
        raise SceneError([Fault.of(file, str(error).removeprefix(f"{file}: "))]) from None
    except OSError as error:
        raise SceneError([Fault.of(file, f"cannot be written: {error.strerror or error}")]) from None
    return True


def _writable(path: Path, file: str) -> Path:
    """Return the file at a path, with links resolved.

    Raises:
        SceneError: it may not be written.
    """
    reason: str | None = ""
    try:
        target = path.resolve()
        if target.suffix.lower() in (".json", ".npz"):
            reason = "is not a scene file; settings can be written to a TOML scene file only"
        elif not target.exists():
            reason = "cannot be read: No such file or directory"
        elif not target.is_file():
            reason = "is not a regular file; settings can be written to a TOML scene file only"
        elif target.is_relative_to(PACKAGE / "shipped"):
            reason = "is part of the installed package and is not changed; copy it and use the copy"
        elif not os.access(target, os.W_OK):
            reason = "cannot be written: it is read-only; make it writable, or use a copy"
        else:
            reason = too_large(target.stat().st_size)
    except (OSError, RuntimeError) as error:  # a loop of links, or a folder without permission
        reason = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if reason:
        raise SceneError([Fault.of(file, reason)])
    return target


def _is_equal(present: Any, wanted: Any) -> bool:
    wanted = wanted.item() if hasattr(wanted, "item") else wanted
    if isinstance(present, bool) or isinstance(wanted, bool):
        return present is wanted
    return bool(present == wanted)
