"""Recorder: arrays for the frames of a run, sized from its step schedule before it starts."""

from collections.abc import Callable, Sequence

import numpy as np

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Exhaustion
from sandbox.frame_table import FrameTable
from sandbox.resource_limits import FREE_FRACTION, TooLargeError, free_memory
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.schedule import frame_count
from sandbox.trajectory import Frame

__all__ = ["EnergyReader", "Recorder", "TooLargeError", "bytes_per_frame", "recorded_frames", "require_memory"]


BYTES_PER_BODY = 6 * 8
"""Bytes of a body in a frame: x, y, vx, vy, angle, ω."""

EnergyReader = Callable[[], tuple[float, Sequence[float]]]
"""Returns the present energy, J, and the cumulative energy of K causes, J."""


def recorded_frames(steps: int, part: float, every: int) -> int:
    """Return the number of recorded frames of a run: the first, every n-th, and the last."""
    return 1 + steps // every + (part > 0.0 or steps % every > 0)


def bytes_per_frame(scene: Scene, bodies: int, causes: int = 0) -> int:
    """Return the bytes of a recorded frame: its time, its bodies with spin and layer, and the energy account.

    Args:
        scene: scene of the run.
        bodies: number of bodies.
        causes: K, number of causes in the energy account; 0 without an account.
    """
    spin = 3 * 8 if scene.surface is not None else 0
    layer = 2 if len(scene.layers) > 1 else 0
    return 8 + max(bodies, 1) * (BYTES_PER_BODY + spin + layer) + (8 * (causes + 1) if causes else 0)


def require_memory(
    scene: Scene, settings: Settings, bodies: int, actions: Sequence[Action] = (), causes: int = 0
) -> int:
    """Return the number of recorded frames of a run, after checking that they fit into memory.

    Args:
        scene: scene of the run.
        settings: settings of the run.
        bodies: number of bodies at the end of the run.
        actions: actions during the run; a switch can change dt.
        causes: K, number of causes in the energy account; 0 without an account.

    Raises:
        TooLargeError: the frames do not fit; the message states a `record_every` that would, if there is one.
    """
    steps, part = frame_count(scene, settings, actions)
    frames = recorded_frames(steps, part, settings.record_every)
    size, free = bytes_per_frame(scene, bodies, causes), int(free_memory() * FREE_FRACTION)
    fitting = free // size
    if frames <= fitting:
        return frames
    count = "1 body" if bodies == 1 else f"{bodies:,} bodies"
    remedy = (
        f"solver.record_every = {steps // (fitting - 1) + 1} would fit (now {settings.record_every})"
        if fitting > 1
        else "not even two frames fit; use fewer bodies"
    )
    raise TooLargeError(
        f"{frames:,} frames of {count} take {frames * size / 1e9:.3g} GB, but only {free / 1e9:.3g} GB are "
        f"available; {remedy}"
    )


class Recorder(FrameTable):
    """Recorded frames of a run: every n-th, and the last; with the energy account of each if it is wanted."""

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        bodies: int,
        actions: Sequence[Action] = (),
        read_energy: EnergyReader | None = None,
        causes: int = 0,
    ) -> None:
        """Allocate the arrays.

        Args:
            scene: scene of the run.
            settings: settings as the engine resolved them.
            bodies: expected number of bodies at the end of the run.
            actions: actions during the run.
            read_energy: called for every recorded frame; None without an energy account.
            causes: K, number of causes in the energy account.

        Raises:
            TooLargeError: the frames would not fit into memory.
        """
        frames = require_memory(scene, settings, bodies, actions, causes if read_energy else 0)
        super().__init__(frames, bodies, settings.record_every)
        self._scene = scene
        self.end_time: float | None = None
        """s, exact duration of a run that has reached it, which the sum of its steps misses by rounding"""
        self._read_energy = read_energy
        self._energy: FloatArray = np.empty(frames if read_energy else 0)
        self._account: FloatArray = np.empty((frames, causes) if read_energy else (0, 0))

    @property
    def has_energy(self) -> bool:
        """Whether energies are recorded, which are read at the moment at which a frame is recorded."""
        return self._read_energy is not None

    def record(self, frame: Frame) -> None:
        """Record a frame."""
        super().record(frame)
        if self._read_energy is not None:
            self._energy[self.count - 1], self._account[self.count - 1] = self._read_energy()

    def record_unless_recorded(self, frame: Frame) -> None:
        """Record a frame unless the last recorded one has its time."""
        if frame.time != self.time[self.count - 1]:
            self.record(frame)

    def replace_last(self, frame: Frame) -> None:
        """Replace the last recorded frame by one of the same time, which actions have changed since."""
        self.count -= 1
        self.record(frame)

    def record_end(self, frame: Frame) -> None:
        """Record a frame as the last one, or replace a frame of the same time."""
        if frame.time == self.time[self.count - 1]:
            self.replace_last(frame)
        else:
            self.record(frame)

    def _widen(self, bodies: int) -> None:
        wide = bodies + bodies // 2  # more bodies are likely to follow
        if len(self.time) * bytes_per_frame(self._scene, wide, self._account.shape[1]) > free_memory() * FREE_FRACTION:
            raise Exhaustion(f"the frames of {bodies:,} bodies do not fit into memory; use solver.record_every")
        self._resize_columns(wide)

    def layers(self, bodies: int) -> IntArray:
        """Return the layers of the first bodies, (T, n); (0, 0) if there is a single layer."""
        return np.empty((0, 0), np.int16) if self.layer is None else self.layer[: self.count, :bodies]

    def arrays(self, bodies: int) -> dict[str, FloatArray]:
        """Return the recorded arrays of the first bodies, by their names in `Trajectory`."""
        if self.end_time is not None:
            self.time[self.count - 1] = self.end_time
        names = ("position", "velocity", "angle", "angular_velocity")
        kept = {name: getattr(self, name)[: self.count, :bodies] for name in names}
        account = {"energy": self._energy[: self.count], "account": self._account[: self.count]}
        spin = np.empty((0, 0, 3)) if self.spin is None else self.spin[: self.count, :bodies]
        return {"time": self.time[: self.count], "spin": spin, **kept, **account}
