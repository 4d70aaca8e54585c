"""Pace, and the pictures between two states."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.trajectory import Frame
from sandbox.window.playback.clock import MAX_FRAME_TIME, FixedStepClock, interpolate


def frame(time: float, position: FloatArray, velocity: FloatArray, present: list[bool] | None = None) -> Frame:
    count = len(position)
    there = np.ones(count, np.bool_) if present is None else np.asarray(present)
    return Frame(time, position, velocity, np.full(count, time), np.zeros(count), there)


def test_rungs_are_those_of_a_tenth_of_a_decade() -> None:
    pace, seen = FixedStepClock(), []
    for _ in range(11):
        seen.append(round(100 * pace.speed))
        pace.slower()
    assert seen == [100, 79, 63, 50, 40, 32, 25, 20, 16, 13, 10]
    for _ in range(99):
        pace.slower()
    assert pace.speed == pytest.approx(0.001, rel=1e-12)  # rounding
    for _ in range(99):
        pace.faster()
    assert pace.speed == pytest.approx(10.0, rel=1e-12)  # rounding
    pace.slower()
    pace.faster()
    assert pace.speed == 10.0


@given(
    pictures=st.lists(st.floats(0.0, 0.1), min_size=1, max_size=200),
    dt=st.sampled_from([1e-4, 1e-3, 1 / 120, 1 / 60, 0.01, 0.05, 0.5]),
    rung=st.integers(-20, 10),
)
def test_simulated_time_is_real_time_by_the_speed_up_to_a_step(pictures: list[float], dt: float, rung: int) -> None:
    pace = FixedStepClock()
    for _ in range(abs(rung)):
        (pace.faster if rung > 0 else pace.slower)()
    real, steps = 0.0, 0
    for elapsed in pictures:
        asked = pace.steps_due(elapsed, dt)
        pace.record_steps(elapsed, asked, asked, dt)
        real, steps = real + elapsed, steps + asked
        behind = real * pace.speed - steps * dt
        assert -1e-9 <= behind <= dt * (1.0 + 1e-9) + 1e-9  # sums of up to 200 terms
        assert 0.0 <= pace.alpha(dt) <= 1.0
        assert pace.alpha(dt) == pytest.approx(min(max(behind / dt, 0.0), 1.0), abs=1e-6)  # as above, over dt of 1e-4


@given(elapsed=st.floats(0.0, 1e6), dt=st.floats(1e-6, 10.0))
def test_no_picture_asks_for_more_than_the_cap(elapsed: float, dt: float) -> None:
    asked = FixedStepClock().steps_due(elapsed, dt)
    assert asked * dt <= MAX_FRAME_TIME * (1.0 + 1e-9)  # rounding of the quotient
    assert asked == 0 or (asked + 1) * dt >= min(elapsed, MAX_FRAME_TIME) * (1.0 - 1e-9)  # as above


def test_steps_that_could_not_be_made_are_dropped_and_the_speed_says_so() -> None:
    """A machine that makes only 2 of 10 steps a picture: what is asked for does not grow."""
    pace = FixedStepClock()
    for _ in range(100):
        asked = pace.steps_due(0.1, 0.01)
        assert asked in (9, 10)  # 0.1 / 0.01, after rounding
        pace.record_steps(0.1, 2, asked, 0.01)
    assert pace.real_speed == pytest.approx(0.2, rel=1e-12)  # rounding
    assert pace.speed == 1.0


def test_real_speed_is_that_asked_for_until_it_is_known() -> None:
    pace = FixedStepClock()
    pace.slower()
    assert pace.real_speed == pace.speed
    for _ in range(60):
        asked = pace.steps_due(1 / 60, 0.001)
        pace.record_steps(1 / 60, asked, asked, 0.001)
    assert pace.real_speed == pytest.approx(pace.speed, rel=0.01)  # a step of 1 ms in half a second
    pace.reset()
    assert pace.real_speed == pace.speed
    assert pace.alpha(0.001) == 0.0


def test_flow_is_capped_real_time_by_the_speed() -> None:
    pace = FixedStepClock()
    assert pace.scale_time(0.02) == 0.02
    assert pace.scale_time(9.0) == MAX_FRAME_TIME
    pace.faster()
    assert pace.scale_time(0.02) == 0.02 * pace.speed


@given(share=st.floats(0.0, 1.0))
def test_picture_lies_on_the_straight_line_between_two_states(share: float) -> None:
    velocity = np.asarray([[2.0, 0.0]])
    a, b = frame(1.0, np.asarray([[0.0, 1.0]]), velocity), frame(1.5, np.asarray([[1.0, 1.5]]), velocity)
    found = interpolate(a, b, share)
    assert found.time == pytest.approx(1.0 + 0.5 * share, rel=1e-15)  # one rounding
    assert found.position[0] == pytest.approx([share, 1.0 + 0.5 * share], abs=1e-15)  # as above
    assert found.angle[0] == pytest.approx(1.0 + 0.5 * share, abs=1e-15)  # as above


def test_who_was_put_elsewhere_appeared_or_is_gone_is_shown_as_in_the_later_state() -> None:
    start = np.asarray([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    moved = np.asarray([[0.1, 0.0], [9.0, 0.0], [0.1, 0.0], [0.0, 5.0]])
    before = frame(0.0, start, np.full((3, 2), 1.0), [True, True, True])
    after = frame(0.1, moved, np.full((4, 2), 1.0), [True, True, False, True])
    found = interpolate(before, after, 0.5).position
    assert found.tolist() == [[0.05, 0.0], [9.0, 0.0], [0.1, 0.0], [0.0, 5.0]]
    assert interpolate(after, before, 0.5).position.shape == (
        3,
        2,
    )  # a body that is not in the later state is not there
    assert interpolate(before, after, 1.0) is after
    assert interpolate(after, after, 0.3) is after


def test_picture_of_a_state_that_is_not_finite_is_no_worse_than_it() -> None:
    here = np.asarray([[0.0, 0.0], [1.0, 1.0]])
    there = np.asarray([[np.nan, np.inf], [1.1, 1.0]])
    found = interpolate(frame(0.0, here, here), frame(0.1, there, there), 0.5)
    assert np.isfinite(found.position[1]).all()
