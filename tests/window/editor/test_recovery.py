"""Recovery of unsaved changes in the window: the question, restoring, discarding, and how editing ends."""

import os
import subprocess
import sys
from pathlib import Path

import pygame
import pytest

from sandbox.scene.editing.autosave import HEADER
from sandbox.scene.files.shipped_scenes import find
from tests.window.editor.hand import CTRL, OpenOn
from tests.window.pressing import press

pytestmark = pytest.mark.fail_slow(60)  # a window

SCENE = '[[ball]]\nname = "a"\nposition = [0.0, 2.0]\nradius = 0.5\n'
CHANGED = SCENE.replace("0.5", "0.25")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "car.toml"
    path.write_text(SCENE)
    return path


def leave_behind(path: Path, text: str) -> Path:
    """Write the autosave of a process that has ended; return its path."""
    code = f"""
import sys
from sandbox.scene.editing.autosave import AutosaveHeader
from sandbox.scene.editing.draft import SceneDraft
from pathlib import Path
print(AutosaveHeader.of(SceneDraft.read(Path({str(path)!r}))).line, end="")
"""
    header = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    file = path.parent / f".{path.name}.autosave"
    file.write_text(header + text)
    return file


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


def test_unsaved_changes_are_restored_as_one_change(open_on: OpenOn, path: Path) -> None:
    file = leave_behind(path, CHANGED)
    hand = open_on(path)
    view = hand.view
    assert view.recovered is not None
    assert view.draft.text == SCENE
    for code in (pygame.K_b, pygame.K_SPACE, pygame.K_e):  # no other key has a meaning
        hand.key(code)
        hand.key(code, CTRL)
    hand.frame(press(400, 300))
    assert (hand.window.editing, view.editor.gesture, view.editor.tool) == (view, None, "select")
    hand.key(pygame.K_RETURN)
    assert view.recovered is None
    assert view.draft.text == CHANGED
    hand.frame()
    assert file.read_text().endswith(CHANGED)
    assert f'"pid": {os.getpid()}' in file.read_text()
    hand.key(pygame.K_z, CTRL)
    assert view.draft.text == SCENE
    hand.frame()
    assert names(path.parent) == {"car.toml"}


def test_discarded_changes_are_gone(open_on: OpenOn, path: Path) -> None:
    leave_behind(path, CHANGED)
    hand = open_on(path)
    hand.key(pygame.K_ESCAPE)
    assert hand.view.recovered is None
    assert hand.view.draft.text == SCENE
    assert names(path.parent) == {"car.toml"}
    assert hand.window.context.exit_status is None


def test_window_that_is_closed_without_an_answer_keeps_the_changes(open_on: OpenOn, path: Path) -> None:
    file = leave_behind(path, CHANGED)
    hand = open_on(path)
    hand.frame(pygame.event.Event(pygame.QUIT))
    assert hand.window.context.exit_status == 0
    assert file.exists()


def test_text_that_is_no_scene_any_more_is_kept_and_reported(open_on: OpenOn, path: Path) -> None:
    file = leave_behind(path, SCENE.replace("radius", "radios"))
    before = file.read_bytes()
    hand = open_on(path)
    hand.key(pygame.K_RETURN)
    assert hand.view.recovered is None
    assert hand.view.draft.text == SCENE
    assert file.name in hand.messages()
    assert "radius" in hand.messages()
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    assert file.read_bytes() == before


def test_changes_of_a_killed_window_are_offered_to_the_next_one(open_on: OpenOn, path: Path) -> None:
    hand = open_on(path)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    file = path.parent / ".car.toml.autosave"
    content = file.read_text()
    hand.window.context.exit_status = 0  # as by SIGTERM, without a question
    hand.window.close()
    assert file.read_text().endswith(CHANGED)
    assert content.startswith(HEADER)
    hand = open_on(path)
    assert hand.view.recovered is not None
    hand.key(pygame.K_RETURN)
    assert hand.view.draft.text == CHANGED
    hand.key(pygame.K_s, CTRL)
    hand.frame()
    assert path.read_text() == CHANGED
    assert names(path.parent) == {"car.toml"}


@pytest.mark.parametrize("is_running", [False, True])
def test_confirmed_loss_removes_the_changes(open_on: OpenOn, path: Path, is_running: bool) -> None:
    hand = open_on(path)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    assert ".car.toml.autosave" in names(path.parent)
    if is_running:
        hand.key(pygame.K_e, CTRL)
        assert hand.window.editing is None
    hand.key(pygame.K_ESCAPE)
    assert hand.window.context.exit_status is None
    assert ".car.toml.autosave" in names(path.parent)
    hand.key(pygame.K_ESCAPE)
    assert hand.window.context.exit_status == 0
    hand.window.close()
    assert names(path.parent) == {"car.toml"}


def test_opening_another_scene_without_a_question_keeps_the_changes(open_on: OpenOn, path: Path) -> None:
    hand = open_on(path)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    hand.window.app_state.open_other(find("tutorial/bounce"))  # as the scene browser does
    assert hand.window.editing is None
    assert "kept" in hand.messages()
    hand.window.app_state.open_other(path)
    hand.window.start_editing()
    assert hand.view.recovered is not None


def test_confirmed_change_of_the_scene_removes_the_changes(open_on: OpenOn, path: Path) -> None:
    (path.parent / "zebra.toml").write_text(SCENE)
    hand = open_on(path)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    hand.key(pygame.K_e, CTRL)
    hand.key(pygame.K_RIGHTBRACKET)
    assert ".car.toml.autosave" in names(path.parent)
    hand.key(pygame.K_RIGHTBRACKET)
    assert hand.window.app_state.path == path.parent / "zebra.toml"
    assert names(path.parent) == {"car.toml", "zebra.toml"}


def test_reload_ends_the_editing_of_the_former_text(open_on: OpenOn, path: Path) -> None:
    hand = open_on(path)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    hand.key(pygame.K_e, CTRL)
    path.write_text(SCENE.replace("2.0", "3.0"))
    hand.key(pygame.K_l, CTRL)
    hand.key(pygame.K_l, CTRL)
    hand.key(pygame.K_e, CTRL)
    assert hand.view.draft.text == path.read_text()
    assert names(path.parent) == {"car.toml"}
    hand.key(pygame.K_e, CTRL)
    path.write_text(SCENE.replace("2.0", "4.0"))  # changed, while nothing is unsaved
    hand.key(pygame.K_e, CTRL)
    assert hand.view.draft.text == path.read_text()


def test_changes_are_noted_while_the_panel_is_hidden(open_on: OpenOn, path: Path) -> None:
    hand = open_on(path)
    hand.key(pygame.K_TAB)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    hand.key(pygame.K_ESCAPE)
    assert hand.window.context.exit_status is None
    assert "not saved" in (hand.window.app_state.question or "")


def test_failure_is_shown_and_editing_continues(open_on: OpenOn, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hand = open_on(path)

    def fail(self: Path, _data: bytes) -> int:
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_bytes", fail)
    hand.view.draft.replace_text(CHANGED, "change")
    hand.frame()
    assert "No space left" in hand.messages()
    hand.key(pygame.K_z, CTRL)
    assert hand.view.draft.text == SCENE


@pytest.mark.parametrize("size", [(900, 600), (160, 120)])
def test_question_is_drawn_at_every_size(open_on: OpenOn, path: Path, size: tuple[int, int]) -> None:
    file = leave_behind(path, CHANGED)
    os.utime(file, (0, 0))
    path.write_text("# newer\n" + SCENE)
    hand = open_on(path)
    hand.window.context.resize(pygame.display.set_mode(size, pygame.RESIZABLE))
    hand.frame()
    assert hand.view.recovered is not None
    assert "has changed since" in hand.view._recovery_question(hand.view.recovered)
