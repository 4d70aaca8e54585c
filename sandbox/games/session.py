"""Referee: rules at work between the steps of one game, whoever runs it, and whoever plays.

It stamps times, keeps what the player did until the rules look, knows which presses are still to come where a game is
seen again, and notices where the rules would have done something else than was done then.

Lighting: which lamps of a game were lit when, kept with a run: who sees it again has no rules that would tell.

Bout: a game between the steps of a headless run, played by a policy or seen again.
"""

import copy
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Self

from sandbox.action import Action, Switch
from sandbox.games.contract import HasLamps, HasLog, Policy, Press, Rules, StepInfo
from sandbox.trajectory import Contacts, Frame

MIN_LAMP_INTERVAL = 0.04
"""s between two looks, as between the pictures of a film; a flash lasts longer, and a look at each step would tell in
a game's time"""

TIME_ROUNDING = 1e-9
"""s, of times of steps"""


class LampState:
    """Looks at the lamps of a game from time to time, and keeps what has changed; of a game without lamps nothing."""

    def __init__(self, rules: Rules) -> None:
        """Begin, with all of them dark."""
        self._rules = rules if isinstance(rules, HasLamps) else None
        self._lit: frozenset[str] = frozenset()
        self._next = 0.0
        self._changes: list[tuple[float, list[str]]] = []

    def update(self, time: float) -> None:
        """Look, if it is time to, s."""
        if self._rules is None or time < self._next - TIME_ROUNDING:
            return
        self._next = time + MIN_LAMP_INTERVAL
        lit = self._rules.lit_lamps()
        if lit != self._lit:
            self._changes.append((time, sorted(lit ^ self._lit)))
            self._lit = lit

    def changes(self) -> list[list[Any]]:
        """Return as JSON values when, s, which lamps were lit or went out."""
        return [list(change) for change in self._changes]


class LampLog(NamedTuple):
    """The same to be looked up."""

    times: list[float]
    """s, in order"""
    lit: list[frozenset[str]]
    """from then on"""

    @classmethod
    def from_changes(cls, changes: Sequence[Any]) -> "LampLog":
        """Read what `Lighting.told` has returned.

        Raises:
            ValueError: it is something else.
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
        place = bisect_right(self.times, time) - 1
        return self.lit[place] if place >= 0 else frozenset()


REPLAY_ROUNDING = 1e-9
"""s by which the time of a press may miss that of a step, which another engine counts otherwise"""


class GameSession:
    """A game under way. A copy goes on from here by itself."""

    def __init__(self, rules: Rules, presses: Iterable[Press] = ()) -> None:
        """Begin.

        Args:
            rules: of a game that has just begun.
            presses: of a game that was played, to be seen again.
        """
        self.rules = rules
        self._presses = sorted(presses, key=lambda press: press.time)
        self._pressed = 0
        self._done: list[Action] = []  # by the player since the last look
        self.step_info: StepInfo | None = None
        """what the rules have looked at last"""
        self.diverged_at: float | None = None
        """when the rules, as onlookers, would first have done something else than was done, s"""

    def copy(self) -> Self:
        """Return a copy; what is put into one later is not in the other."""
        return copy.deepcopy(self)

    @property
    def presses(self) -> tuple[Press, ...]:
        """What was pressed up to now."""
        return tuple(self._presses[: self._pressed])

    @property
    def future_presses(self) -> tuple[Press, ...]:
        """What was pressed later than now, in a game that is seen again."""
        return tuple(self._presses[self._pressed :])

    @property
    def all_presses(self) -> tuple[Press, ...]:
        """What was pressed, also later than now in a game that is seen again."""
        return tuple(self._presses)

    def set_presses(self, presses: Sequence[Press]) -> None:
        """Take over all that was pressed, from a game that is this one up to now."""
        self._presses = [*presses]

    def discard_future(self) -> None:
        """Forget what was pressed later than now: it goes another way."""
        del self._presses[self._pressed :]

    def on_step(self, time: float, frame: Frame, contacts: Contacts) -> tuple[Action, ...]:
        """Let the rules see a state, and return what they do, with its time; once the game is over, nothing."""
        self.step_info, self._done = StepInfo(time, frame, contacts, tuple(self._done)), []
        return () if self.rules.game_over is not None else _stamped(self.rules.on_step(self.step_info), time)

    def press(self, time: float, control: str, value: float) -> tuple[Action, ...]:
        """Set a control now, and return what comes of it; whatever was pressed later is forgotten."""
        if self.rules.game_over is not None:
            return ()
        self.discard_future()
        self._presses.append(Press(time, control, value))
        self._pressed += 1
        return _stamped(self.rules.on_input(control, value), time)

    def note_actions(self, actions: Iterable[Action]) -> None:
        """Take note of what the player has done; another engine going on is no doing of his."""
        self._done += [action for action in actions if not isinstance(action, Switch)]

    def replay(self, time: float, own: Sequence[Action], done: Sequence[Action]) -> None:
        """Hold what was done at a time against what the rules do, and press again what was pressed then.

        Args:
            time: s.
            own: what the rules did as they looked just now.
            done: what was done then, theirs before the player's.
        """
        theirs, left = list(own), list(done)
        if left[: len(theirs)] == theirs:
            del left[: len(theirs)]
        else:
            self._note_divergence(time)
            left = [action for action in left if action not in theirs]
        self.replay_player(time, left)

    def replay_player(self, time: float, done: Sequence[Action]) -> None:
        """Hold what a player did at a time against what was pressed then."""
        pressed: list[Action] = []
        while self._pressed < len(self._presses) and self._presses[self._pressed].time <= time + REPLAY_ROUNDING:
            press = self._presses[self._pressed]
            self._pressed += 1
            if self.rules.game_over is None:
                pressed += _stamped(self.rules.on_input(press.control, press.value), time)
        if any(action not in done for action in pressed):
            self._note_divergence(time)
        self.note_actions(done)

    def _note_divergence(self, time: float) -> None:
        self.diverged_at = time if self.diverged_at is None else self.diverged_at


def _stamped(actions: Iterable[Action], time: float) -> tuple[Action, ...]:
    return tuple(action.model_copy(update={"time": time}) for action in actions)


class HeadlessGame:
    """Asked between any two steps what is to be done. One bout is of one run."""

    def __init__(self, rules: Rules, policy: Policy | None, player: str, presses: Iterable[Press] = ()) -> None:
        """Begin a game.

        Args:
            rules: of a game that has just begun.
            policy: who plays; none where a game is seen again, in which all that was done is given.
            player: what he is called.
            presses: of a game that is seen again.
        """
        self.player = player
        self._session, self._policy = GameSession(rules, presses), policy
        self._lamps = LampState(rules)

    @property
    def finished(self) -> bool:
        """Whether the run is to end here; a game that is seen again is seen to the end of what was recorded."""
        return self._policy is not None and self._session.rules.game_over is not None

    def actions_between_steps(
        self, time: float, frame: Frame, contacts: Contacts, given: Sequence[Action], last: bool
    ) -> Sequence[Action]:
        """Let all who may act between two steps, and return what is to be done, in order.

        Args:
            time: s.
            frame: the state.
            contacts: of the last step.
            given: what is to be done at this time in any case.
            last: no step comes after it, so that nobody is asked to play.
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
                pressed += session.press(time, control, value)
        played = [*pressed, *given]
        session.note_actions(played)
        return [*own, *played]

    @property
    def presses(self) -> tuple[Press, ...]:
        """What was pressed."""
        return self._session.presses

    @property
    def diverged_at(self) -> float | None:
        """When the rules would first have done something else than was done, s, in a game that is seen again."""
        return self._session.diverged_at

    @property
    def game_over(self) -> str | None:
        """Why the game is over; None while it goes on."""
        return self._session.rules.game_over

    @property
    def score(self) -> int | float:
        """Of who plays."""
        return self._session.rules.score

    def to_dict(self, game: str) -> dict[str, Any]:
        """Return the outcome as JSON values."""
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
