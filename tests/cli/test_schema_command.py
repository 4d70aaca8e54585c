"""`sandbox schema`: the complete schema as JSON, the listing of one table, unknown tables."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.cli.main import call
from sandbox.scene.files.json_schema import dumps, schema
from tests.cli.calling import DROP, json_of, lines_of, output_of, write_scene
from tests.engines.builders import ROOT

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


@pytest.mark.parametrize("place", [".", "levels", "levels/one.toml", "one.toml"])
def test_schema_is_installed_beside_scenes_without_a_checkout(tmp_path: Path, place: str) -> None:
    """Runs a copy of what a wheel installs, away from the sources."""
    site, folder = tmp_path / "site", tmp_path / "work"
    shutil.copytree(ROOT / "sandbox", site / "sandbox", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "scenes", site / "sandbox" / "shipped")
    (folder / "levels").mkdir(parents=True)
    scenes = [write_scene(folder / name) for name in (".", "levels")]
    for scene in scenes:
        Path(scene).rename(Path(scene).with_name("one.toml"))
    done = subprocess.run(
        [sys.executable, "-m", "sandbox", "schema", "--install", place],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(site)},
        timeout=60,
        check=True,
    )
    written, line = done.stdout.splitlines()
    target = folder / ("levels" if "levels" in place else ".") / "scene.schema.json"
    assert written == f"written: {target.relative_to(folder)}"
    address = line.rpartition("#:schema ")[2]
    assert (target.parent / address).read_text(encoding="utf-8") == dumps()


def test_scene_that_names_the_schema_already_is_recognised(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    write_scene(tmp_path, "#:schema scene.schema.json\n" + DROP)
    for _ in range(2):  # an older schema is replaced
        assert "already" in output_of(capfd, "schema", "--install", "drop.toml")[1]


@pytest.mark.parametrize("arguments", [["missing"], ["missing/one.toml"], [".", "ball"], [".", "--json"]])
def test_wrong_install_writes_nothing(
    arguments: list[str], tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, out, err = lines_of(capfd, "schema", "--install", *arguments)
    assert (status, out, len(err), list(tmp_path.iterdir())) == (2, [], 1, [])
