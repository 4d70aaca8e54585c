"""Session of a game: calls the rules between the steps of a simulation, and records and replays inputs.

`GameSession` sets the times of actions, passes the player's actions to the rules, and records the inputs. In the replay
of a recorded game it repeats the recorded inputs, and detects when the rules act differently than in the recording.
`HeadlessGame` is a session of a run without a window, played by a policy or replayed. `SteppedGame` is a session with a
simulation of its own, which its caller advances: an episode of an environment, or a match between bots.

`LampRecorder` and `LampLog` record which lamps were lit at which time. They are stored with a run, because viewing a
run does not execute the rules.
"""

import copy
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Self

from sandbox.action import Action, Switch
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.games.contract import HasLamps, HasLog, HasWaiting, Policy, Press, Rules, StepInfo
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Contacts, Frame

LAMP_INTERVAL = 0.04
"""s between two samples of the lamps, the frame interval of a video. Flashes last longer; sampling every step would be
slow"""

TIME_ROUNDING = 1e-9
"""s, rounding error of the times of steps"""


class LampRecorder:
    """Samples the lamps of a game at intervals and keeps the changes; records nothing for a game without lamps."""

    def __init__(self, rules: Rules) -> None:
        """Start with all lamps off."""
        self._rules = rules if isinstance(rules, HasLamps) else None
        self._lit: frozenset[str] = frozenset()
        self._next = 0.0
        self._changes: list[tuple[float, list[str]]] = []

    def update(self, time: float) -> None:
        """Sample the lamps at a time, s, if the interval has passed."""
        if self._rules is None or time < self._next - TIME_ROUNDING:
            return
        self._next = time + LAMP_INTERVAL
        lit = self._rules.lit_lamps()
        if lit != self._lit:
            self._changes.append((time, sorted(lit ^ self._lit)))
            self._lit = lit

    def changes(self) -> list[list[Any]]:
        """Return, as JSON values, the time, s, and the names of the lamps that changed, for each change."""
        return [list(change) for change in self._changes]


class LampLog(NamedTuple):
    """Lit lamps as a function of time."""

    times: list[float]
    """s, of the changes, in order"""
    lit: list[frozenset[str]]
    """names of the lit lamps from each of these times"""

    @classmethod
    def from_changes(cls, changes: Sequence[Any]) -> "LampLog":
        """Read the JSON values of `LampRecorder.changes`.

        Raises:
            ValueError: the values are invalid.
        """
        times, states = list[float](), list[frozenset[str]]()
        now: frozenset[str] = frozenset()
        try:
            for time, names in changes:
                now = now.symmetric_difference(names)
                times.append(float(time))
                states.append(now)
        except (TypeError, ValueError):
            raise ValueError("invalid lamp record: each change is a time and a list of names") from None
        return cls(times, states)

    def at(self, time: float) -> frozenset[str]:
        """Return the lamps that are lit at a time, s."""
        index = bisect_right(self.times, time) - 1
        return self.lit[index] if index >= 0 else frozenset()


REPLAY_ROUNDING = 1e-9
"""s, tolerance of the time of a recorded input: engines accumulate steps with different rounding"""


class GameSession:
    """A running game. A copy is independent of the original."""

    def __init__(self, rules: Rules, presses: Iterable[Press] = ()) -> None:
        """Start a session.

        Args:
            rules: rules of a new game.
            presses: inputs of a recorded game, to be replayed.
        """
        self.rules = rules
        self._presses = sorted(presses, key=lambda press: press.time)
        self._pressed = 0
        self._done: list[Action] = []  # player's actions since the last step
        self.step_info: StepInfo | None = None
        """input of the last `Rules.on_step`"""
        self.diverged_at: float | None = None
        """s, first time at which the rules acted differently than in the recording; None if they never did"""

    def copy(self) -> Self:
        """Return an independent copy."""
        return copy.deepcopy(self)

    @property
    def presses(self) -> tuple[Press, ...]:
        """Inputs up to now."""
        return tuple(self._presses[: self._pressed])

    @property
    def future_presses(self) -> tuple[Press, ...]:
        """Inputs of the replayed game after now."""
        return tuple(self._presses[self._pressed :])

    @property
    def all_presses(self) -> tuple[Press, ...]:
        """Inputs up to now, and those of the replayed game after now."""
        return tuple(self._presses)

    def set_presses(self, presses: Sequence[Press]) -> None:
        """Replace all inputs by those of another session that is equal to this one up to now."""
        self._presses = [*presses]

    def discard_future(self) -> None:
        """Discard the inputs after now."""
        del self._presses[self._pressed :]

    def truncate(self, count: int) -> None:
        """Discard all inputs but the first `count`."""
        del self._presses[count:]
        self._pressed = min(self._pressed, count)

    @property
    def pending_actions(self) -> tuple[Action, ...]:
        """The player's actions since the last step, which the rules have not seen yet."""
        return tuple(self._done)

    @property
    def waiting(self) -> bool:
        """Whether the rules hold time until the player acts, and the player has not acted since the last step."""
        return isinstance(self.rules, HasWaiting) and self.rules.waiting and not self._done

    def on_step(self, time: float, frame: Frame, contacts: Contacts) -> tuple[Action, ...]:
        """Call the rules after a step, and return their actions with the present time; none once the game is over."""
        self.step_info, self._done = StepInfo(time, frame, contacts, tuple(self._done)), []
        return () if self.rules.game_over is not None else _timed(self.rules.on_step(self.step_info), time)

    def record_input(self, time: float, control: str, value: float) -> tuple[Action, ...]:
        """Set a control now, and return the actions that result; inputs after now are discarded."""
        if self.rules.game_over is not None:
            return ()
        self.discard_future()
        self._presses.append(Press(time, control, value))
        self._pressed += 1
        return _timed(self.rules.on_input(control, value), time)

    def note_actions(self, actions: Iterable[Action]) -> None:
        """Add actions of the player to the input of the next step, except switches of the engine."""
        self._done += [action for action in actions if type(action) is not Switch]

    def replay(self, time: float, own: Sequence[Action], recorded: Sequence[Action]) -> None:
        """Compare the actions of the rules with the recording, and repeat the recorded inputs of a time.

        Args:
            time: s.
            own: actions of the rules from the `on_step` at this time.
            recorded: recorded actions of this time, those of the rules before those of the player.
        """
        left = list(recorded)
        if left[: len(own)] == list(own):
            del left[: len(own)]
        else:
            self._note_divergence(time)
            left = [action for action in left if action not in own]
        self.replay_player(time, left)

    def replay_player(self, time: float, recorded: Sequence[Action]) -> None:
        """Repeat the recorded inputs of a time, s, and compare the resulting actions with the recorded ones."""
        actions: list[Action] = []
        while self._pressed < len(self._presses) and self._presses[self._pressed].time <= time + REPLAY_ROUNDING:
            press = self._presses[self._pressed]
            self._pressed += 1
            if self.rules.game_over is None:
                actions += _timed(self.rules.on_input(press.control, press.value), time)
        if any(action not in recorded for action in actions):
            self._note_divergence(time)
        self.note_actions(recorded)

    def _note_divergence(self, time: float) -> None:
        self.diverged_at = time if self.diverged_at is None else self.diverged_at


def _timed(actions: Sequence[Action], time: float) -> tuple[Action, ...]:
    return tuple([action.at(time) for action in actions]) if actions else ()


class HeadlessGame:
    """A game between the steps of one run without a window."""

    def __init__(self, rules: Rules, policy: Policy | None, player: str, presses: Iterable[Press] = ()) -> None:
        """Start a game.

        Args:
            rules: rules of a new game.
            policy: the player; None for the replay of a recorded game, all actions of which are given.
            player: name of the player.
            presses: inputs of the recorded game.
        """
        self.player = player
        self._session, self._policy = GameSession(rules, presses), policy
        self._lamps = LampRecorder(rules)

    @property
    def finished(self) -> bool:
        """Whether the run may end; a replay runs to the end of the recording."""
        return self._policy is not None and self._session.rules.game_over is not None

    def actions_between_steps(
        self, time: float, frame: Frame, contacts: Contacts, given: Sequence[Action], last: bool
    ) -> Sequence[Action]:
        """Return the actions to apply between two steps, in order: of the rules, of the player, and the given ones.

        Args:
            time: s.
            frame: the present state.
            contacts: contacts of the last step.
            given: additional actions; in a replay, all recorded actions.
            last: whether no step follows; then the policy is not called.
        """
        session, policy = self._session, self._policy
        own = session.on_step(time, frame, contacts)
        self._lamps.update(time)
        if policy is None:
            session.replay(time, own, given)
            return given
        pressed: list[Action] = []
        if not last and session.rules.game_over is None and session.step_info is not None:
            for control, value in policy.decide(session.step_info, session.rules):
                pressed += session.record_input(time, control, value)
        played = [*pressed, *given]
        session.note_actions(played)
        return [*own, *played]

    @property
    def presses(self) -> tuple[Press, ...]:
        """Inputs up to now."""
        return self._session.presses

    @property
    def diverged_at(self) -> float | None:
        """s, first time at which the rules acted differently than in the recording; None if they never did."""
        return self._session.diverged_at

    @property
    def game_over(self) -> str | None:
        """Reason why the game is over; None while it runs."""
        return self._session.rules.game_over

    @property
    def score(self) -> int | float:
        """Present score."""
        return self._session.rules.score

    def to_dict(self, game: str) -> dict[str, Any]:
        """Return the result as JSON values."""
        rules = self._session.rules
        log = {"log": [list(entry) for entry in rules.log]} if isinstance(rules, HasLog) else {}
        return {
            "name": game,
            "player": self.player,
            "score": self.score,
            "over": self.game_over,
            "lines": [list(line) for line in rules.display_lines()],
            "presses": [list(press) for press in self.presses],
            "otherwise": self.diverged_at,
            **log,
            **({"lamps": lamps} if (lamps := self._lamps.changes()) else {}),
        }


class SteppedGame:
    """A simulation with its game, advanced step by step by its caller, with its actions and inputs so far."""

    def __init__(self, scene: Scene, engine: str, rules: Rules) -> None:
        """Start the simulation of a scene, with the rules of a new game.

        Raises:
            Refusal: the engine does not support the scene.
        """
        self.scene, self.engine, self.rules = scene, engine, rules
        self.session = GameSession(rules)
        self.simulation: SwitchableSimulation = start(scene, engine)
        """the running simulation"""
        self.simulation.contacts()  # contacts are recorded from now on
        self._done: list[Action] = []
        self._frame: Frame | None = None  # present state, until an action or step changes it
        self._update_rules(Contacts.none())

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self.simulation.time

    def frame(self) -> Frame:
        """Return the present state."""
        if self._frame is None:
            self._frame = self.simulation.frame()
        return self._frame

    def set_control(self, control: str, value: float) -> None:
        """Set a control, and apply the actions that result.

        Raises:
            ActionError: an action is invalid.
        """
        self.act(self.session.record_input(self.time, control, value))

    def act(self, actions: Sequence[Action]) -> None:
        """Apply actions of the player.

        Raises:
            ActionError: an action is invalid.
        """
        self._apply(actions)
        self.session.note_actions(actions)

    def step(self) -> None:
        """Make one step, and apply the actions of the rules.

        Raises:
            Divergence, Exhaustion: the engine cannot continue.
            ActionError: an action of the rules is invalid.
        """
        self._frame = None
        self.simulation.step()
        self._update_rules(self.simulation.contacts())

    def recording(self) -> Recording:
        """Return the session so far as a recording."""
        return Recording(
            scene=self.scene,
            engine=self.engine,
            settings=self.scene.solver,
            actions=tuple(self._done),
            duration=self.time,
            state_hash=self.simulation.state_hash(),
            presses=self.session.presses,
            score=self.rules.score,
        )

    def close(self) -> None:
        """Release the engine."""
        self.simulation.close()

    def _update_rules(self, contacts: Contacts) -> None:
        """Pass the present state to the rules, and apply their actions."""
        self._apply(self.session.on_step(self.time, self.frame(), contacts))

    def _apply(self, actions: Sequence[Action]) -> None:
        for action in actions:
            self._frame = None
            self.simulation.apply(action)
            self._done.append(action)
