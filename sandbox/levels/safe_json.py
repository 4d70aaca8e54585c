"""JSON of untrusted files: a bounded document, whose values are checked as they are read. Faults name their paths."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from sandbox.echo import short_repr
from sandbox.levels.level_files import read_text, refuse
from sandbox.resource_limits import SESSION_SIZE
from sandbox.scene.errors import quoted
from sandbox.scene.files.document import NestingError, check_text

MAX_ENTRIES = 10_000
"""Entries of an object whose entries become parts of a scene."""


@dataclass(frozen=True)
class JsonNode:
    """A value of a JSON document. Each method raises `SceneError` if the value is not of the kind that it reads."""

    value: Any
    file: str
    """name of the file in faults"""
    path: str = ""
    """path of the value, such as `table.pockets.lb.center[0]`"""

    def refuse(self, message: str) -> NoReturn:
        """Raise a `SceneError` with the path of the value."""
        refuse(self.file, message, None, self.path)

    def find(self, key: str) -> "JsonNode | None":
        """Return a member of an object; None if it is missing or null."""
        if not isinstance(self.value, dict):
            self.refuse(f"must be an object, is {short_repr(self.value)}")
        value = self.value.get(key)
        return None if value is None else self._member(key, value)

    def __getitem__(self, key: str) -> "JsonNode":
        """Return a member of an object, which must not be missing."""
        node = self.find(key)
        if node is None:
            self._member(key, None).refuse("is missing")
        return node

    def _member(self, key: str, value: Any) -> "JsonNode":
        name = quoted(key)
        return JsonNode(value, self.file, f"{self.path}.{name}" if self.path else name)

    def members(self) -> Iterator[tuple[str, "JsonNode"]]:
        """Yield the keys, which must be printable, and values of an object with at most `MAX_ENTRIES` of them."""
        if not isinstance(self.value, dict):
            self.refuse(f"must be an object, is {short_repr(self.value)}")
        if len(self.value) > MAX_ENTRIES:
            self.refuse(f"has {len(self.value):,} entries; the limit is {MAX_ENTRIES:,}")
        for key, value in self.value.items():
            if not key.isprintable():  # also finds half of a surrogate pair, which no file can contain
                self.refuse(f"has the key {short_repr(key)}, which is not printable")
            yield key, self._member(key, value)

    def elements(self, count: int | None = None) -> list["JsonNode"]:
        """Return the elements of an array.

        Args:
            count: valid number of them; default: any.
        """
        if not isinstance(self.value, list) or count not in (None, len(self.value)):
            kind = "an array" if count is None else f"an array of {count}"
            self.refuse(f"must be {kind}, is {short_repr(self.value)}")
        return [JsonNode(value, self.file, f"{self.path}[{k}]") for k, value in enumerate(self.value)]

    def number(self, lowest: float, highest: float) -> float:
        """Return a finite number within limits."""
        value = self.value
        if isinstance(value, bool) or not isinstance(value, int | float) or not lowest <= value <= highest:
            self.refuse(f"must be a number from {lowest:g} to {highest:g}, is {short_repr(value)}")
        return float(value)

    def vector(self, limit: float) -> tuple[float, float, float]:
        """Return three numbers between −limit and limit."""
        x, y, z = (each.number(-limit, limit) for each in self.elements(3))
        return x, y, z

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            self.refuse(f"must be a string, is {short_repr(self.value)}")
        return self.value


def read_json(path: Path, file: str) -> JsonNode:
    """Return the document of a file.

    Args:
        path: path of the file.
        file: its name in faults.

    Raises:
        SceneError: the file cannot be read, is larger than `SESSION_SIZE`, or is no JSON.
    """
    return parse_json(read_text(path, file, SESSION_SIZE), file)


def parse_json(text: str, file: str) -> JsonNode:
    """Parse a document. Not-a-number and infinity, which Python writes, are values that no method accepts.

    Args:
        text: the document.
        file: its name in faults.

    Raises:
        SceneError: the text is no JSON, or its values are nested too deeply.
    """
    try:
        check_text(text)
        return JsonNode(json.loads(text), file)
    except NestingError as error:
        refuse(file, str(error), error.line)
    except json.JSONDecodeError as error:
        refuse(file, f"not well-formed JSON: {error.msg}, at column {error.colno}", error.lineno)
    except ValueError:
        refuse(file, "contains an integer of more than 4,300 digits")
