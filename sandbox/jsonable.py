"""JSON documents from dataclasses: the values of a document, and its JSON Schema from the same types.

A dataclass becomes an object with its fields in order, but for those without `repr`. The metadata of `in_json` rename,
omit or inline a field. The fields and properties that a class lists in `json_head` precede the other fields, the
properties in `json_properties` follow them; each is listed by name or as (key, name). `json_name` is the name of a
class in schemas; default: the name of the class. JSON has no number for nan and infinity: they become null, so that
every float may be null in the schema.
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import fields, is_dataclass
from enum import Enum
from types import NoneType, UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel

DIALECT = "https://json-schema.org/draft/2020-12/schema"

JsonObject = dict[str, Any]
"""JSON object: values by key"""


def in_json(
    *, key: str | None = None, omit: bool = False, inline: bool = False, optional: bool = False
) -> dict[str, Any]:
    """Return the `metadata` of a dataclass field that says how it appears in JSON documents.

    Args:
        key: key in the document; default: the name of the field.
        omit: leave the field out of the document.
        inline: merge the value, an object, into the object of the dataclass; None adds nothing.
        optional: leave the field out of a document in which its value is None.
    """
    return {"json": JsonField(key, omit, inline, optional)}


class JsonField(NamedTuple):
    """How a field appears in documents, see `in_json`."""

    key: str | None = None
    omit: bool = False
    inline: bool = False
    optional: bool = False


def _members(cls: Any) -> list[tuple[str, JsonField]]:
    """Return the fields and properties that the documents of a class have, in order, and how they appear, with keys."""
    if is_dataclass(cls):
        options: dict[str, JsonField] = {
            each.name: each.metadata.get("json", JsonField(omit=not each.repr)) for each in fields(cls)
        }
    else:
        options = dict.fromkeys(cls.model_fields if issubclass(cls, BaseModel) else cls._fields, JsonField())
    head, last = getattr(cls, "json_head", ()), getattr(cls, "json_properties", ())
    found = []
    for each in (*head, *(name for name in options if name not in head), *last):
        key, name = (None, each) if isinstance(each, str) else each
        option = options.get(name, JsonField())
        if not option.omit:
            found.append((name, option._replace(key=key or option.key or name)))
    return found


def finite(value: float | None) -> float | None:
    """Return a number, or None if it is unknown or not finite."""
    return value if value is not None and math.isfinite(value) else None


def to_json(value: Any) -> Any:
    """Return a value as JSON can hold it; a number that is not finite becomes None.

    Args:
        value: dataclass, named tuple, pydantic model, mapping, sequence, set, array, number, string or None.

    Raises:
        TypeError: JSON cannot hold a value of that type.
    """
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if (is_dataclass(value) and not isinstance(value, type)) or (
        isinstance(value, tuple) and hasattr(value, "_fields")
    ):
        return _object(value)
    if isinstance(value, Mapping):
        return {str(key): to_json(each) for key, each in value.items()}
    if isinstance(value, Sequence | Set):
        return [to_json(each) for each in value]
    if isinstance(value, np.ndarray | np.generic):
        return to_json(value.tolist())
    raise TypeError(f"JSON cannot hold a {type(value).__name__}")


def _object(value: Any) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, (key, _, inline, optional) in _members(type(value)):
        own = getattr(value, name)
        if own is None and (optional or inline):
            continue
        if inline:
            found |= to_json(own)
        else:
            found[str(key)] = to_json(own)
    return found


def json_schema(document: type, *, is_open: bool = False) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of the documents that `to_json` makes of a dataclass.

    Args:
        document: the dataclass of the document.
        is_open: whether the document may have further keys.
    """
    definitions: dict[str, Any] = {}
    schema = _object_schema(document, definitions)
    schema["additionalProperties"] |= is_open
    return {"$schema": DIALECT, **schema, **({"$defs": dict(sorted(definitions.items()))} if definitions else {})}


def _object_schema(cls: type, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a dataclass, named tuple or inlined pydantic model."""
    hints = get_type_hints(cls)
    properties: dict[str, Any] = {}
    required: list[str] = []
    is_open = False
    for name, (key, _, inline, optional) in _members(cls):
        hint = hints[name] if name in hints else get_type_hints(getattr(cls, name).fget)["return"]
        inlined = _without_none(hint)
        if not inline:
            properties[str(key)] = _schema(hint, definitions)
            required += [] if optional else [str(key)]
        elif isinstance(inlined, type) and (is_dataclass(inlined) or issubclass(inlined, BaseModel)):
            inner = _object_schema(inlined, definitions)
            properties |= inner["properties"]
            required += inner["required"] if inlined is hint else []
            is_open |= inner["additionalProperties"]
        else:
            is_open = True  # the keys of a mapping are not known
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": is_open}


def _without_none(hint: Any) -> Any:
    """Return the type T of a hint `T | None`; any other hint unchanged."""
    others = [each for each in get_args(hint) if each is not NoneType]
    return others[0] if get_origin(hint) in (Union, UnionType) and len(others) == 1 else hint


def _schema(hint: Any, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a type."""
    origin, arguments = get_origin(hint), get_args(hint)
    if hint is Any or hint is object:
        return {}
    if origin in (Union, UnionType):
        return _union([_schema(each, definitions) for each in arguments])
    if origin is Literal:
        return {"enum": list(arguments)}
    if isinstance(hint, type) and issubclass(hint, Enum):
        return {"enum": [each.value for each in hint]}
    simple = {NoneType: "null", bool: "boolean", int: "integer", str: "string"}
    if hint in simple:
        return {"type": simple[hint]}
    if hint is float:
        return {"type": ["number", "null"]}
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        return {"type": "object"}
    if isinstance(hint, type) and (is_dataclass(hint) or hasattr(hint, "_fields")):
        name = getattr(hint, "json_name", hint.__name__)
        if name not in definitions:
            definitions[name] = {}  # a type may refer to itself
            definitions[name] = _object_schema(hint, definitions)
        return {"$ref": f"#/$defs/{name}"}
    if isinstance(origin, type) and issubclass(origin, Mapping):
        values = _schema(arguments[1], definitions)
        return {"type": "object", **({"additionalProperties": values} if values else {})}
    if origin is tuple and arguments[-1:] != (Ellipsis,):
        items = [_schema(each, definitions) for each in arguments]
        return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}
    if isinstance(origin, type) and issubclass(origin, Sequence | Set):
        return {"type": "array", "items": _schema(arguments[0], definitions)}
    raise TypeError(f"no JSON Schema for {hint}")


def _union(schemas: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a schema that allows any of several."""
    if any(not each for each in schemas):
        return {}
    if all(set(each) == {"type"} for each in schemas):
        names: list[str] = []
        for each in schemas:
            names += each["type"] if isinstance(each["type"], list) else [each["type"]]
        unique = list(dict.fromkeys(names))
        return {"type": unique if len(unique) > 1 else unique[0]}
    return {"anyOf": schemas}
