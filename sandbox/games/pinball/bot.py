"""Hand: a player of pinball who watches the ball, more or less well."""

import math
from collections.abc import Sequence

from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError, checked_skill
from sandbox.games.pinball.ball_control import SLOW
from sandbox.games.pinball.playfield import PlayfieldElement
from sandbox.games.pinball.rules import FLIPPERS, PLUNGER, PinballRules
from sandbox.scene.random_streams import Stream, draws

LEAD = 0.03
"""s, that a flipper takes to get up, and so ahead of which a player looks. Source: Visual Pinball's stroke of 34 ms"""

HELD = 0.15
"""s, a flipper is held up"""

PAUSE, FLIGHT = 0.05, 1.0
"""s, at least, before a flipper is pressed again, and before the plunger is: the ball has to get away"""

PULL = 1.2
"""s, a plunger is drawn"""

STRENGTH = 0.85, 1.0
"""of a pull, at random between these"""

JITTER = 0.05
"""s, by which a player without any skill is late or early"""

IDLE = 0.7
"""1/s, how often a player without any skill flips for nothing"""


class PinballBot:
    """Flips when a ball is about to be within reach, plunges when one waits.

    Skill is the part of the balls that are info in time; it also takes away from how far the timing is off, and from
    flipping for nothing. A table with other rules than pinball it cannot play.
    """

    def __init__(self, seed: int, skill: float = 0.8) -> None:
        """Sit down.

        Raises:
            ValueError: the skill is not from 0 to 1.
        """
        self.skill = checked_skill(skill)
        self._chance = draws(Stream.FLIPPERS, seed)
        self._due: dict[str, float] = {}  # by control: when it is pressed, s
        self._until: dict[str, float] = {}  # by control: when it is let go, s
        self._rests: dict[str, float] = {}  # by control: until when it is not pressed again, s
        self._judged: dict[str, bool] = {}  # by control: whether the ball that is within reach was thought about

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return what is pressed and let go now.

        Raises:
            UnsuitableSceneError: these are no rules of pinball.
        """
        if not isinstance(rules, PinballRules):
            raise UnsuitableSceneError("this player only plays pinball")
        found = [(control, 0.0) for control, until in sorted(self._until.items()) if until <= info.time]
        for control, _ in found:
            del self._until[control]
            self._rests[control] = info.time + (FLIGHT if control == PLUNGER else PAUSE)
        for control, side in FLIPPERS.items():
            self._flip(control, rules.board.flippers(side), info, rules)
        self._plunge(info, rules)
        for control in sorted(control for control, due in self._due.items() if due <= info.time):
            del self._due[control]
            if control not in self._until and self._rests.get(control, 0.0) <= info.time:
                plunges = control == PLUNGER
                self._until[control] = info.time + (PULL if plunges else HELD)
                found.append((control, float(self._chance.uniform(*STRENGTH)) if plunges else 1.0))
        return found

    def _flip(self, control: str, flippers: tuple[PlayfieldElement, ...], info: StepInfo, rules: PinballRules) -> None:
        """Decide whether to flip, once for each ball that comes within reach."""
        near = any(_reached(each, ball, info, rules) for each in flippers for ball in rules.trough.live)
        if near and not self._judged.get(control) and self._chance.random() < self.skill:
            late = self._chance.normal(0.0, JITTER * (1.0 - self.skill))
            self._due.setdefault(control, info.time + max(late, 0.0))
        self._judged[control] = near
        if self._chance.random() < IDLE * (1.0 - self.skill) * rules.board.dt:
            self._due.setdefault(control, info.time)

    def _plunge(self, info: StepInfo, rules: PinballRules) -> None:
        position, velocity = info.frame.position, info.frame.velocity
        waits = any(
            rules.board.in_lane(*position[ball].tolist()) and math.hypot(*velocity[ball].tolist()) < SLOW
            for ball in rules.trough.live
        )
        if waits and PLUNGER not in self._until:
            self._due.setdefault(PLUNGER, info.time)


def _reached(flipper: PlayfieldElement, ball: int, info: StepInfo, rules: PinballRules) -> bool:
    """Tell whether a ball will be where a flipper can strike it, by the time that it is up."""
    (x, y), (vx, vy) = info.frame.position[ball].tolist(), info.frame.velocity[ball].tolist()
    up = rules.board.up
    if vx * up[0] + vy * up[1] > 0.1:  # it goes up by itself
        return False
    ahead = (x + vx * LEAD - flipper.where[0], y + vy * LEAD - flipper.where[1])
    above = ahead[0] * up[0] + ahead[1] * up[1]
    return math.hypot(*ahead) < flipper.span + rules.board.radius and above < 1.2 * rules.board.radius + 0.02
