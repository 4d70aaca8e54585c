"""Base class of simulations: clock, lock, end of the run, and the bounds of a valid state."""

import copy
import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NoReturn, Protocol, Self

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Observer, PairRuns, PathObserver, SnapshotError, StateSnapshot
from sandbox.engines.energy_ledger import Cause
from sandbox.frame_table import FrameTable
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import PlaneReach
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Frame


class StepLock:
    """Non-blocking lock that is held while a simulation is being changed.

    Two threads in one pymunk space hang or crash the process. In other engines they would corrupt the step.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        """Acquire the lock.

        Raises:
            RuntimeError: the lock is held already.
        """
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("a step or action of the simulation is still in progress, perhaps in another thread")

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        self._lock.release()


class BaseSimulation(ABC):
    """Simulation that advances by time steps dt until it ends. One thread at a time may use it."""

    uncopied: ClassVar[str | None] = None
    """reason why the state cannot be copied; None if it can"""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._lock = StepLock()
        self._observer: Observer | None = None
        self._steps, self._part = 0, 0.0
        self._ended = False
        self.patience: float | None = None
        """s, largest computing time of a step; engines check it where they can. None: unlimited"""

    @property
    def makes_whole_steps(self) -> bool:
        """Whether no step is shorter than dt, as `Simulation.makes_whole_steps`."""
        return False

    def __reduce__(self) -> NoReturn:
        """Refuse pickling and shallow copies, which would share arrays with the original."""
        raise TypeError("a running simulation cannot be pickled; use `snapshot`, or start its scene again")

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return an independent simulation in the same state, without the observer.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """
        if self.uncopied is not None:
            raise SnapshotError(self.uncopied)
        with self._lock:
            memo[id(self)] = copied = type(self).__new__(type(self))
            memo[id(self._settings)] = self._settings
            state = {key: value for key, value in self.__dict__.items() if key not in ("_lock", "_observer")}
            copied.__dict__ = {**copy.deepcopy(state, memo), "_lock": StepLock(), "_observer": None}
            return copied

    def snapshot(self) -> StateSnapshot[Self]:
        """Return a copy of the whole state, as `Simulation.snapshot`."""
        return StateSnapshot(self)

    def restore(self, snapshot: StateSnapshot[Self]) -> None:
        """Return to the state of a snapshot, as `Simulation.restore`.

        Raises:
            ValueError: the snapshot is that of another engine.
        """
        resumed = snapshot.resumed()
        if type(resumed) is not type(self):
            raise ValueError(f"{snapshot!r} is not a snapshot of a {type(self).__name__}")
        with self._lock:
            kept = {"_lock": self._lock, "_observer": self._observer}
            self.__dict__ = {**resumed.__dict__, **kept}

    @property
    @abstractmethod
    def setup(self) -> Setup:
        """State from which the simulation started, with the changes that actions have made to its scene."""

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""
        return self.setup.scene

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return (self._steps + self._part) * self._settings.dt

    @property
    def substeps(self) -> int:
        """Number of substeps so far, including a shortened last one."""
        return self._steps * self._settings.substeps + math.ceil(self._part * self._settings.substeps)

    @property
    def settings(self) -> Settings:
        """The settings, with every default chosen by the engine filled in."""
        return self._settings

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints broke."""
        return {}

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes as (x, y, distance), m; None if they are infinite."""
        return None

    @abstractmethod
    def frame(self) -> Frame:
        """Return the present state."""

    @abstractmethod
    def step(self) -> None:
        """Advance by one time step dt."""

    def advance(self, steps: int, frames: FrameTable, *, until_event: bool = False) -> None:
        """Advance by at most so many time steps, and record the frames that are due, as `Simulation.advance`.

        Engines override this method where they have a faster way to the same results.
        """
        step_and_record(self, 1 if until_event else steps, frames)

    @abstractmethod
    def account(self) -> Mapping[Cause, float]:
        """Return the energy change, J, by each cause since the first call."""

    def _after(self, substeps: float) -> float:
        """Return the time after a number of substeps of the present step, s.

        After all of them it is the next frame's time.
        """
        return (self._steps + substeps / self._settings.substeps) * self._settings.dt

    def state_hash(self) -> str:
        """Return the SHA-256 of the time and the state of every body."""
        return self.frame().state_hash()

    def close(self) -> None:
        """End the simulation and release its resources."""
        self._ended = True

    def _check_running(self) -> None:
        if self._ended:
            raise RuntimeError("the simulation has ended; its state can be read, but it cannot continue")

    @staticmethod
    def _check_part(part: float) -> None:
        if not 0.0 < part < 1.0:
            raise ValueError(f"a last part of {part} steps; it must be greater than 0 and less than 1")


class Stepping(Protocol):
    """A simulation that can be stepped and read."""

    def step(self) -> None:
        """Advance by one time step dt."""

    def frame(self) -> Frame:
        """Return the present state."""


def step_and_record(simulation: Stepping, steps: int, frames: FrameTable) -> None:
    """Step a simulation, and record each frame that is due."""
    for _ in range(steps):
        simulation.step()
        frames.steps += 1
        if frames.is_due():
            frames.record(simulation.frame())


def observe_path(observer: Observer, times: FloatArray, path: FloatArray, pairs: PairRuns) -> None:
    """Pass B substeps to an observer, at once if it can take them so, else one by one.

    Args:
        observer: the observer.
        times: (B,) s, start of each substep.
        path: (B + 1, N, 2) m, centres before the first substep and after each.
        pairs: pairs in contact at the end of each.
    """
    if not len(times):
        return
    if isinstance(observer, PathObserver):
        observer.observe_path(times, path, pairs)
        return
    begin = 0
    for end, touching in pairs:
        for k in range(begin, end):
            observer(float(times[k]), path[k], path[k + 1], touching)
        begin = end


class SteppedSimulation(BaseSimulation):
    """Simulation whose shortened last step differs from the others only in its length."""

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: the state of a body is not finite, or exceeds the bounds. It can still be read.
            Exhaustion: the step exceeds a resource limit.
        """
        with self._lock, np.errstate(all="ignore"):  # `_finish_step` reports a state that is not finite
            self._check_running()
            self._make_step(1.0)
            self._steps += 1
            self._finish_step()

    def finish(self, part: float) -> None:
        """Advance by a last fraction of dt, 0 < part < 1, or by dt with `makes_whole_steps`. No step can follow.

        Raises:
            Divergence: as `step`.
            Exhaustion: as `step`.
            ValueError: `part` is out of range.
        """
        self._check_part(part)
        with self._lock, np.errstate(all="ignore"):
            self._check_running()
            if self.makes_whole_steps:
                self._make_step(1.0)
                self._steps += 1
            else:
                self._make_step(part)
                self._part = part
            self._finish_step()
            self._ended = True

    @abstractmethod
    def _make_step(self, part: float) -> None:
        """Advance the bodies by a fraction of dt, 0 < part <= 1."""

    @abstractmethod
    def _finish_step(self) -> None:
        """Check that the state is finite and bounded, and remove expired bodies."""


FARTHEST = 1e17
"""m, largest distance from the origin; ten times the largest start position of a scene"""

FASTEST = 1e13
"""m/s, largest speed; ten times the largest start speed of a scene"""

BEYOND = "is not finite, or is out of range"
