"""Input to the window that nobody means: it is used as far as it makes sense, or told in the window."""

import json
from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.games.high_scores import HighScores, opened
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.ui.high_score_dialog import HighScoreEntry
from tests.window.pressing import key

pytestmark = pytest.mark.full  # property tests with many examples

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
ODD = ["\0", "\x1b[31mred", "a\nb", "\u202eright to left", "👩‍👩‍👧" * 30, "\U0010ffff", "../../x", "/", "x" * 200]


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    """A window that writes into a folder of its own; what it prints is in `window.said`."""
    (tmp_path / "out").mkdir()
    said: list[str] = []
    window = App(AppState(), size=(900, 600), folder=tmp_path / "out", say=said.append)
    window.said = said
    yield window
    window.close()


def room(folder: Path, title: str = "Room", name: str = "a") -> Path:
    path = folder / "room.toml"
    written = ('"' + "".join(f"\\U{ord(letter):08x}" for letter in text) + '"' for text in (title, name))
    path.write_text(ROOM.format(**dict(zip(("title", "name"), written, strict=True))), encoding="utf-8")
    return path


def post(window: App, *events: pygame.event.Event) -> None:
    for event in events:
        pygame.event.post(event)
    window.run_frame(0.02)


def control(window: App, code: int) -> None:
    post(window, key(code, mod=pygame.KMOD_CTRL), pygame.event.Event(pygame.KEYUP, key=code, mod=0, unicode=""))


@pytest.mark.parametrize("text", ODD)
def test_any_title_and_name_are_shown_and_saved_under_a_plain_name(window: App, tmp_path: Path, text: str) -> None:
    name = text if text.isprintable() else "a"
    assert window.app_state.open(room(tmp_path, text, name))
    window.context.gui.overlays |= {"names"}
    control(window, pygame.K_p)
    control(window, pygame.K_s)
    written = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert written == ["sandbox-room-1.json", "sandbox-room-1.png"]
    assert pygame.display.get_caption()[0].isprintable()


@pytest.mark.parametrize("typed", ["x" * 500, "\0\x1b\ud800\u200b", "👩\U0010ffff\u202e", "../../etc", "%s{}\\"])
def test_any_letters_can_be_typed_for_a_scene(window: App, tmp_path: Path, typed: str) -> None:
    window.app_state.open(room(tmp_path))
    control(window, pygame.K_o)
    for letter in typed:
        post(window, pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a, mod=0, unicode=letter))
    assert window.context.gui.scene_browser is not None
    assert len(window.context.gui.scene_browser.typed) <= 60
    assert window.context.gui.scene_browser.typed.isprintable()


@pytest.mark.parametrize("is_file", [False, True], ids=["gone", "a file"])
def test_folder_that_cannot_be_written_is_told(window: App, tmp_path: Path, is_file: bool) -> None:
    window.app_state.open(room(tmp_path))
    (tmp_path / "out").rmdir()
    if is_file:
        (tmp_path / "out").write_text("", encoding="utf-8")
    for code in (pygame.K_p, pygame.K_s, pygame.K_r):
        control(window, code)
        assert "out: cannot be written: " in window.said[-1]
        assert ".tmp" not in window.said[-1]


@pytest.mark.parametrize("notches", [1e9, -1e9, 10_000, -10_000])
def test_wheel_that_spins_wildly_only_zooms(window: App, tmp_path: Path, notches: float) -> None:
    window.app_state.open(room(tmp_path))
    turned = {"x": 0, "y": int(notches), "precise_y": float(notches), "flipped": False}
    post(window, pygame.event.Event(pygame.MOUSEWHEEL, **turned))
    post(window, pygame.event.Event(pygame.MOUSEWHEEL, **turned))
    assert 0.0 < window.context.camera.scale < float("inf")


@pytest.mark.parametrize("what", [pygame.DROPFILE, pygame.DROPTEXT])
@pytest.mark.parametrize("dropped", ["/", "../x", "\0", "x" * 10_000])
def test_what_is_dropped_on_the_window_does_nothing(window: App, tmp_path: Path, what: int, dropped: str) -> None:
    window.app_state.open(room(tmp_path))
    show = window.app_state.view
    post(window, pygame.event.Event(what, file=dropped, text=dropped))
    assert window.app_state.view is show
    assert window.context.exit_status is None


@pytest.mark.parametrize("score", [10**16, -(10**16), 10**4000, 1e300])
def test_high_scores_that_no_game_gives_are_damage(tmp_path: Path, score: float) -> None:
    path = tmp_path / "scores.json"
    path.write_text(json.dumps({"t": [["ABC", score]]}), encoding="utf-8")
    scores = opened(path)
    assert scores.told is not None
    assert scores.of("t") == ()


def test_high_scores_list_ten_however_many_a_file_has(tmp_path: Path) -> None:
    path = tmp_path / "scores.json"
    path.write_text(json.dumps({"t": [["ABC", 1000 - k] for k in range(500)]}), encoding="utf-8")
    assert len(HighScores(path).of("t")) == 10


@pytest.mark.parametrize("typed", ["é\0../👩", "\ud800\n", "xyzzy" * 100])
def test_initials_are_three_plain_letters_whatever_is_typed(tmp_path: Path, typed: str) -> None:
    entry = HighScoreEntry(HighScores(tmp_path / "scores.json"), "t", 12, 1)
    for letter in ("a", *typed):
        entry.type(letter)
    entry.save()
    (row,) = entry.rows()
    assert row.initials.isascii()
    assert 1 <= len(row.initials) <= 3
