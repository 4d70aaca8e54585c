"""Recovery of unsaved changes in the window: the question, restoring, discarding, and how editing ends."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.scene.editing.autosave import HEADER
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.editor.edit_view import EditView
from tests.window.pressing import key, key_up, press

pytestmark = pytest.mark.full  # a window

SCENE = '[[ball]]\nname = "a"\nposition = [0.0, 2.0]\nradius = 0.5\n'
CHANGED = SCENE.replace("0.5", "0.25")
CTRL = pygame.KMOD_CTRL


@pytest.fixture
def open_on(tmp_path: Path) -> Iterator[Callable[[Path], App]]:
    """Return a function that opens a window on a scene and edits it."""
    windows: list[App] = []

    def edit(path: Path) -> App:
        window = App(AppState(), size=(900, 600), folder=tmp_path, say=lambda _: None)
        windows.append(window)
        assert window.app_state.open(path)
        pygame.event.clear()
        type_key(window, pygame.K_e, CTRL)
        return window

    yield edit
    for window in windows:
        window.close()


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


def type_key(window: App, code: int, mod: int = 0) -> None:
    for event in (key(code, mod), key_up(code)):
        pygame.event.post(event)
    window.run_frame(0.02)


def view_of(window: App) -> EditView:
    assert window.editing is not None
    return window.editing


def names(folder: Path) -> set[str]:
    return {each.name for each in folder.iterdir()}


def messages(window: App) -> str:
    return " ".join(text for _, text in window.app_state.messages.visible())


def test_unsaved_changes_are_restored_as_one_change(open_on: Callable[[Path], App], path: Path) -> None:
    file = leave_behind(path, CHANGED)
    window = open_on(path)
    view = view_of(window)
    assert view.recovered is not None
    assert view.draft.text == SCENE
    for code in (pygame.K_b, pygame.K_SPACE, pygame.K_e):  # no other key has a meaning
        type_key(window, code)
        type_key(window, code, CTRL)
    pygame.event.post(press(400, 300))
    window.run_frame(0.02)
    assert (window.editing, view.editor.gesture, view.editor.tool) == (view, None, "select")
    type_key(window, pygame.K_RETURN)
    assert view.recovered is None
    assert view.draft.text == CHANGED
    window.run_frame(0.02)
    assert file.read_text().endswith(CHANGED)
    assert f'"pid": {os.getpid()}' in file.read_text()
    type_key(window, pygame.K_z, CTRL)
    assert view.draft.text == SCENE
    window.run_frame(0.02)
    assert names(path.parent) == {"car.toml"}


def test_discarded_changes_are_gone(open_on: Callable[[Path], App], path: Path) -> None:
    leave_behind(path, CHANGED)
    window = open_on(path)
    type_key(window, pygame.K_ESCAPE)
    assert view_of(window).recovered is None
    assert view_of(window).draft.text == SCENE
    assert names(path.parent) == {"car.toml"}
    assert window.context.exit_status is None


def test_window_that_is_closed_without_an_answer_keeps_the_changes(open_on: Callable[[Path], App], path: Path) -> None:
    file = leave_behind(path, CHANGED)
    window = open_on(path)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.run_frame(0.02)
    assert window.context.exit_status == 0
    assert file.exists()


def test_text_that_is_no_scene_any_more_is_kept_and_reported(open_on: Callable[[Path], App], path: Path) -> None:
    file = leave_behind(path, SCENE.replace("radius", "radios"))
    before = file.read_bytes()
    window = open_on(path)
    type_key(window, pygame.K_RETURN)
    assert view_of(window).recovered is None
    assert view_of(window).draft.text == SCENE
    assert file.name in messages(window)
    assert "radius" in messages(window)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    assert file.read_bytes() == before


def test_changes_of_a_killed_window_are_offered_to_the_next_one(open_on: Callable[[Path], App], path: Path) -> None:
    window = open_on(path)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    file = path.parent / ".car.toml.autosave"
    content = file.read_text()
    window.context.exit_status = 0  # as by SIGTERM, without a question
    window.close()
    assert file.read_text().endswith(CHANGED)
    assert content.startswith(HEADER)
    window = open_on(path)
    assert view_of(window).recovered is not None
    type_key(window, pygame.K_RETURN)
    assert view_of(window).draft.text == CHANGED
    type_key(window, pygame.K_s, CTRL)
    window.run_frame(0.02)
    assert path.read_text() == CHANGED
    assert names(path.parent) == {"car.toml"}


@pytest.mark.parametrize("is_running", [False, True])
def test_confirmed_loss_removes_the_changes(open_on: Callable[[Path], App], path: Path, is_running: bool) -> None:
    window = open_on(path)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    assert ".car.toml.autosave" in names(path.parent)
    if is_running:
        type_key(window, pygame.K_e, CTRL)
        assert window.editing is None
    type_key(window, pygame.K_ESCAPE)
    assert window.context.exit_status is None
    assert ".car.toml.autosave" in names(path.parent)
    type_key(window, pygame.K_ESCAPE)
    assert window.context.exit_status == 0
    window.close()
    assert names(path.parent) == {"car.toml"}


def test_opening_another_scene_without_a_question_keeps_the_changes(open_on: Callable[[Path], App], path: Path) -> None:
    window = open_on(path)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    window.app_state.open_other(find("tutorial/bounce"))  # as the scene browser does
    assert window.editing is None
    assert "kept" in messages(window)
    window.app_state.open_other(path)
    window.start_editing()
    assert view_of(window).recovered is not None


def test_confirmed_change_of_the_scene_removes_the_changes(open_on: Callable[[Path], App], path: Path) -> None:
    (path.parent / "zebra.toml").write_text(SCENE)
    window = open_on(path)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    type_key(window, pygame.K_e, CTRL)
    type_key(window, pygame.K_RIGHTBRACKET)
    assert ".car.toml.autosave" in names(path.parent)
    type_key(window, pygame.K_RIGHTBRACKET)
    assert window.app_state.path == path.parent / "zebra.toml"
    assert names(path.parent) == {"car.toml", "zebra.toml"}


def test_reload_ends_the_editing_of_the_former_text(open_on: Callable[[Path], App], path: Path) -> None:
    window = open_on(path)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    type_key(window, pygame.K_e, CTRL)
    path.write_text(SCENE.replace("2.0", "3.0"))
    type_key(window, pygame.K_l, CTRL)
    type_key(window, pygame.K_l, CTRL)
    type_key(window, pygame.K_e, CTRL)
    assert view_of(window).draft.text == path.read_text()
    assert names(path.parent) == {"car.toml"}
    type_key(window, pygame.K_e, CTRL)
    path.write_text(SCENE.replace("2.0", "4.0"))  # changed, while nothing is unsaved
    type_key(window, pygame.K_e, CTRL)
    assert view_of(window).draft.text == path.read_text()


def test_changes_are_noted_while_the_panel_is_hidden(open_on: Callable[[Path], App], path: Path) -> None:
    window = open_on(path)
    type_key(window, pygame.K_TAB)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    type_key(window, pygame.K_ESCAPE)
    assert window.context.exit_status is None
    assert "not saved" in (window.app_state.question or "")


def test_failure_is_shown_and_editing_continues(
    open_on: Callable[[Path], App], path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    window = open_on(path)

    def fail(self: Path, _data: bytes) -> int:
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_bytes", fail)
    view_of(window).draft.replace_text(CHANGED, "change")
    window.run_frame(0.02)
    assert "No space left" in messages(window)
    type_key(window, pygame.K_z, CTRL)
    assert view_of(window).draft.text == SCENE


@pytest.mark.parametrize("size", [(900, 600), (160, 120)])
def test_question_is_drawn_at_every_size(open_on: Callable[[Path], App], path: Path, size: tuple[int, int]) -> None:
    file = leave_behind(path, CHANGED)
    os.utime(file, (0, 0))
    path.write_text("# newer\n" + SCENE)
    window = open_on(path)
    window.context.resize(pygame.display.set_mode(size, pygame.RESIZABLE))
    window.run_frame(0.02)
    assert view_of(window).recovered is not None
    assert "has changed since" in view_of(window)._recovery_question(view_of(window).recovered)
