"""PartedMemory: the impulses that pymunk still remembers of contacts that have parted.

When a pair touches again within `persistence` substeps, Munk2D starts its accumulated impulse at the old value
(`cpArbiterUpdate`) without having applied it (`cpArbiterApplyCachedImpulse` skips first contacts). What it then
reports as the total holds the old impulse a second time. Taken off again, the impulses of a run add up to its change
of momentum, to rounding.
"""

import numpy as np

from sandbox.engines.touching import ComplexArray
from sandbox.trajectory import IntArray


class PartedMemory:
    """The last accumulated impulses of pairs that touched no more than `persistence` substeps ago."""

    def __init__(self, persistence: int) -> None:
        self._persistence = persistence
        self._moment = 0
        self._parted: dict[int, tuple[int, complex]] = {}

    def forget_and_advance(self) -> None:
        """Go on to the next substep."""
        self._moment += 1
        while self._parted:
            key = next(iter(self._parted))
            if self._moment - self._parted[key][0] <= self._persistence:
                break
            del self._parted[key]

    def part(self, key: IntArray, impulse: ComplexArray, normal: ComplexArray) -> None:
        """Remember pairs that touched in the last substep, and do not now.

        Args:
            key: (K,) of the pairs.
            impulse: (K,) on the first of each, as pymunk reported it, N·s.
            normal: (K,) from the first to the second.
        """
        # pymunk accumulates along the normal and across it: the impulse turned back by the normal.
        accumulated = -impulse * normal.conj()
        for each, value in zip(key.tolist(), accumulated.tolist(), strict=True):
            self._parted.pop(each, None)  # so that the dict stays in the order of parting
            self._parted[each] = self._moment - 1, value

    def excess(self, key: IntArray, normal: ComplexArray) -> ComplexArray:
        """Return what pymunk reports too much (K,), on the first of pairs that have just met, N·s."""
        known = [self._parted.pop(each, (0, 0j))[1] for each in key.tolist()]
        return -normal * np.asarray(known, np.complex128)
