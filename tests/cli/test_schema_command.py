"""`sandbox schema`: the complete schema as JSON, the listing of one table, unknown tables."""

import json

import pytest

from sandbox.cli.main import call
from sandbox.scene.files.json_schema import dumps, schema
from tests.cli.calling import json_of, lines_of, output_of

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


def test_schema_without_a_table_prints_the_json_schema(capfd: pytest.CaptureFixture[str]) -> None:
    for flags in ([], ["--json"]):
        assert call(["schema", *flags]) == 0
        assert capfd.readouterr().out == dumps()


@pytest.mark.parametrize("table", ["[ball]", "body.box", "play.part", "world"])
def test_table_lists_each_key_with_its_description(table: str, capfd: pytest.CaptureFixture[str]) -> None:
    out = output_of(capfd, "schema", table)
    _, document, _ = json_of(capfd, "schema", table)
    listed = {line.split()[0]: line for line in out[2:]}
    assert list(listed) == list(document["properties"])
    for key, node in document["properties"].items():
        assert node["description"].split()[0] in listed[key]


@pytest.mark.parametrize(("table", "kind"), [("joint", "rotary_limit"), ("drive", "plunger")])
def test_table_of_several_kinds_lists_each_kind(table: str, kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "schema", table)
    assert status == 0
    assert any(line.startswith(f"{table}, kind {kind}: ") for line in out)
    _, document, _ = json_of(capfd, "schema", table)
    assert kind in json.dumps(document["oneOf"])


def test_ranges_omit_bounds_of_extreme_size(capfd: pytest.CaptureFixture[str]) -> None:
    _, out, _ = lines_of(capfd, "schema", "ball")
    lines = {line.split()[0]: line for line in out}
    assert "number 0 … 1 " in lines["restitution"]
    assert "number > 0 " in lines["radius"]
    assert "1e+" not in lines["position"]
    assert "required" in lines["position"]


def test_every_table_of_a_scene_can_be_listed(capfd: pytest.CaptureFixture[str]) -> None:
    for key, node in schema()["properties"].items():
        if node.get("type") != "string":
            status, out, err = lines_of(capfd, "schema", key)
            assert (status, err, len(out) > 2) == (0, [], True)
