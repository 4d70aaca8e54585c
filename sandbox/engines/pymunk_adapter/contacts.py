"""Contacts of a step with their impulses, corrected for warm-start impulses that pymunk reports twice.

Munk2D caches the contact of two shapes that separate for `persistence` substeps. If they touch again by then, it starts
each point that it recognises by its hash at the impulse accumulated there (`cpArbiterUpdate`), without applying it
(`cpArbiterApplyCachedImpulse` skips first contacts). The total impulse that it then reports contains the old impulse a
second time. Without it, the impulses of a run add up to its change of momentum, to rounding. `WarmStarts` lists the
impulse with which each contact begins, in a callback; this works for every shape.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pymunk
from pymunk._chipmunk_cffi import lib
from pymunk.batch import ArbiterFields

from sandbox.arrays import ComplexArray, FloatArray, IntArray
from sandbox.engines.common.contact_log import ContactBatch, ContactLog
from sandbox.engines.pymunk_adapter.callbacks import PairCallbacks, kick_works
from sandbox.engines.pymunk_adapter.joint_impulses import JointImpulses
from sandbox.engines.pymunk_adapter.munk2d_memory import CONTACT_POINT, WORD, Listing, address_of, points_of
from sandbox.engines.pymunk_adapter.reader import SpaceReader

WarmStart = tuple[IntArray, ComplexArray]
"""Ids (K, 2) of two bodies each, and the impulses (K,), N·s, on the first with which their contacts began."""

BEGINNING = ArbiterFields.BODY_A_ID | ArbiterFields.BODY_B_ID | ArbiterFields.TOTAL_IMPULSE


class WarmStarts:
    """Impulses with which contacts of the last substep began, and which had been applied before they separated."""

    def __init__(self, space: pymunk.Space) -> None:
        self.lists_pairs = False
        """whether to list them by pair, for `take`"""
        self.points: dict[int, npt.NDArray[Any]] | None = None
        """`CONTACT_POINT`s of contacts that began with impulses, by address of the arbiter; filled if it is a dict"""
        self._began = Listing(BEGINNING)
        self.began = self._began.integers
        """array whose `num` is not 0 if contacts have begun since the last `take`"""
        space.on_collision(begin=self._begin)

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        if self.lists_pairs:
            lib.pmSpaceArbiterIteratorFuncBatched(arbiter._arbiter, self._began.data)
        if self.points is not None:
            points = points_of(arbiter._arbiter)
            if points["jnAcc"].any() or points["jtAcc"].any():
                self.points[address_of(arbiter._arbiter)] = points

    def take(self) -> WarmStart | None:
        """Return and clear the impulses; None if all contacts of the last substep began at 0."""
        if not self.began.num:
            return None
        impulses = self._began.numbers(np.complex128)
        started = np.flatnonzero(impulses)
        ids = np.frombuffer(self._began.words(), np.int64).reshape(-1, 2)
        self._began.clear()
        return (ids[started], impulses[started]) if len(started) else None


def subtract_impulses(touching: ContactBatch, pair: IntArray, impulse: ComplexArray) -> ContactBatch:
    """Return contacts without impulses that are counted twice.

    Args:
        touching: contacts as pymunk reports them.
        pair: (K, 2) body indices, in either order; if the two have several contacts, it does not matter which is
            corrected.
        impulse: (K,) on the first of each, N·s.
    """
    key, pair_key = _pair_key(touching.a, touching.b), _pair_key(*pair.T)
    began = np.sort(pair_key)
    rows = np.flatnonzero(began[np.minimum(np.searchsorted(began, key), len(began) - 1)] == key)
    if not len(rows):
        return touching
    rows = rows[np.argsort(key[rows], kind="stable")]
    row = rows[np.minimum(np.searchsorted(key[rows], pair_key), len(rows) - 1)]
    found = np.flatnonzero(key[row] == pair_key)
    row = row[found]
    sign = np.where(touching.a[row] == pair[found, 0], 1.0, -1.0)
    corrected = touching.impulse.copy()
    np.subtract.at(corrected, row, sign * impulse[found])
    return touching._replace(impulse=corrected)


def _pair_key(a: IntArray, b: IntArray) -> IntArray:
    """Return a number for each pair of indices that does not depend on their order."""
    key: IntArray = (np.minimum(a, b) << 32) + np.maximum(a, b)
    return key


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

    def __init__(self, space: pymunk.Space, warm_starts: WarmStarts, pair_callbacks: PairCallbacks) -> None:
        self._space, self._warm_starts, self._pair_callbacks = space, warm_starts, pair_callbacks
        warm_starts.points, pair_callbacks.recorded_kicks = {}, {}

    def read(self, index: dict[Any, int]) -> ContactPoints:
        """Return the points of the last substep, with the impulses applied in it.

        Args:
            index: body index of each `cpBody` that moves; all others are static.
        """
        began = self._warm_starts.points
        first: list[int] = []
        second: list[int] = []
        normal: list[tuple[float, float]] = []
        slip_target: list[float] = []
        records: list[npt.NDArray[Any]] = []
        addresses: list[int] = []
        kicks = self._pair_callbacks.recorded_kicks
        for arbiter in self._space._get_arbiters():
            if arbiter.state >= NOT_TOUCHING:
                continue
            record = points_of(arbiter)
            if began and (applied_before := began.get(address_of(arbiter))) is not None:
                for impulse in ("jnAcc", "jtAcc"):
                    record[impulse] -= applied_before[impulse]
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
        if began:
            began.clear()
        kick = np.zeros(len(first))
        if kicks:
            kick = kick_works(kicks, addresses, [len(record) for record in records])
            kicks.clear()
        table = np.concatenate(records) if records else np.empty(0, CONTACT_POINT)
        indices = np.asarray(first, np.int64), np.asarray(second, np.int64)
        normals = np.asarray(normal, np.float64).reshape(-1, 2)
        points = table["r1"], table["r2"], normals, table["jnAcc"], table["jtAcc"]
        return ContactPoints(*indices, *points, kick, np.asarray(slip_target, np.float64))


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
        self._ends = [0, *word_ends]
        self.warm_starts = warm_starts
        """impulses with which contacts began, by substep"""

    def __len__(self) -> int:
        return len(self._ends) - 1

    def words(self, k: int) -> bytes:
        """Return the integers of a substep: two ids and the number of points of each contact."""
        words: bytes = self._words[self._ends[k] * WORD : self._ends[k + 1] * WORD]
        return words

    def vectors(self, k: int) -> ComplexArray:
        """Return the vectors of a substep."""
        return self._vectors[self._vector_index(k) : self._vector_index(k + 1)]

    def stack(self, begin: int, end: int) -> ComplexArray:
        """Return the vectors of substeps whose integers are equal, one row each."""
        return self._vectors[self._vector_index(begin) : self._vector_index(end)].reshape(end - begin, -1)

    def _vector_index(self, k: int) -> int:
        """Return the index of the first vector of a substep."""
        return self._ends[k] // 3 * self.width

    def end_of_same(self, k: int) -> int:
        """Return the first substep after k whose integers differ from those of k, or that has warm starts."""
        last, count = self.words(k), len(self)
        if not self.warm_starts and self._words[self._ends[k] * WORD :] == last * (count - k):
            return count
        end = k + 1
        while end < count and self.words(end) == last and end not in self.warm_starts:
            end += 1
        return end


class ContactReader:
    """Contacts of a space. Nothing is read before the first call; from then on impulses are corrected."""

    def __init__(self, space: pymunk.Space, reader: SpaceReader, pair_callbacks: PairCallbacks) -> None:
        self._space, self._reader, self._pair_callbacks = space, reader, pair_callbacks
        self._warm_starts: WarmStarts | None = None
        self._points: ContactPointReader | None = None

    def touching(self, polygons: bool, impulses_suffice: bool) -> ContactBatch | ComplexArray:
        """Return the present contacts.

        Args:
            polygons: whether there are polygons, which may touch in two points.
            impulses_suffice: whether impulses alone suffice if the contacts are those of the last call, in that order.
        """
        is_same = self._reader.read_contacts(polygons) and self.is_started
        self.warm_starts.lists_pairs = True
        return self._corrected(is_same and impulses_suffice, self.warm_starts.take())

    @property
    def is_listed(self) -> bool:
        """Whether the last list had contacts, open ones or ended ones that Munk2D still keeps."""
        return bool(self._reader.id_words)

    @property
    def is_started(self) -> bool:
        """Whether contacts have been read, so that impulses with which they begin are listed."""
        return self._warm_starts is not None and self._warm_starts.lists_pairs

    def read_batch(
        self, lists: ContactLists, log: ContactLog, times: FloatArray, polygons: bool
    ) -> Iterator[tuple[int, int]]:
        """Enter the contacts of a batch into a log, as if they had been read after each substep.

        Args:
            lists: the contacts.
            log: the log.
            times: (B,) s, end of each substep.
            polygons: as of `touching`.

        Yields:
            After each substep, or after several with the same pairs: the number of the next substep, and of contacts.
        """
        k = 0
        while k < len(lists):
            impulses = self._impulses_in(lists, k, polygons) if log.has_distinct_rows else NO_IMPULSES
            if len(impulses):
                log.add_impulse_rows(impulses)
                k, count = k + len(impulses), impulses.size
            else:
                contacts = self._touching_in(lists, k, polygons, log.has_distinct_rows)
                if isinstance(contacts, ContactBatch):
                    log.record(float(times[k]), contacts)
                    count = len(contacts.a)
                else:
                    log.add_impulses(contacts)
                    count = len(contacts)
                k += 1
            yield k, count

    def _touching_in(
        self, lists: ContactLists, k: int, polygons: bool, impulses_suffice: bool
    ) -> ContactBatch | ComplexArray:
        """Return the contacts of a substep of a batch, as `touching` would have done after it."""
        is_same = self._reader.use_list(lists.words(k), lists.vectors(k), polygons)
        return self._corrected(is_same and impulses_suffice, lists.warm_starts.get(k))

    def _impulses_in(self, lists: ContactLists, begin: int, polygons: bool) -> ComplexArray:
        """Return the impulses (S, K), N·s, of substeps from `begin` on with the same contacts as the last one read.

        S is 0 if the contacts of the first of them differ, or need a correction.
        """
        reader = self._reader
        if begin in lists.warm_starts or lists.words(begin) != reader.id_words:
            return NO_IMPULSES
        end = lists.end_of_same(begin)
        reader.use_list(reader.id_words, lists.vectors(end - 1), polygons)
        return lists.stack(begin, end)[:, reader.impulse_columns()]

    def _corrected(self, impulses_suffice: bool, warm_start: WarmStart | None) -> ContactBatch | ComplexArray:
        """Return the contacts of the present list of the reader, without impulses that are counted twice."""
        if impulses_suffice and warm_start is None:
            return self._reader.impulses()
        found = self._reader.touching()
        if warm_start is None:
            return found
        ids, impulses = warm_start
        return subtract_impulses(found, self._reader.indices(ids), impulses)

    @property
    def warm_starts(self) -> WarmStarts:
        """The impulses with which contacts begin, which are listed from the first call on."""
        if self._warm_starts is None:
            self._warm_starts = WarmStarts(self._space)
        return self._warm_starts

    def points(self) -> ContactPoints:
        """Return the contact points of the last substep; from the first call on, their impulses are corrected."""
        if self._points is None:
            self._points = ContactPointReader(self._space, self.warm_starts, self._pair_callbacks)
        return self._points.read(self._reader.records)
