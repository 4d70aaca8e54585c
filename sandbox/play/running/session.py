"""Session: a scene being played. It goes on by steps, does what hands do, remembers it, and finds the way back.

A session is its scene and its actions; going back is to go there again. From a checkpoint that is shorter, but a
state does not hold what an engine remembers of contacts: so checkpoints are made where nothing has touched for a
while, and wherever a state is known from before, its hash must be the same. Where it is not, the way from the start
is taken, which is the same every time.

What nobody has seen before cannot be checked so. Whatever is new on a way from a checkpoint therefore makes taking it
up part of the session, as a switch that changes nothing: who replays the session hands over there too.
"""

from collections.abc import Iterator
from time import perf_counter

from sandbox.action import Action, ActionError, Pull
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.relay import Relay, joined
from sandbox.play.running.history import History, Mark
from sandbox.play.running.script import Script
from sandbox.recording import Recording
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, Frame

CALM = 8
"""Substeps without contact before a checkpoint is made; engines remember parted contacts for 3 by default."""

PACE = 16
"""Steps made at a time on the way to another one."""
FINE = 64
"""Steps before the other one that are made one by one: each is seen, and so at hand for who steps further back."""
PATIENCE = 2.0
"""s that one step may take to compute, where an engine can tell."""


class WrongWayError(Exception):
    """The way from a checkpoint leads to another state than was seen before."""


class Session:
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
    ) -> None:
        """Start.

        Args:
            scene: what is played.
            engine: its name.
            settings: by default the scene's own.
            actions: to be done again on the way, in order of time.

        Raises:
            UnknownEngineError: no engine has that name.
            Refusal: the engine cannot run the scene.
        """
        self._scene, self._engine = scene, engine
        self.relay = Relay(scene, engine, settings)
        """what runs"""
        self._settings = self.relay.wanted
        self.relay.patience = PATIENCE
        self._script = Script(actions)
        self._redone: list[tuple[int, Action]] = []
        self._step = 0
        self._calm = 0
        self._mark: Mark | None = None  # that the relay was taken up from, as long as all that followed was known
        self._astray = False
        self._exhausted = False
        self._contacts: list[Contacts] = []
        self._everyone = self.relay.bodies
        self.history = History()
        self.ended: str | None = None
        """why it cannot go on: it diverged, or asks for more than can be had"""
        self.relay.contacts()
        self._redo()
        self._previous = self._frame = self.relay.frame()
        self.history.keep(0, self._frame)

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

    def bodies_in(self, frame: Frame) -> Bodies:
        """Return the bodies by number, with those of a state that was seen; it may lie ahead and have more."""
        return self._everyone if len(frame.position) > len(self.bodies) else self.bodies

    @property
    def step_number(self) -> int:
        """Steps made since the start."""
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
        """The state one step before, or the present one where there is none to go by."""
        return self._previous

    def rest(self) -> None:
        """Forget the state before: until the next step, pictures show the present one."""
        self._previous = self._frame

    @property
    def actions(self) -> tuple[Action, ...]:
        """All that was done, up to now."""
        return self._script.so_far

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
            if not self._one():
                break
            made += 1
            if self._mark is not None and not last:
                self._check(None)
        if made:
            self._see()
        return made

    def _one(self) -> bool:
        """Make a step, and do what is to be done then; tell whether the step was made."""
        if self._step >= self.history.furthest:
            self._own_up()
        try:
            self.relay.step()
        except Divergence as divergence:
            self.ended = str(divergence)
        except Exhaustion as exhaustion:
            self.ended, self._exhausted = f"at {self.relay.time:g} s: {exhaustion}", True
            return False
        self._step += 1
        if self.ended is None:
            self._redo()
        return True

    def _redo(self) -> None:
        """Do again what was done at this time."""
        try:
            self._redone += [(self._step, action) for action in self._script.redo(self.relay)]
        except ActionError as error:
            self.ended = f"at {self.relay.time:g} s: {error}"

    def _see(self) -> None:
        """Look at the present state: keep it, hold it against what was seen before, and make a checkpoint if due."""
        self._frame = self.relay.frame()
        if len(self.bodies) >= len(self._everyone):
            self._everyone = self.bodies
        self._contacts.append(self.relay.contacts())
        del self._contacts[:-64]  # nobody asks
        if len(self._contacts[-1]):
            self._calm = 0
        else:
            self._calm += self.relay.settings.substeps
        if self._exhausted:  # within the step after this one: that state is none of the session's
            return
        self._check(self._frame)
        self.history.keep(self._step, self._frame)
        calm = self._calm >= max(CALM, 2 * (self.relay.settings.persistence or 1))
        if calm and self.ended is None and self.history.wants_mark(self._step):
            self.history.mark(Mark(self._step, self._script.done, self.relay.checkpoint()))

    def _check(self, frame: Frame | None) -> None:
        """Hold the present state against what was seen before."""
        known = self.history.known(self._step)
        if known is not None and known.state_hash() != (frame or self.relay.frame()).state_hash():
            self._astray = True
            raise WrongWayError(f"step {self._step} led elsewhere than before")

    def _own_up(self) -> None:
        """Make the taking up of the checkpoint part of the session: from here on, what comes is new."""
        mark, self._mark = self._mark, None
        if mark is not None and self._script.hand_over(mark.actions, mark.point.frame.time):
            self.history.inserted(mark.step)

    def redone(self) -> list[tuple[int, Action]]:
        """Return what was done again since the last call, each with the step after which it was."""
        parts, self._redone = self._redone, []
        return parts

    def contacts(self) -> Contacts:
        """Return the contacts that were open since the last call."""
        parts, self._contacts = self._contacts, []
        return joined(parts) if parts else Contacts.none()

    def act(self, action: Action) -> Action:
        """Do something now, whatever its time says, and remember it; what came later is forgotten.

        Returns:
            The action with its time.

        Raises:
            ActionError: it cannot be done. Nothing has changed then.
        """
        if self.ended is not None:
            raise ActionError("the scene has ended here; go back, or restart")
        timed = action.model_copy(update={"time": self.relay.time})
        self.relay.apply(timed)
        self._own_up()
        self._script.add(timed, self.relay)
        self.history.cut(self._step - 1)
        self._everyone = self.bodies
        self._frame = self._previous = self.relay.frame()
        self.history.keep(self._step, self._frame)
        self._calm = 0
        return timed

    def seek(self, step: int) -> Iterator[float]:
        """Go to a step, back or forth. Yields the share that is done, after each part of the way.

        The session is in between while this is not finished; a caller may give up, and ask for another step.
        """
        step = max(0, step)
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
        relay = None
        if mark is not None:
            try:
                relay = Relay.resumed(mark.point)
            except (Refusal, ActionError):
                self.history.distrust()
        self.relay.close()
        if relay is None or mark is None:
            self.relay = Relay(self._scene, self._engine, self._settings)
            self._step = self._script.done = 0
            self._mark = None
        else:
            self.relay, self._step, self._script.done = relay, mark.step, mark.actions
            self._mark = mark
        self.ended = None
        self._astray = self._exhausted = False
        self._calm = 0
        self._contacts.clear()
        self.relay.patience = PATIENCE
        self.relay.contacts()
        self._redo()
        self._previous = self._frame = self.relay.frame()

    def recording(self) -> Recording:
        """Return the session up to now."""
        return Recording(
            scene=self._scene,
            engine=self._engine,
            settings=self._settings,
            # A hand that is still holding lets go at the end: no replay is to hang from one that nobody sees.
            actions=self.actions + tuple(Pull(time=self.relay.time, body=name) for name in self.relay.pulls),
            duration=self.relay.time,
            state_hash=None if self._exhausted else self.relay.state_hash(),
        )

    def close(self) -> None:
        """Release what the engine holds."""
        self.relay.close()
