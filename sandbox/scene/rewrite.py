"""Rewriting: settings put into a scene file's `[solver]`, while the rest of the file stays as it was written.

Only the characters of the values that change are touched, so that comments, order, blank lines, quotes and line
endings stay to the byte. What comes out is read again, and must say the same but for the settings.
"""

import math
import os
import re
import shutil
import tomllib
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

from sandbox.scene.faults import TOKEN, Fault, SceneError
from sandbox.scene.file import MAX_BYTES, loads
from sandbox.scene.shipped import PACKAGE
from sandbox.scene.statements import Statement, statements
from sandbox.whole import whole

Edit = tuple[int, int, str]
"""From where to where a text is replaced, and by what."""

_COMMENT = re.compile(r"[ \t]*#")


def with_solver(text: str, settings: Mapping[str, Any], file: str = "<scene>") -> str:
    """Return a scene file's text with settings put into its `[solver]`.

    A `[solver]` that is missing is added behind `[world]`, or before the first table where there is none. Dotted keys
    (`solver.dt = 0.01`) and an inline table (`solver = { dt = 0.01 }`) stay what they are. A value that is as it
    should be already is not touched.

    Args:
        text: of the file; it may begin with a byte order mark and have line endings of either kind.
        settings: a value for each key of `[solver]`; None takes the key out, with the comment on its line.
        file: what faults call it.

    Raises:
        SceneError: the text is no scene, or one that has faults with these settings.
        ValueError: the file is written in a way that cannot be changed; it would then say something else.
    """
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    text = text.removeprefix(mark)
    loads(text, file)
    before = tomllib.loads(text)
    solver = before.get("solver", {})
    changes = {k: v for k, v in settings.items() if (k in solver if v is None else not _same(solver.get(k), v))}
    if not changes:
        return mark + text
    result = _edited(text, _edits(text, changes))
    after = {**solver, **{key: _plain(value) for key, value in changes.items()}}
    wanted = {**before, "solver": {key: value for key, value in after.items() if value is not None}}
    loads(result, file)
    found = tomllib.loads(result)
    if {"solver": {}, **found} != wanted:
        raise ValueError(f"{file}: its [solver] is written in a way that cannot be changed; please change it by hand")
    return mark + result


def write_solver(path: str | Path, settings: Mapping[str, Any]) -> bool:
    """Put settings into the `[solver]` of a scene file, whole or not at all; its permissions are kept.

    Returns:
        Whether the file changed.

    Raises:
        SceneError: it is no scene file, or cannot be read or written, or has faults with these settings.
    """
    file = str(path)
    target = _writable(Path(path), file)
    try:
        text = target.read_bytes().decode("utf-8")
        result = with_solver(text, settings, file)
        if result == text:
            return False
        with whole(target) as temporary:
            temporary.write_bytes(result.encode("utf-8"))
            shutil.copymode(target, temporary)
    except UnicodeDecodeError:
        raise SceneError([Fault(file, None, "", "is not UTF-8 text; a scene is a TOML file")]) from None
    except ValueError as error:
        raise SceneError([Fault(file, None, "", str(error).removeprefix(f"{file}: "))]) from None
    except OSError as error:
        raise SceneError([Fault(file, None, "", f"cannot be written: {error.strerror or error}")]) from None
    return True


def _writable(path: Path, file: str) -> Path:
    """Return the file behind a path, links followed.

    Raises:
        SceneError: nothing should be written there.
    """
    reason = ""
    try:
        target = path.resolve()
        if target.suffix.lower() in (".json", ".npz"):
            reason = "is no scene file; settings are written into a scene's TOML file"
        elif not target.exists():
            reason = "cannot be read: No such file or directory"
        elif not target.is_file():
            reason = "is no plain file; settings are written into a scene's TOML file"
        elif target.is_relative_to(PACKAGE / "shipped"):
            reason = "is part of the installed package, and stays as it ships; copy it, and change the copy"
        elif not os.access(target, os.W_OK):
            reason = "cannot be written: it is read-only; copy it, or make it writable"
        elif target.stat().st_size > MAX_BYTES:
            reason = f"larger than {MAX_BYTES >> 20} MiB; generators such as [[grid]] say more in less"
    except (OSError, RuntimeError) as error:  # a loop of links, or a folder that may not be entered
        reason = f"cannot be read: {getattr(error, 'strerror', None) or error}"
    if reason:
        raise SceneError([Fault(file, None, "", reason)])
    return target


def _edits(text: str, changes: Mapping[str, Any]) -> list[Edit]:
    """Return what to replace in a text so that its `[solver]` has some values, or lacks those that are None."""
    found = list(statements(text))
    heading = next((k for k, s in enumerate(found) if s.heading and s.keys == ("solver",)), None)
    first = next((k for k, s in enumerate(found) if s.heading), len(found))
    for statement in found[:first]:
        if statement.keys == ("solver",):
            return [(*statement.value, _inline(text[slice(*statement.value)], changes))]
    if heading is not None:
        stop = next((k for k in range(heading + 1, len(found)) if found[k].heading), len(found))
        own = {s.keys[-1]: s for s in found[heading + 1 : stop]}
        return _changed(text, changes, own, found[stop - 1], "")
    dotted = [s for s in found[:first] if s.keys[0] == "solver"]
    if dotted:
        prefix = text[slice(*dotted[-1].head)]
        prefix = prefix[: _last_dot(prefix) + 1]
        return _changed(text, changes, {s.keys[-1]: s for s in dotted}, dotted[-1], prefix)
    new = {key: value for key, value in changes.items() if value is not None}
    return [_added(text, found, new)]


def _changed(
    text: str, changes: Mapping[str, Any], own: Mapping[str, Statement], last: Statement, prefix: str
) -> list[Edit]:
    """Return what to replace where each setting has a line of its own; new ones follow the `last` of these."""
    edits, lines = [], ""
    ending = _ending(text, last)
    indent = "" if last.heading else text[last.begin : last.head[0]]
    for key, value in changes.items():
        statement = own.get(key)
        if statement is None:
            lines += f"{indent}{prefix}{key} = {written(value)}{ending}"
        elif value is None:
            edits.append((statement.begin, statement.end, ""))
        else:
            edits.append((*statement.value, written(value)))
    if lines:
        broken = text[last.value[1] : last.end].endswith("\n")
        edits.append((last.end, last.end, lines if broken else ending + lines.removesuffix(ending)))
    return edits


def _added(text: str, found: list[Statement], values: Mapping[str, Any]) -> Edit:
    """Return where a `[solver]` of its own goes: behind `[world]`, or before the first table, or last."""
    headings = [s for s in found if s.heading]
    world = next((k for k, s in enumerate(headings) if s.keys == ("world",)), -1)
    ending = _ending(text, found[0]) if found else "\n"
    block = "".join(f"{line}{ending}" for line in ("[solver]", *(f"{k} = {written(v)}" for k, v in values.items())))
    if world + 1 == len(headings):
        return len(text), len(text), _gap(text, ending) + block
    place = _above_comments(text, headings[world + 1].begin)
    return place, place, _gap(text[:place], ending) + block + ending


def _gap(text: str, ending: str) -> str:
    """Return the line endings that a text lacks to end in a blank line."""
    if not text.strip() or re.search(r"\n[ \t]*\r?\n\Z", text):
        return ""
    return ending if text.endswith("\n") else 2 * ending


def _above_comments(text: str, begin: int) -> int:
    """Return where the comment lines right above a line begin; where they begin the file they are the file's."""
    place = begin
    while place:
        line = text.rfind("\n", 0, place - 1) + 1
        if not _COMMENT.match(text, line, place):
            return place
        place = line
    return begin


def _inline(text: str, changes: Mapping[str, Any]) -> str:
    """Return an inline table with some values, or without those that are None."""
    inner = text[1:-1]
    commas = [m.start() for m in TOKEN.finditer(inner) if m[0] == ","]
    pieces: dict[str, tuple[str, str]] = {}
    for begin, end in pairwise((-1, *commas, len(inner))):
        piece = inner[begin + 1 : end].strip()
        if piece:
            (only,) = statements(piece)
            pieces[only.keys[0]] = piece[: only.value[0]], piece[only.value[0] :]
    for key, value in changes.items():
        if value is None:
            del pieces[key]
        else:
            pieces[key] = pieces.get(key, (f"{key} = ", ""))[0], written(value)
    kept = ", ".join(head + value for head, value in pieces.values())
    space = " " if inner[:1].isspace() or not inner else ""
    return f"{{{space}{kept}{space}}}" if kept else "{}"


def _last_dot(key: str) -> int:
    """Return where the last dot of a dotted key of two parts stands; quoted parts are not looked into."""
    return max(m.start() for m in re.finditer(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|\.', key) if m[0] == ".")


def written(value: Any) -> str:
    """Return a setting as TOML writes it, figures in the shortest way that says the same: 0.001, 1e-6, 4."""
    value = _plain(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return repr(value)
        return re.sub(r"e([+-]?)0*(\d)", lambda e: f"e{e[1].strip('+')}{e[2]}", repr(value))
    import tomlkit  # only what is rewritten needs it

    return str(tomlkit.item(value).as_string())


def _plain(value: Any) -> Any:
    """Return a number of whatever library as Python's own."""
    if isinstance(value, float):
        return float(value)
    return value.item() if hasattr(value, "item") and hasattr(value, "dtype") else value


def _same(now: Any, wanted: Any) -> bool:
    wanted = _plain(wanted)
    if isinstance(now, bool) or isinstance(wanted, bool):
        return now is wanted
    return bool(now == wanted)


def _ending(text: str, statement: Statement) -> str:
    """Return the line ending of a statement; of the text where that is its last line."""
    line = text[statement.begin : statement.end]
    line = line if line.endswith("\n") else text
    return "\r\n" if "\r\n" in line else "\n"


def _edited(text: str, edits: list[Edit]) -> str:
    for begin, end, new in sorted(edits, reverse=True):
        text = text[:begin] + new + text[end:]
    return text
