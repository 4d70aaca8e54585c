"""Contacts of a step with their impulses, corrected for warm-start impulses that pymunk reports twice.

Munk2D caches the contact of two shapes that separate for `persistence` substeps. If they touch again by then, it starts
each point that it recognises by its hash at the impulse accumulated there (`cpArbiterUpdate`), without applying it
(`cpArbiterApplyCachedImpulse` skips first contacts). The total impulse that it then reports contains the old impulse a
second time. Without it, the impulses of a run add up to its change of momentum, to rounding.

`WarmStartCorrection` reads the impulse with which a contact begins, in a callback. That works for every shape: for
polygons, of whose two points one may be recognised and the other new, and for bodies of several shapes, of which one
separates while another stays.

`CachedContactCorrection` computes the same correction from the lists of contacts, without callbacks. It needs pairs
with at most one contact point. The impulse with which such a pair begins again is its last one, in the frame of the
normal: with complex numbers c = J/n, and then c·n' about the new normal. A callback at each beginning would
take a sixth of the step of a pile.
"""

from typing import Any, NamedTuple

import numpy as np
import pymunk

from sandbox.arrays import ComplexArray, FloatArray, IntArray
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch, PairIndex
from sandbox.engines.pymunk_adapter.callbacks import PairCallbacks, kick_works
from sandbox.engines.pymunk_adapter.joint_impulses import JointImpulses
from sandbox.engines.pymunk_adapter.reader import (
    ARMS,
    IMPULSES,
    WIDTH,
    WORD,
    SpaceReader,
    address_of,
    impulses_of,
    points_of,
)

WarmStart = tuple[IntArray, FloatArray]
"""Ids (K, 2) of two bodies each, and the impulses (K, 2), N·s, on the first with which their contacts began."""


class WarmStartCorrection:
    """Impulses with which contacts of the last substep began, and which had been applied before they separated."""

    def __init__(self, space: pymunk.Space) -> None:
        self._ids: list[tuple[int, int]] = []
        self._impulses: list[tuple[float, float]] = []
        self.pairs = False
        """whether to collect them by pair"""
        self.points: dict[int, FloatArray] | None = None
        """the same point by point, (C, 2) by the address of the arbiter; filled if it is a dict"""
        space.on_collision(begin=self._begin)

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        x, y = arbiter.total_impulse
        if not (x or y):
            return
        if self.points is not None:
            address, impulses = impulses_of(arbiter)
            self.points[address] = impulses
        if self.pairs:
            a, b = arbiter.shapes
            if a.body is not None and b.body is not None:
                self._ids.append((a.body.id, b.body.id))
                self._impulses.append((x, y))

    @property
    def found(self) -> bool:
        """Whether impulses have been collected."""
        return bool(self._ids)

    def take(self) -> WarmStart:
        """Return and clear the impulses."""
        ids, impulses = np.asarray(self._ids, np.int64).reshape(-1, 2), np.asarray(self._impulses).reshape(-1, 2)
        self._ids, self._impulses = [], []
        return ids, impulses


def subtract_impulses(touching: ContactBatch, pair: IntArray, impulse: FloatArray) -> ContactBatch:
    """Return contacts without impulses that are counted twice.

    Args:
        touching: contacts as pymunk reports them.
        pair: (K, 2) body indices; if the two have several contacts, it does not matter which is corrected.
        impulse: (K, 2) on the first of each, N·s.
    """
    if not len(pair) or not len(touching.a):
        return touching
    lowest = int(min(touching.a.min(), touching.b.min(), pair.min()))
    span = int(max(touching.a.max(), touching.b.max(), pair.max())) - lowest + 1
    key = (touching.a - lowest) * span + touching.b - lowest
    order = np.argsort(key, kind="stable")
    corrected = touching.impulse.copy()
    impulse_vector = impulse[:, 0] + 1j * impulse[:, 1]
    for first, second, sign in ((0, 1, 1.0), (1, 0, -1.0)):
        pair_key = (pair[:, first] - lowest) * span + pair[:, second] - lowest
        row = order[np.minimum(np.searchsorted(key, pair_key, sorter=order), len(key) - 1)]
        found = key[row] == pair_key
        np.subtract.at(corrected, row[found], sign * impulse_vector[found])
        pair, impulse_vector = pair[~found], impulse_vector[~found]  # some may be listed in the other order
    return touching._replace(impulse=corrected)


NO_IMPULSES: ComplexArray = np.empty((0, 0), np.complex128)

NOT_TOUCHING = 2
"""cpArbiterState from which on shapes are not in contact: ignored, cached, invalidated."""


class ContactPoints(NamedTuple):
    """P contact points of a substep."""

    a: IntArray
    """(P,) index of one body; −1 for a static body"""
    b: IntArray
    """(P,) index of the other"""
    arm_a: FloatArray
    """(P, 2) m, from the centre of a to the point"""
    arm_b: FloatArray
    """(P, 2) likewise of b"""
    normal: FloatArray
    """(P, 2) from a to b"""
    along: FloatArray
    """(P,) normal impulse on b, N·s"""
    across: FloatArray
    """(P,) impulse on b to the left of the normal, N·s"""
    kick: FloatArray
    """(P,) work of a kick for each N·s of normal impulse, J; 0 without a kick"""
    slip_target: FloatArray
    """(P,) m/s, velocity of b relative to a, to the left of the normal, without slip; not 0 if a surface moves"""

    @property
    def joint_impulses(self) -> JointImpulses:
        """The impulses in the form of joint impulses."""
        nx, ny = self.normal.T
        impulse = np.column_stack((nx * self.along - ny * self.across, ny * self.along + nx * self.across))
        return JointImpulses(self.a, self.b, self.arm_a, self.arm_b, impulse, np.zeros(len(self.a)))

    def work(self, velocity: FloatArray, spin: FloatArray) -> tuple[float, float, float, float]:
        """Return the work, J, of impulses along normals, of friction, kicks and moving surfaces, at mean velocities."""
        x, y = self.joint_impulses.separating_velocity(velocity, spin).T
        nx, ny = self.normal.T
        normal_velocity, tangential_velocity = nx * x + ny * y, nx * y - ny * x
        kick_work = float(self.along @ self.kick)
        friction_work = float(self.across @ (tangential_velocity - self.slip_target))
        surface_work = float(self.across @ self.slip_target)
        return float(self.along @ normal_velocity) - kick_work, friction_work, kick_work, surface_work


class ContactPointReader:
    """Reads the contact points of a space after each substep."""

    def __init__(self, space: pymunk.Space, warm_start: WarmStartCorrection, pair_callbacks: PairCallbacks) -> None:
        self._space, self._warm_start, self._pair_callbacks = space, warm_start, pair_callbacks
        warm_start.points, pair_callbacks.recorded_kicks = {}, {}

    def read(self, index: dict[Any, int]) -> ContactPoints:
        """Return the points of the last substep, with the impulses applied in it.

        Args:
            index: body index of each `cpBody` that moves; all others are static.
        """
        warm_start = self._warm_start.points
        first: list[int] = []
        second: list[int] = []
        normal: list[tuple[float, float]] = []
        slip_target: list[float] = []
        records: list[FloatArray] = []
        addresses: list[int] = []
        kicks = self._pair_callbacks.recorded_kicks
        for arbiter in self._space._get_arbiters():
            if arbiter.state >= NOT_TOUCHING:
                continue
            record = points_of(arbiter)
            if warm_start:
                applied_before = warm_start.get(address_of(arbiter))
                if applied_before is not None:
                    record[:, IMPULSES] -= applied_before  # applied before they separated
            records.append(record)
            if kicks:
                addresses.append(address_of(arbiter))
            a, b = index.get(arbiter.body_a, -1), index.get(arbiter.body_b, -1)
            n, surface = (arbiter.n.x, arbiter.n.y), arbiter.surface_vr
            target = surface.x * n[1] - surface.y * n[0]
            for _ in range(len(record)):
                first.append(a)
                second.append(b)
                normal.append(n)
                slip_target.append(target)
        if warm_start:
            warm_start.clear()
        kick = np.zeros(len(first))
        if kicks:
            kick = kick_works(kicks, addresses, [len(record) for record in records])
            kicks.clear()
        table = np.concatenate(records) if records else np.empty((0, WIDTH))
        arms, impulses = table[:, ARMS], table[:, IMPULSES]
        indices = np.asarray(first, np.int64), np.asarray(second, np.int64)
        normals = np.asarray(normal, np.float64).reshape(-1, 2)
        points = arms[:, :2], arms[:, 2:], normals, impulses[:, 0], impulses[:, 1]
        return ContactPoints(*indices, *points, kick, np.asarray(slip_target, np.float64))


ColliderPair = tuple[int, int]
"""Indices of two bodies or static colliders, the lower first."""


class CachedContactCorrection:
    """Pairs that have separated and that pymunk still caches."""

    def __init__(self, reader: SpaceReader, collider_count: int) -> None:
        """Start after a first reading without cached pairs.

        Args:
            reader: of the space; from now on it keeps each listing for one more reading.
            collider_count: number of static colliders.
        """
        self._reader, self._collider_count = reader, collider_count
        self._rows = PairIndex()
        self._last = NO_CONTACTS
        self._separated: dict[ColliderPair, complex] = {}
        """pair → last impulse, N·s, in the frame of its normal"""
        reader.keep_last = True

    def correct(self, contacts: ContactBatch) -> ContactBatch:
        """Return contacts that differ from the last ones, without impulses that are counted twice."""
        last = self._last
        # pymunk lists either body first.
        lower, higher = np.minimum(contacts.a, contacts.b), np.maximum(contacts.a, contacts.b)
        row, new = self._rows.find(lower + self._collider_count, higher + self._collider_count)
        self._rows.keep(np.arange(len(contacts.a)))
        self._last = contacts
        ended = np.ones(len(last.a), np.bool_)
        lasting = np.ones(len(contacts.a), np.bool_)
        lasting[new] = False
        ended[row[lasting]] = False
        ended_rows = np.flatnonzero(ended)
        if len(ended_rows):
            impulse, normal = self._reader.last_vectors(ended_rows)
            for pair, last_impulse in zip(_pairs(last, ended_rows), (impulse / normal).tolist(), strict=True):
                self._separated[pair] = last_impulse
        if not self._separated:
            return contacts
        reopened = [
            (k, self._separated.pop(pair))
            for k, pair in zip(new.tolist(), _pairs(contacts, new), strict=True)
            if pair in self._separated
        ]
        if self._separated:  # a pair that pymunk no longer caches begins at 0
            cached = set(map(_pair, *self._reader.cached().T.tolist()))
            self._separated = {pair: last_impulse for pair, last_impulse in self._separated.items() if pair in cached}
        if not reopened:
            return contacts
        impulse = contacts.impulse.copy()
        for k, last_impulse in reopened:
            impulse[k] -= last_impulse * contacts.normal[k]
        return contacts._replace(impulse=impulse)


def _pairs(touching: ContactBatch, rows: IntArray) -> list[ColliderPair]:
    return list(map(_pair, touching.a[rows].tolist(), touching.b[rows].tolist()))


def _pair(a: int, b: int) -> ColliderPair:
    return (a, b) if a < b else (b, a)


class ContactLists:
    """Contacts at the end of each of B substeps, as Munk2D lists them."""

    def __init__(
        self, words: Any, word_ends: list[int], vectors: ComplexArray, width: int, warm_starts: dict[int, WarmStart]
    ) -> None:
        """Take over the lists.

        Args:
            words: memory of all integers.
            word_ends: (B,) number of integers up to the end of each substep.
            vectors: of all contacts.
            width: number of vectors of a contact.
            warm_starts: impulses with which contacts began, by substep.
        """
        self._words, self._vectors, self.width = words, vectors, width
        self.count = word_ends[-1] // 3
        """number of all contacts, with those that have ended and that Munk2D still keeps"""
        self._byte_ends = [0, *(end * WORD for end in word_ends)]
        self._vector_ends = [0, *(end // 3 * width for end in word_ends)]
        self.warm_starts = warm_starts
        """impulses with which contacts began, by substep"""

    def __len__(self) -> int:
        return len(self._byte_ends) - 1

    def words(self, k: int) -> bytes:
        """Return the integers of a substep: two ids and the number of points of each contact."""
        words: bytes = self._words[self._byte_ends[k] : self._byte_ends[k + 1]]
        return words

    def vectors(self, k: int) -> ComplexArray:
        """Return the vectors of a substep."""
        return self._vectors[self._vector_ends[k] : self._vector_ends[k + 1]]

    def stack(self, begin: int, end: int) -> ComplexArray:
        """Return the vectors of substeps whose integers are equal, one row each."""
        return self._vectors[self._vector_ends[begin] : self._vector_ends[end]].reshape(end - begin, -1)

    def end_of_same(self, k: int) -> int:
        """Return the first substep after k whose integers differ from those of k, or that has warm starts."""
        words, ends, last, count = self._words, self._byte_ends, self.words(k), len(self)
        if not self.warm_starts and words[ends[k] :] == last * (count - k):
            return count
        end = k + 1
        while end < count and words[ends[end] : ends[end + 1]] == last and end not in self.warm_starts:
            end += 1
        return end


class ContactReader:
    """Contacts of a space. Nothing is read before the first call."""

    def __init__(
        self, space: pymunk.Space, reader: SpaceReader, pair_callbacks: PairCallbacks, collider_count: int
    ) -> None:
        self._space, self._reader, self._pair_callbacks, self._collider_count = (
            space,
            reader,
            pair_callbacks,
            collider_count,
        )
        self._warm_start: WarmStartCorrection | None = None
        self._cached_correction: CachedContactCorrection | None = None
        self._points: ContactPointReader | None = None

    def touching(self, polygons: bool, single: bool, impulses_suffice: bool) -> ContactBatch | ComplexArray:
        """Return the present contacts; from the first call on, their impulses are corrected.

        Args:
            polygons: whether there are polygons, which may touch in two points.
            single: whether two bodies have at most one contact.
            impulses_suffice: whether impulses alone suffice if the contacts are those of the last call, in that order.
        """
        return self._corrected(self._reader.read_contacts(polygons), single, impulses_suffice, self.take_warm_start())

    def take_warm_start(self) -> WarmStart | None:
        """Return and clear the impulses with which contacts of the last substep began; None if there are none."""
        warm_start = self._warm_start
        return warm_start.take() if warm_start is not None and warm_start.pairs and warm_start.found else None

    @property
    def has_warm_starts(self) -> bool:
        """Whether impulses with which contacts begin are collected by callbacks."""
        return self._warm_start is not None and self._warm_start.pairs

    @property
    def is_listed(self) -> bool:
        """Whether the last list had contacts, open ones or ended ones that Munk2D still keeps."""
        return bool(self._reader.id_words)

    @property
    def is_started(self) -> bool:
        """Whether contacts have been read, so that the kind of correction is known."""
        return self.has_warm_starts or self._cached_correction is not None

    def touching_in(
        self, lists: ContactLists, k: int, polygons: bool, single: bool, impulses_suffice: bool
    ) -> ContactBatch | ComplexArray:
        """Return the contacts of a substep of a batch, as `touching` would have done after it."""
        same = self._reader.use_list(lists.words(k), lists.vectors(k), polygons)
        return self._corrected(same, single, impulses_suffice, lists.warm_starts.get(k))

    def impulses_in(self, lists: ContactLists, begin: int, polygons: bool) -> ComplexArray:
        """Return the impulses (S, K), N·s, of substeps from `begin` on with the same contacts as the last one read.

        S is 0 if the contacts of the first of them differ, or need a correction.
        """
        reader = self._reader
        if begin in lists.warm_starts or lists.words(begin) != reader.id_words:
            return NO_IMPULSES
        end = lists.end_of_same(begin)
        reader.use_list(reader.id_words, lists.vectors(end - 1), polygons)
        return lists.stack(begin, end)[:, reader.impulse_columns()]

    def _corrected(
        self, same: bool, single: bool, impulses_suffice: bool, warm_start: WarmStart | None
    ) -> ContactBatch | ComplexArray:
        """Return the contacts of the present list of the reader; `same` as `SpaceReader.read_contacts` returns."""
        if single and self._are_listings_enough():
            if same and impulses_suffice and self._cached_correction is not None:
                return self._reader.impulses()
            found = self._reader.touching()
            if self._cached_correction is None:
                self._cached_correction = CachedContactCorrection(self._reader, self._collider_count)
            elif same:
                return found
            return self._cached_correction.correct(found)
        if same and impulses_suffice and self.has_warm_starts and warm_start is None:
            return self._reader.impulses()
        self._start_warm_start_correction().pairs = True
        found = self._reader.touching()
        return (
            found
            if warm_start is None
            else subtract_impulses(found, self._reader.indices(warm_start[0]), warm_start[1])
        )

    def _are_listings_enough(self) -> bool:
        """Return whether listings suffice: no pair was cached before the first, and no callback is in use."""
        if self._warm_start is not None and self._warm_start.pairs:
            return False
        return self._cached_correction is not None or not len(self._reader.cached())

    def _start_warm_start_correction(self) -> WarmStartCorrection:
        if self._warm_start is None:
            self._warm_start = WarmStartCorrection(self._space)
        return self._warm_start

    def points(self) -> ContactPoints:
        """Return the contact points of the last substep; from the first call on, their impulses are corrected."""
        if self._points is None:
            self._points = ContactPointReader(self._space, self._start_warm_start_correction(), self._pair_callbacks)
        return self._points.read(self._reader.records)
