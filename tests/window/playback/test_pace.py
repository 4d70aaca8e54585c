"""Clock of the simulation speed, and interpolation between two states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.step_clock import MAX_FRAME_TIME, FixedStepClock, interpolate
from sandbox.trajectory import Frame


def frame(time: float, position: FloatArray, velocity: FloatArray, present: list[bool] | None = None) -> Frame:
    count = len(position)
    mask = np.ones(count, np.bool_) if present is None else np.asarray(present)
    return Frame(time, position, velocity, np.full(count, time), np.zeros(count), mask)


def test_speed_levels_are_tenths_of_a_decade() -> None:
    clock, speeds = FixedStepClock(), []
    for _ in range(11):
        speeds.append(round(100 * clock.speed))
        clock.slower()
    assert speeds == [100, 79, 63, 50, 40, 32, 25, 20, 16, 13, 10]
    for _ in range(99):
        clock.slower()
    assert clock.speed == pytest.approx(0.001, rel=1e-12)  # rounding
    for _ in range(99):
        clock.faster()
    assert clock.speed == pytest.approx(10.0, rel=1e-12)  # rounding
    clock.slower()
    clock.faster()
    assert clock.speed == 10.0


@given(
    frames=st.lists(st.floats(0.0, 0.1), min_size=1, max_size=200),
    dt=st.sampled_from([1e-4, 1e-3, 1 / 120, 1 / 60, 0.01, 0.05, 0.5]),
    level=st.integers(-20, 10),
)
def test_simulated_time_is_real_time_times_the_speed_within_a_step(frames: list[float], dt: float, level: int) -> None:
    clock = FixedStepClock()
    for _ in range(abs(level)):
        (clock.faster if level > 0 else clock.slower)()
    real, steps = 0.0, 0
    for elapsed in frames:
        due = clock.steps_due(elapsed, dt)
        clock.record_steps(elapsed, due, due, dt)
        real, steps = real + elapsed, steps + due
        behind = real * clock.speed - steps * dt
        assert -1e-9 <= behind <= dt * (1.0 + 1e-9) + 1e-9  # sums of up to 200 terms
        assert 0.0 <= clock.alpha(dt) <= 1.0
        assert clock.alpha(dt) == pytest.approx(min(max(behind / dt, 0.0), 1.0), abs=1e-6)  # as above, over dt of 1e-4


@given(elapsed=st.floats(0.0, 1e6), dt=st.floats(1e-6, 10.0))
def test_steps_of_a_frame_are_limited_by_the_maximum_frame_time(elapsed: float, dt: float) -> None:
    due = FixedStepClock().steps_due(elapsed, dt)
    assert due * dt <= MAX_FRAME_TIME * (1.0 + 1e-9)  # rounding of the quotient
    assert due == 0 or (due + 1) * dt >= min(elapsed, MAX_FRAME_TIME) * (1.0 - 1e-9)  # as above


def test_missed_steps_are_dropped_and_lower_the_real_speed() -> None:
    """The machine makes only 2 of 10 steps per frame; the number of due steps must not grow."""
    clock = FixedStepClock()
    for _ in range(100):
        due = clock.steps_due(0.1, 0.01)
        assert due in (9, 10)  # 0.1 / 0.01, after rounding
        clock.record_steps(0.1, 2, due, 0.01)
    assert clock.real_speed == pytest.approx(0.2, rel=1e-12)  # rounding
    assert clock.speed == 1.0


def test_real_speed_is_the_set_speed_until_it_is_measured() -> None:
    clock = FixedStepClock()
    clock.slower()
    assert clock.real_speed == clock.speed
    for _ in range(60):
        due = clock.steps_due(1 / 60, 0.001)
        clock.record_steps(1 / 60, due, due, 0.001)
    assert clock.real_speed == pytest.approx(clock.speed, rel=0.01)  # a step of 1 ms in half a second
    clock.reset()
    assert clock.real_speed == clock.speed
    assert clock.alpha(0.001) == 0.0


def test_scaled_time_is_limited_real_time_times_the_speed() -> None:
    clock = FixedStepClock()
    assert clock.scale_time(0.02) == 0.02
    assert clock.scale_time(9.0) == MAX_FRAME_TIME
    clock.faster()
    assert clock.scale_time(0.02) == 0.02 * clock.speed


@given(fraction=st.floats(0.0, 1.0))
def test_interpolation_is_linear_between_two_states(fraction: float) -> None:
    velocity = np.asarray([[2.0, 0.0]])
    a, b = frame(1.0, np.asarray([[0.0, 1.0]]), velocity), frame(1.5, np.asarray([[1.0, 1.5]]), velocity)
    found = interpolate(a, b, fraction)
    assert found.time == pytest.approx(1.0 + 0.5 * fraction, rel=1e-15)  # one rounding
    assert found.position[0] == pytest.approx([fraction, 1.0 + 0.5 * fraction], abs=1e-15)  # as above
    assert found.angle[0] == pytest.approx(1.0 + 0.5 * fraction, abs=1e-15)  # as above


def test_moved_spawned_and_removed_bodies_are_shown_as_in_the_later_state() -> None:
    start = np.asarray([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    moved = np.asarray([[0.1, 0.0], [9.0, 0.0], [0.1, 0.0], [0.0, 5.0]])
    before = frame(0.0, start, np.full((3, 2), 1.0), [True, True, True])
    after = frame(0.1, moved, np.full((4, 2), 1.0), [True, True, False, True])
    found = interpolate(before, after, 0.5).position
    assert found.tolist() == [[0.05, 0.0], [9.0, 0.0], [0.1, 0.0], [0.0, 5.0]]
    # A body that is missing in the later state is not shown.
    assert interpolate(after, before, 0.5).position.shape == (3, 2)
    assert interpolate(before, after, 1.0) is after
    assert interpolate(after, after, 0.3) is after


def test_interpolation_with_a_non_finite_body_keeps_the_others_finite() -> None:
    finite = np.asarray([[0.0, 0.0], [1.0, 1.0]])
    non_finite = np.asarray([[np.nan, np.inf], [1.1, 1.0]])
    found = interpolate(frame(0.0, finite, finite), frame(0.1, non_finite, non_finite), 0.5)
    assert np.isfinite(found.position[1]).all()
