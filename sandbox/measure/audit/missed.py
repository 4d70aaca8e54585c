"""Audit: the contacts that an engine never saw, or saw too late.

A fixed-step engine looks for overlap at the end of each substep only. What comes into contact and out again in
between is lost to it; what it finds on the far side it pushes out there.
"""

from itertools import pairwise

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.audit.looks import Looks
from sandbox.measure.audit.neighbours import Neighbours
from sandbox.measure.audit.obstacles import Obstacles, Paths
from sandbox.measure.audit.sweep import CLEAR, DEEP, JUMP, approaching, closest_to_origin, dot
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene

LONGEST_BATCH = 32
"""Substeps examined together: spreads the cost of a call of numpy."""
BATCH_ROWS = 1 << 14
"""Centres in a batch of more than one substep: they stay in cache."""

CHUNK = 1 << 13
"""Encounters looked at together: they stay in cache."""

FAR = 1e50
"""m: who is farther out is diverging and does not count; fourth powers of it still are finite."""


class Audit:
    """Counts missed contacts; an `Observer` to be called after every substep.

    Within a substep, in which every centre moves along a straight line, a pair that can meet is missed when

    1. it jumps: its relative displacement is at least `JUMP` (7 %) of its contact distance. One that moves less
       cannot be through before it is looked at;
    2. it is clear at the start: no deeper than half the tolerance, and not in contact at the end of the last
       substep;
    3. it is deep somewhere on the way: by more than `TOLERANCE` (0.5 %) of its contact distance;
    4. the engine did not see it in time: the pair is not in contact at the end, or is but no longer approaches
       there, its closest approach lying behind.

    Contact distance is the sum of the radii, for a wall the radius and half the thickness. A plane is a solid
    `BACKING` deep: there the fourth condition is no contact, or a centre deeper than the backing. A wall is one
    thing: it is approached if any of its segments in reach is; besides, whoever passes through the line of a
    segment of which it was clear has missed the wall, whatever the engine finds on the far side and on whichever
    other segment it rested. Bodies whose places are nan, before or after, are gone and miss nothing.

    So a passage counts once: a pair that is through or still inside is not clear, or moves away.

    All this is exact for discs. Of any other body it takes `Bodies.core`, the largest disc about the centre of mass
    that lies inside it, for the radius: what passes through that was surely missed, so that there is no false alarm,
    but what only clips a corner is not counted. A body whose core is 0, as its centre of mass lies outside of it, is
    left out. Pairs that a joint keeps from meeting, and bodies of one
    group, miss nothing; nor does who is on different layers, or changes its own within the substep, nor those that
    strokes and plungers lead through fixed things.

    Limits: motion is taken to be straight, as in pymunk. The cost grows with (bodies that jump) × (segments and
    planes), and among balls with the pairs that are near.
    """

    def __init__(self, start: Scene | Setup, bodies: Bodies | None = None) -> None:
        setup = Setup.of(start)
        scene = setup.scene
        self._obstacles = Obstacles.of(scene)
        self._apart = setup.links.apart()
        self._led = frozenset(drive.body for drive in scene.drives if drive.kind != "torque")
        self._times: list[FloatArray] = []
        self._pairs: list[IntArray] = []
        self._looks = Looks()
        self._looks.add(np.empty((0, 2), np.int64))
        self._on: IntArray = np.zeros((0, 0), np.int64)  # layers, as bits; without rows where there is one alone
        self._lay_out(setup.bodies if bodies is None else bodies)

    def joined(self, bodies: Bodies) -> None:
        """Take note that bodies were added; `bodies` are all of them."""
        self._examine()
        self._lay_out(bodies)

    def changed(self, scene: Scene, bodies: Bodies) -> None:
        """Take note that other things are solid now; `bodies` are all there are."""
        self._examine()
        self._obstacles = Obstacles.of(scene)
        self._lay_out(bodies)

    def __call__(
        self, time: float, start: FloatArray, end: FloatArray, touching: IntArray, on: IntArray | None = None
    ) -> None:
        """Take note of one substep; they are examined some at a time. The arrays are copied.

        Args:
            time: at its start, s.
            start: centres (N, 2), m.
            end: centres (N, 2), m.
            touching: pairs (K, 2) in contact at the end, numbered as in `Contacts`.
            on: (N,) the layers on which each was all the while, as bits, where there are several; who shares none
                with another misses it rightly.

        Raises:
            ValueError: N is not the number of bodies; `joined` tells of new ones.
        """
        if len(start) != self._number:
            raise ValueError(f"{len(start)} bodies, where the audit knows of {self._number}")
        if not len(self._core):
            return
        row = len(self._time)
        self._start[row] = start[self._part]
        self._end[row] = end[self._part]
        if on is not None:
            if not len(self._on):
                self._on = np.zeros(self._start.shape[:2], np.int64)
            self._on[row] = on[self._part]
        self._looks.add(touching)
        self._time.append(time)
        if len(self._time) == len(self._start):
            self._examine()

    @property
    def times(self) -> FloatArray:
        """When the substep of each miss began, (M,) s."""
        self._examine()
        return np.concatenate((np.empty(0), *self._times))

    @property
    def pairs(self) -> IntArray:
        """Who missed whom, (M, 2), numbered as in `Contacts`; by time, then by number."""
        self._examine()
        return np.concatenate((np.empty((0, 2), np.int64), *self._pairs))

    def missed(self) -> tuple[FloatArray, IntArray]:
        """Return `times` and `pairs`."""
        return self.times, self.pairs

    def _lay_out(self, bodies: Bodies) -> None:
        """Derive who can meet what, and how far each must move at least to skip a look."""
        every = np.asarray([e.collides == "all" for e in bodies.elements], np.bool_)[bodies.element]
        some = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element]
        every, some = every & (bodies.core > 0.0), some & (bodies.core > 0.0)
        moves, to_all, still = some & ~bodies.fixed, every & ~bodies.fixed, every & bodies.fixed
        member = to_all | still | (moves & bool(still.any()))

        # Of two that jump together, one moves half as far at least.
        least = np.full(len(bodies), np.inf)
        cores = bodies.core[member]
        if len(cores) > 1:
            least[member] = JUMP * (cores + cores.min()) / 2
        if len(self._obstacles):
            least[moves] = np.minimum(least, JUMP * bodies.core)[moves]

        # Bodies of a kind stand together: those before the first and after the last that matter cost nothing.
        matter = np.flatnonzero(np.isfinite(least))
        self._number = len(bodies)
        self._offset = int(matter[0]) if len(matter) else 0
        self._part = part = slice(self._offset, int(matter[-1]) + 1 if len(matter) else 0)
        self._moves, self._to_all, self._still = moves[part], to_all[part], still[part]
        self._core = bodies.core[part]
        self._lands = self._moves
        if self._led:  # what a stroke or a plunger leads passes through what never moves
            self._lands = self._moves & ~np.isin(bodies.names[part], [*self._led])
        self._group = bodies.group[part] if bodies.group.any() else None
        self._least2 = least[part] ** 2 * (1 - 1e-9)  # rounding must not hide a pair from the exact test
        self._neighbours = Neighbours(self._core, member[part], self._meet)

        batch = max(1, min(LONGEST_BATCH, BATCH_ROWS // max(1, len(self._core))))
        self._time: list[float] = []
        self._start = np.empty((batch, len(self._core), 2))
        self._end = np.empty_like(self._start)
        self._on = np.zeros((0, 0), np.int64)

    def _examine(self) -> None:
        """Examine the substeps that wait."""
        start, end = self._start[: len(self._time)], self._end[: len(self._time)]
        with np.errstate(invalid="ignore", over="ignore"):  # diverging bodies reach inf; they drop out here
            move = end - start
            move *= move
            length2 = move[..., 0] + move[..., 1]
        fast = length2 >= self._least2
        if fast.any():
            lost = ~(length2 < FAR**2)
            when, who = np.nonzero(fast)
            lost[when, who] |= (np.abs(start[when, who]) > FAR).any(axis=1)
            if lost.any():
                start[lost] = end[lost] = np.nan
                length2[lost] = 0.0
                fast &= ~lost
            nearing = 2 * float(np.sqrt(length2.max()))
            found = self._balls(start, end, fast, nearing), self._fixed(start, end, fast)
            when = np.concatenate([when for when, _ in found])
            pairs = np.concatenate([pairs for _, pairs in found])
            if len(when):
                order = np.lexsort((pairs[:, 1], pairs[:, 0], when))
                self._times.append(np.asarray(self._time)[when[order]])
                self._pairs.append(pairs[order])
        self._time.clear()
        self._looks.forget()

    def _fixed(self, start: FloatArray, end: FloatArray, fast: BoolArray) -> tuple[IntArray, IntArray]:
        """Return when (M,) which pairs (M, 2) of a body and a fixed thing were missed."""
        when, who = np.nonzero(fast & self._lands)
        on = self._on[when, who] if len(self._on) else None
        paths = Paths(when, who + self._offset, start[when, who], end[when, who], self._core[who], on)
        return self._obstacles.missed(paths, self._looks)

    def _meet(self, i: IntArray, j: IntArray) -> BoolArray:
        """Return which pairs of bodies can touch."""
        able = self._to_all[i] & self._to_all[j]
        able |= self._moves[i] & self._still[j]
        able |= self._still[i] & self._moves[j]
        if self._group is not None:
            able &= (self._group[i] == 0) | (self._group[i] != self._group[j])
        if len(self._apart):
            pair = _coded(np.minimum(i, j) + self._offset, np.maximum(i, j) + self._offset)
            able &= ~np.isin(pair, _coded(*self._apart.T))
        return np.asarray(able)

    def _balls(self, start: FloatArray, end: FloatArray, fast: BoolArray, nearing: float) -> tuple[IntArray, IntArray]:
        """Return when (M,) which pairs (M, 2) of bodies were missed; none comes nearer by more than `nearing`."""
        when, i, j = self._neighbours.encounters(start, end, fast)
        if len(self._on):
            near = (self._on[when, i] & self._on[when, j]) != 0
            when, i, j = when[near], i[near], j[near]
        parts = len(when) // CHUNK + 1
        at = np.concatenate(
            [
                begin + self._deep(start, end, nearing, *(column[begin:stop] for column in (when, i, j)))
                for begin, stop in pairwise(np.linspace(0, len(when), parts + 1, dtype=np.int64).tolist())
            ]
        )
        when, pair = when[at], np.column_stack((i[at], j[at])) + self._offset
        last = _offset(end, when, i[at], j[at])
        late = ~approaching(last, last - _offset(start, when, i[at], j[at]))
        late[~late] = ~self._looks.found(when[~late] + 1, pair[~late])
        when, pair = when[late], pair[late]
        new = ~self._looks.found(when, pair)
        return when[new], pair[new]

    def _deep(
        self, start: FloatArray, end: FloatArray, nearing: float, when: IntArray, i: IntArray, j: IntArray
    ) -> IntArray:
        """Return which encounters lead from clear into deep contact on a path that can skip a look."""
        gap = _offset(start, when, i, j)
        distance2, contact = dot(gap, gap), self._core[i] + self._core[j]
        at = np.flatnonzero((distance2 >= (CLEAR * contact) ** 2) & (distance2 <= (contact + nearing) ** 2))
        gap, contact = gap[at], contact[at]
        move = _offset(end, when[at], i[at], j[at]) - gap
        able = (dot(gap, move) < 0) & (dot(move, move) >= (JUMP * contact) ** 2)
        able &= closest_to_origin(gap, move) < (DEEP * contact) ** 2
        return at[able]


def _coded(first: IntArray, second: IntArray) -> IntArray:
    """Return a number for each pair of bodies, of which there are less than 2³¹."""
    return np.asarray(first * (1 << 32) + second)


def _offset(place: FloatArray, when: IntArray, i: IntArray, j: IntArray) -> FloatArray:
    """Return where the second of each pair is from the first, (K, 2)."""
    # As complex numbers two coordinates are fetched at once: three times as fast as rows of an array.
    point, row = place.view(np.complex128).reshape(-1), when * place.shape[1]
    between = point.take(row + j) - point.take(row + i)
    return np.asarray(between.view(np.float64).reshape(-1, 2))
