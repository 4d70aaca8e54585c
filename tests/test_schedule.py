"""Schedules: stretches of equal steps, with the step lengths that actions set."""

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import Action, Remove, Switch
from sandbox.schedule import ROUNDING, Stretch, schedule


def change(time: float, **settings: Any) -> Switch:
    return Switch(time=time, settings=settings)


def test_schedule_without_changes_is_one_stretch() -> None:
    assert schedule(1.0, 0.1) == [Stretch(10, 0.1)]
    assert schedule(0.3, 0.1) == [Stretch(3, 0.1)]  # 0.3 / 0.1 is 2.9999999999999996
    assert schedule(0.25, 0.1) == [Stretch(2, 0.1, 0.5)]
    assert schedule(0.05, 0.1) == [Stretch(0, 0.1, 0.5)]
    assert schedule(0.0, 0.1) == [Stretch(0, 0.1)]


def test_change_takes_effect_at_the_first_step_not_before_it() -> None:
    assert schedule(1.0, 0.1, [change(0.5, dt=0.25)]) == [Stretch(5, 0.1), Stretch(2, 0.25)]
    assert schedule(1.1, 0.1, [change(0.55, dt=0.25)]) == [Stretch(6, 0.1), Stretch(2, 0.25)]
    assert schedule(1.0, 0.1, [change(0.0, dt=0.5)]) == [Stretch(2, 0.5)]


def test_time_within_rounding_of_a_step_counts_as_that_step() -> None:
    for time in (0.3, 0.1 + 0.1 + 0.1, 3 * 0.1 * (1 + 1e-12), 3 * 0.1 * (1 - 1e-12)):
        assert schedule(0.8, 0.1, [change(time, dt=0.25)])[0] == Stretch(3, 0.1)
    assert schedule(0.9, 0.1, [change(0.3 * (1 + 1e-6), dt=0.25)])[0] == Stretch(4, 0.1)


def test_last_change_at_one_time_wins_and_changes_at_the_end_do_nothing() -> None:
    actions = [change(0.5, dt=0.2), change(0.5, dt=0.05), change(1.0, dt=0.001), change(2.0, dt=1e-9)]
    assert schedule(1.0, 0.1, actions) == [Stretch(5, 0.1), Stretch(10, 0.05)]


def test_actions_without_a_valid_dt_are_ignored() -> None:
    actions: list[Action] = [
        Remove(time=0.1, body="a"), change(0.2, substeps=2), Switch(time=0.3, engine="exact"),
        change(0.4, dt="fast"), change(0.5, dt=0), change(0.6, dt=-1.0), change(0.7, dt=None),
    ]  # fmt: skip
    assert schedule(1.0, 0.1, actions) == [Stretch(10, 0.1)]


def test_step_longer_than_the_remaining_time_is_cut() -> None:
    stretches = schedule(1.0, 0.1, [change(0.5, dt=5.0)])
    assert stretches[0] == Stretch(5, 0.1)
    assert stretches[1].steps == 0
    assert stretches[1].part == pytest.approx(0.1, rel=1e-12)  # rounding


steps = st.sampled_from([0.1, 0.01, 1 / 60, 1 / 3, 0.007, 0.25])


@given(duration=st.floats(0.01, 50.0), dt=steps, changes=st.lists(st.tuples(st.floats(0.0, 60.0), steps), max_size=6))
def test_stretches_fill_the_duration_and_begin_at_the_changes(duration, dt, changes):
    changes.sort(key=lambda each: each[0])
    stretches = schedule(duration, dt, [change(time, dt=other) for time, other in changes])
    whole = sum(each.steps * each.dt for each in stretches)
    last = stretches[-1]
    assert whole + last.part * last.dt == pytest.approx(duration, rel=2 * ROUNDING)  # parts below ROUNDING are dropped
    assert all(each.part == 0.0 and each.steps > 0 for each in stretches[:-1])
    assert 0.0 <= last.part < 1.0
    begin = 0.0
    for before, after in pairwise(stretches):
        begin += before.steps * before.dt
        due = [other for time, other in changes if time <= begin + ROUNDING * before.dt]
        assert due[-1] == after.dt
        # It does not begin a step too late: a change lies within the last step.
        early = begin - before.dt + 2.0 * ROUNDING * before.dt  # times this close count as equal
        assert any(early < time for time, _ in changes[: len(due)])


def test_whole_steps_after_a_change_to_a_much_shorter_dt_are_not_cut() -> None:
    switch = Switch(time=0.2, settings={"dt": 1e-9})
    for steps in range(1, 20):
        duration = 0.2 + steps * 1e-9
        assert schedule(duration, 0.1, [switch])[-1] == Stretch(steps, 1e-9)
