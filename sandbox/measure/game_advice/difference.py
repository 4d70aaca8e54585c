"""Difference of two runs of a game: distances of its bodies, and collision callbacks that one of them lacks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.jsonable import in_json
from sandbox.rehearsal.rehearse import Rehearsal
from sandbox.rehearsal.space_log import GameCallback

CHATTER = 15
"""Frames within which calls for the same two shapes count as one contact: shapes at rest on each other part and meet
again within the rounding of their motion"""
IN_TIME = 1
"""Frames by which a callback may be late or early without being so: the step in which a contact is found"""
WINDOW = 30
"""Frames within which a callback is late or early, and beyond which it is missed"""
STEP_PHASES = ("pre_solve", "post_solve")
"""Callbacks that are called in each step of a contact, and therefore more often with substeps"""

IMPACT = 5
"""Frames after the beginning of an impact in which positions may depend on the step, and contacts still count"""
BACK = 10
"""Frames for which a body has to be close to its place in another run to be there again"""

Span = tuple[int, int]
"""First frame, and frame after the last one"""
CallbackPair = tuple[GameCallback, tuple[int, int]]
"""Callback and the numbers of two shapes"""


class DifferingContact(NamedTuple):
    """Contact for which a run calls a callback at another time than the truth, or not at all."""

    frame: int
    """its first frame: of the truth, or of the run if the truth does not have it"""
    kind: str
    """`missed`, `late`, `early` or `extra`"""
    shapes: tuple[int, int]
    """numbers of the two shapes"""


@dataclass(frozen=True)
class CallbackDifference:
    """Contacts for which a run calls a callback at another time than the truth, or not at all."""

    callback: str
    """as the game registers it"""
    expected: int
    """contacts in the truth"""
    missed: int
    late: int
    """more than a frame later, or earlier, than in the truth"""
    extra: int
    """contacts that the truth does not have"""
    first_frame: int | None
    """frame of the first one of them; None if there is none"""
    first_pair: str | None
    """its two bodies"""
    contacts: tuple[DifferingContact, ...] = field(default=(), metadata=in_json(omit=True))
    """all of them, in order"""

    @property
    def is_equal(self) -> bool:
        """Whether all contacts are those of the truth, in time."""
        return not (self.missed or self.late or self.extra)


@dataclass(frozen=True, eq=False)
class GameDifference:
    """Difference of a run from the truth, as long as the truth is known."""

    error: float
    """largest distance of a body, in units of the game"""
    body: str | None
    """that body; None if no body moves"""
    frame: int | None
    """frame in which it is there"""
    within_until: int | None
    """first frame with an error of more than the tolerance; None if there is none"""
    by_frame: FloatArray
    """(F,) largest distance in each frame"""
    missing_frames: int
    """frames that one of the runs has and the other one lacks, because the game ends earlier"""
    callbacks: tuple[CallbackDifference, ...]
    """of each callback that is called in one of the runs"""

    @property
    def differing(self) -> int:
        """Number of contacts that are missed, late, early or extra."""
        return sum(each.missed + each.late + each.extra for each in self.callbacks)


@dataclass(frozen=True, eq=False)
class GameTruth:
    """Run of a game with many substeps, and how far it can be relied on."""

    run: Rehearsal
    unknown: Mapping[int, Sequence[Span]]
    """frames in which the position of a body is not known, by number of the body"""
    uncertain: frozenset[tuple[CallbackPair, int]]
    """contacts, by their first frames, that a finer or a perturbed run does not have"""
    doubtful: frozenset[tuple[CallbackPair, int]] = frozenset()
    """contacts of these runs that the truth does not have"""

    def is_known(self, body: int, frame: int) -> bool:
        """Return whether the position of a body in a frame is known."""
        return not any(start <= frame < end for start, end in self.unknown.get(body, ()))

    def knows_contacts(self, body: int, frame: int) -> bool:
        """Return whether contacts of a body in a frame count: it is known, or has not been so for a moment only.

        Around an impact, positions depend on the step, although all runs have the contact.
        """
        return not any(start + IMPACT <= frame < end for start, end in self.unknown.get(body, ()))

    def lost_from(self, body: int) -> int | None:
        """Return the frame from which on the position of a body is not known to the end; None if it is known there."""
        spans = self.unknown.get(body, ())
        last = max((end for _, end in spans), default=0)
        return max(start for start, end in spans if end == last) if last >= self.run.frames else None

    @property
    def known_fraction(self) -> float:
        """Fraction of all positions of bodies, over all frames, that are known."""
        bodies, rows = self.run.bodies, np.repeat(np.arange(self.run.frames), np.diff(self.run.offsets))
        if not len(bodies):
            return 1.0
        is_known = np.ones(len(bodies), np.bool_)
        for body, spans in self.unknown.items():
            for start, end in spans:
                is_known &= ~((bodies == body) & (start <= rows) & (rows < end))
        return float(np.mean(is_known))


def apart_spans(run: Rehearsal, other: Rehearsal, distance: float) -> dict[int, list[Span]]:
    """Return the frames in which each body is farther from its place in another run than a distance.

    A body that one of the runs lacks for longer than a frame is apart too. It is back when it has been close for
    `BACK` frames: bodies whose motion is chaotic pass each other now and then.

    Args:
        run: of a game.
        other: another one.
        distance: in units of the game.
    """
    found: dict[int, list[Span]] = {}
    began: dict[int, int] = {}
    last: dict[int, int] = {}
    absent: dict[int, int] = {}
    for frame in range(min(run.frames, other.frames)):
        bodies, apart, lacking = _apart(run, other, frame)
        still = set(lacking.tolist())
        absent = {body: absent.get(body, frame) for body in still}
        here = dict.fromkeys(bodies[apart > distance].tolist(), frame)
        here |= {body: since for body, since in absent.items() if frame - since > IN_TIME}
        for body, since in here.items():
            began.setdefault(body, since)
            last[body] = frame
        close = [body for body in bodies.tolist() if body in began and frame - last[body] >= BACK] if began else []
        for body in close:
            found.setdefault(body, []).append((began.pop(body), last[body] + 1))
    for body, start in began.items():
        found.setdefault(body, []).append((start, run.frames))
    return found


def _apart(run: Rehearsal, other: Rehearsal, frame: int) -> tuple[IntArray, FloatArray, IntArray]:
    """Return the bodies that two runs share in a frame, their distances, and the bodies that one of them lacks."""
    (bodies, states), (others, other_states) = run.frame(frame), other.frame(frame)
    if len(bodies) == len(others) and (bodies == others).all():
        difference = states[:, :2] - other_states[:, :2]
        return bodies, np.hypot(difference[:, 0], difference[:, 1]), bodies[:0]
    if not len(bodies) or not len(others):  # no space makes a step in this frame of one of the runs
        return bodies[:0], np.empty(0), bodies[:0]
    shared, rows, other_rows = np.intersect1d(bodies, others, assume_unique=True, return_indices=True)
    difference = states[rows, :2] - other_states[other_rows, :2]
    return shared, np.hypot(difference[:, 0], difference[:, 1]), np.setxor1d(bodies, others, assume_unique=True)


def difference_from(truth: GameTruth, run: Rehearsal, tolerance: float) -> GameDifference:
    """Return how far a run is from the truth.

    Args:
        truth: of the game.
        run: with other settings.
        tolerance: accepted error, in units of the game.
    """
    frames = min(truth.run.frames, run.frames)
    by_frame = np.zeros(frames)
    worst: tuple[float, int, int] | None = None
    for frame in range(frames):
        bodies, apart, _ = _apart(truth.run, run, frame)
        if truth.unknown and len(bodies):
            is_known = np.array([truth.is_known(body, frame) for body in bodies.tolist()])
            bodies, apart = bodies[is_known], apart[is_known]
        if len(bodies):
            largest = int(apart.argmax())
            by_frame[frame] = apart[largest]
            if worst is None or by_frame[frame] > worst[0]:
                worst = float(by_frame[frame]), int(bodies[largest]), frame
    beyond = np.flatnonzero(by_frame > tolerance)
    return GameDifference(
        0.0 if worst is None else worst[0],
        None if worst is None else truth.run.body_name(worst[1]),
        None if worst is None else worst[2],
        int(beyond[0]) if len(beyond) else None,
        by_frame,
        abs(truth.run.frames - run.frames),
        tuple(_callback_differences(truth, run, frames)),
    )


def contacts(run: Rehearsal) -> dict[CallbackPair, list[int]]:
    """Return the first frames of the contacts for which each callback is called, by callback and shapes."""
    found: dict[CallbackPair, list[int]] = {}
    last: dict[CallbackPair, int] = {}
    for each in run.calls:
        pair = run.callbacks[each.callback], each.shapes
        if each.frame - last.get(pair, -CHATTER - 1) > CHATTER:
            found.setdefault(pair, []).append(each.frame)
        last[pair] = each.frame
    return found


def unmatched(run: Rehearsal, other: Rehearsal) -> frozenset[tuple[CallbackPair, int]]:
    """Return the contacts of a run that another one does not have, or not in time, by their first frames."""
    theirs = contacts(other)
    found = set()
    for pair, frames in contacts(run).items():
        matches = _match(frames, theirs.get(pair, []))
        found |= {(pair, frame) for frame, match in matches if match is None or abs(match - frame) > IN_TIME}
    return frozenset(found)


def _match(frames: list[int], others: list[int]) -> Iterator[tuple[int, int | None]]:
    """Yield each frame with the nearest one of the others within the window, each of which is used once."""
    left = list(others)
    for frame in frames:
        near = min(left, key=lambda other: abs(other - frame), default=None)
        if near is not None and abs(near - frame) <= WINDOW:
            left.remove(near)
            yield frame, near
        else:
            yield frame, None


def _callback_differences(truth: GameTruth, run: Rehearsal, frames: int) -> Iterator[CallbackDifference]:
    expected, found = contacts(truth.run), contacts(run)
    for callback in dict.fromkeys([*truth.run.callbacks, *run.callbacks]):
        pairs = [pair for pair in dict.fromkeys([*expected, *found]) if pair[0] == callback]
        count = missed = late = extra = 0
        events: list[DifferingContact] = []
        for pair in pairs:
            bodies = [_body_of(truth.run, run, shape) for shape in pair[1]]
            right = [
                frame
                for frame in expected.get(pair, [])
                if _counts(truth, bodies, frame, frames) and (pair, frame) not in truth.uncertain
            ]
            here = found.get(pair, [])
            count += len(right)
            used = set()
            for frame, match in _match(right, here):
                used.add(match)
                if match is None or abs(match - frame) > IN_TIME:
                    kind = "missed" if match is None else "late" if match > frame else "early"
                    events.append(DifferingContact(frame, kind, pair[1]))
                    missed += match is None
                    late += match is not None
            known = [frame for each, frame in (*truth.uncertain, *truth.doubtful) if each == pair]
            for frame in here:
                if frame in used or any(abs(frame - other) <= WINDOW for other in known):
                    continue
                if not _counts(truth, bodies, frame, frames):
                    continue
                extra += 1
                events.append(DifferingContact(frame, "extra", pair[1]))
        if count or missed or extra:
            events.sort(key=lambda each: each.frame)
            first = events[0] if events else None
            yield CallbackDifference(
                str(callback),
                count,
                missed,
                late,
                extra,
                None if first is None else first.frame,
                None if first is None else _pair_text(truth.run, run, first.shapes),
                tuple(events),
            )


def _body_of(truth: Rehearsal, run: Rehearsal, shape: int) -> int:
    bodies = truth.shape_bodies if shape in truth.shape_bodies else run.shape_bodies
    return bodies[shape]


def _counts(truth: GameTruth, bodies: Sequence[int], frame: int, frames: int) -> bool:
    """Return whether a contact of two bodies in a frame counts."""
    return frame < frames - IN_TIME and all(truth.knows_contacts(body, frame) for body in bodies)


def _pair_text(truth: Rehearsal, run: Rehearsal, shapes: tuple[int, int]) -> str:
    names = (_body_of(truth, run, shape) for shape in shapes)
    return " and ".join("the static body" if body < 0 else truth.body_name(body) for body in names)
