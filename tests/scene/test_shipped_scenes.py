import os
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.scene.files import shipped_scenes as module
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import SCHEMA, UnknownSceneError, find, folder, shipped


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
    assert names == sorted(names)
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


def test_existing_path_is_returned_unchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").touch()
    Path("link.toml").symlink_to("mine.toml")
    Path("down").mkdir()
    for text in ("mine.toml", "./mine.toml", "link.toml", "down/../mine.toml", str(tmp_path / "mine.toml")):
        assert find(text) == Path(text)


def test_file_takes_precedence_over_a_shipped_name_and_a_folder_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bounce").mkdir()
    assert find("bounce").name == "bounce.toml"
    Path("bounce").rmdir()
    Path("bounce").touch()
    assert find("bounce") == Path("bounce")


def test_pipe_is_accepted_as_a_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert find(str(pipe)) == pipe


def test_ambiguous_stem_is_refused_with_the_candidates(installed: Path) -> None:
    with pytest.raises(UnknownSceneError) as caught:
        find("same")
    assert str(caught.value) == "'same' is ambiguous: one/same, two/same; include the folder"


@pytest.mark.parametrize(
    ("text", "suggestion"),
    [
        ("bonce", "did you mean tutorial/bounce?"),
        ("tutorial/bonuce", "did you mean tutorial/bounce"),
        ("tutorial/bounce.toml", "did you mean tutorial/bounce"),
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
