"""Finder: broad phase, then narrow phase; from positions to manifolds."""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable

import numpy as np

from sandbox.engines.reference.broad_phase import BROAD_PHASES
from sandbox.engines.reference.candidates import Candidates
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.segments import SegmentBoxes
from sandbox.engines.reference.sieve import Sieve
from sandbox.engines.roster import NOTHING, Roster
from sandbox.trajectory import BoolArray, FloatArray, IntArray

WORK = "broad_tests", "pair_tests", "contacts", "contact_iterations", "joint_iterations"
"""What is counted; the solvers count their passes in with what is found."""


class Finder(ABC):
    """Finds contacts, in the order of their keys, whichever broad phase; counts the work. Of what, its kinds say."""

    sieve: Sieve | None = None
    """what keeps apart those near each other that do not meet, where something does"""
    _owner: IntArray
    """body of each ball, or piece"""

    def __init__(self, roster: Roster, broad_phase: str) -> None:
        self._roster, self._broad_phase = roster, BROAD_PHASES[broad_phase]
        self._ball_keys, self._segment_keys = np.empty(64, np.int64), np.empty(64, np.int64)
        self._out = _room_for(64)
        self._none = self._out.of(slice(0))
        self.work: Counter[str] = Counter(dict.fromkeys(WORK, 0))
        self.population_changed()

    def population_changed(self) -> None:
        """Work out anew who can meet what."""
        roster = self._roster
        self.able: BoolArray = roster.moving & (roster.meets > NOTHING)
        self._moves: BoolArray = roster.mobile
        self._order: IntArray = np.arange(len(roster.position))
        self._boxes = SegmentBoxes(roster.fixtures)
        self._planes = len(roster.fixtures.planes) if self.able.any() else 0
        self._plane_tests = self._planes * int(np.count_nonzero(self.able))
        touching = roster.radius[self.able]
        self.widest = float(roster.radius[roster.meets > NOTHING].max(initial=0.0))
        """m; the largest radius of what can touch anything"""
        alone = not (roster.meet.ball_ball or self._planes or len(self._boxes))
        self.thinnest = np.inf if alone else float(touching.min(initial=np.inf))
        """m; the smallest radius of what moves and can touch anything"""
        self.use(roster.restitution)

    def use(self, restitution: FloatArray) -> None:
        """Enter figures of one's own (S, S) into the manifolds, in the place of restitution."""
        self._tables = restitution, self._roster.friction

    @abstractmethod
    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> Candidates:
        """Return the pairs worth a look at (N, ≥ 2) poses, m: none nearer than the margin, m, is left out.

        Where walls and posts alone are asked for, the sieve leaves them all in.
        """

    def _filled(self, room: IntArray, search: Callable[[IntArray], tuple[int, int]]) -> tuple[IntArray, IntArray]:
        """Return what a search finds, sorted, and the room that it took: more where there was too little."""
        found, tests = search(room)
        if found > len(room):
            room = np.empty(2 * found, np.int64)
            found, tests = search(room)
        self.work["broad_tests"] += tests
        return room, np.sort(room[:found])

    def manifolds(self, position: FloatArray, near: Candidates, reach: float = 0.0) -> Manifolds:
        """Return the contacts among candidates: those nearer than `reach`, m; 0 for overlap alone.

        They are good until the next look.
        """
        size = self._looked(position, near, reach)
        if size > len(self._out.key):
            self._out = _room_for(2 * size)
            self._looked(position, near, reach)
        self.work["pair_tests"] += len(near.balls) + len(near.segments) + self._plane_tests
        self.work["contacts"] += size
        if not size:
            return self._none
        found = self._out.of(slice(0, size))
        return found if self.sieve is None else self.sieve.on_planes(found)

    def at_gates(self, position: FloatArray) -> Manifolds:
        """Return where bodies overlap one-way walls, whether these stop them or not; good until the next look."""
        assert self.sieve is not None
        near = self.sieve.at_gates(self.candidates(position, walls_alone=True), self._owner)
        if not len(near.segments):
            return self._none
        found = self.manifolds(position, near)
        return found.of(self.sieve.gate(found.second))

    @abstractmethod
    def _looked(self, position: FloatArray, near: Candidates, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""

    @abstractmethod
    def farthest(self, start: FloatArray, end: FloatArray) -> float:
        """Return the longest way, m, of any point of those that can touch anything, between two sets of poses."""

    def overlaps(self, position: FloatArray) -> Manifolds:
        """Return all contacts at (N, ≥ 2) positions, m. They are good until the next look."""
        return self.manifolds(position, self.candidates(position))


def _room_for(size: int) -> Manifolds:
    """Return unset manifolds."""
    return Manifolds(
        key=np.empty(size, np.int64),
        first=np.empty(size, np.int64),
        second=np.empty(size, np.int64),
        normal=np.empty((size, 2)),
        separation=np.empty(size),
        point=np.empty((size, 2)),
        arm=np.empty((size, 2)),
        offset=np.zeros((size, 2)),  # where only discs meet it stays so
        coefficient=np.empty((size, 2)),
    )
