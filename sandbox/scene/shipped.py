"""Shipped scenes: finding a scene by its path or, anywhere, by the name of one that ships.

They lie in `scenes/` of a checkout, and inside the package where it was installed from a wheel.
"""

import difflib
import tomllib
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).resolve().parents[1]
SCHEMA = "scene.schema.json"
"""It lies beside the folders of scenes, and tells that they are ours."""


class UnknownSceneError(LookupError):
    """No scene goes by a name, or several do; `str()` says which do."""


class ShippedScene(NamedTuple):
    """A scene that ships."""

    name: str
    """folder and file, such as `tutorial/bounce`"""
    path: Path


def folder() -> Path | None:
    """Return where the shipped scenes lie, or None where they were not installed."""
    for candidate in (PACKAGE.parent / "scenes", PACKAGE / "shipped"):
        if (candidate / SCHEMA).is_file():
            return candidate
    return None


def shipped() -> tuple[ShippedScene, ...]:
    """Return every scene that ships, by name."""
    root = folder()
    files = () if root is None else root.glob("*/*.toml")
    return tuple(sorted(ShippedScene(f"{file.parent.name}/{file.stem}", file) for file in files))


def find(text: str) -> Path:
    """Return the file of a scene: a path that exists as given, or else a shipped one by its name.

    Args:
        text: a path, `tutorial/bounce`, or `bounce` where no other folder has one of that name.

    Raises:
        UnknownSceneError: there is no such scene, or there are several.
    """
    if _is_file(text):
        return Path(text)
    scenes = shipped()
    found = _shipped_as(text)
    if len(found) == 1:
        return found[0].path
    if found:
        names = ", ".join(scene.name for scene in found)
        raise UnknownSceneError(f"{text!r} could be any of {names}; give the folder too")
    within = scenes_in(text)
    if within or _is_folder(text):
        raise UnknownSceneError(f"is a folder; {_offer(text, within)}")
    names_of = {name: scene.name for scene in scenes for name in (scene.path.stem, scene.name)}
    close = dict.fromkeys(names_of[match] for match in difflib.get_close_matches(text, names_of, n=3))
    meant = f"; did you mean {' or '.join(close)}?" if close else ";"
    raise UnknownSceneError(f"no file and no shipped scene is called {text!r}{meant} `sandbox scenes` lists them")


def scenes_in(text: str) -> tuple[str, ...]:
    """Return the names of the scenes of a folder, sorted: on the disk, or a shipped one, such as `tutorial`.

    A TOML file without any key of a scene is left out; one that cannot be parsed is kept, and reported.
    The result is empty where the text is a file or the name of a shipped scene.
    """
    if _is_file(text) or _shipped_as(text):
        return ()
    if not _is_folder(text):
        return tuple(scene.name for scene in shipped() if scene.name.rpartition("/")[0] == text.rstrip("/"))
    return tuple(sorted(str(file) for file in Path(text).glob("*.toml") if file.is_file() and _seems_scene(file)))


def _seems_scene(file: Path) -> bool:
    from sandbox.scene.model import Scene

    try:
        keys = set(tomllib.loads(file.read_bytes().decode("utf-8-sig")))
    except (OSError, ValueError, RecursionError):
        return True
    return not keys or not keys.isdisjoint(field.alias or name for name, field in Scene.model_fields.items())


def _offer(text: str, names: tuple[str, ...]) -> str:
    """Say which scenes a folder has, three of them by name."""
    if not names:
        below = sorted({str(file.parent) for file in Path(text).glob("*/*.toml")})
        return "it holds no scene (*.toml)" + (f"; folders in it do: {', '.join(below[:5])}" if below else "")
    return f"name one of its scenes: {', '.join(names[:3])}{f' … {len(names)} in all' if len(names) > 3 else ''}"


def _shipped_as(text: str) -> list[ShippedScene]:
    return [scene for scene in shipped() if text in (scene.name, scene.path.stem)]


def _is_folder(text: str) -> bool:
    try:
        return bool(text) and Path(text).is_dir()
    except (OSError, ValueError):
        return False


def _is_file(text: str) -> bool:
    """Tell whether a text is the path of something to read; what may not be read says so when it is."""
    try:
        return Path(text).is_file() or Path(text).is_fifo()
    except PermissionError:
        return True
    except OSError:  # such as a name longer than any file's
        return False
