"""Rolling resistance on pymunk: a motor at rest between the two bodies of each contact of a ball.

Munk2D solves the motor together with the contacts, so that a ball rests on a slope that is not steeper than its rolling
resistance. The largest torque of the motor follows from the normal impulse of the last substep, as that of the present
one is known only at its end: at a landing it is one substep late.
"""

import math
from typing import Any, NamedTuple

import pymunk
from pymunk._chipmunk_cffi import lib

from sandbox.scene.compile.contacts import ContactMatrix

_Pair = tuple[int, int]
"""ids of two bodies, ascending"""


class RollingShapes(NamedTuple):
    """Two shapes at whose contact rolling resistance acts."""

    bodies: _Pair
    reach: float
    """c·r, m"""


class SpaceRolling:
    """Rolling resistance of the balls of a space."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self._coefficients: dict[tuple[int, int], float] = {}
        self._radius: dict[int, float] = {}
        self._known: dict[tuple[pymunk.Shape, pymunk.Shape], RollingShapes | None] = {}
        self._bodies: dict[_Pair, tuple[pymunk.Body, pymunk.Body]] = {}
        self._impulses: dict[_Pair, float] = {}
        self._motors: dict[_Pair, pymunk.SimpleMotor] = {}
        self.resisted: set[int] = set()
        """ids of the bodies on which a motor acted in the last substep"""

    @property
    def is_active(self) -> bool:
        """Whether a pair of surfaces has rolling resistance."""
        return any(self._coefficients.values())

    def rebuild(self, matrix: ContactMatrix) -> None:
        """Set the coefficients of all pairs of surfaces that can touch."""
        rolling = matrix.surfaces.rolling
        self._known.clear()
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
        self._known.clear()

    def leave(self, body: pymunk.Body) -> None:
        """Remove the motors of a body that leaves the space, or that a zone holds or releases."""
        self._known.clear()
        self._bodies = {pair: bodies for pair, bodies in self._bodies.items() if body.id not in pair}
        self._impulses = {pair: impulse for pair, impulse in self._impulses.items() if body.id not in pair}
        for pair in [pair for pair in self._motors if body.id in pair]:
            self._space.remove(self._motors.pop(pair))

    def _record(self, arbiter: pymunk.Arbiter, _: pymunk.Space, surfaces: Any) -> None:
        """Record the largest angular impulse of a contact, N·m·s, by its normal impulse in the present substep."""
        shapes = arbiter.shapes
        if shapes not in self._known:
            self._known[shapes] = self._between(*shapes, self._coefficients[surfaces])
        known = self._known[shapes]
        if known is not None:
            impulse, normal = lib.cpArbiterTotalImpulse(arbiter._arbiter), lib.cpArbiterGetNormal(arbiter._arbiter)
            along = abs(impulse.x * normal.x + impulse.y * normal.y)
            self._impulses[known.bodies] = self._impulses.get(known.bodies, 0.0) + known.reach * along

    def _between(self, first: pymunk.Shape, second: pymunk.Shape, coefficient: float) -> RollingShapes | None:
        """Return the rolling resistance between two shapes; None if nothing can turn, or no ball is among them."""
        a, b = first.body, second.body
        assert a is not None and b is not None
        reach = coefficient * max(self._radius.get(a.id, 0.0), self._radius.get(b.id, 0.0))
        if not reach or not (_can_turn(a) or _can_turn(b)):
            return None
        pair = min(a.id, b.id), max(a.id, b.id)
        self._bodies[pair] = a, b
        return RollingShapes(pair, reach)

    def update(self) -> None:
        """Set the motors of the next substep by the contacts of the last one."""
        self.resisted = {body for pair in self._motors for body in pair}
        for pair in [pair for pair in self._motors if pair not in self._impulses]:
            self._space.remove(self._motors.pop(pair))
        for pair, impulse in self._impulses.items():
            motor = self._motors.get(pair)
            if motor is None:
                static = self._space.static_body
                first, second = (
                    static if each.body_type == pymunk.Body.STATIC else each for each in self._bodies[pair]
                )
                self._motors[pair] = motor = pymunk.SimpleMotor(first, second, 0.0)
                self._space.add(motor)
            lib.cpConstraintSetMaxForce(motor._constraint, impulse / self._h)
        self._impulses.clear()


def _can_turn(body: pymunk.Body) -> bool:
    """Return whether a torque turns a body."""
    return body.body_type == pymunk.Body.DYNAMIC and math.isfinite(body.moment)
