"""Referee: rules at work between the steps of one game, whoever runs it, and whoever plays.

It stamps times, keeps what the player did until the rules look, knows which presses are still to come where a game is
seen again, and notices where the rules would have done something else than was done then.
"""

import copy
from collections.abc import Iterable, Sequence
from typing import Self

from sandbox.action import Action, Switch
from sandbox.games.rules import Press, Rules, Seen
from sandbox.trajectory import Contacts, Frame

ROUNDING = 1e-9
"""s by which the time of a press may miss that of a step, which another engine counts otherwise"""


class Referee:
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
        self.seen: Seen | None = None
        """what the rules have looked at last"""
        self.otherwise: float | None = None
        """when the rules, as onlookers, would first have done something else than was done, s"""

    def copy(self) -> Self:
        """Return a copy; what is put into one later is not in the other."""
        return copy.deepcopy(self)

    @property
    def presses(self) -> tuple[Press, ...]:
        """What was pressed up to now."""
        return tuple(self._presses[: self._pressed])

    @property
    def coming(self) -> tuple[Press, ...]:
        """What was pressed later than now, in a game that is seen again."""
        return tuple(self._presses[self._pressed :])

    @property
    def all_presses(self) -> tuple[Press, ...]:
        """What was pressed, also later than now in a game that is seen again."""
        return tuple(self._presses)

    def expect(self, presses: Sequence[Press]) -> None:
        """Take over all that was pressed, from a game that is this one up to now."""
        self._presses = [*presses]

    def forget(self) -> None:
        """Forget what was pressed later than now: it goes another way."""
        del self._presses[self._pressed :]

    def look(self, time: float, frame: Frame, contacts: Contacts) -> tuple[Action, ...]:
        """Let the rules see a state, and return what they do, with its time; once the game is over, nothing."""
        self.seen, self._done = Seen(time, frame, contacts, tuple(self._done)), []
        return () if self.rules.over is not None else _stamped(self.rules.look(self.seen), time)

    def press(self, time: float, control: str, value: float) -> tuple[Action, ...]:
        """Set a control now, and return what comes of it; whatever was pressed later is forgotten."""
        if self.rules.over is not None:
            return ()
        self.forget()
        self._presses.append(Press(time, control, value))
        self._pressed += 1
        return _stamped(self.rules.control(control, value), time)

    def saw(self, actions: Iterable[Action]) -> None:
        """Take note of what the player has done; another engine going on is no doing of his."""
        self._done += [action for action in actions if not isinstance(action, Switch)]

    def watch(self, time: float, own: Sequence[Action], done: Sequence[Action]) -> None:
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
            self._note(time)
            left = [action for action in left if action not in theirs]
        self.watch_player(time, left)

    def watch_player(self, time: float, done: Sequence[Action]) -> None:
        """Hold what a player did at a time against what was pressed then."""
        pressed: list[Action] = []
        while self._pressed < len(self._presses) and self._presses[self._pressed].time <= time + ROUNDING:
            press = self._presses[self._pressed]
            self._pressed += 1
            if self.rules.over is None:
                pressed += _stamped(self.rules.control(press.control, press.value), time)
        if any(action not in done for action in pressed):
            self._note(time)
        self.saw(done)

    def _note(self, time: float) -> None:
        self.otherwise = time if self.otherwise is None else self.otherwise


def _stamped(actions: Iterable[Action], time: float) -> tuple[Action, ...]:
    return tuple(action.model_copy(update={"time": time}) for action in actions)
