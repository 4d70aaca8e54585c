"""Drive: the loop of a run: step, act, keep frames, up to the end or to what ends it before."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import chain, repeat
from time import perf_counter
from typing import NamedTuple

import numpy as np

from sandbox.action import Action, ActionError
from sandbox.engines.contract import Divergence, Exhaustion, Simulation
from sandbox.games.session import HeadlessGame
from sandbox.measure.recorder import Recorder
from sandbox.measure.schedule import ROUNDING, Stretch
from sandbox.trajectory import Contacts, Frame

Progress = Callable[[float], None]
"""Progress callback: called from time to time with the completed fraction of the run, 0 to 1."""

Watch = Callable[[int, Mapping[str, int]], None]
"""Callback from time to time, and at the end, with the steps done and the work counters. It may raise to end the run.
"""

REPORT_EVERY = 0.1  # s

HEARD = 1024
"""Steps of a game whose contacts are kept apart before they are made one list; they would be many."""


class End(NamedTuple):
    """How a run ended."""

    status: str
    reason: str | None
    steps: int
    contacts: Contacts
    done: tuple[Action, ...]
    """the actions that were given, and those of a game, in the order in which they were done"""


class _Doing:
    """What is done between steps: the actions that were given, and a game's."""

    def __init__(self, simulation: Simulation, actions: Sequence[Action], bout: HeadlessGame | None) -> None:
        self._simulation, self._actions, self._bout = simulation, actions, bout
        self._due = 0
        self.next = -math.inf
        """when there is something to be done again, s; of a game at every step"""
        self._done: list[Action] = []
        self._heard: list[Contacts] = []
        self.frame: Frame | None = None
        """of this moment, where it was just read; nobody has to read it again then"""

    def act(self, now: float, last: bool = False) -> bool:
        """Do all whose time has come by `now`, s; tell whether anything was done."""
        begin = self._due
        while self._due < len(self._actions) and self._actions[self._due].time <= now:
            self._due += 1
            if self._bout is None:
                self._simulation.apply(self._actions[self._due - 1])
        if self._bout is None:
            self.next = self._actions[self._due].time if self._due < len(self._actions) else math.inf
            return self._due > begin
        acts = self._turn(self._actions[begin : self._due], last)
        for action in acts:
            self._simulation.apply(action)
            self._done.append(action)
        return bool(acts)

    def look(self) -> None:
        """Let a game see the end of a run, within a step: nothing can be done there any more."""
        if self._bout is not None:
            self._turn((), last=True)

    def _turn(self, given: Sequence[Action], last: bool) -> Sequence[Action]:
        assert self._bout is not None
        simulation, contacts = self._simulation, self._simulation.contacts()
        if len(contacts):
            self._heard.append(contacts)
            if len(self._heard) == HEARD:
                self._heard = [Contacts.joined(self._heard).merged()]
        frame = simulation.frame() if self.frame is None else self.frame
        return self._bout.actions_between_steps(simulation.time, frame, contacts, given, last)

    @property
    def done(self) -> tuple[Action, ...]:
        """All that was given and, of a game, all that was done."""
        return tuple(self._actions) if self._bout is None else tuple(self._done)

    def contacts(self) -> Contacts:
        """Return all contacts of the run."""
        rest = self._simulation.contacts()
        return _by_pair(Contacts.joined([*self._heard, rest]).merged() if self._heard else rest)


def drive(
    duration: float,
    simulation: Simulation,
    stretches: list[Stretch],
    actions: Sequence[Action],
    recorder: Recorder,
    progress: Progress | None = None,
    bout: HeadlessGame | None = None,
    watch: Watch | None = None,
) -> End:
    """Step to the end.

    Args:
        duration: of the run, s.
        simulation: at its start.
        stretches: its steps.
        actions: what is given to be done, in order of time.
        recorder: keeps the frames.
        progress: who is told how far it is.
        bout: a game that is played on the way; where it stops, so does the run.
        watch: sees the work as it is counted.
    """
    status, reason, step = "ok", None, 0
    every = sum(stretch.steps for stretch in stretches)
    part = stretches[-1].part
    told = perf_counter()
    simulation.contacts()
    recorder.keep(simulation.frame(), 0.0)
    doing = _Doing(simulation, actions, bout)
    try:
        for dt in chain.from_iterable(repeat(stretch.dt, stretch.steps) for stretch in stretches):
            now = simulation.time + ROUNDING * dt
            if now >= doing.next:
                doing.act(now)
                if bout is not None and bout.finished:
                    break
            simulation.step()
            step += 1
            last = step == every and part == 0.0
            doing.frame = None
            if recorder.wants(step, last):
                doing.frame = simulation.frame()
                recorder.keep(doing.frame, duration if last else simulation.time)
            if (progress is not None or watch is not None) and perf_counter() - told > REPORT_EVERY:
                told = perf_counter()
                if watch is not None:
                    watch(step, simulation.work)
                if progress is not None:
                    progress(step / (every + part))
        if bout is not None and bout.finished:
            recorder.end(simulation.frame())
        elif part > 0.0:
            doing.act(simulation.time + ROUNDING * stretches[-1].dt)
            simulation.finish(part)
            doing.frame = simulation.frame()
            recorder.keep(doing.frame, duration)
            doing.look()
        elif doing.act(simulation.time + ROUNDING * stretches[-1].dt, last=True):
            recorder.amend(simulation.frame())
    except Divergence as divergence:
        status, reason = "diverged", str(divergence)
        recorder.keep(simulation.frame(), divergence.time)
    except ActionError as error:
        status, reason = "failed", f"at {simulation.time:g} s: {error}"
        recorder.keep_as_it_is(simulation.frame())
    except Exhaustion as error:  # within a step: there is no frame of it
        status, reason = "failed", f"at {simulation.time:g} s: {error}"
    if watch is not None:
        watch(step, simulation.work)
    if progress is not None:
        progress(1.0)
    return End(status, reason, step, doing.contacts(), doing.done)


def _by_pair(contacts: Contacts) -> Contacts:
    """Return contacts of one moment in the order of their pairs; an engine may find them in any."""
    order = np.lexsort((contacts.pair[:, 1], contacts.pair[:, 0], contacts.time))
    vectors = (each[order] for each in (contacts.point, contacts.normal, contacts.impulse))
    return Contacts(contacts.time[order], contacts.pair[order], *vectors)
