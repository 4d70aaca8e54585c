"""A scene as TOML text, with every digit of its numbers."""

import json
from typing import Any


def text(document: dict[str, Any]) -> str:
    """Return the text of a scene: plain keys first, then tables and arrays of tables in their order."""
    plain, tables = [], []
    for key, value in document.items():
        if isinstance(value, dict):
            tables.append(f"[{key}]\n{_lines(value)}")
        elif isinstance(value, list):
            tables.extend(f"[[{key}]]\n{_lines(item)}" for item in value)
        else:
            plain.append(f"{key} = {_value(value)}")
    return "\n".join(["\n".join(plain) + "\n", *tables])


def _lines(table: dict[str, Any]) -> str:
    return "".join(f"{key} = {_value(value)}\n" for key, value in table.items())


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return repr(value + 0.0 if isinstance(value, float) else value)
