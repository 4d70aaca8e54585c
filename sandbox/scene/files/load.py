"""Reading, checking and writing of scene files. All faults of a file are reported at once.

tomllib parses; pydantic validates in strict mode on JSON, so that arrays become tuples; `validate/scene.py` checks
relations between elements, such as references to bodies by name.
"""

import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

from pydantic import ValidationError

from sandbox.resource_limits import FILE_SIZE, read_limited
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.game_tables import has_preset
from sandbox.scene.errors import Fault, Lines, LocatedMessage, Location, SceneError, path_of
from sandbox.scene.files import presets
from sandbox.scene.files.document import NestingError, check_text, check_value, read_model, to_document
from sandbox.scene.files.overrides import AddressError, assign, parse_assignment
from sandbox.scene.files.shipped_scenes import UnknownSceneError, find
from sandbox.scene.validate.scene import crosscheck

NO_TIME = 5e-324
"""s, smallest duration of a scene: replaces 0 while the scene of a session without steps is checked."""

_CHECKED = "_is_checked"
"""Entry of the dictionary of a scene that was found without faults; copies with other values do not have it"""

Override = str | tuple[str, Any]
"""`"KEY=VALUE"`, or `(KEY, value)`."""


def load(path: str | Path, overrides: Iterable[Override] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: path of the file, or name of a shipped scene, such as `bounce` or `tutorial/bounce`.
        overrides: values that are set before the scene is checked, each `"KEY=VALUE"` or `(KEY, value)`.

    Returns:
        The scene.

    Raises:
        SceneError: the file cannot be found or read, or the scene is invalid; the error has every fault that was found.

    Example:
        >>> scene = sandbox.load("bounce", ["world.duration=2"])
        >>> scene.world.duration
        2.0
    """
    try:
        file = find(str(path))
    except UnknownSceneError as error:
        raise SceneError([Fault.of(str(path), str(error))]) from None
    return loads(_read(file), str(file), overrides)


def as_scene(scene: Scene | str | Path) -> Scene:
    """Return a scene, loaded if it is given by its name or path. One that was made in Python is checked as a file is.

    Raises:
        SceneError: as `load`.
        TypeError: it is neither.
    """
    if not isinstance(scene, Scene | str | Path):
        hint = "; a recording has its scene in `.scene`" if hasattr(scene, "actions") else ""
        raise TypeError(f"a scene, a name or a path is needed, not a {type(scene).__name__}{hint}")
    if not isinstance(scene, Scene):
        return load(scene)
    if _CHECKED not in scene.__dict__ and (found := crosscheck(scene)):
        document = to_document(scene)
        raise SceneError([Fault("scene", None, path_of(location, document), text) for location, text in found])
    scene.__dict__[_CHECKED] = True
    return scene


def loads(text: str, file: str = "<scene>", overrides: Iterable[Override] = ()) -> Scene:
    """Read a scene from a TOML text.

    Args:
        text: the text.
        file: name of the text in faults.
        overrides: values that are set before the scene is checked, each `"KEY=VALUE"` or `(KEY, value)`.

    Returns:
        The scene.

    Raises:
        SceneError: the scene is invalid; the error has every fault that was found.

    Example:
        >>> scene = sandbox.loads('ball = [{ name = "a", position = [0, 1], radius = 0.1 }]')
        >>> scene.balls[0].position
        (0.0, 1.0)
    """
    return SceneText.of(text, file).scene(overrides)


@dataclass(frozen=True)
class SceneText:
    """Text of a scene file, parsed once for many scenes that differ in values set."""

    file: str
    """name of the text in faults"""
    text: str
    document: dict[str, Any]
    """the parsed text, not yet checked as a scene"""

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a scene file.

        Raises:
            SceneError: the file cannot be read, or is not TOML.
        """
        return cls.of(_read(path), str(path))

    @classmethod
    def of(cls, text: str, file: str = "<scene>") -> Self:
        """Parse a text.

        Raises:
            SceneError: it is not TOML, or empty.
        """
        try:
            check_text(text)
            document = tomllib.loads(text)
            check_value(document)
        except tomllib.TOMLDecodeError as error:
            from sandbox.scene.files.toml_mistakes import syntax_fault  # imported only if there are faults

            raise SceneError([syntax_fault(file, text, error)]) from None
        except NestingError as error:
            raise SceneError([Fault(file, error.line, "", str(error))]) from None
        except ValueError as error:  # an integer of thousands of digits
            raise SceneError([Fault.of(file, f"cannot be read: {error}")]) from None
        if not document:
            message = "the file is empty; a scene needs at least one body, such as a [[ball]] with position and radius"
            raise SceneError([Fault(file, 1, "", message)])
        return cls(file, text, document)

    def scene(self, overrides: Iterable[Override] = ()) -> Scene:
        """Return the scene with values set.

        Raises:
            SceneError: the scene is invalid; the error has every fault that was found.
        """
        return from_document(self.document, self.file, overrides, self.text)


def from_document(
    document: dict[str, Any], file: str = "<scene>", overrides: Iterable[Override] = (), text: str = ""
) -> Scene:
    """Check a scene given as nested dicts and lists, as parsed from TOML or JSON.

    Args:
        document: the scene.
        file: name of the document in faults.
        overrides: values that are set before the scene is checked.
        text: source text of the document, from which faults get their line; without it they have none.

    Raises:
        SceneError: the scene is invalid; the error has every fault that was found.
    """
    try:
        check_value(document)
    except NestingError as error:
        raise SceneError([Fault.of(file, str(error))]) from None
    assignments, faults = _parse_overrides(overrides, file)
    stated, whole, changed = document, True, set[Location]()
    if has_preset(document, (path for path, _ in assignments)):
        stated, changed, assignments, wrong = presets.apply_preset_overrides(document, assignments)
        faults += [Fault(file, None, "--set", message, key) for key, message in wrong]
        written = presets.expanded_document(stated)
        document, whole = (stated, False) if written is None else (written, True)
    remaining: list[Override] = []
    for path, value in assignments:
        try:
            document, location = assign(document, path, value)
            changed.add(location)
        except AddressError as error:
            remaining.append((path, value))
            if whole:
                faults.append(Fault(file, None, "--set", str(error), path))
    if faults:
        raise SceneError(faults)

    found: list[LocatedMessage]
    try:
        scene = read_model(document)
    except ValidationError as error:
        # imported only if there are faults
        from sandbox.scene.files.diagnosis import faults_of

        found = faults_of(document, error)
    except ValueError as error:
        found = [((), f"the scene cannot be read: {error}")]
    else:
        if not whole:
            found = list(presets.faults_of(scene))
            if not found:  # an override has removed the fault
                return from_document(document, file, remaining, text)
        else:
            found = crosscheck(scene)
            if not found:
                scene.__dict__[_CHECKED] = True
                return scene

    stated_at = partial(presets.stated_location, document=document, stated=stated) if whole else None
    raise SceneError(_located(found, file, text, document, changed, stated_at))


def _located(
    found: list[LocatedMessage],
    file: str,
    text: str,
    document: dict[str, Any],
    changed: set[Location],
    stated_at: Callable[[Location], Location] | None,
) -> list[Fault]:
    """Return faults in the order of their lines.

    Args:
        found: locations in the document, and messages.
        file: name of the document.
        text: its source text, which has the lines.
        document: the document, with presets expanded.
        changed: locations that overrides have set; their faults have no line.
        stated_at: returns the location in the source text of a location in the document; default: the same.
    """
    lines, faults = Lines(text), []
    for location, message in dict.fromkeys(found):
        is_set = any(location[: len(c)] == c for c in changed)
        line = None if is_set else lines.find(location if stated_at is None else stated_at(location))
        faults.append(Fault(file, line, path_of(location, document) + (" (set)" if is_set else ""), message))
    return sorted(faults, key=lambda fault: (fault.line is None, fault.line or 0))


def from_session(document: dict[str, Any], file: str = "<session>", overrides: Iterable[Override] = ()) -> Scene:
    """Check the scene of a session or of a stored run, as `from_document` does; its duration may be 0 s.

    Raises:
        SceneError: the scene is invalid; the error has every fault that was found.
    """
    world = document.get("world")
    if not isinstance(world, dict) or world.get("duration") != 0 or isinstance(world["duration"], bool):
        return from_document(document, file, overrides)
    scene = from_document({**document, "world": {**world, "duration": NO_TIME}}, file, overrides)
    if scene.world.duration != NO_TIME:  # it was set
        return scene
    return scene.with_duration(0.0)


def _parse_overrides(overrides: Iterable[Override], file: str) -> tuple[list[tuple[str, Any]], list[Fault]]:
    """Return overrides as paths and values, and the faults of invalid ones."""
    parsed, faults = [], []
    for override in overrides:
        try:
            path, value = parse_assignment(override) if isinstance(override, str) else override
            check_value(value)
            parsed.append((path, value))
        except (AddressError, NestingError) as error:
            key = "" if isinstance(override, str) else override[0]
            faults.append(Fault(file, None, "--set", str(error), key))
    return parsed, faults


def dumps(scene: Scene) -> str:
    """Return a scene as TOML. Values equal to their default are left out.

    `loads(dumps(scene)) == scene`.

    Args:
        scene: the scene.

    Raises:
        ValueError: the scene has another start than that of a file, as those of `Starts`.

    Example:
        >>> print(sandbox.dumps(sandbox.Scene(balls=[sandbox.Ball(position=[0.0, 1.0], radius=0.1)])).strip())
        [[ball]]
        position = [0.0, 1.0]
        radius = 0.1
    """
    import tomlkit

    if scene.is_perturbed:
        raise ValueError("a perturbed start of a scene cannot be written; write the scene, and the number of the start")
    return tomlkit.dumps(to_document(scene))


def too_large(size: int) -> str | None:
    """Return the reason why a scene file of this size in bytes is not read, or None if it is within the limit."""
    subject = "generators such as [[grid]] need less text than this file's"
    return FILE_SIZE.refusal(subject, size)


def _read(path: str | Path) -> str:
    file = str(path)
    try:
        if (message := too_large(Path(path).stat().st_size)) is not None:
            raise SceneError([Fault.of(file, message)])
        return read_limited(Path(path), FILE_SIZE.value).decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        raise SceneError([Fault.of(file, f"cannot be read: {error.strerror or error}")]) from None
    except ValueError as error:
        if isinstance(error, UnicodeDecodeError):
            reason = "is not UTF-8 text; a scene is a TOML file"
        else:
            reason = f"{error}; generators such as [[grid]] need less text"
        raise SceneError([Fault.of(file, reason)]) from None
