"""RememberedImpulses: what pymunk reports too much where shapes meet again.

Two shapes that part are remembered for `persistence` substeps. If they touch again by then, Munk2D starts each point
that it knows again, by its hash, at the impulse that was accumulated there (`cpArbiterUpdate`) without applying it
(`cpArbiterApplyCachedImpulse` skips first contacts). What it then reports as the total holds the old impulses a
second time. Taken off again, the impulses of a run add up to its change of momentum, to rounding.

What a contact starts with can be read when it begins. That serves every shape: polygons, of whose two points one may
be known and the other new, and bodies of several pieces, of which one parts while another stays.
"""

from typing import Any

import numpy as np
import pymunk

from sandbox.engines.native.record import impulses_of
from sandbox.engines.touching import Touching
from sandbox.trajectory import FloatArray, IntArray


class RememberedImpulses:
    """The impulses that contacts of the last substep began with, which had been applied before they parted."""

    def __init__(self, space: pymunk.Space) -> None:
        self._ids: list[tuple[int, int]] = []
        self._impulses: list[tuple[float, float]] = []
        self.pairs = False
        """whether anybody takes them"""
        self.points: dict[int, FloatArray] | None = None
        """the same point by point, (C, 2) by the address of the arbiter; where a dict is put here"""
        space.on_collision(begin=self._begin)

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        x, y = arbiter.total_impulse
        if not (x or y):
            return
        if self.points is not None:
            where, impulses = impulses_of(arbiter)
            self.points[where] = impulses
        if self.pairs:
            a, b = arbiter.shapes
            if a.body is not None and b.body is not None:
                self._ids.append((a.body.id, b.body.id))
                self._impulses.append((x, y))

    @property
    def found(self) -> bool:
        """Whether there are some."""
        return bool(self._ids)

    def take(self) -> tuple[IntArray, FloatArray]:
        """Return the ids (K, 2) of the bodies, and the impulses (K, 2) on the first of each, N·s; forget them."""
        ids, impulses = np.asarray(self._ids, np.int64).reshape(-1, 2), np.asarray(self._impulses).reshape(-1, 2)
        self._ids, self._impulses = [], []
        return ids, impulses


def without(touching: Touching, pair: IntArray, impulse: FloatArray) -> Touching:
    """Return what touches without impulses that are counted twice.

    Args:
        touching: what pymunk reports.
        pair: (K, 2) numbers of the bodies; where they touch in several places, it does not matter in which.
        impulse: (K, 2) on the first of each, N·s.
    """
    if not len(pair) or not len(touching.a):
        return touching
    low = int(min(touching.a.min(), touching.b.min(), pair.min()))
    span = int(max(touching.a.max(), touching.b.max(), pair.max())) - low + 1
    key = (touching.a - low) * span + touching.b - low
    order = np.argsort(key, kind="stable")
    corrected = touching.impulse.copy()
    given = impulse[:, 0] + 1j * impulse[:, 1]
    for first, second, sign in ((0, 1, 1.0), (1, 0, -1.0)):
        wanted = (pair[:, first] - low) * span + pair[:, second] - low
        row = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
        found = key[row] == wanted
        np.subtract.at(corrected, row[found], sign * given[found])
        pair, given = pair[~found], given[~found]  # some may be listed the other way round
    return touching._replace(impulse=corrected)
