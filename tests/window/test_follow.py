"""Following camera: the followed bodies stay in the picture, in whichever direction they move."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.camera import Camera
from tests.toml_text import toml
from tests.window.pressing import key, key_up, press, release
from tests.window.windowed import open_window, run_frame

pytestmark = pytest.mark.fail_slow(60)  # every shipped scene

LEAVING = (
    'title = "Leaving"\n'
    + toml("world", gravity=[0.0, -10.0], duration=1.0)
    + toml("play", speed=1.0)
    + toml("solver", dt=0.01)
    + toml("ball", name="a", position=[0.0, 0.0], velocity=[5.0, 5.0], radius=0.2, collides="none")
    + toml("ball", name="b", position=[1.0, 0.0], velocity=[-5.0, 0.0], radius=0.2, collides="none")
)
F, HOME = pygame.K_f, pygame.K_HOME


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(LEAVING, tmp_path) as window:
        pygame.event.clear()  # events of opening the window
        yield window


def visible(window: App) -> list[bool]:
    """Return which bodies are in the uncovered part of the picture."""
    assert window.app_state.view is not None
    free = window.context.gui.area
    return [
        free.collidepoint(point)
        for point in window.context.camera.to_screen(window.app_state.view.displayed_frame.position).tolist()
    ]


def tap(window: App, code: int) -> None:
    run_frame(window, key(code), key_up(code), elapsed=0.0)


@pytest.mark.parametrize("elapsed", [0.01, 0.1])
def test_all_moving_bodies_stay_in_the_picture(window: App, elapsed: float) -> None:
    tap(window, F)
    for _ in range(round(4.0 / elapsed)):  # the bodies are 40 m apart at the end, and have fallen 80 m
        run_frame(window, elapsed=elapsed)
        assert all(visible(window))


def test_picked_body_stays_in_the_picture_at_the_same_scale(window: App) -> None:
    x, y = window.context.camera.to_screen(np.zeros(2)).tolist()
    run_frame(window, press(x, y), release(x, y), elapsed=0.0)
    tap(window, F)
    scale = window.context.camera.scale
    for _ in range(40):
        run_frame(window, elapsed=0.1)
        assert visible(window)[0]
    assert window.context.camera.scale == scale
    assert not visible(window)[1]
    tap(window, HOME)
    assert window.context.following is None
    assert window.context.is_fitted


def test_message_is_shown_while_no_body_is_in_view(window: App) -> None:
    home = window.context.camera
    for _ in range(40):
        run_frame(window, elapsed=0.1)
    assert window.context.camera == home
    assert window.context.is_out_of_view
    text = window.context.gui.describe_out_of_view(window.app_state)
    assert text is not None
    assert "Home" in text
    tap(window, HOME)
    assert not window.context.is_out_of_view
    assert window.context.gui.describe_out_of_view(window.app_state) is None


def test_out_of_view_message_of_fireworks_names_the_relaunch_key(tmp_path: Path) -> None:
    with open_window(find("fireworks"), tmp_path) as window:
        window.context.camera = Camera((1e6, 0.0), 10.0, (640, 480))
        window.context.is_fitted = False
        window.run_frame(0.0)
        assert "Space relaunches" in str(window.context.gui.describe_out_of_view(window.app_state))


def test_body_driven_by_keys_is_followed_from_the_start(tmp_path: Path) -> None:
    with open_window(find("spaceship"), tmp_path) as window:
        pygame.event.clear()
        scene = window.app_state.file
        assert scene is not None
        ship = scene.bodies.names.index(scene.thrusts[0].body)
        assert window.context.following == ship
        run_frame(window, key(pygame.K_UP), elapsed=0.0)
        for _ in range(60):
            run_frame(window, elapsed=0.1)
            assert visible(window)[ship]


def test_f11_toggles_full_screen_and_restores_the_size(window: App) -> None:
    run_frame(window, elapsed=0.0)
    size = window.context.surface.get_size()
    tap(window, pygame.K_F11)
    assert window.context.surface.get_flags() & pygame.FULLSCREEN
    tap(window, pygame.K_F11)
    assert not window.context.surface.get_flags() & pygame.FULLSCREEN
    assert window.context.surface.get_size() == size
    assert window.context.camera.size == size
