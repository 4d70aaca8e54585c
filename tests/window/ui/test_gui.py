"""GUI: cached work that frames do not repeat while nothing changes, checked by the number of calls."""

from pathlib import Path
from typing import Any

import pygame
import pytest

from sandbox.scene.files.shipped_scenes import find
from sandbox.window import app_state
from sandbox.window.playback.parameters import SessionParameters
from sandbox.window.ui import gui
from sandbox.window.ui.panel import SidePanel
from tests.toml_text import toml
from tests.window.pressing import press, release
from tests.window.windowed import open_window, run_frame

pytestmark = pytest.mark.fail_slow(60)  # a window

ROOM = (
    toml("world", gravity=[0.0, -9.8], duration=60.0)
    + toml("ball", name="ball", position=[0.0, 1.0], radius=0.4)
    + toml(
        "emitter", name="spark", position=[1.0, 0.0], count=3, velocity_min=[-1, -1], velocity_max=[1, 1], radius=0.05
    )
    + toml("play", relaunch="spark")
)


def count_calls(monkeypatch: pytest.MonkeyPatch, owner: object, name: str) -> list[str]:
    """Return a list that grows by one item with every call."""
    calls: list[str] = []
    original: Any = getattr(owner, name)

    def counted(*arguments: Any, **named: Any) -> Any:
        calls.append(name)
        return original(*arguments, **named)

    monkeypatch.setattr(owner, name, counted)
    return calls


def test_key_bindings_are_computed_once_per_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = count_calls(monkeypatch, app_state, "key_bindings")
    with open_window(ROOM, tmp_path) as window:
        for _ in range(3):
            run_frame(window, press(100, 100), release(100, 100))
        assert len(calls) == 1
        assert window.app_state.key_bindings.pressed.keys() == {pygame.K_SPACE}


def test_score_panel_layout_is_cached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = count_calls(monkeypatch, gui, "layout_score")
    with open_window(find("duel"), tmp_path, (1280, 720)) as window:
        window.run_frame(0.0)
        calls.clear()
        window.run_frame(0.0)
        assert not calls
        window.context.gui.panel.visible = False  # changes the free width
        window.run_frame(0.0)
        assert len(calls) == 1


def test_parameters_are_queried_only_after_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    queries = count_calls(monkeypatch, SessionParameters, "of")
    shown = count_calls(monkeypatch, SidePanel, "show")
    with open_window(ROOM, tmp_path, (1280, 720)) as window:
        run_frame(window)
        queries.clear()
        shown.clear()
        run_frame(window)
        run_frame(window)
        assert (queries, shown) == ([], [])
        window.app_state.paused = True  # changes a button of the panel
        run_frame(window)
        assert len(shown) == 1
        live = window.app_state.live
        assert live is not None
        window.app_state.set_parameter("gravity", -3.0)
        run_frame(window)
        assert len(queries) == 2
        gravity = next(each for each in window.context.gui.panel.widgets if getattr(each, "parameter", None))
        assert gravity.parameter.value == -3.0  # type: ignore[attr-defined]  # it has a parameter


def test_widget_shows_the_current_value_after_a_refused_change(tmp_path: Path) -> None:
    with open_window(ROOM, tmp_path, (1280, 720)) as window:
        run_frame(window)
        window.context.gui.panel.on_change = lambda *_: None  # as if it were refused
        gravity = next(each for each in window.context.gui.panel.widgets if getattr(each, "parameter", None))
        x, y = gravity.rect.left + window.context.gui.area.width + 5, gravity.rect.centery
        run_frame(window, press(x, y), release(x, y))
        assert gravity.value == gravity.parameter.value  # type: ignore[attr-defined]  # it has a parameter
