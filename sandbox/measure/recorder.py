"""Recorder: arrays for the frames of a run, sized before it starts."""

from collections.abc import Callable, Sequence

import numpy as np

from sandbox.action import Action
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Exhaustion
from sandbox.measure.schedule import schedule
from sandbox.resource_limits import FREE_FRACTION, TooLargeError, free_memory
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

__all__ = [
    "Books",
    "Recorder",
    "TooLargeError",
    "bytes_per_frame",
    "frame_count",
    "kept_frames",
    "require_memory",
]

BYTES_PER_BODY = 6 * 8
"""of a frame: x, y, vx, vy, angle, ω"""

Books = Callable[[], tuple[float, Sequence[float]]]
"""Tells the present energy, J, and what each of K causes has brought by then."""


def frame_count(scene: Scene, settings: Settings, actions: Sequence[Action] = ()) -> tuple[int, float]:
    """Return how many whole steps a run has, and the part of a step (0 ≤ part < 1) that is left for its end.

    A duration within rounding of a whole number of steps is that number.
    """
    stretches = schedule(scene.world.duration, settings.dt, actions)
    return sum(stretch.steps for stretch in stretches), stretches[-1].part


def kept_frames(steps: int, part: float, every: int) -> int:
    """Return how many frames a run keeps: the first, every n-th, and the last."""
    return 1 + steps // every + (part > 0.0 or steps % every > 0)


def bytes_per_frame(scene: Scene, bodies: int, causes: int = 0) -> int:
    """Return the bytes of one kept frame: its time, its bodies with spin and layer, and the account of energy.

    Args:
        scene: what runs.
        bodies: how many there are.
        causes: K of the account of energy, 0 where none is kept.
    """
    spin = 3 * 8 if scene.surface is not None else 0
    layer = 2 if len(scene.layers) > 1 else 0
    return 8 + max(bodies, 1) * (BYTES_PER_BODY + spin + layer) + (8 * (causes + 1) if causes else 0)


def require_memory(
    scene: Scene, settings: Settings, bodies: int, actions: Sequence[Action] = (), causes: int = 0
) -> int:
    """Return how many frames a run keeps, having made sure that they fit into memory.

    Args:
        scene: what runs.
        settings: of the run.
        bodies: how many there will be.
        actions: what happens on the way; a switch may change dt.
        causes: K of the account of energy, 0 where none is kept.

    Raises:
        TooLargeError: they do not; it names a `record_every` that would fit, where one does.
    """
    steps, part = frame_count(scene, settings, actions)
    kept = kept_frames(steps, part, settings.record_every)
    each, free = bytes_per_frame(scene, bodies, causes), int(free_memory() * FREE_FRACTION)
    fitting = free // each
    if kept <= fitting:
        return kept
    count = "1 body" if bodies == 1 else f"{bodies:,} bodies"
    remedy = (
        f"solver.record_every = {steps // (fitting - 1) + 1} would fit (now {settings.record_every})"
        if fitting > 1
        else "not even two frames fit; use fewer bodies"
    )
    raise TooLargeError(
        f"{kept:,} frames of {count} take {kept * each / 1e9:.3g} GB, but only {free / 1e9:.3g} GB are "
        f"available; {remedy}"
    )


class Recorder:
    """The kept frames of a run: every n-th, and the last."""

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        bodies: int,
        actions: Sequence[Action] = (),
        books: Books | None = None,
        causes: int = 0,
    ) -> None:
        """Allocate.

        Args:
            scene: what runs.
            settings: with every choice filled in.
            bodies: how many there will be.
            actions: what happens on the way.
            books: asked at every frame that is kept; none where no account is.
            causes: K.

        Raises:
            TooLargeError: the frames would not fit.
        """
        kept = require_memory(scene, settings, bodies, actions, causes if books else 0)
        self._scene = scene
        self._every = settings.record_every
        self._count = 0
        self._last = -1.0
        """s, of the simulation at the frame kept last; the time recorded for it may be the run's exact duration"""
        self.time: FloatArray = np.empty(kept)
        # Not filled: a run that ends early takes no memory for the frames that it never kept.
        self.position, self.velocity = (np.empty((kept, bodies, 2)) for _ in range(2))
        self.angle, self.angular_velocity = (np.empty((kept, bodies)) for _ in range(2))
        self.spin: FloatArray | None = None
        """(T, N, 3) rad/s, where the first frame says that something rolls"""
        self.layer: IntArray | None = None
        """(T, N) where the first frame says that there are layers; −1 for a body that is not there yet"""
        self._books = books
        self._energy: FloatArray = np.empty(kept if books else 0)
        self._account: FloatArray = np.empty((kept, causes) if books else (0, 0))

    def wants(self, step: int, last: bool) -> bool:
        """Tell whether the frame after so many steps is kept."""
        return last or step % self._every == 0

    def keep_as_it_is(self, frame: Frame) -> None:
        """Keep a frame where a run ends early, unless it is the one kept last."""
        if frame.time != self._last:
            self.keep(frame, frame.time)

    def amend(self, frame: Frame) -> None:
        """Put a frame in place of the last."""
        self._count -= 1
        self.keep(frame, float(self.time[self._count]))

    def end(self, frame: Frame) -> None:
        """Keep a frame as the last, also where it was kept before something more was done."""
        if frame.time == self._last:
            self.amend(frame)
        else:
            self.keep(frame, frame.time)

    def keep(self, frame: Frame, time: float) -> None:
        """Keep a frame, as of a time."""
        k, n = self._count, len(frame.position)
        if n > self.angle.shape[1]:
            self._widen(n)
        self.time[k], self._last = time, frame.time
        self.position[k, :n], self.velocity[k, :n] = frame.position, frame.velocity
        self.angle[k, :n], self.angular_velocity[k, :n] = frame.angle, frame.angular_velocity
        for values in (self.position, self.velocity, self.angle, self.angular_velocity):
            values[k, n:] = np.nan  # bodies that are not there yet
        spin = frame.spin
        if spin is not None:
            if self.spin is None:
                self.spin = np.empty((*self.angle.shape, 3))
            self.spin[k, :n], self.spin[k, n:] = spin, np.nan
        if frame.layer is not None:
            if self.layer is None:
                self.layer = np.empty(self.angle.shape, np.int16)
            self.layer[k, :n], self.layer[k, n:] = frame.layer, -1
        if self._books is not None:
            self._energy[k], self._account[k] = self._books()
        self._count += 1

    def _widen(self, bodies: int) -> None:
        """Make room for bodies that nobody had foreseen, as those that the rules of a game spawn."""
        wide = bodies + bodies // 2  # more are to be expected
        if len(self.time) * bytes_per_frame(self._scene, wide, self._account.shape[1]) > free_memory() * FREE_FRACTION:
            raise Exhaustion(f"the frames of {bodies:,} bodies do not fit into memory; use solver.record_every")
        for name in ("position", "velocity", "angle", "angular_velocity", "spin", "layer"):
            old = getattr(self, name)
            if old is not None:
                new = np.full((len(old), wide, *old.shape[2:]), -1 if name == "layer" else np.nan, old.dtype)
                new[: self._count, : old.shape[1]] = old[: self._count]
                setattr(self, name, new)

    def layers(self, bodies: int) -> IntArray:
        """Return the layers of the first so many bodies, (T, n); (0, 0) where there is one alone."""
        return np.empty((0, 0), np.int16) if self.layer is None else self.layer[: self._count, :bodies]

    def arrays(self, bodies: int) -> dict[str, FloatArray]:
        """Return what was kept of the first so many bodies."""
        names = ("position", "velocity", "angle", "angular_velocity")
        kept = {name: getattr(self, name)[: self._count, :bodies] for name in names}
        books = {"energy": self._energy[: self._count], "account": self._account[: self._count]}
        spin = np.empty((0, 0, 3)) if self.spin is None else self.spin[: self._count, :bodies]
        return {"time": self.time[: self._count], "spin": spin, **kept, **books}
