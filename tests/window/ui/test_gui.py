"""GUI: cached work that frames do not repeat while nothing changes, checked by the number of calls."""

from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

from sandbox.scene.files.shipped_scenes import find
from sandbox.window import app_state
from sandbox.window.playback.parameters import SessionParameters
from sandbox.window.ui import gui, hud
from sandbox.window.ui.panel import SidePanel
from sandbox.window.view_bounds import field_rect
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


def test_film_shows_the_scene_without_panel_state_and_messages(tmp_path: Path) -> None:
    with open_window(ROOM, tmp_path, (800, 600)) as window:
        gui, state = window.context.gui, window.app_state
        window.run_frame(0.0)

        def picture() -> np.ndarray:
            film = gui.film_picture(window.context.camera, state)
            assert film is not None
            assert film.get_size() == gui.area.size
            return pygame.surfarray.array3d(film)

        before = picture()
        state.messages.add("a message", "warning")
        state.question, state.paused = "a question?", True
        window.run_frame(0.0)
        seen = pygame.surfarray.array3d(window.context.surface)[: gui.area.width, : gui.area.height]
        after = picture()
        assert (after == before).all()
        assert (seen != after).any(axis=2).sum() > 500  # the state, the message and the question


@pytest.mark.parametrize("name", ["classic", "full", "landing"])
@pytest.mark.parametrize("size", [(1000, 700), (640, 480)])
def test_start_of_a_game_is_announced_on_its_field_with_its_keys(
    tmp_path: Path, name: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    notices: list[tuple[str, pygame.Rect, str]] = []
    monkeypatch.setattr(
        hud, "draw_notice", lambda surface, text, area, size, edge, detail="": notices.append((text, area, detail))
    )
    with open_window(find(name), tmp_path, size) as window:
        state = window.app_state
        window.run_frame(0.0)
        assert state.waits_for_start
        text, area, keys = notices[-1]
        assert state.view is not None
        assert text == "Press Space to start"
        assert field_rect(state.view.scene, window.context.camera).collidepoint(area.center)
        assert ":" in keys
        assert ("flippers" in keys) == (state.view.scene.play.game == "pinball")
