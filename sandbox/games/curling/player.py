"""Policy `skilled` of curling: it chooses deliveries as the bot does, and makes them by the controls of a person."""

from collections.abc import Sequence

from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError, checked_skill
from sandbox.games.curling.bot import CurlingBot
from sandbox.games.curling.rules import HARDER, SIDEWAYS, Curling, CurlingAim, broom_offset
from sandbox.games.curling.sheet import RELEASE, TEAMS

MAX_ERROR = 5.0
"""error of the deliveries at skill 0, in units of `CurlingBot`"""


class CurlingPlayer:
    """Policy that delivers the stones of all teams that a person plays."""

    def __init__(self, seed: int, skill: float = 0.8) -> None:
        """Create a policy.

        Args:
            seed: random seed of the errors.
            skill: 0 to 1; the errors of the deliveries decrease from `MAX_ERROR` to none.

        Raises:
            ValueError: the skill is not from 0 to 1.
        """
        self._seed, self._error = seed, MAX_ERROR * (1.0 - checked_skill(skill))
        self._bots: list[CurlingBot] = []
        self._target: CurlingAim | None = None
        self._held_controls: set[str] = set()
        self._time = 0.0

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls to press and to release now.

        Raises:
            UnsuitableSceneError: the rules are those of another game.
        """
        if not isinstance(rules, Curling):
            raise UnsuitableSceneError("this player only plays curling")
        step, self._time = info.time - self._time, info.time
        wanted: set[str] = set()
        if rules.aim is None:
            self._target = None
        else:
            self._target = self._target or self._choose(rules)
            wanted = self._wanted(rules.aim, self._target, step)
        changes = [(name, 0.0) for name in sorted(self._held_controls - wanted)]
        changes += [(name, 1.0) for name in sorted(wanted - self._held_controls)]
        self._held_controls = wanted
        return changes

    def _choose(self, rules: Curling) -> CurlingAim:
        """Return the aim of the next delivery."""
        if not self._bots:
            self._bots = [CurlingBot(team, rules.ice, self._error, self._seed) for team in range(len(TEAMS))]
        score = rules.present_score
        chosen = self._bots[score.team].delivery(rules.stones, score.thrown, rules.has_last_stone)
        weight = rules.ice.distance_for(chosen.speed) + RELEASE
        return CurlingAim(broom_offset(chosen.heading), weight, chosen.turn).limited()

    def _wanted(self, aim: CurlingAim, target: CurlingAim, step: float) -> set[str]:
        """Return the controls to hold during the next step; `turn` and `throw` are tapped."""
        wanted: set[str] = set()
        for offset, rate, more, less in (
            (target.broom - aim.broom, SIDEWAYS, "left", "right"),
            (target.weight - aim.weight, HARDER, "harder", "softer"),
        ):
            if abs(offset) > 0.5 * rate * step:  # one more step reduces the offset
                wanted.add(more if offset > 0.0 else less)
        if aim.turn != target.turn:
            wanted |= {"turn"} - self._held_controls
        elif not wanted:
            wanted |= {"throw"} - self._held_controls
        return wanted
