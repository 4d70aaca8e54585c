"""Statements: where in a TOML text its headings and its keys stand, to the character, so that one can be changed."""

import re
import tomllib
from collections.abc import Iterator
from typing import Any, NamedTuple

from sandbox.scene.faults import TOKEN


class Statement(NamedTuple):
    """A heading, or a key with its value, of a TOML text; the places count its characters."""

    keys: tuple[str, ...]
    """as the heading or the key says them, the heading in force left out"""
    heading: bool
    begin: int
    """of its first line"""
    head: tuple[int, int]
    """from where to where its key stands, or its heading"""
    value: tuple[int, int]
    """from where to where its value stands; of a heading, its end twice"""
    end: int
    """past its last line's end, comment and line break included"""


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
        return Statement(_keys(text[first:last]), True, begin, (first, last), (last, last), end)
    blank = re.compile(r"\s*").match(text, equals + 1)
    assert blank is not None  # it matches nothing, too
    head = first, first + len(text[first:equals].rstrip())
    return Statement(_keys(text[slice(*head)] + "=0"), False, begin, head, (blank.end(), last), end)


def _keys(text: str) -> tuple[str, ...]:
    keys: list[str] = []
    here: Any = tomllib.loads(text)
    while isinstance(here, dict) and here:
        key, here = next(iter(here.items()))
        keys.append(key)
    return tuple(keys)
