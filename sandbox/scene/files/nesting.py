"""Nesting depth of documents, checked before anything recursive reads them.

Parsers, validators and copies recurse a few frames per level, so a text of brackets alone could exhaust the stack or
the memory. Nothing here recurses; time and memory grow linearly with the size of the document.
"""

import re
from typing import Any

MAX_DEPTH = 32
"""Largest number of nested tables and arrays, including the document, and of parts of one key. A scene needs 8."""

_BARE, _QUOTED = r"[\w-]++", r'"(?:[^"\\\n]++|\\[^\n])*+"|' r"'[^'\n]*+'"
_LONG_KEY = rf"(?:(?:{_BARE}|{_QUOTED})[ \t]*+\.[ \t]*+){{{MAX_DEPTH}}}"
_TEXT = (
    r'"""(?:[^"\\]++|\\.|"(?!""))*+(?:"{3,5}|\Z)'
    r"|'''(?:[^']++|'(?!''))*+(?:'{3,5}|\Z)"
    rf"|{_QUOTED}|[\"'][^\n]*+"  # an unclosed string ends with its line
    r"|#[^\n]*+"
)
"""Strings and comments, in which brackets and dots do not count."""

_BRACKET = re.compile(rf"(?:[^\"'#\[\]{{}}]++|{_TEXT})*+(?:(?P<open>[\[{{])|(?P<close>[\]}}])|\Z)", re.DOTALL)
"""The next bracket, with everything before it."""
_SEEMS_LONG = re.compile(rf"(?:^|[\[{{,])[ \t]*+{_LONG_KEY}", re.MULTILINE)
"""Finds every key with too many parts quickly, and also text within strings that only looks like one."""
_KEY = re.compile(rf"(?P<key>(?<![\w-]){_LONG_KEY})|{_TEXT}", re.DOTALL)


class NestingError(ValueError):
    """Values are nested too deeply. `line` is the line in the text, or None."""

    def __init__(self, line: int | None = None) -> None:
        super().__init__(f"nested too deeply: more than {MAX_DEPTH} levels of tables and arrays")
        self.line = line


def check_text(text: str) -> None:
    """Refuse a TOML or JSON text whose brackets are nested, or whose keys have parts, beyond `MAX_DEPTH`.

    The text need not be valid. Keys, inline tables and headings together can still exceed the limit; `check_value`
    finds that in the parsed document.

    Raises:
        NestingError: with the line of the text.
    """
    depth = 0
    for token in _BRACKET.finditer(text):
        kind = token.lastgroup
        if kind == "open":
            depth += 1
            if depth >= MAX_DEPTH:
                raise NestingError(text.count("\n", 0, token.end()) + 1)
        elif kind == "close":
            depth -= 1
    if _SEEMS_LONG.search(text):
        for token in _KEY.finditer(text):
            if token.lastgroup == "key":
                raise NestingError(text.count("\n", 0, token.start()) + 1)


def check_value(value: Any) -> None:
    """Refuse nested dicts, lists and tuples deeper than `MAX_DEPTH`, such as one that contains itself.

    Raises:
        NestingError: they are too deep.
    """
    level = [value] if isinstance(value, dict | list | tuple) else []
    for _ in range(MAX_DEPTH):
        if not level:
            return
        inner = [
            each
            for container in level
            for each in (container.values() if isinstance(container, dict) else container)
            if isinstance(each, dict | list | tuple)
        ]
        level = list({id(each): each for each in inner}.values())  # each container once
    if level:
        raise NestingError
