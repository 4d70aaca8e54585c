"""Recorder: arrays for the frames of a run, sized from its step schedule before it starts."""

from collections.abc import Callable, Sequence

import numpy as np

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Exhaustion
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


class Recorder:
    """Recorded frames of a run: every n-th, and the last."""

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
        self._scene = scene
        self._every = settings.record_every
        self._count = 0
        self._last = -1.0
        """s, time of the simulation at the last recorded frame; its recorded time can be the exact duration of the run
        """
        self.time: FloatArray = np.empty(frames)
        # Not filled: a run that ends early takes no memory for the frames that it never recorded.
        self.position, self.velocity = (np.empty((frames, bodies, 2)) for _ in range(2))
        self.angle, self.angular_velocity = (np.empty((frames, bodies)) for _ in range(2))
        self.spin: FloatArray | None = None
        """(T, N, 3) rad/s, if the first frame has rolling spheres"""
        self.layer: IntArray | None = None
        """(T, N), if the first frame has layers; −1 for a body that has not been added yet"""
        self._read_energy = read_energy
        self._energy: FloatArray = np.empty(frames if read_energy else 0)
        self._account: FloatArray = np.empty((frames, causes) if read_energy else (0, 0))

    def is_due(self, step: int, is_last: bool) -> bool:
        """Return whether the frame after a number of steps is recorded."""
        return is_last or step % self._every == 0

    def record(self, frame: Frame, time: float) -> None:
        """Record a frame with a time, s."""
        k, n = self._count, len(frame.position)
        if n > self.angle.shape[1]:
            self._widen(n)
        self.time[k], self._last = time, frame.time
        self.position[k, :n], self.velocity[k, :n] = frame.position, frame.velocity
        self.angle[k, :n], self.angular_velocity[k, :n] = frame.angle, frame.angular_velocity
        for values in (self.position, self.velocity, self.angle, self.angular_velocity):
            values[k, n:] = np.nan  # bodies that have not been added yet
        spin = frame.spin
        if spin is not None:
            if self.spin is None:
                self.spin = np.empty((*self.angle.shape, 3))
            self.spin[k, :n], self.spin[k, n:] = spin, np.nan
        if frame.layer is not None:
            if self.layer is None:
                self.layer = np.empty(self.angle.shape, np.int16)
            self.layer[k, :n], self.layer[k, n:] = frame.layer, -1
        if self._read_energy is not None:
            self._energy[k], self._account[k] = self._read_energy()
        self._count += 1

    def record_unless_recorded(self, frame: Frame) -> None:
        """Record the frame at which a run ends early, unless it is the last recorded one."""
        if frame.time != self._last:
            self.record(frame, frame.time)

    def replace_last(self, frame: Frame) -> None:
        """Replace the last recorded frame, with its time."""
        self._count -= 1
        self.record(frame, float(self.time[self._count]))

    def record_end(self, frame: Frame) -> None:
        """Record a frame as the last one; replace a frame of the same time, which actions have changed since."""
        if frame.time == self._last:
            self.replace_last(frame)
        else:
            self.record(frame, frame.time)

    def _widen(self, bodies: int) -> None:
        """Enlarge the arrays for unexpected bodies, such as those that the rules of a game add."""
        wide = bodies + bodies // 2  # more bodies are likely to follow
        if len(self.time) * bytes_per_frame(self._scene, wide, self._account.shape[1]) > free_memory() * FREE_FRACTION:
            raise Exhaustion(f"the frames of {bodies:,} bodies do not fit into memory; use solver.record_every")
        for name in ("position", "velocity", "angle", "angular_velocity", "spin", "layer"):
            old = getattr(self, name)
            if old is not None:
                new = np.full((len(old), wide, *old.shape[2:]), -1 if name == "layer" else np.nan, old.dtype)
                new[: self._count, : old.shape[1]] = old[: self._count]
                setattr(self, name, new)

    def layers(self, bodies: int) -> IntArray:
        """Return the layers of the first bodies, (T, n); (0, 0) if there is a single layer."""
        return np.empty((0, 0), np.int16) if self.layer is None else self.layer[: self._count, :bodies]

    def arrays(self, bodies: int) -> dict[str, FloatArray]:
        """Return the recorded arrays of the first bodies, by their names in `Trajectory`."""
        names = ("position", "velocity", "angle", "angular_velocity")
        kept = {name: getattr(self, name)[: self._count, :bodies] for name in names}
        account = {"energy": self._energy[: self._count], "account": self._account[: self._count]}
        spin = np.empty((0, 0, 3)) if self.spin is None else self.spin[: self._count, :bodies]
        return {"time": self.time[: self._count], "spin": spin, **kept, **account}
