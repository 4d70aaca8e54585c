"""Interactive simulation with undo: steps an engine, logs actions, and seeks to any step by replay.

A session is its scene and its actions. Seeking backwards restores a keyframe, or takes over the simulation that follows
the session on engines without snapshots (`follower`), and replays the steps and actions from there. On engines that can
copy their state, keyframes are snapshots, from which a session continues exactly. On others they are checkpoints, which
do not hold the contacts that an engine caches. So checkpoints are taken only after some time without contact, and
wherever a state was seen before, the state hash of the replayed one must be the same. If it differs, checkpoints are
disabled and the session is replayed from the start, which leads to the same states every time.

States that were not seen before cannot be checked so. If new steps follow a replay from a checkpoint, the restoring of
that checkpoint therefore becomes an action of the session: a switch that changes no setting. A replay of the recording
restores the engine at the same moment.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple, Self

from sandbox.action import Action, ActionError, Pull
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.session import GameSession
from sandbox.recording import RecordedGame, Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import zone_visits
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Contacts, Frame
from sandbox.window.playback.action_log import TIME_ROUNDING, ActionLog, SceneHistory, insert_switch
from sandbox.window.playback.follower import FollowerSlot, advance_batch, next_action_time
from sandbox.window.playback.history import BreakTimes, ContactFreeTimer, History, Keyframe, Replay, keyframe_state

STEP_TIMEOUT = 2.0
"""s that one step may take to compute, on engines that can interrupt a step"""
SEEK_BATCH, REPLAY_BATCH = 16, 256
"""steps between two yields of `Session.seek`; the second where the replay is certain to lead to the same states"""
BATCH_ADVANTAGE = 4
"""factor by which a replay in batches is faster than one that is compared: 2 to 8 on pymunk, measured"""
SEEK_FINE_STEPS = 64
"""steps before the target of a seek that are stored one by one, so that stepping further back needs no replay"""
MAX_PENDING_CONTACTS = 64
"""steps whose contacts are kept until `Session.contacts` is called"""


class ReplayMismatchError(Exception):
    """A replay from a checkpoint leads to another state than the original run."""


class ReplacedFuture(NamedTuple):
    """The part of a session after some moment, which a new action at that moment has replaced."""

    time: float
    """s, time of that moment"""
    recording: Recording
    """the whole session before the action"""


class Session:
    """A scene on an engine, the actions on it, and the rules of a game.

    After a seek backwards, steps are repeated with their logged actions until a new action is applied: it discards the
    later ones.
    """

    def __init__(
        self,
        scene: Scene,
        engine: str = "pymunk",
        settings: Settings | None = None,
        actions: tuple[Action, ...] = (),
        game: GameSession | None = None,
        until: float = -1.0,
    ) -> None:
        """Start a session.

        Args:
            scene: scene to simulate.
            engine: name of the engine.
            settings: solver settings; default: those of the scene.
            actions: actions to be repeated, in order of time.
            game: new game, with the inputs to be repeated.
            until: end of a recording, s: up to there the actions of the rules are among `actions`, so that those of
                `game` are compared with them, not applied.

        Raises:
            UnknownEngineError: no engine has that name.
            Refusal: the engine cannot run the scene.
        """
        self._start = scene, engine, settings
        self._source: Recording | None = None
        self.simulation: SwitchableSimulation
        """the engine, with switches between engines"""
        self._step = 0
        self.ended: str | None = None
        """reason why no step can follow: divergence, exhaustion, or a logged action that the engine refuses"""
        self.log = ActionLog(actions)
        self.replay = Replay(until)
        """how the present state came about"""
        self._replayed: list[tuple[int, Action]] = []
        self._initial_game = game
        self.game: GameSession | None = None
        """the game in its present state"""
        self._game_contacts: list[Contacts] = []  # shown to the rules since the last state was stored
        self.history = History()
        self._start_simulation()
        self._followers = FollowerSlot(self._start, self._initial_game)
        self._contact_free = ContactFreeTimer()
        self._step_cost = 0.0  # s, computation time of the last step
        self._contacts: list[Contacts] = []
        self.replaced: ReplacedFuture | None = None
        """the last part of the session that was replaced"""
        self.log.saved = self.log.all
        self._all_bodies = self.bodies
        self._breaks = BreakTimes(len(self.scene.joint_arrays))
        self._frame: Frame = self.simulation.frame()
        self._previous: Frame = self._frame
        self.history.store(0, self._frame)

    @classmethod
    def of_recording(cls, recording: Recording, game: GameSession | None) -> Self:
        """Return a session that repeats a recording; see `__init__`."""
        session = cls(
            recording.scene, recording.engine, recording.settings, recording.actions, game, recording.duration
        )
        session._source = recording
        return session

    # --- State ---------------------------------------------------------------------------------------------------

    @property
    def scene(self) -> Scene:
        """The scene, with all changes since the start."""
        return self.simulation.scene

    @property
    def engine(self) -> str:
        """Name of the present engine."""
        return self.simulation.engine

    @property
    def settings(self) -> Settings:
        """The present settings, with every default filled in."""
        return self.simulation.settings

    @property
    def wanted(self) -> Settings:
        """The present settings as requested; those that are None are chosen by the engine."""
        return self.simulation.wanted

    @property
    def bodies(self) -> Bodies:
        """The bodies by index; spawned ones at the end."""
        return self.simulation.bodies

    @property
    def step_number(self) -> int:
        """Number of steps since the start."""
        return self._step

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._frame.time

    @property
    def frame(self) -> Frame:
        """The present state."""
        return self._frame

    @property
    def previous(self) -> Frame:
        """The state one step before; the present one after a seek or an action."""
        return self._previous

    def reset_interpolation(self) -> None:
        """Make the previous state the present one: until the next step, pictures show the present state."""
        self._previous = self._frame

    @property
    def actions(self) -> tuple[Action, ...]:
        """The actions up to now."""
        return self.log.past

    @property
    def waiting(self) -> bool:
        """Whether the rules of the game hold time until the player acts; never during a replay."""
        return self.game is not None and self.ended is None and self.game.waiting and self.is_latest

    @property
    def is_latest(self) -> bool:
        """Whether no later states, actions or inputs are known."""
        return self._step >= self.history.last_step and not self._has_future(-TIME_ROUNDING)

    def _has_future(self, tolerance: float) -> bool:
        """Return whether later actions, inputs or parts of a recording are known, with a tolerance in steps."""
        if self.log.has_future or (self.game is not None and self.game.future_presses):
            return True
        return self.simulation.time < self.replay.recorded_until + tolerance * self.simulation.settings.dt

    @property
    def break_times(self) -> FloatArray:
        """Time at which each joint of the scene breaks, (J,) s, inf if never; also in states later than now."""
        return self._breaks.of(len(self.simulation.setup.joints))

    def bodies_in(self, frame: Frame) -> Bodies:
        """Return the bodies of a state in the history; it may be later than now and have more."""
        return self._all_bodies if len(frame.position) > len(self.bodies) else self.bodies

    def scene_history(self) -> SceneHistory:
        """Return the scene at any time, also later than now, as far as walls and posts change."""
        return SceneHistory(self._start[0], self.log.all)

    def contacts(self) -> Contacts:
        """Return the contacts of the steps since the last call."""
        parts, self._contacts = self._contacts, []
        return Contacts.joined(parts) if parts else Contacts.none()

    def take_replayed_actions(self) -> list[tuple[int, Action]]:
        """Return the logged actions that were repeated since the last call, each with its step."""
        parts, self._replayed = self._replayed, []
        return parts

    def close(self) -> None:
        """Release the resources of the engine."""
        self._followers.discard_from(0)
        self.simulation.close()

    # --- Recording -----------------------------------------------------------------------------------------------

    def recording(self) -> Recording:
        """Return the whole session: up to the last moment it has reached, also after a seek backwards.

        If the present state is only reached from a checkpoint, the recording restores that checkpoint too.
        """
        whole = self.replay.recording_beyond(self._step)
        if whole is not None:
            return replace(whole, at=self.time)
        actions, origin = self.actions, self.replay.origin
        # Mouse pulls are released at the end: in a replay no mouse would ever release them.
        actions += tuple(Pull(time=self.simulation.time, body=name) for name in self.simulation.pulls)
        if origin is not None and self.replay.unconfirmed:
            actions = insert_switch(actions, origin.actions, origin.time)
        scene, engine, settings = self._start
        found = Recording(
            scene=scene,
            engine=engine,
            settings=scene.solver if settings is None else settings,
            actions=actions,
            duration=self.simulation.time,
            state_hash=None if self._exhausted else self.simulation.state_hash(),
            presses=() if self.game is None else self.game.presses,
            score=None if self.game is None else self.game.rules.score,
        )
        source = self._source
        if source is None or source.game is None:
            return found
        is_whole = found.actions == source.actions and self._step == round(source.duration / self.settings.dt)
        program = RecordedGame(source.game.omitted, source.game.inexact)  # a changed session has another end
        return replace(found, game=source.game if is_whole else program)

    # --- Stepping ------------------------------------------------------------------------------------------------

    def advance(self, steps: int = 1, until: float | None = None, *, hold: bool = False) -> int:
        """Make steps; return how many were made.

        Args:
            steps: how many, at most.
            until: the time (`perf_counter`, s) before which to stop, after one step at least; the next step is expected
                to take as long as the last one did.
            hold: whether to stop as soon as the rules wait for the player, also before the first step.

        Raises:
            ReplayMismatchError: a state differs from the one seen before; `seek` to the same step mends it.
        """
        made, last = 0, False
        while made < steps and self.ended is None and not last and not (hold and self.waiting):
            began = perf_counter()
            # The state before the last step is kept for interpolation, so that step must be known beforehand.
            last = made + 1 == steps or (until is not None and began + 2.0 * self._step_cost > until)
            if last:
                self._previous = self.simulation.frame()
            repeated = 0 if until is not None else self._repeat_steps(steps - made - 1)
            if repeated:
                made += repeated
                continue
            if self._step >= self.history.last_step:
                self._commit_checkpoint()
            if not self._make_step():
                break
            self._step_cost = perf_counter() - began
            made += 1
            if self.replay.origin is not None and not last:
                self._compare_with_history(None)
            elif not last and until is not None and self.ended is None:
                self.history.store_fine(self._step, self.simulation.frame())
        if made:
            self._store_state()
            if hold and self.waiting:  # no later state follows to which pictures could interpolate
                self._previous = self._frame
        return made

    def _make_step(self) -> bool:
        """Make a step, then apply the actions of its time; return whether the step was made."""
        try:
            self.simulation.step()
        except Divergence as divergence:
            self.ended = str(divergence)
        except Exhaustion as exhaustion:
            self.ended, self._exhausted = f"at {self.simulation.time:g} s: {exhaustion}", True
            return False
        self._step += 1
        if self.ended is None:
            self._run_rules()
            self._replay_actions()
        return True

    def _repeat_steps(self, steps: int) -> int:
        """Repeat steps that were made before, in a batch up to the next action; return how many, 0 if not possible."""
        steps = min(steps, self.history.last_step - 1 - self._step)
        if steps < 2 or self.game is not None or self.replay.origin is not None:
            return 0
        try:
            made = advance_batch(self.simulation, steps, next_action_time(self.log.all, self.log.done))
        except (Divergence, Exhaustion) as error:  # they did not occur in the run itself
            raise ReplayMismatchError(str(error)) from None
        self._step += made
        self._replay_actions()
        return made

    def _run_rules(self) -> None:
        """Show the state to the rules, and apply their actions; in a replay, compare them with the logged ones."""
        game, simulation = self.game, self.simulation
        if game is None:
            return
        contacts = simulation.contacts()
        self._game_contacts.append(contacts)
        own, due = game.on_step(simulation.time, simulation.frame(), contacts), self.log.due(simulation)
        if self._is_replaying:
            game.replay(simulation.time, own, due)
            return
        try:
            for action in own:
                simulation.apply(action)
                self.log.append(action)
                self._replayed.append((self._step, action))
        except ActionError as error:
            self.ended = f"at {simulation.time:g} s: {error}"

    @property
    def _is_replaying(self) -> bool:
        """Whether the actions of the rules at the present step are in the log already."""
        is_seen = self.history.get(0) is not None and self._step <= self.history.last_step
        return is_seen or self._has_future(TIME_ROUNDING)

    def _replay_actions(self) -> None:
        """Apply the logged actions of the present time."""
        try:
            self._replayed += [(self._step, action) for action in self.log.replay_due(self.simulation)]
        except ActionError as error:
            self.ended = f"at {self.simulation.time:g} s: {error}"

    def _store_state(self) -> None:
        """Store the present state, compare it with the one seen before, and take a checkpoint if one is due."""
        self._frame = self.simulation.frame()
        if len(self.bodies) >= len(self._all_bodies):
            self._all_bodies = self.bodies
        self._breaks.update(self.simulation.broken)
        self._contacts.append(self._contacts_of_step())
        del self._contacts[:-MAX_PENDING_CONTACTS]
        contacts = self._contacts[-1]
        touching = contacts.some(~zone_visits(contacts.pair, self.scene))
        self._contact_free.update(touching, self.simulation.settings)
        if self._exhausted:  # the state lies within a step, so it is none of the session's
            return
        self._compare_with_history(self._frame)
        if self.replay.origin is not None and self.history.get(self._step) is None:
            self.replay.unconfirmed.append(self._step)
        self.history.store(self._step, self._frame)
        if self.ended is None and self.history.wants_keyframe(self._step):
            can_checkpoint = self._contact_free.allows_checkpoint(self.simulation, self._frame)
            state = keyframe_state(self.simulation, can_checkpoint)
            if state is not None:
                game = None if self.game is None else self.game.copy()
                self.history.add_keyframe(Keyframe(self._step, self.log.done, state, game))

    def _contacts_of_step(self) -> Contacts:
        """Return the contacts since the last call, with those that the rules have been shown."""
        shown, self._game_contacts = self._game_contacts, []
        last = self.simulation.contacts()
        return Contacts.joined([*shown, last]).merged() if shown else last

    def _compare_with_history(self, frame: Frame | None) -> None:
        """Compare the state hash of the present state with that of the one seen before."""
        known = self.history.get(self._step)
        if known is None:
            return
        if known.state_hash() != (frame or self.simulation.frame()).state_hash():
            self.history.discard(self.replay.leave())
            raise ReplayMismatchError(f"step {self._step} led to another state than before")
        self.replay.unconfirmed.clear()

    def _commit_checkpoint(self) -> None:
        """Make the restoring of the checkpoint an action of the session: the steps that follow are new."""
        origin = self.replay.commit()
        if origin is not None and self.log.insert_switch(origin.actions, origin.time):
            self.history.count_inserted_action(origin.step)
            self._followers.discard_from(origin.step)

    # --- Actions -------------------------------------------------------------------------------------------------

    def apply(self, action: Action) -> Action:
        """Apply an action now, regardless of its time, and log it; later actions are discarded.

        Returns:
            The action with its time.

        Raises:
            ActionError: it cannot be applied; nothing has changed then.
        """
        self._check_not_ended()
        timed = action.model_copy(update={"time": self.simulation.time})
        self.simulation.apply(timed)
        self._branch([timed])
        if self.game is not None:
            self.game.discard_future()
            self.game.note_actions([timed])
        return timed

    def apply_input(self, control: str, value: float) -> tuple[Action, ...]:
        """Set a control of the game now, and apply the actions of its rules; later actions are discarded.

        Returns:
            Those actions.

        Raises:
            ActionError: the engine refuses one of them. Game, inputs and state are then as before, restored by a
                replay from the last checkpoint.
        """
        if self.game is None or self.game.rules.game_over is not None:
            return ()
        self._check_not_ended()
        presses = self.game.all_presses
        actions = self.game.record_input(self.simulation.time, control, value)
        try:
            for action in actions:
                self.simulation.apply(action)
        except ActionError:
            self.game.set_presses(presses)
            step = self._step
            self._go_back(step)
            for _ in self.seek(step):
                pass
            raise
        self._branch(actions)
        self.game.note_actions(actions)
        return actions

    def _check_not_ended(self) -> None:
        if self.ended is not None:
            raise ActionError("the run has ended; step back or restart")

    def _branch(self, actions: Sequence[Action]) -> None:
        """Log actions that were just applied, and discard all that came later."""
        self._commit_checkpoint()
        whole = self.replay.branch(self._step, self.simulation.time)
        if whole is not None:
            self.replaced = ReplacedFuture(self.simulation.time, whole)
        self.log.branch(actions, self.simulation)
        self._discard_from(self._step)
        self._breaks.update(self.simulation.broken)
        self._frame = self._previous = self.simulation.frame()
        self.history.store(self._step, self._frame)
        self._contact_free = ContactFreeTimer()

    def _discard_from(self, step: int) -> None:
        """Discard the stored states from a step on."""
        self.history.truncate(step - 1)
        self._followers.discard_from(step)
        self._all_bodies = self.bodies
        self._breaks.reset()

    def follow(self, until: float, *, is_idle: bool) -> None:
        """Keep the follower a short way behind the present, until a time (`perf_counter`, s).

        Args:
            until: s.
            is_idle: whether no picture waits, so that a large scene may be started as well.
        """
        if self.replay.is_off_track or self.replay.origin is not None:
            return
        presses = () if self.game is None else self.game.all_presses
        self._followers.advance(self._step, self.simulation, self.log.all, presses, until, is_idle=is_idle)

    def retract(self, index: int, inputs: int | None = None) -> int:
        """Remove the action of an index and all later ones, and the inputs since then; discard the states after it.

        Args:
            index: of the action.
            inputs: number of inputs of the game that remain; default: those before the time of that action.

        Returns:
            The step to seek: the one after which that action was applied. The present state changes only then.

        Raises:
            IndexError: the log is shorter.
        """
        time = self.actions[index].time
        step = self.history.nearest(time)[0]
        self.log.truncate(index)
        if self.game is not None:
            before = sum(press.time < time for press in self.game.all_presses)
            self.game.truncate(before if inputs is None else inputs)
        self.replay.whole, self.replay.is_off_track = None, True
        self._discard_from(step)
        return step

    # --- Seeking -------------------------------------------------------------------------------------------------

    def seek(self, step: int) -> Iterator[float]:
        """Go to a step, backwards or forwards. Yields the fraction that is done, a few steps at a time.

        Until it is finished the session is in between; a caller may abandon it and seek another step.
        """
        step, replay = max(0, step), self.replay
        if step < self._step and self._step >= self.history.last_step and not replay.is_off_track:
            replay.whole = self._step, self.recording()
        if step < self._step or replay.is_off_track:
            self._go_back(step)
        try:
            yield from self._advance_to(step)
        except ReplayMismatchError:  # from the start, from now on without checkpoints
            self.history.disable_checkpoints()
            self._restore(None)
            yield from self._advance_to(step)

    def _go_back(self, step: int) -> None:
        """Restore the last checkpoint before a step, or take over the follower."""
        keyframe = self.history.keyframe_before(step)
        if keyframe is not None and not keyframe.is_exact and self.game is None:
            # A replay from a checkpoint is compared at each stored state; one from the start is made in batches.
            keyframe = keyframe if (step - keyframe.step) * BATCH_ADVANTAGE < step else None
        follower = self._followers.take(step, keyframe)
        if follower is None:
            self._restore(keyframe)
        else:
            self.simulation.close()
            self._set_simulation(follower.simulation, follower.game, follower.step, follower.done)
            self._begin_replay(None)

    def _advance_to(self, step: int) -> Iterator[float]:
        start = self._step
        while self._step < step and self.ended is None:
            coarse = step - SEEK_FINE_STEPS - self._step
            if coarse > 0 and self.replay.origin is None and self.game is None and self._step < self.history.last_step:
                self.advance(min(REPLAY_BATCH, coarse))
            else:
                batch = SEEK_BATCH if coarse > 0 else 1
                stored = self.history.next_stored(self._step)  # to be compared with
                self.advance(min(batch, stored - self._step if stored is not None else batch))
            yield (self._step - start) / (step - start)

    def _restore(self, keyframe: Keyframe | None) -> None:
        """Go back to a checkpoint, or to the start, also if the engine cannot continue from the checkpoint."""
        simulation = None
        if keyframe is not None:
            try:
                simulation = keyframe.resumed()
            except (Refusal, ActionError):
                self.history.disable_checkpoints()
        self.simulation.close()
        if keyframe is None or simulation is None:
            self._start_simulation()
            self._begin_replay(None)
            return
        self._set_simulation(simulation, keyframe.game, keyframe.step, keyframe.actions)
        if self.game is not None:
            self.game.replay_player(simulation.time, self.log.due(simulation))
        self._replay_actions()
        self._begin_replay(None if keyframe.is_exact else keyframe)

    def _start_simulation(self) -> None:
        """Replace the simulation by one at the start."""
        self._set_simulation(SwitchableSimulation(*self._start), self._initial_game, 0, 0)
        self._run_rules()
        self._replay_actions()

    def _set_simulation(self, simulation: SwitchableSimulation, game: GameSession | None, step: int, done: int) -> None:
        """Continue with a simulation after some steps and actions; later inputs of the game are kept."""
        self.ended, self._exhausted = None, False
        self._step, self.log.done = step, done
        self.simulation = simulation
        simulation.patience = STEP_TIMEOUT
        simulation.contacts()  # discards those before
        self._game_contacts.clear()
        before, self.game = self.game, None if game is None else game.copy()
        if self.game is not None and before is not None:
            self.game.set_presses(before.all_presses)

    def _begin_replay(self, origin: Keyframe | None) -> None:
        """Start to repeat the session from the present simulation, which comes from a checkpoint `origin`."""
        self.replay.begin(origin)
        self._contact_free = ContactFreeTimer()
        self._contacts.clear()
        self._previous = self._frame = self.simulation.frame()
        self.history.store(self._step, self._frame)
