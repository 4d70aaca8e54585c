"""Tapes of inputs: one records what a program reads from its surroundings, the other plays it back.

A reading is found again by its frame and by its number among the calls of its kind within the frame. So a program that
runs with other settings, and calls less or more often, stays in step with the frames of the recording.
"""

from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from sandbox.game_inputs import GameInputs, InputEvent, InputReading, InputValue

TICK = 1e-5
"""s, by which the clock of a tape moves on with each reading that was not recorded: a program that waits in a loop ends
its wait"""


WALL_CLOCK = "time.time"
"""Kind of the clock that counts from 1970"""


class EndOfTape(SystemExit):
    """Ends a program that runs beyond the recorded inputs."""


Events = Sequence[tuple[int, dict[str, InputValue]]]
"""Types and attributes of events"""


class InputTape(Protocol):
    """What a program reads from its surroundings, by kind."""

    frame: int
    """number of the present frame"""

    def state(self, kind: str, live: Callable[[], InputValue]) -> InputValue:
        """Return a state that holds until it changes, such as the pressed keys.

        Args:
            kind: name of the state.
            live: returns the present state of the device.
        """

    def time(self, kind: str, live: Callable[[], float], per_second: float = 1.0) -> float:
        """Return a reading of a clock.

        Args:
            kind: name of the clock.
            live: returns the present reading of the real clock.
            per_second: units of the reading per second.
        """

    def result(self, kind: str, live: Callable[[], InputValue], otherwise: Callable[[float], InputValue]) -> InputValue:
        """Return the result of a call, such as the movement of the mouse since the last call.

        Args:
            kind: name of the call.
            live: makes the call.
            otherwise: returns the result of a call that was not recorded, given the length of the frame, s.
        """

    def events(self, live: Callable[[], Events]) -> Events:
        """Return the events that have reached the queue since the last call."""

    def awaited_events(self) -> Events:
        """Return events for a program that waits for one, and does nothing else until it comes.

        Raises:
            EndOfTape: no event will come.
        """

    def end_frame(self) -> None:
        """End the present frame.

        Raises:
            EndOfTape: the recorded inputs have ended.
        """


class RecordingTape:
    """Tape that records.

    Args:
        now: returns the time since the start, s.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.frame = 0
        self._now = now
        self._calls: Counter[str] = Counter()
        self._watched: dict[str, Callable[[], InputValue]] = {}
        self.readings: dict[str, list[InputReading]] = {}
        self.recorded_events: list[InputEvent] = []
        self.frame_times: list[float] = []

    def state(self, kind: str, live: Callable[[], InputValue]) -> InputValue:
        """Return the present state of a device, and record it if it has changed."""
        value = live()
        self._watched[kind] = live
        self._note_state(kind, value)
        return value

    def time(self, kind: str, live: Callable[[], float], per_second: float = 1.0) -> float:  # noqa: ARG002
        """Return the reading of the real clock, and record it."""
        value = live()
        self.readings.setdefault(kind, []).append(InputReading(self.frame, self._count(kind), value))
        return value

    def result(self, kind: str, live: Callable[[], InputValue], otherwise: Callable[[float], InputValue]) -> InputValue:  # noqa: ARG002
        """Return the result of a call, and record it."""
        value = live()
        self.readings.setdefault(kind, []).append(InputReading(self.frame, self._count(kind), value))
        return value

    def events(self, live: Callable[[], Events]) -> Events:
        """Return the events of the device, and record them."""
        found, call = live(), self._count("events")
        self.recorded_events += [InputEvent(self.frame, call, kind, values) for kind, values in found]
        return found

    def awaited_events(self) -> Events:
        """Return no events: they come from the device."""
        return ()

    def end_frame(self) -> None:
        """End the frame: a state that the program has read before is recorded, whether it reads it again or not."""
        for kind, live in self._watched.items():
            self._note_state(kind, live())
        self.frame_times.append(self._now())
        self.frame += 1
        self._calls.clear()

    def _note_state(self, kind: str, value: InputValue) -> None:
        known, call = self.readings.setdefault(kind, []), self._count(kind)
        if not known or known[-1].value != value:
            known.append(InputReading(self.frame, call, value))

    def _count(self, kind: str) -> int:
        self._calls[kind] += 1
        return self._calls[kind] - 1


class ReplayTape:
    """Tape that plays recorded inputs.

    Args:
        inputs: of a game.
    """

    def __init__(self, inputs: GameInputs) -> None:
        self.frame = 0
        self.unread: dict[str, None] = {}
        """kinds of readings that the program made, and the recording has none of"""
        self._inputs = inputs
        self._calls: Counter[str] = Counter()
        self._states = {kind: _Sequence(readings) for kind, readings in inputs.readings.items()}
        self._results: Mapping[str, Mapping[tuple[int, int], InputValue]] = {
            kind: {(each.frame, each.call): each.value for each in readings}
            for kind, readings in inputs.readings.items()
        }
        self._last: dict[str, float] = {}
        self._offsets: dict[str, float] = {}
        self._next_event = 0

    def state(self, kind: str, live: Callable[[], InputValue]) -> InputValue:
        """Return the state as the program saw it at this call of this frame; that of the device if it never did."""
        known = self._states.get(kind)
        if known is None:
            self.unread[kind] = None
            return live()
        return known.at(self.frame, self._count(kind))

    def time(self, kind: str, live: Callable[[], float], per_second: float = 1.0) -> float:  # noqa: ARG002
        """Return the recorded reading; for a call that was not recorded, the time of the frame on the same clock."""
        known, call = self._results.get(kind, {}), self._count(kind)
        value = known.get((self.frame, call))
        if not isinstance(value, (int, float)):
            value = self._offset(kind, per_second) + per_second * (self._frame_start + TICK * call)
        # A later reading is never earlier, also after readings that were not recorded.
        value = max(value, self._last.get(kind, value))
        self._last[kind] = value
        return value

    def result(self, kind: str, live: Callable[[], InputValue], otherwise: Callable[[float], InputValue]) -> InputValue:  # noqa: ARG002
        """Return the recorded result of a call."""
        at = self.frame, self._count(kind)
        known = self._results.get(kind, {})
        return known[at] if at in known else otherwise(self._time_of(self.frame + 1) - self._frame_start)

    def events(self, live: Callable[[], Events]) -> Events:  # noqa: ARG002
        """Return the recorded events up to this call of this frame."""
        call, found = self._count("events"), []
        recorded = self._inputs.events
        while self._next_event < len(recorded) and recorded[self._next_event][:2] <= (self.frame, call):
            event = recorded[self._next_event]
            found.append((event.type, event.values))
            self._next_event += 1
        return found

    def awaited_events(self) -> Events:
        """Return the next recorded event, in whichever frame it is.

        Raises:
            EndOfTape: there is none.
        """
        if self._next_event >= len(self._inputs.events):
            raise EndOfTape(0)
        event = self._inputs.events[self._next_event]
        self._next_event += 1
        return [(event.type, event.values)]

    def end_frame(self) -> None:
        """End the frame.

        Raises:
            EndOfTape: the program runs on after the recorded frames.
        """
        self.frame += 1
        self._calls.clear()
        if self.frame > self._inputs.frames:
            raise EndOfTape(0)

    @property
    def _frame_start(self) -> float:
        return self._time_of(self.frame)

    def _time_of(self, frame: int) -> float:
        """Return the time at the start of a frame, s; times after the last frame continue with its length."""
        times = self._inputs.frame_times
        if frame <= 0 or not times:
            return 0.0
        if frame <= len(times):
            return times[frame - 1]
        return times[-1] + (frame - len(times)) * times[-1] / len(times)

    def _offset(self, kind: str, per_second: float) -> float:
        """Return the reading of a clock at the start of the program, known from its first recorded reading."""
        if kind not in self._offsets:
            readings = self._inputs.readings.get(kind, ())
            first = readings[0] if readings else None
            if first is not None and isinstance(first.value, (int, float)):
                self._offsets[kind] = first.value - per_second * self._time_of(first.frame)
            else:
                self.unread[kind] = None
                self._offsets[kind] = per_second * self._inputs.started if kind == WALL_CLOCK else 0.0
        return self._offsets[kind]

    def _count(self, kind: str) -> int:
        self._calls[kind] += 1
        return self._calls[kind] - 1


class _Sequence:
    """States in order of time."""

    def __init__(self, readings: Sequence[InputReading]) -> None:
        self._times = [each[:2] for each in readings]
        self._values = [each.value for each in readings]

    def at(self, frame: int, call: int) -> InputValue:
        """Return the last state at or before a call of a frame; the first one before it."""
        return self._values[max(bisect_right(self._times, (frame, call)) - 1, 0)]
