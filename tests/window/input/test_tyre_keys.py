"""Keys of tyres: throttle, steering and brake while they are held."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Steer
from sandbox.scene.files.load import from_document
from sandbox.window.app import App
from sandbox.window.playback.live import LiveView
from tests.toml_text import toml
from tests.window.pressing import FOCUS_LOST, key, key_up
from tests.window.render.drawn import changed_pixels, render, snapshot
from tests.window.windowed import open_window, run_frame

CAR = (
    'title = "Car"\n'
    + toml("world", duration=5.0)
    + toml("solver", dt=0.01)
    + toml("box", name="car", position=[0.0, 0.0], size=[2.0, 1.0], mass=1.0)
    + toml("tyre", name="front", body="car", point=[0.8, 0.0], grip=50.0, steer=0.4, keys=True)
    + toml("tyre", body="car", point=[-0.8, 0.0], grip=50.0, drive=4.0, brake=50.0, keys=True)
    + toml("tyre", name="castor", body="car", point=[0.0, 0.0], grip=1e-9)
)
UP, DOWN, LEFT, RIGHT, SPACE = pygame.K_UP, pygame.K_DOWN, pygame.K_LEFT, pygame.K_RIGHT, pygame.K_SPACE


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(CAR, tmp_path) as window:
        yield window


def drive(window: App, *events: pygame.event.Event, tenths: int) -> LiveView:
    """Return the view after some events and tenths of a second, the longest frame."""
    run_frame(window, *events, elapsed=0.0)
    for _ in range(tenths):
        live = run_frame(window, elapsed=0.1)
    return live


def test_up_drives_left_steers_and_space_brakes(window: App) -> None:
    live = drive(window, key(UP), tenths=5)
    assert float(live.frame.velocity[0, 0]) == pytest.approx(2.0, abs=0.05)  # 4 m/s²; timing may add or drop a step
    live = drive(window, key_up(UP), key(LEFT), tenths=2)
    assert float(live.frame.angular_velocity[0]) > 0.3
    live = drive(window, key_up(LEFT), key(RIGHT), tenths=2)
    assert float(live.frame.angular_velocity[0]) < -0.3
    live = drive(window, key_up(RIGHT), key(SPACE), tenths=3)
    assert np.abs(live.frame.velocity).max() < 1e-9  # at rest, to rounding
    live = drive(window, key_up(SPACE), key(DOWN), tenths=2)
    assert np.hypot(*live.frame.velocity[0]) == pytest.approx(0.8, abs=0.05)  # backwards; timing, as above


def test_keys_held_together_are_one_input_for_each_tyre_with_keys(window: App) -> None:
    live = run_frame(window, key(UP), key(LEFT), elapsed=0.05)
    assert {
        name: (each.throttle, each.brake, each.steer) for name, each in live.session.simulation.steering.items()
    } == {
        "front": (1.0, 0.0, 1.0),
        "tyre-2": (1.0, 0.0, 1.0),
    }
    live = run_frame(window, key(DOWN), elapsed=0.05)
    assert live.session.simulation.steering["front"].throttle == 0.0
    live = run_frame(window, FOCUS_LOST, elapsed=0.05)
    front = live.session.simulation.steering["front"]
    assert (front.throttle, front.brake, front.steer) == (0.0, 0.0, 0.0)
    assert any(isinstance(action, Steer) for action in live.session.recording().actions)


def test_help_lists_the_keys_and_the_car_is_followed(window: App) -> None:
    assert window.app_state.key_bindings.help_rows == (("Arrows", "drive and steer car"), ("Space", "brake car"))
    assert window.context.following == 0


BOX = {"name": "car", "position": [0.0, 0.0], "size": [2.0, 1.0]}
TYRE = {"name": "front", "body": "car", "point": [0.8, 0.0], "grip": 5.0, "steer": 0.8}


def test_tyre_is_drawn_where_it_is_and_turns_with_its_steering() -> None:
    bare, with_tyre = from_document({"box": [BOX]}), from_document({"box": [BOX], "tyre": [TYRE]})
    drawn = changed_pixels(render(snapshot(bare)), render(snapshot(with_tyre)))
    assert drawn.any()
    steered = render(snapshot(with_tyre, steering={"front": 1.0}))
    assert changed_pixels(render(snapshot(with_tyre)), steered).any()


def test_ground_friction_of_a_crate_is_not_drawn_as_a_tyre() -> None:
    bare = from_document({"box": [BOX]})
    sliding = from_document({"box": [BOX], "tyre": [{**TYRE, "rolling_drag": 5.0}]})
    assert not changed_pixels(render(snapshot(bare)), render(snapshot(sliding))).any()
