"""Diagnostics of a session: ghost on another engine, perturbed twin, audit of missed contacts, and trails."""

from collections import deque
from collections.abc import Collection
from dataclasses import replace
from time import perf_counter

import numpy as np

from sandbox.action import Action, ActionError, Switch
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import ENGINES
from sandbox.engines.segment import Checkpoint
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.metrics.perturbation import perturb
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.run.runner import TimedAudit
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.world import COMMON
from sandbox.trajectory import Frame
from sandbox.window.playback.history import History, Trails
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import MissedContactMarker

CATCH_UP_TIME = 0.3
"""s, computation time of the steps of a shadow run per picture"""


class ShadowRun:
    """A second simulation with the actions of a session. An error ends only the shadow run."""

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start a run.

        Args:
            point: a checkpoint of the session.
            step: step of that checkpoint.

        Raises:
            Refusal: its engine cannot continue from there.
            ActionError: its engine refuses a persistent force.
        """
        self.step = step
        """step of the session that the run has reached"""
        self.simulation = SwitchableSimulation.resumed(point)
        self.simulation.patience = CATCH_UP_TIME
        self.frame: Frame | None = self.simulation.frame()
        self.start_time = point.frame.time
        """s, time of the checkpoint"""
        self.ended: str | None = None
        """error that ended the run"""

    @property
    def engine(self) -> str:
        """Name of its engine."""
        return self.simulation.engine

    def apply(self, action: Action) -> None:
        """Apply an action of the session."""
        if self.ended is None:
            try:
                self.simulation.apply(action)
                self.frame = self.simulation.frame()
            except ActionError as error:
                self._end(str(error))

    def follow(self, step: int) -> None:
        """Make the steps up to a step of the session; none if it is ahead already."""
        steps, self.step = step - self.step, max(step, self.step)
        until, compiled = perf_counter() + CATCH_UP_TIME, COMPILE_CLOCK.seconds
        if self.ended is not None or steps <= 0:
            return
        try:
            for _ in range(steps):
                self.simulation.step()
                if perf_counter() > until + COMPILE_CLOCK.seconds - compiled:
                    raise Exhaustion(f"{self.engine} is too slow to keep up")
            self.frame = self.simulation.frame()
        except (Divergence, Exhaustion) as error:
            self._end(str(error))

    def _end(self, reason: str) -> None:
        self.ended, self.frame = reason, None

    def close(self) -> None:
        """Release the resources of its engine."""
        self.simulation.close()


GHOST_ENGINES = ("exact", "reference", "pymunk")
"""engines of the ghost, the preferred one first; others follow"""


def create_ghost(point: Checkpoint, step: int = 0, excluded: Collection[str] = ()) -> tuple[ShadowRun, str]:
    """Return the ghost of a session, on `exact` or else the first engine that can continue, and the other refusals.

    Args:
        point: a checkpoint of the session.
        step: step of that checkpoint.
        excluded: engines that are not tried.

    Raises:
        ActionError: no other engine can continue from here.
    """
    reasons: list[str] = []
    for name in (*GHOST_ENGINES, *ENGINES):
        if name == point.engine or name in excluded or name not in ENGINES:
            continue
        try:
            return ShadowRun(replace(point, engine=name, wanted=point.wanted.common()), step), "; ".join(reasons)
        except (Refusal, ActionError) as refusal:
            reasons.append(str(refusal))
    raise ActionError("; ".join(reasons) or "no other engine is available")


class DivergenceMonitor:
    """Predictability horizon: the time at which a twin of the session, perturbed by 1e-12 m at first, departs from it.

    Beyond it the session shows one of many possible outcomes: either the scene is chaotic, or the perturbation decides
    in which step an engine with discrete detection finds a contact.
    """

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start the twin.

        Args:
            point: a checkpoint of the session.
            step: step of that checkpoint.

        Raises:
            Refusal: the engine cannot continue from there.
            ActionError: the engine refuses a persistent force.
        """
        self.tolerance = default_tolerance(point.scene)
        self.time = point.frame.time
        """s, time of the session"""
        self.horizon: float | None = None
        """s, time at which the distance exceeded the tolerance; valid until a new action"""
        self.distance: float | None = None
        """m, largest distance between a body and its twin"""
        perturbed = _perturbed(point)
        self.can_diverge = perturbed is not None
        """whether any body can collide with another or with a wall"""
        self._twin = ShadowRun(perturbed, step) if perturbed is not None else None

    @property
    def step(self) -> int:
        """Step of the session that the twin has reached; 0 without a twin."""
        return self._twin.step if self._twin is not None else 0

    def apply(self, action: Action) -> None:
        """Apply an action of the session."""
        if self._twin is not None:
            self._twin.apply(action)

    def follow(self, step: int) -> None:
        """Make the steps of the twin up to a step of the session."""
        if self._twin is not None:
            self._twin.follow(step)

    def update(self, frame: Frame, step: int) -> None:
        """Measure the distance between the twin and the session, whose state after a step is given."""
        self.time = frame.time
        if self._twin is None or self.horizon is not None or step != self._twin.step:
            return
        if self._twin.frame is None:
            self._twin.close()
            self._twin = None
            return
        self.distance = max_body_distance(frame, self._twin.frame)
        if self.distance is None or not self.distance <= self.tolerance:
            self.horizon = frame.time

    @property
    def state(self) -> str:
        """`trusted`, `lost`, or `unknown`."""
        if self.horizon is not None:
            return "lost" if self.time >= self.horizon else "trusted"
        return "trusted" if self._twin is not None or not self.can_diverge else "unknown"

    def close(self) -> None:
        """Release the resources of its engine."""
        if self._twin is not None:
            self._twin.close()


def max_body_distance(a: Frame, b: Frame) -> float | None:
    """Return the largest distance of a body between two frames, m; None if no body is in both."""
    known = min(len(a.position), len(b.position))
    both = a.present[:known] & b.present[:known]
    with np.errstate(all="ignore"):
        distance = np.hypot(*(a.position[:known][both] - b.position[:known][both]).T)
    return float(distance.max()) if len(distance) else None


def _perturbed(point: Checkpoint) -> Checkpoint | None:
    """Return a checkpoint with every body perturbed that can have contacts; None if there is no such body."""
    frame, present = point.frame, point.frame.present
    moved = perturb(point.present_setup())
    if moved is None:
        return None
    state = {key: getattr(frame, key).copy() for key in ("position", "velocity", "angle")}
    for key, array in state.items():
        array[present] = getattr(moved.bodies, key)
    return replace(point, frame=replace(frame, **state))


def ghost_action(action: Action) -> Action | None:
    """Return an action of the session for the ghost, without switches of the engine; None if nothing remains."""
    if not isinstance(action, Switch):
        return action
    shared = {key: value for key, value in action.settings.items() if key in COMMON}
    return Switch(time=action.time, settings=shared) if shared else None


MARKER_DURATION = 1.5
"""s of real time"""
MAX_MARKERS = 50


class MissedContactMonitor:
    """Live audit of missed contacts of a simulation."""

    def __init__(self, simulation: SwitchableSimulation) -> None:
        self._auditor = TimedAudit(simulation.setup, simulation)
        self._counted = 0
        self._markers: deque[tuple[tuple[float, float], float]] = deque(maxlen=MAX_MARKERS)

    def update(self, frame: Frame) -> int:
        """Add the contacts missed since the last call; return their number."""
        _, pairs = self._auditor.missed
        new = pairs[self._counted :]
        self._counted = len(pairs)
        for body_index in new[-MAX_MARKERS:, 0].tolist():
            position = frame.position[body_index]
            if np.isfinite(position).all():
                self._markers.append(((float(position[0]), float(position[1])), perf_counter()))
        return len(new)

    def markers(self) -> tuple[MissedContactMarker, ...]:
        """Return the markers of the last `MARKER_DURATION`."""
        now = perf_counter()
        while self._markers and now - self._markers[0][1] > MARKER_DURATION:
            self._markers.popleft()
        return tuple(MissedContactMarker(position, now - since) for position, since in self._markers)


class Diagnostics:
    """The ghost, the divergence monitor, the missed-contact audit and the trails of a session.

    Ghost and twin start from the present state of the session. They are not stepped while the session is at an earlier
    time than they are.
    """

    def __init__(self, session: Session, recorded: RecordedRun | None = None) -> None:
        """Start.

        Args:
            session: the observed session.
            recorded: a recorded run that is the ghost, instead of another engine.
        """
        self._session, self._recorded = session, recorded
        self.trails = Trails()
        self.notifications: list[tuple[str, str]] = []
        """(level, text) of events; the reader empties the list"""
        self.divergence: DivergenceMonitor | None = None
        self.ghost: ShadowRun | None = None
        self._ghost_history = History()
        self._failed_engines: tuple[str, ...] = ()
        self._audit: MissedContactMonitor | None = None
        self._missed_times: list[float] = []
        self.restart()

    def restart(self, companions: bool = False) -> None:
        """Observe the simulation of the session, which was replaced.

        Args:
            companions: restart ghost and twin too, from the present state. Otherwise they wait where they are: the
                session has gone back, and may get there again.
        """
        session = self._session
        self._missed_times = [time for time in self._missed_times if time <= session.time]
        can_miss = not bool(contact_matrix(session.simulation.setup, session.bodies).free.all())
        self._audit = MissedContactMonitor(session.simulation) if can_miss else None
        self.trails.add(session.frame)
        if self.divergence is not None:
            self.divergence.update(session.frame, session.step_number)
        session.take_replayed_actions()
        if companions:
            self._restart_companions()

    def _restart_companions(self) -> None:
        if self.ghost is not None:
            self._start_ghost()
        if self.divergence is not None:
            self.watch_divergence(True)

    def advance(self, replayed: list[tuple[int, Action]]) -> None:
        """Follow the session to its present step.

        Args:
            replayed: the actions that it has repeated on the way, each with its step.
        """
        frame, step = self._session.frame, self._session.step_number
        self.trails.add(frame)
        if self._audit is not None:
            self._missed_times += [frame.time] * self._audit.update(frame)
        for each in (self.ghost, self.divergence):
            if each is None:
                continue
            reached = each.step  # all actions up to there are applied; a step can have several
            for at, action in replayed:
                if at > reached:
                    each.follow(at)
                    self._apply_to(each, action)
            each.follow(step)
        if self.divergence is not None:
            self.divergence.update(frame, step)
        if self.ghost is not None:
            if self.ghost.frame is not None:
                self._ghost_history.store(self.ghost.step, self.ghost.frame)
            else:
                self._replace_ghost(self.ghost)

    def apply(self, action: Action) -> None:
        """Forward a new action of the session to ghost and twin; one that is ahead of the session is restarted."""
        step = self._session.step_number
        if self.ghost is not None and self.ghost.step > step:
            self._start_ghost()
        elif self.ghost is not None:
            self._apply_to(self.ghost, action)
        if self.divergence is not None and (self.divergence.step > step or self.divergence.horizon is not None):
            self.watch_divergence(True)
        elif self.divergence is not None:
            self._apply_to(self.divergence, action)
        self._session.take_replayed_actions()

    def _apply_to(self, each: ShadowRun | DivergenceMonitor, action: Action) -> None:
        """Apply an action of the session; the ghost keeps its own engine."""
        own = ghost_action(action) if each is self.ghost else action
        if own is not None:
            each.apply(own)

    @property
    def missed_contacts(self) -> int | None:
        """Contacts missed so far; None if none can be."""
        return len(self._missed_times) if self._audit is not None else None

    @property
    def missed_markers(self) -> tuple[MissedContactMarker, ...]:
        """The contacts missed a moment ago."""
        return self._audit.markers() if self._audit is not None else ()

    @property
    def has_ghost(self) -> bool:
        """Whether there is a ghost."""
        return self.ghost is not None or self._recorded is not None

    def show_ghost(self, on: bool) -> None:
        """Start a ghost from the present state, or end it."""
        self._recorded, self._failed_engines = None, ()
        self._drop_ghost()
        if on:
            self._start_ghost()

    def _start_ghost(self) -> None:
        """Start a ghost from the present state, on the first engine that can and has not failed."""
        self._drop_ghost()
        try:
            self.ghost, note = create_ghost(
                self._session.simulation.checkpoint(), self._session.step_number, self._failed_engines
            )
        except ActionError as error:
            self.notifications.append(("warning", f"no ghost: {error}"))
            return
        self._ghost_history = History()
        if self.ghost.frame is not None:
            self._ghost_history.store(self.ghost.step, self.ghost.frame)
        if note:
            self.notifications.append(("info", f"ghost computed by {self.ghost.engine}: {note}"))

    def _replace_ghost(self, ended: ShadowRun) -> None:
        """Start a ghost on another engine from the present state."""
        self._failed_engines += (ended.engine,)
        self.notifications.append(("warning", f"ghost of {ended.engine} stopped: {ended.ended}"))
        self._start_ghost()

    def _drop_ghost(self) -> None:
        if self.ghost is not None:
            self.ghost.close()
            self.ghost = None

    def watch_divergence(self, on: bool) -> None:
        """Start a divergence monitor from the present state, or end it."""
        if self.divergence is not None:
            self.divergence.close()
            self.divergence = None
        if on:
            try:
                self.divergence = DivergenceMonitor(self._session.simulation.checkpoint(), self._session.step_number)
            except (Refusal, ActionError) as error:
                self.notifications.append(("warning", f"no predictability horizon: {error}"))

    @property
    def ghost_frame(self) -> Frame | None:
        """State of the ghost; None without one, or at a time before its start."""
        if self._recorded is not None:
            return self._recorded.frame(self._session.time)
        time = self._session.time
        if self.ghost is None or time < self.ghost.start_time - 1e-12:
            return None
        return (
            self.ghost.frame if self._session.step_number == self.ghost.step else self._ghost_history.nearest(time)[1]
        )

    @property
    def ghost_engine(self) -> str | None:
        """Name of the engine of the ghost."""
        if self._recorded is not None:
            return f"stored run ({self._recorded.trajectory.info['engine']})"
        return self.ghost.engine if self.ghost is not None else None

    @property
    def ghost_distance(self) -> float | None:
        """Largest distance between a body and its ghost, m."""
        ghost = self.ghost_frame
        return None if ghost is None else max_body_distance(self._session.frame, ghost)

    def close(self) -> None:
        """Release the resources of all engines."""
        self._drop_ghost()
        self.watch_divergence(False)
