"""Shipped scenes and the schema of scene files."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import is_required
from sandbox.scene.files import shipped_scenes as module
from sandbox.scene.files.json_schema import dumps, schema
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import SCHEMA, UnknownSceneError, find, folder, shipped
from tests.scene.models import models


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Make a package as a wheel installs it, with two scenes of one stem; return its scene folder."""
    package = tmp_path / "site-packages" / "sandbox"
    root = package / "shipped"
    for name in ("one/same", "two/same", "two/other"):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / f"{name}.toml").write_text(f'title = "{name}"\n')
    (root / SCHEMA).write_text("{}")
    (root / "two" / "notes.md").write_text("no scene")
    monkeypatch.setattr(module, "PACKAGE", package)
    return root


def test_checkout_ships_its_scenes() -> None:
    names = [scene.name for scene in shipped()]
    assert {"tutorial/ball", "tutorial/bounce", "benchmark/pile", "particles/fireworks_100k"} <= set(names)
    assert names == sorted(names, key=lambda name: (not name.startswith("tutorial/"), name))
    assert folder() == Path(__file__).resolve().parents[2] / "scenes"


def test_installed_package_ships_its_scenes(installed: Path) -> None:
    assert folder() == installed
    assert [scene.name for scene in shipped()] == ["one/same", "two/other", "two/same"]
    assert find("two/same") == installed / "two" / "same.toml"
    assert find("other") == installed / "two" / "other.toml"


def test_scenes_of_a_checkout_take_precedence_over_installed_ones(installed: Path) -> None:
    checkout = installed.parents[1] / "scenes"
    (checkout / "tutorial").mkdir(parents=True)
    (checkout / "tutorial" / "mine.toml").touch()
    assert folder() == installed  # a folder "scenes" without our schema belongs to another project
    (checkout / SCHEMA).touch()
    assert [scene.name for scene in shipped()] == ["tutorial/mine"]


def test_package_without_scenes_has_no_shipped_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PACKAGE", tmp_path / "sandbox")
    assert folder() is None
    assert shipped() == ()
    with pytest.raises(UnknownSceneError):
        find("bounce")


@pytest.mark.parametrize("text", ["bounce", "tutorial/bounce"])
def test_shipped_scene_is_found_by_name_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert load(find(text)).title == "Bounce"


def test_file_takes_precedence_over_a_shipped_name_and_a_folder_does_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").touch()
    Path("link.toml").symlink_to("mine.toml")
    os.mkfifo("pipe")
    for text in ("mine.toml", "./mine.toml", "link.toml", str(tmp_path / "mine.toml"), "pipe"):
        assert find(text) == Path(text)
    Path("bounce").mkdir()
    assert find("bounce").name == "bounce.toml"
    Path("bounce").rmdir()
    Path("bounce").touch()
    assert find("bounce") == Path("bounce")


def test_ambiguous_stem_is_refused_with_the_candidates(installed: Path) -> None:
    with pytest.raises(UnknownSceneError) as caught:
        find("same")
    assert str(caught.value) == "'same' is ambiguous: one/same, two/same; include the folder"


@pytest.mark.parametrize(
    ("text", "suggestion"),
    [
        ("bonce", "mean tutorial/bounce?"),
        ("tutorial/bonuce", "tutorial/bounce"),
        ("tutorial/bounce.toml", "tutorial/bounce"),
    ],
)
def test_misspelt_scene_is_refused_with_a_suggestion(text: str, suggestion: str) -> None:
    with pytest.raises(UnknownSceneError) as caught:
        find(text)
    assert repr(text) in str(caught.value)
    assert suggestion in str(caught.value)


@pytest.mark.parametrize("text", ["", "a\0b", "x" * 5000, "../no" * 500, "/dev/null/x", "日本", "*", "\n"])
def test_text_that_is_no_scene_is_refused(text: str) -> None:
    with pytest.raises(LookupError, match="`sandbox scenes` lists the shipped scenes") as caught:
        find(text)
    assert isinstance(caught.value, UnknownSceneError)
    assert "\n" not in str(caught.value)


def test_shipped_scenes_imports_neither_pydantic_nor_numpy() -> None:
    code = "import sys, sandbox.scene.files.shipped_scenes; print({'pydantic', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


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


def test_committed_schema_is_current() -> None:
    root = folder()
    assert (root / SCHEMA).read_text(encoding="utf-8") == dumps()


@pytest.mark.fail_slow(60)  # takes over half a second
def test_dumped_schema_is_valid_json_with_its_dialect() -> None:
    assert json.loads(dumps()) == cached_schema()
    assert dumps().endswith("}\n")
    assert cached_schema()["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize("part", models(), ids=lambda part: part.__name__)
def test_table_has_exactly_the_keys_of_its_model(part: type[BaseModel]) -> None:
    table = cached_schema() if part is Scene else cached_schema()["$defs"][part.__name__]
    fields = {field.alias or name: field for name, field in part.model_fields.items()}
    assert set(table["properties"]) == set(fields)
    assert set(table.get("required", ())) == {key for key, field in fields.items() if is_required(field)}
    assert table["additionalProperties"] is False


def test_schema_allows_no_null() -> None:
    for each in objects(cached_schema()):
        assert each.get("type") != "null"
        assert None not in each.values()


def test_docstrings_below_fields_become_descriptions() -> None:
    document = cached_schema()
    ball = document["$defs"]["Ball"]["properties"]
    assert ball["fixed"]["description"] == "Never moves, as if infinitely heavy."
    # inherited from a base class of Ball
    assert ball["mass"]["description"] == "mass, kg; default 1 if neither mass nor density is given"
    assert document["properties"]["about"]["description"] == "What to observe."
    assert document["properties"]["ball"]["description"] == "One ball; on a `[surface]` a sphere, I = ⅖ m r²."


def test_every_key_has_a_description() -> None:
    tables = {"scene": cached_schema(), **cached_schema()["$defs"]}
    undocumented = [f"{name}.{key}" for name, table in tables.items() for key in table.get("properties", ())
               if not table["properties"][key].get("description")]  # fmt: skip
    assert undocumented == []
