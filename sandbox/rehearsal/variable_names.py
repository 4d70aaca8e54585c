"""Names that a program has for its bodies and its collision types, read from its variables."""

import re
from collections.abc import Iterator, Mapping
from enum import Enum
from types import FrameType
from typing import Any

import pymunk

from sandbox.rehearsal.game_clock import is_own_code

_TYPE_NAME = re.compile(r"coll|type|categor|layer", re.IGNORECASE)
_AFFIXES = re.compile(r"^(coll(ision)?_?types?|coll(ision)?|ct|types?)_|_?(coll(ision)?)?_?types?$", re.IGNORECASE)
_NO_NAMES = frozenset({"self", "body", "b", "space", "each"})


def type_name(value: Any, frame: FrameType) -> str | None:
    """Return the name of a collision type in a program; None if it has none.

    It is the name of a member of an enumeration, the key in a dictionary, or that of a constant, if the name of the
    dictionary or constant says so, or the only constant of this value. Examples: `collision_types = {"ball": 1}`,
    `COLLTYPE_BALL = 1`.

    Args:
        value: the collision type.
        frame: of the code that uses it.
    """
    if isinstance(value, Enum):
        return value.name.lower()
    for name, known in _variables(frame):
        if not _TYPE_NAME.search(name):
            continue
        if isinstance(known, Mapping):
            found = next((key for key, each in known.items() if isinstance(key, str) and _is_same(each, value)), None)
            if found is not None:
                return found.lower()
        elif isinstance(known, type) and not issubclass(known, Enum):
            found = next((key for key, each in vars(known).items() if _is_same(each, value)), None)
            if found is not None:
                return found.lower()
        elif _is_same(known, value):
            return _AFFIXES.sub("", name).lower() or name.lower()
    constants = {
        name
        for name, known in frame.f_globals.items()
        if name.isupper() and type(known) is type(value) and _is_same(known, value)
    }
    return constants.pop().lower() if len(constants) == 1 else None


def body_names(frame: FrameType) -> Iterator[tuple[pymunk.Body, str]]:
    """Yield bodies and the names of their variables, or of the attributes of variables: `player`, `car.chassis`.

    Args:
        frame: of the code that makes a step.
    """
    for name, value in _variables(frame):
        if len(name) == 1:
            continue
        if isinstance(value, pymunk.Body) and name not in _NO_NAMES:
            yield value, name
        elif isinstance(value, pymunk.Shape):
            if value.body is not None and value.body.body_type != pymunk.Body.STATIC and name not in _NO_NAMES:
                yield value.body, name
        elif isinstance(value, (list, tuple)) and len(value) <= MAX_LIST:
            for number, each in enumerate(value):
                if isinstance(each, pymunk.Body):
                    yield each, f"{name}[{number}]"
        else:
            for attribute, each in _attributes(value):
                if isinstance(each, pymunk.Body) and attribute not in _NO_NAMES:
                    yield each, attribute if name == "self" else f"{name}.{attribute}"
                elif isinstance(each, pymunk.Body):
                    yield each, name


MAX_LIST = 1000
"""Entries of a list whose bodies get names"""


def _attributes(value: Any) -> list[tuple[str, Any]]:
    """Return the attributes of an object of the program itself."""
    kind = type(value)
    if kind.__module__.partition(".")[0] in ("builtins", "pymunk", "pygame", "numpy") or isinstance(value, type):
        return []
    return list(getattr(value, "__dict__", {}).items())


def _variables(frame: FrameType) -> Iterator[tuple[str, Any]]:
    """Yield the variables of a program: those of the calling functions, from the innermost on, and of the module."""
    each: FrameType | None = frame
    while each is not None and is_own_code(each.f_code.co_filename) and not _runs_program(each):
        each = each.f_back  # as the functions that stand in for those of pymunk 6
    while each is not None and not _runs_program(each):
        for name, value in list(each.f_locals.items()):
            if not name.startswith("__"):
                yield name, value
        if each.f_locals is not each.f_globals:
            yield from ((name, value) for name, value in list(each.f_globals.items()) if not name.startswith("__"))
        each = each.f_back


def _runs_program(frame: FrameType) -> bool:
    return frame.f_code.co_filename.startswith("<frozen")


def _is_same(known: Any, value: Any) -> bool:
    return isinstance(known, int) and not isinstance(known, bool) and known == value
