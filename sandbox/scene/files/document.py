"""Conversion between a scene document (nested dicts and lists, as TOML or JSON) and the `Scene` model."""

import json
from typing import Any

from pydantic import BaseModel

from sandbox.scene.files.overrides import EVERY, AddressError, assign_all, index_of, parse_path
from sandbox.scene.scene import Scene

_FIELDS = {field.alias or name: name for name, field in Scene.model_fields.items()}
"""Field name of a scene by the heading of its table."""


def read_model(document: dict[str, Any]) -> Scene:
    """Validate a scene document with the keys of a file. Dates and times are no valid values.

    Raises:
        pydantic.ValidationError: parts have faults.
        ValueError: a number is too large to be written.
    """
    return Scene.model_validate_json(_text(document), by_alias=True, by_name=False)


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, default=lambda value: {"a date or time": str(value)})


def to_document(scene: Scene) -> dict[str, Any]:
    """Return a scene as nested dicts and lists without default values."""
    document = scene.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    return document or {"title": scene.title}


def change_value(scene: Scene, path: str, value: Any) -> Scene:
    """Return a scene with one value changed; only the part that holds the value is validated.

    The time needed does not grow with the scene. Unchanged parts and the bodies are the same objects as before: the
    caller updates the bodies and checks references between parts (`crosscheck`). Raises pydantic's own errors;
    `from_document` gives the full messages.

    Args:
        scene: not modified.
        path: such as `world.gravity` or `ball.*.friction`.
        value: as in TOML or JSON.

    Raises:
        ValueError: the path does not exist, or the value is invalid.
    """
    heading, *rest = parse_path(path)
    part = getattr(scene, _FIELDS.get(heading, ""), None)
    if isinstance(part, BaseModel) and rest:
        changed: Any = _with(part, rest, path, value)
    elif isinstance(part, tuple) and part and len(rest) > 1:
        names = [{} if each.name is None else {"name": each.name} for each in part if hasattr(each, "name")]
        names = names or [{} for _ in part]
        every = rest[0] == EVERY and {"name": EVERY} not in names
        those = range(len(part)) if every else [index_of(names, (heading, rest[0]), path)]
        elements = list(part)
        for k in those:
            elements[k] = _with(elements[k], rest[1:], path, value)
        changed = tuple(elements)
    else:
        raise AddressError(f"{path}: the scene has no such value")
    return scene.model_copy(update={_FIELDS[heading]: changed})


def _with(part: BaseModel, rest: list[str], path: str, value: Any) -> BaseModel:
    """Return a part of a scene with the value at the rest of a path changed."""
    document = part.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    assign_all(document, tuple(rest), path, value)
    if len(rest) > 1:
        return type(part).model_validate_json(_text(document), by_alias=True, by_name=False)
    # Only the one value is copied: a session without steps has the duration 0, which a file may not have.
    if "duration" in document:
        document["duration"] = 1.0
    read = type(part).model_validate_json(_text(document), by_alias=True, by_name=False)
    name = next(name for name, field in type(part).model_fields.items() if (field.alias or name) == rest[0])
    return part.model_copy(update={name: getattr(read, name)})
