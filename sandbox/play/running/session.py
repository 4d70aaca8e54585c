"""Session: a scene being played. It goes on by steps, does what hands do, remembers it, and finds the way back.

A session is its scene and its actions; going back is to go there again. From a checkpoint that is shorter, but a
state does not hold what an engine remembers of contacts: so checkpoints are made where nothing has touched for a
while, and wherever a state is known from before, its hash must be the same. Where it is not, the way from the start
is taken, which is the same every time.

What nobody has seen before cannot be checked so. Whatever is new on a way from a checkpoint therefore makes taking it
up part of the session, as a switch that changes nothing: who replays the session hands over there too.
"""

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

from sandbox.action import Action, ActionError, Switch
from sandbox.arrays import FloatArray
from sandbox.games.referee import Referee
from sandbox.play.breaks import BreakTimes
from sandbox.play.running.calm import Calm
from sandbox.play.running.course import Course
from sandbox.play.running.history import History, Mark
from sandbox.play.running.script import handed_over
from sandbox.recording import Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame

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


class Session(Course):
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
        game: Referee | None = None,
        until: float = -1.0,
    ) -> None:
        """Start; as `Course`."""
        self.history = History()
        super().__init__(scene, engine, settings, actions, game, until)
        self._calm = Calm()
        self._mark: Mark | None = None  # that the relay was taken up from, as long as all that followed was known
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
        return replace(recording, actions=handed_over(recording.actions, mark.actions, mark.point.frame.time))

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
            self.game.forget()
            self.game.saw([timed])
        return timed

    def press(self, control: str, value: float) -> tuple[Action, ...]:
        """Set a control of the game now, and do what comes of it; what came later is forgotten.

        Returns:
            What came of it.

        Raises:
            ActionError: it cannot be done. Then it was not pressed.
        """
        if self.game is None or self.game.rules.over is not None:
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
            self.game.forget()
            raise
        finally:
            self.game.saw(actions[:done])
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
        self._calm = Calm()

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

    def _restore(self, mark: Mark | None) -> None:
        """Take up the checkpoint, or start anew."""
        taken = self._take_up(mark)
        if mark is not None and not taken:
            self.history.distrust()
        self._mark = mark if taken else None
        self._unsure.clear()
        self._astray = False
        self._calm = Calm()
        self._contacts.clear()
        self._previous = self._frame = self.relay.frame()
        self.history.keep(self._step, self._frame)


def _only_resumes(action: Action) -> bool:
    """Tell whether an action is the taking up of a checkpoint, which changes nothing."""
    return isinstance(action, Switch) and action.engine is None and not action.settings
