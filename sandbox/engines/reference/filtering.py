"""Collision filtering: layers, categories, bodies held by zones, and one-way walls.

A one-way wall is solid on its left. A body that first overlaps it from the right passes until they separate. The side
is that of the body's centre at the beginning of the piece of a substep in which the overlap begins. The decision holds
until they separate: a body that turns round inside the wall returns freely, and a stopped body never passes, at any
depth. For a polyline the nearest segment decides; at a vertex, where two segments are equally near, the sum of their
normals does (Bærentzen & Aanæs 2005, pseudonormals).

`CollisionFilter` removes candidate pairs by layer, by category, by one-way walls, and pairs in which neither body can
move (held, kinematic, or fixed). Scenes without these have no filter.
"""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.reference.broad_phase import FIRST, SECOND, CandidatePairs
from sandbox.engines.reference.manifold import KIND, Manifolds
from sandbox.scene.compile.filters import filter_table, fixed_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Wall

EQUAL = 1e-9
"""Relative difference of two distances below which both segments meet at one vertex of a wall."""

BodyColliderPair = tuple[int, int]
"""Indices of a body and of a static collider."""


class OneWayWalls:
    """The one-way walls of a run, and the bodies that touch them."""

    def __init__(self, store: BodyStore) -> None:
        self._store = store
        self.is_one_way: BoolArray = np.asarray(
            [isinstance(t, Wall) and t.one_way for t in store.scene.fixed], np.bool_
        )
        """(F,) which static colliders are one-way walls"""
        self._passing: set[BodyColliderPair] = {(body, -1 - wall) for body, wall in store.setup.passing}
        self._stopped: set[BodyColliderPair] = set()
        self._continues = store.setup.time > 0.0  # the state contains the bodies that pass; others are stopped

    def rebuild(self, start: FloatArray) -> None:
        """Update after a change of the walls; `start` are the centres (N, ≥ 2), m."""
        static, self._start = self._store.static_colliders, start
        order = np.argsort(static.segment_collider, kind="stable")
        colliders = np.flatnonzero(self.is_one_way)
        begin, end = (np.searchsorted(static.segment_collider[order], colliders, side) for side in ("left", "right"))
        self._segments = {
            collider: static.segments[order[first:last], :4]
            for collider, first, last in zip(colliders.tolist(), begin.tolist(), end.tolist(), strict=True)
        }

    def stop(self, bodies: IntArray, colliders: IntArray) -> BoolArray:
        """Return which pairs (K,) of a body and a static collider collide: all but bodies that pass a one-way wall."""
        found = np.ones(len(bodies), np.bool_)
        for k in np.flatnonzero(self.is_one_way[colliders]).tolist():
            found[k] = self._stops((int(bodies[k]), int(colliders[k])))
        return found

    def settle(self, overlaps: Manifolds, end: FloatArray) -> None:
        """Update after a piece of a substep: the overlaps at its end, and the centres then, (N, ≥ 2) m."""
        touching = _pairs(overlaps)
        self._passing = {pair for pair in touching if not self._stops(pair)}
        self._stopped, self._start = touching - self._passing, end

    def begin(self, overlaps: Manifolds, closing: FloatArray) -> None:
        """Set the initial overlaps, and their closing speeds, (K,) m/s.

        A new body on the left is stopped unless it moves away.
        """
        coming = _pairs(overlaps if self._continues else overlaps.of(closing >= 0.0))
        self._continues = False
        touching, known = _pairs(overlaps), self._passing | self._stopped
        passing = {pair for pair in touching - known if pair not in coming or not self._on_left(pair)}
        self._passing = passing | (self._passing & touching)
        self._stopped = touching - self._passing

    @property
    def passing(self) -> IntArray | None:
        """Bodies that pass a wall, and the wall, −1 − k, (P, 2); None if no body does."""
        pairs = sorted((body, -1 - collider) for body, collider in self._passing)
        return np.asarray(pairs, np.int64) if pairs else None

    def _stops(self, pair: BodyColliderPair) -> bool:
        if pair in self._passing:
            return False
        return pair in self._stopped or self._on_left(pair)

    def _on_left(self, pair: BodyColliderPair) -> bool:
        """Return whether a body is to the left of a wall, or on its line."""
        body, collider = pair
        segments = self._segments[collider]
        a, b, position = segments[:, :2], segments[:, 2:], self._start[body, :2]
        along = b - a
        length = np.sqrt((along * along).sum(axis=1))
        unit = along / length[:, None]
        off = position - a
        along_segment = np.clip((off * unit).sum(axis=1), 0.0, length)
        distance = np.hypot(*(off - along_segment[:, None] * unit).T)
        nearest = distance <= distance.min() * (1.0 + EQUAL)
        across = unit[:, 0] * off[:, 1] - unit[:, 1] * off[:, 0]
        return bool(across[nearest].sum() >= 0.0)


def _pairs(contacts: Manifolds) -> set[BodyColliderPair]:
    return set(zip(contacts.first.tolist(), (-1 - contacts.second).tolist(), strict=True))


class CollisionFilter:
    """Removes candidate pairs of a body store that do not collide."""

    def __init__(self, store: BodyStore) -> None:
        self._store, scene = store, store.scene
        planes = slice(len(scene.planes))
        self._collider_bits: IntArray = fixed_layers(scene)
        every = (1 << len(scene.layers)) - 1
        self._filters_planes = bool((self._collider_bits[planes] != every).any() or (scene.categories and scene.planes))
        self.walls = OneWayWalls(store) if any(wall.one_way for wall in scene.walls) else None
        """the one-way walls, if there are any"""
        self.rebuild(store.position)

    @staticmethod
    def is_needed(scene: Scene) -> bool:
        """Return whether a scene has layers, categories, one-way walls, or zones that hold."""
        has_parts = len(scene.layers) > 1 or bool(scene.categories) or any(wall.one_way for wall in scene.walls)
        return has_parts or any(zone.holds for zone in scene.zones)

    def rebuild(self, position: FloatArray) -> None:
        """Update after a change of the body store; positions are (N, ≥ 2) m."""
        self._bits: IntArray = 1 << self._store.layer
        self._filters = filter_table(self._store.scene, self._store.bodies)
        self._is_movable: BoolArray = (self._store.inverse_mass > 0.0) | (self._store.inverse_moment > 0.0)
        self._segment_collider = self._store.static_colliders.segment_collider
        if self.walls is not None:
            self.walls.rebuild(position)

    def apply(self, near: CandidatePairs, owner: IntArray) -> CandidatePairs:
        """Return the candidate pairs that collide; `owner` is the body of each ball, or piece."""
        balls, segments = near
        if len(balls):
            a, b = owner[balls >> FIRST], owner[balls & SECOND]
            collides = (self._is_movable[a] | self._is_movable[b]) & (self._bits[a] & self._bits[b] != 0)
            balls = balls[collides & self._filters.share_categories(a, b)]
        if len(segments):
            body, collider = owner[segments >> FIRST], self._segment_collider[segments & SECOND]
            collides = self._meets(body, collider)
            if self.walls is not None:
                collides[collides] = self.walls.stop(body[collides], collider[collides])
            segments = segments[collides]
        return CandidatePairs(balls, segments)

    def at_one_way_walls(self, near: CandidatePairs, owner: IntArray) -> CandidatePairs:
        """Return only the candidate pairs with one-way walls that collide by layer and category."""
        assert self.walls is not None
        body, collider = owner[near.segments >> FIRST], self._segment_collider[near.segments & SECOND]
        collides = self.walls.is_one_way[collider] & self._meets(body, collider)
        return CandidatePairs(near.balls[:0], near.segments[collides])

    def is_one_way(self, second: IntArray) -> BoolArray:
        """Return which second bodies of contacts (K,) are one-way walls."""
        assert self.walls is not None
        return np.asarray(self.walls.is_one_way[np.maximum(-1 - second, 0)] & (second < 0))

    def drop_filtered_planes(self, contacts: Manifolds) -> Manifolds:
        """Return contacts without those of filtered planes; every body is a candidate for every plane."""
        if not self._filters_planes:
            return contacts
        collider = np.maximum(-1 - contacts.second, 0)
        return contacts.of((contacts.second >= 0) | self._meets(contacts.first, collider))

    def with_filtered_planes(self, keys: IntArray, can_touch: BoolArray) -> IntArray:
        """Return keys, ascending, together with those of all pairs of a ball and a plane that cannot collide."""
        if not self._filters_planes:
            return keys
        body = np.arange(len(self._bits))[:, None]
        filtered = can_touch[:, None] & ~self._meets(body, self._store.static_colliders.plane_collider)
        ball, plane = np.nonzero(filtered)
        return np.union1d(keys, (1 << KIND) + (ball << FIRST) + plane)

    def _meets(self, bodies: IntArray, colliders: IntArray) -> BoolArray:
        """Return which pairs of a body and a static collider collide by layer and category."""
        on_layer = self._bits[bodies] & self._collider_bits[colliders] != 0
        return np.asarray(on_layer & self._filters.share_categories_with_fixed(bodies, colliders))
