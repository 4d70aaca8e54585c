"""Tearing: links that break under more than their strength."""

import numpy as np

from sandbox.scene.links import Links
from sandbox.trajectory import FloatArray, IntArray


class Tearing:
    """What each link gave in the present substep, and which may still break.

    A force is the mean over a substep and not over the pieces that impacts cut it into: the shorter one is, the larger
    its forces.
    """

    def __init__(self, links: Links) -> None:
        self._strength = links.strength
        self._breakable: IntArray = np.flatnonzero(np.isfinite(links.strength))
        self._given: FloatArray = np.zeros((len(links), 2))  # N·s or N·m·s, in this substep

    @property
    def any(self) -> bool:
        """Whether some link may still break."""
        return len(self._breakable) > 0

    def note(self, given: FloatArray) -> None:
        """Take note of what links gave in a piece of a substep, (L, 2) N·s or N·m·s."""
        self._given += given

    def torn(self, h: float) -> IntArray:
        """Return the numbers of the links that break at the end of a substep of h, s."""
        force = np.hypot(*self._given[self._breakable].T) / h
        self._given[:] = 0.0
        broken: IntArray = self._breakable[force > self._strength[self._breakable]]
        if len(broken):
            self._breakable = np.setdiff1d(self._breakable, broken)
        return broken
