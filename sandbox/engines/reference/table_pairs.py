"""Pairs of balls and cushions on a surface that can have touched within a substep, by the circle pipeline."""

from collections.abc import Mapping

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import NOTHING
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.tabletop.contacts import SKIN
from sandbox.engines.tabletop.simulation import TabletopBodyStore
from sandbox.scene.description.world import Settings


class CirclePairFinder:
    """`CollisionDetector` that uses the broad phase and narrow phase of this engine.

    The candidates of a substep are all pairs that can have touched within it: those whose separation at its end is less
    than their largest relative displacement. So no ball tunnels, at any speed.
    """

    def __init__(self, store: TabletopBodyStore, settings: Settings) -> None:
        """Create the detector.

        Args:
            store: the bodies, whose positions the stepper writes.
            settings: with every choice filled in.

        Raises:
            Exhaustion: the first collision detection needs more memory or work than its limit.
        """
        assert settings.broad_phase is not None
        self._store, self._h = store, settings.h
        self._pipeline = CirclePipeline(store, settings.broad_phase)
        self._pipeline.check_limits(store.position)

    @property
    def work(self) -> Mapping[str, int]:
        """Work counters since the start."""
        return self._pipeline.work

    def rebuild(self) -> None:
        """Update after a change of the bodies or static colliders."""
        self._pipeline.rebuild()

    def find_pairs(self, velocity: FloatArray) -> IntArray:
        """Return the pairs (K, 2) that can have touched in a substep with mean velocities (N, 2), m/s."""
        pipeline, position = self._pipeline, self._store.position
        fastest = float(np.sqrt((velocity * velocity).sum(axis=1).max(initial=0.0)))
        margin = 2.0 * (SKIN * pipeline.max_radius + self._h * fastest)
        contacts = pipeline.manifolds(position, pipeline.candidates(position, margin), margin)
        first, second = contacts.first, contacts.second
        mask = self._store.balls.collision_mask  # NOTHING for balls in pockets, too
        collides = (mask[first] != NOTHING) & ((second < 0) | (mask[np.maximum(second, 0)] != NOTHING))
        return np.column_stack((first[collides], second[collides]))

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a ball: it is in the arrays of the store already."""
