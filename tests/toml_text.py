"""Texts of scene files, a line of Python for each table."""

import json
from typing import Any

SINGLE = frozenset(
    ("world", "solver", "play", "terrain", "artillery", "billiards", "billiards.place", "surface", "pinball")
)
"""Tables that a scene has once; all others are arrays of tables."""


def toml(table: str = "", /, **keys: Any) -> str:
    """Return a table of a scene file, a key per line; without a name, the keys before the first table."""
    heading = f"[{table}]\n" if table in SINGLE else f"[[{table}]]\n" if table else ""
    return heading + "".join(f"{key} = {_value(value)}\n" for key, value in keys.items())


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_value(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value) if isinstance(value, bool | str) else repr(value)
