"""Keys of the thrusts and drives of a scene: held, released, and released by a loss of focus."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.action import Drive, Throttle
from sandbox.scene.description.forces import DriveKey, ThrustKey
from sandbox.scene.files.load import from_document
from sandbox.window.app import App
from sandbox.window.input.bindings import KEYS, key_bindings, thrust_and_drive_keys
from sandbox.window.input.body_tools import BodyTools
from sandbox.window.playback.live import LiveView
from tests.toml_text import toml
from tests.window.pressing import FOCUS_LOST, key, key_up
from tests.window.windowed import open_window, run_frame

SHIP = (
    'title = "Ship"\n'
    + toml("world", duration=5.0)
    + toml("solver", dt=0.01)
    + toml("box", name="ship", position=[0.0, 0.0], size=[1.0, 0.5])
    + toml("thrust", name="main", body="ship", force=[0.0, 2.0], key="up")
    + toml("thrust", body="ship", force=[1.0, 0.0], point=[0.0, 0.25], key="right")
)
UP, RIGHT = pygame.K_UP, pygame.K_RIGHT


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(SHIP, tmp_path) as window:
        yield window


def vertical_speed(live: LiveView) -> float:
    return float(live.frame.velocity[0, 1])


def test_thrust_fires_while_its_key_is_held(window: App) -> None:
    assert vertical_speed(run_frame(window)) == 0.0
    live = run_frame(window, key(UP), elapsed=0.1)
    assert vertical_speed(live) == pytest.approx(0.2, abs=0.021)  # 10 steps of 0.02 m/s; timing may add or drop one
    still_held = vertical_speed(run_frame(window, key(UP), elapsed=0.1))  # SDL repeats a held key
    assert still_held == pytest.approx(0.4, abs=0.021)
    live = run_frame(window, key_up(UP), elapsed=0.1)
    assert vertical_speed(live) == pytest.approx(still_held, abs=1e-12)
    acts = [action for action in live.session.recording().actions if isinstance(action, Throttle)]
    assert [(action.thrust, action.level) for action in acts] == [("main", 1.0), ("main", 0.0)]


@pytest.mark.parametrize("hides", [FOCUS_LOST])
def test_thrust_ends_when_the_window_loses_focus(window: App, hides: pygame.event.Event) -> None:
    run_frame(window, key(UP))
    coasting = vertical_speed(run_frame(window, hides))
    assert vertical_speed(run_frame(window, elapsed=0.2)) == pytest.approx(coasting, abs=1e-12)


def test_two_keys_fire_two_thrusts_and_an_eccentric_one_rotates_the_ship(window: App) -> None:
    live = run_frame(window, key(UP), key(RIGHT), elapsed=0.2)
    assert vertical_speed(live) > 0.1
    assert float(live.frame.angular_velocity[0]) < -0.1
    run_frame(window, key_up(UP))
    turning = float(live.frame.angular_velocity[0])
    live = run_frame(window, elapsed=0.1)
    assert float(live.frame.angular_velocity[0]) < turning


def test_help_lists_the_thrust_of_each_key(window: App) -> None:
    assert window.app_state.key_bindings.help_rows == (("Up", "fire main"), ("Right", "fire thrust-2"))


BOX = {"name": "rod", "position": [0.0, 0.0], "size": [1.0, 1.0]}
PLUNGER = {"kind": "plunger", "body": "rod", "direction": [0.0, 1.0], "travel": 1.0, "speed": 1.0}


class RecordingSession:
    """Fake session that records the applied actions."""

    def __init__(self, scene):
        self.scene, self.actions = scene, []

    def apply(self, action):
        self.actions.append(action)


def test_every_key_of_the_scene_format_is_a_key_of_the_window():
    assert {*DriveKey.__args__} == {*KEYS} >= {*ThrustKey.__args__}


@pytest.mark.parametrize("key", KEYS)
def test_held_key_sets_level_1(key):
    scene = from_document({"box": [BOX], "drive": [{**PLUNGER, "key": key}]})
    live = RecordingSession(scene)
    bindings = key_bindings(live, BodyTools())
    bindings.pressed[KEYS[key]]()
    bindings.released[KEYS[key]]()
    assert live.actions == [Drive(time=0.0, drive="drive-1", level=level) for level in (1.0, 0.0)]
    assert KEYS[key] not in bindings.repeated  # a key that repeats is still held
    assert bindings.help_rows == ((key.capitalize(), "drive drive-1"),)


def test_thrust_and_drive_with_the_same_key_both_act():
    ship = {"name": "ship", "position": [5.0, 0.0], "size": [1.0, 1.0]}
    thrust = {"name": "main", "body": "ship", "force": [1.0, 0.0], "key": "up"}
    scene = from_document({"box": [BOX, ship], "thrust": [thrust], "drive": [{**PLUNGER, "key": "up"}]})
    live = RecordingSession(scene)
    key_bindings(live, BodyTools()).pressed[pygame.K_UP]()
    assert [type(action) for action in live.actions] == [Throttle, Drive]
    assert len([*thrust_and_drive_keys(scene)]) == 2
