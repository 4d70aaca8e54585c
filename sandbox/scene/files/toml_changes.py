"""Changes to the text of a scene file in place: values set and removed, elements added and removed.

Only the characters of what changes are replaced; comments, order, blank lines, quotes, number spellings and line
endings of the rest are kept to the byte. The changes are made to the document first; the text is then edited where the
changed document differs from the original. The result is parsed again, and must equal the changed document.
"""

import datetime
import json
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from sandbox.scene.errors import Location, path_of
from sandbox.scene.files.toml_index import BLANK_LINE, COMMENT_LINE, InlineContainer, Statement, TextEntry, TomlIndex


class TextEditError(ValueError):
    """The text cannot be changed automatically; `str()` has the reason."""


@dataclass(frozen=True)
class SetValue:
    """Set a value; missing tables around it are created."""

    location: Location
    """such as `("ball", 2, "position")`, `("ball", 2, "position", 1)` or `("title",)`"""
    value: Any
    """number, bool, string, list, or dict, which is written as an inline table"""


@dataclass(frozen=True)
class RemoveValue:
    """Remove a key with its value; an absent key is ignored."""

    location: Location
    """such as `("ball", 2, "velocity")` or `("world",)`"""


@dataclass(frozen=True)
class AddElement:
    """Append an element to a list of tables."""

    table: str
    """heading of the list, such as `ball`"""
    values: Mapping[str, Any]


@dataclass(frozen=True)
class RemoveElement:
    """Remove an element of a list of tables."""

    table: str
    index: int
    """index in the list before any of the changes"""


Change = SetValue | RemoveValue | AddElement | RemoveElement

_REMOVED = object()
"""Placeholder of a removed element; it keeps the indices of the following ones."""


def with_changes(text: str, changes: Sequence[Change]) -> str:
    """Return a TOML text with changes; indices refer to the text before any of them.

    Args:
        text: a valid TOML text without byte order mark, with either kind of line endings.
        changes: later ones take precedence over earlier ones at the same location.

    Raises:
        TextEditError: the text is not TOML, a change refers to an element or table that does not exist or to a value
            that TOML cannot hold, or its layout cannot be changed automatically.
    """
    before = _loaded(text)
    altered = _altered(before, changes)
    wanted = _completed(altered, changes)
    had_newline = text.endswith("\n") or not text
    ending = "\r\n" if "\r\n" in text else "\n"
    editor = _TextEditor(text if had_newline else text + ending, before, altered)
    result = editor.result([change for change in changes if isinstance(change, AddElement)])
    if not had_newline:
        result = result.removesuffix("\n").removesuffix("\r")
    if _without_empty(_without_emptied(_loaded(result), altered)) != _without_empty(wanted):
        raise TextEditError("the layout of the file cannot be changed automatically; edit it by hand")
    return result


def with_swapped_elements(text: str, table: str, one: int, other: int) -> str:
    """Return a TOML text in which two elements of a list have changed places, with the comments attached to them.

    Raises:
        TextEditError: the text cannot be changed in place.
    """
    index, document = TomlIndex(text), tomllib.loads(text)
    spans = []
    for number in sorted((one, other)):
        entry, blocks = index.find((table, number)), index.blocks_in.get((table, number), [])
        if entry is not None:
            spans.append(entry.value)
        elif blocks and all(block.stop == after.first for block, after in pairwise(blocks)):
            spans.append((index.attached(blocks[0].first), index.content_end(blocks[-1])))
        else:
            raise TextEditError(f"{table}: the elements are not in one piece each; move them in a text editor")
    (a, b), (c, d) = spans
    first, second = text[a:b], text[c:d]
    ending = "\r\n" if first.endswith("\r\n") else "\n"
    if not second.endswith("\n") and first.endswith("\n"):  # the last line of the file
        first, second = first.removesuffix(ending), second + ending
    below, end = text[b:c], text[d:]
    if _ends_with_comment(second) and not BLANK_LINE.match(below):  # else the comment would go to the next element
        below = ending + below
    if _ends_with_comment(first) and end and not BLANK_LINE.match(end):
        end = ending + end
    result = text[:a] + second + below + first + end
    elements = document[table]
    elements[one], elements[other] = elements[other], elements[one]
    if tomllib.loads(result) != document:
        raise TextEditError(f"{table}: the elements cannot be exchanged; move them in a text editor")
    return result


def _ends_with_comment(text: str) -> bool:
    """Return whether the last line of a statement or block is a comment."""
    return COMMENT_LINE.match(text, text.rfind("\n", 0, -1) + 1) is not None


def _completed(altered: dict[str, Any], changes: Sequence[Change]) -> dict[str, Any]:
    """Return an altered document without its removed elements and with the added ones."""
    result = {key: _kept(value) for key, value in altered.items()}
    result = {key: value for key, value in result.items() if value != [] or altered[key] == []}
    for change in changes:
        if isinstance(change, AddElement):
            elements = result.setdefault(change.table, [])
            if not isinstance(elements, list) or not all(isinstance(each, dict) for each in elements):
                raise TextEditError(f"{change.table}: is not a list of tables")
            elements.append(_plain(change.values, (change.table,)))
    return result


def _loaded(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise TextEditError(f"not TOML: {error}") from None


def _without_empty(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if value not in ([], {})}


def _without_emptied(document: dict[str, Any], altered: dict[str, Any]) -> dict[str, Any]:
    """Return a document without the empty lists in its tables whose elements were all removed."""
    result = {}
    for key, value in document.items():
        before = altered.get(key)
        if value == [] and isinstance(before, list) and _REMOVED in before:
            continue
        if isinstance(value, dict) and isinstance(before, dict):
            value = _without_emptied(value, before)
        elif isinstance(value, list) and isinstance(before, list):
            rest = [each for each in before if each is not _REMOVED]
            are_tables = len(rest) == len(value) and all(isinstance(each, dict) for each in (*rest, *value))
            value = [_without_emptied(*each) for each in zip(value, rest, strict=True)] if are_tables else value
        result[key] = value
    return result


def _kept(value: Any) -> Any:
    """Return a value without the removed elements of its lists, and tables without the lists that became empty."""
    if isinstance(value, dict):
        return {key: _kept(inner) for key, inner in value.items() if not _is_emptied(inner)}
    return [_kept(inner) for inner in value if inner is not _REMOVED] if isinstance(value, list) else value


def _is_emptied(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(each is _REMOVED for each in value)


def _plain(value: Any, location: Location) -> Any:
    """Return a copy made of plain dicts, lists, numbers and strings; arrays of numbers become lists.

    Raises:
        TextEditError: TOML has no such value, or a number is not finite.
    """
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, (*location, str(key))) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner, (*location, index)) for index, inner in enumerate(value)]
    if isinstance(value, float) and not math.isfinite(value):
        raise TextEditError(f"{path_of(location, {})}: must be a finite number, not {value}")
    for kind in (bool, int, float, str):
        if isinstance(value, kind):
            return kind(value)
    if isinstance(value, datetime.date | datetime.time):
        return value
    raise TextEditError(f"{path_of(location, {})}: a value of type {type(value).__name__} cannot be written as TOML")


def _copy(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copy(inner) for key, inner in value.items()}
    return [_copy(inner) for inner in value] if isinstance(value, list) else value


def _altered(document: dict[str, Any], changes: Sequence[Change]) -> dict[str, Any]:
    """Return a copy with values set and removed; no element is added, removed ones are placeholders."""
    result: dict[str, Any] = _copy(document)
    for change in changes:
        if isinstance(change, SetValue):
            _put(result, change.location, _plain(change.value, change.location))
        elif isinstance(change, RemoveValue):
            _take(result, change.location)
        elif isinstance(change, RemoveElement):
            elements = result.get(change.table)
            if not isinstance(elements, list) or not 0 <= change.index < len(elements):
                raise TextEditError(f"{path_of((change.table, change.index), {})}: does not exist")
            elements[change.index] = _REMOVED
    return result


def _put(document: dict[str, Any], location: Location, value: Any) -> None:
    """Set a value of a document; missing tables around it are created."""
    if not location:
        raise TextEditError("a location must have at least one key")
    holder: Any = document
    for key in location[:-1]:
        if isinstance(holder, dict) and isinstance(key, str):
            holder = holder.setdefault(key, {})
        else:
            holder = holder[key] if _has(holder, key) else _REMOVED
    if not (isinstance(holder, dict) and isinstance(location[-1], str)) and not _has(holder, location[-1]):
        raise TextEditError(f"{path_of(location, document)}: does not exist")
    holder[location[-1]] = value


def _take(document: dict[str, Any], location: Location) -> None:
    """Remove a value of a document; an absent one is ignored."""
    holder: Any = document
    for key in location[:-1]:
        if not _has(holder, key):
            return
        holder = holder[key]
    if not location or not _has(holder, location[-1]):
        return
    if isinstance(location[-1], int):
        holder[location[-1]] = _REMOVED
    else:
        del holder[location[-1]]


def _has(holder: Any, key: str | int) -> bool:
    if isinstance(holder, list) and isinstance(key, int):
        return 0 <= key < len(holder) and holder[key] is not _REMOVED
    return isinstance(holder, dict) and key in holder


def _toml(value: Any) -> str:
    """Return a plain value in TOML on one line, numbers in their shortest form."""
    if isinstance(value, dict):
        return f"{{ {', '.join(_assignment(*item) for item in value.items())} }}" if value else "{}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, str):
        return _quoted(value)
    return str(value) if type(value) is int else written(value)


def written(value: Any) -> str:
    """Return a setting in TOML, numbers in their shortest form: 0.001, 1e-6, 4."""
    value = value.item() if hasattr(value, "item") else value  # a number of numpy
    if isinstance(value, float):
        if not math.isfinite(value):
            return repr(value)
        return re.sub(r"e([+-]?)0*(\d)", lambda e: f"e{e[1].strip('+')}{e[2]}", repr(value))
    import tomlkit  # imported only if something is rewritten

    return str(tomlkit.item(value).as_string())


def _assignment(key: str, value: Any) -> str:
    return f"{_key(key)} = {_toml(value)}"


def _quoted(text: str) -> str:
    """Return a basic string; the escapes of JSON are valid in TOML, which requires one more."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _quoted(key)


_REST_OF_LINE = re.compile(r"[ \t]*(,?)[ \t]*(?:#[^\n]*|\r?)\n")


class _TextEditor:
    """Edits that turn the text of one document into that of another one."""

    def __init__(self, text: str, before: dict[str, Any], after: dict[str, Any]) -> None:
        self._text, self._before, self._after = text, before, after
        self._index = TomlIndex(text)
        self._edits: list[tuple[int, int, str]] = []
        self._cut: dict[Location, set[int]] = {}  # starts of removed entries of inline containers
        self._fresh: dict[Location, list[str]] = {}  # new entries of inline containers
        self._pieces: dict[int, list[str]] = {}  # new groups of lines, by position
        self._separated: set[int] = set()  # positions with a blank line below the new lines

    def result(self, added: Sequence[AddElement]) -> str:
        """Return the text of the other document with elements added."""
        self._compare((), self._before, self._after)
        for element in added:
            self._add_element(element.table, _plain(element.values, (element.table,)))
        for location in self._cut.keys() | self._fresh.keys():
            self._edit_container(location)
        for position, pieces in self._pieces.items():
            self._edits.append((position, position, self._group(position, pieces)))
        return self._edited()

    def _compare(self, location: Location, old: Any, new: Any) -> None:
        if isinstance(old, dict) and isinstance(new, dict):
            for key, value in old.items():
                if key in new:
                    self._compare((*location, key), value, new[key])
                else:
                    self._remove((*location, key), is_last=not new)
            items = {key: value for key, value in new.items() if key not in old}
            if items:
                self._insert(location, items)
        elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
            for index, (value, other) in enumerate(zip(old, new, strict=True)):
                if other is _REMOVED:
                    self._remove((*location, index), is_last=False)
                else:
                    self._compare((*location, index), value, other)
        elif old != new or type(old) is not type(new):
            self._replace(location, new)

    def _replace(self, location: Location, value: Any) -> None:
        entry = self._index.find(location)
        if entry is None:
            raise TextEditError(
                f"{path_of(location, self._before)}: is made of several lines, which cannot be replaced"
            )
        self._edits.append((*entry.value, _toml(_kept(value))))

    def _remove(self, location: Location, is_last: bool) -> None:
        """Remove a value, element or table; a table made of dotted keys that becomes empty remains as `{}`."""
        parent, entry = location[:-1], self._index.find(location)
        siblings = self._index.dotted.get(parent, []) if is_last and len(parent) > 1 else []
        for each in [entry] if entry else self._index.dotted.get(location, []):
            if siblings and each is siblings[0]:
                table = self._dotted_prefix(each, parent).rstrip().removesuffix(".").rstrip()
                self._edits.append((each.head[0], each.value[1], f"{table} = {{}}"))
            elif each.holder is None:
                self._edits.append((*each.lines, ""))
            else:
                self._cut.setdefault(each.holder, set()).add(each.head[0])
        for block in self._index.blocks_in.get(location, []):
            self._edits.append((*self._index.region(block), ""))

    def _insert(self, parent: Location, items: dict[str, Any]) -> None:
        """Insert new keys into a table, in the form in which it is written."""
        index = self._index
        index.find((*parent, ""))  # parses the inline values around it
        lines = [_assignment(*item) for item in items.items()]
        if parent in index.containers:
            self._fresh.setdefault(parent, []).extend(lines)
        elif not parent:
            self._insert_at_root(items)
        elif parent in index.blocks:
            self._insert_lines(index.statements[index.blocks[parent].stop - 1], lines)
        elif parent in index.dotted:
            self._insert_dotted(parent, lines)
        else:
            position = index.gap(index.blocks_in[parent][0].first)
            heading = ".".join(_key(key) for key in parent if isinstance(key, str))
            self._insert_group(position, [f"[{heading}]", *lines])

    def _insert_at_root(self, items: dict[str, Any]) -> None:
        index, stop = self._index, self._index.blocks[()].stop
        lines = [_assignment(*item) for item in items.items() if not isinstance(item[1], dict)]
        if lines and stop:
            self._insert_lines(index.statements[stop - 1], lines)
        elif lines:
            self._insert_group(index.gap(0) if index.statements else index.end(), lines)
        tables = {key: value for key, value in items.items() if isinstance(value, dict)}
        lists = (k for k, each in enumerate(index.statements) if each.heading and self._text[each.head[0] + 1] == "[")
        first = next(lists, None) if tables else None
        for key, value in tables.items():
            position = index.end() if first is None else index.gap(first)
            self._insert_group(position, [f"[{_key(key)}]", *(_assignment(*item) for item in value.items())])

    def _insert_dotted(self, table: Location, assignments: list[str]) -> None:
        last = self._index.dotted[table][-1]
        lines = [self._dotted_prefix(last, table) + each for each in assignments]
        if last.holder is not None:
            self._fresh.setdefault(last.holder, []).extend(lines)
        else:
            self._insert_lines(Statement((), False, last.lines[0], last.head, last.value, last.lines[1]), lines)

    def _dotted_prefix(self, entry: TextEntry, table: Location) -> str:
        """Return the part of a dotted key up to the dot behind the name of a table."""
        head = self._text[slice(*entry.head)]
        dots = [m.end() for m in re.finditer(r'"(?:\\.|[^"\\])*"|\'[^\']*\'|\.', head) if m[0] == "."]
        return head[: dots[len(table) - (len(entry.location) - entry.parts) - 1]]

    def _insert_lines(self, above: Statement, lines: list[str]) -> None:
        indent, ending = self._text[above.begin : above.head[0]], self._ending(above.end)
        self._edits.append((above.end, above.end, "".join(f"{indent}{line}{ending}" for line in lines)))

    def _insert_group(self, position: int, lines: list[str], *, is_separated: bool = True) -> None:
        ending = self._ending(position)
        self._pieces.setdefault(position, []).append("".join(line + ending for line in lines))
        if is_separated:
            self._separated.add(position)

    def _group(self, position: int, pieces: list[str]) -> str:
        """Return new groups of lines, with blank lines between them and around them."""
        ending = self._ending(position)
        above = ending if position else ""
        is_blank_below = position == len(self._text) or BLANK_LINE.match(self._text, position)
        below = "" if is_blank_below or position not in self._separated else ending
        return above + ending.join(pieces) + below

    def _ending(self, position: int) -> str:
        """Return the line ending above a position; at the start, that of the text."""
        text = self._text[max(position - 2, 0) : position] or self._text
        return "\r\n" if "\r\n" in text else "\n"

    def _add_element(self, table: str, values: dict[str, Any]) -> None:
        index, old, new = self._index, self._before.get(table), self._after.get(table)
        lines = [f"[[{_key(table)}]]", *(_assignment(*item) for item in values.items())]
        if old is None and new is None:
            self._insert_group(index.end(), lines, is_separated=False)
        elif (table,) in index.blocks_in:
            position = index.content_end(index.blocks_in[(table,)][-1])
            self._insert_group(position, lines, is_separated=False)
        elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new) and index.container((table,)):
            self._fresh.setdefault((table,), []).append(_toml(values))
        else:
            raise TextEditError(f"{table}: cannot be set and get a new element at once")

    def _edit_container(self, location: Location) -> None:
        """Edit an inline array or table whose entries are removed or which gets new ones."""
        container, fresh = self._index.containers[location], self._fresh.get(location, [])
        cut = self._cut.get(location, set())
        entries, commas = container.entries, container.commas
        kept = [k for k, each in enumerate(entries) if each.head[0] not in cut]
        if not kept and not container.has_comments:
            space = " " if fresh and self._text[container.begin] == "{" else ""
            new = space + ", ".join(fresh) + space
            self._edits.append((container.begin + 1, container.end - 1, new))
            return
        last = kept[-1] if kept else -1
        for k, entry in enumerate(entries):
            if entry.head[0] in cut:
                self._edits.append((*self._cut_range(container, k, is_tail=k > last), ""))
        is_tail_cut, has_last_comma = last < len(entries) - 1, bool(entries) and len(commas) == len(entries)
        own = self._own_lines(container, len(entries) - 1) if entries else None
        if fresh and own:
            self._insert_own_lines(container, last, own, fresh)
            return
        if kept and is_tail_cut and not has_last_comma:
            self._edits.append((self._before_blanks(commas[last]), commas[last] + 1, ""))
        if fresh and not kept:
            self._edits.append((container.end - 1, container.end - 1, ", ".join(fresh)))
        elif fresh:
            position = commas[last] + 1 if has_last_comma else entries[last].value[1]
            new = "".join(f" {each}," if has_last_comma else f", {each}" for each in fresh)
            self._edits.append((position, position, new))

    def _cut_range(self, container: InlineContainer, k: int, is_tail: bool) -> tuple[int, int]:
        """Return the range to delete for an entry: its lines, or the entry with its comma and the blanks on one side.

        `is_tail`: no entry behind it remains.
        """
        entry, commas = container.entries[k], container.commas
        own = self._own_lines(container, k)
        if own:
            return own
        if is_tail:
            return self._before_blanks(entry.head[0]), commas[k] + 1 if k < len(commas) else entry.value[1]
        blank = re.compile(r"[ \t]*").match(self._text, commas[k] + 1)
        return entry.head[0], blank.end() if blank else commas[k] + 1

    def _own_lines(self, container: InlineContainer, k: int) -> tuple[int, int] | None:
        """Return the range of the lines of an entry if nothing else but its comma and a comment is on them."""
        entry = container.entries[k]
        begin = self._before_blanks(entry.head[0])
        rest = _REST_OF_LINE.match(self._text, entry.value[1])
        if rest is None or self._text[begin - 1] != "\n" or bool(rest[1]) != (k < len(container.commas)):
            return None
        return begin, rest.end()

    def _insert_own_lines(self, container: InlineContainer, last: int, own: tuple[int, int], fresh: list[str]) -> None:
        """Insert new entries with a line each below the lines of the last entry; `last` is the last that remains."""
        entries = container.entries
        has_last_comma = len(container.commas) == len(entries)
        if not has_last_comma and last == len(entries) - 1:
            self._edits.append((entries[last].value[1], entries[last].value[1], ","))
        indent, ending = self._text[own[0] : entries[-1].head[0]], self._ending(own[1])
        lines = f",{ending}".join(indent + each for each in fresh) + ("," if has_last_comma else "") + ending
        self._edits.append((own[1], own[1], lines))

    def _before_blanks(self, position: int) -> int:
        while position and self._text[position - 1] in " \t":
            position -= 1
        return position

    def _edited(self) -> str:
        """Return the text with the edits; insertions at the same position keep their order."""
        pieces, position = [], 0
        for begin, end, new in sorted(self._edits, key=lambda edit: edit[:2]):
            if begin < position:
                raise TextEditError("two changes concern the same characters; make them one after the other")
            pieces += [self._text[position:begin], new]
            position = end
        result = "".join(pieces) + self._text[position:]
        while (blank := BLANK_LINE.match(result)) and not BLANK_LINE.match(self._text):
            result = result[blank.end() :]
        return result
