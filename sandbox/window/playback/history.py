"""History: the states that were seen, and the checkpoints from which the way back to them is short.

Rest: whether everything has come to it.

Calm: how long nothing has touched in a session, and whether that is long enough for a checkpoint.

Trails: the last places of the bodies.
"""

from bisect import bisect_left, bisect_right, insort
from collections import deque
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.segment import Checkpoint
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.session import GameSession
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame

BUDGET = 256 * 2**20
"""Bytes that the kept states may take."""
BYTES_PER_BODY, BYTES_PER_FRAME = 6 * 8 + 1, 1100
"""The second is what Python's own objects take, measured."""
APART = 30
"""States seen between two checkpoints, at least."""
MAX_FRAMES = 64
"""Checkpoints kept."""


class Keyframe(NamedTuple):
    """A checkpoint, and how many actions had been done by then."""

    step: int
    actions: int
    point: Checkpoint
    game: GameSession | None = None
    """as it stood then"""


class History:
    """What a session has seen so far, by the number of the step.

    States are thinned out where they would take too much memory, and checkpoints where there are many: what was long
    ago keeps every second. The first and the last stay.
    """

    def __init__(self) -> None:
        self._steps: list[int] = []
        self._frames: list[Frame] = []
        self._bytes = 0
        self._marks: list[Keyframe] = []
        self.marking = True
        """Whether checkpoints are of use; they are not, once one has led somewhere else than the way from the start."""

    @property
    def furthest(self) -> int:
        """The last step that was seen."""
        return self._steps[-1] if self._steps else 0

    @property
    def marks(self) -> tuple[int, ...]:
        """The steps of the checkpoints."""
        return tuple(mark.step for mark in self._marks)

    @property
    def end(self) -> float:
        """The time of the last state, s."""
        return self._frames[-1].time if self._frames else 0.0

    @property
    def mark_times(self) -> tuple[float, ...]:
        """The times of the checkpoints, s."""
        return tuple(mark.point.frame.time for mark in self._marks)

    def keep(self, step: int, frame: Frame) -> None:
        """Keep the state after so many steps; one that is known stays as it is."""
        at = bisect_left(self._steps, step)
        if at < len(self._steps) and self._steps[at] == step:
            return
        self._steps.insert(at, step)
        self._frames.insert(at, frame)
        self._bytes += _bytes(frame)
        if self._bytes > BUDGET and len(self._steps) > 2:
            self._thin()

    def _thin(self) -> None:
        half = len(self._steps) // 2
        kept = [*range(0, half, 2), *range(half, len(self._steps))]
        if len(kept) == len(self._steps):  # two are left, and one of them is the first
            kept = [0, len(self._steps) - 1]
        self._steps, self._frames = [self._steps[k] for k in kept], [self._frames[k] for k in kept]
        self._bytes = sum(map(_bytes, self._frames))

    def known(self, step: int) -> Frame | None:
        """Return the state after so many steps, where it was kept."""
        at = bisect_left(self._steps, step)
        return self._frames[at] if at < len(self._steps) and self._steps[at] == step else None

    def next_known(self, step: int) -> int | None:
        """Return the next step after one whose state is kept."""
        at = bisect_right(self._steps, step)
        return self._steps[at] if at < len(self._steps) else None

    def nearest(self, time: float) -> tuple[int, Frame]:
        """Return the kept state that is nearest to a time, s, and its step.

        Raises:
            LookupError: none is kept.
        """
        if not self._steps:
            raise LookupError("nothing has been seen yet")
        at = min(bisect_right(self._frames, time, key=lambda frame: frame.time), len(self._frames) - 1)
        if at > 0 and time - self._frames[at - 1].time < self._frames[at].time - time:
            at -= 1
        return self._steps[at], self._frames[at]

    def closest(self, step: int) -> tuple[int, Frame] | None:
        """Return the last kept state at or before a step, and its step."""
        at = bisect_right(self._steps, step) - 1
        return (self._steps[at], self._frames[at]) if at >= 0 else None

    def wants_mark(self, step: int) -> bool:
        """Tell whether enough was seen since the last checkpoint before a step."""
        if not self.marking:
            return False
        last = self.before(step)
        since = last.step if last is not None else 0
        return bisect_left(self._steps, step) - bisect_right(self._steps, since) >= APART

    def mark(self, mark: Keyframe) -> None:
        """Keep a checkpoint."""
        insort(self._marks, mark, key=lambda other: other.step)
        if len(self._marks) > MAX_FRAMES:
            half = len(self._marks) // 2
            self._marks = self._marks[:half:2] + self._marks[half:]

    def inserted(self, step: int) -> None:
        """Take note that one more action was done by a step, and so by all later ones."""
        self._marks = [m._replace(actions=m.actions + 1) if m.step >= step else m for m in self._marks]

    def before(self, step: int) -> Keyframe | None:
        """Return the last checkpoint at or before a step."""
        found = [mark for mark in self._marks if mark.step <= step]
        return found[-1] if found else None

    def distrust(self) -> None:
        """Forget all checkpoints, and keep none from now on: they do not lead where the way from the start does."""
        self._marks.clear()
        self.marking = False

    def forget(self, steps: list[int]) -> None:
        """Forget the states after some steps."""
        gone = set(steps)
        kept = [k for k, step in enumerate(self._steps) if step not in gone]
        self._steps, self._frames = [self._steps[k] for k in kept], [self._frames[k] for k in kept]
        self._bytes = sum(map(_bytes, self._frames))

    def cut(self, step: int) -> None:
        """Forget what came after a step: from there it will go another way."""
        at = bisect_right(self._steps, step)
        self._bytes -= sum(map(_bytes, self._frames[at:]))
        del self._steps[at:], self._frames[at:]
        self._marks = [mark for mark in self._marks if mark.step <= step]


def _bytes(frame: Frame) -> int:
    return len(frame.position) * BYTES_PER_BODY + BYTES_PER_FRAME


REST_SPEED = 1e-9
"""m/s and rad/s: what is slower rests"""


def is_at_rest(frame: Frame) -> bool:
    """Tell whether nothing moves or turns."""
    rates = (frame.velocity, frame.angular_velocity, *(() if frame.roll is None else (frame.roll,)))
    return all(float(np.abs(rate).max(initial=0.0)) <= REST_SPEED for rate in rates)


MIN_CONTACT_FREE = 8
"""Substeps without contact before a checkpoint is made; engines remember parted contacts for 3 by default."""


class ContactFreeTimer:
    """The time since the last contact, in substeps."""

    def __init__(self) -> None:
        self._substeps = 0

    def look(self, contacts: Contacts, settings: Settings) -> None:
        """Take in the contacts of what was last seen."""
        self._substeps = 0 if len(contacts) else self._substeps + settings.substeps

    def lasts(self, relay: SwitchableSimulation, frame: Frame) -> bool:
        """Tell whether from the present state of a relay one can go on as if it had never been left."""
        if self._substeps < max(MIN_CONTACT_FREE, 2 * (relay.settings.persistence or 1)):
            return False
        # A state in mid-roll does not tell when the roll began: the way on differs by roundings.
        return relay.scene.surface is None or is_at_rest(frame)


TRAIL_LENGTH = 120
"""States that a trail goes back."""
MAX_TRAIL_POINTS = 2000
"""Bodies that leave trails; of more, none does."""


class Trails:
    """Remembers where bodies were."""

    def __init__(self) -> None:
        self._places: deque[tuple[float, FloatArray]] = deque(maxlen=TRAIL_LENGTH)

    def keep(self, frame: Frame) -> None:
        """Take note of a state; one of an earlier time begins anew."""
        if len(frame.position) > MAX_TRAIL_POINTS:
            self.clear()
            return
        if self._places and frame.time <= self._places[-1][0]:
            if frame.time == self._places[-1][0]:
                self._places.pop()
            else:
                self.clear()
        places = np.where(frame.present[:, None], frame.position, np.nan)
        self._places.append((frame.time, places))

    def pieces(self) -> tuple[FloatArray, ...]:
        """Return (T, N, 2) m for each stretch of time with the same bodies, oldest first."""
        found: list[list[FloatArray]] = []
        for _, places in self._places:
            if found and len(found[-1][-1]) == len(places):
                found[-1].append(places)
            else:
                found.append([places])
        return tuple(np.stack(piece) for piece in found)

    def clear(self) -> None:
        """Forget all."""
        self._places.clear()
