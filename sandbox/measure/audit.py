"""Audit: the contacts that an engine never saw, or saw too late.

A fixed-step engine looks for overlap at the end of each substep only. What comes into contact and out again in
between is lost to it; what it finds on the far side it pushes out there.
"""

from dataclasses import dataclass, field

import numpy as np

from sandbox.measure.neighbours import Neighbours
from sandbox.measure.sweep import (
    approaching,
    closest_to_origin,
    closest_to_segment,
    dot,
    from_segment,
)
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Post, Scene, Wall
from sandbox.scene.near import CHUNK
from sandbox.scene.part import BACKING
from sandbox.trajectory import BoolArray, FloatArray, IntArray

TOLERANCE = 1e-6
"""Depth, of the radii's sum, below which a contact does not count. So shallow a graze turns a path by 1e-3 of its
speed at most, and an engine that tests overlap in another order of operations may rightly find none. A pair is
clear, and can come into contact, when it is no deeper than half of it: bodies laid out to touch are."""

CLEAR = 1 - TOLERANCE / 2
DEEP = 1 - TOLERANCE
JUMP = float(np.sqrt(CLEAR**2 - DEEP**2))
"""The shortest relative path, of the radii's sum, that can skip a look: from clear to the closest approach of a
path that is deep there. Distance to a convex thing is curved by 1/distance at most, so going back from the closest
approach q the distance after a path x is √(q² + x²) at most: x² ≥ CLEAR² − DEEP², half a chord of the circle."""

FAR = 1e50
"""m: who is farther out is diverging and does not count; fourth powers of it still are finite."""

PLANE_ROUNDING = 1e-11
"""m: added to the tolerance at planes, which engines make of shapes kilometres large; they round at 3e-13 m."""


class Audit:
    """Counts missed contacts; an `Observer` to be called after every substep.

    Within a substep, in which every centre moves along a straight line, a pair that can meet is missed when

    1. it jumps: its relative displacement is at least `JUMP` (0.1 %) of its contact distance. One that moves less
       cannot be through before it is looked at;
    2. it is clear at the start: no deeper than half the tolerance, and not in contact at the end of the last
       substep;
    3. it is deep somewhere on the way: by more than `TOLERANCE` of its contact distance;
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
        self._fixed = _Fixed.of(scene)
        self._times: list[FloatArray] = []
        self._pairs: list[IntArray] = []
        self._before = np.empty((0, 2), np.int64)
        self.joined(scene.bodies if bodies is None else bodies)

    def joined(self, bodies: Bodies) -> None:
        """Take note that bodies were added; `bodies` are all of them."""
        every = np.asarray([e.collides == "all" for e in bodies.elements], np.bool_)[bodies.element]
        some = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element]
        self._radius = bodies.radius
        self._moves = some & ~bodies.fixed
        self._to_all = every & ~bodies.fixed
        self._still = every & bodies.fixed
        member = self._to_all | self._still | (self._moves & bool(self._still.any()))
        self._neighbours = Neighbours(self._radius, member, self._meet)

        # Of two that jump together, one moves half as far at least.
        least = np.full(len(bodies), np.inf)
        balls = self._radius[member]
        if len(balls) > 1:
            least[member] = JUMP * (balls + balls.min()) / 2
        if len(self._fixed):
            least[self._moves] = np.minimum(least, JUMP * self._radius)[self._moves]
        self._least2 = least * least * (1 - 1e-9)  # rounding must not hide a pair from the exact test

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
        if len(start) != len(self._radius):
            raise ValueError(f"{len(start)} bodies, where the audit knows of {len(self._radius)}")
        before, self._before = self._before, touching.copy()
        with np.errstate(invalid="ignore", over="ignore"):  # diverging bodies reach inf; they drop out below
            move = end - start
            square = move * move
            fast = square[:, 0] + square[:, 1] >= self._least2
        if fast.any():
            self._look(time, start, end, fast, _Seen(before), _Seen(touching))

    def _look(
        self, time: float, start: FloatArray, end: FloatArray, fast: BoolArray, before: "_Seen", after: "_Seen"
    ) -> None:
        lost = ~((np.abs(start) < FAR).all(axis=1) & (np.abs(end) < FAR).all(axis=1))
        if lost.any():
            start, end = (np.where(lost[:, None], np.nan, place) for place in (start, end))
            fast = fast & ~lost
        who = np.flatnonzero(fast & self._moves)
        missed = np.concatenate(
            (
                self._balls(start, end, fast, before, after),
                self._fixed.missed_walls(who, start[who], end[who], self._radius[who], before, after),
                self._fixed.missed_planes(who, start[who], end[who], self._radius[who], before, after),
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
        self, start: FloatArray, end: FloatArray, fast: BoolArray, before: "_Seen", after: "_Seen"
    ) -> IntArray:
        """Return the missed pairs of bodies, (M, 2)."""
        i, j = self._neighbours.pairs(start, end, fast)
        gap = start[j] - start[i]
        move = end[j] - start[j] - (end[i] - start[i])
        distance2 = (self._radius[i] + self._radius[j]) ** 2
        able = (dot(gap, move) < 0) & (dot(gap, gap) >= CLEAR**2 * distance2)
        able &= dot(move, move) >= JUMP**2 * distance2
        i, j, gap, move, distance2 = (column[able] for column in (i, j, gap, move, distance2))
        deep = closest_to_origin(gap, move) < DEEP**2 * distance2
        i, j, gap, move = (column[deep] for column in (i, j, gap, move))
        pair = np.column_stack((i, j))
        if not len(pair):
            return pair
        in_time = after.has(pair) & approaching(gap + move, move)
        return pair[~in_time & ~before.has(pair)]


class _Seen:
    """The pairs that an engine found in contact."""

    def __init__(self, pairs: IntArray) -> None:
        self._pairs = pairs

    def has(self, pair: IntArray) -> BoolArray:
        """Return which of pairs (K, 2) are among them."""
        both = np.concatenate((self._pairs, pair))
        low = both.min(axis=0, initial=0)
        width = int(both[:, 1].max(initial=0) - low[1]) + 1
        code = (both[:, 0] - low[0]) * width + both[:, 1] - low[1]
        return np.isin(code[len(self._pairs) :], code[: len(self._pairs)])
