"""BallFinder: broad phase, then narrow phase, for scenes of balls; and when on their ways they first touch."""

import numpy as np

from sandbox.engines.reference.candidates import Candidates
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.manifolds import KIND, Manifolds, meet_balls, meet_planes, meet_segments
from sandbox.engines.reference.piece_contacts import drop
from sandbox.engines.reference.pieces import apart_keys
from sandbox.engines.reference.segments import near_segments
from sandbox.engines.reference.touch import first_touch
from sandbox.trajectory import FloatArray, IntArray


class BallFinder(Finder):
    """Finds contacts of balls, in the order of their keys; counts the work."""

    def population_changed(self) -> None:
        """Work out anew who can meet what."""
        super().population_changed()
        self._apart: IntArray = apart_keys(self._roster.links)
        self._owner = np.arange(len(self._roster.position))  # each ball is its own body

    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> Candidates:
        """Return the pairs worth a look at (N, ≥ 2) positions, m: none nearer than the margin, m, is left out."""
        roster, boxes = self._roster, self._boxes
        balls = segments = self._ball_keys[:0]
        if roster.meet.ball_ball and not walls_alone:
            self._ball_keys, balls = self._filled(
                self._ball_keys,
                lambda room: self._broad_phase(
                    self._order, position, roster.radius, roster.meets, self._moves, margin, room
                ),
            )
            if len(self._apart):
                balls = balls[: drop(balls, self._owner, self._apart, roster.bodies.group)]
        if len(boxes):
            self._segment_keys, segments = self._filled(
                self._segment_keys,
                lambda room: near_segments(
                    position, roster.radius, self.able, boxes.box, boxes.index, boxes.widest, margin, room
                ),
            )
        near = Candidates(balls, segments)
        return near if self.sieve is None or walls_alone else self.sieve.some(near, self._owner)

    def _looked(self, position: FloatArray, near: Candidates, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""
        roster, fixtures, size = self._roster, self._roster.fixtures, 0
        radius, surface, other = roster.radius, roster.surface, roster.fixed_surface
        if len(near.balls):
            size = meet_balls(near.balls, position, radius, surface, *self._tables, reach, self._out, size)
        if self._planes:
            things = fixtures.planes, fixtures.plane_thing, other
            size = meet_planes(position, radius, self.able, surface, *things, *self._tables, reach, self._out, size)
        if len(near.segments):
            walls = fixtures.segments, fixtures.joints, fixtures.segment_thing, other
            size = meet_segments(
                near.segments, position, radius, surface, *walls, *self._tables, reach, self._out, size
            )
        return size

    def farthest(self, start: FloatArray, end: FloatArray) -> float:
        """Return the longest way, m, between two sets of (N, ≥ 2) centres, of those that can touch anything."""
        way = (end - start)[self.able, :2]
        return float(np.sqrt((way * way).sum(axis=1)).max(initial=0.0))

    def first_touch(self, start: FloatArray, end: FloatArray, rest: IntArray) -> tuple[float, int]:
        """Return the share of straight ways at which a pair first touches, and its key; −1 for none.

        Pairs whose keys are in `rest`, ascending, are left out.
        """
        roster = self._roster
        if self.sieve is not None:
            rest = self.sieve.with_planes_apart(rest, self.able)
        near = self.candidates(start, 2.0 * self.farthest(start, end))
        self.work["pair_tests"] += len(near.balls) + len(near.segments) + self._plane_tests
        fixtures = roster.fixtures
        walls = near.segments, fixtures.segments, fixtures.joints
        share, key = first_touch(start, end, roster.radius, self.able, near.balls, fixtures.planes, *walls, rest)
        return float(share), int(key)

    def only(self, position: FloatArray, key: int) -> Manifolds:
        """Return the manifold of one pair, whether it overlaps or not."""
        balls = np.array([key] if key >> KIND == 0 else [], np.int64)
        segments = np.array([key - (2 << KIND)] if key >> KIND == 2 else [], np.int64)
        contacts = self.manifolds(position, Candidates(balls, segments), np.inf)
        return contacts.of(contacts.key == key)
