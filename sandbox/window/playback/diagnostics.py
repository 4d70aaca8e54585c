"""Companions: runs beside the session, from the same state by the same actions: the ghost and the twin.

The ghost is the scene as another engine has it, the twin the scene with every
body moved by 1e-12 m. Each begins where the session is when it is asked for; while the session goes back, it waits.

Watch: the contacts that the session's engine misses, noticed while it is played.

Company: all that runs beside a session and tells how far it can be trusted.
"""

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
from sandbox.measure.compare.errors import usual_tolerance
from sandbox.measure.compare.horizon import perturb
from sandbox.measure.run import Auditor
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.world import COMMON
from sandbox.trajectory import Frame
from sandbox.window.playback.history import History, Trails
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import MissedContactMarker

CATCH_UP_TIME = 0.3
"""s that the steps of a companion may take to compute for one picture."""


class ShadowRun:
    """A run beside a session. Where it fails it ends, and says why; the session goes on."""

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start.

        Args:
            point: where the session is.
            step: how many steps that has made.

        Raises:
            Refusal: its engine cannot begin from there.
            ActionError: it cannot take over a steady force.
        """
        self.step = step
        """of the session, up to which it has come"""
        self.relay = SwitchableSimulation.resumed(point)
        self.relay.patience = CATCH_UP_TIME
        self.frame: Frame | None = self.relay.frame()
        self.begun = point.frame.time
        """s"""
        self.ended: str | None = None

    @property
    def engine(self) -> str:
        """Its engine's name."""
        return self.relay.engine

    def act(self, action: Action) -> None:
        """Do what the session does; it keeps its own engine."""
        if self.ended is None:
            try:
                self.relay.apply(action)
                self.frame = self.relay.frame()
            except ActionError as error:
                self._end(str(error))

    def follow(self, step: int) -> None:
        """Make steps up to one of the session; where it has been there, it waits."""
        steps, self.step = step - self.step, max(step, self.step)
        until, compiled = perf_counter() + CATCH_UP_TIME, COMPILE_CLOCK.seconds
        if self.ended is not None or steps <= 0:
            return
        try:
            for _ in range(steps):
                self.relay.step()
                if perf_counter() > until + COMPILE_CLOCK.seconds - compiled:
                    raise Exhaustion(f"{self.engine} is too slow to keep up")
            self.frame = self.relay.frame()
        except (Divergence, Exhaustion) as error:
            self._end(str(error))

    def _end(self, why: str) -> None:
        self.ended, self.frame = why, None

    def close(self) -> None:
        """Release what its engine holds."""
        self.relay.close()


def ghost_setting(point: Checkpoint, step: int = 0, without: Collection[str] = ()) -> tuple[ShadowRun, str]:
    """Return the ghost of a session, and what is to be said of it: `exact` where it can, else another engine.

    Args:
        point: where the session is.
        step: how many steps that has made.
        without: engines that have been tried already.

    Raises:
        ActionError: no other engine can go on from here.
    """
    why: list[str] = []
    for name in ("exact", "reference", "pymunk", *ENGINES):
        if name == point.engine or name in without or name not in ENGINES:
            continue
        try:
            return ShadowRun(replace(point, engine=name, wanted=point.wanted.common()), step), "; ".join(why)
        except (Refusal, ActionError) as refusal:
            why.append(str(refusal))
    raise ActionError("; ".join(why) or "no other engine is available")


class DivergenceMonitor:
    """Whether what is seen can still be trusted: a twin, moved by 1e-12 m at first, is still at the same places.

    Past that horizon what is seen is one of many things that might as well have happened: the scene is chaotic, or
    the nudge decides in which step an engine that looks at steps alone sees a contact.
    """

    def __init__(self, point: Checkpoint, step: int = 0) -> None:
        """Start the twin.

        Args:
            point: where the session is.
            step: how many steps that has made.

        Raises:
            Refusal: the engine cannot begin from there.
            ActionError: it cannot take over a steady force.
        """
        self.tolerance = usual_tolerance(point.scene)
        self.time = point.frame.time
        """s, what the session shows"""
        self.horizon: float | None = None
        """s, when the two had come apart; known as long as the session goes the same way"""
        self.spread: float | None = None
        perturbed = _perturbed(point)
        self.able = perturbed is not None
        """whether anything can grow at all"""
        self._twin = ShadowRun(perturbed, step) if perturbed is not None else None

    @property
    def step(self) -> int:
        """Step of the session up to which the twin has come; 0 where there is none."""
        return self._twin.step if self._twin is not None else 0

    def act(self, action: Action) -> None:
        """Do what the session does."""
        if self._twin is not None:
            self._twin.act(action)

    def follow(self, step: int) -> None:
        """Let the twin make steps up to one of the session."""
        if self._twin is not None:
            self._twin.follow(step)

    def look(self, frame: Frame, step: int) -> None:
        """Look how far the session, which shows this after so many steps, and the twin have come apart."""
        self.time = frame.time
        if self._twin is None or self.horizon is not None or step != self._twin.step:
            return
        if self._twin.frame is None:
            self._twin.close()
            self._twin = None
            return
        self.spread = max_body_distance(frame, self._twin.frame)
        if self.spread is None or not self.spread <= self.tolerance:
            self.horizon = frame.time

    @property
    def state(self) -> str:
        """`trusted`, `lost`, or `unknown`."""
        if self.horizon is not None:
            return "lost" if self.time >= self.horizon else "trusted"
        return "trusted" if self._twin is not None or not self.able else "unknown"

    def close(self) -> None:
        """Release what its engine holds."""
        if self._twin is not None:
            self._twin.close()


def max_body_distance(a: Frame, b: Frame) -> float | None:
    """Return the largest distance between a body in one frame and in the other, m; None where none is in both."""
    known = min(len(a.position), len(b.position))
    both = a.present[:known] & b.present[:known]
    with np.errstate(all="ignore"):
        distance = np.hypot(*(a.position[:known][both] - b.position[:known][both]).T)
    return float(distance.max()) if len(distance) else None


def _perturbed(point: Checkpoint) -> Checkpoint | None:
    """Return the moment with every body that can meet something moved a little (`perturb`); None without any."""
    frame, there = point.frame, point.frame.present
    moved = perturb(point.present_setup())
    if moved is None:
        return None
    state = {key: getattr(frame, key).copy() for key in ("position", "velocity", "angle")}
    for key, array in state.items():
        array[there] = getattr(moved.bodies, key)
    return replace(point, frame=replace(frame, **state))


def can_follow(action: Action) -> Action | None:
    """Return a session's action as the ghost does it: the session's engine is not its own."""
    if not isinstance(action, Switch):
        return action
    shared = {key: value for key, value in action.settings.items() if key in COMMON}
    return Switch(time=action.time, settings=shared) if shared else None


MARKER_DURATION = 1.5
"""s that a flash is seen"""
MAX_MARKERS = 50
"""Flashes at a time."""


class MissedContactMonitor:
    """Audits a relay, and remembers where a miss was noticed."""

    def __init__(self, relay: SwitchableSimulation) -> None:
        self._auditor = Auditor(relay.setup, relay)
        self._told = 0
        self._flashes: deque[tuple[tuple[float, float], float]] = deque(maxlen=MAX_MARKERS)

    def look(self, frame: Frame) -> int:
        """Take note of what was missed since the last look; return how many that are."""
        _, pairs = self._auditor.missed
        new = pairs[self._told :]
        self._told = len(pairs)
        for number in new[-MAX_MARKERS:, 0].tolist():
            place = frame.position[number]
            if np.isfinite(place).all():
                self._flashes.append(((float(place[0]), float(place[1])), perf_counter()))
        return len(new)

    def flashes(self) -> tuple[MissedContactMarker, ...]:
        """Return what was noticed a moment ago."""
        now = perf_counter()
        while self._flashes and now - self._flashes[0][1] > MARKER_DURATION:
            self._flashes.popleft()
        return tuple(MissedContactMarker(place, now - since) for place, since in self._flashes)


class Diagnostics:
    """The ghost, the twin, the audit and the trails of a session.

    All of them begin from where the session is, and anew whenever it has gone back or changed its engine.
    """

    def __init__(self, session: Session, film: RecordedRun | None = None) -> None:
        """Begin.

        Args:
            session: what is played.
            film: a stored run to be seen as the ghost, instead of another engine.
        """
        self._session, self._film = session, film
        self.trails = Trails()
        self.notes: list[tuple[str, str]] = []
        """(level, text) of what happened; whoever tells it empties the list"""
        self.trust: DivergenceMonitor | None = None
        """the twin that is being watched"""
        self._ghost: ShadowRun | None = None
        self._seen = History()  # of the ghost
        self._given_up: tuple[str, ...] = ()
        self._watch: MissedContactMonitor | None = None
        self._missed: list[float] = []
        self.begin()

    def begin(self, anew: bool = False) -> None:
        """Watch the session's relay, which is another one now.

        Args:
            anew: begin the ghost and the twin anew, too, from where the session is. Else they wait where they are:
                the session has gone back, and may come there again.
        """
        session = self._session
        self._missed = [time for time in self._missed if time <= session.time]
        # What can meet nothing misses nothing.
        meets = not bool(contact_matrix(session.simulation.setup, session.bodies).free.all())
        self._watch = MissedContactMonitor(session.simulation) if meets else None
        self.trails.add(session.frame)
        if self.trust is not None:
            self.trust.look(session.frame, session.step_number)
        session.take_replayed_actions()
        if anew:
            self._begin_companions()

    def _begin_companions(self) -> None:
        if self._ghost is not None:
            self._begin_ghost()
        if self.trust is not None:
            self.show_trust(True)

    def advance(self, redone: list[tuple[int, Action]]) -> None:
        """Go where the session has gone.

        Args:
            redone: what it has done again on the way, each with the step after which it was.
        """
        frame, step = self._session.frame, self._session.step_number
        self.trails.add(frame)
        if self._watch is not None:
            self._missed += [frame.time] * self._watch.look(frame)
        for each in (self._ghost, self.trust):
            if each is None:
                continue
            been = each.step  # all that was done up to then it has done; after one step there may be several things
            for at, action in redone:
                if at > been:
                    each.follow(at)
                    self._let(each, action)
            each.follow(step)
        if self.trust is not None:
            self.trust.look(frame, step)
        if self._ghost is not None:
            if self._ghost.frame is not None:
                self._seen.store(self._ghost.step, self._ghost.frame)
            else:
                self._replace_ghost(self._ghost)

    def did(self, action: Action) -> None:
        """Take note of something new that the session has done; where that is in the past, what came is no more."""
        step = self._session.step_number
        if self._ghost is not None and self._ghost.step > step:
            self._begin_ghost()
        elif self._ghost is not None:
            self._let(self._ghost, action)
        if self.trust is not None and (self.trust.step > step or self.trust.horizon is not None):
            self.show_trust(True)
        elif self.trust is not None:
            self._let(self.trust, action)
        self._session.take_replayed_actions()

    def _let(self, each: ShadowRun | DivergenceMonitor, action: Action) -> None:
        """Let one do what the session has done; the ghost keeps its own engine."""
        followed = can_follow(action) if each is self._ghost else action
        if followed is not None:
            each.act(followed)

    @property
    def missed(self) -> int | None:
        """Contacts missed so far; None where none can be."""
        return len(self._missed) if self._watch is not None else None

    @property
    def flashes(self) -> tuple[MissedContactMarker, ...]:
        """The misses of a moment ago."""
        return self._watch.flashes() if self._watch is not None else ()

    @property
    def ghosted(self) -> bool:
        """Whether there is a ghost."""
        return self._ghost is not None or self._film is not None

    def show_ghost(self, on: bool) -> None:
        """Begin a ghost from here, or end it."""
        self._film, self._given_up = None, ()
        self._drop_ghost()
        if on:
            self._begin_ghost()

    def _begin_ghost(self) -> None:
        """Begin a ghost from here, on the first engine that can and has not been given up."""
        self._drop_ghost()
        try:
            self._ghost, note = ghost_setting(
                self._session.simulation.checkpoint(), self._session.step_number, self._given_up
            )
        except ActionError as error:
            self.notes.append(("warning", f"no ghost: {error}"))
            return
        self._seen = History()
        if self._ghost.frame is not None:
            self._seen.store(self._ghost.step, self._ghost.frame)
        if note:
            self.notes.append(("info", f"ghost computed by {self._ghost.engine}: {note}"))

    def _replace_ghost(self, ended: ShadowRun) -> None:
        """Let another engine go on as the ghost, from here."""
        self._given_up += (ended.engine,)
        self.notes.append(("warning", f"ghost of {ended.engine} stopped: {ended.ended}"))
        self._begin_ghost()

    def _drop_ghost(self) -> None:
        if self._ghost is not None:
            self._ghost.close()
            self._ghost = None

    def show_trust(self, on: bool) -> None:
        """Begin to watch a twin from here, or end it."""
        if self.trust is not None:
            self.trust.close()
            self.trust = None
        if on:
            try:
                self.trust = DivergenceMonitor(self._session.simulation.checkpoint(), self._session.step_number)
            except (Refusal, ActionError) as error:
                self.notes.append(("warning", f"no predictability horizon: {error}"))

    @property
    def ghost_frame(self) -> Frame | None:
        """The ghost's state."""
        if self._film is not None:
            return self._film.frame(self._session.time)
        time = self._session.time
        if self._ghost is None or time < self._ghost.begun - 1e-12:
            return None
        return self._ghost.frame if self._session.step_number == self._ghost.step else self._seen.nearest(time)[1]

    @property
    def ghost_engine(self) -> str | None:
        """What computes the ghost."""
        if self._film is not None:
            return f"stored run ({self._film.trajectory.info['engine']})"
        return self._ghost.engine if self._ghost is not None else None

    @property
    def distance(self) -> float | None:
        """How far the ghost is away at most, m."""
        ghost = self.ghost_frame
        return None if ghost is None else max_body_distance(self._session.frame, ghost)

    def close(self) -> None:
        """Release all engines."""
        self._drop_ghost()
        self.show_trust(False)
