"""PieceFinder: broad phase, then narrow phase, for scenes in which not all bodies are balls.

The broad phases see a disc around each piece. `oriented` looks at oriented boxes after that: worth it where pieces are
long, as a disc around them holds mostly nothing.
"""

import numpy as np

from sandbox.engines.reference.candidates import Candidates
from sandbox.engines.reference.finder import Finder
from sandbox.engines.reference.piece_contacts import (
    Look,
    drop,
    drop_apart,
    lay_boxes,
    meet_bodies,
    meet_fixed_segments,
    meet_half_planes,
)
from sandbox.engines.reference.pieces import Pieces
from sandbox.engines.reference.segments import near_segments
from sandbox.engines.roster import Roster
from sandbox.trajectory import FloatArray, IntArray


class PieceFinder(Finder):
    """Finds contacts of convex pieces, in the order of their keys; counts the work."""

    def __init__(self, roster: Roster, broad_phase: str) -> None:
        self._oriented = broad_phase == "oriented"
        super().__init__(roster, "sweep" if self._oriented else broad_phase)

    def population_changed(self) -> None:
        """Work out anew who can meet what."""
        super().population_changed()
        roster = self._roster
        self._pieces = Pieces(roster)
        self._owner = self._pieces.body
        self._order: IntArray = np.arange(self._pieces.count)
        self._plane_tests = self._planes * int(np.count_nonzero(self._pieces.able))
        self._box = np.empty((len(self._pieces.radius), 6))
        self._scratch = np.empty((2, 6))
        touching = roster.bodies.thin[self.able]
        if np.isfinite(self.thinnest):
            self.thinnest = float(touching.min(initial=np.inf))

    def _lay_out(self, position: FloatArray) -> None:
        angle = position[:, 2] if position.shape[1] == 3 else self._roster.angle
        self._pieces.lay_out(position, angle)

    def candidates(self, position: FloatArray, margin: float = 0.0, walls_alone: bool = False) -> Candidates:
        """Return the pairs of pieces, and of pieces and segments, worth a look at (N, ≥ 2) positions, m."""
        self._lay_out(position)
        roster, boxes, pieces = self._roster, self._boxes, self._pieces
        bodies = segments = self._ball_keys[:0]
        if roster.meet.mutual and not walls_alone:
            self._ball_keys, bodies = self._filled(
                self._ball_keys,
                lambda room: self._broad_phase(
                    self._order, pieces.middle, pieces.reach, pieces.meets, pieces.moves, margin, room
                ),
            )
            bodies = bodies[: drop(bodies, pieces.body, pieces.apart, pieces.group)]
        if len(boxes):
            self._segment_keys, segments = self._filled(
                self._segment_keys,
                lambda room: near_segments(
                    pieces.middle, pieces.reach, pieces.able, boxes.box, boxes.index, boxes.widest, margin, room
                ),
            )
        if self._oriented and (len(bodies) or len(segments)):
            box = self._box
            lay_boxes(pieces.corner, pieces.first, pieces.radius, box)
            self.work["broad_tests"] += len(bodies) + len(segments)
            bodies = bodies[: drop_apart(bodies, 0, box, margin)]
            segments = segments[: drop_apart(segments, pieces.count, box, margin)]
        near = Candidates(bodies, segments)
        return near if self.sieve is None or walls_alone else self.sieve.some(near, self._owner)

    def _looked(self, position: FloatArray, near: Candidates, reach: float) -> int:
        """Write the contacts as far as there is room; return how many there are."""
        self._lay_out(position)
        roster, fixtures, pieces, size = self._roster, self._roster.fixtures, self._pieces, 0
        hulls = pieces.hulls
        look = Look(*self._tables, reach, self._scratch)
        if len(near.balls):
            size = meet_bodies(near.balls, hulls, position, look, self._out, size)
        if self._planes:
            things = fixtures.planes, fixtures.plane_thing, roster.fixed_surface
            size = meet_half_planes(hulls, pieces.able, position, *things, look, self._out, size)
        if len(near.segments):
            walls = fixtures.joints, fixtures.segment_thing, roster.fixed_surface
            size = meet_fixed_segments(near.segments, hulls, position, *walls, look, self._out, size)
        return size

    def farthest(self, start: FloatArray, end: FloatArray) -> float:
        """Return the longest way, m, of any point of those that can touch anything, between two sets of poses."""
        way = (end - start)[self.able]
        length = np.sqrt((way[:, :2] ** 2).sum(axis=1))
        if way.shape[1] == 3:
            reach = self._roster.radius[self.able]
            if self._roster.held:
                reach = reach + np.hypot(*self._roster.hinge[self.able].T)
            length += np.abs(way[:, 2]) * reach
        return float(length.max(initial=0.0))
