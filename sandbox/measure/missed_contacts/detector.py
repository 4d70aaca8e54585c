"""Detector of missed contacts: contacts that an engine never detected, or detected too late.

A fixed-step engine tests for overlap at the end of each substep only. A contact that begins and ends within a substep
is lost. A body that has reached the far side of an obstacle is pushed out on that side.
"""

from itertools import pairwise

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.contract import PairRuns
from sandbox.measure.missed_contacts.contact_history import ContactHistory, pair_keys
from sandbox.measure.missed_contacts.static_geometry import StaticGeometry, SweptCircles
from sandbox.measure.missed_contacts.swept_geometry import CLEAR, DEEP, JUMP, approaching, closest_to_origin, dot
from sandbox.measure.missed_contacts.verlet_list import VerletList
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup

MAX_BATCH = 32
"""Largest number of substeps that are examined together, which spreads the cost of numpy calls."""
BATCH_ROWS = 1 << 14
"""Centres in a batch of several substeps, so that they stay in the cache."""

MAX_PATH_BATCH = 1024
"""Largest number of substeps of a path that are examined together."""
PATH_ROWS = 1 << 15
"""Centres in such a part of a path."""

CHUNK = 1 << 13
"""Encounters that are examined together, so that they stay in the cache."""

MAX_COORDINATE = 1e50
"""m: a body farther out is diverging and does not count; fourth powers of this are still finite."""


class Audit:
    """Counter of missed contacts; an `Observer` that is called after every substep.

    Every centre moves along a straight line within a substep. A pair that can collide misses a contact if

    1. it jumps: its relative displacement is at least `JUMP` (7 %) of its contact distance. A pair that moves less
       cannot pass through before the next test;
    2. it is clear at the start: no deeper than half the tolerance, and not in contact at the end of the last substep;
    3. it is deep somewhere on its path: by more than `TOLERANCE` (0.5 %) of its contact distance;
    4. the engine does not detect it in time: the pair is not in contact at the end, or it is but no longer approaches
       there, because its closest approach is already over.

    The contact distance is the sum of the radii; for a wall it is the radius and half the thickness. A plane is a solid
    that is `BACKING` deep: condition 4 is then no contact, or a centre deeper than the backing. A wall is one object:
    it is approached if any of its segments in reach is. A body that passes through the line of a segment from
    which it was clear has missed the wall, regardless of contacts on the far side and of other segments on which the
    body rested. Bodies whose position is nan before or after the substep do not count.

    A passage therefore counts once: a pair that has passed or is still inside is not clear, or moves apart.

    This is exact for discs. Of any other body, the radius is `Bodies.core`, the largest disc about the centre of mass
    inside the body: a passage through it was missed with certainty, so that there are no false alarms, but a contact
    with a corner only is not counted; `with_slender_passages` adds the passages of the ends of slender bodies. A body
    with a core of 0, whose centre of mass lies outside, is left out. Pairs
    whose collisions a joint or their categories disable, bodies of one group, bodies on different layers or that change
    their layer within the substep, and bodies that strokes and plungers move through static objects do not count.
    Neither do kinematic bodies that pass through static objects or each other, nor one-way bodies.

    Limits: motion is taken to be straight, as in pymunk. The cost grows with (bodies that jump) × (segments and
    planes), and among balls with the number of close pairs.
    """

    def __init__(self, start: Scene | Setup, bodies: Bodies | None = None) -> None:
        setup = Setup.of(start)
        scene = setup.scene
        self._scene = scene
        self._static_geometry = _static_geometry(setup)
        self._apart = setup.joints.apart()
        self._kinematic = frozenset(drive.body for drive in scene.drives if drive.kind != "torque")
        self._times: list[FloatArray] = []
        self._pairs: list[IntArray] = []
        self._history = ContactHistory()
        self._history.add(np.empty((0, 2), np.int64))
        self._layer_bits: IntArray = np.zeros((0, 0), np.int64)  # layers as bits; empty if there is a single layer
        self._classify_bodies(setup.bodies if bodies is None else bodies)

    def joined(self, bodies: Bodies) -> None:
        """Include bodies that were added.

        Args:
            bodies: all bodies.
        """
        self._examine()
        self._classify_bodies(bodies)

    def changed(self, scene: Scene, bodies: Bodies) -> None:
        """Include changes of the static objects.

        Args:
            scene: scene with the present static objects.
            bodies: all bodies.
        """
        self._examine()
        self._scene = scene
        self._static_geometry = StaticGeometry.of(scene)
        self._classify_bodies(bodies)

    def __call__(
        self, time: float, start: FloatArray, end: FloatArray, touching: IntArray, on: IntArray | None = None
    ) -> None:
        """Record one substep; several are examined together. The arrays are copied.

        Args:
            time: start of the substep, s.
            start: centres at the start, (N, 2) m.
            end: centres at the end, (N, 2) m.
            touching: pairs (K, 2) in contact at the end, with the indices of `Contacts`.
            on: layer of each body throughout the substep as a bit, (N,), if there are several layers; bodies on
                different layers cannot collide.

        Raises:
            ValueError: N is not the number of bodies; `joined` adds bodies.
        """
        if len(start) != self._body_count:
            raise ValueError(f"{len(start)} bodies, where the audit knows of {self._body_count}")
        if not len(self._core):
            return
        row = len(self._time)
        self._start[row] = start[self._part]
        self._end[row] = end[self._part]
        if on is not None:
            if not len(self._layer_bits):
                self._layer_bits = np.zeros(self._start.shape[:2], np.int64)
            self._layer_bits[row] = on[self._part]
        self._history.add(touching)
        self._time.append(time)
        if len(self._time) == len(self._start):
            self._examine()

    @property
    def has_bodies(self) -> bool:
        """Whether any body can miss a contact."""
        return len(self._core) > 0

    @property
    def times(self) -> FloatArray:
        """Start of the substep of each missed contact, (M,) s."""
        self._examine()
        return np.concatenate((np.empty(0), *self._times))

    @property
    def pairs(self) -> IntArray:
        """Pairs that missed a contact, (M, 2), with the indices of `Contacts`; sorted by time, then by index."""
        self._examine()
        return np.concatenate((np.empty((0, 2), np.int64), *self._pairs))

    def missed(self) -> tuple[FloatArray, IntArray]:
        """Return `times` and `pairs`."""
        return self.times, self.pairs

    def can_collide(self, first: IntArray, second: IntArray) -> BoolArray:
        """Return which pairs of body indices (K,), (K,) can collide, of those whose contacts are audited."""
        i, j = first - self._offset, second - self._offset
        able = (np.minimum(i, j) >= 0) & (np.maximum(i, j) < len(self._core))
        able[able] = self._can_collide(i[able], j[able])
        return able

    def _classify_bodies(self, bodies: Bodies) -> None:
        """Derive the collision classes of the bodies, and the smallest displacement that can miss a contact."""
        collides_with_all = np.asarray([e.collides == "all" for e in bodies.elements], np.bool_)[bodies.element]
        some = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element]
        collides_with_all, some = collides_with_all & (bodies.core > 0.0), some & (bodies.core > 0.0)
        for index in bodies.one_way:  # others may pass it
            collides_with_all[index] = some[index] = False
        moves, moving_to_all, static = (
            some & ~bodies.fixed,
            collides_with_all & ~bodies.fixed,
            collides_with_all & bodies.fixed,
        )
        member = moving_to_all | static | (moves & bool(static.any()))

        # If a pair jumps, one of the two moves at least half as far.
        smallest = np.full(len(bodies), np.inf)
        cores = bodies.core[member]
        if len(cores) > 1:
            smallest[member] = JUMP * (cores + cores.min()) / 2
        if len(self._static_geometry):
            smallest[moves] = np.minimum(smallest, JUMP * bodies.core)[moves]

        # Bodies of one kind are adjacent: those before the first and after the last relevant one are left out.
        relevant = np.flatnonzero(np.isfinite(smallest))
        self._body_count = len(bodies)
        self._offset = int(relevant[0]) if len(relevant) else 0
        self._part = part = slice(self._offset, int(relevant[-1]) + 1 if len(relevant) else 0)
        self._moves, self._to_all, self._static = moves[part], moving_to_all[part], static[part]
        self._core = bodies.core[part]
        self._immovable = bodies.immovable[part] if bodies.kinematic.any() else None
        self._hits_static = self._moves & ~bodies.kinematic[part]
        if self._kinematic:  # bodies moved by a stroke or a plunger pass through static objects
            self._hits_static = self._hits_static & ~np.isin(bodies.names[part], [*self._kinematic])
        self._group = bodies.group[part] if bodies.group.any() else None
        self._filters = filter_table(self._scene, bodies) if self._scene.categories else None
        self._smallest_squared = smallest[part] ** 2 * (1 - 1e-9)  # rounding must not hide a pair from the exact test
        self._verlet_list = VerletList(self._core, member[part], self._can_collide)

        batch = max(1, min(MAX_BATCH, BATCH_ROWS // max(1, len(self._core))))
        self._time: list[float] = []
        self._start = np.empty((batch, len(self._core), 2))
        self._end = np.empty_like(self._start)
        self._layer_bits = np.zeros((0, 0), np.int64)

    def observe_path(self, times: FloatArray, path: FloatArray, pairs: PairRuns, on: IntArray | None = None) -> None:
        """Record many substeps at once; as if each had been recorded by a call.

        Args:
            times: (B,) s, start of each substep.
            path: (B + 1, N, 2) m, centres before the first substep and after each.
            pairs: pairs in contact at the end of each.
            on: layer of each body throughout all of them as a bit, (N,), if there are several layers.

        Raises:
            ValueError: N is not the number of bodies; `joined` adds bodies.
        """
        if path.shape[1] != self._body_count:
            raise ValueError(f"{path.shape[1]} bodies, where the audit knows of {self._body_count}")
        if not len(self._core):
            return
        self._examine()
        path, on = path[:, self._part], None if on is None else on[self._part]
        with np.errstate(invalid="ignore", over="ignore"):  # as in `_examine_substeps`
            is_fast: BoolArray = np.any(_squared_lengths(path[:-1], path[1:]) >= self._smallest_squared, axis=1)
        touching = [each for begin, (end, each) in zip(_begins(pairs), pairs, strict=True) for _ in range(begin, end)]
        batch = max(1, min(MAX_PATH_BATCH, PATH_ROWS // len(self._core)))
        parts = -(-len(times) // batch)
        for begin, end in pairwise(np.linspace(0, len(times), parts + 1, dtype=np.int64).tolist()):
            rows = slice(begin, end)
            self._history.extend(touching[rows])
            if is_fast[rows].any():  # in most substeps nothing moves fast enough to miss a contact
                start, end = path[rows].copy(), path[rows.start + 1 : rows.stop + 1].copy()
                bits = np.zeros((0, 0), np.int64) if on is None else np.tile(on, (len(start), 1))
                self._examine_substeps(times[rows], start, end, bits)
            self._history.forget()

    def _examine(self) -> None:
        """Examine the recorded substeps."""
        count = len(self._time)
        if count:
            bits = self._layer_bits[:count]
            self._examine_substeps(np.asarray(self._time), self._start[:count], self._end[:count], bits)
        self._time.clear()
        self._history.forget()

    def _examine_substeps(self, times: FloatArray, start: FloatArray, end: FloatArray, layer_bits: IntArray) -> None:
        """Examine substeps, of which the history has the pairs: their start and end, (B, M, 2) m, may be changed.

        `layer_bits` are those of the bodies in each, (B, M), or empty.
        """
        with np.errstate(invalid="ignore", over="ignore"):  # diverging bodies reach inf and are left out here
            length2 = _squared_lengths(start, end)
        fast = length2 >= self._smallest_squared
        if fast.any():
            is_diverging = ~(length2 < MAX_COORDINATE**2)
            when, body = np.nonzero(fast)
            is_diverging[when, body] |= (np.abs(start[when, body]) > MAX_COORDINATE).any(axis=1)
            if is_diverging.any():
                start[is_diverging] = end[is_diverging] = np.nan
                length2[is_diverging] = 0.0
                fast &= ~is_diverging
            nearing = 2 * float(np.sqrt(length2.max()))
            found = self._balls(start, end, fast, nearing, layer_bits), self._fixed(start, end, fast, layer_bits)
            when = np.concatenate([when for when, _ in found])
            pairs = np.concatenate([pairs for _, pairs in found])
            if len(when):
                order = np.lexsort((pairs[:, 1], pairs[:, 0], when))
                self._times.append(times[when[order]])
                self._pairs.append(pairs[order])

    def _fixed(
        self, start: FloatArray, end: FloatArray, fast: BoolArray, layer_bits: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Return substeps (M,) and pairs (M, 2) of a body and a static object that missed a contact."""
        when, body = np.nonzero(fast & self._hits_static)
        on = layer_bits[when, body] if len(layer_bits) else None
        paths = SweptCircles(when, body + self._offset, start[when, body], end[when, body], self._core[body], on)
        return self._static_geometry.missed(paths, self._history, self._filters)

    def _can_collide(self, i: IntArray, j: IntArray) -> BoolArray:
        """Return which pairs of bodies can collide."""
        able = self._to_all[i] & self._to_all[j]
        able |= self._moves[i] & self._static[j]
        able |= self._static[i] & self._moves[j]
        if self._immovable is not None:
            able &= ~(self._immovable[i] & self._immovable[j])
        if self._group is not None:
            able &= (self._group[i] == 0) | (self._group[i] != self._group[j])
        if self._filters is not None:
            able &= self._filters.share_categories(i + self._offset, j + self._offset)
        if len(self._apart):
            pair = pair_keys(np.minimum(i, j) + self._offset, np.maximum(i, j) + self._offset)
            able &= ~np.isin(pair, pair_keys(*self._apart.T))
        return np.asarray(able)

    def _balls(
        self, start: FloatArray, end: FloatArray, fast: BoolArray, nearing: float, layer_bits: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Return substeps (M,) and pairs (M, 2) of bodies that missed a contact.

        No pair approaches by more than `nearing`, m.
        """
        when, i, j = self._verlet_list.encounters(start, end, fast)
        if len(layer_bits):
            same_layer = (layer_bits[when, i] & layer_bits[when, j]) != 0
            when, i, j = when[same_layer], i[same_layer], j[same_layer]
        parts = len(when) // CHUNK + 1
        deep = np.concatenate(
            [
                begin + self._deep(start, end, nearing, *(column[begin:stop] for column in (when, i, j)))
                for begin, stop in pairwise(np.linspace(0, len(when), parts + 1, dtype=np.int64).tolist())
            ]
        )
        when, pair = when[deep], np.column_stack((i[deep], j[deep])) + self._offset
        last = _offset(end, when, i[deep], j[deep])
        late = ~approaching(last, last - _offset(start, when, i[deep], j[deep]))
        late[~late] = ~self._history.found(when[~late] + 1, pair[~late])
        when, pair = when[late], pair[late]
        new = ~self._history.found(when, pair)
        return when[new], pair[new]

    def _deep(
        self, start: FloatArray, end: FloatArray, nearing: float, when: IntArray, i: IntArray, j: IntArray
    ) -> IntArray:
        """Return which encounters lead from clear into deep contact on a path that can skip a test."""
        gap = _offset(start, when, i, j)
        distance2, contact = dot(gap, gap), self._core[i] + self._core[j]
        at = np.flatnonzero((distance2 >= (CLEAR * contact) ** 2) & (distance2 <= (contact + nearing) ** 2))
        gap, contact = gap[at], contact[at]
        move = _offset(end, when[at], i[at], j[at]) - gap
        able = (dot(gap, move) < 0) & (dot(move, move) >= (JUMP * contact) ** 2)
        able &= closest_to_origin(gap, move) < (DEEP * contact) ** 2
        return at[able]


_static_geometry = derived_once(lambda setup: StaticGeometry.of(setup.scene))


def _squared_lengths(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the squares of the displacements from start to end, both (B, N, 2) m, (B, N) m²."""
    move = end - start
    move *= move
    return np.asarray(move[..., 0] + move[..., 1])


def _begins(pairs: PairRuns) -> list[int]:
    """Return the first substep of each entry of pairs."""
    return [0, *(end for end, _ in pairs[:-1])]


def _offset(position: FloatArray, when: IntArray, i: IntArray, j: IntArray) -> FloatArray:
    """Return the offset from the first to the second of each pair, (K, 2) m."""
    # As complex numbers, both coordinates are fetched at once, three times as fast as rows of an array.
    point, row = position.view(np.complex128).reshape(-1), when * position.shape[1]
    between = point.take(row + j) - point.take(row + i)
    return np.asarray(between.view(np.float64).reshape(-1, 2))
