"""Shipped scenes: finds a scene by its path or, in any folder, by the name of a shipped one.

They are in `scenes/` of a checkout, and inside the package if it was installed from a wheel.
"""

import difflib
import tomllib
from pathlib import Path
from typing import NamedTuple

from sandbox.echo import MAX_ECHO, short_repr

PACKAGE = Path(__file__).resolve().parents[2]
SCHEMA = "scene.schema.json"
"""File next to the folders of shipped scenes, which identifies them."""


FIRST = "tutorial/"
"""Folder whose scenes are listed first"""


class UnknownSceneError(LookupError):
    """No scene, or more than one, has a given name; `str()` lists them."""


class ShippedScene(NamedTuple):
    """A shipped scene."""

    name: str
    """folder and file, such as `tutorial/bounce`"""
    path: Path


def folder() -> Path | None:
    """Return the folder of the shipped scenes, or None if they are not installed."""
    for candidate in (PACKAGE.parent / "scenes", PACKAGE / "shipped"):
        if (candidate / SCHEMA).is_file():
            return candidate
    return None


def shipped() -> tuple[ShippedScene, ...]:
    """Return all shipped scenes: those of the tutorial, then the others, each sorted by name."""
    root = folder()
    files = () if root is None else root.glob("*/*.toml")
    scenes = (ShippedScene(f"{file.parent.name}/{file.stem}", file) for file in files)
    return tuple(sorted(scenes, key=lambda scene: (not scene.name.startswith(FIRST), scene.name)))


def find(text: str) -> Path:
    """Return the file of a scene: an existing path, or else a shipped scene by its name.

    Args:
        text: a path, `tutorial/bounce`, or `bounce` if only one folder has that name.

    Raises:
        UnknownSceneError: no scene, or more than one, has that name.
    """
    if _is_file(text):
        return Path(text)
    scenes = shipped()
    found = _shipped_as(text)
    if len(found) == 1:
        return found[0].path
    if found:
        names = ", ".join(scene.name for scene in found)
        raise UnknownSceneError(f"{short_repr(text)} is ambiguous: {names}; include the folder")
    contained = scenes_in(text)
    if contained or _is_folder(text):
        raise UnknownSceneError(f"is a folder; {_folder_message(text, contained)}")
    names_of = {name: scene.name for scene in scenes for name in (scene.path.stem, scene.name)}
    close = dict.fromkeys(names_of[match] for match in difflib.get_close_matches(text[:MAX_ECHO], names_of, n=3))
    hint = f"; did you mean {' or '.join(close)}?" if close else ";"
    raise UnknownSceneError(
        f"no file or shipped scene is named {short_repr(text)}{hint} `sandbox scenes` lists the shipped scenes"
    )


def scenes_in(text: str) -> tuple[str, ...]:
    """Return the names of the scenes of a folder, sorted: on disk, or a shipped one, such as `tutorial`.

    A TOML file without any key of a scene is omitted; one that cannot be parsed is included, so that it is reported.
    The result is empty if the text is a file or the name of a shipped scene.
    """
    if _is_file(text) or _shipped_as(text):
        return ()
    if not _is_folder(text):
        return tuple(scene.name for scene in shipped() if scene.name.rpartition("/")[0] == text.rstrip("/"))
    return tuple(sorted(str(file) for file in Path(text).glob("*.toml") if file.is_file() and _has_scene_key(file)))


def _has_scene_key(file: Path) -> bool:
    from sandbox.scene.compile.scene import Scene
    from sandbox.scene.files.document import check_text

    try:
        text = file.read_bytes().decode("utf-8-sig")
        check_text(text)
        keys = set(tomllib.loads(text))
    except (OSError, ValueError):
        return True
    return not keys or not keys.isdisjoint(field.alias or name for name, field in Scene.model_fields.items())


def _folder_message(text: str, names: tuple[str, ...]) -> str:
    """Return a message with up to three scenes of a folder."""
    if not names:
        below = sorted({str(file.parent) for file in Path(text).glob("*/*.toml")})
        return "it contains no scene (*.toml)" + (f"; these folders in it do: {', '.join(below[:5])}" if below else "")
    return f"name one of its scenes: {', '.join(names[:3])}{f' … {len(names)} in all' if len(names) > 3 else ''}"


def _shipped_as(text: str) -> list[ShippedScene]:
    return [scene for scene in shipped() if text in (scene.name, scene.path.stem)]


def _is_folder(text: str) -> bool:
    try:
        return bool(text) and Path(text).is_dir()
    except (OSError, ValueError):
        return False


def _is_file(text: str) -> bool:
    """Return whether a text is the path of a file or a pipe; an unreadable file is reported when it is read."""
    try:
        return Path(text).is_file() or Path(text).is_fifo()
    except PermissionError:
        return True
    except (OSError, ValueError):  # such as a name that is too long
        return False
