"""Session: a scene being played. It goes on by steps, does what hands do, remembers it, and finds the way back.

A session is its scene and its actions; going back is to go there again. From a checkpoint that is shorter, but a
state does not hold what an engine remembers of contacts: so checkpoints are made where nothing has touched for a
while, and wherever a state is known from before, its hash must be the same. Where it is not, the way from the start
is taken, which is the same every time.

What nobody has seen before cannot be checked so. Whatever is new on a way from a checkpoint therefore makes taking it
up part of the session, as a switch that changes nothing: who replays the session hands over there too.

Course: a relay driven by a script, step by step, from the start or from a checkpoint.

It knows nothing of what was seen before: that is the session's.
"""

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

from sandbox.action import Action, ActionError, Pull, Switch
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame
from sandbox.window.playback.action_log import ROUNDING, ActionLog, SceneHistory, switch_actions
from sandbox.window.playback.history import ContactFreeTimer, History, Keyframe
from sandbox.window.playback.snapshot import BreakTimes

PATIENCE = 2.0
"""s that one step may take to compute, where an engine can tell."""


class EngineRun:
    """A scene on an engine, and what is done in it. Steps are made with the actions of their times."""

    def __init__(
        self,
        scene: Scene,
        engine: str = "pymunk",
        settings: Settings | None = None,
        actions: tuple[Action, ...] = (),
        game: GameSession | None = None,
        until: float = -1.0,
    ) -> None:
        """Start.

        Args:
            scene: what is played.
            engine: its name.
            settings: by default the scene's own.
            actions: to be done on the way, in order of time.
            game: one that has not yet begun, and what is to be pressed on the way.
            until: up to when all that was done is known, that of the rules too, s: they look on till then.

        Raises:
            UnknownEngineError: no engine has that name.
            Refusal: the engine cannot run the scene.
        """
        self._start = scene, engine, settings
        self.ended: str | None = None
        """why it cannot go on: it diverged, or asks for more than can be had"""
        self._exhausted = False
        self._script = ActionLog(actions)
        self._redone: list[tuple[int, Action]] = []
        self._step = 0
        self._first_game, self._until = game, until
        self.game: GameSession | None = None
        """the game that is played, as it stands"""
        self._heard: list[Contacts] = []  # what the game has been told of, since somebody else asked
        self._begin(SwitchableSimulation(*self._start))

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self.relay.scene

    @property
    def engine(self) -> str:
        """The present engine's name."""
        return self.relay.engine

    @property
    def settings(self) -> Settings:
        """The present settings, with every choice filled in."""
        return self.relay.settings

    @property
    def wanted(self) -> Settings:
        """The present settings as they were asked for."""
        return self.relay.wanted

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; spawned ones at the end."""
        return self.relay.bodies

    @property
    def step_number(self) -> int:
        """Steps made since the start."""
        return self._step

    @property
    def actions(self) -> tuple[Action, ...]:
        """All that was done, up to now."""
        return self._script.so_far

    def scenery(self) -> SceneHistory:
        """Return what the scene is at any time, also later than now, as far as walls and posts go."""
        return SceneHistory(self._start[0], self._script.whole)

    @property
    def ahead(self) -> bool:
        """Whether something was done later than now, and will be done again on the way there."""
        return self._script.ahead

    def _make_step(self) -> bool:
        """Make a step, and do what is to be done then; tell whether the step was made."""
        try:
            self.relay.step()
        except Divergence as divergence:
            self.ended = str(divergence)
        except Exhaustion as exhaustion:
            self.ended, self._exhausted = f"at {self.relay.time:g} s: {exhaustion}", True
            return False
        self._step += 1
        if self.ended is None:
            self._judge()
            self._redo()
        return True

    def _redo(self) -> None:
        """Do again what was done at this time."""
        try:
            self._redone += [(self._step, action) for action in self._script.redo(self.relay)]
        except ActionError as error:
            self.ended = f"at {self.relay.time:g} s: {error}"

    @property
    def _known(self) -> bool:
        """Whether what the rules do now was done before, and is in the script."""
        return self.ahead or self.relay.time <= self._until + ROUNDING * self.relay.settings.dt

    def _judge(self) -> None:
        """Let the rules look, and do what they say; where that was done before, hold it against what was done."""
        game, relay = self.game, self.relay
        if game is None:
            return
        contacts = relay.contacts()
        self._heard.append(contacts)
        own, due = game.on_step(relay.time, relay.frame(), contacts), self._script.due(relay)
        if self._known:
            game.replay(relay.time, own, due)
            return
        try:
            for action in own:
                relay.apply(action)
                self._script.add(action, relay)
                self._redone.append((self._step, action))
        except ActionError as error:
            self.ended = f"at {relay.time:g} s: {error}"

    def _contacts_since(self) -> Contacts:
        """Return the contacts since the last call, also those that the game has been told of."""
        heard, self._heard = self._heard, []
        last = self.relay.contacts()
        return Contacts.joined([*heard, last]).merged() if heard else last

    def redone(self) -> list[tuple[int, Action]]:
        """Return what was done again since the last call, each with the step after which it was."""
        parts, self._redone = self._redone, []
        return parts

    def _mark_here(self) -> Keyframe:
        """Make a checkpoint of the present state."""
        game = None if self.game is None else self.game.copy()
        return Keyframe(self._step, self._script.done, self.relay.checkpoint(), game)

    def _take_up(self, mark: Keyframe | None) -> bool:
        """Go back to a checkpoint, or to the start; tell whether the checkpoint could be taken up."""
        relay = None
        if mark is not None:
            try:
                relay = SwitchableSimulation.resumed(mark.point)
            except (Refusal, ActionError):
                mark = None
        self.relay.close()
        self.ended, self._exhausted = None, False
        self._step, self._script.done = (mark.step, mark.actions) if mark is not None else (0, 0)
        if relay is None or mark is None:
            self._begin(SwitchableSimulation(*self._start))
        else:
            self._take_over(relay, mark.game)
            if self.game is not None:
                self.game.replay_player(relay.time, self._script.due(relay))
            self._redo()
        return mark is not None

    def _begin(self, relay: SwitchableSimulation) -> None:
        """Begin at the start."""
        self._take_over(relay, self._first_game)
        self._judge()
        self._redo()

    def _take_over(self, relay: SwitchableSimulation, game: GameSession | None) -> None:
        """Go on with a relay, and with a copy of a game; what was pressed later than now stays known."""
        self.relay = relay
        """what runs"""
        relay.patience = PATIENCE
        relay.contacts()
        self._heard.clear()
        before, self.game = self.game, None if game is None else game.copy()
        if self.game is not None and before is not None:
            self.game.set_presses(before.all_presses)

    def recording(self) -> Recording:
        """Return all up to now, to be replayed."""
        scene, engine, settings = self._start
        return Recording(
            scene=scene,
            engine=engine,
            settings=scene.solver if settings is None else settings,
            # A hand that is still holding lets go at the end: no replay is to hang from one that nobody sees.
            actions=self.actions + tuple(Pull(time=self.relay.time, body=name) for name in self.relay.pulls),
            duration=self.relay.time,
            state_hash=None if self._exhausted else self.relay.state_hash(),
            presses=() if self.game is None else self.game.presses,
            score=None if self.game is None else self.game.rules.score,
        )

    def close(self) -> None:
        """Release what the engine holds."""
        self.relay.close()


PACE = 16
"""Steps made at a time on the way to another one."""
FINE = 64
"""Steps before the other one that are made one by one: each is seen, and so at hand for who steps further back."""


class WrongWayError(Exception):
    """The way from a checkpoint leads to another state than was seen before."""


class Replaced(NamedTuple):
    """What came after a moment of a session, before something else was done there."""

    time: float
    """s, of that moment"""
    recording: Recording
    """the whole session as it was"""


class Session(EngineRun):
    """A scene that is being played on an engine.

    Steps that were made before are made again with the actions of then, until something else is done: from there on
    what came later is forgotten.
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
        """Start; as `Course`."""
        self.history = History()
        super().__init__(scene, engine, settings, actions, game, until)
        self._calm = ContactFreeTimer()
        self._mark: Keyframe | None = None  # that the relay was taken up from, as long as all that followed was known
        self._unsure: list[int] = []
        self._astray = False
        self._contacts: list[Contacts] = []
        self._whole: tuple[int, Recording] | None = None  # the step it had come to, and all up to there
        self.replaced: Replaced | None = None
        """what came later, where something new was done at an earlier moment; the last that was replaced"""
        self._saved = self._script.whole
        self._everyone = self.bodies
        self._breaks = BreakTimes(len(self.scene.links))
        self._previous = self._frame = self.relay.frame()
        self.history.keep(0, self._frame)

    @property
    def _known(self) -> bool:
        seen = self.history.known(0) is not None and self._step <= self.history.furthest
        return seen or super()._known

    @property
    def unsure(self) -> tuple[int, ...]:
        """Steps first seen on a way from a checkpoint, and not yet confirmed by what follows.

        Where what follows differs, they are forgotten: on the way from the start their last digits may be others.
        """
        return tuple(self._unsure)

    def bodies_in(self, frame: Frame) -> Bodies:
        """Return the bodies by number, with those of a state that was seen; it may lie ahead and have more."""
        return self._everyone if len(frame.position) > len(self.bodies) else self.bodies

    @property
    def breaks(self) -> FloatArray:
        """When each of the scene's joints broke, (J,) s, inf where it never did; also in states that lie ahead."""
        return self._breaks.times

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
        """The state one step before, or the present one where there is none to go by."""
        return self._previous

    def rest(self) -> None:
        """Forget the state before: until the next step, pictures show the present one."""
        self._previous = self._frame

    def advance(self, steps: int = 1, until: float | None = None) -> int:
        """Make steps; return how many were made.

        Args:
            steps: how many, at most.
            until: the time (`perf_counter`, s) by which to stop, after one step at least.

        Raises:
            WrongWayError: it leads to another state than was seen before; `seek` knows the way.
        """
        made, last = 0, False
        while made < steps and self.ended is None and not last:
            last = made + 1 == steps or (made > 0 and until is not None and perf_counter() > until)
            if last:
                self._previous = self.relay.frame()
            if self._step >= self.history.furthest:
                self._own_up()
            if not self._make_step():
                break
            made += 1
            if self._mark is not None and not last:
                self._check(None)
        if made:
            self._see()
        return made

    def _see(self) -> None:
        """Look at the present state: keep it, hold it against what was seen before, and make a checkpoint if due."""
        self._frame = self.relay.frame()
        if len(self.bodies) >= len(self._everyone):
            self._everyone = self.bodies
        self._breaks.note(self.relay.broken)
        self._contacts.append(self._contacts_since())
        del self._contacts[:-64]  # nobody asks
        self._calm.look(self._contacts[-1], self.relay.settings)
        if self._exhausted:  # within the step after this one: that state is none of the session's
            return
        self._check(self._frame)
        if self._mark is not None and self.history.known(self._step) is None:
            self._unsure.append(self._step)
        self.history.keep(self._step, self._frame)
        calm = self._calm.lasts(self.relay, self._frame)
        if calm and self.ended is None and self.history.wants_mark(self._step):
            self.history.mark(self._mark_here())

    def _check(self, frame: Frame | None) -> None:
        """Hold the present state against what was seen before."""
        known = self.history.known(self._step)
        if known is not None and known.state_hash() != (frame or self.relay.frame()).state_hash():
            self._astray = True
            self.history.forget(self._unsure)
            self._unsure.clear()
            raise WrongWayError(f"step {self._step} led to another state than before")
        if known is not None:
            self._unsure.clear()

    def _own_up(self) -> None:
        """Make the taking up of the checkpoint part of the session: from here on, what comes is new."""
        mark, self._mark = self._mark, None
        self._unsure.clear()
        if mark is not None and self._script.hand_over(mark.actions, mark.point.frame.time):
            self.history.inserted(mark.step)

    @property
    def unsaved(self) -> tuple[Action, ...]:
        """What was done since the session began, or was last saved; also what lies later than now."""
        saved, done = ([each for each in part if not _only_resumes(each)] for part in (self._saved, self._script.whole))
        return tuple(done[len(saved) :] if done[: len(saved)] == saved else done)

    def note_saved(self) -> None:
        """Take note that all that was done has been saved."""
        self._saved = self._script.whole

    def note_unsaved(self) -> None:
        """Count all that was done as unsaved."""
        self._saved = ()

    def recording(self) -> Recording:
        """Return the whole session, to be replayed: up to the last moment that it came to, also if it has gone back.

        A state that only a way from a checkpoint has led to is recorded by that way.
        """
        if self._whole is not None and self._step < self._whole[0]:
            return replace(self._whole[1], at=self.time)
        recording, mark = super().recording(), self._mark
        if mark is None or not self._unsure:
            return recording
        return replace(recording, actions=switch_actions(recording.actions, mark.actions, mark.point.frame.time))

    def contacts(self) -> Contacts:
        """Return the contacts that were open since the last call."""
        parts, self._contacts = self._contacts, []
        return Contacts.joined(parts) if parts else Contacts.none()

    def act(self, action: Action) -> Action:
        """Do something now, whatever its time says, and remember it; what came later is forgotten.

        Returns:
            The action with its time.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        if self.ended is not None:
            raise ActionError("the run has ended; step back or restart")
        timed = action.model_copy(update={"time": self.relay.time})
        self.relay.apply(timed)
        self._go_another_way(timed)
        if self.game is not None:
            self.game.discard_future()
            self.game.note_actions([timed])
        return timed

    def press(self, control: str, value: float) -> tuple[Action, ...]:
        """Set a control of the game now, and do what comes of it; what came later is forgotten.

        Returns:
            What came of it.

        Raises:
            ActionError: it cannot be done. Then it was not pressed.
        """
        if self.game is None or self.game.rules.game_over is not None:
            return ()
        if self.ended is not None:
            raise ActionError("the run has ended; step back or restart")
        before, done = self.game.copy(), 0
        actions = self.game.press(self.relay.time, control, value)
        try:
            for action in actions:
                self.relay.apply(action)
                self._go_another_way(action)
                done += 1
        except ActionError:
            self.game = before
            self.game.discard_future()
            raise
        finally:
            self.game.note_actions(actions[:done])
        if not actions:
            self._go_another_way(None)
        return actions

    def _go_another_way(self, action: Action | None) -> None:
        """Take note of what has just been done, if anything: what came later is forgotten."""
        self._own_up()
        self._replace_later()
        self._script.add(action, self.relay)
        self._until = min(self._until, self.relay.time)
        self._forget_from(self._step)
        self._breaks.note(self.relay.broken)
        self._frame = self._previous = self.relay.frame()
        self.history.keep(self._step, self._frame)
        self._calm = ContactFreeTimer()

    def _replace_later(self) -> None:
        """Take note that what came after the present moment is replaced by something else."""
        if self._whole is not None and self._step < self._whole[0]:
            self.replaced = Replaced(self.relay.time, self._whole[1])
        self._whole = None

    def _forget_from(self, step: int) -> None:
        """Forget what was seen of a step and of all after it."""
        self.history.cut(step - 1)
        self._everyone = self.bodies
        self._breaks.forget()

    def retract(self, place: int) -> int:
        """Take back what was done from the place-th action on, and forget what came of it.

        Returns:
            The step to seek: the one after which that action was done. Until it is there, the state is as it was.

        Raises:
            IndexError: not so much was done.
        """
        step = self.history.nearest(self.actions[place].time)[0]
        self._script.cut(place)
        self._whole = None
        self._forget_from(step)
        self._astray = True  # what is seen was never done
        return step

    def seek(self, step: int) -> Iterator[float]:
        """Go to a step, back or forth. Yields the share that is done, after each part of the way.

        The session is in between while this is not finished; a caller may give up, and ask for another step.
        """
        step = max(0, step)
        if step < self._step and self._step >= self.history.furthest and not self._astray:
            self._whole = self._step, self.recording()
        if step < self._step or self._astray:
            self._restore(self.history.before(step))
        try:
            yield from self._forth(step)
        except WrongWayError:
            self.history.distrust()
            self._restore(None)
            yield from self._forth(step)

    def _forth(self, step: int) -> Iterator[float]:
        begin = self._step
        while self._step < step and self.ended is None:
            known = self.history.next_known(self._step)  # to be held against
            pace = PACE if step - self._step > FINE else 1
            self.advance(min(pace, known - self._step if known is not None else pace))
            yield (self._step - begin) / (step - begin)

    def _restore(self, mark: Keyframe | None) -> None:
        """Take up the checkpoint, or start anew."""
        taken = self._take_up(mark)
        if mark is not None and not taken:
            self.history.distrust()
        self._mark = mark if taken else None
        self._unsure.clear()
        self._astray = False
        self._calm = ContactFreeTimer()
        self._contacts.clear()
        self._previous = self._frame = self.relay.frame()
        self.history.keep(self._step, self._frame)


def _only_resumes(action: Action) -> bool:
    """Tell whether an action is the taking up of a checkpoint, which changes nothing."""
    return isinstance(action, Switch) and action.engine is None and not action.settings
