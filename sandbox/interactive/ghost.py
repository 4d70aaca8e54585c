"""Ghost: a second run beside a live scene, on another engine or with another time step, with the same actions."""

from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from sandbox.action import Action, ActionError, Switch
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.engines.switching import SwitchableSimulation
from sandbox.step_clock import interpolate
from sandbox.trajectory import Frame


class Ghost:
    """A second simulation that follows the time of another. An error ends only the ghost."""

    def __init__(self, simulation: SwitchableSimulation, engine: str, dt_fraction: float) -> None:
        """Start from the present state of a simulation.

        Args:
            simulation: the simulation to accompany.
            engine: name of the engine of the ghost.
            dt_fraction: its dt, as a fraction of that of the simulation.

        Raises:
            ActionError: the engine cannot continue from that state.
        """
        self.engine, self.dt_fraction = engine, dt_fraction
        point = simulation.checkpoint()
        try:
            engine_named(engine)
            wanted = point.wanted if engine == point.engine else point.wanted.common()
            if dt_fraction != 1.0:
                wanted = wanted.replace(dt=simulation.settings.dt * dt_fraction)
                point = replace(point, origin=simulation.time, steps=0.0)
            self._simulation = SwitchableSimulation.resumed(replace(point, engine=engine, wanted=wanted))
        except (Refusal, UnknownEngineError, ValueError) as error:  # SettingsError and ActionError are ValueErrors
            raise ActionError(str(error)) from None
        self._simulation.patience = simulation.patience
        self._before = self._after = self._simulation.frame()
        self.ended: str | None = None
        """error that ended it"""

    @property
    def dt(self) -> float:
        """Its time step, s."""
        return self._simulation.settings.dt

    def apply(self, action: Action) -> None:
        """Apply an action of the accompanied simulation, except a switch of engine or settings."""
        if self.ended is not None or isinstance(action, Switch):
            return
        try:
            self._simulation.apply(action)
        except ActionError as error:
            self.ended = str(error)
        self._before = self._after = self._simulation.frame()

    def follow(self, time: float, limit: float) -> None:
        """Make the steps up to a time, s; a ghost that needs a longer computing time than `limit`, s, ends."""
        dt, until, compiled = self.dt, perf_counter() + limit, COMPILE_CLOCK.seconds
        try:
            while self.ended is None and self._simulation.time < time - 1e-9 * dt:
                self._before = self._after
                self._simulation.step()
                self._after = self._simulation.frame()
                if perf_counter() > until + COMPILE_CLOCK.seconds - compiled:
                    self.ended = f"its steps of {dt:.3g} s take longer than {limit:g} s for one of the scene"
        except (Divergence, Exhaustion) as error:
            self.ended = str(error)

    def frame_at(self, time: float) -> Frame:
        """Return the state at a time of the last step, s, interpolated."""
        length = self._after.time - self._before.time
        return interpolate(self._before, self._after, (time - self._before.time) / length if length > 0.0 else 1.0)

    def document(self) -> dict[str, Any]:
        """Return the choice and the state as JSON."""
        return {"engine": self.engine, "dt_fraction": self.dt_fraction, "dt": self.dt, "ended": self.ended}

    def close(self) -> None:
        """Release the resources of its engine."""
        self._simulation.close()


def largest_distance(a: Frame, b: Frame) -> float | None:
    """Return the largest distance between a body in one frame and in another, m; None without a common body."""
    both = a.present & b.present
    with np.errstate(invalid="ignore", over="ignore"):
        distance = np.hypot(*(a.position[both] - b.position[both]).T)
    largest = float(distance.max()) if len(distance) else np.nan
    return largest if np.isfinite(largest) else None
