"""Orientations of rolling balls, integrated from their spins."""

import math

import numpy as np
import pytest

from sandbox.games.billiards.view.balls import BallOrientations
from sandbox.trajectory import Frame

RADIUS = 0.03
"""Radius of a ball, m."""


def frame(time: float, spin: tuple[float, float, float]) -> Frame:
    zero = np.zeros((1, 2))
    return Frame(time, zero, zero.copy(), np.zeros(1), np.array([spin[2]]), np.ones(1, np.bool_), np.array([spin[:2]]))


def rotation_of(spin: tuple[float, float, float], seconds: float, frames: int) -> np.ndarray:
    """Return the rotation of a ball during some seconds, (3, 3)."""
    rolling = BallOrientations()
    rolling.advance(frame(0.0, spin))
    before = rolling.turned[0].copy()
    for k in range(1, frames + 1):
        rolling.advance(frame(seconds * k / frames, spin))
    return rolling.turned[0] @ before.T


def test_rolling_one_circumference_rotates_a_ball_once() -> None:
    speed = 0.5
    seconds = 2.0 * math.pi * RADIUS / speed
    spin = (0.0, speed / RADIUS, 0.0)  # natural roll along +x
    # 60 rotations of 1e-16 each
    assert rotation_of(spin, seconds, 60) == pytest.approx(np.eye(3), abs=1e-12)


def test_top_of_a_rolling_ball_moves_forwards() -> None:
    top = rotation_of((0.0, 10.0, 0.0), 0.01, 1) @ np.array([0.0, 0.0, 1.0])
    assert top[0] == pytest.approx(math.sin(0.1), abs=1e-12)  # rounding


def test_side_spin_rotates_about_the_vertical() -> None:
    east = rotation_of((0.0, 0.0, 2.0), 0.5, 3) @ np.array([1.0, 0.0, 0.0])
    assert east == pytest.approx([math.cos(1.0), math.sin(1.0), 0.0], abs=1e-12)  # rounding


def test_orientation_stays_orthogonal_over_long_rolling() -> None:
    rotation = rotation_of((300.0, -170.0, 40.0), 20.0, 2000)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)  # orthonormalised at every frame
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)


def test_time_that_stops_or_runs_backwards_keeps_the_orientation() -> None:
    rolling = BallOrientations()
    rolling.advance(frame(1.0, (1.0, 2.0, 3.0)))
    before, version = rolling.turned.copy(), rolling.version.copy()
    rolling.advance(frame(1.0, (1.0, 2.0, 3.0)))
    rolling.advance(frame(0.2, (1.0, 2.0, 3.0)))
    assert (rolling.turned == before).all()
    assert (rolling.version == version).all()
