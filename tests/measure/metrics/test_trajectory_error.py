"""Trajectory errors, measured on runs with known offsets."""

import numpy as np
import pytest

from sandbox.measure.metrics.trajectory_error import common_frames, errors
from tests.runs_by_hand import run_of, scene_of

SCENE = scene_of()
MOVING = ~SCENE.bodies.fixed


def test_known_offset_is_the_error() -> None:
    truth = run_of(SCENE)
    position, velocity = truth.position.copy(), truth.velocity.copy()
    position[:, 0] += (3.0, 4.0)  # 5 m away; the other ball has no error
    velocity[:, 1, 0] += 2.0
    found = errors(run_of(SCENE, position, velocity=velocity), truth, MOVING)
    assert found.largest("position", 2.0) == pytest.approx(5.0, rel=1e-15)  # one rounding of hypot
    # a sum of 21 equal squares
    assert found.root_mean_square("position", 2.0) == pytest.approx(5.0 / np.sqrt(2.0), rel=1e-14)
    assert found.largest("velocity", 2.0) == 2.0
    assert found.root_mean_square("velocity", 2.0) == pytest.approx(np.sqrt(2.0), rel=1e-14)  # likewise
    assert found.largest("angle", 2.0) == 0.0
    assert found.position.tolist() == [5.0] * 21


def test_only_frames_up_to_the_given_time_count() -> None:
    truth = run_of(SCENE)
    position = truth.position.copy()
    position[:, 0, 1] += np.arange(21) * 0.25
    found = errors(run_of(SCENE, position), truth, MOVING)
    assert found.largest("position", 1.0) == 2.5
    assert found.largest("position", 2.0) == 5.0
    assert found.first_above(0.6, 2.0) == truth.time[3]
    assert found.first_above(0.75, 2.0) == truth.time[4]  # exactly the tolerance is not above it
    assert found.first_above(0.6, 0.2) is None


def test_fixed_bodies_do_not_count() -> None:
    truth = run_of(SCENE)
    position = truth.position.copy()
    position[:, 2] += 100.0
    assert errors(run_of(SCENE, position), truth, MOVING).largest("position", 2.0) == 0.0


def test_retired_bodies_count_only_while_present_in_both_runs() -> None:
    truth = run_of(SCENE, retired=np.array([1.0, np.nan, np.nan]))
    position = truth.position.copy()
    position[truth.time >= 1.0, 0] = np.nan
    position[:, 1, 0] += 0.5
    found = errors(run_of(SCENE, position), truth, MOVING)
    assert found.position.tolist() == [0.5] * 21
    assert found.count.tolist() == [2.0] * 10 + [1.0] * 11


def test_nan_position_has_infinite_error() -> None:
    truth = run_of(SCENE)
    position = truth.position.copy()
    position[5:, 0] = np.nan
    found = errors(run_of(SCENE, position), truth, MOVING)
    assert found.largest("position", 2.0) == np.inf
    assert found.first_above(1.0, 2.0) == truth.time[5]


def test_common_frames_of_different_steps_are_those_of_equal_time() -> None:
    truth, fine = run_of(SCENE), run_of(SCENE, time=np.append(np.arange(40) * 0.05, 2.0))
    mine, its = common_frames(fine, truth)
    assert mine.tolist() == list(range(0, 41, 2))
    assert its.tolist() == list(range(21))
    mine, its = common_frames(run_of(SCENE, time=np.arange(7) * 0.3), truth)
    assert its.tolist() == list(range(0, 19, 3))
    for shift, count in ((9e-8, 21), (-9e-8, 21), (1.1e-7, 0)):  # a millionth of the interval is 1e-7 s
        _, its = common_frames(run_of(SCENE, time=truth.time + shift), truth)
        assert its.tolist() == list(range(count))


def test_run_without_frames_has_no_score() -> None:
    empty = run_of(SCENE, position=np.empty((0, 3, 2)), time=np.empty(0))
    found = errors(empty, run_of(SCENE), MOVING)
    assert (found.largest("position", 2.0), found.root_mean_square("position", 2.0)) == (None, None)


def test_scene_without_moving_bodies_has_no_score() -> None:
    found = errors(run_of(SCENE), run_of(SCENE), np.zeros(3, dtype=bool))
    assert (found.largest("angle", 2.0), found.root_mean_square("angle", 2.0)) == (None, None)
