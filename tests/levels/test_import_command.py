"""The command `sandbox import`."""

import sys
from pathlib import Path

import pytest

import sandbox
from sandbox.cli.main import call
from tests.levels.drawings import DATA

LEVEL = str(DATA / "level.svg")


def test_scene_goes_to_standard_output_and_warnings_to_standard_error(capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["import", LEVEL]) == 0
    out, err = capfd.readouterr()
    scene = sandbox.loads(out)
    assert scene.title == "Warehouse"
    assert out.startswith("# Imported from ")
    assert "text#hint" in err


def test_file_is_written_and_replaced_only_with_force(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "scene.toml"
    assert call(["import", LEVEL, "--to", str(target)]) == 0
    assert "written: " in capfd.readouterr().out
    assert sandbox.load(target).title == "Warehouse"
    target.write_text("mine")
    assert call(["import", LEVEL, "--to", str(target)]) == 2
    assert "--force" in capfd.readouterr().err
    assert target.read_text() == "mine"
    assert call(["import", LEVEL, "--to", str(target), "--force", "--quiet"]) == 0
    assert capfd.readouterr().out == ""
    assert sandbox.load(target).title == "Warehouse"


def test_level_itself_is_never_replaced(tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    path.write_bytes((DATA / "level.svg").read_bytes())
    assert call(["import", str(path), "--to", str(path), "--force"]) == 2
    assert path.read_bytes() == (DATA / "level.svg").read_bytes()


def test_options_reach_the_scene(capfd: pytest.CaptureFixture[str]) -> None:
    options = ["--scale", "0.1", "--gravity", "0,-1.62", "--origin", "upper-left", "--tolerance", "2"]
    assert call(["import", LEVEL, *options]) == 0
    scene = sandbox.loads(capfd.readouterr().out)
    (post,) = scene.posts
    assert (post.position, post.radius) == ((30.0, -20.0), 1.0)
    assert scene.world.gravity == (0.0, -1.62)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--scale", "0"], "--scale"), (["--scale", "nan"], "--scale"), (["--tolerance", "-1"], "--tolerance"),
        (["--gravity", "9.81"], "--gravity"), (["--gravity", "0,inf"], "--gravity"),
        (["--origin", "middle"], "--origin"), (["--to", "/nonexistent/a.toml"], "no such folder"),
    ],
)  # fmt: skip
def test_invalid_options_are_faults(arguments: list[str], word: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["import", LEVEL, *arguments]) == 2
    err = capfd.readouterr().err
    assert word in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("name", ["a.svgz", "a.tmj", "a.toml", "a.png", "a", "", "x" * 300 + ".svg"])
def test_other_files_are_refused(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["import", name]) == 2
    assert len(capfd.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize(("package", "level"), [("svgelements", "level.svg"), ("pytmx", "level.tmx")])
def test_missing_package_is_named_with_its_installation(package, level, monkeypatch, capfd):
    monkeypatch.setitem(sys.modules, package, None)
    assert call(["import", str(DATA / level)]) == 2
    assert 'pip install -e ".[import]"' in capfd.readouterr().err
