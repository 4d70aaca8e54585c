"""Scene files: reading, checking, writing. Every fault of a file is reported at once.

Parsing is tomllib's, validation pydantic's strict mode on JSON (so that arrays become tuples); what no model can
see, such as names that point at nothing, is `crosscheck.py`'s.
"""

import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sandbox.scene import presets
from sandbox.scene.address import AddressError, assign, parse_assignment
from sandbox.scene.crosscheck import crosscheck
from sandbox.scene.document import read_model, to_document
from sandbox.scene.faults import Fault, Lines, Location, SceneError, path_of
from sandbox.scene.model import Scene
from sandbox.scene.shipped import UnknownSceneError, find

MAX_BYTES = 256 * 2**20

_TOO_DEEP = re.compile(r"(?<![\w-])(?:[\w-]+\.){100}")

Override = str | tuple[str, Any]
"""`"KEY=VALUE"`, or `(KEY, value)`."""


def load(path: str | Path, overrides: Iterable[Override] = ()) -> Scene:
    """Read a scene file.

    Args:
        path: the file, or the name of a scene that ships, such as `bounce` or `tutorial/bounce`.
        overrides: values to set before the scene is checked.

    Raises:
        SceneError: with every fault found. Nothing is partly loaded.
    """
    try:
        file = find(str(path))
    except UnknownSceneError as error:
        raise SceneError([Fault(str(path), None, "", str(error))]) from None
    return loads(_read(file), str(file), overrides)


def loads(text: str, file: str = "<scene>", overrides: Iterable[Override] = ()) -> Scene:
    """Read a scene from a text; `file` is what faults call it.

    Raises:
        SceneError: with every fault found.
    """
    try:
        if _TOO_DEEP.search(text):  # tomllib's memory grows with the square of a key's depth
            raise RecursionError
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SceneError([_syntax_fault(file, text, error)]) from None
    except ValueError as error:  # an integer of thousands of digits
        raise SceneError([Fault(file, None, "", f"cannot be read: {error}")]) from None
    except RecursionError:
        raise SceneError([Fault(file, None, "", "values are nested too deeply for a scene")]) from None
    if not document:
        message = "the file is empty; a scene has at least a body, such as [[ball]] with position and radius"
        raise SceneError([Fault(file, 1, "", message)])
    return from_document(document, file, overrides, text)


def from_document(
    document: dict[str, Any], file: str = "<scene>", overrides: Iterable[Override] = (), text: str = ""
) -> Scene:
    """Check a scene given as nested dicts and lists, as TOML or JSON would hold it.

    Raises:
        SceneError: with every fault found; lines are known where the `text` is given.
    """
    assignments, faults = _parsed(overrides, file)
    stated, whole, changed = document, True, set[Location]()
    if presets.has_preset(document, (path for path, _ in assignments)):
        stated, changed, assignments, wrong = presets.set_first(document, assignments)
        faults += [Fault(file, None, "--set", message) for message in wrong]
        written = presets.written_out(stated)
        document, whole = (stated, False) if written is None else (written, True)
    unset: list[Override] = []
    for path, value in assignments:
        try:
            document, location = assign(document, path, value)
            changed.add(location)
        except AddressError as error:
            unset.append((path, value))
            if whole:
                faults.append(Fault(file, None, "--set", str(error)))
    if faults:
        raise SceneError(faults)

    found: list[tuple[Location, str]]
    try:
        scene = read_model(document)
    except ValidationError as error:
        from sandbox.scene.explain import explain  # only faults need these
        from sandbox.scene.salvage import crosscheck_the_rest

        errors = [e for e in error.errors(include_url=False) if not _only_seems_short(e)]
        found = [explain(details) for details in errors]
        found += crosscheck_the_rest(document, [tuple(details["loc"]) for details in errors])
    except (RecursionError, ValueError) as error:
        found = [((), f"the scene cannot be read: {error}")]
    else:
        if not whole:
            from sandbox.scene.expanding import faults_of  # few scenes need it

            found = list(faults_of(scene))
            if not found:  # it was mended by what was set
                return from_document(document, file, unset, text)
        else:
            found = crosscheck(scene)
            if not found:
                return scene

    lines = Lines(text)
    for location, message in dict.fromkeys(found):
        is_set = any(location[: len(c)] == c for c in changed)
        place = presets.place_of(location, document, stated) if whole else location
        line = None if is_set else lines.find(place)
        path = path_of(location, document) + (" (set)" if is_set else "")
        faults.append(Fault(file, line, path, message))
    raise SceneError(sorted(faults, key=lambda fault: (fault.line is None, fault.line or 0)))


def _parsed(overrides: Iterable[Override], file: str) -> tuple[list[tuple[str, Any]], list[Fault]]:
    """Return overrides as paths and values, and the faults of those that are none."""
    parsed, faults = [], []
    for override in overrides:
        try:
            parsed.append(parse_assignment(override) if isinstance(override, str) else override)
        except AddressError as error:
            faults.append(Fault(file, None, "--set", str(error)))
    return parsed, faults


def dumps(scene: Scene) -> str:
    """Write a scene as TOML; what is at its default is left out. `loads(dumps(scene)) == scene`."""
    import tomlkit

    return tomlkit.dumps(to_document(scene))


def _read(path: str | Path) -> str:
    file = str(path)
    try:
        if Path(path).stat().st_size > MAX_BYTES:
            message = f"larger than {MAX_BYTES >> 20} MiB; generators such as [[grid]] say more in less"
            raise SceneError([Fault(file, None, "", message)])
        return Path(path).read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except OSError as error:
        raise SceneError([Fault(file, None, "", f"cannot be read: {error.strerror or error}")]) from None
    except ValueError as error:
        reason = "is not UTF-8 text; a scene is a TOML file" if isinstance(error, UnicodeDecodeError) else str(error)
        raise SceneError([Fault(file, None, "", reason)]) from None


def _only_seems_short(details: Any) -> bool:
    """Tell whether an array is long enough; pydantic counts only the elements that have no faults of their own."""
    return bool(details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"])


def _syntax_fault(file: str, text: str, error: tomllib.TOMLDecodeError) -> Fault:
    message = str(error)
    at = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    if at is None:  # at the end of the document
        return Fault(file, text.rstrip("\n").count("\n") + 1, "", f"not TOML: {message}")
    return Fault(file, int(at[1]), "", f"not TOML: {message[: at.start()]}, at column {at[2]}")
