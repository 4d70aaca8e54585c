"""Drawing of sensors: translucent areas below the bodies, brighter while they detect something."""

import math

import numpy as np
import pytest

from sandbox.scene.compile.scene import Scene
from tests.window.render.drawn import ball, changed_pixels, colour_at, frame, render, scene, snapshot

EYE = {"name": "eye", "body": "ball-1", "position": [1.0, 0.0], "radius": 0.5, "colour": "#ff0000"}


def pictures(*balls: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return the pictures of a scene of balls with a sensor on the first, and without it."""
    scenes: list[Scene] = [scene(balls=balls, sensor=sensors) for sensors in ([EYE], [])]
    return render(snapshot(scenes[0])), render(snapshot(scenes[1]))


def added_red(shown: tuple[np.ndarray, np.ndarray], x: float, y: float) -> int:
    """Return how much more red a pixel has in the first picture than in the second."""
    return int(colour_at(shown[0], x, y)[0]) - int(colour_at(shown[1], x, y)[0])


def test_sensor_is_brighter_while_it_detects_a_body() -> None:
    """The sensor is at (1, 0) in the frame of a ball at the origin; the other ball is beside or inside it."""
    idle, detecting = (pictures(ball(0.0, 0.0, 0.3), ball(x, 0.0, 0.3)) for x in (-3.0, 1.4))
    assert 5 < added_red(idle, 0.7, 0.0) < added_red(detecting, 0.7, 0.0) - 30
    assert added_red(idle, 1.8, 0.0) == added_red(detecting, 1.8, 0.0) == 0  # outside


@pytest.mark.parametrize("angle", [0.0, 0.5 * math.pi, 2.0])
def test_sensor_turns_with_its_body(angle: float) -> None:
    shown = pictures(ball(0.0, 0.0, 0.3, angle=angle))
    assert added_red(shown, math.cos(angle), math.sin(angle)) > 5
    assert added_red(shown, -math.cos(angle), -math.sin(angle)) == 0


def test_sensor_of_a_body_that_is_gone_or_not_finite_is_not_drawn() -> None:
    balls = [ball(0.0, 0.0, 0.3), ball(3.0, 0.0, 0.3)]
    one, none = (scene(balls=balls, sensor=sensors) for sensors in ([EYE], []))
    for state in (
        frame(one, present=np.asarray([False, True])),
        frame(one, position=np.asarray([[math.nan, 0.0], [3.0, 0.0]])),
    ):
        assert not changed_pixels(*(render(snapshot(each, frame=state)) for each in (one, none))).any()
