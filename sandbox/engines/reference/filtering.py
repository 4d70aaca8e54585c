"""Collision filtering: layers, categories, bodies held by zones, one-way walls and one-way bodies.

A one-way wall is solid on its left. A body that first overlaps it from the right passes until they separate. The side
is that of the body's centre at the beginning of the piece of a substep in which the overlap begins. The decision holds
until they separate: a body that turns round inside the wall returns freely, and a stopped body never passes, at any
depth. For a polyline the nearest segment decides; at a vertex, where two segments are equally near, the sum of their
normals does (Bærentzen & Aanæs 2005, pseudonormals). A one-way body is solid for bodies that were beyond its outermost
point in its direction, but for the slop, when the overlap began.

`CollisionFilter` removes candidate pairs by layer, by category, by one-way walls and bodies, and pairs in which neither
body can move (held, kinematic, or fixed). Scenes without these have no filter.
"""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.reference.broad_phase import FIRST, SECOND, CandidatePairs
from sandbox.engines.reference.manifold import KIND, Manifolds
from sandbox.scene.compile.filters import filter_table, fixed_layers
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Wall
from sandbox.scene.geometry.vectors import rotate

EQUAL = 1e-9
"""Relative difference of two distances below which both segments meet at one vertex of a wall."""

BodyPair = tuple[int, int]
"""Index of a body, and of what is one-way: a wall, −1 − k, or a body."""


class OneWayColliders:
    """The one-way walls and bodies of a run, and the bodies that touch them."""

    def __init__(self, store: BodyStore, slop: float) -> None:
        self._store, self._slop = store, slop
        self.is_wall: BoolArray = np.asarray([isinstance(t, Wall) and t.one_way for t in store.scene.fixed], np.bool_)
        """(F,) which static colliders are one-way walls"""
        self._passing: set[BodyPair] = set(store.setup.passing)
        self._stopped: set[BodyPair] = set()
        self._continues = store.setup.time > 0.0  # the state contains the bodies that pass; others are stopped

    def rebuild(self, start: FloatArray) -> None:
        """Update after a change of walls or bodies; `start` are the centres, or poses, (N, ≥ 2)."""
        store, static = self._store, self._store.static_colliders
        self.is_body: BoolArray = np.zeros(len(store.bodies), np.bool_)
        """(N,) which bodies are one-way"""
        self.is_body[[*store.bodies.one_way]] = True
        self._start = start
        order = np.argsort(static.segment_collider, kind="stable")
        colliders = np.flatnonzero(self.is_wall)
        begin, end = (np.searchsorted(static.segment_collider[order], colliders, side) for side in ("left", "right"))
        self._segments = {
            collider: static.segments[order[first:last], :4]
            for collider, first, last in zip(colliders.tolist(), begin.tolist(), end.tolist(), strict=True)
        }

    def stop(self, bodies: IntArray, colliders: IntArray) -> BoolArray:
        """Return which pairs (K,) of a body and a static collider collide: all but bodies that pass a one-way wall."""
        found = np.ones(len(bodies), np.bool_)
        for k in np.flatnonzero(self.is_wall[colliders]).tolist():
            found[k] = self._stops((int(bodies[k]), -1 - int(colliders[k])))
        return found

    def stop_bodies(self, first: IntArray, second: IntArray) -> BoolArray:
        """Return which pairs (K,) of bodies collide: all but bodies that pass a one-way body."""
        found = np.ones(len(first), np.bool_)
        for k in np.flatnonzero(self.is_body[first] | self.is_body[second]).tolist():
            found[k] = self._stops(self._ordered(int(first[k]), int(second[k])))
        return found

    def are_one_way(self, first: IntArray, second: IntArray) -> BoolArray:
        """Return which contacts (K,) are those of one-way walls or bodies."""
        of_wall = (second < 0) & np.append(self.is_wall, False)[np.maximum(-1 - second, -1)]
        return np.asarray(of_wall | ((second >= 0) & (self.is_body[first] | self.is_body[np.maximum(second, 0)])))

    def settle(self, overlaps: Manifolds, end: FloatArray) -> None:
        """Update after a piece of a substep: the overlaps at its end, and the centres or poses then, (N, ≥ 2)."""
        touching = self._pairs(overlaps)
        self._passing = {pair for pair in touching if not self._stops(pair)}
        self._stopped, self._start = touching - self._passing, end

    def begin(self, overlaps: Manifolds, closing: FloatArray) -> None:
        """Set the initial overlaps, and their closing speeds, (K,) m/s.

        A new body on the left, or in the direction of a one-way body, is stopped unless it moves away.
        """
        coming = self._pairs(overlaps if self._continues else overlaps.of(closing >= 0.0))
        self._continues = False
        touching, known = self._pairs(overlaps), self._passing | self._stopped
        passing = {pair for pair in touching - known if pair not in coming or not self._on_solid_side(pair)}
        self._passing = passing | (self._passing & touching)
        self._stopped = touching - self._passing

    @property
    def passing(self) -> IntArray | None:
        """Bodies that pass, and the wall, −1 − k, or body that they pass, (P, 2); None if no body does."""
        pairs = sorted(self._passing)
        return np.asarray(pairs, np.int64) if pairs else None

    def _ordered(self, first: int, second: int) -> BodyPair:
        """Return a pair of bodies with the one-way body last."""
        return (first, second) if self.is_body[second] else (second, first)

    def _pairs(self, contacts: Manifolds) -> set[BodyPair]:
        pairs = zip(contacts.first.tolist(), contacts.second.tolist(), strict=True)
        return {pair if pair[1] < 0 else self._ordered(*pair) for pair in pairs}

    def _stops(self, pair: BodyPair) -> bool:
        if pair in self._passing:
            return False
        return pair in self._stopped or self._on_solid_side(pair)

    def _on_solid_side(self, pair: BodyPair) -> bool:
        """Return whether a body is to the left of a wall, or beyond a one-way body in its direction."""
        body, other = pair
        return self._on_left(body, -1 - other) if other < 0 else self._is_beyond(body, other)

    def _on_left(self, body: int, collider: int) -> bool:
        """Return whether a body is to the left of a wall, or on its line."""
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

    def _is_beyond(self, body: int, platform: int) -> bool:
        """Return whether a body is beyond the outermost point of a one-way body in its direction, but for the slop."""
        angle = self._angle(platform)
        out = rotate(*self._store.bodies.one_way[platform], math.cos(angle), math.sin(angle))
        top, bottom = self._farthest(platform, out), -self._farthest(body, (-out[0], -out[1]))
        return bottom >= top - self._slop

    def _angle(self, body: int) -> float:
        return float(self._start[body, 2] if self._start.shape[1] > 2 else self._store.angle[body])

    def _farthest(self, body: int, direction: Point) -> float:
        """Return the largest coordinate of a body along a direction, m."""
        shapes, angle = self._store.bodies.shapes, self._angle(body)
        begin, end = np.searchsorted(shapes.body, (body, body + 1)).tolist()
        corners = slice(shapes.first[begin], shapes.first[end])
        x, y = rotate(*direction, math.cos(angle), -math.sin(angle))  # in the frame of the body
        radius = np.repeat(shapes.radius[begin:end], shapes.corners[begin:end])
        reach = float((shapes.corner[corners] @ (x, y) + radius).max())
        return float(self._start[body, :2] @ direction) + reach


def _has_one_way(store: BodyStore) -> bool:
    return bool(store.bodies.one_way) or any(wall.one_way for wall in store.scene.walls)


class CollisionFilter:
    """Removes candidate pairs of a body store that do not collide."""

    def __init__(self, store: BodyStore, slop: float) -> None:
        self._store, scene = store, store.scene
        planes = slice(len(scene.planes))
        self._collider_bits: IntArray = fixed_layers(scene)
        every = (1 << len(scene.layers)) - 1
        self._filters_planes = bool((self._collider_bits[planes] != every).any() or (scene.categories and scene.planes))
        self.one_way = OneWayColliders(store, slop) if _has_one_way(store) else None
        """the one-way walls and bodies, if there are any"""
        self.rebuild(store.position)

    @staticmethod
    def is_needed(store: BodyStore) -> bool:
        """Return whether a scene has layers, categories, one-way walls or bodies, or zones that hold."""
        scene = store.scene
        has_parts = len(scene.layers) > 1 or bool(scene.categories) or _has_one_way(store)
        return has_parts or any(zone.holds for zone in scene.zones)

    def rebuild(self, position: FloatArray) -> None:
        """Update after a change of the body store; positions are (N, ≥ 2) m."""
        self._bits: IntArray = 1 << self._store.layer
        self._filters = filter_table(self._store.scene, self._store.bodies)
        self._is_movable: BoolArray = (self._store.inverse_mass > 0.0) | (self._store.inverse_moment > 0.0)
        self._segment_collider = self._store.static_colliders.segment_collider
        if self.one_way is not None:
            self.one_way.rebuild(position)

    def apply(self, near: CandidatePairs, owner: IntArray) -> CandidatePairs:
        """Return the candidate pairs that collide; `owner` is the body of each ball, or piece."""
        balls, segments = near
        if len(balls):
            a, b = owner[balls >> FIRST], owner[balls & SECOND]
            collides = (self._is_movable[a] | self._is_movable[b]) & (self._bits[a] & self._bits[b] != 0)
            collides &= self._filters.share_categories(a, b)
            if self.one_way is not None:
                collides[collides] = self.one_way.stop_bodies(a[collides], b[collides])
            balls = balls[collides]
        if len(segments):
            body, collider = owner[segments >> FIRST], self._segment_collider[segments & SECOND]
            collides = self._meets(body, collider)
            if self.one_way is not None:
                collides[collides] = self.one_way.stop(body[collides], collider[collides])
            segments = segments[collides]
        return CandidatePairs(balls, segments)

    def at_one_way(self, near: CandidatePairs, owner: IntArray) -> CandidatePairs:
        """Return only the candidate pairs with one-way walls and bodies that collide by layer and category."""
        assert self.one_way is not None
        body, collider = owner[near.segments >> FIRST], self._segment_collider[near.segments & SECOND]
        at_wall = self.one_way.is_wall[collider] & self._meets(body, collider)
        a, b = owner[near.balls >> FIRST], owner[near.balls & SECOND]
        at_body = (self.one_way.is_body[a] | self.one_way.is_body[b]) & (self._bits[a] & self._bits[b] != 0)
        at_body &= (self._is_movable[a] | self._is_movable[b]) & self._filters.share_categories(a, b)
        return CandidatePairs(near.balls[at_body], near.segments[at_wall])

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
