"""Step loop of a run: step, apply actions and record frames, to the end or to the failure that ends the run early."""

import math
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import NamedTuple

import numpy as np

from sandbox.action import Action, ActionError
from sandbox.engines.contract import Divergence, Exhaustion, Simulation
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.recorder import Recorder
from sandbox.progress import Progress, ProgressCallback
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.scene import first_sensor
from sandbox.schedule import ROUNDING, Stretch
from sandbox.trajectory import Contacts, Frame

WorkCallback = Callable[[int, Mapping[str, int]], None]
"""Called at intervals and at the end, with the number of steps and the work counters. It may raise to end the run."""

REPORT_INTERVAL = 0.1
"""s between two calls of the callbacks."""

CALL_DURATION = 0.02
"""s that a call of `Simulation.advance` should take, so that progress and Ctrl-C are prompt."""

FIRST_STEPS = 16
"""Steps of the first call of `Simulation.advance`, of which nothing is known."""

MAX_GROWTH = 8
"""Largest factor from one call to the next; the first steps of a scene may be faster than the later ones."""

MIN_ELAPSED = 1e-6
"""s, resolution of the clock."""

MAX_PENDING_CONTACTS = 1024
"""Steps of a game whose contacts are kept separately before they are merged, which bounds memory."""


class RunEnd(NamedTuple):
    """Outcome of a step loop."""

    status: str
    """`ok`, `diverged` or `failed`"""
    reason: str | None
    """reason for a status other than `ok`"""
    steps: int
    """steps made"""
    contacts: Contacts
    """all contacts of the run"""
    done: tuple[Action, ...]
    """the given actions and those of a game, in the order in which they were applied"""


class RunCallbacks(NamedTuple):
    """Callbacks of a step loop."""

    on_progress: ProgressCallback | None = None
    on_work: WorkCallback | None = None


def run_loop(
    duration: float,
    simulation: Simulation,
    stretches: list[Stretch],
    actions: Sequence[Action],
    recorder: Recorder,
    game: HeadlessGame | None = None,
    callbacks: RunCallbacks | None = None,
) -> RunEnd:
    """Step a simulation to the end of a run.

    Args:
        duration: duration of the run, s.
        simulation: simulation at its start.
        stretches: schedule of the steps.
        actions: actions in order of time.
        recorder: recorder of the frames.
        game: game played during the run; the run ends with the game.
        callbacks: callbacks for progress and work.
    """
    queue = _ActionQueue(simulation, actions, game)
    loop = _StepLoop(duration, simulation, stretches, queue, recorder, game, callbacks or RunCallbacks())
    status, reason = "ok", None
    try:
        loop.step_all()
        loop.finish()
    except Divergence as divergence:
        status, reason = "diverged", str(divergence)
        recorder.record(simulation.frame())
    except ActionError as error:
        status, reason = "failed", f"at {simulation.time:g} s: {error}"
        recorder.record_unless_recorded(simulation.frame())
    except Exhaustion as error:  # within a step, which has no frame
        status, reason = "failed", f"at {simulation.time:g} s: {error}"
    loop.report(1.0)
    return RunEnd(status, reason, recorder.steps, loop.queue.contacts(), loop.queue.done)


class _StepLoop:
    """A run in progress."""

    def __init__(
        self,
        duration: float,
        simulation: Simulation,
        stretches: list[Stretch],
        queue: "_ActionQueue",
        recorder: Recorder,
        game: HeadlessGame | None,
        callbacks: RunCallbacks,
    ) -> None:
        self.queue = queue
        self._duration, self._simulation, self._stretches = duration, simulation, stretches
        self._recorder, self._game, self._callbacks = recorder, game, callbacks
        self._count = sum(stretch.steps for stretch in stretches)
        self._part = stretches[-1].part
        """length of the last, incomplete step as a fraction of dt"""
        self._reported = perf_counter()
        self._has_callbacks = any(each is not None for each in self._callbacks)
        self._steps_per_call = FIRST_STEPS
        self.queue.keep_visits(simulation.contacts())
        recorder.record(simulation.frame())

    def step_all(self) -> None:
        """Make all whole steps; a game can end them."""
        # A game has a turn after every step, and energies are read at every frame.
        one_by_one = self._game is not None or self._recorder.has_energy
        for stretch in self._stretches:
            end = self._recorder.steps + stretch.steps
            while (left := end - self._recorder.steps) > 0:
                now = self._simulation.time + ROUNDING * stretch.dt
                if now >= self.queue.next:
                    self.queue.apply_due(now)
                    if self._is_game_over():
                        return
                if one_by_one:
                    self._step()
                else:
                    self._advance(min(left, _steps_before(self.queue.next, now, stretch.dt)))
                if self._has_callbacks and perf_counter() - self._reported > REPORT_INTERVAL:
                    self._reported = perf_counter()
                    self.report(self._recorder.steps / (self._count + self._part))
        if self._part == 0.0:
            self.queue.frame = self._simulation.frame()
            self._recorder.record_unless_recorded(self.queue.frame)
            self._recorder.end_time = self._duration

    def _step(self) -> None:
        """Make one step, and record its frame if it is due."""
        self._simulation.step()
        self._recorder.steps += 1
        self.queue.frame = None
        if self._recorder.is_due():
            self.queue.frame = self._simulation.frame()
            self._recorder.record(self.queue.frame)

    def _advance(self, steps: int) -> None:
        """Make at most so many steps in one call, and adapt the length of the next call to the time that it took."""
        steps = min(steps, self._steps_per_call)
        start = perf_counter()
        self._simulation.advance(steps, self._recorder)
        elapsed = perf_counter() - start
        if elapsed > CALL_DURATION:
            self._steps_per_call = max(int(steps * CALL_DURATION / elapsed), 1)
        elif steps == self._steps_per_call:
            self._steps_per_call = min(MAX_GROWTH * steps, int(steps * CALL_DURATION / max(elapsed, MIN_ELAPSED)))

    def _is_game_over(self) -> bool:
        return self._game is not None and self._game.finished

    def finish(self) -> None:
        """Make the last step if it is incomplete, and apply the actions at the end of the run."""
        simulation, recorder = self._simulation, self._recorder
        now = simulation.time + ROUNDING * self._stretches[-1].dt
        if self._is_game_over():
            recorder.record_end(simulation.frame())
        elif self._part > 0.0:
            self.queue.apply_due(now)
            simulation.finish(self._part)
            if simulation.makes_whole_steps:
                recorder.steps += 1
            else:
                recorder.end_time = self._duration
            self.queue.frame = simulation.frame()
            recorder.record(self.queue.frame)
            self.queue.notify_end()
        elif self.queue.apply_due(now, is_last=True):
            recorder.replace_last(simulation.frame())

    def report(self, fraction: float) -> None:
        """Call the callbacks."""
        if self._callbacks.on_work is not None:
            self._callbacks.on_work(self._recorder.steps, self._simulation.work)
        if self._callbacks.on_progress is not None:
            self._callbacks.on_progress(Progress(fraction=fraction))


def _steps_before(time: float, now: float, dt: float) -> int:
    """Return the number of steps of dt that can be made from `now` on before a time, s; at least one.

    It is one fewer than possible, so that rounding does not matter: the last steps are made one by one.
    """
    steps = (time - now) / dt
    return max(int(steps) - 1, 1) if steps < MAX_STEPS else int(MAX_STEPS)


class _ActionQueue:
    """Actions between steps: those that were given, and those of a game."""

    def __init__(self, simulation: Simulation, actions: Sequence[Action], game: HeadlessGame | None) -> None:
        self._simulation, self._actions, self._game = simulation, actions, game
        self._due = 0
        self.next = -math.inf
        """s, time of the next action; with a game, every step has one"""
        self._done: list[Action] = []
        self._pending: list[Contacts] = []
        self.frame: Frame | None = None
        """the present frame, if it was just read, so that a game need not read it again"""

    def apply_due(self, now: float, is_last: bool = False) -> bool:
        """Apply all actions due by the time `now`, s; return whether there were any."""
        begin = self._due
        while self._due < len(self._actions) and self._actions[self._due].time <= now:
            self._due += 1
            if self._game is None:
                self._simulation.apply(self._actions[self._due - 1])
        if self._game is None:
            self.next = self._actions[self._due].time if self._due < len(self._actions) else math.inf
            return self._due > begin
        actions = self._game_turn(self._actions[begin : self._due], is_last)
        for action in actions:
            self._simulation.apply(action)
            self._done.append(action)
        return bool(actions)

    def notify_end(self) -> None:
        """Notify the game of the end of a run within a step, when no action is possible any more."""
        if self._game is not None:
            self._game_turn((), is_last=True)

    def _game_turn(self, given: Sequence[Action], is_last: bool) -> Sequence[Action]:
        assert self._game is not None
        simulation, contacts = self._simulation, self._simulation.contacts()
        if len(contacts):
            self._pending.append(contacts)
            if len(self._pending) == MAX_PENDING_CONTACTS:
                self._pending = [Contacts.joined(self._pending).merged()]
        frame = simulation.frame() if self.frame is None else self.frame
        return self._game.actions_between_steps(simulation.time, frame, contacts, given, is_last)

    @property
    def done(self) -> tuple[Action, ...]:
        """All given actions, or with a game all that were applied."""
        return tuple(self._actions) if self._game is None else tuple(self._done)

    def keep_visits(self, contacts: Contacts) -> None:
        """Keep the visits of sensors among the contacts at the start, which may end in the first step."""
        if self._simulation.scene.sensors:
            self._pending.append(contacts.some(contacts.pair[:, 1] <= first_sensor(self._simulation.scene)))

    def contacts(self) -> Contacts:
        """Return all contacts of the run."""
        latest = self._simulation.contacts()
        return _by_pair(Contacts.joined([*self._pending, latest]).merged() if self._pending else latest)


def _by_pair(contacts: Contacts) -> Contacts:
    """Return contacts sorted by time and, at equal times, by pair; the order of an engine is arbitrary."""
    order = np.lexsort((contacts.pair[:, 1], contacts.pair[:, 0], contacts.time))
    vectors = (each[order] for each in (contacts.point, contacts.normal, contacts.impulse))
    return Contacts(contacts.time[order], contacts.pair[order], *vectors)
