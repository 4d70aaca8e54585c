"""Policy `skilled` of pinball: flips when a ball is in reach of a flipper, with errors that depend on its skill."""

import math
from collections.abc import Sequence

from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError, checked_skill
from sandbox.games.pinball.ball_control import REST_SPEED
from sandbox.games.pinball.playfield import PlayfieldElement
from sandbox.games.pinball.rules import FLIPPERS, PLUNGER, PinballRules
from sandbox.scene.random_streams import Stream, draws

LEAD_TIME = 0.03
"""s, time that a flipper takes to rise, for which the bot extrapolates the ball. Source: Visual Pinball, stroke of 34
ms"""

HOLD_TIME = 0.15
"""s for which a flipper is held up"""

FLIPPER_PAUSE, PLUNGER_PAUSE = 0.05, 1.0
"""s, minimum time from the release of a flipper, and of the plunger, to its next press: the ball has to leave"""

PULL_TIME = 1.2
"""s for which the plunger is pulled"""

PULL_STRENGTH = 0.85, 1.0
"""bounds of the random value of a pull"""

TIMING_ERROR = 0.05
"""s, standard deviation of the time of a flip at skill 0"""

FALSE_FLIP_RATE = 0.7
"""1/s, rate of flips without a ball in reach at skill 0"""


class PinballBot:
    """Policy that flips when a ball comes into reach, and plunges when a ball waits in the lane.

    The skill is the probability that it notices a ball in reach. The timing error and the rate of false flips decrease
    in proportion to 1 − skill.
    """

    def __init__(self, seed: int, skill: float = 0.8) -> None:
        """Create a policy.

        Args:
            seed: random seed of the errors.
            skill: 0 to 1.

        Raises:
            ValueError: the skill is not from 0 to 1.
        """
        self.skill = checked_skill(skill)
        self._rng = draws(Stream.FLIPPERS, seed)
        self._press_times: dict[str, float] = {}  # by control: time at which it is pressed, s
        self._release_times: dict[str, float] = {}  # by control: time at which it is released, s
        self._pause_ends: dict[str, float] = {}  # by control: earliest time of the next press, s
        self._was_near: dict[str, bool] = {}  # by control: whether a ball was in reach in the last step

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the controls to press and to release now.

        Raises:
            UnsuitableSceneError: the rules are those of another game.
        """
        if not isinstance(rules, PinballRules):
            raise UnsuitableSceneError("this player only plays pinball")
        found = [(control, 0.0) for control, until in sorted(self._release_times.items()) if until <= info.time]
        for control, _ in found:
            del self._release_times[control]
            self._pause_ends[control] = info.time + (PLUNGER_PAUSE if control == PLUNGER else FLIPPER_PAUSE)
        for control, side in FLIPPERS.items():
            self._flip(control, rules.board.flippers(side), info, rules)
        self._plunge(info, rules)
        for control in sorted(control for control, due in self._press_times.items() if due <= info.time):
            del self._press_times[control]
            if control not in self._release_times and self._pause_ends.get(control, 0.0) <= info.time:
                plunges = control == PLUNGER
                self._release_times[control] = info.time + (PULL_TIME if plunges else HOLD_TIME)
                found.append((control, float(self._rng.uniform(*PULL_STRENGTH)) if plunges else 1.0))
        return found

    def _flip(self, control: str, flippers: tuple[PlayfieldElement, ...], info: StepInfo, rules: PinballRules) -> None:
        """Decide whether to flip, once for each ball that comes into reach."""
        near = any(_is_in_reach(each, ball, info, rules) for each in flippers for ball in rules.trough.in_play)
        if near and not self._was_near.get(control) and self._rng.random() < self.skill:
            late = self._rng.normal(0.0, TIMING_ERROR * (1.0 - self.skill))
            self._press_times.setdefault(control, info.time + max(late, 0.0))
        self._was_near[control] = near
        if self._rng.random() < FALSE_FLIP_RATE * (1.0 - self.skill) * rules.board.dt:
            self._press_times.setdefault(control, info.time)

    def _plunge(self, info: StepInfo, rules: PinballRules) -> None:
        position, velocity = info.frame.position, info.frame.velocity
        waits = any(
            rules.board.in_lane(*position[ball].tolist()) and math.hypot(*velocity[ball].tolist()) < REST_SPEED
            for ball in rules.trough.in_play
        )
        if waits and PLUNGER not in self._release_times:
            self._press_times.setdefault(PLUNGER, info.time)


def _is_in_reach(flipper: PlayfieldElement, ball: int, info: StepInfo, rules: PinballRules) -> bool:
    """Return whether a flipper can strike a ball once it has risen."""
    (x, y), (vx, vy) = info.frame.position[ball].tolist(), info.frame.velocity[ball].tolist()
    up = rules.board.up
    if vx * up[0] + vy * up[1] > 0.1:  # the ball already moves upwards
        return False
    ahead = (x + vx * LEAD_TIME - flipper.position[0], y + vy * LEAD_TIME - flipper.position[1])
    above = ahead[0] * up[0] + ahead[1] * up[1]
    return math.hypot(*ahead) < flipper.span + rules.board.radius and above < 1.2 * rules.board.radius + 0.02
