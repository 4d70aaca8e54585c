import json
from collections.abc import Iterator
from functools import cache
from typing import Any, get_args

import pytest

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part
from sandbox.scene.description.game_tables import lazy_table
from sandbox.scene.files.json_schema import dumps, schema
from sandbox.scene.files.shipped_scenes import SCHEMA, folder


@cache
def cached_schema() -> dict[str, Any]:
    """Return the schema, built once."""
    return schema()


def objects(value: Any) -> Iterator[dict[str, Any]]:
    """Yield every JSON object within a value."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from objects(inner)


def parts(model: type[Part]) -> Iterator[type[Part]]:
    """Yield a model and the models of its fields, recursively."""
    yield model
    for field in model.model_fields.values():
        table = lazy_table(field)
        for inner in (field.annotation if table is None else table.model, *get_args(field.annotation)):
            if isinstance(inner, type) and issubclass(inner, Part):
                yield from parts(inner)


def test_committed_schema_is_current() -> None:
    root = folder()
    assert root is not None
    assert (root / SCHEMA).read_text(encoding="utf-8") == dumps()


def test_dumped_schema_is_valid_json_with_its_dialect() -> None:
    assert json.loads(dumps()) == cached_schema()
    assert dumps().endswith("}\n")
    assert cached_schema()["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize("part", list(parts(Scene)), ids=lambda part: part.__name__)
def test_table_has_exactly_the_keys_of_its_model(part: type[Part]) -> None:
    table = cached_schema() if part is Scene else cached_schema()["$defs"][part.__name__]
    fields = {field.alias or name: field for name, field in part.model_fields.items()}
    assert set(table["properties"]) == set(fields)
    assert set(table.get("required", ())) == {key for key, field in fields.items() if field.is_required()}
    assert table["additionalProperties"] is False


def test_schema_allows_no_null() -> None:
    for each in objects(cached_schema()):
        assert each.get("type") != "null"
        assert None not in each.values()


def test_docstrings_below_fields_become_descriptions() -> None:
    document = cached_schema()
    ball = document["$defs"]["Ball"]["properties"]
    assert ball["fixed"]["description"] == "Never moves, as if infinitely heavy."
    assert (
        ball["mass"]["description"] == "mass, kg; default 1 if neither mass nor density is given"
    )  # inherited from a base class of Ball
    assert document["properties"]["about"]["description"] == "What to observe."
    assert document["properties"]["ball"]["description"] == "One ball; on a `[surface]` a sphere, I = ⅖ m r²."


def test_every_key_has_a_description() -> None:
    tables = {"scene": cached_schema(), **cached_schema()["$defs"]}
    undocumented = [f"{name}.{key}" for name, table in tables.items() for key in table.get("properties", ())
               if not table["properties"][key].get("description")]  # fmt: skip
    assert undocumented == []


@pytest.mark.parametrize(
    ("table", "key", "unit"),
    [
        ("Ball", "position", "m"), ("Ball", "radius", "m"), ("Ball", "velocity", "m/s"), ("Ball", "angle", "rad"),
        ("Ball", "angular_velocity", "rad/s"), ("Ball", "mass", "kg"), ("Ball", "density", "kg/m²"),
        ("World", "gravity", "m/s²"), ("World", "linear_drag", "1/s"), ("Box", "size", "m"), ("Settings", "dt", "s"),
        ("Spring", "stiffness", "N/m"), ("Motor", "rate", "rad/s"), ("Thrust", "force", "N"), ("Post", "radius", "m"),
    ],
)  # fmt: skip
def test_descriptions_of_quantities_name_their_units(table: str, key: str, unit: str) -> None:
    words = (
        cached_schema()["$defs"][table]["properties"][key]["description"].replace(",", " ").replace(";", " ").split()
    )
    assert unit in [word.rstrip(".:") for word in words]


def test_schema_has_the_ranges_and_defaults_of_the_model() -> None:
    tables = cached_schema()["$defs"]
    assert tables["Ball"]["properties"]["radius"] == {
        "description": "radius of the disc, m",
        "type": "number",
        "minimum": 1e-9,
        "maximum": 1e9,
    }
    assert tables["Settings"]["properties"]["dt"]["default"] == 0.01
    assert tables["Emitter"]["properties"]["collides"]["default"] == "none"
    assert tables["Emitter"]["properties"]["radius"]["default"] == 0.05
