"""Validation of JSON values by the parts of JSON Schema (draft 2020-12) that the schemas of the documents use."""

from collections.abc import Iterator, Mapping
from typing import Any

from sandbox.cli.json_schemas import document_schema

TYPES: Mapping[str, tuple[type, ...]] = {
    "null": (type(None),), "boolean": (bool,), "integer": (int,), "number": (int, float), "string": (str,),
    "array": (list,), "object": (dict,),
}  # fmt: skip
OBJECT_KEYWORDS = frozenset(("properties", "required", "additionalProperties"))
ARRAY_KEYWORDS = frozenset(("items", "prefixItems", "minItems", "maxItems"))
KEYWORDS = frozenset(("$schema", "$defs", "$ref", "type", "enum", "anyOf")) | OBJECT_KEYWORDS | ARRAY_KEYWORDS


def assert_valid_document(command: str, document: Mapping[str, Any]) -> None:
    """Check that a document satisfies the published schema of its command."""
    schema = document_schema(command)
    assert list(violations(document, schema, schema)) == []


def violations(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], path: str = "") -> Iterator[str]:
    """Yield the paths at which a value violates a schema, with the reason.

    Args:
        value: the value.
        schema: its schema.
        root: the root schema, which has the definitions.
        path: path of the value.
    """
    assert set(schema) <= KEYWORDS, f"unknown keywords: {set(schema) - KEYWORDS}"
    if "$ref" in schema:
        yield from violations(value, root["$defs"][schema["$ref"].rpartition("/")[2]], root, path)
    if "enum" in schema and value not in schema["enum"]:
        yield f"{path}: {value!r} is not one of {schema['enum']}"
    if "anyOf" in schema and all(any(violations(value, each, root, path)) for each in schema["anyOf"]):
        yield f"{path}: {value!r:.80} matches no alternative"
    if "type" in schema:
        names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
        if not any(_has_type(value, name) for name in names):
            yield f"{path}: {value!r:.80} is not {' or '.join(names)}"
            return
    if isinstance(value, dict):
        yield from _object_violations(value, schema, root, path)
    elif isinstance(value, list):
        yield from _array_violations(value, schema, root, path)


def _has_type(value: Any, name: str) -> bool:
    return isinstance(value, TYPES[name]) and (name == "boolean" or not isinstance(value, bool))


def _object_violations(
    value: dict[str, Any], schema: Mapping[str, Any], root: Mapping[str, Any], path: str
) -> Iterator[str]:
    properties, more = schema.get("properties", {}), schema.get("additionalProperties", True)
    for key in schema.get("required", ()):
        if key not in value:
            yield f"{path}: {key} is missing"
    for key, each in value.items():
        if key in properties:
            yield from violations(each, properties[key], root, f"{path}.{key}")
        elif more is False:
            yield f"{path}: {key} is unknown"
        elif isinstance(more, dict):
            yield from violations(each, more, root, f"{path}.{key}")


def _array_violations(value: list[Any], schema: Mapping[str, Any], root: Mapping[str, Any], path: str) -> Iterator[str]:
    if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
        yield f"{path}: {len(value)} elements"
        return
    first = schema.get("prefixItems", [])
    for k, each in enumerate(value):
        if k < len(first):
            yield from violations(each, first[k], root, f"{path}[{k}]")
        elif "items" in schema:
            yield from violations(each, schema["items"], root, f"{path}[{k}]")
