"""Live: a session with all that runs beside it, driven by real time.

Journey: the way to another step of a session, gone in parts, one a picture.

Showing: a session as it is looked at: its present state, or another one that was seen.

Switching: going on with another engine, which may not know all that was chosen for the present one.
"""

from collections.abc import Callable, Iterator
from time import perf_counter

from sandbox.action import Action, ActionError, Launch, Switch, Value
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.energy_balance import energy_of
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import COMMON, Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.playback.action_log import SceneHistory
from sandbox.window.playback.clock import FixedStepClock, interpolate
from sandbox.window.playback.diagnostics import Diagnostics
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.playback.session import ReplacedFuture, ReplayMismatchError, Session
from sandbox.window.playback.snapshot import BreakNotifier, Snapshot, active_thrusters, broken_joints

SLICE = 0.04
"""s of each picture that the way may take"""


class Seek:
    """Where a session is on its way to; nowhere, as long as it plays."""

    def __init__(self) -> None:
        self._way: Iterator[float] | None = None
        self.target = 0
        """the step that it was last on its way to"""
        self.share = 0.0
        """of the way that is done"""

    @property
    def under_way(self) -> bool:
        """Whether it has yet to arrive."""
        return self._way is not None

    def set_out(self, session: Session, step: int) -> None:
        """Begin the way to a step, whatever the way was before."""
        self.share, self.target = 0.0, step
        self._way = session.seek(step)

    def go(self) -> bool:
        """Go on for `SLICE` seconds; tell whether it has arrived."""
        until = perf_counter() + SLICE
        while self._way is not None and perf_counter() < until:
            try:
                self.share = next(self._way)
            except StopIteration:
                self._way = None
        return self._way is None


class DisplayedStep:
    """What is shown of a session. Looking at another state does not move the session."""

    def __init__(self, session: Session) -> None:
        """Show the present state."""
        self.session = session
        self._peek: tuple[int, Frame] | None = None  # number and state of another step than the present one
        self._scenery: SceneHistory | None = None  # as long as that is looked at

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self.session.scene

    @property
    def shown(self) -> Scene:
        """The scene of the state that is shown: with its walls as they were then."""
        if self._peek is None:
            self._scenery = None
            return self.scene
        self._scenery = self._scenery or self.session.scene_history()
        return self._scenery.at(self._peek[1].time)

    @property
    def peeking(self) -> bool:
        """Whether another state than the present one is shown."""
        return self._peek is not None

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; of the state that is shown."""
        return self.session.bodies if self._peek is None else self.session.bodies_in(self._peek[1])

    @property
    def engine(self) -> str:
        """The present engine's name."""
        return self.session.engine

    @property
    def settings(self) -> Settings:
        """The present settings, with every choice filled in."""
        return self.session.settings

    @property
    def step_number(self) -> int:
        """Steps made since the start; of the state that is shown."""
        return self.session.step_number if self._peek is None else self._peek[0]

    @property
    def frame(self) -> Frame:
        """The state that is shown, or that the picture is just short of."""
        return self.session.frame if self._peek is None else self._peek[1]

    def scrub(self, time: float) -> None:
        """Look at the state seen nearest to a time, s; the session stays where it is until `settle`."""
        self._peek = self.session.history.nearest(time)

    @property
    def begin(self) -> float:
        """The first time that can be gone to, s."""
        return 0.0

    @property
    def end(self) -> float:
        """The last time that was seen, s."""
        return self.session.history.end_time

    @property
    def marks(self) -> tuple[float, ...]:
        """Times of the checkpoints, s."""
        return self.session.history.keyframe_times

    def energy(self) -> tuple[float, float, float]:
        """Return the kinetic, potential and total energy, J."""
        return energy_of(
            self.frame, self.bodies, self.scene.world.gravity, self.session.simulation.setup, self.session.break_times
        )


def switch_engine(session: Session, engine: str) -> str | None:
    """Go on with another engine from the state as it is.

    Choices that only the present engine knows are left to the other.

    Returns:
        Which those were, in words.

    Raises:
        ActionError: the other engine cannot go on from here.
    """
    try:
        session.apply(Switch(time=0.0, engine=engine))
    except ActionError as error:
        own = [key for key in session.simulation.wanted.model_dump(exclude_defaults=True) if key not in COMMON]
        if not own:
            raise
        free: dict[str, Value] = {key: False if key == "half_kick" else None for key in own}
        try:
            session.apply(Switch(time=0.0, engine=engine, settings=free))
        except ActionError:
            raise error from None
        return f"chosen by {engine}: {', '.join(own)}"
    return None


LEAST, MOST = 0.012, 0.03
"""s of each picture that steps may take: as much as all else takes, within these bounds. Where they need more, the
scene is slower than asked."""


class LiveView(DisplayedStep):
    """A session that is being watched."""

    def __init__(self, session: Session, ghost: RecordedRun | None = None, until: float | None = None) -> None:
        """Start watching.

        Args:
            session: what is played.
            ghost: a stored run to be seen beside it, instead of another engine.
            until: when what was recorded ends, s; it pauses there, once.
        """
        super().__init__(session)
        self.pace = FixedStepClock()
        self.company = Diagnostics(session, ghost)
        self._journey, self._worked = Seek(), 0.0
        self.on_contacts: Callable[[Contacts], object] = len
        """Called with contacts as they come."""
        self._since = session.settings.dt
        self._hear()
        self._seed = session.scene.world.seed
        self._told_end = False
        self._breaks = BreakNotifier()
        self._until = until
        self.wants_pause = False
        """It has come to the end of what was recorded; whoever pauses it takes this back."""
        self._anew = False  # what runs beside it has seen what was taken back

    @property
    def busy(self) -> str | None:
        """What it is doing instead of playing."""
        return f"replaying {self._journey.share:.0%}" if self._journey.under_way else None

    @property
    def between_steps(self) -> float:
        """Where the picture lies between the last two states."""
        return self.pace.between(self.session.settings.dt)

    @property
    def drawn(self) -> Frame:
        """The state that pictures show; it may lie between two steps."""
        session = self.session
        return self.frame if self.peeking else interpolate(session.previous, session.frame, self.between_steps)

    def go_on(self, elapsed: float, paused: bool) -> None:
        """Let real time pass, s: make the steps it is enough for, or some of the way to where we are going."""
        if self._journey.under_way:
            self._go_there()
            return
        if paused or self.session.ended is not None:
            self.pace.rest()
            self.session.reset_interpolation()
            return
        dt = self.session.settings.dt
        asked = self.pace.due(elapsed, dt)
        if self._until is not None:
            left = round((self._until - self.session.time) / dt)
            if left <= asked:
                asked = max(left, 0)
                self._until, self.wants_pause = None, True
                self.company.notes.append(("info", "end of the recording; resume to play on from here"))
        compiled, began = COMPILE_CLOCK.seconds, perf_counter()
        budget = min(max(elapsed - self._worked, LEAST), MOST)
        made = self._advance(asked, began + budget) if asked else 0
        self._worked = perf_counter() - began
        if COMPILE_CLOCK.seconds > compiled:  # that time was not the scene's
            self.pace.rest()
        else:
            self.pace.spent(elapsed, made, asked, dt)

    def step(self) -> None:
        """Make one step."""
        self.pace.rest()
        if self._journey.under_way:
            self.seek(self._journey.target + 1)
            return
        self._advance(1, None)
        self.session.reset_interpolation()

    def _advance(self, steps: int, until: float | None) -> int:
        before = self.session.time
        try:
            made = self.session.advance(steps, until)
        except ReplayMismatchError:
            self.session.history.disable_checkpoints()
            self.seek(self.session.step_number)
            return 0
        if made:
            self._since = self.session.time - before
            self._hear()
            self.company.advance(self.session.take_replayed_actions())
            self.company.notes += self._breaks.told(len(self.session.simulation.broken), self.session.time)
        if self.session.ended is not None and not self._told_end:
            self._told_end = True
            self.company.notes.append(("error", self.session.ended))
        return made

    def act(self, action: Action) -> None:
        """Do something now.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        self._check_there()
        before = self.session.replaced
        done = self.session.apply(action)
        self.company.did(done)
        self._tell_replaced(before)
        self._hear()

    def press(self, control: str, value: float) -> None:
        """Set a control of the game now.

        Raises:
            ActionError: it cannot be done. Then it was not pressed.
        """
        self._check_there()
        before = self.session.replaced
        simulation = self.session.simulation
        try:
            actions = self.session.press(control, value)
        finally:
            if self.session.simulation is not simulation:  # the engine refused it, and the session was restored
                self._begin()
        for action in actions:
            self.company.did(action)
        self._tell_replaced(before)
        self._hear()

    def _tell_replaced(self, before: ReplacedFuture | None) -> None:
        """Say that what came later is replaced, where it has just been."""
        now = self.session.replaced
        if now is not None and now is not before:
            text = f"everything after {now.time:.4g} s is replaced (Ctrl+Z: restore it)"
            self.company.notes.append(("warning", text))

    def _hear(self) -> None:
        self._contacts = self.session.contacts()
        self.on_contacts(self._contacts)

    def retract(self, place: int) -> None:
        """Take back what was done from the place-th action on, and set out for when it was done.

        Raises:
            ActionError: it is on its way elsewhere.
        """
        self._check_there()
        step, self._anew = self.session.retract(place), True
        self.seek(step)

    def relaunch(self, generator: str) -> None:
        """Start the balls of a generator anew, each time with another seed.

        Raises:
            ActionError: it cannot be done.
        """
        self._seed = (self._seed + 1) % 2**63
        self.act(Launch(time=0.0, generator=generator, seed=self._seed))
        self.company.trails.clear()

    def switch(self, engine: str) -> str | None:
        """Go on with another engine; return what is to be said of it.

        Raises:
            ActionError: it cannot go on from here.
        """
        self._check_there()
        told = switch_engine(self.session, engine)
        self._begin(anew=True)
        return told

    def _check_there(self) -> None:
        if self._journey.under_way:
            raise ActionError("wait until the jump in time is complete")

    def seek(self, step: int) -> None:
        """Set out for another step. It is reached in parts, one a picture; meanwhile what is known nearest is seen."""
        self.pace.rest()
        self._told_end = False
        self._peek = self.session.history.last_at(max(step, 0))
        self._journey.set_out(self.session, max(step, 0))
        self._go_there()

    def _begin(self, anew: bool = False) -> None:
        """Begin what runs beside the session anew, from where it is."""
        self._since = self.session.settings.dt
        self._hear()
        self.company.begin(anew)

    def arrive(self) -> None:
        """Go the rest of the way to where we are going, however long it takes."""
        while self._journey.under_way:
            self._go_there()

    def back(self) -> None:
        """Set out for the step before."""
        present = self._journey.target if self._journey.under_way else self.session.step_number
        if present > 0:
            self.seek(present - 1)

    def settle(self) -> None:
        """Set out for the state that is being looked at."""
        if self._peek is not None:
            step, self._peek = self._peek[0], None
            if step != self.session.step_number:
                self.seek(step)

    def _go_there(self) -> None:
        if self._journey.go():
            self._peek = None
            self.session.reset_interpolation()
            self._begin(self._anew)
            self._anew = False

    @property
    def contacts(self) -> Contacts:
        """Those of the last steps."""
        return self._contacts

    @property
    def missed(self) -> int | None:
        """Contacts missed so far; None where none can be."""
        return self.company.missed

    @property
    def notes(self) -> list[tuple[str, str]]:
        """(level, text) of what happened; whoever tells it empties the list."""
        return self.company.notes

    def snapshot(
        self,
        overlays: frozenset[str],
        picked: int | None = None,
        pull: tuple[tuple[float, float], tuple[float, float]] | None = None,
    ) -> Snapshot:
        """Return what is drawn now.

        Args:
            overlays: of `snapshot.OVERLAYS`.
            picked: number of the picked body.
            pull: where a body is held, and the hand, m.
        """
        session, present, scene, frame = self.session, self._peek is None, self.shown, self.drawn
        touches = self._contacts.some(~zone_visits(self._contacts.pair, session.scene))
        return Snapshot(
            scene=scene,
            bodies=self.bodies,
            frame=frame,
            overlays=overlays,
            contacts=touches if present else Contacts.none(),
            seconds=self._since,
            ghost=self.company.ghost_frame if present else None,
            trails=self.company.trails.pieces() if "trails" in overlays and present else (),
            overlapping=overlapping_bodies(scene, self.bodies, frame) if scene.play.show == "overlap" else None,
            flashes=self.company.flashes,
            picked=picked,
            pull=pull,
            broken=broken_joints(session.break_times, frame.time),
            flames=active_thrusters(session.scene, self.bodies, session.simulation.throttles, session.time)
            if present and session.scene.thrusts
            else (),
            setup=session.simulation.setup if scene is session.scene else None,
        )

    def close(self) -> None:
        """Release all engines."""
        self.company.close()
        self.session.close()
