"""Index of a TOML text: where its statements, headings and values are, by their locations in the document.

Positions are offsets in characters. Inline arrays and tables are read when something in them is looked for.
"""

import re
import tomllib
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

from sandbox.scene.errors import TOKEN, Location, enter

COMMENT_LINE = re.compile(r"[ \t]*#[^\n]*\n")
BLANK_LINE = re.compile(r"[ \t]*\r?\n")


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


class TextEntry(NamedTuple):
    """A key with its value, or an element of an inline array; positions are offsets in characters."""

    location: Location
    parts: int
    """number of parts of its key; 0 for an element of an array"""
    head: tuple[int, int]
    """start and end of its key; for an element of an array, its start twice"""
    value: tuple[int, int]
    lines: tuple[int, int]
    """start of its first line and end of its last, if it is a statement"""
    holder: Location | None
    """location of the inline table or array around it; None for a statement"""


class InlineContainer(NamedTuple):
    """An array or inline table in a text; positions are offsets in characters."""

    begin: int
    end: int
    entries: list[TextEntry]
    commas: list[int]
    has_comments: bool


class TextBlock(NamedTuple):
    """A heading with the statements directly below it, as range of indices of statements."""

    first: int
    """index of the heading; −1 for the statements above the first heading"""
    stop: int


class TomlIndex:
    """Positions of the statements, blocks and values of a valid TOML text; inline values are parsed when needed."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.statements: list[Statement] = list(statements(text))
        self.entries: dict[Location, TextEntry] = {}
        self.dotted: dict[Location, list[TextEntry]] = {}  # entries whose dotted keys create a table
        self.blocks: dict[Location, TextBlock] = {}  # of the heading of a table itself
        self.blocks_in: dict[Location, list[TextBlock]] = {}  # of a table and of the tables in it
        self.containers: dict[Location, InlineContainer] = {}
        headings = [k for k, each in enumerate(self.statements) if each.heading]
        counts: dict[Location, int] = {}
        for first, stop in pairwise((-1, *headings, len(self.statements))):
            table: Location = ()
            if first >= 0:
                heading = self.statements[first]
                table = enter((heading.keys, text.startswith("[[", heading.head[0])), counts)
            block = self.blocks[table] = TextBlock(first, stop)
            for length in range(1, len(table) + 1):
                self.blocks_in.setdefault(table[:length], []).append(block)
            for each in self.statements[first + 1 : stop]:
                lines = each.begin, each.end
                self._add(TextEntry((*table, *each.keys), len(each.keys), each.head, each.value, lines, None))

    def _add(self, entry: TextEntry) -> None:
        self.entries[entry.location] = entry
        for length in range(len(entry.location) - entry.parts + 1, len(entry.location)):
            self.dotted.setdefault(entry.location[:length], []).append(entry)

    def find(self, location: Location) -> TextEntry | None:
        """Return the entry of a location; None for a table made by headings or dotted keys."""
        for length in range(1, len(location)):
            self.container(location[:length])
        return self.entries.get(location)

    def container(self, location: Location) -> InlineContainer | None:
        """Return the inline array or table at a location, if there is one."""
        entry = self.entries.get(location)
        if entry and location not in self.containers and self.text[entry.value[0]] in "[{":
            tokens = TOKEN.finditer(self.text, *entry.value)
            self._read(next(tokens), tokens, location)
        return self.containers.get(location)

    def _read(self, opening: re.Match[str], tokens: Iterator[re.Match[str]], location: Location) -> int:
        """Store an inline array or table and what is in it, and return its end."""
        is_table, has_comments, commas = opening[0] == "{", False, list[int]()
        entries: list[TextEntry] = []
        head, key_end, begin, end, here = -1, -1, -1, -1, location
        for token in tokens:
            sign = token[0]
            if sign == "\n" or sign[0] == "#":
                has_comments |= sign != "\n"
            elif sign in (",", "]", "}"):
                if head >= 0:
                    heads = (head, key_end) if is_table else (head, head)
                    parts = len(here) - len(location) if is_table else 0
                    entries.append(TextEntry(here, parts, heads, (begin, end), (head, end), location))
                    self._add(entries[-1])
                head = key_end = begin = -1
                if sign != ",":
                    end = token.end()
                    break
                commas.append(token.start())
            elif sign == "=" and is_table and key_end < 0:
                key = self.text[head : token.start()].rstrip()
                key_end, here = head + len(key), (*location, *keys_of(f"{key}=0"))
            else:
                head = token.start() if head < 0 else head
                if begin < 0 and (key_end >= 0 or not is_table):
                    begin = token.start()
                    here = here if is_table else (*location, len(entries))
                end = self._read(token, tokens, here) if sign in ("[", "{") else token.end()
        self.containers[location] = InlineContainer(opening.start(), end, entries, commas, has_comments)
        return end

    def region(self, block: TextBlock) -> tuple[int, int]:
        """Return the range of a block with the blank lines and attached comments above it and comments below it."""
        return self.gap(block.first), self.content_end(block)

    def gap(self, heading: int) -> int:
        """Return the start of the blank lines above a heading and the comments attached to it."""
        return self._above(heading, self.attached(heading), BLANK_LINE)

    def content_end(self, block: TextBlock) -> int:
        """Return the end of the last statement of a block and of the comment lines directly below it."""
        position = self.statements[block.stop - 1].end
        limit = self.attached(block.stop) if block.stop < len(self.statements) else len(self.text)
        while line := COMMENT_LINE.match(self.text, position, limit):
            position = line.end()
        return position

    def attached(self, heading: int) -> int:
        """Return the start of the comment lines directly above a heading; `#:schema` belongs to the file."""
        begin = self.statements[heading].begin
        position = self._above(heading, begin, COMMENT_LINE)
        return begin if position == 0 and self.text.startswith("#:schema") else position

    def _above(self, heading: int, position: int, pattern: re.Pattern[str]) -> int:
        """Return the start of the matching lines directly above a position, as far as the statement above."""
        floor = self.statements[heading - 1].end if heading else 0
        while position > floor:
            line = max(self.text.rfind("\n", floor, position - 1) + 1, floor)
            if not pattern.match(self.text, line, position):
                break
            position = line
        return position

    def end(self) -> int:
        """Return the end of the last line that is not blank."""
        content = len(self.text.rstrip())
        return self.text.find("\n", content) + 1 if content else 0
