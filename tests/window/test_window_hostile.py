"""Malformed and extreme input to the window: it is used as far as possible, or reported in the window."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.window.app import App
from sandbox.window.app_state import AppState
from tests.window.pressing import key

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

ROOM = """
title = {title}
about = {title}
[world]
duration = 5.0
[[wall]]
points = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]]
closed = true
[[ball]]
name = {name}
position = [-1.0, 0.0]
radius = 0.4
"""
HOSTILE_TEXTS = [
    "\0",
    "\x1b[31mred",
    "a\nb",
    "\u202eright to left",
    "👩‍👩‍👧" * 30,
    "\U0010ffff",
    "../../x",
    "/",
    "x" * 200,
]


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    """Return a window that writes into the folder `out`; its printed lines are in `window.printed`."""
    (tmp_path / "out").mkdir()
    printed: list[str] = []
    window = App(AppState(), size=(900, 600), folder=tmp_path / "out", say=printed.append)
    window.printed = printed
    yield window
    window.close()


def write_room(folder: Path, title: str = "Room", name: str = "a") -> Path:
    path = folder / "room.toml"
    literals = ('"' + "".join(f"\\U{ord(letter):08x}" for letter in text) + '"' for text in (title, name))
    path.write_text(ROOM.format(**dict(zip(("title", "name"), literals, strict=True))), encoding="utf-8")
    return path


def post(window: App, *events: pygame.event.Event) -> None:
    for event in events:
        pygame.event.post(event)
    window.run_frame(0.02)


def press_with_ctrl(window: App, code: int) -> None:
    post(window, key(code, mod=pygame.KMOD_CTRL), pygame.event.Event(pygame.KEYUP, key=code, mod=0, unicode=""))


@pytest.mark.parametrize("text", HOSTILE_TEXTS)
def test_any_title_and_name_are_shown_and_saved_under_a_plain_name(window: App, tmp_path: Path, text: str) -> None:
    name = text if text.isprintable() else "a"
    assert window.app_state.open(write_room(tmp_path, text, name))
    window.context.gui.overlays |= {"names"}
    press_with_ctrl(window, pygame.K_p)
    press_with_ctrl(window, pygame.K_s)
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == ["sandbox-room-1.json", "sandbox-room-1.png"]
    assert pygame.display.get_caption()[0].isprintable()


@pytest.mark.parametrize("typed", ["x" * 500, "\0\x1b\ud800\u200b", "👩\U0010ffff\u202e", "../../etc", "%s{}\\"])
def test_any_text_can_be_typed_into_the_picker(window: App, tmp_path: Path, typed: str) -> None:
    window.app_state.open(write_room(tmp_path))
    press_with_ctrl(window, pygame.K_o)
    for letter in typed:
        post(window, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a, mod=0, unicode=letter))
    assert window.context.gui.scene_browser is not None
    assert len(window.context.gui.scene_browser.typed) <= 60
    assert window.context.gui.scene_browser.typed.isprintable()


@pytest.mark.parametrize("is_file", [False, True], ids=["gone", "a file"])
def test_unwritable_folder_is_reported(window: App, tmp_path: Path, is_file: bool) -> None:
    window.app_state.open(write_room(tmp_path))
    (tmp_path / "out").rmdir()
    if is_file:
        (tmp_path / "out").write_text("", encoding="utf-8")
    for code in (pygame.K_p, pygame.K_s, pygame.K_r):
        press_with_ctrl(window, code)
        assert "out: cannot be written: " in window.printed[-1]
        assert ".tmp" not in window.printed[-1]


@pytest.mark.parametrize("notches", [1e9, -1e9, 10_000, -10_000])
def test_extreme_wheel_events_keep_the_scale_finite(window: App, tmp_path: Path, notches: float) -> None:
    window.app_state.open(write_room(tmp_path))
    wheel = {"x": 0, "y": int(notches), "precise_y": float(notches), "flipped": False}
    post(window, pygame.event.Event(pygame.MOUSEWHEEL, **wheel))
    post(window, pygame.event.Event(pygame.MOUSEWHEEL, **wheel))
    assert 0.0 < window.context.camera.scale < float("inf")


@pytest.mark.parametrize("event_type", [pygame.DROPFILE, pygame.DROPTEXT])
@pytest.mark.parametrize("dropped", ["/", "../x", "\0", "x" * 10_000])
def test_dropped_files_and_text_are_ignored(window: App, tmp_path: Path, event_type: int, dropped: str) -> None:
    window.app_state.open(write_room(tmp_path))
    view = window.app_state.view
    post(window, pygame.event.Event(event_type, file=dropped, text=dropped))
    assert window.app_state.view is view
    assert window.context.exit_status is None
