"""Bout: a game between the steps of a headless run, played by a policy or seen again."""

from collections.abc import Iterable, Sequence
from typing import Any

from sandbox.action import Action
from sandbox.games.lighting import Lighting
from sandbox.games.referee import Referee
from sandbox.games.rules import Logged, Policy, Press, Rules
from sandbox.trajectory import Contacts, Frame


class Bout:
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
        self._referee, self._policy = Referee(rules, presses), policy
        self._lighting = Lighting(rules)

    @property
    def stops(self) -> bool:
        """Whether the run is to end here; a game that is seen again is seen to the end of what was recorded."""
        return self._policy is not None and self._referee.rules.over is not None

    def turn(
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
        referee, policy = self._referee, self._policy
        own = referee.look(time, frame, contacts)
        self._lighting.look(time)
        if policy is None:
            referee.watch(time, own, given)
            return given
        pressed: list[Action] = []
        if not last and referee.rules.over is None and referee.seen is not None:
            for control, value in policy.decide(referee.seen, referee.rules):
                pressed += referee.press(time, control, value)
        played = [*pressed, *given]
        referee.saw(played)
        return [*own, *played]

    @property
    def presses(self) -> tuple[Press, ...]:
        """What was pressed."""
        return self._referee.presses

    @property
    def otherwise(self) -> float | None:
        """When the rules would first have done something else than was done, s, in a game that is seen again."""
        return self._referee.otherwise

    @property
    def over(self) -> str | None:
        """Why the game is over; None while it goes on."""
        return self._referee.rules.over

    @property
    def score(self) -> int | float:
        """Of who plays."""
        return self._referee.rules.score

    def told(self, game: str) -> dict[str, Any]:
        """Return the outcome as JSON values."""
        rules = self._referee.rules
        log = {"log": [list(entry) for entry in rules.log]} if isinstance(rules, Logged) else {}
        return {
            "name": game,
            "player": self.player,
            "score": self.score,
            "over": self.over,
            "lines": [list(line) for line in rules.lines()],
            "presses": [list(press) for press in self.presses],
            "otherwise": self.otherwise,
            **log,
            **({"lamps": lamps} if (lamps := self._lighting.told()) else {}),
        }
