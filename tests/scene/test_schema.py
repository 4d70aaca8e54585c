import json
from collections.abc import Iterator
from typing import Any, get_args

import pytest

from sandbox.scene.model import Scene
from sandbox.scene.part import Part
from sandbox.scene.schema import dumps, schema
from sandbox.scene.shipped import SCHEMA, folder


def objects(value: Any) -> Iterator[dict[str, Any]]:
    """Every JSON object within a value."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from objects(inner)


def parts(model: type[Part]) -> Iterator[type[Part]]:
    """A model and all that its fields are made of."""
    yield model
    for field in model.model_fields.values():
        for inner in (field.annotation, *get_args(field.annotation)):
            if isinstance(inner, type) and issubclass(inner, Part):
                yield from parts(inner)


def test_committed_schema_is_current() -> None:
    root = folder()
    assert root is not None
    assert (root / SCHEMA).read_text(encoding="utf-8") == dumps()


def test_schema_is_its_text() -> None:
    assert json.loads(dumps()) == schema()
    assert dumps().endswith("}\n")
    assert schema()["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize("part", list(parts(Scene)), ids=lambda part: part.__name__)
def test_table_knows_exactly_the_keys_of_its_part(part: type[Part]) -> None:
    table = schema() if part is Scene else schema()["$defs"][part.__name__]
    fields = {field.alias or name: field for name, field in part.model_fields.items()}
    assert set(table["properties"]) == set(fields)
    assert set(table.get("required", ())) == {key for key, field in fields.items() if field.is_required()}
    assert table["additionalProperties"] is False


def test_nothing_may_be_null_for_toml_has_none() -> None:
    for each in objects(schema()):
        assert each.get("type") != "null"
        assert None not in each.values()


def test_docstrings_below_fields_become_descriptions() -> None:
    document = schema()
    ball = document["$defs"]["Ball"]["properties"]
    assert ball["fixed"]["description"] == "Never moves: infinitely heavy."
    assert ball["mass"]["description"] == "kg; without mass or density, 1"  # written in a class that Ball extends
    assert document["properties"]["about"]["description"] == "What to look for."
    assert "description" not in document["properties"]["title"]


def test_ranges_and_defaults_are_those_of_the_model() -> None:
    tables = schema()["$defs"]
    assert tables["Ball"]["properties"]["radius"] == {"type": "number", "minimum": 1e-9, "maximum": 1e9}
    assert tables["Settings"]["properties"]["dt"]["default"] == 0.01
    assert tables["Emitter"]["properties"]["collides"]["default"] == "none"
    assert tables["Emitter"]["properties"]["radius"]["default"] == 0.05
