"""Episode: a game that whoever plays it advances himself, decision by decision; `play_out` lets a policy play."""

from collections.abc import Sequence

from sandbox.action import Action
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.games.contract import Control, Rules
from sandbox.games.registry import required_rules
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.scene import Scene
from sandbox.trajectory import Contacts, Frame


class Episode:
    """A scene that runs, and its game."""

    def __init__(self, scene: Scene, engine: str) -> None:
        """Begin.

        Raises:
            UnfitError: the scene has no game with rules, or lacks what its game needs.
            Refusal: the engine lacks something that the scene needs.
        """
        self.scene, self.engine = scene, engine
        self._referee = GameSession(required_rules(scene))
        self.relay: SwitchableSimulation = start(scene, engine)
        """what runs"""
        self.relay.contacts()
        self._done: list[Action] = []
        self._levels = [0.0] * len(self.rules.controls)
        self._look(Contacts.none())

    @property
    def rules(self) -> Rules:
        """Of the game, as they are now."""
        return self._referee.rules

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.relay.time

    @property
    def late(self) -> bool:
        """Whether the scene's duration is over."""
        return self.relay.time >= self.scene.world.duration - 0.5 * self.scene.solver.dt

    @property
    def ended(self) -> bool:
        """Whether nothing is left to decide."""
        return self.late or self.rules.game_over is not None

    def frame(self) -> Frame:
        """Return the present state."""
        return self.relay.frame()

    def press(self, levels: Sequence[float]) -> None:
        """Set each control to a level from 0 to 1, of which those that are not analogue are on above a half.

        Raises:
            ActionError: what comes of it cannot be done.
        """
        for k, (control, level) in enumerate(zip(self.rules.controls, levels, strict=True)):
            value = _value(control, level)
            if value != self._levels[k]:
                self._levels[k] = value
                acts = self._referee.press(self.relay.time, control.name, value)
                self._do(acts)
                self._referee.note_actions(acts)

    def step(self) -> None:
        """Advance by one dt, and let the rules see what happened.

        Raises:
            Divergence, Exhaustion: the physics cannot go on.
            ActionError: what the rules do cannot be done.
        """
        self.relay.step()
        self._look(self.relay.contacts())

    def recording(self) -> Recording:
        """Return the session up to now, to be replayed."""
        return Recording(
            scene=self.scene,
            engine=self.engine,
            settings=self.scene.solver,
            actions=tuple(self._done),
            duration=self.relay.time,
            state_hash=self.relay.state_hash(),
            presses=self._referee.presses,
            score=self.rules.score,
        )

    def close(self) -> None:
        """Release the engine."""
        self.relay.close()

    def _look(self, contacts: Contacts) -> None:
        """Let the rules see the state, and do what they say."""
        self._do(self._referee.on_step(self.relay.time, self.relay.frame(), contacts))

    def _do(self, acts: Sequence[Action]) -> None:
        for act in acts:
            self.relay.apply(act)
            self._done.append(act)


def _value(control: Control, level: float) -> float:
    return level if control.analogue else float(level > 0.5)
