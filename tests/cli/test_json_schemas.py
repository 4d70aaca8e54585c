"""JSON Schemas of the commands' documents: the published ones are current."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal, NamedTuple

import numpy as np
import pytest

from sandbox.cli.json_schemas import DOCUMENTS
from sandbox.jsonable import in_json, json_schema, to_json
from tests.cli.json_validation import violations
from tools.json_schemas import FOLDER, schema_text


class Point(NamedTuple):
    x: float
    y: float


@dataclass(frozen=True)
class Inner:
    kind: Literal["a", "b"]
    numbers: tuple[int, ...]


@dataclass(frozen=True)
class Sample:
    name: str = field(metadata=in_json(key="label"))
    hidden: object = field(metadata=in_json(omit=True))
    value: float | None
    point: Point
    pair: tuple[float, str]
    inner: Inner = field(metadata=in_json(inline=True))
    many: Sequence[Inner]
    table: Mapping[str, float]
    array: Sequence[float]

    json_properties: ClassVar = ("double",)

    @property
    def double(self) -> int:
        return 2 * len(self.name)


SAMPLE = Sample(
    name="n",
    hidden=object(),
    value=math.nan,
    point=Point(1.0, math.inf),
    pair=(0.5, "s"),
    inner=Inner("a", (1, 2)),
    many=(Inner("b", ()),),
    table={"k": -math.inf},
    array=np.array([1.0, np.nan]),
)


def test_document_has_the_fields_of_the_dataclass_in_order() -> None:
    document = to_json(SAMPLE)
    assert document == {
        "label": "n",
        "value": None,
        "point": {"x": 1.0, "y": None},
        "pair": [0.5, "s"],
        "kind": "a",
        "numbers": [1, 2],
        "many": [{"kind": "b", "numbers": []}],
        "table": {"k": None},
        "array": [1.0, None],
        "double": 2,
    }
    assert list(document)[:3] == ["label", "value", "point"]
    json.dumps(document, allow_nan=False)


@dataclass(frozen=True)
class Listed:
    size: int
    name: str

    json_head: ClassVar = ("name", ("surface", "area"))
    json_name: ClassVar = "Square"

    @property
    def area(self) -> int:
        return self.size**2


def test_listed_members_precede_the_other_fields() -> None:
    assert list(to_json(Listed(3, "n")).items()) == [("name", "n"), ("surface", 9), ("size", 3)]
    assert list(json_schema(Listed)["properties"]) == ["name", "surface", "size"]


def test_value_that_json_cannot_hold_is_refused() -> None:
    with pytest.raises(TypeError, match="complex"):
        to_json([1j])


def test_schema_of_a_dataclass_accepts_its_document_and_no_damaged_one() -> None:
    schema, document = json_schema(Sample), to_json(SAMPLE)
    assert list(violations(document, schema, schema)) == []
    for damage in (
        {"label": 1},
        {"kind": "c"},
        {"pair": [0.5]},
        {"many": [{}]},
        {"more": 0},
        {"double": 1.5},
        {"value": "x"},
    ):
        assert list(violations({**document, **damage}, schema, schema)), damage
    assert list(violations({}, schema, schema))


@pytest.mark.parametrize("command", DOCUMENTS)
def test_published_schema_is_the_generated_one(command: str) -> None:
    stored = (FOLDER / f"{command}.schema.json").read_text(encoding="utf-8")
    assert stored == schema_text(command), "python -m tools.json_schemas writes it"
