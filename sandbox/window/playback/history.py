"""Stored states and checkpoints of a session, and its replay; break times of joints, and trails of positions."""

from bisect import bisect_left, bisect_right, insort
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import SnapshotError, StateSnapshot
from sandbox.engines.segment import Checkpoint
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

MAX_BYTES = 256 * 2**20
"""maximum size of the stored states"""
BYTES_PER_BODY, BYTES_PER_FRAME = 6 * 8 + 1, 1100
"""The second is the size of the Python objects, measured."""
MIN_KEYFRAME_INTERVAL = 30
"""states stored between two checkpoints"""
MAX_KEYFRAMES = 64
MAX_FINE_STEPS, MAX_FINE_BYTES = 512, 32 * 2**20
"""the last steps of which each state is stored, also those between two pictures, and bound of their size"""


class Keyframe(NamedTuple):
    """A state of a session from which it can continue."""

    step: int
    actions: int
    """how many had been applied"""
    state: StateSnapshot[SwitchableSimulation] | Checkpoint
    """a snapshot, or a checkpoint on engines that cannot make snapshots"""
    game: GameSession | None = None
    """a copy"""

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.state.time if isinstance(self.state, StateSnapshot) else self.state.frame.time

    @property
    def is_exact(self) -> bool:
        """Whether the session continues from it as it did, bit for bit, with certainty."""
        return isinstance(self.state, StateSnapshot)

    def resumed(self) -> SwitchableSimulation:
        """Return a new simulation that continues from the state.

        Raises:
            Refusal: the engine cannot start from a checkpoint.
            ActionError: the engine cannot take over a constant force of a checkpoint.
        """
        return (
            self.state.resumed() if isinstance(self.state, StateSnapshot) else SwitchableSimulation.resumed(self.state)
        )


def keyframe_state(
    simulation: SwitchableSimulation, can_checkpoint: bool
) -> StateSnapshot[SwitchableSimulation] | Checkpoint | None:
    """Return a snapshot of a simulation; where its engine makes none a checkpoint, and None if that is not possible."""
    try:
        return simulation.snapshot()
    except SnapshotError:
        return simulation.checkpoint() if can_checkpoint else None


class History:
    """The states and checkpoints of a session, by step.

    Beyond `MAX_BYTES` of states, and `MAX_KEYFRAMES` checkpoints, every second one of the older half is discarded. The
    first and the last state stay.
    """

    def __init__(self) -> None:
        self._steps: list[int] = []
        self._frames: list[Frame] = []
        self._bytes = 0
        self._fine: dict[int, Frame] = {}  # of the last steps, between those above
        self._keyframes: list[Keyframe] = []
        self.checkpoints_enabled = True
        """False once a checkpoint has led to another state than a replay from the start"""

    @property
    def last_step(self) -> int:
        """The last step whose state is stored."""
        return self._steps[-1] if self._steps else 0

    @property
    def keyframe_steps(self) -> tuple[int, ...]:
        """The steps of the checkpoints."""
        return tuple(keyframe.step for keyframe in self._keyframes)

    @property
    def end_time(self) -> float:
        """Time of the last state, s."""
        return self._frames[-1].time if self._frames else 0.0

    @property
    def keyframe_times(self) -> tuple[float, ...]:
        """Times of the checkpoints, s."""
        return tuple(keyframe.time for keyframe in self._keyframes)

    def store(self, step: int, frame: Frame) -> None:
        """Store the state after a step, unless there is one already."""
        at = bisect_left(self._steps, step)
        if at < len(self._steps) and self._steps[at] == step:
            return
        self._steps.insert(at, step)
        self._frames.insert(at, frame)
        self._bytes += _bytes(frame)
        if self._bytes > MAX_BYTES and len(self._steps) > 2:
            self._thin()

    def store_fine(self, step: int, frame: Frame) -> None:
        """Store a state between two pictures for a while, so that single steps back can show it."""
        self._fine.setdefault(step, frame)
        kept = max(min(MAX_FINE_STEPS, MAX_FINE_BYTES // _bytes(frame)), 1)
        while len(self._fine) > kept:
            del self._fine[next(iter(self._fine))]

    def _thin(self) -> None:
        half = len(self._steps) // 2
        kept = [*range(0, half, 2), *range(half, len(self._steps))]
        if len(kept) == len(self._steps):  # two are left, and one of them is the first
            kept = [0, len(self._steps) - 1]
        self._steps, self._frames = [self._steps[k] for k in kept], [self._frames[k] for k in kept]
        self._bytes = sum(map(_bytes, self._frames))

    def get(self, step: int) -> Frame | None:
        """Return the state after a step, if it is stored."""
        at = bisect_left(self._steps, step)
        if at < len(self._steps) and self._steps[at] == step:
            return self._frames[at]
        return self._fine.get(step)

    def next_stored(self, step: int) -> int | None:
        """Return the first step after a step whose state is stored."""
        at = bisect_right(self._steps, step)
        return self._steps[at] if at < len(self._steps) else None

    def nearest(self, time: float) -> tuple[int, Frame]:
        """Return the stored state nearest to a time, s, and its step.

        Raises:
            LookupError: none is stored.
        """
        if not self._steps:
            raise LookupError("no state is stored")
        at = min(bisect_right(self._frames, time, key=lambda frame: frame.time), len(self._frames) - 1)
        if at > 0 and time - self._frames[at - 1].time < self._frames[at].time - time:
            at -= 1
        return self._steps[at], self._frames[at]

    def last_at(self, step: int) -> tuple[int, Frame] | None:
        """Return the last stored state at or before a step, and its step."""
        if step in self._fine:
            return step, self._fine[step]
        at = bisect_right(self._steps, step) - 1
        return (self._steps[at], self._frames[at]) if at >= 0 else None

    def wants_keyframe(self, step: int) -> bool:
        """Return whether enough states are stored between the last checkpoint and a step."""
        if not self.checkpoints_enabled:
            return False
        last = self.keyframe_before(step)
        since = last.step if last is not None else 0
        return bisect_left(self._steps, step) - bisect_right(self._steps, since) >= MIN_KEYFRAME_INTERVAL

    def add_keyframe(self, keyframe: Keyframe) -> None:
        """Store a checkpoint."""
        insort(self._keyframes, keyframe, key=lambda other: other.step)
        if len(self._keyframes) > MAX_KEYFRAMES:
            half = len(self._keyframes) // 2
            self._keyframes = self._keyframes[:half:2] + self._keyframes[half:]

    def count_inserted_action(self, step: int) -> None:
        """Add one to the number of actions of the checkpoints from a step on: one was inserted there."""
        self._keyframes = [k._replace(actions=k.actions + 1) if k.step >= step else k for k in self._keyframes]

    def keyframe_before(self, step: int) -> Keyframe | None:
        """Return the last checkpoint at or before a step."""
        found = [keyframe for keyframe in self._keyframes if keyframe.step <= step]
        return found[-1] if found else None

    def disable_checkpoints(self) -> None:
        """Discard all checkpoints and store none from now on: one led to another state than a replay from the start."""
        self._keyframes.clear()
        self.checkpoints_enabled = False

    def discard(self, steps: list[int]) -> None:
        """Discard the states of some steps."""
        discarded = set(steps)
        self._fine = {step: frame for step, frame in self._fine.items() if step not in discarded}
        kept = [k for k, step in enumerate(self._steps) if step not in discarded]
        self._steps, self._frames = [self._steps[k] for k in kept], [self._frames[k] for k in kept]
        self._bytes = sum(map(_bytes, self._frames))

    def truncate(self, step: int) -> None:
        """Discard all states and checkpoints after a step."""
        first = bisect_right(self._steps, step)
        self._bytes -= sum(map(_bytes, self._frames[first:]))
        del self._steps[first:], self._frames[first:]
        self._fine = {each: frame for each, frame in self._fine.items() if each <= step}
        self._keyframes = [keyframe for keyframe in self._keyframes if keyframe.step <= step]


def _bytes(frame: Frame) -> int:
    return len(frame.position) * BYTES_PER_BODY + BYTES_PER_FRAME


@dataclass
class Replay:
    """How the present state of a session came about, and what the session holds after it.

    The state is one of three:

    - exact: reached by steps, or by a replay from the start or from a snapshot, which leads to it bit for bit.
    - resumed: replayed from a checkpoint, `origin`. States that were seen before are equal; those that were not are
      `unconfirmed` until a later one is equal.
    - off track: not a state of the session, because a replay led to another state than before, or because actions
      before it were removed.

    A seek backwards, and every seek from a state off track, restores an earlier state: `begin` makes it exact or
    resumed. An equal state confirms those before it; a different one leads off track (`leave`). With the first new step
    or action, a resumed state becomes exact (`commit`): restoring its checkpoint is then an action of the session.
    """

    recorded_until: float
    """s, end of a recording: up to there the actions of the rules are among the logged ones, and compared with them"""
    origin: Keyframe | None = None
    """checkpoint of a resumed state"""
    unconfirmed: list[int] = field(default_factory=list)
    """steps that are first seen in a replay from a checkpoint: a replay from the start may differ in the last digits"""
    is_off_track: bool = False
    whole: tuple[int, Recording] | None = None
    """last step and recording of the session, before a seek backwards"""

    def begin(self, origin: Keyframe | None) -> None:
        """Start from a state that was restored; `origin` is its checkpoint, if the state is not exact."""
        self.origin, self.is_off_track = origin, False
        self.unconfirmed.clear()

    def leave(self) -> list[int]:
        """Lead off track; return the steps whose states were not confirmed."""
        found, self.unconfirmed, self.is_off_track = self.unconfirmed, [], True
        return found

    def commit(self) -> Keyframe | None:
        """Make the state exact; return the checkpoint that must be restored for that, if any."""
        origin, self.origin = self.origin, None
        self.unconfirmed.clear()
        return origin

    def branch(self, step: int, time: float) -> Recording | None:
        """Discard what the session holds after a step and its time, s; return the recording of all of it, if any."""
        found = self.recording_beyond(step)
        self.whole, self.recorded_until = None, min(self.recorded_until, time)
        return found

    def recording_beyond(self, step: int) -> Recording | None:
        """Return the recording of the whole session if it has later steps than this one."""
        return self.whole[1] if self.whole is not None and step < self.whole[0] else None


class BreakTimes:
    """Break times of the joints."""

    def __init__(self, joints: int) -> None:
        """Start with all joints unbroken."""
        self.times: FloatArray = np.full(joints, np.inf)
        """(J,) s, inf if unbroken; replaced by an update, never changed in place"""

    def of(self, joints: int) -> FloatArray:
        """Return the times of the first so many joints, some of which may have been added, (joints,) s."""
        if joints > len(self.times):
            self.times = np.append(self.times, np.full(joints - len(self.times), np.inf))
        return self.times[:joints]

    def update(self, broken: Mapping[int, float]) -> None:
        """Add break times, s. Times later than the present remain, as a replay reaches them again."""
        self.of(1 + max(broken, default=-1))
        numbers = list(broken)
        if numbers and not np.isfinite(self.times[numbers]).all():
            self.times = self.times.copy()
            self.times[numbers] = list(broken.values())

    def reset(self) -> None:
        """Mark all joints as unbroken."""
        self.times = np.full(len(self.times), np.inf)


MIN_CONTACT_FREE = 8
"""substeps without contact before a checkpoint; engines cache contacts for 3 substeps by default"""


class ContactFreeTimer:
    """The time since the last contact, in substeps."""

    def __init__(self) -> None:
        self._substeps = 0

    def update(self, contacts: Contacts, settings: Settings) -> None:
        """Count a step with these contacts."""
        self._substeps = 0 if len(contacts) else self._substeps + settings.substeps

    def allows_checkpoint(self, simulation: SwitchableSimulation, frame: Frame) -> bool:
        """Return whether a simulation restored from the present state would continue in the same way."""
        if simulation.settings.sleeping:  # a state does not hold how long bodies have been idle
            return False
        if self._substeps < max(MIN_CONTACT_FREE, 2 * (simulation.settings.persistence or 1)):
            return False
        # A state does not hold when a roll began: a continuation from there differs by rounding errors.
        return simulation.scene.surface is None or frame.is_at_rest


TRAIL_LENGTH = 120
"""states in a trail"""
MAX_TRAIL_BODIES = 2000
"""With more bodies there are no trails."""


class Trails:
    """The last positions of the bodies."""

    def __init__(self) -> None:
        self._positions: deque[tuple[float, FloatArray]] = deque(maxlen=TRAIL_LENGTH)

    def add(self, frame: Frame) -> None:
        """Add a state. One of an earlier time than the last discards all others."""
        if len(frame.position) > MAX_TRAIL_BODIES:
            self.clear()
            return
        if self._positions and frame.time <= self._positions[-1][0]:
            if frame.time == self._positions[-1][0]:
                self._positions.pop()
            else:
                self.clear()
        positions = np.where(frame.present[:, None], frame.position, np.nan)
        self._positions.append((frame.time, positions))

    def pieces(self) -> tuple[FloatArray, ...]:
        """Return (T, N, 2) m for each interval with the same number of bodies, oldest first."""
        found: list[list[FloatArray]] = []
        for _, positions in self._positions:
            if found and len(found[-1][-1]) == len(positions):
                found[-1].append(positions)
            else:
                found.append([positions])
        return tuple(np.stack(piece) for piece in found)

    def clear(self) -> None:
        """Discard all positions."""
        self._positions.clear()
