"""Policies: who plays where nobody sits at the window. But for the skilled they look at nothing: they press keys."""

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from sandbox.games.artillery.terrain import Artillery
from sandbox.games.curling.match import CurlingMatch
from sandbox.games.pinball.hand import PinballHand
from sandbox.games.rules import Control, Policy, Press, Rules, Seen, UnfitError
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.random_streams import Stream, draws
from sandbox.scene.scene import Scene

RATES = 0.2, 2.0
"""1/s, how often a random player presses a usual control: one rate for each, drawn evenly by factors between these"""
HOLDS = 0.05, 1.6
"""s, how long it holds a control: drawn likewise, for each press anew; what takes a second to draw is drawn at times"""
FULL = 0.5
"""of the presses of what can be pressed by halves, those all the way, as keys do; others are even from 0 to 1"""


class Nobody:
    """Presses nothing."""

    def decide(self, seen: Seen, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return nothing."""
        return ()


class Chance:
    """Presses each control at random times, exponentially distributed at a rate of its own, and holds it a while."""

    def __init__(self, seed: int) -> None:
        self._chance = draws(Stream.KEYS, seed)
        self._turns: dict[str, tuple[float, bool]] = {}  # by control: when it changes next, and whether it is down
        self._pauses: dict[str, float] = {}  # s between presses, on average
        self._next = -math.inf  # when anything changes, s

    def decide(self, seen: Seen, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return what changes now."""
        if seen.time < self._next:
            return ()
        if not self._turns:
            self._begin(rules.controls, seen.time)
        found = []
        for control in rules.controls:
            due, down = self._turns[control.name]
            if due > seen.time:
                continue
            down = not down
            # No sooner than the next step: a control changes once a step.
            lasts = self._drawn(HOLDS) if down else float(self._chance.exponential(self._pauses[control.name]))
            self._turns[control.name] = seen.time + lasts, down
            found.append((control.name, self._level(control) if down else 0.0))
        self._next = min((due for due, _ in self._turns.values()), default=math.inf)
        return found

    def _begin(self, controls: Sequence[Control], time: float) -> None:
        for control in controls:
            pause = self._pauses[control.name] = 1.0 / (self._drawn(RATES) * control.often)
            self._turns[control.name] = time + self._chance.exponential(pause), False

    def _drawn(self, bounds: tuple[float, float]) -> float:
        return float(np.exp(self._chance.uniform(*np.log(bounds))))

    def _level(self, control: Control) -> float:
        """Return how far a control is pressed."""
        if not control.analogue or self._chance.uniform() < FULL:
            return 1.0
        return float(self._chance.uniform())


class Script:
    """Presses what a script says, each before the first step that starts at its time or later."""

    def __init__(self, presses: Iterable[Press]) -> None:
        self._presses = sorted(presses, key=lambda press: press.time)
        self._done = 0

    def decide(self, seen: Seen, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return what is due."""
        begin = self._done
        while self._done < len(self._presses) and self._presses[self._done].time <= seen.time + 1e-9:  # rounding
            self._done += 1
        return [(press.control, press.value) for press in self._presses[begin : self._done]]


def _nobody(scene: Scene) -> Policy:
    """Return the player that presses nothing.

    Raises:
        UnfitError: the game stands still until a person delivers a stone, or fires.
    """
    play = scene.play
    if play.game == "curling" and (table_of(play, CurlingMatch) or CurlingMatch()).people:
        raise UnfitError(
            "player 'none' delivers no stone, so nothing would move; use random or a script, or let both teams play by "
            "themselves with --set play.curling.people=0"
        )
    artillery = table_of(scene, Artillery)
    if play.game == "artillery" and artillery is not None:
        waits = next((player.name for player in artillery.players if player.bot is None), None)
        if waits is not None:
            raise UnfitError(
                f"player 'none' fires no gun, so {waits} would never play; use random, skilled or a script"
            )
    return Nobody()


def _skilled(scene: Scene) -> Policy:
    """Return a player who watches the ball, or aims a gun.

    Raises:
        UnfitError: it is a game that none knows.
    """
    if scene.play.game == "artillery":
        from sandbox.games.artillery.hand import ArtilleryHand  # an engine's integrators, which others do without

        return ArtilleryHand(scene.world.seed)
    if scene.play.game != "pinball":
        raise UnfitError(f"player 'skilled' plays pinball and artillery, not {scene.play.game}; use random")
    return PinballHand(scene.world.seed)


POLICIES: dict[str, Callable[[Scene], Policy]] = {
    "random": lambda scene: Chance(scene.world.seed),
    "none": _nobody,
    "skilled": _skilled,
}
"""Those that need no script, by name."""
