"""Frame table: arrays for the frames of a run, with one row for each recorded frame."""

from typing import TypeVar

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.trajectory import Frame

Scalar = TypeVar("Scalar", bound=np.generic)


class FrameTable:
    """Preallocated arrays of T frames of up to N bodies. A frame is due after every n-th step.

    `Simulation.advance` writes its frames here. Rows after the last one that was written are not set.
    """

    def __init__(self, frames: int, bodies: int, every: int = 1) -> None:
        """Allocate the arrays.

        Args:
            frames: T, largest number of frames.
            bodies: N, expected number of bodies.
            every: number of steps between two frames.
        """
        self.every = every
        """number of steps between two frames"""
        self.steps = 0
        """steps made so far"""
        self.count = 0
        """frames recorded so far"""
        # Not filled: a run that ends early takes no memory for the frames that it never recorded.
        self.time: FloatArray = np.empty(frames)
        """(T,) s"""
        self.position: FloatArray = np.empty((frames, bodies, 2))
        """(T, N, 2) m; nan for bodies that have not been added yet, as in all arrays of floats"""
        self.velocity: FloatArray = np.empty((frames, bodies, 2))
        """(T, N, 2) m/s"""
        self.angle: FloatArray = np.empty((frames, bodies))
        """(T, N) rad"""
        self.angular_velocity: FloatArray = np.empty((frames, bodies))
        """(T, N) rad/s"""
        self.spin: FloatArray | None = None
        """(T, N, 3) rad/s, if the frames have rolling spheres"""
        self.layer: IntArray | None = None
        """(T, N), if the frames have layers; −1 for a body that has not been added yet"""

    def is_due(self) -> bool:
        """Return whether the frame after the steps made so far is recorded."""
        return self.steps % self.every == 0

    def record(self, frame: Frame) -> None:
        """Write a frame into the next row."""
        n = len(frame.position)
        if n > self.angle.shape[1]:
            self._widen(n)
        k = self.count
        self.time[k] = frame.time
        self.position[k, :n], self.velocity[k, :n] = frame.position, frame.velocity
        self.angle[k, :n], self.angular_velocity[k, :n] = frame.angle, frame.angular_velocity
        spin = frame.spin
        if spin is not None:
            self.spin_rows()[k, :n] = spin
        if frame.layer is not None:
            self.layer_rows()[k, :n] = frame.layer
        self.finish_rows(1, n)

    def prepare(self, steps: int, bodies: int) -> None:
        """Prepare the table for frames that are written directly.

        Args:
            steps: number of steps that follow.
            bodies: number of bodies.

        Raises:
            ValueError: there are too few rows for the frames of these steps.
        """
        due = (self.steps % self.every + steps) // self.every
        if self.count + due > len(self.time):
            raise ValueError(f"{due:,} more frames, after {self.count:,}, in a table of {len(self.time):,}")
        if bodies > self.angle.shape[1]:
            self._widen(bodies)

    def clear(self) -> None:
        """Forget all steps and frames; the arrays are written again from the first row on."""
        self.steps = self.count = 0

    def frame(self, row: int, present: BoolArray) -> Frame:
        """Return a recorded frame, of a scene without zones, drives and one-way walls.

        Args:
            row: of the frame.
            present: (N,) whether each body was in the scene; the table does not contain it.
        """
        n = len(present)
        roll = None if self.spin is None else self.spin[row, :n, 0:2].copy()
        layer = None if self.layer is None else self.layer[row, :n].astype(np.int64)
        position, velocity = self.position[row, :n].copy(), self.velocity[row, :n].copy()
        angle, spin = self.angle[row, :n].copy(), self.angular_velocity[row, :n].copy()
        return Frame(float(self.time[row]), position, velocity, angle, spin, present, roll, layer)

    def spin_rows(self) -> FloatArray:
        """Return `spin`, allocated at the first call."""
        if self.spin is None:
            self.spin = np.empty((*self.angle.shape, 3))
        return self.spin

    def layer_rows(self) -> IntArray:
        """Return `layer`, allocated at the first call."""
        if self.layer is None:
            self.layer = np.empty(self.angle.shape, np.int16)
        return self.layer

    def finish_rows(self, rows: int, bodies: int) -> None:
        """Count rows that were written directly after the last one, for the first bodies; mark the others as absent."""
        begin, self.count = self.count, self.count + rows
        if bodies < self.angle.shape[1]:
            for values in (self.position, self.velocity, self.angle, self.angular_velocity, self.spin):
                if values is not None:
                    values[begin : self.count, bodies:] = np.nan
            if self.layer is not None:
                self.layer[begin : self.count, bodies:] = -1

    def _widen(self, bodies: int) -> None:
        """Enlarge the arrays for unexpected bodies, such as those that the rules of a game add."""
        self._resize_columns(bodies + bodies // 2)  # more bodies are likely to follow

    def _resize_columns(self, bodies: int) -> None:
        def resized(old: npt.NDArray[Scalar], absent: float) -> npt.NDArray[Scalar]:
            new = np.full((len(old), bodies, *old.shape[2:]), absent, old.dtype)
            new[: self.count, : old.shape[1]] = old[: self.count]
            return new

        self.position, self.velocity = resized(self.position, np.nan), resized(self.velocity, np.nan)
        self.angle, self.angular_velocity = resized(self.angle, np.nan), resized(self.angular_velocity, np.nan)
        self.spin = None if self.spin is None else resized(self.spin, np.nan)
        self.layer = None if self.layer is None else resized(self.layer, -1)
