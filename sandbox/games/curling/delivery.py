"""Delivery: how a stone has to be let go to come to a place, by the closed form of a puck that curls.

As complex numbers a stone that leaves at v goes v² / (μg) · (1 − s^(2−iκ)) / (2 − iκ), s the share of its speed that is
left; `engines.tabletop.motion` says where that is from. So where it stops, what it takes to get there is known at once;
and for a stone that only passes a place, the share of its speed there is sought.
"""

import cmath
import math
from typing import NamedTuple

from sandbox.games.curling.sheet import RELEASE
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Floor

SPIN = 1.0
"""rad/s with which stones are let go: some two turns and a half until they rest"""
CLOSE = 1e-12
"""Share of the speed to which that at a place is sought."""


class Delivery(NamedTuple):
    """How a stone is let go."""

    speed: float
    """m/s"""
    heading: float
    """rad, from the way along the sheet, to its left"""
    turn: int
    """1 turns anti-clockwise and curls to the left, −1 the other way"""

    @property
    def velocity(self) -> tuple[float, float]:
        """m/s at first."""
        return self.speed * math.cos(self.heading), self.speed * math.sin(self.heading)

    @property
    def spin(self) -> float:
        """rad/s at first."""
        return self.turn * SPIN


class Ice(NamedTuple):
    """What a sheet does to stones."""

    slowing: float
    """μ·g, m/s²"""
    curl: float
    """κ"""

    @classmethod
    def of(cls, floor: Floor) -> "Ice":
        """Return that of a scene's floor."""
        return cls(floor.sliding_friction * floor.gravity, floor.curl)

    def way(self, delivery: Delivery, share: float) -> complex:
        """Return how far a stone has come when a share of its speed is left, m, along the sheet and to its left."""
        power = 2.0 - 1j * self.curl * delivery.turn
        gone = 1.0 - (cmath.exp(power * math.log(share)) if share > 0.0 else 0.0)
        return delivery.speed**2 / self.slowing * gone / power * cmath.exp(1j * delivery.heading)

    def speed_for(self, distance: float) -> float:
        """Return the speed with which a stone comes to rest so far away as the crow flies, m/s."""
        return math.sqrt(distance * self.slowing * abs(2.0 - 1j * self.curl))

    def to_rest(self, target: Point, turn: int) -> Delivery:
        """Return the delivery after which a stone comes to rest at a place, m."""
        far = complex(target[0] - RELEASE, target[1])
        speed = self.speed_for(abs(far))
        return self._turned(Delivery(speed, 0.0, turn), far, 0.0)

    def through(self, target: Point, turn: int, speed: float) -> Delivery:
        """Return the delivery with a speed, m/s, that passes a place, m; or comes to rest there, if it is too slow."""
        far = complex(target[0] - RELEASE, target[1])
        straight = Delivery(speed, 0.0, turn)
        if abs(self.way(straight, 0.0)) <= abs(far):
            return self.to_rest(target, turn)
        low, high = 0.0, 1.0  # the distance grows as the share falls
        while high - low > CLOSE:
            middle = 0.5 * (low + high)
            if abs(self.way(straight, middle)) > abs(far):
                low = middle
            else:
                high = middle
        return self._turned(straight, far, high)

    def _turned(self, delivery: Delivery, far: complex, share: float) -> Delivery:
        """Return a delivery headed so that its way leads to a place."""
        way = self.way(delivery, share)
        # not `cmath.phase`, which raises where an angle is too small for a float
        heading = math.atan2(far.imag, far.real) - math.atan2(way.imag, way.real)
        return delivery._replace(heading=heading)
