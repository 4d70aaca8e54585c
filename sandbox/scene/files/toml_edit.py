"""Changes to `[solver]` in the text of a scene file; the rest of the file is not modified.

Only the characters of changed values are replaced: comments, order, blank lines, quotes and line endings are kept to
the byte. The result is parsed again, and must equal the original document except for the settings.
"""

import math
import os
import re
import shutil
import tomllib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from sandbox.atomic_write import atomic_write
from sandbox.scene.errors import TOKEN, Fault, SceneError
from sandbox.scene.files.load import loads, too_large
from sandbox.scene.files.shipped_scenes import PACKAGE


class Statement(NamedTuple):
    """A heading, or a key with its value, of a TOML text; positions are offsets in characters."""

    keys: tuple[str, ...]
    """parts of the key, without those of the heading above"""
    heading: bool
    begin: int
    """start of its first line"""
    head: tuple[int, int]
    """start and end of its key or heading"""
    value: tuple[int, int]
    """start and end of its value; for a heading, its end twice"""
    end: int
    """end of its last line, including comment and line break"""


def statements(text: str) -> Iterator[Statement]:
    """Yield the statements of a valid TOML text in order, in linear time."""
    open_brackets, first, equals, last = 0, -1, -1, -1
    for token in TOKEN.finditer(text):
        sign = token[0]
        if sign == "\n":
            if first >= 0 and open_brackets == 0:
                yield _statement(text, first, equals, last, token.end())
                first, equals = -1, -1
        elif sign[0] != "#":
            if first < 0:
                first = token.start()
            if sign == "=" and equals < 0:
                equals = token.start()
            open_brackets += (sign in ("[", "{")) - (sign in ("]", "}"))
            last = token.end()
    if first >= 0:
        yield _statement(text, first, equals, last, len(text))


def _statement(text: str, first: int, equals: int, last: int, end: int) -> Statement:
    begin = text.rfind("\n", 0, first) + 1
    if text[first] == "[":
        return Statement(keys_of(text[first:last]), True, begin, (first, last), (last, last), end)
    blank = re.compile(r"\s*").match(text, equals + 1)
    assert blank is not None  # it also matches the empty text
    head = first, first + len(text[first:equals].rstrip())
    return Statement(keys_of(text[slice(*head)] + "=0"), False, begin, head, (blank.end(), last), end)


@lru_cache(maxsize=10_000)
def keys_of(text: str) -> tuple[str, ...]:
    """Return the parts of the key of a statement, such as `a.b = 0`, or of a heading."""
    keys: list[str] = []
    value: Any = tomllib.loads(text)
    while isinstance(value, dict) and value:
        key, value = next(iter(value.items()))
        keys.append(key)
    return tuple(keys)


Edit = tuple[int, int, str]
"""Start and end of the replaced text, and its replacement."""

_COMMENT = re.compile(r"[ \t]*#")


def with_solver(text: str, settings: Mapping[str, Any], file: str = "<scene>") -> str:
    """Return the text of a scene file with settings put into its `[solver]`.

    A missing `[solver]` is added after `[world]`, or before the first table if there is none. Dotted keys (`solver.dt =
    0.01`) and an inline table (`solver = { dt = 0.01 }`) keep their form. A value that is already equal is not
    modified.

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
    before = tomllib.loads(text)
    solver = before.get("solver", {})
    changes = {k: v for k, v in settings.items() if (k in solver if v is None else not _is_equal(solver.get(k), v))}
    if not changes:
        return mark + text
    result = _edited(text, _edits(text, changes))
    after = {**solver, **{key: _plain(value) for key, value in changes.items()}}
    wanted = {**before, "solver": {key: value for key, value in after.items() if value is not None}}
    loads(result, file)
    found = tomllib.loads(result)
    if {"solver": {}, **found} != wanted:
        raise ValueError(f"{file}: the format of its [solver] cannot be changed automatically; edit it by hand")
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
        raise SceneError([Fault(file, None, "", "is not UTF-8 text; a scene is a TOML file")]) from None
    except ValueError as error:
        raise SceneError([Fault(file, None, "", str(error).removeprefix(f"{file}: "))]) from None
    except OSError as error:
        raise SceneError([Fault(file, None, "", f"cannot be written: {error.strerror or error}")]) from None
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
        raise SceneError([Fault(file, None, "", reason)])
    return target


def _edits(text: str, changes: Mapping[str, Any]) -> list[Edit]:
    """Return the edits that give `[solver]` the values, and remove the keys whose value is None."""
    found = list(statements(text))
    heading = next((k for k, s in enumerate(found) if s.heading and s.keys == ("solver",)), None)
    first = next((k for k, s in enumerate(found) if s.heading), len(found))
    for statement in found[:first]:
        if statement.keys == ("solver",):
            return [(*statement.value, _inline(text[slice(*statement.value)], changes))]
    if heading is not None:
        stop = next((k for k in range(heading + 1, len(found)) if found[k].heading), len(found))
        statements_of = {s.keys[-1]: s for s in found[heading + 1 : stop]}
        return _changed(text, changes, statements_of, found[stop - 1], "")
    dotted = [s for s in found[:first] if s.keys[0] == "solver"]
    if dotted:
        prefix = text[slice(*dotted[-1].head)]
        prefix = prefix[: _last_dot(prefix) + 1]
        return _changed(text, changes, {s.keys[-1]: s for s in dotted}, dotted[-1], prefix)
    new = {key: value for key, value in changes.items() if value is not None}
    return [_added(text, found, new)]


def _changed(
    text: str, changes: Mapping[str, Any], statements_of: Mapping[str, Statement], last: Statement, prefix: str
) -> list[Edit]:
    """Return the edits of settings with one line each; new ones are inserted after `last`."""
    edits, lines = [], ""
    ending = _ending(text, last)
    indent = "" if last.heading else text[last.begin : last.head[0]]
    for key, value in changes.items():
        statement = statements_of.get(key)
        if statement is None:
            lines += f"{indent}{prefix}{key} = {written(value)}{ending}"
        elif value is None:
            edits.append((statement.begin, statement.end, ""))
        else:
            edits.append((*statement.value, written(value)))
    if lines:
        has_line_break = text[last.value[1] : last.end].endswith("\n")
        edits.append((last.end, last.end, lines if has_line_break else ending + lines.removesuffix(ending)))
    return edits


def _added(text: str, found: list[Statement], values: Mapping[str, Any]) -> Edit:
    """Return the edit that adds a `[solver]` table: after `[world]`, before the first table, or at the end."""
    headings = [s for s in found if s.heading]
    world = next((k for k, s in enumerate(headings) if s.keys == ("world",)), -1)
    ending = _ending(text, found[0]) if found else "\n"
    block = "".join(f"{line}{ending}" for line in ("[solver]", *(f"{k} = {written(v)}" for k, v in values.items())))
    if world + 1 == len(headings):
        return len(text), len(text), _gap(text, ending) + block
    position = _above_comments(text, headings[world + 1].begin)
    return position, position, _gap(text[:position], ending) + block + ending


def _gap(text: str, ending: str) -> str:
    """Return the line endings needed for the text to end in a blank line."""
    if not text.strip() or re.search(r"\n[ \t]*\r?\n\Z", text):
        return ""
    return ending if text.endswith("\n") else 2 * ending


def _above_comments(text: str, begin: int) -> int:
    """Return the start of the comment lines directly above a line; comments at the start belong to the file."""
    position = begin
    while position:
        line = text.rfind("\n", 0, position - 1) + 1
        if not _COMMENT.match(text, line, position):
            return position
        position = line
    return begin


def _inline(text: str, changes: Mapping[str, Any]) -> str:
    """Return an inline table with the given values, without the keys whose value is None."""
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
    """Return the offset of the last dot of a dotted key of two parts, outside quotes."""
    return max(m.start() for m in re.finditer(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|\.', key) if m[0] == ".")


def written(value: Any) -> str:
    """Return a setting in TOML, numbers in their shortest form: 0.001, 1e-6, 4."""
    value = _plain(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            return repr(value)
        return re.sub(r"e([+-]?)0*(\d)", lambda e: f"e{e[1].strip('+')}{e[2]}", repr(value))
    import tomlkit  # imported only if something is rewritten

    return str(tomlkit.item(value).as_string())


def _plain(value: Any) -> Any:
    """Return a number of any library as a Python number."""
    if isinstance(value, float):
        return float(value)
    return value.item() if hasattr(value, "item") and hasattr(value, "dtype") else value


def _is_equal(present: Any, wanted: Any) -> bool:
    wanted = _plain(wanted)
    if isinstance(present, bool) or isinstance(wanted, bool):
        return present is wanted
    return bool(present == wanted)


def _ending(text: str, statement: Statement) -> str:
    """Return the line ending of a statement; that of the text if it is its last line."""
    line = text[statement.begin : statement.end]
    line = line if line.endswith("\n") else text
    return "\r\n" if "\r\n" in line else "\n"


def _edited(text: str, edits: list[Edit]) -> str:
    for begin, end, new in sorted(edits, reverse=True):
        text = text[:begin] + new + text[end:]
    return text
