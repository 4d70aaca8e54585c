"""Delivery of a curling stone: speed and heading that reach a target, by the closed-form path of a curling puck.

Displacements are complex numbers: real along the heading at release, imaginary to its left. A stone released at speed v
is displaced by v² / (μg) · (1 − s^(2−iκ)) / (2 − iκ), where s is the remaining fraction of its speed, for a stone that
turns anticlockwise; `sandbox.engines.tabletop.motion` derives it. The delivery that comes to rest at a point follows
directly. For a delivery that passes a point, s at the point is found by bisection.
"""

import cmath
import math
from typing import NamedTuple

from sandbox.games.curling.sheet import RELEASE
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Floor

RELEASE_SPIN = 1.0
"""rad/s at release: about two and a half turns until the stone rests"""
FRACTION_TOLERANCE = 1e-12
"""tolerance of the bisection for the fraction of the speed: above the rounding error of 1e-16"""


class Delivery(NamedTuple):
    """Release of a stone."""

    speed: float
    """m/s"""
    heading: float
    """rad, anticlockwise from the direction along the sheet"""
    turn: int
    """1: turns anticlockwise and curls to the left; −1: clockwise and to the right"""

    @property
    def velocity(self) -> tuple[float, float]:
        """m/s, at release."""
        return self.speed * math.cos(self.heading), self.speed * math.sin(self.heading)

    @property
    def spin(self) -> float:
        """rad/s, at release."""
        return self.turn * RELEASE_SPIN


class Ice(NamedTuple):
    """Properties of the ice."""

    slowing: float
    """μ·g, m/s²"""
    curl: float
    """κ"""

    @classmethod
    def of(cls, floor: Floor) -> "Ice":
        """Return the ice of a surface."""
        return cls(floor.sliding_friction * floor.gravity, floor.curl)

    def displacement(self, delivery: Delivery, fraction: float) -> complex:
        """Return the displacement from the release, m, at a remaining fraction of the speed: x + iy."""
        power = 2.0 - 1j * self.curl * delivery.turn
        gone = 1.0 - (cmath.exp(power * math.log(fraction)) if fraction > 0.0 else 0.0)
        return delivery.speed**2 / self.slowing * gone / power * cmath.exp(1j * delivery.heading)

    def speed_for(self, distance: float) -> float:
        """Return the speed, m/s, of a stone that comes to rest at a straight-line distance, m, from its release."""
        return math.sqrt(distance * self.slowing * abs(2.0 - 1j * self.curl))

    def distance_for(self, speed: float) -> float:
        """Return the straight-line distance from its release, m, at which a stone of a speed, m/s, comes to rest."""
        return speed**2 / (self.slowing * abs(2.0 - 1j * self.curl))

    def to_rest(self, target: Point, turn: int) -> Delivery:
        """Return the delivery of a stone that comes to rest at a position, m."""
        target_offset = complex(target[0] - RELEASE, target[1])
        speed = self.speed_for(abs(target_offset))
        return self._with_heading(Delivery(speed, 0.0, turn), target_offset, 0.0)

    def through(self, target: Point, turn: int, speed: float) -> Delivery:
        """Return the delivery with a speed, m/s, that passes a position, m; if it is too slow, as `to_rest`."""
        target_offset = complex(target[0] - RELEASE, target[1])
        straight = Delivery(speed, 0.0, turn)
        if abs(self.displacement(straight, 0.0)) <= abs(target_offset):
            return self.to_rest(target, turn)
        low, high = 0.0, 1.0  # the distance increases as the fraction decreases
        while high - low > FRACTION_TOLERANCE:
            middle = 0.5 * (low + high)
            if abs(self.displacement(straight, middle)) > abs(target_offset):
                low = middle
            else:
                high = middle
        return self._with_heading(straight, target_offset, high)

    def _with_heading(self, delivery: Delivery, target_offset: complex, fraction: float) -> Delivery:
        """Return a delivery with the heading that leads in the direction of a target, at a fraction of the speed."""
        displacement = self.displacement(delivery, fraction)
        # not `cmath.phase`, which raises where an angle is too small for a float
        heading = math.atan2(target_offset.imag, target_offset.real) - math.atan2(displacement.imag, displacement.real)
        return delivery._replace(heading=heading)
