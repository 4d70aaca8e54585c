"""Sieve: which of those that are near each other do not meet, though their kinds could.

Two that share no layer pass over each other, one-way walls let through who comes from their right, and of two that
are held, led or fixed, neither yields. A scene that knows none of this has no sieve.
"""

import numpy as np

from sandbox.engines.reference.candidates import Candidates
from sandbox.engines.reference.gates import Gates
from sandbox.engines.reference.manifolds import KIND, Manifolds
from sandbox.engines.reference.meeting import FIRST, SECOND
from sandbox.engines.roster import Roster
from sandbox.scene.model import Scene
from sandbox.scene.zone import mask_of
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Sieve:
    """What keeps the bodies of a roster apart from what they do not meet."""

    def __init__(self, roster: Roster) -> None:
        self._roster, scene = roster, roster.scene
        self._of_fixed: IntArray = np.asarray([mask_of(t.layers, scene.layers) for t in scene.fixed], np.int64)
        every = (1 << len(scene.layers)) - 1
        self._planes_apart = bool((self._of_fixed[: len(scene.planes)] != every).any())
        self.gates = Gates(roster) if any(wall.one_way for wall in scene.walls) else None
        """the one-way walls, where there are some"""
        self.population_changed(roster.position)

    @staticmethod
    def needed(scene: Scene) -> bool:
        """Tell whether a scene has layers, one-way walls, or zones that hold."""
        return len(scene.layers) > 1 or any(wall.one_way for wall in scene.walls) or any(z.holds for z in scene.zones)

    def population_changed(self, position: FloatArray) -> None:
        """Take note of who is on which layer, who is held, where they are, (N, ≥ 2) m, and where walls run."""
        self._bits: IntArray = 1 << self._roster.layer
        self._yields: BoolArray = (self._roster.inverse_mass > 0.0) | (self._roster.inverse_moment > 0.0)
        self._thing = self._roster.fixtures.segment_thing
        if self.gates is not None:
            self.gates.renew(position)

    def some(self, near: Candidates, owner: IntArray) -> Candidates:
        """Return the candidates that meet; `owner` is the body of each ball, or piece."""
        balls, segments = near
        if len(balls):
            a, b = owner[balls >> FIRST], owner[balls & SECOND]
            balls = balls[(self._yields[a] | self._yields[b]) & (self._bits[a] & self._bits[b] != 0)]
        if len(segments):
            body, thing = owner[segments >> FIRST], self._thing[segments & SECOND]
            meets = self._bits[body] & self._of_fixed[thing] != 0
            if self.gates is not None:
                meets[meets] = self.gates.stop(body[meets], thing[meets])
            segments = segments[meets]
        return Candidates(balls, segments)

    def at_gates(self, near: Candidates, owner: IntArray) -> Candidates:
        """Return the candidates of one-way walls that share a layer with them, and no others."""
        assert self.gates is not None
        body, thing = owner[near.segments >> FIRST], self._thing[near.segments & SECOND]
        meets = self.gates.of_thing[thing] & (self._bits[body] & self._of_fixed[thing] != 0)
        return Candidates(near.balls[:0], near.segments[meets])

    def gate(self, second: IntArray) -> BoolArray:
        """Tell which seconds of contacts (K,) are one-way walls."""
        assert self.gates is not None
        return np.asarray(self.gates.of_thing[np.maximum(-1 - second, 0)] & (second < 0))

    def on_planes(self, contacts: Manifolds) -> Manifolds:
        """Return contacts without those of planes on other layers, of which every body is a candidate."""
        if not self._planes_apart:
            return contacts
        thing = np.maximum(-1 - contacts.second, 0)
        return contacts.of((contacts.second >= 0) | (self._bits[contacts.first] & self._of_fixed[thing] != 0))

    def with_planes_apart(self, keys: IntArray, able: BoolArray) -> IntArray:
        """Return keys, ascending, with those of all able balls and planes on other layers."""
        if not self._planes_apart:
            return keys
        apart = able[:, None] & (self._bits[:, None] & self._of_fixed[self._roster.fixtures.plane_thing] == 0)
        ball, plane = np.nonzero(apart)
        return np.union1d(keys, (1 << KIND) + (ball << FIRST) + plane)
