"""Rolling resistance on pymunk: a motor at rest between the two bodies of each contact of a ball.

Munk2D solves the motor together with the contacts, so that a ball rests on a slope that is not steeper than its rolling
resistance. The largest torque of the motor follows from the normal impulse of the last substep, as that of the present
one is known only at its end: at a landing it is one substep late.
"""

import math
from typing import Any, NamedTuple

import pymunk

from sandbox.scene.compile.contacts import ContactMatrix


class RollingPair(NamedTuple):
    """Two bodies that touch."""

    a: pymunk.Body
    b: pymunk.Body
    impulse: float
    """N·m·s, largest angular impulse in a substep"""


class SpaceRolling:
    """Rolling resistance of the balls of a space."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self._coefficients: dict[tuple[int, int], float] = {}
        self._radius: dict[int, float] = {}
        self._touching: dict[tuple[int, int], RollingPair] = {}
        self._motors: dict[tuple[int, int], pymunk.SimpleMotor] = {}
        self.resisted: set[int] = set()
        """ids of the bodies on which a motor acted in the last substep"""

    @property
    def is_active(self) -> bool:
        """Whether a pair of surfaces has rolling resistance."""
        return any(self._coefficients.values())

    def rebuild(self, matrix: ContactMatrix) -> None:
        """Set the coefficients of all pairs of surfaces that can touch."""
        rolling = matrix.surfaces.rolling
        for pair in self._coefficients:
            self._coefficients[pair] = 0.0
        for a in range(len(rolling)) if rolling.any() else ():
            for b in range(a, len(rolling)):
                if rolling[a, b] > 0.0 and matrix.touching[a, b]:
                    if (a, b) not in self._coefficients:
                        self._space.on_collision(a + 1, b + 1, post_solve=self._record, data=(a, b))
                    self._coefficients[a, b] = float(rolling[a, b])

    def join(self, body: pymunk.Body, radius: float) -> None:
        """Include a ball, with its radius, m."""
        self._radius[body.id] = radius

    def leave(self, body: pymunk.Body) -> None:
        """Remove the motors of a body that leaves the space, or that a zone holds."""
        for pair in [pair for pair in self._motors if body.id in pair]:
            self._space.remove(self._motors.pop(pair))

    def _record(self, arbiter: pymunk.Arbiter, _: pymunk.Space, surfaces: Any) -> None:
        """Record the normal impulse of a contact in the present substep."""
        a, b = arbiter.bodies
        radius = max(self._radius.get(a.id, 0.0), self._radius.get(b.id, 0.0))
        reach = radius * self._coefficients[surfaces]
        if not reach or not (_can_turn(a) or _can_turn(b)):
            return
        impulse, pair = reach * abs(arbiter.total_impulse.dot(arbiter.normal)), (min(a.id, b.id), max(a.id, b.id))
        known = self._touching.get(pair)
        self._touching[pair] = RollingPair(a, b, impulse if known is None else known.impulse + impulse)

    def update(self) -> None:
        """Set the motors of the next substep by the contacts of the last one."""
        self.resisted = {body for pair in self._motors for body in pair}
        for pair in [pair for pair in self._motors if pair not in self._touching]:
            self._space.remove(self._motors.pop(pair))
        for pair, (a, b, impulse) in self._touching.items():
            motor = self._motors.get(pair)
            if motor is None:
                static = self._space.static_body
                first, second = (static if each.body_type == pymunk.Body.STATIC else each for each in (a, b))
                self._motors[pair] = motor = pymunk.SimpleMotor(first, second, 0.0)
                self._space.add(motor)
            motor.max_force = impulse / self._h
        self._touching.clear()


def _can_turn(body: pymunk.Body) -> bool:
    """Return whether a torque turns a body."""
    return body.body_type == pymunk.Body.DYNAMIC and math.isfinite(body.moment)
