"""Tapes of inputs: what one records, the other plays back at the same frame and call, however often it is asked."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.game_inputs import GameInputs
from sandbox.rehearsal.tape import WALL_CLOCK, EndOfTape, RecordingTape, ReplayTape

FRAME = 0.02  # s


class Clock:
    """Clock that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        """Return the time."""
        return self.now


def recorded(tape: RecordingTape) -> GameInputs:
    """Return the inputs on a tape."""
    return GameInputs(
        "game.py",
        ".",
        started=1000.0,
        frame_times=tuple(tape.frame_times),
        readings={kind: tuple(each) for kind, each in tape.readings.items()},
        events=tuple(tape.recorded_events),
    )


@given(st.lists(st.lists(st.integers(0, 5), max_size=4), min_size=1, max_size=12))
def test_states_and_results_are_those_of_the_same_call(frames: list[list[int]]) -> None:
    """Each frame has some calls, whose results are the numbers drawn."""
    clock = Clock()
    tape = RecordingTape(clock)

    def play(on: RecordingTape | ReplayTape, live: Callable[[int], int]) -> list[tuple[object, ...]]:
        seen = []
        for number, calls in enumerate(frames):
            for value in calls:
                state = on.state("keys", lambda value=value: live(value))
                result = on.result("tick", lambda value=value: live(value) + 1, lambda _: -1)
                events = on.events(lambda value=value: [(live(value), {})])
                seen.append((state, result, *events))
            clock.now = (number + 1) * FRAME
            on.end_frame()
        return seen

    first = play(tape, lambda value: value)

    def no_device(_: int) -> int:
        raise AssertionError("a replay reads no device")

    replay = ReplayTape(recorded(tape))
    assert play(replay, no_device) == first
    assert not replay.unread
    with pytest.raises(EndOfTape):
        replay.end_frame()


def test_events_that_are_not_fetched_in_their_frame_come_later_in_order() -> None:
    tape = RecordingTape(Clock())
    for number in range(3):
        tape.events(lambda number=number: [(number, {})])
        tape.end_frame()
    replay = ReplayTape(recorded(tape))
    replay.end_frame()
    replay.end_frame()  # two frames without a look into the queue
    assert [kind for kind, _ in replay.events(list)] == [0, 1, 2]


def test_waiting_for_an_event_takes_the_next_one_and_ends_after_the_last() -> None:
    tape = RecordingTape(Clock())
    tape.end_frame()
    tape.events(lambda: [(7, {"key": 1})])
    replay = ReplayTape(recorded(tape))
    assert list(replay.awaited_events()) == [(7, {"key": 1})]
    with pytest.raises(EndOfTape):
        replay.awaited_events()


def test_clock_of_a_call_that_was_not_recorded_is_that_of_the_frame_and_never_runs_back() -> None:
    clock = Clock()
    tape = RecordingTape(clock)
    for number in range(4):
        clock.now = number * FRAME
        if number != 2:  # in frame 2 the game does not look at the clock
            tape.time("time.perf_counter", lambda: 50.0 + clock.now)
        clock.now = (number + 1) * FRAME
        tape.end_frame()
    replay = ReplayTape(recorded(tape))
    seen = []
    for _ in range(4):
        seen += [replay.time("time.perf_counter", lambda: 0.0) for _ in range(3)]
        replay.end_frame()
    assert seen == sorted(seen)
    # one reading of a frame is recorded; those that are not are at most 20 µs later, 10 µs for each call
    assert seen[::3] == pytest.approx([50.0, 50.0 + FRAME, 50.0 + 2 * FRAME, 50.0 + 3 * FRAME], abs=5e-5)


def test_clock_that_the_game_reads_only_now_starts_with_the_recording() -> None:
    tape = RecordingTape(Clock())
    tape.end_frame()
    replay = ReplayTape(recorded(tape))
    assert replay.time(WALL_CLOCK, lambda: 0.0) == pytest.approx(1000.0, abs=1e-3)  # started, and a reading later
    assert WALL_CLOCK in replay.unread


def test_time_since_the_last_frame_is_that_of_the_frame_for_further_calls() -> None:
    clock = Clock()
    tape = RecordingTape(clock)
    tape.result("tick", lambda: 17, lambda _: 0)
    clock.now = FRAME
    tape.end_frame()
    replay = ReplayTape(recorded(tape))
    results = [replay.result("tick", lambda: 0, lambda seconds: round(1e3 * seconds)) for _ in range(2)]
    assert results == [17, 20]
