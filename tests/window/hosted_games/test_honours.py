"""Honours: who is asked for initials, when, and what comes of the keys."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pygame
import pytest

from sandbox.games.high_scores import FILE, opened
from sandbox.window.ui import high_score_dialog as honours_panel
from sandbox.window.ui.high_score_dialog import HighScoreView

TABLE = "pinball: Test"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SANDBOX_DATA", str(tmp_path))
    monkeypatch.setattr(honours_panel, "DEAF", 0.0)
    return tmp_path


@dataclass
class Hosted:
    """What honours need of a host."""

    over: str | None = "game over"
    score: int = 5_000
    touched: bool = True
    rules: Any = field(init=False)
    live: Any = field(init=False)

    def __post_init__(self) -> None:
        self.rules = self
        self.live = SimpleNamespace(scene=SimpleNamespace(title="Test", play=SimpleNamespace(game="pinball")))


def press(panel: HighScoreView, *keys: int | str) -> list[bool]:
    found = []
    for key in keys:
        code, text = (key, "") if isinstance(key, int) else (ord(key.lower()), key)
        found.append(panel.handle(pygame.event.Event(pygame.KEYDOWN, key=code, unicode=text, mod=0)))
    return found


def ended(host: Hosted | None = None) -> HighScoreView:
    """A panel that has just seen a game end."""
    panel = HighScoreView()
    panel.watch(host or Hosted())
    return panel


def test_initials_are_asked_for_at_the_end_and_kept() -> None:
    host, panel = Hosted(over=None), HighScoreView()
    panel.watch(host)
    assert panel.honours.entering is None
    assert press(panel, "a") == [False]
    host.over = "game over"
    panel.watch(host)
    assert press(panel, "a", "b", "*", "d", pygame.K_BACKSPACE, "c", "x", pygame.K_RETURN) == [True] * 8
    (best,) = opened().of(TABLE)
    assert (best.initials, best.score) == ("ABC", 5_000)
    assert press(panel, "r") == [False]  # the list still shows, but keys are the window's again
    assert press(panel, pygame.K_RETURN, pygame.K_RETURN) == [True, False]
    panel.watch(host)
    assert panel.honours.entering is None  # one game is entered once


def test_enter_without_letters_keeps_nothing() -> None:
    panel = ended()
    assert press(panel, pygame.K_RETURN) == [True]
    assert opened().of(TABLE) == ()
    assert panel.honours.entering is not None


def test_escape_keeps_nothing() -> None:
    panel = ended()
    assert press(panel, "a", pygame.K_ESCAPE, pygame.K_ESCAPE) == [True, True, False]
    assert opened().of(TABLE) == ()


@pytest.mark.parametrize("host", [Hosted(score=0), Hosted(touched=False)], ids=["nothing scored", "a recording"])
def test_who_has_not_earned_it_is_not_asked(host: Hosted) -> None:
    assert ended(host).honours.entering is None


def test_eleventh_is_not_asked() -> None:
    for k in range(10):
        opened().enter(TABLE, "abc", 6_000 + k)
    assert ended().honours.entering is None


def test_own_row_shows_where_it_will_stand() -> None:
    for score in (9_000, 1_000):
        opened().enter(TABLE, "abc", score)
    panel = ended()
    press(panel, "x")
    entering = panel.honours.entering
    assert entering is not None
    assert [(each.initials, each.score) for each in entering.rows()] == [("ABC", 9_000), ("X__", 5_000), ("ABC", 1_000)]


def test_going_back_asks_anew() -> None:
    host = Hosted()
    panel = ended(host)
    host.over = None
    panel.watch(host)
    assert panel.honours.entering is None
    host.over = "again"
    panel.watch(host)
    assert panel.honours.entering is not None


def test_damage_is_told(folder: Path) -> None:
    (folder / FILE).write_text("{", encoding="utf-8")
    panel = HighScoreView()
    (note,) = panel.watch(Hosted())
    assert "damaged" in note
    assert panel.honours.entering is not None


def test_file_that_cannot_be_written_is_told(folder: Path) -> None:
    host = Hosted()
    panel = ended(host)
    (folder / FILE).mkdir()
    press(panel, "a", pygame.K_RETURN)
    (note,) = panel.watch(host)
    assert note.startswith("no high scores: ")
    assert panel.honours.entering is None


def test_hands_that_still_play_type_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(honours_panel, "DEAF", 60.0)
    panel = ended()
    assert press(panel, "z", pygame.K_RETURN) == [True, True]
    assert panel.honours.entering is not None
    assert panel.honours.entering.letters == ""


def test_list_is_drawn_and_marks_its_own_row() -> None:
    for k in range(10):
        opened().enter(TABLE, "abc", 1_000 * (k + 1) ** 3)
    panel, surface = ended(), pygame.Surface((800, 600))
    press(panel, "j", "l")
    panel.draw(surface, surface.get_rect(), 1.0)
    shown = pygame.surfarray.array3d(surface).astype(int)
    assert (shown.sum(axis=2) > 0).mean() > 0.1
    assert ((shown[..., 1] - shown[..., 0]) > 60).sum() > 100  # the green of the own row
