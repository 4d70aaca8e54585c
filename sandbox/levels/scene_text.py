"""Text of an imported scene: tables with comments that name their elements, and faults by element."""

import bisect
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from sandbox.echo import printable, shorten
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import Fault, SceneError, quoted
from sandbox.scene.files.load import loads

_WIDTH = 120
"""Columns of the text."""


class LevelElement(NamedTuple):
    """Element of a level, as messages name it."""

    path: str
    """such as `rect#crate`"""
    line: int | None
    """line in the file, from 1"""
    file: str = ""
    """file of the element, if it is not the level itself"""


class LevelBlock(NamedTuple):
    """One table of the scene, such as a `[[ball]]`."""

    table: str
    values: dict[str, Any]
    """with the key `name`"""
    element: LevelElement


def compose_scene(head: Sequence[str], blocks: Sequence[LevelBlock], file: str) -> tuple[Scene, str]:
    """Return the scene of some lines and the tables after them, and its text.

    Args:
        head: first lines of the text: comments, and tables without a name.
        blocks: tables, in the order of the text.
        file: name of the level in faults.

    Raises:
        SceneError: the scene is invalid; each fault names the element of its table.
    """
    lines = list(head)
    starts = []  # line of each heading, from 1
    for block in blocks:
        lines.append("")
        starts.append(len(lines) + 1)
        line = "" if block.element.line is None else f", line {block.element.line}"
        comment = f"  # {shorten(printable(block.element.path))}{line}" if block.element.path else ""
        lines.append(f"[[{block.table}]]{comment}")
        lines += table_lines(block.values)
    text = "\n".join(lines) + "\n"
    try:
        return loads(text, file), text
    except SceneError as error:
        raise SceneError([_located(fault, file, blocks, starts) for fault in error.faults]) from None


def _located(fault: Fault, file: str, blocks: Sequence[LevelBlock], starts: Sequence[int]) -> Fault:
    """Return a fault of the scene as a fault of the element of the level."""
    index = bisect.bisect_right(starts, fault.line or 0) - 1
    if index < 0:
        return replace(fault, line=None)
    block = blocks[index]
    rest = fault.path.removeprefix(f"{block.table}.{quoted(block.values['name'])}").lstrip(".")
    path = f"{block.element.path}.{rest}" if rest and block.element.path else block.element.path or fault.path
    return Fault(block.element.file or file, block.element.line, path, fault.message)


def table_lines(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table below its heading; the parts of a body are inline tables."""
    for key, value in values.items():
        text = f"{key} = {toml_text(value)}"
        if len(text) <= _WIDTH or not isinstance(value, list | tuple):
            yield text
            continue
        yield f"{key} = ["
        line = " "
        for each in value:
            item = f" {toml_text(each)},"
            if len(line) + len(item) > _WIDTH and line.strip():
                yield line
                line = " "
            line += item
        yield from (line, "]")


def toml_text(value: Any) -> str:
    """Return a value as TOML, in one line."""
    match value:
        case bool():
            return "true" if value else "false"
        case float() | int():
            return repr(value)
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case dict():
            return "{ " + ", ".join(f"{key} = {toml_text(each)}" for key, each in value.items()) + " }"
        case _:
            return "[" + ", ".join(map(toml_text, value)) + "]"


def clean_text(text: str) -> str:
    """Return a text in one line, without control characters."""
    return " ".join("".join(sign if sign.isprintable() else " " for sign in text).split())
