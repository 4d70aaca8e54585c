"""Watch: the contacts that the session's engine misses, noticed while it is played."""

from collections import deque
from time import perf_counter

import numpy as np

from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.run import Auditor
from sandbox.play.sight import Flash
from sandbox.trajectory import Frame

LASTS = 1.5
"""s that a flash is seen"""
MOST = 50
"""Flashes at a time."""


class Watch:
    """Audits a relay, and remembers where a miss was noticed."""

    def __init__(self, relay: SwitchableSimulation) -> None:
        self._auditor = Auditor(relay.setup, relay)
        self._told = 0
        self._flashes: deque[tuple[tuple[float, float], float]] = deque(maxlen=MOST)

    def look(self, frame: Frame) -> int:
        """Take note of what was missed since the last look; return how many that are."""
        _, pairs = self._auditor.missed
        new = pairs[self._told :]
        self._told = len(pairs)
        for number in new[-MOST:, 0].tolist():
            place = frame.position[number]
            if np.isfinite(place).all():
                self._flashes.append(((float(place[0]), float(place[1])), perf_counter()))
        return len(new)

    def flashes(self) -> tuple[Flash, ...]:
        """Return what was noticed a moment ago."""
        now = perf_counter()
        while self._flashes and now - self._flashes[0][1] > LASTS:
            self._flashes.popleft()
        return tuple(Flash(place, now - since) for place, since in self._flashes)
