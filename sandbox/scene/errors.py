"""Faults: errors in a scene, each with file, line, path and a message that states the valid values."""

import difflib
import json
import re
import tomllib
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Self

from sandbox.echo import MAX_MESSAGE, MAX_NAMED, printable, shorten

PathKey = str | int
Location = tuple[PathKey, ...]
"""Position in a document: keys of tables and indices of arrays, as in `("ball", 0, "velocity", 1)`."""

LocatedMessage = tuple[Location, str]
"""Location of a fault, and its description."""


@dataclass(frozen=True)
class Fault:
    """One error in a scene file. `str()` is `file:line: path: message`."""

    file: str
    """name of the file"""
    line: int | None
    """line in the file, from 1; None if unknown"""
    path: str
    """path of the key, such as `ball.cue.velocity[1]`; empty if the fault concerns the whole file"""
    message: str
    """description of the error and of the valid values"""
    key: str = field(default="", repr=False, compare=False)
    """key of the override at fault, as it was given; empty for other faults"""

    @classmethod
    def of(cls, source: str, message: str) -> Self:
        """Return the fault of a whole file, or of an option of the command line such as `--dt`."""
        return cls(source, None, "", message)

    def __str__(self) -> str:
        file, path = shorten(self.file, MAX_NAMED), shorten(self.path, MAX_NAMED)
        position = file if self.line is None else f"{file}:{self.line}"
        text = f"{position}: {path}: " if path else f"{position}: "
        return printable(text + shorten(self.message, MAX_MESSAGE))


class SceneError(Exception):
    """A scene is invalid. `str()` has one line for each fault.

    Attributes:
        faults: every `Fault` that was found.
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("\n".join(map(str, faults)))
        self.faults = tuple(faults)

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[Fault, ...]]]:
        """Keep the faults when the error is pickled for another process."""
        return type(self), (self.faults,)


class PartError(SceneError, ValueError):
    """A table of a scene, an action or a stroke has invalid values in Python. Each fault has its path, as `radius`."""


class SettingsError(PartError):
    """A setting is unknown or has an invalid value. Each fault has its path, such as `solver.dt`."""


EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "tuple_type": "an array, such as [0.0, 1.0]",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "too_short": "an array of {min_length} or more",
    "too_long": "an array of {max_length} at most",
    "string_too_short": "text of {min_length} or more characters",
    "string_too_long": "text of {max_length} characters at most",
    "literal_error": "one of {expected}",
}
"""What a value must be, by the type of pydantic's error"""


EXPECTED_IN_PYTHON = {"tuple_type": "a list or a tuple", "string_type": "a text", "bool_type": "True or False"}
"""What an argument must be, where it is not written as in a file"""
SMALLEST_STATED = 1e-5
"""Smaller positive bounds only protect the engines; the message for a value that is not positive leaves them out."""
_BOUNDS = {"gt": "more than", "ge": "at least", "lt": "less than", "le": "at most"}
"""Violated bounds of a number in words"""


def explain_arguments(details: Iterable[Any], known: Collection[str]) -> list[LocatedMessage]:
    """Return location and message of each error of pydantic about the arguments of a class in Python.

    Args:
        details: errors of pydantic. A default that was not computed because of another error is no fault.
        known: names of the arguments.
    """
    return [(each["loc"], _explain(each, known)) for each in details if each["type"] != "default_factory_not_called"]


def _explain(details: Any, known: Collection[str]) -> str:
    kind, context = details["type"], details.get("ctx", {})
    if kind == "missing":
        return "is missing; it is required"
    if kind == "extra_forbidden":
        name, names = str(details["loc"][-1]), known if len(details["loc"]) == 1 else ()
        close = difflib.get_close_matches(name.lower(), names, n=1)
        if close:
            return f"unknown key; did you mean {close[0]!r}?"
        return f"unknown key; known: {', '.join(names)}" if names else "unknown key"
    if kind == "value_error":
        return str(context["error"])
    if kind in ("model_type", "model_attributes_type"):
        expected = f"of the class {context['class_name']}" if context else "of a class of this kind"
    elif kind in ("union_tag_invalid", "union_tag_not_found"):
        expected = f"one of the kinds {context.get('expected_tags', 'of this table')}"
    elif kind == "string_pattern_mismatch":
        expected = f"text that matches {context['pattern']}"
    elif kind in EXPECTED_IN_PYTHON:
        expected = EXPECTED_IN_PYTHON[kind]
    elif kind in EXPECTED:
        expected = EXPECTED[kind].format(**context)
    else:
        expected = details["msg"].removeprefix("Input should be ")
    expected = next((f"{words} {context[key]:g}" for key, words in _BOUNDS.items() if key in context), expected)
    if 0.0 < context.get("ge", 0.0) < SMALLEST_STATED and details["input"] <= 0.0:
        expected = "more than 0"
    return f"must be {expected}, is {shown_input(details)}"


def shown(value: Any) -> str:
    """Return a value as a message shows it, in the notation of JSON."""
    if isinstance(value, float) and value.is_integer():
        return f"{value:.15g}"
    return shorten(json.dumps(value, ensure_ascii=False, default=str))


def shown_input(details: Any) -> str:
    """Return the value of an error of pydantic as a message shows it; 3.0 in the place of a whole number is no 3."""
    value = details["input"]
    return str(float(value)) if details["type"] == "int_type" and isinstance(value, float) else shown(value)


def path_of(location: Location, document: Any) -> str:
    """Return the path of a location, such as `ball.cue.velocity[1]`; named elements appear by name."""
    parts: list[str] = []
    value = document
    for key in location:
        value = _child(value, key)
        if isinstance(key, str):
            key = key if key.isprintable() and key else json.dumps(key)
            parts.append(f".{key}" if parts else key)
            continue
        name = value.get("name") if isinstance(value, dict) else None
        parts.append(f".{quoted(name)}" if isinstance(name, str) and name.isprintable() and name else f"[{key}]")
    return "".join(parts)


def quoted(name: str) -> str:
    """Return a name as one part of a path, in quotes if it contains separators."""
    if not any(sign in name for sign in ".\"'[]="):
        return name
    return f'"{name}"' if '"' not in name else f"'{name}'"


def _child(value: Any, key: PathKey) -> Any:
    try:
        return value[key]
    except (KeyError, IndexError, TypeError):
        return None


class Lines:
    """Finder of the line at which a location of a TOML text begins: a key, a heading, or an element of an array.

    The text is known to be valid, so one linear pass over its tokens suffices. Keys and headings are parsed by tomllib.
    """

    MAX_TEXT = 16_000_000  # characters; beyond it faults have no line, which saves memory

    def __init__(self, text: str) -> None:
        self._text = text if len(text) <= self.MAX_TEXT else ""
        self._lines: dict[Location, int] | None = None

    def find(self, location: Location) -> int | None:
        """Return the line (from 1) of a location, or of the nearest table around it that exists."""
        if self._lines is None:
            self._lines = _lines_of(self._text)
        while location and location not in self._lines:
            location = location[:-1]
        return self._lines.get(location)


TOKEN = re.compile(
    r'''"""(?:\\.|[^\\])*?"{3,5}|'{3}.*?'{3,5}|"(?:\\.|[^"\\])*"|'[^']*'|#[^\n]*|[][{},=\n]|[^][{},=#"'\s]+''',
    re.DOTALL,
)
"""Strings of the four kinds, comments, punctuation, and runs of other characters."""


def _lines_of(text: str) -> dict[Location, int]:
    """Return the line of every location of a valid TOML text."""
    lines: dict[Location, int] = {}
    table: Location = ()  # of the present heading
    counts: dict[Location, int] = {}  # elements so far of each [[table]]
    open_containers: list[tuple[Location, int]] = []  # open arrays with their next index, inline tables with −1
    line, start, first_line, state = 1, 0, 1, "key"
    value_location: Location = ()  # of the present value

    for token in TOKEN.finditer(text + "\n"):
        sign = token[0]
        if sign == "\n" or sign[0] == "#":
            if state == "heading":
                table = enter(_parsed(text[start : token.start()].rstrip()), counts)
                _note(lines, table, first_line)
            if not open_containers:
                state = "key"
        elif state == "key" and sign != "}":
            start, first_line = token.start(), line
            state = "heading" if sign == "[" else "in key"
        elif state == "in key":
            if sign == "=":
                keys = _parsed(text[start : token.start()] + "=0")[0]
                value_location = (open_containers[-1][0] if open_containers else table) + keys
                _note(lines, value_location, first_line)
                state = "value"
        elif state == "value" and sign != "]":
            if open_containers and open_containers[-1][1] >= 0:
                array, index = open_containers.pop()
                open_containers.append((array, index + 1))
                value_location = (*array, index)
                lines[value_location] = line
            if sign in ("[", "{"):
                open_containers.append((value_location, 0 if sign == "[" else -1))
            state = {"[": "value", "{": "key"}.get(sign, "done")
        elif sign in ("]", "}") and state != "heading":
            open_containers.pop()
            state = "done"
        elif sign == "," and state == "done":
            state = "value" if open_containers[-1][1] >= 0 else "key"
        line += sign.count("\n")
    return lines


@lru_cache(maxsize=10_000)
def _parsed(text: str) -> tuple[tuple[str, ...], bool]:
    """Return the keys of `key = 0`, `[heading]` or `[[heading]]`, and whether it was the last form."""
    keys: list[str] = []
    value: Any = tomllib.loads(text)
    while isinstance(value, dict) and value:
        key, value = next(iter(value.items()))
        keys.append(key)
    return tuple(keys), isinstance(value, list)


def enter(heading: tuple[tuple[str, ...], bool], counts: dict[Location, int]) -> Location:
    """Return the location of the table that a heading opens."""
    keys, is_array = heading
    location: Location = ()
    for key in keys[:-1]:
        location += (key,)
        if location in counts:
            location += (counts[location] - 1,)
    location += (keys[-1],)
    if is_array:
        counts[location] = counts.get(location, 0) + 1
    return (*location, counts[location] - 1) if is_array else location


def _note(lines: dict[Location, int], location: Location, line: int) -> None:
    """Store the line of a location and of the tables around it that it creates."""
    for length in range(1, len(location) + 1):
        lines.setdefault(location[:length], line)
