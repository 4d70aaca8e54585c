"""Audit: the contacts that an engine never saw, or saw too late.

A fixed-step engine looks for overlap at the end of each substep only. What comes into contact and out again in
between is lost to it; what it finds on the far side it pushes out there.
"""

import numpy as np

from sandbox.measure.neighbours import Neighbours
from sandbox.measure.obstacles import Obstacles
from sandbox.measure.sweep import CLEAR, DEEP, JUMP, approaching, closest_to_origin, dot
from sandbox.measure.touching import Touching
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.trajectory import BoolArray, FloatArray, IntArray

FAR = 1e50
"""m: who is farther out is diverging and does not count; fourth powers of it still are finite."""


class Audit:
    """Counts missed contacts; an `Observer` to be called after every substep.

    Within a substep, in which every centre moves along a straight line, a pair that can meet is missed when

    1. it jumps: its relative displacement is at least `JUMP` (0.1 %) of its contact distance. One that moves less
       cannot be through before it is looked at;
    2. it is clear at the start: no deeper than half the tolerance, and not in contact at the end of the last
       substep;
    3. it is deep somewhere on the way: by more than `TOLERANCE` (1e-6) of its contact distance;
    4. the engine did not see it in time: the pair is not in contact at the end, or is but no longer approaches
       there, its closest approach lying behind.

    Contact distance is the sum of the radii, for a wall the radius and half the thickness. A plane is a solid
    `BACKING` deep: there the fourth condition is no contact, or a centre deeper than the backing. A wall is one
    thing: it is approached if any of its segments in reach is; besides, whoever passes through the line of a
    segment of which it was clear has missed the wall, whatever the engine finds on the far side and on whichever
    other segment it rested. Bodies whose places are nan, before or after, are gone and miss nothing.

    So a passage counts once: a pair that is through or still inside is not clear, or moves away.

    Limits: motion is taken to be straight, as in pymunk, with no rotation, which circles do not feel. The cost
    grows with (bodies that jump) × (segments and planes); among balls with the pairs that are near.
    """

    def __init__(self, scene: Scene, bodies: Bodies | None = None) -> None:
        self._obstacles = Obstacles.of(scene)
        self._times: list[FloatArray] = []
        self._pairs: list[IntArray] = []
        self._before = Touching(np.empty((0, 2), np.int64))
        self.joined(scene.bodies if bodies is None else bodies)

    def joined(self, bodies: Bodies) -> None:
        """Take note that bodies were added; `bodies` are all of them."""
        every = np.asarray([e.collides == "all" for e in bodies.elements], np.bool_)[bodies.element]
        some = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element]
        moves, to_all, still = some & ~bodies.fixed, every & ~bodies.fixed, every & bodies.fixed
        member = to_all | still | (moves & bool(still.any()))

        # Of two that jump together, one moves half as far at least.
        least = np.full(len(bodies), np.inf)
        balls = bodies.radius[member]
        if len(balls) > 1:
            least[member] = JUMP * (balls + balls.min()) / 2
        if len(self._obstacles):
            least[moves] = np.minimum(least, JUMP * bodies.radius)[moves]

        # Bodies of a kind stand together: those before the first and after the last that matter cost nothing.
        matter = np.flatnonzero(np.isfinite(least))
        self._number = len(bodies)
        self._offset = int(matter[0]) if len(matter) else 0
        self._part = part = slice(self._offset, int(matter[-1]) + 1 if len(matter) else 0)
        self._moves, self._to_all, self._still = moves[part], to_all[part], still[part]
        self._radius = bodies.radius[part]
        self._least2 = least[part] ** 2 * (1 - 1e-9)  # rounding must not hide a pair from the exact test
        self._neighbours = Neighbours(self._radius, member[part], self._meet)

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        """Look at one substep.

        Args:
            time: at its start, s.
            start: centres (N, 2), m.
            end: centres (N, 2), m.
            touching: pairs (K, 2) in contact at the end, numbered as in `Contacts`.

        Raises:
            ValueError: N is not the number of bodies; `joined` tells of new ones.
        """
        if len(start) != self._number:
            raise ValueError(f"{len(start)} bodies, where the audit knows of {self._number}")
        if not len(self._radius):
            return
        before, self._before = self._before, Touching(touching)
        start, end = start[self._part], end[self._part]
        with np.errstate(invalid="ignore", over="ignore"):  # diverging bodies reach inf; they drop out below
            move = end - start
            move *= move
            fast = np.asarray(move[:, 0] + move[:, 1] >= self._least2)
        if fast.any():
            self._look(time, start, end, fast, before, self._before)

    def _look(
        self, time: float, start: FloatArray, end: FloatArray, fast: BoolArray, before: Touching, after: Touching
    ) -> None:
        """Examine the part that matters, in which `fast` bodies move far enough to skip a look."""
        lost = ~((np.abs(start) < FAR).all(axis=1) & (np.abs(end) < FAR).all(axis=1))
        if lost.any():
            start, end = (np.where(lost[:, None], np.nan, place) for place in (start, end))
            fast = fast & ~lost
        who = np.flatnonzero(fast & self._moves)
        paths = who + self._offset, start[who], end[who], self._radius[who]
        missed = np.concatenate(
            (
                self._balls(start, end, fast, before, after),
                self._obstacles.missed(*paths, before, after),
            )
        )
        if len(missed):
            self._pairs.append(missed[np.lexsort((missed[:, 1], missed[:, 0]))])
            self._times.append(np.full(len(missed), time))

    @property
    def times(self) -> FloatArray:
        """When the substep of each miss began, (M,) s."""
        return np.concatenate((np.empty(0), *self._times))

    @property
    def pairs(self) -> IntArray:
        """Who missed whom, (M, 2), numbered as in `Contacts`."""
        return np.concatenate((np.empty((0, 2), np.int64), *self._pairs))

    def missed(self) -> tuple[FloatArray, IntArray]:
        """Return `times` and `pairs`."""
        return self.times, self.pairs

    def _meet(self, i: IntArray, j: IntArray) -> BoolArray:
        """Return which pairs of bodies can touch."""
        able = self._to_all[i] & self._to_all[j]
        able |= self._moves[i] & self._still[j]
        able |= self._still[i] & self._moves[j]
        return np.asarray(able)

    def _balls(
        self, start: FloatArray, end: FloatArray, fast: BoolArray, before: Touching, after: Touching
    ) -> IntArray:
        """Return the missed pairs of bodies, (M, 2)."""
        i, j = self._neighbours.pairs(start, end, fast)
        gap = start[j] - start[i]
        move = end[j] - start[j] - (end[i] - start[i])
        distance2 = (self._radius[i] + self._radius[j]) ** 2
        able = (dot(gap, move) < 0) & (dot(gap, gap) >= CLEAR**2 * distance2)
        able &= dot(move, move) >= JUMP**2 * distance2
        at = np.flatnonzero(able)
        at = at[closest_to_origin(gap[at], move[at]) < DEEP**2 * distance2[at]]
        pair = np.column_stack((i[at], j[at])) + self._offset
        in_time = after.has(pair) & approaching(gap[at] + move[at], move[at])
        return pair[~in_time & ~before.has(pair)]
