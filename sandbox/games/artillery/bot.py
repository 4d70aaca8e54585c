"""Bot of artillery as a policy: it plans a shot by `BotPlanner`, and sets the gun by holding and tapping keys."""

import math
from collections.abc import Sequence

from sandbox.games.artillery.battlefield import Tank
from sandbox.games.artillery.bot_planner import BotPlanner
from sandbox.games.artillery.rules import HOLD_RATES, TAP_ANGLE, TAP_POWER, ArtilleryRules
from sandbox.games.artillery.targeting import FiringSolution
from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError, checked_skill
from sandbox.scene.random_streams import Stream, draws

TAP_DISTANCE = 12.0
"""taps: below this distance from the setting, a key is tapped instead of held"""


class ArtilleryBot:
    """Policy that plays the turns of all players without a bot of their own."""

    def __init__(self, seed: int, skill: float = 0.8) -> None:
        """Create a policy.

        Raises:
            ValueError: the skill is not from 0 to 1.
        """
        self.skill = checked_skill(skill)
        self._seed, self._turn, self._time = seed, 0, 0.0
        self._planner: BotPlanner | None = None
        self._held_controls: set[str] = set()

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls to press and to release now.

        Raises:
            UnsuitableSceneError: the rules are those of another game.
        """
        if not isinstance(rules, ArtilleryRules):
            raise UnsuitableSceneError("this player only plays artillery")
        step, self._time = info.time - self._time, info.time
        wanted: set[str] = set()
        if rules.phase == "aim" and rules.shooter.player.bot is None:
            aim = self._planned_shot(rules)
            if aim is not None:
                wanted = self._wanted(rules, aim, step)
        changed = [(name, 0.0) for name in sorted(self._held_controls - wanted)]
        changed += [(name, 1.0) for name in sorted(wanted - self._held_controls)]
        self._held_controls = wanted
        return changed

    def _planned_shot(self, rules: ArtilleryRules) -> FiringSolution | None:
        """Continue the search for the shot of this turn; return it once it is found."""
        if self._planner is None or self._turn != rules.turn:
            random = draws(Stream.AIM, self._seed, rules.turn)
            self._planner = BotPlanner(rules.world, rules.field, rules.shooter, random, self.skill)
            self._turn = rules.turn
        return self._planner.advance()

    def _wanted(self, rules: ArtilleryRules, aim: FiringSolution, step: float) -> set[str]:
        """Return the keys to hold now; a key is tapped by releasing it at every second step."""
        tank, keys = rules.shooter, set[str]()
        assert self._planner is not None
        if tank.weapon != self._planner.weapon:
            keys |= {"weapon"} - self._held_controls
        remaining_changes = self._remaining_changes(rules, tank, aim)
        for (remaining, tap, rate), (more, less) in zip(
            remaining_changes, (("left", "right"), ("up", "down")), strict=True
        ):
            key = more if remaining > 0.0 else less
            if abs(remaining) > 0.5 * (tap + rate * step) and (
                key not in self._held_controls or abs(remaining) > TAP_DISTANCE * tap
            ):
                keys.add(key)
        if not keys and not self._held_controls:
            keys.add("fire")
        return keys

    @staticmethod
    def _remaining_changes(
        rules: ArtilleryRules, tank: Tank, aim: FiringSolution
    ) -> tuple[tuple[float, float, float], ...]:
        """Return, for angle and power, the remaining change, the change by a tap, and the change per second."""
        power = aim.speed / rules.artillery.speed
        return (
            (min(max(aim.angle, 0.0), math.pi) - tank.angle, TAP_ANGLE, HOLD_RATES[0]),
            (power - tank.power, TAP_POWER, HOLD_RATES[1]),
        )
