"""Running: what every simulation here has of its own accord: a clock, a lock, an end, and a fingerprint."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NoReturn

from sandbox.engines.account import Cause
from sandbox.engines.turn import Turn
from sandbox.scene.settings import Settings
from sandbox.trajectory import Frame


class Running(ABC):
    """A simulation that advances by steps of dt, one thread at a time, until it ends."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._turn = Turn()
        self._steps, self._part = 0, 0.0
        self._ended = False
        self.patience: float | None = None
        """s that a step may take, where the engine can tell while it works"""

    def __reduce__(self) -> NoReturn:
        """Refuse to be copied or pickled: in contact a copied space goes on differently, and says nothing."""
        raise TypeError("a running simulation cannot be copied; start its scene again and repeat its actions")

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return (self._steps + self._part) * self._settings.dt

    @property
    def substeps(self) -> int:
        """How many substeps there have been, one that was cut short at the end included."""
        return self._steps * self._settings.substeps + math.ceil(self._part * self._settings.substeps)

    @property
    def settings(self) -> Settings:
        """The settings, with every choice filled in."""
        return self._settings

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""
        return {}

    @abstractmethod
    def frame(self) -> Frame:
        """Return the present state."""

    @abstractmethod
    def account(self) -> Mapping[Cause, float]:
        """Return the energy, J, that each cause has brought since the first call."""

    def _after(self, substeps: int) -> float:
        """Return the time after so many substeps of the present step, s; after all of them, the next frame's."""
        return (self._steps + substeps / self._settings.substeps) * self._settings.dt

    def state_hash(self) -> str:
        """Return a SHA-256 of time and every body's state."""
        return self.frame().state_hash()

    def close(self) -> None:
        """End the simulation. What it holds goes with it."""
        self._ended = True

    def _check_running(self) -> None:
        if self._ended:
            raise RuntimeError("the simulation has ended; it can be read, but not go on")

    @staticmethod
    def _check_part(part: float) -> None:
        if not 0.0 < part < 1.0:
            raise ValueError(f"a last part of {part} steps; it is more than 0 and less than 1")
