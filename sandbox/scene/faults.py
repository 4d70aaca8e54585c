"""Faults: everything that is wrong with a scene, each with file, line, path and what would be right."""

import json
import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Self

Key = str | int
Location = tuple[Key, ...]
"""Where in a document: keys of tables and indices of arrays, as in `("ball", 0, "velocity", 1)`."""


@dataclass(frozen=True)
class Fault:
    """One thing that is wrong with a scene file."""

    file: str
    line: int | None
    path: str
    message: str

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        text = f"{place}: {self.path}: {self.message}" if self.path else f"{place}: {self.message}"
        return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


class SceneError(Exception):
    """A scene cannot be used. `faults` holds every reason; `str()` is one line a fault."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("\n".join(map(str, faults)))
        self.faults = tuple(faults)

    def __reduce__(self) -> tuple[type[Self], tuple[tuple[Fault, ...]]]:
        """Let it pass from one process to another, faults and all."""
        return type(self), (self.faults,)


def path_of(location: Location, document: Any) -> str:
    """Write a location as a person would: `ball.cue.velocity[1]`, elements by name where they have one."""
    parts: list[str] = []
    here = document
    for key in location:
        here = _child(here, key)
        if isinstance(key, str):
            key = key if key.isprintable() and key else json.dumps(key)
            parts.append(f".{key}" if parts else key)
            continue
        name = here.get("name") if isinstance(here, dict) else None
        parts.append(f".{quoted(name)}" if isinstance(name, str) and name.isprintable() and name else f"[{key}]")
    return "".join(parts)


def quoted(name: str) -> str:
    """Write a name as a part of a path, in quotes where it would be read as several parts."""
    if not any(sign in name for sign in ".\"'[]="):
        return name
    return f'"{name}"' if '"' not in name else f"'{name}'"


def _child(value: Any, key: Key) -> Any:
    try:
        return value[key]
    except (KeyError, IndexError, TypeError):
        return None


class Lines:
    """Finds the line on which a location of a TOML text begins: of a key, a table's heading, an array's element.

    The text is known to parse, so one pass over its tokens is enough to follow where it stands, in linear time.
    Keys and headings are still read by tomllib.
    """

    MAX_TEXT = 16_000_000  # characters; beyond, a fault goes without its line rather than fill the memory

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
"""Strings of the four kinds, comments, punctuation, and runs of anything else."""


def _lines_of(text: str) -> dict[Location, int]:
    """Return the line of every location of a valid TOML text."""
    lines: dict[Location, int] = {}
    table: Location = ()  # of the heading in force
    counts: dict[Location, int] = {}  # elements so far of each [[table]]
    within: list[tuple[Location, int]] = []  # open arrays with their next index, inline tables with −1
    line, start, begun, state = 1, 0, 1, "key"
    where: Location = ()  # of the value at hand

    for token in TOKEN.finditer(text + "\n"):
        sign = token[0]
        if sign == "\n" or sign[0] == "#":
            if state == "heading":
                table = _enter(_parsed(text[start : token.start()].rstrip()), counts)
                _note(lines, table, begun)
            if not within:
                state = "key"
        elif state == "key" and sign != "}":
            start, begun = token.start(), line
            state = "heading" if sign == "[" else "in key"
        elif state == "in key":
            if sign == "=":
                keys = _parsed(text[start : token.start()] + "=0")[0]
                where = (within[-1][0] if within else table) + keys
                _note(lines, where, begun)
                state = "value"
        elif state == "value" and sign != "]":
            if within and within[-1][1] >= 0:
                array, index = within.pop()
                within.append((array, index + 1))
                where = (*array, index)
                lines[where] = line
            if sign in ("[", "{"):
                within.append((where, 0 if sign == "[" else -1))
            state = {"[": "value", "{": "key"}.get(sign, "done")
        elif sign in ("]", "}") and state != "heading":
            within.pop()
            state = "done"
        elif sign == "," and state == "done":
            state = "value" if within[-1][1] >= 0 else "key"
        line += sign.count("\n")
    return lines


@lru_cache(maxsize=10_000)
def _parsed(text: str) -> tuple[tuple[str, ...], bool]:
    """Return the keys of `key = 0`, `[heading]` or `[[heading]]`, and whether it was the last."""
    keys: list[str] = []
    here: Any = tomllib.loads(text)
    while isinstance(here, dict) and here:
        key, here = next(iter(here.items()))
        keys.append(key)
    return tuple(keys), isinstance(here, list)


def _enter(heading: tuple[tuple[str, ...], bool], counts: dict[Location, int]) -> Location:
    """Return the location of the table that a heading opens."""
    keys, many = heading
    location: Location = ()
    for key in keys[:-1]:
        location += (key,)
        if location in counts:
            location += (counts[location] - 1,)
    location += (keys[-1],)
    if many:
        counts[location] = counts.get(location, 0) + 1
    return (*location, counts[location] - 1) if many else location


def _note(lines: dict[Location, int], location: Location, line: int) -> None:
    """Enter a location and the tables around it that come into being with it."""
    for length in range(1, len(location) + 1):
        lines.setdefault(location[:length], line)
