"""Collision pipelines: broad phase, filter and narrow phase, for circles or for convex pieces.

`CirclePipeline` serves scenes in which all bodies are balls, `ConvexPipeline` all others. The broad phases use the
bounding circle of each piece. `oriented` tests oriented boxes after that, which removes most candidates if pieces are
long and thin.
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
    grid_memory,
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
    drop_excluded,
    drop_separated,
    excluded_pair_keys,
    find_body_contacts,
    find_fixed_segment_contacts,
    find_half_plane_contacts,
    write_boxes,
)
from sandbox.engines.reference.time_of_impact import first_touch

WORK = "broad_tests", "pair_tests", "contacts", "contact_iterations", "joint_iterations"
"""Work counters of the collision pipeline and the solvers"""


MIN_BOXES_FOR_AXIS_CHOICE = 10_000
"""Number of boxes above which the axis of the sweep is chosen by the number of overlaps"""

BYTES_PER_CANDIDATE, BYTES_PER_CONTACT = 3 * 8, 2 * 14 * 8
"""B: a key with spare capacity, and sorted; a row of manifolds with spare capacity"""


class CollisionPipeline(ABC):
    """Finds contacts, in ascending order of their keys, which does not depend on the broad phase. Counts the work."""

    filter: CollisionFilter | None = None
    """removes candidate pairs that do not collide; None if all do"""
    _owner: IntArray
    """index of the body of each ball, or piece"""

    def __init__(self, store: BodyStore, broad_phase: str, work: Counter[str] | None = None) -> None:
        self._store, self._broad_phase = store, BROAD_PHASES[broad_phase]
        self._is_sweep, self._is_grid = broad_phase == "sweep", broad_phase == "grid"
        self._tests_all_pairs = broad_phase in ("all_pairs", "circles")
        self._max_pairs = resource_limits.PAIRS.value
        self._ball_keys, self._segment_keys = np.empty(64, np.int64), np.empty(64, np.int64)
        self._out, self._wall_out = empty_manifolds(64), empty_manifolds(64)
        """buffers of the contacts, and of the overlaps with one-way walls"""
        self._no_contacts = self._out.of(slice(0))
        self.work: Counter[str] = Counter(dict.fromkeys(WORK, 0)) if work is None else work
        self.rebuild()

    def rebuild(self) -> None:
        """Update after a change of the bodies or static colliders in the body store."""
        store = self._store
        self.can_touch: BoolArray = store.moving & (store.collision_mask > NOTHING)
        self._moves: BoolArray = store.mobile
        self._order: IntArray | None = None
        self._boxes = SegmentBoxes(store.static_colliders)
        self._plane_count = len(store.static_colliders.planes) if self.can_touch.any() else 0
        self._plane_tests = self._plane_count * int(np.count_nonzero(self.can_touch))
        touching = store.radius[self.can_touch]
        self.max_radius = float(store.radius[store.collision_mask > NOTHING].max(initial=0.0))
        """m; largest radius of bodies that can touch anything"""
        alone = not (store.contact_matrix.ball_ball or self._plane_count or len(self._boxes))
        self.min_radius = np.inf if alone else float(touching.min(initial=np.inf))
        """m; smallest radius of moving bodies that can touch anything"""

    @property
    def can_repeat_pairs(self) -> bool:
        """Whether two bodies, or a body and a static collider, can have several contacts at once."""
        return True

    @property
    def segment_boxes(self) -> SegmentBoxes:
        """Boxes of the segments."""
        return self._boxes

    @property
    def moves(self) -> BoolArray:
        """(N,) bodies that are present and not fixed."""
        return self._moves

    @property
    def max_pairs(self) -> int:
        """Largest number of pairs that a broad phase may test."""
        return self._max_pairs

    @property
    def plane_tests(self) -> int:
        """Number of pairs of a body and a plane, all of which are tested."""
        return self._plane_tests

    @abstractmethod
    def candidates(
        self, position: FloatArray, margin: float = 0.0, *, is_filtered: bool = True, segments_only: bool = False
    ) -> CandidatePairs:
        """Return the candidate pairs at (N, ≥ 2) poses, m: at least all that are nearer than the margin, m.

        With `segments_only`, return pairs with walls and posts only; unless `is_filtered`, also those that do not
        collide.
        """

    def check_limits(self, position: FloatArray) -> None:
        """Detect contacts at (N, ≥ 2) positions, m, if that may exceed a resource limit. The work is not counted.

        Raises:
            Exhaustion: it exceeds a limit.
        """
        discs = len(self._owner)
        bound = min(self._max_pairs, resource_limits.MEMORY.value // BYTES_PER_CONTACT)
        if discs * (discs + len(self._boxes) + self._plane_count) > bound:
            before = self.work.copy()
            self.overlaps(position)
            self.work.clear()
            self.work.update(before)

    def _find_pairs(
        self, middle: FloatArray, radius: FloatArray, collision_mask: IntArray, moves: BoolArray, margin: float
    ) -> IntArray:
        """Return the keys of the pairs of discs whose gap may be less than the margin, m, ascending.

        Raises:
            Exhaustion: there are too many to test.
        """
        order = self._order = (
            self._initial_order(middle, radius, collision_mask) if self._order is None else self._order
        )
        if self._swaps_axes:
            middle = np.ascontiguousarray(middle[:, 1::-1])

        def search(keys: IntArray) -> tuple[int, int]:
            given = middle, radius, collision_mask, moves, margin, self._max_pairs, keys
            found, tests = self._broad_phase(order, *given)
            if tests == UNSORTED:
                order[:] = order[np.argsort((middle[:, 0] - radius)[order], kind="stable")]
                found, tests = self._broad_phase(order, *given)
            return found, tests

        self._ball_keys, keys = self._search(self._ball_keys, search)
        return keys

    def _initial_order(self, middle: FloatArray, radius: FloatArray, collision_mask: IntArray) -> IntArray:
        """Return the memory of the broad phase.

        For a sweep, these are the discs that can collide with anything, in order along the axis with fewer overlaps.

        Raises:
            Exhaustion: there are too many pairs to list.
        """
        some = np.flatnonzero(collision_mask > NOTHING)
        if self._tests_all_pairs:
            subject = f"broad_phase 'all_pairs' or 'circles' of {len(some):,} discs tests this many pairs:"
            _raise_refusal(resource_limits.PAIRS.refusal(subject, 0.5 * len(some) * len(collision_mask)))
        self._swaps_axes = False
        if self._is_grid:
            return np.empty(grid_memory(len(middle)), np.int64)
        if self._is_sweep:
            low = middle[some, :2] - radius[some, None]
            if len(some) > MIN_BOXES_FOR_AXIS_CHOICE:
                across, up = (_count_overlapping(low[:, axis], 2.0 * radius[some]) for axis in (0, 1))
                self._swaps_axes = 4 * up < across
            some = some[np.argsort(low[:, 1 if self._swaps_axes else 0], kind="stable")]
        return some

    def _search(self, keys: IntArray, search: Callable[[IntArray], tuple[int, int]]) -> tuple[IntArray, IntArray]:
        """Return the buffer, enlarged if it was too small, and the sorted keys that a search finds.

        Raises:
            Exhaustion: there are too many pairs to test, or to store.
        """
        found, tests = search(keys)
        if found > len(keys) and tests != EXCEEDED:
            _raise_refusal(
                resource_limits.MEMORY.refusal(
                    f"{found:,} candidate pairs of a broad phase take", found * BYTES_PER_CANDIDATE
                )
            )
            keys = np.empty(2 * found, np.int64)
            found, tests = search(keys)
        if tests == EXCEEDED:
            limit = resource_limits.PAIRS
            raise Exhaustion(
                f"bodies are so close together that the broad phase has more than {limit.shown(self._max_pairs)} "
                f"pairs to test; {limit.remedy(2 * self._max_pairs)}"
            )
        self.work["broad_tests"] += tests
        return keys, np.sort(keys[:found])

    def manifolds(self, position: FloatArray, pairs: CandidatePairs, max_separation: float = 0.0) -> Manifolds:
        """Return the contacts among candidates: pairs with a separation below `max_separation`, m; 0 for overlaps only.

        They are valid until the next detection.

        Raises:
            Exhaustion: there are too many to store.
        """
        if self._plane_tests > self._max_pairs:
            raise Exhaustion(
                f"{self._plane_count:,} planes make {self._plane_tests:,} pairs with bodies; "
                f"{resource_limits.PAIRS.remedy(self._plane_tests)}"
            )
        size = self._write_manifolds(position, pairs, max_separation)
        if size > len(self._out.key):
            _raise_refusal(resource_limits.MEMORY.refusal(f"{size:,} contacts take", size * BYTES_PER_CONTACT))
            self._out = empty_manifolds(2 * size)
            self._write_manifolds(position, pairs, max_separation)
        self.work["pair_tests"] += len(pairs.balls) + len(pairs.segments) + self._plane_tests
        self.work["contacts"] += size
        if not size:
            return self._no_contacts
        found = self._out.of(slice(0, size))
        return found if self.filter is None else self.filter.drop_filtered_planes(found)

    def at_one_way(self, position: FloatArray) -> Manifolds:
        """Return the overlaps with one-way walls and bodies, passing ones too; valid until the next detection."""
        assert self.filter is not None and self.filter.one_way is not None
        only_walls = not self.filter.one_way.is_body.any()
        near = self.candidates(position, is_filtered=False, segments_only=only_walls)
        pairs = self.filter.at_one_way(near, self._owner)
        if not (len(pairs.segments) or len(pairs.balls)):
            return self._no_contacts
        self._out, self._wall_out = self._wall_out, self._out  # the contacts of the step remain valid
        try:
            found = self.manifolds(position, pairs)
        finally:
            self._out, self._wall_out = self._wall_out, self._out
        return found.of(self.filter.one_way.are_one_way(found.first, found.second))

    @abstractmethod
    def _write_manifolds(self, position: FloatArray, pairs: CandidatePairs, max_separation: float) -> int:
        """Write contacts up to the capacity of the buffer; return their number."""

    @abstractmethod
    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of any point of bodies that can touch anything, between two poses."""

    @abstractmethod
    def broad_phase_memory(self, position: FloatArray) -> IntArray:
        """Return the memory of the broad phase, which its next call changes."""

    def overlaps(self, position: FloatArray) -> Manifolds:
        """Return all contacts at (N, ≥ 2) positions, m. They are valid until the next detection."""
        return self.manifolds(position, self.candidates(position))


def _raise_refusal(refusal: str | None) -> None:
    """Raise `Exhaustion` with the refusal of a resource limit; do nothing for None.

    Raises:
        Exhaustion: a limit is exceeded.
    """
    if refusal is not None:
        raise Exhaustion(refusal)


def _count_overlapping(low: FloatArray, width: FloatArray) -> int:
    """Return the number of overlapping pairs among N intervals."""
    order = np.argsort(low)
    begin = low[order]
    return int((np.searchsorted(begin, begin + width[order], side="right") - np.arange(1, len(low) + 1)).sum())


def empty_manifolds(size: int) -> Manifolds:
    """Return a buffer of uninitialised manifolds."""
    return Manifolds(
        key=np.empty(size, np.int64),
        first=np.empty(size, np.int64),
        second=np.empty(size, np.int64),
        normal=np.empty((size, 2)),
        separation=np.empty(size),
        point=np.empty((size, 2)),
        rn=np.empty((size, 2)),
        rt=np.zeros((size, 2)),  # remains 0 if only discs collide
        friction=np.empty(size),
        slip_target=np.empty(size),
        surface_pair=np.empty(size, np.int64),
    )


class CirclePipeline(CollisionPipeline):
    """Finds contacts of balls."""

    def rebuild(self) -> None:
        """Update after a change of the bodies or static colliders in the body store."""
        super().rebuild()
        self._excluded: IntArray = excluded_pair_keys(self._store.joints)
        self._has_groups = bool(self._store.bodies.group.any())
        self._owner = np.arange(len(self._store.position))  # each ball is its own body

    @property
    def can_repeat_pairs(self) -> bool:
        """Whether a ball can have several contacts at once with one collider: a wall of several segments."""
        colliders = self._store.static_colliders.segment_collider
        return len(np.unique(colliders)) < len(colliders)

    def candidates(
        self, position: FloatArray, margin: float = 0.0, *, is_filtered: bool = True, segments_only: bool = False
    ) -> CandidatePairs:
        """Return the candidate pairs at (N, ≥ 2) positions, m: at least all that are nearer than the margin, m."""
        store, boxes = self._store, self._boxes
        balls = segments = self._ball_keys[:0]
        if store.contact_matrix.ball_ball and not segments_only:
            balls = self._find_pairs(position, store.radius, store.collision_mask, self._moves, margin)
            if len(self._excluded) or self._has_groups:
                balls = balls[: drop_excluded(balls, self._owner, self._excluded, store.bodies.group)]
        if len(boxes.index):
            self._segment_keys, segments = self._search(
                self._segment_keys,
                lambda keys: near_segments(
                    position, store.radius, self.can_touch, *boxes.sorted, margin, self._max_pairs, keys
                ),
            )
        pairs = CandidatePairs(balls, segments)
        return self.filter.apply(pairs, self._owner) if self.filter is not None and is_filtered else pairs

    def _write_manifolds(self, position: FloatArray, pairs: CandidatePairs, max_separation: float) -> int:
        """Write contacts up to the capacity of the buffer; return their number."""
        store, static, size = self._store, self._store.static_colliders, 0
        radius, surface, other = store.radius, store.surface, store.fixed_surface
        if len(pairs.balls):
            size = find_ball_contacts(
                pairs.balls, position, radius, surface, store.tangential, max_separation, self._out, size
            )
        if self._plane_count:
            planes = static.planes, static.plane_collider, other
            size = find_plane_contacts(
                position, radius, self.can_touch, surface, *planes, store.tangential, max_separation, self._out, size
            )
        if len(pairs.segments):
            walls = static.segments, static.joints, static.segment_collider, other
            size = find_segment_contacts(
                pairs.segments, position, radius, surface, *walls, store.tangential, max_separation, self._out, size
            )
        return size

    def broad_phase_memory(self, position: FloatArray) -> IntArray:
        """Return the memory of the broad phase, which its next call changes; positions (N, ≥ 2) m.

        Raises:
            Exhaustion: there are too many pairs to list.
        """
        if self._order is None:
            store = self._store
            self._order = self._initial_order(position, store.radius, store.collision_mask)
        return self._order

    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of bodies that can touch anything, between centres (N, ≥ 2)."""
        displacement = (end - start)[self.can_touch, :2]
        return float(np.sqrt((displacement * displacement).sum(axis=1)).max(initial=0.0))

    def first_touch(self, start: FloatArray, end: FloatArray, resting: IntArray) -> tuple[float, int]:
        """Return the fraction of straight displacements at which a pair first touches, and its key; −1 for none.

        Pairs whose keys are in `resting`, ascending, are ignored.
        """
        store = self._store
        if self.filter is not None:
            resting = self.filter.with_filtered_planes(resting, self.can_touch)
        pairs = self.candidates(start, 2.0 * self.max_displacement(start, end))
        self.work["pair_tests"] += len(pairs.balls) + len(pairs.segments) + self._plane_tests
        static = store.static_colliders
        walls = pairs.segments, static.segments, static.joints
        fraction, key = first_touch(
            start, end, store.radius, self.can_touch, pairs.balls, static.planes, *walls, resting
        )
        return float(fraction), int(key)

    def pair_manifold(self, position: FloatArray, key: int) -> Manifolds:
        """Return the manifold of one pair, also if it does not overlap."""
        balls = np.array([key] if key >> KIND == 0 else [], np.int64)
        segments = np.array([key - (2 << KIND)] if key >> KIND == 2 else [], np.int64)
        contacts = self.manifolds(position, CandidatePairs(balls, segments), np.inf)
        return contacts.of(contacts.key == key)


class ConvexPipeline(CollisionPipeline):
    """Finds contacts of convex pieces."""

    def __init__(self, store: BodyStore, broad_phase: str, work: Counter[str] | None = None) -> None:
        self._oriented = broad_phase == "oriented"
        super().__init__(store, "sweep" if self._oriented else broad_phase, work)

    def rebuild(self) -> None:
        """Update after a change of the bodies or static colliders in the body store."""
        super().rebuild()
        store = self._store
        self._pieces = WorldPieces(store)
        self._owner = self._pieces.body
        self._plane_tests = self._plane_count * int(np.count_nonzero(self._pieces.can_touch))
        self._box = np.empty((len(self._pieces.radius), 6))
        self._scratch = np.empty((2, 6))
        touching = store.bodies.thin[self.can_touch]
        if np.isfinite(self.min_radius):
            self.min_radius = float(touching.min(initial=np.inf))

    @property
    def pieces(self) -> WorldPieces:
        """The pieces, at the poses of the last detection."""
        return self._pieces

    def broad_phase_memory(self, position: FloatArray) -> IntArray:
        """Return the memory of the broad phase, as `CirclePipeline`; poses (N, ≥ 2)."""
        if self._order is None:
            self._update_pieces(position)
            pieces = self._pieces
            self._order = self._initial_order(pieces.middle, pieces.bounding_radius, pieces.collision_mask)
        return self._order

    def _update_pieces(self, position: FloatArray) -> None:
        angle = position[:, 2] if position.shape[1] == 3 else self._store.angle
        self._pieces.update(position, angle)

    def candidates(
        self, position: FloatArray, margin: float = 0.0, *, is_filtered: bool = True, segments_only: bool = False
    ) -> CandidatePairs:
        """Return the candidate pairs of pieces, and of pieces and segments, at (N, ≥ 2) positions, m."""
        self._update_pieces(position)
        store, boxes, pieces = self._store, self._boxes, self._pieces
        bodies = segments = self._ball_keys[:0]
        if store.contact_matrix.mutual and not segments_only:
            bodies = self._find_pairs(
                pieces.middle, pieces.bounding_radius, pieces.collision_mask, pieces.moves, margin
            )
            bodies = bodies[: drop_excluded(bodies, pieces.body, pieces.excluded, pieces.group)]
        if len(boxes.index):
            self._segment_keys, segments = self._search(
                self._segment_keys,
                lambda keys: near_segments(
                    pieces.middle,
                    pieces.bounding_radius,
                    pieces.can_touch,
                    *boxes.sorted,
                    margin,
                    self._max_pairs,
                    keys,
                ),
            )
        if self._oriented and (len(bodies) or len(segments)):
            box = self._box
            write_boxes(pieces.corner, pieces.first, pieces.radius, box)
            self.work["broad_tests"] += len(bodies) + len(segments)
            bodies = bodies[: drop_separated(bodies, 0, box, margin)]
            segments = segments[: drop_separated(segments, pieces.count, box, margin)]
        pairs = CandidatePairs(bodies, segments)
        return self.filter.apply(pairs, self._owner) if self.filter is not None and is_filtered else pairs

    def _write_manifolds(self, position: FloatArray, pairs: CandidatePairs, max_separation: float) -> int:
        """Write contacts up to the capacity of the buffer; return their number."""
        self._update_pieces(position)
        store, static, pieces, size = self._store, self._store.static_colliders, self._pieces, 0
        hulls = pieces.hulls
        query = NarrowPhaseInput(store.tangential, max_separation, self._scratch)
        if len(pairs.balls):
            size = find_body_contacts(pairs.balls, hulls, position, query, self._out, size)
        if self._plane_count:
            planes = static.planes, static.plane_collider, store.fixed_surface
            size = find_half_plane_contacts(hulls, pieces.can_touch, position, *planes, query, self._out, size)
        if len(pairs.segments):
            walls = static.joints, static.segment_collider, store.fixed_surface
            size = find_fixed_segment_contacts(pairs.segments, hulls, position, *walls, query, self._out, size)
        return size

    def max_displacement(self, start: FloatArray, end: FloatArray) -> float:
        """Return the largest displacement, m, of any point of bodies that can touch anything, between two poses."""
        displacement = (end - start)[self.can_touch]
        length = np.sqrt((displacement[:, :2] ** 2).sum(axis=1))
        if displacement.shape[1] == 3:
            radius = self._store.radius[self.can_touch]
            if self._store.has_driven:
                radius = radius + np.hypot(*self._store.hinge[self.can_touch].T)
            length += np.abs(displacement[:, 2]) * radius
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
    """Return whether a pipeline is of the kind that a body store needs; keys of the other kind mean other pairs."""
    return isinstance(pipeline, ConvexPipeline) == needs_pieces(store)


def needs_pieces(store: BodyStore) -> bool:
    """Return whether collisions are detected by convex pieces: not all bodies are discs about their centres."""
    return store.contact_matrix.solids or store.has_driven
