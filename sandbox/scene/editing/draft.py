"""Draft: a scene file while it is edited, with undo and redo, and how it is saved.

The text of the file is changed in place, so that comments, order and formatting of everything else stay to the byte. A
draft is a valid scene at all times: a change that would give faults is refused with them. Undo restores the text of
before, to the byte.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sandbox.atomic_write import atomic_write
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.description.game_tables import PRESETS, game_table
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import SceneText, dumps, too_large
from sandbox.scene.files.shipped_scenes import PACKAGE
from sandbox.scene.files.toml_changes import Change, with_changes

MAX_UNDO = 1_000
"""Changes that can be undone"""
MAX_UNDO_TEXT = 64_000_000
"""Characters of their texts"""
BYTE_ORDER_MARK = "\ufeff"

NEW_SCENE = """title = "New scene"

[world]
gravity = [0.0, -9.81]
duration = 10.0

[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
friction = 0.7071
restitution = 0.5
"""
"""An empty scene with a ground."""


@dataclass(frozen=True)
class DraftState:
    """Text of a draft, and its scene."""

    text: str
    scene: Scene
    document: dict[str, Any]
    """the text as parsed TOML"""
    preset: str | None
    """heading of the preset that makes the scene"""
    label: str = ""
    """what was done to get here, such as "move 2 elements" """

    @classmethod
    def of(cls, text: str, path: Path | None, label: str = "") -> "DraftState":
        """Return the state of a text.

        Raises:
            SceneError: it is no valid scene.
        """
        source = SceneText.of(text, "<scene>" if path is None else path.name)
        preset = next((key for key in PRESETS if key in source.document), None)
        return cls(text, source.scene(), source.document, preset, label)


class SceneDraft:
    """A scene file while it is edited.

    Args:
        text: TOML text of the file, without byte order mark.
        path: of the file; None for a scene that was not saved yet.
        saved: the text as it is in the file; None if it is not in a file.

    Raises:
        SceneError: it is no valid scene.
    """

    def __init__(self, text: str = NEW_SCENE, path: Path | None = None, saved: str | None = None) -> None:
        self.path = path
        self._saved = saved
        self._past: list[DraftState] = []
        self._now = DraftState.of(text, path)
        self._future: list[DraftState] = []
        self._merge: str | None = None
        """mark of the last change, with which a change of the same mark is undone together"""

    @classmethod
    def read(cls, path: Path) -> "SceneDraft":
        """Read a scene file.

        Raises:
            SceneError: it cannot be read, or is no valid scene.
        """
        try:
            raw = path.read_bytes()
            if (refusal := too_large(len(raw))) is not None:
                raise SceneError([Fault.of(str(path), refusal)])
            text = raw.decode("utf-8")
        except OSError as error:
            raise SceneError([Fault.of(str(path), f"cannot be read: {error.strerror or error}")]) from None
        except UnicodeDecodeError:
            raise SceneError([Fault.of(str(path), "is not UTF-8 text; a scene is a TOML file")]) from None
        draft = cls(text.removeprefix(BYTE_ORDER_MARK), path, text)
        if text.startswith(BYTE_ORDER_MARK):
            draft._has_mark = True
        return draft

    _has_mark = False

    @property
    def text(self) -> str:
        """The present text."""
        return self._now.text

    @property
    def scene(self) -> Scene:
        """The present scene."""
        return self._now.scene

    @property
    def document(self) -> dict[str, Any]:
        """The present text as parsed TOML; must not be changed in place."""
        return self._now.document

    @property
    def preset_table(self) -> tuple[str, Part] | None:
        """Heading of the preset that makes the scene, and its table; None without one."""
        heading = self.preset
        if heading is None:
            return None
        return heading, game_table(heading).model.model_validate_json(json.dumps(self.document[heading]), by_alias=True)

    @property
    def saved_text(self) -> str | None:
        """The text as it is in the file, with its byte order mark; None if it is not in a file."""
        return self._saved

    @property
    def is_changed(self) -> bool:
        """Whether the text differs from the file."""
        return self._file_text != self._saved and (self._saved is not None or bool(self._past))

    @property
    def preset(self) -> str | None:
        """Heading of a preset of the file, whose elements cannot be edited one by one; None without one."""
        return self._now.preset

    @property
    def undo_label(self) -> str | None:
        """What `undo` takes back; None if there is nothing."""
        return self._now.label if self._past else None

    @property
    def redo_label(self) -> str | None:
        """What `redo` does again; None if there is nothing."""
        return self._future[-1].label if self._future else None

    def change(self, changes: Sequence[Change], label: str, merge: str | None = None) -> bool:
        """Change the text; return whether that changed it.

        Args:
            changes: see `toml_changes`.
            label: what is done, for the menu of undo.
            merge: mark of changes that follow each other and are undone together, such as steps of the arrow keys.

        Raises:
            SceneError: the scene would have faults. The draft is unchanged.
            TextEditError: the text cannot be changed in place. The draft is unchanged.
        """
        text = with_changes(self.text, changes)
        return self._replace(text, label, merge)

    def replace_text(self, text: str, label: str) -> bool:
        """Replace the whole text; return whether that changed it.

        Raises:
            SceneError: it is no valid scene. The draft is unchanged.
        """
        return self._replace(text, label, None)

    def take_apart_preset(self) -> None:
        """Write the elements of the file's preset as elements of their own, without comments.

        Raises:
            SceneError: they are no valid scene.
        """
        self._replace(dumps(self.scene), "take the preset apart", None)

    def _replace(self, text: str, label: str, merge: str | None) -> bool:
        if text == self.text:
            return False
        state = DraftState.of(text, self.path, label)
        is_merged = merge is not None and merge == self._merge and bool(self._past)
        if not is_merged:
            self._past.append(self._now)
            while len(self._past) > MAX_UNDO or sum(len(each.text) for each in self._past) > MAX_UNDO_TEXT:
                del self._past[0]
        self._now = state
        self._future.clear()
        self._merge = merge
        return True

    def undo(self) -> str | None:
        """Undo the last change; return its label, or None if there is nothing to undo."""
        if not self._past:
            return None
        label = self._now.label
        self._future.append(self._now)
        self._now = self._past.pop()
        self._merge = None
        return label

    def redo(self) -> str | None:
        """Do the last undone change again; return its label, or None if there is none."""
        if not self._future:
            return None
        self._past.append(self._now)
        self._now = self._future.pop()
        self._merge = None
        return self._now.label

    def is_file_changed(self) -> bool:
        """Return whether the file has changed on disk since it was read or saved."""
        if self.path is None or self._saved is None:
            return False
        try:
            return self.path.read_bytes() != self._saved.encode("utf-8")
        except OSError:
            return True

    def save(self, path: Path | None = None) -> Path:
        """Write the text to its file, or to another one, which becomes its file; return the path.

        The file is replaced as a whole, or not at all.

        Raises:
            SceneError: it cannot be written; `str()` of its fault has the reason.
        """
        target = path or self.path
        if target is None:
            raise SceneError([Fault.of("<scene>", "has no file yet; give it a name")])
        fault = _reason_not_writable(target)
        if fault is None:
            try:
                resolved = target.resolve()
                with atomic_write(resolved) as temporary:
                    temporary.write_bytes(self._file_text.encode("utf-8"))
                    if resolved.exists():
                        temporary.chmod(resolved.stat().st_mode & 0o777)
            except OSError as error:
                fault = f"cannot be written: {error.strerror or error}"
        if fault is not None:
            raise SceneError([Fault.of(str(target), fault)])
        self.path, self._saved = target, self._file_text
        return target

    @property
    def _file_text(self) -> str:
        return (BYTE_ORDER_MARK if self._has_mark else "") + self.text


def _reason_not_writable(path: Path) -> str | None:
    """Return why a scene cannot be saved at a path; None if it can be tried."""
    if path.suffix.lower() != ".toml":
        return "is not a name of a scene file, which ends in .toml"
    try:
        resolved = path.resolve()
        if resolved.is_relative_to(PACKAGE / "shipped"):
            return "is part of the installed package and is not changed; save it under another name"
        if resolved.is_dir():
            return "is a folder; give the name of a file"
        if not resolved.parent.is_dir():
            return f"cannot be written: there is no folder {resolved.parent}"
        if resolved.exists() and not os.access(resolved, os.W_OK):
            return "cannot be written: it is read-only; save it under another name"
    except (OSError, RuntimeError) as error:
        return f"cannot be written: {getattr(error, 'strerror', None) or error}"
    return None
