"""EventDriven: what simulations from event to event have in common: frames between events, ends, who is there."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from time import perf_counter
from typing import NoReturn

import numpy as np

from sandbox.engines.account import Account
from sandbox.engines.compiling import COMPILING
from sandbox.engines.contract import Divergence, Exhaustion, Observer
from sandbox.engines.exact.troupe import Troupe
from sandbox.engines.kernel import tell_if_slow
from sandbox.engines.limits import BEYOND
from sandbox.engines.running import Running
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import IntArray


class EventDriven(Running):
    """A simulation whose frames are read off between events, and change nothing."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        super().__init__(settings)
        self._troupe = Troupe(scene, settings.dt)
        self._stopped: float | None = None
        tell_if_slow(len(scene.bodies))

    @property
    def time(self) -> float:
        """Simulated time, s; after an exhaustion, that of the last event."""
        return super().time if self._stopped is None else self._stopped

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._troupe.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by number, as they started; spawned ones join at the end."""
        return self._troupe.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that is no longer there was gone: number → s. Who lies in a pocket is still there."""
        return self._troupe.retired

    def step(self) -> None:
        """Advance by one dt.

        Raises:
            Divergence: a body is no longer finite, or beyond all bounds. The state can still be read.
            Exhaustion: too many events, or too many contacts to keep.
        """
        with self._turn:
            self._check_running()
            self._advance((self._steps + 1) * self._settings.dt)
            self._steps += 1
            self._look()

    def finish(self, part: float) -> None:
        """Advance by a last part of dt, 0 < part < 1.

        Raises:
            Divergence: as `step`.
            Exhaustion: as `step`.
            ValueError: there is no such part.
        """
        self._check_part(part)
        with self._turn:
            self._check_running()
            self._advance((self._steps + part) * self._settings.dt)
            self._part = part
            self._look()
            self._ended = True

    def watch(self, observer: Observer) -> None:
        """Do nothing: there are no substeps to call an observer after, and no contact is missed."""

    @abstractmethod
    def _advance(self, until: float) -> None:
        """Let all events up to a time happen, s."""

    @abstractmethod
    def _evaluate(self) -> None:
        """Write the state of the present time into the troupe."""

    @abstractmethod
    def _take_out(self, numbers: IntArray) -> None:
        """Remove bodies; they stay where they are, with no velocity."""

    @property
    @abstractmethod
    def _outside(self) -> Account | None:
        """The account of what is done from outside, where one is kept."""

    def _through(self, go: Callable[[], int], done: int, halted: Callable[[int], None]) -> None:
        """Have a kernel go on until it is done; in between Python sees to signals, and to why it halted."""
        began, compiled = perf_counter(), COMPILING.seconds
        with np.errstate(all="ignore"):
            while (status := go()) != done:
                waited = perf_counter() - began - (COMPILING.seconds - compiled)
                if self.patience is not None and waited > self.patience:
                    self._stop(f"a step of {self._settings.dt:g} s takes longer than {self.patience:g} s to compute")
                halted(status)

    @property
    @abstractmethod
    def _last_event(self) -> float:
        """When the last event was, s."""

    def _stop(self, why: str) -> NoReturn:
        self._ended = True
        self._stopped = self._last_event
        self._evaluate()
        raise Exhaustion(why)

    def _look(self) -> None:
        """Read the state off, stop what is no longer finite and bounded, retire whose time is up."""
        self._evaluate()
        beyond = self._troupe.beyond()
        if beyond is not None:
            self._ended = True
            raise Divergence(self.time, self.bodies.names[beyond], BEYOND)
        going = self._troupe.going(self.time)
        if len(going):
            self._take_out(going)
