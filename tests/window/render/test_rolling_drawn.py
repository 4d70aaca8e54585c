"""How balls are seen to turn: by their spins alone."""

import math

import numpy as np
import pytest

from sandbox.games.billiards.view.balls import BallOrientations
from sandbox.trajectory import Frame

RADIUS = 0.03
"""m"""


def frame(time: float, spin: tuple[float, float, float]) -> Frame:
    zero = np.zeros((1, 2))
    return Frame(time, zero, zero.copy(), np.zeros(1), np.array([spin[2]]), np.ones(1, np.bool_), np.array([spin[:2]]))


def turned(spin: tuple[float, float, float], seconds: float, pictures: int) -> np.ndarray:
    """Return the rotation that a ball has made, (3, 3)."""
    rolling = BallOrientations()
    rolling.advance(frame(0.0, spin))
    before = rolling.turned[0].copy()
    for k in range(1, pictures + 1):
        rolling.advance(frame(seconds * k / pictures, spin))
    return rolling.turned[0] @ before.T


def test_rolling_one_circumference_turns_a_ball_once() -> None:
    speed = 0.5
    seconds = 2.0 * math.pi * RADIUS / speed
    spin = (0.0, speed / RADIUS, 0.0)  # natural roll along +x
    # 60 rotations of 1e-16 each
    assert turned(spin, seconds, 60) == pytest.approx(np.eye(3), abs=1e-12)


def test_what_is_on_top_goes_forwards() -> None:
    top = turned((0.0, 10.0, 0.0), 0.01, 1) @ np.array([0.0, 0.0, 1.0])
    assert top[0] == pytest.approx(math.sin(0.1), abs=1e-12)  # rounding


def test_side_spin_turns_about_the_vertical() -> None:
    east = turned((0.0, 0.0, 2.0), 0.5, 3) @ np.array([1.0, 0.0, 0.0])
    assert east == pytest.approx([math.cos(1.0), math.sin(1.0), 0.0], abs=1e-12)  # rounding


def test_long_rolling_leaves_a_rotation() -> None:
    rotation = turned((300.0, -170.0, 40.0), 20.0, 2000)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)  # squared up at every picture
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)


def test_time_that_stands_or_runs_backwards_turns_nothing() -> None:
    rolling = BallOrientations()
    rolling.advance(frame(1.0, (1.0, 2.0, 3.0)))
    before, version = rolling.turned.copy(), rolling.version.copy()
    rolling.advance(frame(1.0, (1.0, 2.0, 3.0)))
    rolling.advance(frame(0.2, (1.0, 2.0, 3.0)))
    assert (rolling.turned == before).all()
    assert (rolling.version == version).all()
