"""Stored: a run from a file, driven by real time. It can be gone through in any way, but not changed."""

from dataclasses import replace

import numpy as np

from sandbox.engines.common.energy_balance import energy_of
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame
from sandbox.window.capture.film import RecordedRun
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.playback.clock import FixedStepClock
from sandbox.window.playback.snapshot import Snapshot


class RecordedView:
    """A stored run that is being watched; a step is a stored frame."""

    def __init__(self, film: RecordedRun) -> None:
        """Start at its beginning.

        Raises:
            pydantic.ValidationError: the settings that it names are none.
        """
        self.film = film
        self.pace = FixedStepClock()
        self.notes: list[tuple[str, str]] = []
        self.settings = Settings.model_validate(film.trajectory.info["settings"])
        self._times = film.trajectory.time
        self._time = float(self._times[0])
        self.busy: str | None = None

    @property
    def scene(self) -> Scene:
        """Its scene."""
        return self.film.scene

    @property
    def bodies(self) -> Bodies:
        """Its bodies by number."""
        return self.film.bodies

    @property
    def engine(self) -> str:
        """What computed it."""
        return str(self.film.trajectory.info["engine"])

    @property
    def step_number(self) -> int:
        """Number of the stored frame that is shown, or was last."""
        return max(int(np.searchsorted(self._times, self._time, side="right")) - 1, 0)

    @property
    def frame(self) -> Frame:
        """The state that is shown."""
        return self.film.frame(self._time)

    @property
    def drawn(self) -> Frame:
        """The state that pictures show."""
        return self.frame

    @property
    def begin(self) -> float:
        """Its first time, s."""
        return float(self._times[0])

    @property
    def end(self) -> float:
        """Its last time, s."""
        return float(self._times[-1])

    @property
    def at_end(self) -> bool:
        """Whether its last time is shown."""
        return self._time >= self.end

    @property
    def marks(self) -> tuple[float, ...]:
        """None: every moment is as near as any other."""
        return ()

    @property
    def missed(self) -> int | None:
        """Contacts missed so far; None where the run was not audited."""
        run = self.film.trajectory
        return int((run.missed_time <= self._time).sum()) if run.missed_contacts is not None else None

    def go_on(self, elapsed: float, paused: bool) -> None:
        """Let real time pass, s."""
        if paused or self.at_end:
            self.pace.rest()
            return
        step = self.pace.flow(elapsed)
        self._time = min(self._time + step, self.end)

    def step(self) -> None:
        """Go to the next stored frame."""
        self._time = float(self._times[min(self.step_number + 1, len(self._times) - 1)])

    def back(self) -> None:
        """Go to the stored frame before."""
        k = self.step_number
        earlier = k if float(self._times[k]) < self._time else max(k - 1, 0)
        self._time = float(self._times[earlier])

    def scrub(self, time: float) -> None:
        """Go to a time, s."""
        self._time = min(max(time, self.begin), self.end)

    def settle(self) -> None:
        """Stay there."""

    def energy(self) -> tuple[float, float, float]:
        """Return the kinetic, potential and total energy, J."""
        return energy_of(self.frame, self.bodies, self.scene.world.gravity, self.scene, self.film.breaks)

    @property
    def contacts(self) -> Contacts:
        """Those that began a moment ago."""
        return self.film.contacts(self._time, self.pace.speed)

    def sight(
        self,
        overlays: frozenset[str],
        picked: int | None = None,
        pull: tuple[tuple[float, float], tuple[float, float]] | None = None,
    ) -> Snapshot:
        """Return what is drawn now.

        Args:
            overlays: of `sight.OVERLAYS`.
            picked: number of the picked body.
            pull: nothing can be pulled here.
        """
        sight = self.film.sight(self._time, overlays, self.pace.speed)
        shows = self.scene.play.show == "overlap"
        over = overlapping_bodies(self.scene, self.bodies, sight.frame) if shows else None
        return replace(sight, picked=picked, pull=pull, overlapping=over)

    def close(self) -> None:
        """Nothing is held."""
