"""Gates: one-way walls. Who comes from the right of one is let through, for as long as the two overlap.

Which side a body comes from is told by its centre when the two do not yet touch, at the beginning of the piece of a
substep in which they come to. What is then decided holds until they touch no more: so what turns round within goes
back unhindered, and what was stopped and is too deep is not let through. Of a polyline the nearest segment tells;
where two are equally near, at a joint, the sum of their normals does (Bærentzen & Aanæs 2005, pseudonormals).
"""

import numpy as np

from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.roster import Roster
from sandbox.scene.model import Wall
from sandbox.trajectory import BoolArray, FloatArray, IntArray

EQUAL = 1e-9
"""Distances that differ by less than this part are those of one joint."""

Pair = tuple[int, int]
"""A body and a fixed thing, by their numbers."""


class Gates:
    """The one-way walls of a run, and who touches them."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
        self.of_thing: BoolArray = np.asarray([isinstance(t, Wall) and t.one_way for t in roster.scene.fixed], np.bool_)
        """(F,) which fixed things are some"""
        self._passing: set[Pair] = {(body, -1 - wall) for body, wall in roster.scene.passing}
        self._stopped: set[Pair] = set()
        self._goes_on = roster.scene.began > 0.0  # from a state that tells who passes: others on the left are stopped

    def renew(self, start: FloatArray) -> None:
        """Go on from centres (N, ≥ 2), m, with walls that may have other courses, or be solid now."""
        fixtures, self._start = self._roster.fixtures, start
        self._segments = {
            thing: fixtures.segments[fixtures.segment_thing == thing, :4]
            for thing in np.flatnonzero(self.of_thing).tolist()
        }

    def stop(self, bodies: IntArray, things: IntArray) -> BoolArray:
        """Tell which pairs (K,) of a body and a fixed thing that is near meet: all but those that are let through."""
        found = np.ones(len(bodies), np.bool_)
        for k in np.flatnonzero(self.of_thing[things]).tolist():
            found[k] = self._stops((int(bodies[k]), int(things[k])))
        return found

    def settle(self, overlaps: Manifolds, end: FloatArray) -> None:
        """Take note of who touches at the end of a piece of a substep, where centres are (N, ≥ 2), m."""
        touching = _pairs(overlaps)
        self._passing = {pair for pair in touching if not self._stops(pair)}
        self._stopped, self._start = touching - self._passing, end

    def begin(self, overlaps: Manifolds, closing: FloatArray) -> None:
        """Take note of who touches at the beginning: new is stopped who is on the left and does not leave, (K,) m/s."""
        coming = _pairs(overlaps if self._goes_on else overlaps.of(closing >= 0.0))
        self._goes_on = False
        touching, known = _pairs(overlaps), self._passing | self._stopped
        passing = {pair for pair in touching - known if pair not in coming or not self._on_left(pair)}
        self._passing = passing | (self._passing & touching)
        self._stopped = touching - self._passing

    @property
    def passing(self) -> IntArray | None:
        """Who is being let through, and which wall, −1 − k, (P, 2); none where nobody is."""
        pairs = sorted((body, -1 - thing) for body, thing in self._passing)
        return np.asarray(pairs, np.int64) if pairs else None

    def _stops(self, pair: Pair) -> bool:
        if pair in self._passing:
            return False
        return pair in self._stopped or self._on_left(pair)

    def _on_left(self, pair: Pair) -> bool:
        """Tell whether a body is on the left of a wall, or on its line."""
        body, thing = pair
        segments = self._segments[thing]
        a, b, place = segments[:, :2], segments[:, 2:], self._start[body, :2]
        along = b - a
        length = np.sqrt((along * along).sum(axis=1))
        unit = along / length[:, None]
        off = place - a
        share = np.clip((off * unit).sum(axis=1), 0.0, length)
        away = np.hypot(*(off - share[:, None] * unit).T)
        nearest = away <= away.min() * (1.0 + EQUAL)
        across = unit[:, 0] * off[:, 1] - unit[:, 1] * off[:, 0]
        return bool(across[nearest].sum() >= 0.0)


def _pairs(contacts: Manifolds) -> set[Pair]:
    return set(zip(contacts.first.tolist(), (-1 - contacts.second).tolist(), strict=True))
