"""Interactive view of a session: drives it in real time, seeks in time slices, and shows any stored state."""

import math
from collections.abc import Iterator, Sequence
from time import perf_counter

from sandbox.action import Action, Launch
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.energy_balance import energy_of
from sandbox.engines.switching import switch_engine
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import Settings
from sandbox.step_clock import FixedStepClock, interpolate
from sandbox.trajectory import Contacts, Frame
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.playback.action_log import SceneHistory
from sandbox.window.playback.diagnostics import Diagnostics
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.playback.session import ReplacedFuture, ReplayMismatchError, Session
from sandbox.window.playback.snapshot import BreakNotifier, Snapshot, active_thrusters, broken_joints

SEEK_BUDGET = 0.04
"""s, computation time of a seek per picture"""
SEEK_DELAY = 0.25
"""s after which a seek begins whose target is stored, and so is displayed at once: another step back may follow"""
FOLLOW_BUDGET, IDLE_FOLLOW_BUDGET = 0.003, 0.02
"""s, computation time per picture of the follower of the session, while it plays and while it is paused"""
MIN_STEP_BUDGET, MAX_STEP_BUDGET = 0.012, 0.03
"""s, bounds of the computation time of steps per picture, which is as long as everything else takes. If steps need
more, the scene runs slower than selected."""


class Seek:
    """A seek of a session, in time slices; inactive while the session plays."""

    def __init__(self) -> None:
        self._steps: Iterator[float] | None = None
        self.target = 0
        """target step of the last seek"""
        self.fraction = 0.0
        """completed fraction of the replay"""
        self.begins_at = 0.0
        """time (`perf_counter`, s) from which on it advances"""

    @property
    def is_active(self) -> bool:
        """Whether the target has not been reached yet."""
        return self._steps is not None

    def start(self, session: Session, step: int, delay: float) -> None:
        """Start a seek to a step after a delay, s; it replaces an active one."""
        self.fraction, self.target, self.begins_at = 0.0, step, perf_counter() + delay
        self._steps = session.seek(step)

    def advance(self, budget: float) -> bool:
        """Replay for a time, s; return whether the target is reached."""
        until = perf_counter() + budget
        while self._steps is not None and perf_counter() < until:
            try:
                self.fraction = next(self._steps)
            except StopIteration:
                self._steps = None
        return self._steps is None


class LiveView:
    """A session, its diagnostics, and the state that is displayed: the present one, or a stored one being scrubbed."""

    def __init__(self, session: Session, ghost: RecordedRun | None = None, until: float | None = None) -> None:
        """Start the view.

        Args:
            session: session to play.
            ghost: a recorded run to be shown beside it, instead of another engine.
            until: end of a recording, s, at which the view requests a pause once.
        """
        self.session = session
        self.clock = FixedStepClock()
        self.diagnostics = Diagnostics(session, ghost)
        self._seek, self._step_time = Seek(), 0.0
        self._restart_companions = False  # the companions have seen actions that were retracted
        self._preview: tuple[int, Frame] | None = None  # step and state, if not the present one
        self._preview_scenes: SceneHistory | None = None  # while there is a preview
        self._contact_interval = session.settings.dt
        self._read_contacts()
        self._seed = session.scene.world.seed
        self._end_notified = False
        self._break_notifier = BreakNotifier()
        self._until = until
        self.wants_pause = False
        """Set at the end of a recording; to be reset by the caller."""

    # --- Displayed state -----------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """The scene, with all changes since the start."""
        return self.session.scene

    @property
    def displayed_scene(self) -> Scene:
        """The scene of the displayed state, with the walls of that time."""
        if self._preview is None:
            self._preview_scenes = None
            return self.scene
        self._preview_scenes = self._preview_scenes or self.session.scene_history()
        return self._preview_scenes.at(self._preview[1].time)

    @property
    def is_previewing(self) -> bool:
        """Whether another state than the present one is displayed."""
        return self._preview is not None

    @property
    def bodies(self) -> Bodies:
        """The bodies of the displayed state, by index."""
        return self.session.bodies if self._preview is None else self.session.bodies_in(self._preview[1])

    @property
    def engine(self) -> str:
        """Name of the present engine."""
        return self.session.engine

    @property
    def settings(self) -> Settings:
        """The present settings, with every default filled in."""
        return self.session.settings

    @property
    def step_number(self) -> int:
        """Steps from the start to the displayed state."""
        return self.session.step_number if self._preview is None else self._preview[0]

    @property
    def frame(self) -> Frame:
        """The displayed state, at a whole step."""
        return self.session.frame if self._preview is None else self._preview[1]

    @property
    def displayed_frame(self) -> Frame:
        """The state that is drawn; it may lie between two steps."""
        session = self.session
        return self.frame if self.is_previewing else interpolate(session.previous, session.frame, self.alpha)

    @property
    def alpha(self) -> float:
        """Position of the drawn state between the last two steps, 0 to 1."""
        return self.clock.alpha(self.session.settings.dt)

    @property
    def start_time(self) -> float:
        """The first time that can be sought, s."""
        return 0.0

    @property
    def end_time(self) -> float:
        """The last time that is stored, s."""
        return self.session.history.end_time

    @property
    def keyframe_times(self) -> tuple[float, ...]:
        """Times of the checkpoints, s."""
        return self.session.history.keyframe_times

    @property
    def contacts(self) -> Contacts:
        """The contacts of the last steps."""
        return self._contacts

    @property
    def missed_contacts(self) -> int | None:
        """Contacts missed so far; None if none can be."""
        return self.diagnostics.missed_contacts

    @property
    def notifications(self) -> list[tuple[str, str]]:
        """(level, text) of events; the reader empties the list."""
        return self.diagnostics.notifications

    def energy(self) -> tuple[float, float, float]:
        """Return the kinetic, potential and total energy, J."""
        session = self.session
        return energy_of(
            self.frame, self.bodies, self.scene.world.gravity, session.simulation.setup, session.break_times
        )

    def snapshot(
        self,
        overlays: frozenset[str],
        picked: int | None = None,
        pull: tuple[tuple[float, float], tuple[float, float]] | None = None,
    ) -> Snapshot:
        """Return the snapshot to be drawn.

        Args:
            overlays: of `snapshot.OVERLAYS`.
            picked: index of the picked body.
            pull: ends of the mouse joint: the grip on a body, and the pointer, m.
        """
        session, present, scene, frame = self.session, self._preview is None, self.displayed_scene, self.displayed_frame
        contacts = self._contacts.some(~zone_visits(self._contacts.pair, session.scene))
        return Snapshot(
            scene=scene,
            bodies=self.bodies,
            frame=frame,
            overlays=overlays,
            contacts=contacts if present else Contacts.none(),
            seconds=self._contact_interval,
            ghost=self.diagnostics.ghost_frame if present else None,
            trails=self.diagnostics.trails.pieces() if "trails" in overlays and present else (),
            overlapping=overlapping_bodies(scene, self.bodies, frame) if scene.play.show == "overlap" else None,
            flashes=self.diagnostics.missed_markers,
            picked=picked,
            pull=pull,
            broken=self._absent_joints(frame.time),
            flames=active_thrusters(session.scene, self.bodies, session.simulation.throttles, session.time)
            if present and session.scene.thrusts
            else (),
            steering={name: each.steer for name, each in session.simulation.steering.items()} if present else {},
            setup=session.simulation.setup if scene is session.scene else None,
        )

    def _absent_joints(self, time: float) -> list[int]:
        """Return the indices of joints that have broken by a time, s, or are added later."""
        later = [k for k, joined in self.session.simulation.joined.items() if joined > time]
        return [*broken_joints(self.session.break_times, time), *later]

    # --- Real time -----------------------------------------------------------------------------------------------

    def update(self, elapsed: float, paused: bool) -> None:
        """Make the steps that are due after elapsed real time, s, or a part of a seek."""
        if self._seek.is_active:
            if not paused or perf_counter() >= self._seek.begins_at:
                self._advance_seek()
            else:
                self._follow(IDLE_FOLLOW_BUDGET, is_idle=True)
            return
        if paused or self.session.ended is not None:
            self.clock.reset()
            self.session.reset_interpolation()
            self._follow(IDLE_FOLLOW_BUDGET, is_idle=True)
            return
        dt = self.session.settings.dt
        asked = self.clock.steps_due(elapsed, dt)
        if self._until is not None:
            left = round((self._until - self.session.time) / dt)
            if left <= asked:
                asked = max(left, 0)
                self._until, self.wants_pause = None, True
                self.notifications.append(("info", "end of the recording; resume to play on from here"))
        compiled, started = COMPILE_CLOCK.seconds, perf_counter()
        budget = min(max(elapsed - self._step_time, MIN_STEP_BUDGET), MAX_STEP_BUDGET)
        made = self._advance(asked, started + budget, hold=True) if asked else 0
        self._step_time = perf_counter() - started
        # Neither compilation nor a wait for the player is part of the speed of the scene.
        if COMPILE_CLOCK.seconds > compiled or self.session.waiting:
            self.clock.reset()
        else:
            self.clock.record_steps(elapsed, made, asked, dt)
        if made == asked:
            self._follow(FOLLOW_BUDGET, is_idle=False)

    def _follow(self, budget: float, *, is_idle: bool) -> None:
        """Advance the follower of the session, from which steps back continue, for a time, s."""
        self.session.follow(perf_counter() + budget, is_idle=is_idle)

    def step(self) -> None:
        """Make one step."""
        self.clock.reset()
        if self._seek.is_active:
            self.seek(self._seek.target + 1)
            return
        self._advance(1, None)
        self.session.reset_interpolation()

    def _advance(self, steps: int, until: float | None, *, hold: bool = False) -> int:
        """Make steps, at most until a time (`perf_counter`, s); return how many were made; see `Session.advance`."""
        before = self.session.time
        try:
            made = self.session.advance(steps, until, hold=hold)
        except ReplayMismatchError:
            self.session.history.disable_checkpoints()
            self.seek(self.session.step_number)
            return 0
        if made:
            self._contact_interval = self.session.time - before
            self._read_contacts()
            self.diagnostics.advance(self.session.take_replayed_actions())
            simulation = self.session.simulation
            broken = simulation.setup.joints.count_among(simulation.broken)
            self.notifications.extend(self._break_notifier.update(broken, self.session.time))
        if self.session.ended is not None and not self._end_notified:
            self._end_notified = True
            self.notifications.append(("error", self.session.ended))
        return made

    def _read_contacts(self) -> None:
        self._contacts = self.session.contacts()

    # --- Actions -------------------------------------------------------------------------------------------------

    def apply(self, action: Action) -> None:
        """Apply an action now.

        Raises:
            ActionError: it cannot be applied; nothing has changed then.
        """
        self.finish_seek()
        before = self.session.replaced
        self._inform_companions([self.session.apply(action)])
        self._notify_replaced(before)
        self._read_contacts()

    def apply_input(self, control: str, value: float) -> None:
        """Set a control of the game now.

        Raises:
            ActionError: the engine refuses an action of the rules; nothing has changed then.
        """
        self.finish_seek()
        before, simulation = self.session.replaced, self.session.simulation
        try:
            actions = self.session.apply_input(control, value)
        finally:
            if self.session.simulation is not simulation:  # an action was refused, and the session was restored
                self._restart_diagnostics()
        self._inform_companions(actions)
        self._notify_replaced(before)
        self._read_contacts()

    def relaunch(self, generator: str) -> None:
        """Place the balls of a generator again, each time with another seed.

        Raises:
            ActionError: the action is refused.
        """
        self._seed = (self._seed + 1) % 2**63
        self.apply(Launch(time=0.0, generator=generator, seed=self._seed))
        self.diagnostics.trails.clear()

    def switch_engine(self, engine: str) -> str | None:
        """Continue with another engine; return a message about the settings that it does not take over.

        Raises:
            ActionError: the engine cannot continue from here.
        """
        self.finish_seek()
        message = switch_engine(self.session, engine)
        self._restart_diagnostics(companions=True)
        return message

    def retract(self, index: int, inputs: int | None = None) -> None:
        """Undo the action of an index and all later ones, and start a seek to the time of that action.

        Args:
            index: index of the action.
            inputs: number of inputs of the game that remain; default: those before the time of that action.
        """
        self.finish_seek()
        step, self._restart_companions = self.session.retract(index, inputs), True
        self.seek(step)

    def _inform_companions(self, actions: Sequence[Action]) -> None:
        """Forward new actions to ghost and twin, if there are any."""
        if self.diagnostics.ghost is not None or self.diagnostics.divergence is not None:
            for action in actions:
                self.diagnostics.apply(action)
        else:
            self.session.take_replayed_actions()  # no companion repeats them

    def _notify_replaced(self, before: ReplacedFuture | None) -> None:
        """Notify if the last action has replaced the actions after it."""
        now = self.session.replaced
        if now is not None and now is not before:
            text = f"everything after {now.time:.4g} s is replaced (Ctrl+Z: restore it)"
            self.notifications.append(("warning", text))

    # --- Seeking -------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> str | None:
        """Progress of a seek, in words."""
        return f"replaying {self._seek.fraction:.0%}" if self._seek.is_active else None

    def seek(self, step: int) -> None:
        """Start a seek to a step. It takes one part a picture; meanwhile the nearest stored state is displayed."""
        self.clock.reset()
        self._end_notified = False
        step = max(step, 0)
        self._preview = self.session.history.last_at(step)
        is_displayed = self._preview is not None and self._preview[0] == step
        self._seek.start(self.session, step, SEEK_DELAY if is_displayed else 0.0)
        if not is_displayed:
            self._advance_seek()

    def finish_seek(self) -> None:
        """Complete the seek, however long it takes."""
        if self._seek.is_active:
            self._advance_seek(math.inf)

    def step_back(self) -> None:
        """Start a seek to the step before."""
        present = self._seek.target if self._seek.is_active else self.session.step_number
        if present > 0:
            self.seek(present - 1)

    def scrub(self, time: float) -> None:
        """Display the stored state nearest to a time, s; the session stays where it is until `commit_scrub`."""
        self._preview = self.session.history.nearest(time)

    def commit_scrub(self) -> None:
        """Start a seek to the displayed state."""
        if self._preview is not None:
            step, self._preview = self._preview[0], None
            if step != self.session.step_number:
                self.seek(step)

    def _advance_seek(self, budget: float | None = None) -> None:
        if self._seek.advance(SEEK_BUDGET if budget is None else budget):
            self._preview = None
            self.session.reset_interpolation()
            self._restart_diagnostics(self._restart_companions)
            self._restart_companions = False

    def _restart_diagnostics(self, companions: bool = False) -> None:
        """Continue the diagnostics with the present simulation; `companions`: restart ghost and twin from here."""
        self._contact_interval = self.session.settings.dt
        self._read_contacts()
        self.diagnostics.restart(companions)

    def close(self) -> None:
        """Release the resources of all engines."""
        self.diagnostics.close()
        self.session.close()
