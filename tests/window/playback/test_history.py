"""History of frames within a memory budget, and keyframes."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Frame
from sandbox.window.playback import history as module
from sandbox.window.playback.history import (
    BYTES_PER_BODY,
    BYTES_PER_FRAME,
    MAX_KEYFRAMES,
    MIN_KEYFRAME_INTERVAL,
    History,
    Keyframe,
)


def frame(time: float, bodies: int = 1) -> Frame:
    two, one = np.zeros((bodies, 2)), np.zeros(bodies)
    return Frame(time, two.copy(), two.copy(), one.copy(), one.copy(), np.ones(bodies, np.bool_))


CHECKPOINT = SwitchableSimulation(from_document({"ball": [{"position": [0, 0], "radius": 1}]})).checkpoint()


def filled_history(steps: int, dt: float = 0.01) -> History:
    history = History()
    for k in range(steps):
        history.store(k, frame(k * dt))
    return history


def test_stored_frames_are_returned_and_not_overwritten() -> None:
    history = filled_history(5)
    first = history.get(3)
    history.store(3, frame(99.0))
    assert history.get(3) is first
    assert history.get(5) is None
    assert history.last_step == 4
    assert history.end_time == 0.04
    assert (history.next_stored(2), history.next_stored(4)) == (3, None)


def test_empty_history_has_no_frames_and_no_keyframes() -> None:
    history = History()
    assert (history.last_step, history.end_time, history.keyframe_steps, history.keyframe_times) == (0, 0.0, (), ())
    assert history.get(0) is None
    assert history.next_stored(0) is None
    assert history.keyframe_before(9) is None
    with pytest.raises(LookupError):
        history.nearest(0.0)


@pytest.mark.parametrize(
    ("time", "step"), [(-1.0, 0), (0.0, 0), (0.014, 1), (0.016, 2), (0.03, 3), (0.04, 4), (99.0, 4)]
)
def test_nearest_frame_by_time(time: float, step: int) -> None:
    history = filled_history(5)
    found, state = history.nearest(time)
    assert found == step
    assert state is history.get(step)


@given(st.integers(1, 40), st.integers(2, 400))
def test_history_stays_within_its_budget_and_keeps_first_and_last_frame(max_frames: int, steps: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MAX_BYTES", max_frames * (100 * BYTES_PER_BODY + BYTES_PER_FRAME))
        history = History()
        for k in range(steps):
            history.store(k, frame(float(k), 100))
            known = [j for j in range(k + 1) if history.get(j) is not None]
            assert len(known) <= max(max_frames, 2)
            assert known[0] == 0
            assert known[-1] == k == history.last_step


def test_old_frames_are_thinned_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_BYTES", 64 * (BYTES_PER_BODY + BYTES_PER_FRAME))
    history = filled_history(300)
    known = [k for k in range(300) if history.get(k) is not None]
    gaps = [b - a for a, b in pairwise(known)]
    assert gaps[0] > gaps[-1] == 1
    assert gaps == sorted(gaps, reverse=True)


def test_truncate_discards_later_frames_and_keyframes() -> None:
    history = filled_history(10)
    for step in (2, 5, 8):
        history.add_keyframe(Keyframe(step, 0, CHECKPOINT))
    history.truncate(5)
    assert history.last_step == 5
    assert history.keyframe_steps == (2, 5)
    history.store(6, frame(9.0))
    assert history.end_time == 9.0
    history.truncate(-1)
    assert history.last_step == 0
    assert history.keyframe_steps == ()


def test_keyframes_keep_a_minimum_interval_and_are_found() -> None:
    history = History()
    for k in range(200):
        history.store(k, frame(float(k)))
        if history.wants_keyframe(k):
            history.add_keyframe(Keyframe(k, 0, CHECKPOINT))
    assert len(history.keyframe_steps) >= 5
    assert all(b - a >= MIN_KEYFRAME_INTERVAL for a, b in pairwise((0, *history.keyframe_steps)))
    for step in (0, 40, 100, 199):
        keyframe = history.keyframe_before(step)
        assert (keyframe.step if keyframe else None) == max(
            (m for m in history.keyframe_steps if m <= step), default=None
        )


def test_keyframes_are_limited_in_number_and_span_all_time() -> None:
    history = History()
    for k in range(0, 10_000, 10):
        history.add_keyframe(Keyframe(k, 0, CHECKPOINT))
    assert len(history.keyframe_steps) <= MAX_KEYFRAMES
    assert list(history.keyframe_steps) == sorted(history.keyframe_steps)
    assert history.keyframe_steps[0] == 0
    assert history.keyframe_steps[-1] == 9990


def test_disabled_checkpoints_stay_disabled() -> None:
    history = filled_history(100)
    history.add_keyframe(Keyframe(50, 0, CHECKPOINT))
    history.disable_checkpoints()
    assert history.keyframe_steps == ()
    assert not history.wants_keyframe(99)


def test_inserted_action_is_counted_by_keyframes_from_its_step_on() -> None:
    history = filled_history(100)
    for step, actions in ((10, 1), (40, 2), (70, 2)):
        history.add_keyframe(Keyframe(step, actions, CHECKPOINT))
    history.count_inserted_action(40)
    found = [history.keyframe_before(step) for step in (10, 40, 70)]
    assert [keyframe.actions for keyframe in found if keyframe is not None] == [1, 3, 3]
