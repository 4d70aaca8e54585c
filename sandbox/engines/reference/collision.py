"""Collision pipelines: broad phase, filter and narrow phase, for circles or for convex pieces.

ConvexPipeline: broad phase, then narrow phase, for scenes in which not all bodies are balls.

The broad phases see a disc around each piece. `oriented` looks at oriented boxes after that: worth it where pieces are
long, as a disc around them holds mostly nothing.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable

import numpy as np

from sandbox import resource_limits
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import NOTHING, BodyStore
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.broad_phase import (
    BROAD_PHASES,
    EXCEEDED,
    UNSORTED,
    CandidatePairs,
    SegmentBoxes,
    near_segments,
)
from sandbox.engines.reference.filtering import CollisionFilter
from sandbox.engines.reference.manifold import (
    KIND,
    Manifolds,
    find_ball_contacts,
    find_plane_contacts,
    find_segment_contacts,
)
from sandbox.engines.reference.polygon_contacts import (
    NarrowPhaseInput,
    WorldPieces,
    apart_keys,
    drop,
    drop_apart,
    find_body_contacts,
    find_fixed_segment_contacts,
    find_half_plane_contacts,
    lay_boxes,
)
from sandbox.engines.reference.time_of_impact import first_touch

WORK = "broad_tests", "pair_tests", "contacts", "contact_iterations", "joint_iterations"
"""The kinds of work that are counted, by the collision pipeline and by the solvers."""


MANY = 10_000
"""Boxes from which on it is worth choosing the axis that the sweep goes along."""

BYTES_PER_CANDIDATE, BYTES_PER_CONTACT = 3 * 8, 2 * 14 * 8
"""Keys with as much room again, and sorted; a row of manifolds with as much room again."""


class CollisionPipeline(ABC):
    """Finds contacts in the order of their keys, which does not depend on the broad phase; counts the work."""

    filter: CollisionFilter | None = None
    """removes candidate pairs that do not collide; None if all do"""
    _owner: IntArray
    """body of each ball, or piece"""

    def __init__(self, store: BodyStore, broad_phase: str, work: Counter[str] | None = None) -> None:
        self._store, self._broad_phase = store, BROAD_PHASES[broad_phase]
        self._sorts, self._listing = broad_phase == "sweep", broad_phase in ("all_pairs", "circles")
        self._most_pairs = resource_limits.PAIRS.value
        self._ball_keys, self._segment_keys = np.empty(64, np.int64), np.empty(64, np.int64)
        self._out = _room_for(64)
        self._none = self._out.of(slice(0))
        self.work: Counter[str] = Counter(dict.fromkeys(WORK, 0)) if work is None else work
        self.rebuild()

    def rebuild(self) -> None:
        """Derive the data of bodies, pieces and static colliders anew from the body store."""
        store = self._store
        self.can_touch: BoolArray = store.moving & (store.collision_mask > NOTHING)
        self._moves: BoolArray = store.mobile
        self._order: IntArray | None = None
        self._boxes = SegmentBoxes(store.fixtures)
        self._planes = len(store.fixtures.planes) if self.can_touch.any() else 0
        self._plane_tests = self._planes * int(np.count_nonzero(self.can_touch))
        touching = store.radius[self.can_touch]
        self.widest = float(store.radius[store.collision_mask > NOTHING].max(initial=0.0))
        """m; largest radius of bodies that can touch anything"""
        alone = not (store.contact_matrix.ball_ball or self._planes or len(self._boxes))
        self.thinnest = np.inf if alone else float(touching.min(initial=np.inf))
        """m; smallest radius of moving bodies that can touch anything"""

    @abstractmethod
    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> CandidatePairs:
        """Return the pairs worth a look at (N, ≥ 2) poses, m: none nearer than the margin, m, is left out.

        Where walls and posts alone are asked for, the filter leaves them all in.
        """

    def check_limits(self, position: FloatArray) -> None:
        """Look once at (N, ≥ 2) positions, m, if there is so much that a look may take too much; it is not counted.

        Raises:
            Exhaustion: it does.
        """
        discs = len(self._owner)
        bound = min(self._most_pairs, resource_limits.MEMORY.value // BYTES_PER_CONTACT)
        if discs * (discs + len(self._boxes) + self._planes) > bound:
            before = self.work.copy()
            self.overlaps(position)
            self.work.clear()
            self.work.update(before)

    def _near(
        self, middle: FloatArray, reach: FloatArray, collision_mask: IntArray, moves: BoolArray, margin: float
    ) -> IntArray:
        """Return the keys of the pairs of discs whose gap may be less than the margin, m, ascending.

        Raises:
            Exhaustion: there are too many to look at.
        """
        order = self._order = self._arranged(middle, reach, collision_mask) if self._order is None else self._order
        if self._turned:
            middle = np.ascontiguousarray(middle[:, 1::-1])

        def search(room: IntArray) -> tuple[int, int]:
            given = middle, reach, collision_mask, moves, margin, self._most_pairs, room
            found, tests = self._broad_phase(order, *given)
            if tests == UNSORTED:
                order[:] = order[np.argsort((middle[:, 0] - reach)[order], kind="stable")]
                found, tests = self._broad_phase(order, *given)
            return found, tests

        self._ball_keys, keys = self._filled(self._ball_keys, search)
        return keys

    def _arranged(self, middle: FloatArray, reach: FloatArray, collision_mask: IntArray) -> IntArray:
        """Return the discs that can collide with anything, in the order for a sweep along the axis that suits it.

        Raises:
            Exhaustion: there are too many pairs to list them all.
        """
        some = np.flatnonzero(collision_mask > NOTHING)
        if self._listing:
            subject = f"broad_phase 'all_pairs' or 'circles' of {len(some):,} discs tests this many pairs:"
            _require(resource_limits.PAIRS.refusal(subject, 0.5 * len(some) * len(collision_mask)))
        self._turned = False
        if self._sorts:
            low = middle[some, :2] - reach[some, None]
            if len(some) > MANY:
                across, up = (_overlapping(low[:, axis], 2.0 * reach[some]) for axis in (0, 1))
                self._turned = 4 * up < across
            some = some[np.argsort(low[:, 1 if self._turned else 0], kind="stable")]
        return some

    def _filled(self, room: IntArray, search: Callable[[IntArray], tuple[int, int]]) -> tuple[IntArray, IntArray]:
        """Return the sorted keys that a search finds, and its buffer, enlarged if it was too small.

        Raises:
            Exhaustion: there are too many pairs to look at, or to keep.
        """
        found, tests = search(room)
        if found > len(room) and tests != EXCEEDED:
            _require(
                resource_limits.MEMORY.refusal(
                    f"{found:,} candidate pairs of a broad phase take", found * BYTES_PER_CANDIDATE
                )
            )
            room = np.empty(2 * found, np.int64)
            found, tests = search(room)
        if tests == EXCEEDED:
            limit = resource_limits.PAIRS
            raise Exhaustion(
                f"bodies are so close together that the broad phase has more than {limit.shown(self._most_pairs)} "
                f"pairs to test; {limit.remedy(2 * self._most_pairs)}"
            )
        self.work["broad_tests"] += tests
        return room, np.sort(room[:found])

    def manifolds(self, position: FloatArray, near: CandidatePairs, reach: float = 0.0) -> Manifolds:
        """Return the contacts among candidates: those nearer than `reach`, m; 0 for overlap alone.

        They are good until the next look.

        Raises:
            Exhaustion: there are too many to keep.
        """
        if self._plane_tests > self._most_pairs:
            raise Exhaustion(
                f"{self._planes:,} planes make {self._plane_tests:,} pairs with bodies; "
                f"{resource_limits.PAIRS.remedy(self._plane_tests)}"
            )
        size = self._write_manifolds(position, near, reach)
        if size > len(self._out.key):
            _require(resource_limits.MEMORY.refusal(f"{size:,} contacts take", size * BYTES_PER_CONTACT))
            self._out = _room_for(2 * size)
            self._write_manifolds(position, near, reach)
        self.work["pair_tests"] += len(near.balls) + len(near.segments) + self._plane_tests
        self.work["contacts"] += size
        if not size:
            return self._none
        found = self._out.of(slice(0, size))
        return found if self.filter is None else self.filter.on_planes(found)

    def at_one_way_walls(self, position: FloatArray) -> Manifolds:
        """Return where bodies overlap one-way walls, whether these stop them or not; good until the next look."""
        assert self.filter is not None
        near = self.filter.at_one_way_walls(self.candidates(position, walls_alone=True), self._owner)
        if not len(near.segments):
            return self._none
        found = self.manifolds(position, near)
        return found.of(self.filter.is_one_way(found.second))

    @abstractmethod
    def _write_manifolds(self, position: FloatArray, near: CandidatePairs, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""

    @abstractmethod
    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of any point of bodies that can touch anything, between two poses."""

    def overlaps(self, position: FloatArray) -> Manifolds:
        """Return all contacts at (N, ≥ 2) positions, m. They are good until the next look."""
        return self.manifolds(position, self.candidates(position))


def _require(refusal: str | None) -> None:
    """Raise the refusal of a resource limit, if there is one.

    Raises:
        Exhaustion: it says something.
    """
    if refusal is not None:
        raise Exhaustion(refusal)


def _overlapping(low: FloatArray, width: FloatArray) -> int:
    """Return how many pairs of N intervals overlap."""
    order = np.argsort(low)
    begin = low[order]
    return int((np.searchsorted(begin, begin + width[order], side="right") - np.arange(1, len(low) + 1)).sum())


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
        offset=np.zeros((size, 2)),  # stays 0 where only discs collide
        friction=np.empty(size),
        surface_pair=np.empty(size, np.int64),
    )


class CirclePipeline(CollisionPipeline):
    """Finds contacts of balls, in the order of their keys; counts the work."""

    def rebuild(self) -> None:
        """Derive the data of bodies, pieces and static colliders anew from the body store."""
        super().rebuild()
        self._apart: IntArray = apart_keys(self._store.links)
        self._owner = np.arange(len(self._store.position))  # each ball is its own body

    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> CandidatePairs:
        """Return the pairs worth a look at (N, ≥ 2) positions, m: none nearer than the margin, m, is left out."""
        store, boxes = self._store, self._boxes
        balls = segments = self._ball_keys[:0]
        if store.contact_matrix.ball_ball and not walls_alone:
            balls = self._near(position, store.radius, store.collision_mask, self._moves, margin)
            if len(self._apart):
                balls = balls[: drop(balls, self._owner, self._apart, store.bodies.group)]
        if len(boxes.index):
            self._segment_keys, segments = self._filled(
                self._segment_keys,
                lambda room: near_segments(
                    position, store.radius, self.can_touch, *boxes.sorted, margin, self._most_pairs, room
                ),
            )
        near = CandidatePairs(balls, segments)
        return near if self.filter is None or walls_alone else self.filter.apply(near, self._owner)

    def _write_manifolds(self, position: FloatArray, near: CandidatePairs, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""
        store, fixtures, size = self._store, self._store.fixtures, 0
        radius, surface, other = store.radius, store.surface, store.fixed_surface
        if len(near.balls):
            size = find_ball_contacts(near.balls, position, radius, surface, store.friction, reach, self._out, size)
        if self._planes:
            planes = fixtures.planes, fixtures.plane_collider, other
            size = find_plane_contacts(
                position, radius, self.can_touch, surface, *planes, store.friction, reach, self._out, size
            )
        if len(near.segments):
            walls = fixtures.segments, fixtures.joints, fixtures.segment_collider, other
            size = find_segment_contacts(
                near.segments, position, radius, surface, *walls, store.friction, reach, self._out, size
            )
        return size

    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of bodies that can touch anything, between centres (N, ≥ 2)."""
        displacement = (end - start)[self.can_touch, :2]
        return float(np.sqrt((displacement * displacement).sum(axis=1)).max(initial=0.0))

    def first_touch(self, start: FloatArray, end: FloatArray, rest: IntArray) -> tuple[float, int]:
        """Return the fraction of straight ways at which a pair first touches, and its key; −1 for none.

        Pairs whose keys are in `rest`, ascending, are left out.
        """
        store = self._store
        if self.filter is not None:
            rest = self.filter.with_planes_apart(rest, self.can_touch)
        near = self.candidates(start, 2.0 * self.max_displacement(start, end))
        self.work["pair_tests"] += len(near.balls) + len(near.segments) + self._plane_tests
        fixtures = store.fixtures
        walls = near.segments, fixtures.segments, fixtures.joints
        fraction, key = first_touch(start, end, store.radius, self.can_touch, near.balls, fixtures.planes, *walls, rest)
        return float(fraction), int(key)

    def only(self, position: FloatArray, key: int) -> Manifolds:
        """Return the manifold of one pair, whether it overlaps or not."""
        balls = np.array([key] if key >> KIND == 0 else [], np.int64)
        segments = np.array([key - (2 << KIND)] if key >> KIND == 2 else [], np.int64)
        contacts = self.manifolds(position, CandidatePairs(balls, segments), np.inf)
        return contacts.of(contacts.key == key)


class ConvexPipeline(CollisionPipeline):
    """Finds contacts of convex pieces, in the order of their keys; counts the work."""

    def __init__(self, store: BodyStore, broad_phase: str, work: Counter[str] | None = None) -> None:
        self._oriented = broad_phase == "oriented"
        super().__init__(store, "sweep" if self._oriented else broad_phase, work)

    def rebuild(self) -> None:
        """Derive the data of bodies, pieces and static colliders anew from the body store."""
        super().rebuild()
        store = self._store
        self._pieces = WorldPieces(store)
        self._owner = self._pieces.body
        self._plane_tests = self._planes * int(np.count_nonzero(self._pieces.can_touch))
        self._box = np.empty((len(self._pieces.radius), 6))
        self._scratch = np.empty((2, 6))
        touching = store.bodies.thin[self.can_touch]
        if np.isfinite(self.thinnest):
            self.thinnest = float(touching.min(initial=np.inf))

    def _lay_out(self, position: FloatArray) -> None:
        angle = position[:, 2] if position.shape[1] == 3 else self._store.angle
        self._pieces.lay_out(position, angle)

    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> CandidatePairs:
        """Return the pairs of pieces, and of pieces and segments, worth a look at (N, ≥ 2) positions, m."""
        self._lay_out(position)
        store, boxes, pieces = self._store, self._boxes, self._pieces
        bodies = segments = self._ball_keys[:0]
        if store.contact_matrix.mutual and not walls_alone:
            bodies = self._near(pieces.middle, pieces.reach, pieces.collision_mask, pieces.moves, margin)
            bodies = bodies[: drop(bodies, pieces.body, pieces.apart, pieces.group)]
        if len(boxes.index):
            self._segment_keys, segments = self._filled(
                self._segment_keys,
                lambda room: near_segments(
                    pieces.middle, pieces.reach, pieces.can_touch, *boxes.sorted, margin, self._most_pairs, room
                ),
            )
        if self._oriented and (len(bodies) or len(segments)):
            box = self._box
            lay_boxes(pieces.corner, pieces.first, pieces.radius, box)
            self.work["broad_tests"] += len(bodies) + len(segments)
            bodies = bodies[: drop_apart(bodies, 0, box, margin)]
            segments = segments[: drop_apart(segments, pieces.count, box, margin)]
        near = CandidatePairs(bodies, segments)
        return near if self.filter is None or walls_alone else self.filter.apply(near, self._owner)

    def _write_manifolds(self, position: FloatArray, near: CandidatePairs, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""
        self._lay_out(position)
        store, fixtures, pieces, size = self._store, self._store.fixtures, self._pieces, 0
        hulls = pieces.hulls
        look = NarrowPhaseInput(store.friction, reach, self._scratch)
        if len(near.balls):
            size = find_body_contacts(near.balls, hulls, position, look, self._out, size)
        if self._planes:
            planes = fixtures.planes, fixtures.plane_collider, store.fixed_surface
            size = find_half_plane_contacts(hulls, pieces.can_touch, position, *planes, look, self._out, size)
        if len(near.segments):
            walls = fixtures.joints, fixtures.segment_collider, store.fixed_surface
            size = find_fixed_segment_contacts(near.segments, hulls, position, *walls, look, self._out, size)
        return size

    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of any point of bodies that can touch anything, between two poses."""
        displacement = (end - start)[self.can_touch]
        length = np.sqrt((displacement[:, :2] ** 2).sum(axis=1))
        if displacement.shape[1] == 3:
            reach = self._store.radius[self.can_touch]
            if self._store.held:
                reach = reach + np.hypot(*self._store.hinge[self.can_touch].T)
            length += np.abs(displacement[:, 2]) * reach
        return float(length.max(initial=0.0))


def make_pipeline(
    store: BodyStore, broad_phase: str, collision_filter: CollisionFilter | None, work: Counter[str]
) -> CollisionPipeline:
    """Return the collision pipeline for the bodies of a simulation.

    Args:
        store: the bodies.
        broad_phase: its name.
        collision_filter: None if every candidate pair may touch.
        work: counters of the work done, shared with the solvers.
    """
    kind = ConvexPipeline if needs_pieces(store) else CirclePipeline
    pipeline = kind(store, broad_phase, work)
    pipeline.filter = collision_filter
    return pipeline


def is_suitable(pipeline: CollisionPipeline, store: BodyStore) -> bool:
    """Return whether a pipeline is of the kind that a body store needs; if not, its keys mean other pairs."""
    return isinstance(pipeline, ConvexPipeline) == needs_pieces(store)


def needs_pieces(store: BodyStore) -> bool:
    """Return whether collisions are detected by convex pieces: not all bodies are discs about their centres."""
    return store.contact_matrix.solids or len(store.drives) > 0
