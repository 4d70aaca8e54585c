"""Keys that fire a scene's thrusts: held, let go, and let go by what hides the release."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.action import Throttle
from sandbox.window.app import App
from sandbox.window.playback.live import LiveView
from tests.window.pressing import FOCUS_LOST, key, key_up
from tests.window.windowed import turned, window_on

SHIP = """
title = "Ship"
[world]
duration = 5.0
[solver]
dt = 0.01
[[box]]
name = "ship"
position = [0.0, 0.0]
size = [1.0, 0.5]
[[thrust]]
name = "main"
body = "ship"
force = [0.0, 2.0]
key = "up"
[[thrust]]
body = "ship"
force = [1.0, 0.0]
point = [0.0, 0.25]
key = "right"
"""
UP, RIGHT = pygame.K_UP, pygame.K_RIGHT


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with window_on(SHIP, tmp_path) as opened:
        yield opened


def rising(live: LiveView) -> float:
    return float(live.frame.velocity[0, 1])


def test_thrust_fires_while_its_key_is_held(window: App) -> None:
    assert rising(turned(window)) == 0.0
    live = turned(window, key(UP), elapsed=0.1)
    assert rising(live) == pytest.approx(0.2, abs=0.021)  # 10 steps of 0.02, one more or less by the pace
    still_held = rising(turned(window, key(UP), elapsed=0.1))  # SDL repeats a held key
    assert still_held == pytest.approx(0.4, abs=0.021)
    live = turned(window, key_up(UP), elapsed=0.1)
    assert rising(live) == pytest.approx(still_held, abs=1e-12)
    acts = [action for action in live.session.recording().actions if isinstance(action, Throttle)]
    assert [(action.thrust, action.level) for action in acts] == [("main", 1.0), ("main", 0.0)]


@pytest.mark.parametrize("hides", [FOCUS_LOST])
def test_thrust_ends_where_the_release_would_go_elsewhere(window: App, hides: pygame.event.Event) -> None:
    turned(window, key(UP))
    coasting = rising(turned(window, hides))
    assert rising(turned(window, elapsed=0.2)) == pytest.approx(coasting, abs=1e-12)


def test_two_keys_fire_two_thrusts_and_one_of_them_turns_the_ship(window: App) -> None:
    live = turned(window, key(UP), key(RIGHT), elapsed=0.2)
    assert rising(live) > 0.1
    assert float(live.frame.angular_velocity[0]) < -0.1
    turned(window, key_up(UP))
    turning = float(live.frame.angular_velocity[0])
    live = turned(window, elapsed=0.1)
    assert float(live.frame.angular_velocity[0]) < turning


def test_keys_are_told_as_what_they_fire(window: App) -> None:
    assert window.app_state.key_bindings.help_rows == (("Up", "fire main"), ("Right", "fire thrust-2"))
