"""Trails: the last places of the bodies."""

from collections import deque

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.trajectory import Frame

LENGTH = 120
"""States that a trail goes back."""
MOST = 2000
"""Bodies that leave trails; of more, none does."""


class Trails:
    """Remembers where bodies were."""

    def __init__(self) -> None:
        self._places: deque[tuple[float, FloatArray]] = deque(maxlen=LENGTH)

    def keep(self, frame: Frame) -> None:
        """Take note of a state; one of an earlier time begins anew."""
        if len(frame.position) > MOST:
            self.clear()
            return
        if self._places and frame.time <= self._places[-1][0]:
            if frame.time == self._places[-1][0]:
                self._places.pop()
            else:
                self.clear()
        places = np.where(frame.present[:, None], frame.position, np.nan)
        self._places.append((frame.time, places))

    def pieces(self) -> tuple[FloatArray, ...]:
        """Return (T, N, 2) m for each stretch of time with the same bodies, oldest first."""
        found: list[list[FloatArray]] = []
        for _, places in self._places:
            if found and len(found[-1][-1]) == len(places):
                found[-1].append(places)
            else:
                found.append([places])
        return tuple(np.stack(piece) for piece in found)

    def clear(self) -> None:
        """Forget all."""
        self._places.clear()
