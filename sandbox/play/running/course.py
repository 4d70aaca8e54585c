"""Course: a relay driven by a script, step by step, from the start or from a checkpoint.

It knows nothing of what was seen before: that is the session's.
"""

from sandbox.action import Action, ActionError, Pull
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.games.referee import Referee
from sandbox.play.footage.scenery import Scenery
from sandbox.play.running.history import Mark
from sandbox.play.running.script import ROUNDING, Script
from sandbox.recording import Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts

PATIENCE = 2.0
"""s that one step may take to compute, where an engine can tell."""


class Course:
    """A scene on an engine, and what is done in it. Steps are made with the actions of their times."""

    def __init__(
        self,
        scene: Scene,
        engine: str = "pymunk",
        settings: Settings | None = None,
        actions: tuple[Action, ...] = (),
        game: Referee | None = None,
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
        self._script = Script(actions)
        self._redone: list[tuple[int, Action]] = []
        self._step = 0
        self._first_game, self._until = game, until
        self.game: Referee | None = None
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

    def scenery(self) -> Scenery:
        """Return what the scene is at any time, also later than now, as far as walls and posts go."""
        return Scenery(self._start[0], self._script.whole)

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
        own, due = game.look(relay.time, relay.frame(), contacts), self._script.due(relay)
        if self._known:
            game.watch(relay.time, own, due)
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

    def _mark_here(self) -> Mark:
        """Make a checkpoint of the present state."""
        game = None if self.game is None else self.game.copy()
        return Mark(self._step, self._script.done, self.relay.checkpoint(), game)

    def _take_up(self, mark: Mark | None) -> bool:
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
                self.game.watch_player(relay.time, self._script.due(relay))
            self._redo()
        return mark is not None

    def _begin(self, relay: SwitchableSimulation) -> None:
        """Begin at the start."""
        self._take_over(relay, self._first_game)
        self._judge()
        self._redo()

    def _take_over(self, relay: SwitchableSimulation, game: Referee | None) -> None:
        """Go on with a relay, and with a copy of a game; what was pressed later than now stays known."""
        self.relay = relay
        """what runs"""
        relay.patience = PATIENCE
        relay.contacts()
        self._heard.clear()
        before, self.game = self.game, None if game is None else game.copy()
        if self.game is not None and before is not None:
            self.game.expect(before.all_presses)

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
