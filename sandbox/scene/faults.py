"""Faults: everything that is wrong with a scene, each with file, line, path and what would be right."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
        return f"{place}: {self.path}: {self.message}" if self.path else f"{place}: {self.message}"


class SceneError(Exception):
    """A scene cannot be used. `faults` holds every reason; `str()` is one line a fault."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("\n".join(map(str, faults)))
        self.faults = tuple(faults)


def path_of(location: Location, document: Any) -> str:
    """Write a location as a person would: `ball.cue.velocity[1]`, elements by name where they have one."""
    parts: list[str] = []
    here = document
    for key in location:
        here = _child(here, key)
        if isinstance(key, str):
            parts.append(f".{key}" if parts else key)
            continue
        name = here.get("name") if isinstance(here, dict) else None
        parts.append(f".{name}" if isinstance(name, str) and name.isprintable() and name else f"[{key}]")
    return "".join(parts)


def _child(value: Any, key: Key) -> Any:
    try:
        return value[key]
    except (KeyError, IndexError, TypeError):
        return None


class Lines:
    """Finds the line on which a location of a TOML text begins.

    A text cut off after n lines, with up to `CLOSERS` missing brackets added, parses to what the first n lines
    say; so the line sought is the first n at which the location exists, found by bisection. This needs no
    parser of our own and understands every way to write a key.
    """

    CLOSERS = 4
    MAX_TEXT = 4_000_000  # characters; beyond, a fault goes without its line rather than wait for minutes

    def __init__(self, text: str) -> None:
        self._lines = text.splitlines(keepends=True) if len(text) <= self.MAX_TEXT else []
        self._parsed: dict[int, Any] = {}

    def find(self, location: Location) -> int | None:
        """Return the line (from 1) of a location, or of the nearest table around it that exists."""
        while location:
            low, high = 0, len(self._lines)
            if self._holds(high, location):
                while high - low > 1:
                    middle = (low + high) // 2
                    low, high = (low, middle) if self._holds(middle, location) else (middle, high)
                return high
            location = location[:-1]
        return None

    def _holds(self, count: int, location: Location) -> bool:
        """Tell whether the location exists in the first `count` lines.

        Inside a string of several lines nothing parses; what was complete before it decides.
        """
        here = None
        while count > 0 and (here := self._parse(count)) is None:
            count -= 1
        for key in location:
            here = _child(here, key)
            if here is None:
                return False
        return True

    def _parse(self, count: int) -> Any:
        if count not in self._parsed:
            text = "".join(self._lines[:count])
            self._parsed[count] = None
            for closers in range(self.CLOSERS + 1):
                try:
                    self._parsed[count] = tomllib.loads(text + "]" * closers)
                    break
                except (tomllib.TOMLDecodeError, RecursionError):
                    continue
        return self._parsed[count]
