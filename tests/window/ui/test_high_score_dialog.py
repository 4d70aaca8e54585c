"""High-score dialog: opening, keys, errors, and drawing without file access."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pygame
import pytest

from sandbox.games.high_scores import FILE, HighScores, opened
from sandbox.window.ui import high_score_dialog
from sandbox.window.ui.high_score_dialog import HighScoreDialog

TABLE = "pinball: Test"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SANDBOX_DATA", str(tmp_path))
    monkeypatch.setattr(high_score_dialog, "MIN_DELAY_S", 0.0)
    return tmp_path


@dataclass
class FakeHost:
    """Fake of the part of a host that the dialog uses."""

    game_over: str | None = "game over"
    score: int = 5_000
    touched: bool = True
    rules: Any = field(init=False)
    live: Any = field(init=False)

    def __post_init__(self) -> None:
        self.rules = self
        self.live = SimpleNamespace(scene=SimpleNamespace(title="Test", play=SimpleNamespace(game="pinball")))


def press(dialog: HighScoreDialog, *keys: int | str) -> list[bool]:
    found = []
    for key in keys:
        code, text = (key, "") if isinstance(key, int) else (ord(key.lower()), key)
        found.append(dialog.handle_event(pygame.event.Event(pygame.KEYDOWN, key=code, unicode=text, mod=0)))
    return found


def dialog_at_end(host: FakeHost | None = None) -> HighScoreDialog:
    """Return a dialog after the end of a game."""
    dialog = HighScoreDialog()
    dialog.update(host or FakeHost())
    return dialog


def test_initials_are_entered_at_the_end_of_a_game_and_saved() -> None:
    host, dialog = FakeHost(game_over=None), HighScoreDialog()
    dialog.update(host)
    assert dialog.entry is None
    assert press(dialog, "a") == [False]
    host.game_over = "game over"
    dialog.update(host)
    assert press(dialog, "a", "b", "*", "d", pygame.K_BACKSPACE, "c", "x", pygame.K_RETURN) == [True] * 8
    (best,) = opened().of(TABLE)
    assert (best.initials, best.score) == ("ABC", 5_000)
    assert press(dialog, "r") == [False]  # the list is still shown, but other keys go to the window
    assert press(dialog, pygame.K_RETURN, pygame.K_RETURN) == [True, False]
    dialog.update(host)
    assert dialog.entry is None  # a game is entered only once


def test_enter_without_letters_and_escape_save_no_score() -> None:
    dialog = dialog_at_end()
    assert press(dialog, pygame.K_RETURN) == [True]
    assert dialog.entry is not None
    assert press(dialog, "a", pygame.K_ESCAPE, pygame.K_ESCAPE) == [True, True, False]
    assert opened().of(TABLE) == ()


@pytest.mark.parametrize("host", [FakeHost(score=0), FakeHost(touched=False)], ids=["nothing scored", "a recording"])
def test_dialog_does_not_open_without_points_or_for_a_recording(host: FakeHost) -> None:
    assert dialog_at_end(host).entry is None


def test_dialog_does_not_open_for_the_eleventh_best_score() -> None:
    for k in range(10):
        opened().enter(TABLE, "abc", 6_000 + k)
    assert dialog_at_end().entry is None


def test_initials_are_typed_on_a_layout_without_latin_letters_and_edited_by_ctrl() -> None:
    pygame.display.init()
    pygame.display.set_mode((64, 64))
    dialog = dialog_at_end()
    for letter, code in (("ф", pygame.KSCAN_A), ("и", pygame.KSCAN_B)):
        event = pygame.event.Event(pygame.KEYDOWN, key=ord(letter), unicode=letter, mod=0, scancode=code)
        assert dialog.handle_event(event)
    entry = dialog.entry
    assert entry is not None and entry.letters == "AB"
    for key, letters in (("z", ""), ("y", "AB"), ("a", "AB"), ("x", ""), ("v", "AB"), ("c", "AB"), ("v", "ABA")):
        event = pygame.event.Event(pygame.KEYDOWN, key=ord(key), unicode="", mod=pygame.KMOD_LCTRL)
        assert dialog.handle_event(event)
        assert entry.letters == letters
    assert not dialog.handle_event(
        pygame.event.Event(pygame.KEYDOWN, key=pygame.K_s, unicode="", mod=pygame.KMOD_LCTRL)
    )


def test_new_row_is_shown_at_its_rank() -> None:
    for score in (9_000, 1_000):
        opened().enter(TABLE, "abc", score)
    dialog = dialog_at_end()
    press(dialog, "x")
    entry = dialog.entry
    assert entry is not None
    assert [(each.initials, each.score) for each in entry.rows()] == [("ABC", 9_000), ("X__", 5_000), ("ABC", 1_000)]


def test_dialog_opens_again_after_seeking_back() -> None:
    host = FakeHost()
    dialog = dialog_at_end(host)
    host.game_over = None
    dialog.update(host)
    assert dialog.entry is None
    host.game_over = "again"
    dialog.update(host)
    assert dialog.entry is not None


def test_damaged_file_is_reported(folder: Path) -> None:
    (folder / FILE).write_text("{", encoding="utf-8")
    dialog = HighScoreDialog()
    (note,) = dialog.update(FakeHost())
    assert "damaged" in note
    assert dialog.entry is not None


def test_unwritable_file_is_reported(folder: Path) -> None:
    host = FakeHost()
    dialog = dialog_at_end(host)
    (folder / FILE).mkdir()
    press(dialog, "a", pygame.K_RETURN)
    (note,) = dialog.update(host)
    assert note.startswith("high score not saved: ")
    assert dialog.entry is None


def test_keys_during_the_initial_delay_are_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(high_score_dialog, "MIN_DELAY_S", 60.0)
    dialog = dialog_at_end()
    assert press(dialog, "z", pygame.K_RETURN) == [True, True]
    assert dialog.entry is not None
    assert dialog.entry.letters == ""


def test_list_is_drawn_and_highlights_the_new_row() -> None:
    for k in range(10):
        opened().enter(TABLE, "abc", 1_000 * (k + 1) ** 3)
    dialog, surface = dialog_at_end(), pygame.Surface((800, 600))
    press(dialog, "j", "l")
    dialog.draw(surface, surface.get_rect(), 1.0)
    shown = pygame.surfarray.array3d(surface).astype(int)
    assert (shown.sum(axis=2) > 0).mean() > 0.1
    assert ((shown[..., 1] - shown[..., 0]) > 60).sum() > 100  # the green of the new row


def test_score_file_is_read_on_opening_and_not_on_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    reads = []
    original = HighScores._read
    monkeypatch.setattr(HighScores, "_read", lambda self: reads.append(1) or original(self))
    dialog, surface = dialog_at_end(), pygame.Surface((800, 600))
    assert reads
    for _ in range(2):  # while initials are typed, and while the saved list is shown
        reads.clear()
        for _ in range(5):
            dialog.draw(surface, surface.get_rect(), 1.0)
        assert not reads
        press(dialog, "a", pygame.K_RETURN)


@pytest.mark.parametrize("has_text", [True, False])
def test_all_keys_of_characters_are_consumed_while_initials_are_typed(has_text: bool) -> None:
    """R would start a new game, also where an input method gives no text."""
    for code in (*range(pygame.K_a, pygame.K_z + 1), *range(pygame.K_0, pygame.K_9 + 1), pygame.K_SPACE, 1088):
        dialog = dialog_at_end()
        assert dialog.is_typing
        assert press(dialog, chr(code) if has_text else code) == [True]
    assert press(dialog_at_end(), pygame.K_F1) == [False]


@pytest.mark.parametrize("is_ranked", [True, False])
def test_score_that_the_rules_do_not_rank_opens_no_dialog(is_ranked: bool) -> None:
    host = FakeHost()
    host.is_ranked = is_ranked  # type: ignore[attr-defined]
    assert (dialog_at_end(host).entry is not None) is is_ranked
