"""Plates (text boxes) of the window: none overlap in any shipped scene at any size, and most of the window is free."""

import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from itertools import combinations
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.render.text import largest_area
from sandbox.window.ui import score_panel
from sandbox.window.view_bounds import field_rect, view_bounds
from tests.samples import each_shipped_scene
from tests.window.windowed import open_window

pytestmark = pytest.mark.fail_slow(60)  # every shipped scene

SIZES = [(400, 300, 1.0), (800, 600, 1.0), (1024, 700, 1.0), (1280, 720, 1.0), (1920, 1080, 1.0), (1280, 720, 2.0)]
"""Width and height, px, and the scale of text and widgets."""
FIELD_SCENES = [
    each
    for each in each_shipped_scene()
    if (play := load(each.values[0]).play).view is not None or play.area is not None or play.game is not None
]
"""Tables and games: their files state the view, the area or the game."""


def overlaps(window: App) -> list[str]:
    """Return the pairs of plates that overlap."""
    plates = window.context.gui.plates.items()
    return [f"{a}{p} {b}{q}" for (a, p), (b, q) in combinations(plates, 2) if p.colliderect(q)]


OpenScene = Callable[[str], App]


@pytest.fixture
def open_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[OpenScene]:
    """Return a function that opens a window on a shipped scene."""
    # The layout does not depend on the trajectories, so predicting them is skipped.
    monkeypatch.setattr("sandbox.window.app_state.predict_bounds", lambda *_: None)
    with ExitStack() as windows:
        yield lambda name: windows.enter_context(open_window(find(name), tmp_path, (1280, 720)))


def resize(window: App, width: int, height: int, ui_scale: float) -> None:
    window.context.gui.ui_scale = ui_scale
    surface = pygame.display.set_mode((width, height), pygame.RESIZABLE)
    pygame.event.clear()
    window.context.resize(surface)
    window.run_frame(0.0)
    pygame.event.clear()


@pytest.mark.parametrize("name", each_shipped_scene())
def test_no_two_plates_overlap(name: str, open_scene: OpenScene) -> None:
    window = open_scene(name)
    window.run_frame(0.0)
    window.app_state.paused = True  # show every plate at once from here on
    window.context.gui.overlays = set(OVERLAYS)
    window.app_state.body_tools.picked = 0
    window.app_state.messages.add("a message that is long enough to need more than one line of a small window")
    window.app_state.messages.add("another one", "warning")
    for width, height, ui_scale in SIZES:
        resize(window, width, height, ui_scale)
        assert overlaps(window) == [], (width, height, ui_scale)
        free = window.context.gui.area
        assert 2 * free.width * free.height > width * height, (width, height, ui_scale)


@pytest.mark.parametrize("name", [each for each in FIELD_SCENES if each.values[0].startswith("pinball")])
def test_messages_leave_the_field_free_beside_it(name: str, open_scene: OpenScene) -> None:
    window = open_scene(name)
    resize(window, 900, 600, 1.0)
    window.app_state.messages.add("a message that is long enough to need more than one line beside the table")
    window.run_frame(0.0)
    gui, view = window.context.gui, window.app_state.view
    assert view is not None
    field = field_rect(view.scene, window.context.camera)
    messages = [rect for plate, rect in gui.plates.items() if plate.startswith("message")]
    assert messages
    assert field.collidelist(messages) == -1


@pytest.mark.parametrize("name", FIELD_SCENES)
def test_plates_leave_the_field_free(name: str, open_scene: OpenScene) -> None:
    """The field of tables and games is the view that their files state."""
    window = open_scene(name)
    scene = window.app_state.view.scene if window.app_state.view is not None else None
    assert scene is not None
    for width, height, ui_scale in SIZES[1:]:  # 400 × 300 is too small for both
        resize(window, width, height, ui_scale)
        corners = window.context.camera.to_screen(np.asarray(view_bounds(scene)))
        (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        field = pygame.Rect(math.ceil(left), math.ceil(top), int(right - left), int(bottom - top))
        covering = {
            k: r for k, r in window.context.gui.plates.items() if not k.startswith(("message", "rate", "inset"))
        }
        assert [k for k, rect in covering.items() if rect.colliderect(field)] == [], (width, height, ui_scale)
        assert field.width * field.height > 0.08 * width * height  # the field is not reduced to a corner either


def test_last_shot_is_shown_in_full_beside_four_tanks(open_scene: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    window = open_scene("four")
    message = "at 172.07 m, exactly 171.94 m: off by 148 mm"
    lines = ArtilleryRules.display_lines
    monkeypatch.setattr(ArtilleryRules, "display_lines", lambda self: [*lines(self), ("last shot", message)])
    resize(window, 1024, 700, 1.0)
    assert window.app_state.host is not None
    assert window.app_state.view is not None
    panel = score_panel.layout_score(window.app_state.host.shown().board, window.context.gui.area, 300, 1.0)
    texts = [text for cells, _ in panel.rows for _, text in cells]
    assert message in texts
    assert len(panel.rows) <= 4


def test_score_that_rules_state_again_is_shown_once(open_scene: OpenScene, monkeypatch: pytest.MonkeyPatch) -> None:
    window = open_scene("four")
    lines = ArtilleryRules.display_lines
    monkeypatch.setattr(ArtilleryRules, "display_lines", lambda self: [("Score", "7"), *lines(self)])
    assert window.app_state.host is not None
    panel = score_panel.layout_score(window.app_state.host.shown().board, window.context.gui.area, 300, 1.0)
    labels = [label.lower() for cells, _ in panel.rows for label, _ in cells]
    assert labels.count("score") == 1


def test_largest_area_avoids_the_occupied_rectangles() -> None:
    free = pygame.Rect(0, 0, 100, 80)
    assert largest_area((1, 1), free, []) == free
    assert largest_area((1, 1), free, [pygame.Rect(0, 0, 30, 20)]) == pygame.Rect(30, 0, 70, 80)
    assert largest_area((2, 1), free, [pygame.Rect(0, 0, 30, 20)]) == pygame.Rect(0, 20, 100, 60)
    assert largest_area((1, 1), free, [free]) == free  # nothing is left: the occupied rectangles are ignored
