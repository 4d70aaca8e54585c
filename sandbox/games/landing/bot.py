"""Bot of landing: an autopilot that flies to a point above the pad, and descends there.

The horizontal acceleration follows a damped spring towards the pad; the vertical one holds a rate of descent from which
a constant deceleration leads to a slow touchdown. Their direction is the tilt that the side thrusters keep, their
vertical component the throttle of the main engines. The bot reads the thrusts of the scene: forces and points of
application.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError, checked_skill
from sandbox.games.landing.rules import Landing
from sandbox.scene.random_streams import Stream, draws

POSITION_GAIN, VELOCITY_GAIN = 0.0625, 0.4
"""1/s² and 1/s: horizontal acceleration per distance from the pad, and per velocity; nearly critically damped"""
MAX_SIDEWAYS_FRACTION = 0.25
"""largest horizontal acceleration, as a fraction of that of the engines"""
ANGLE_GAIN, ANGULAR_VELOCITY_GAIN = 1.6, 1.8
"""1/s² and 1/s: angular acceleration per angle and per angular velocity"""
DESCENT_CONE = 2.0, 1.0
"""m, and m per m of height: horizontal distance from the pad up to which the ship descends"""
STEADY_HEIGHT = 2.0
"""m, height below which the ship descends only while it is steady"""
STEADY_LIMITS = 0.4, 0.1
"""m/s and rad: limits of horizontal speed and tilt of a steady ship"""
TOUCHDOWN_SPEED = 0.5
"""m/s, rate of descent at the pad"""
BRAKING_FRACTION = 0.15
"""deceleration of the descent, as a fraction of the largest upward acceleration against gravity"""
DESCENT_GAIN = 2.0
"""1/s, vertical acceleration per difference from the rate of descent"""
THROTTLE_LEVELS = 100
"""number of throttle levels: coarser throttles keep the recording of a game short"""
MAX_ERROR = 0.5
"""largest relative error of the estimated height and velocities at skill 0"""


class _Engine(NamedTuple):
    """Accelerations of the ship by a thrust at full throttle."""

    name: str
    lift: float
    """m/s², acceleration in the direction of the ship's nose"""
    turn: float
    """rad/s², angular acceleration"""


class LandingBot:
    """Policy that lands the ship."""

    def __init__(self, seed: int, skill: float = 0.8) -> None:
        """Create a policy.

        Args:
            seed: random seed of the errors.
            skill: 0 to 1; the largest error of height and velocities decreases from `MAX_ERROR` to none.

        Raises:
            ValueError: the skill is not from 0 to 1.
        """
        error = MAX_ERROR * (1.0 - checked_skill(skill))
        self._height_factor, self._velocity_factor = 1.0 + draws(Stream.PILOT, seed).uniform(-error, error, 2)
        self._levels: dict[str, float] = {}

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        """Return the throttles that change.

        Raises:
            UnsuitableSceneError: the rules are those of another game.
        """
        if not isinstance(rules, Landing):
            raise UnsuitableSceneError("this player only plays landing")
        frame, ship = info.frame, rules.ship
        if not frame.present[ship]:
            return ()
        vx, vy = (self._velocity_factor * frame.velocity[ship]).tolist()
        tilt, rate = rules.tilt(frame), float(frame.angular_velocity[ship])
        distance = rules.pad[0] - float(frame.position[ship, 0])
        height = self._height_factor * rules.height(frame)

        engines = _engines(rules)
        available = math.fsum(each.lift for each in engines if not each.turn)
        sideways = _clamp(POSITION_GAIN * distance - VELOCITY_GAIN * vx, MAX_SIDEWAYS_FRACTION * available)
        descent = 0.0
        settled = height > STEADY_HEIGHT or (abs(vx) < STEADY_LIMITS[0] and abs(tilt) < STEADY_LIMITS[1])
        if abs(distance) < DESCENT_CONE[0] + DESCENT_CONE[1] * height and settled:
            braking = BRAKING_FRACTION * max(available - rules.gravity, 0.0)
            descent = TOUCHDOWN_SPEED + math.sqrt(2.0 * braking * max(height, 0.0))
        up = rules.gravity - DESCENT_GAIN * (descent + vy)
        turn = ANGLE_GAIN * (math.atan2(-sideways, max(up, 0.2 * available)) - tilt) - ANGULAR_VELOCITY_GAIN * rate
        return self._throttle_changes(engines, up / max(math.cos(tilt), 0.5), turn)

    def _throttle_changes(self, engines: Sequence[_Engine], lift: float, turn: float) -> list[tuple[str, float]]:
        """Return the throttles that change for accelerations of the ship, m/s² and rad/s²."""
        total_lift = math.fsum(each.lift for each in engines if not each.turn)
        total_turn = math.fsum(abs(each.turn) for each in engines if each.turn * turn > 0.0)
        changes = []
        for each in engines:
            level = 0.0
            if each.turn * turn > 0.0:
                level = abs(turn) / total_turn
            elif not each.turn and total_lift > 0.0:
                level = lift / total_lift
            level = round(min(max(level, 0.0), 1.0) * THROTTLE_LEVELS) / THROTTLE_LEVELS
            if level != self._levels.get(each.name, 0.0):
                self._levels[each.name] = level
                changes.append((each.name, level))
        return changes


def _engines(rules: Landing) -> list[_Engine]:
    """Return the thrusts of the ship; one whose line of action passes through the centre of mass does not turn it."""
    found = []
    for name, thrust in rules.thrusts.items():
        (fx, fy), (x, y) = thrust.force, thrust.point
        torque = x * fy - y * fx
        found.append(_Engine(name, fy / rules.mass, torque / rules.moment if rules.moment > 0.0 else 0.0))
    return found


def _clamp(value: float, bound: float) -> float:
    return min(max(value, -bound), bound)
