"""Hinge: a drive by torque in a pymunk space.

A substep: the torque ramps and the body glides between its stops (`driving/torque.py`); pymunk finds what it meets
there, kicks it to its new speed, and solves contacts. A body that is pressed onto a stop is held there by a one-sided
limit which pymunk solves together with the contacts. Where all that it meets presses it onto its stop as well, it is
immovable for that substep: contact and limit in turn would not get there in 10 iterations.
"""

import math
from typing import Any

import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.engines.driving.arc import heaviness
from sandbox.engines.driving.torque import Torque
from sandbox.engines.native.axle import Axle, Start
from sandbox.scene.drives import TorqueDrive

WIDE = 1e12
"""rad: bounds that no body reaches, for a limit that is off"""

BARELY = 1e-300
"""rad/s: a limit holds only while it has something to put right; this is as good as nothing"""

STILL = 1e-9
"""rad/s that rounding leaves to a body that is pressed onto its stop"""


class Hinge(Axle):
    """A body on a hinge, driven by a torque."""

    def __init__(self, start: Start, ground: pymunk.Body) -> None:
        """Go on from a start; the ground is the space's own body."""
        super().__init__(start)
        assert isinstance(start.mount.drive, TorqueDrive)
        self.moment, self._mass = float(start.body.moment), start.mass
        self._law, self.torque = Torque(start.mount.drive, self.moment), start.state[1]
        self._sense, rest = self._law.sense, self._law.rest
        self._angles = rest - WIDE, rest + WIDE
        self.limit = pymunk.RotaryLimitJoint(ground, self.body, *self._angles)
        self.limit.max_bias = BARELY
        self._armed = 0
        self.at = 0
        """the stop onto which it is pressed: −1, 1 or 0"""
        self._stiff, self._off, self._met, self._shifted = False, False, False, False
        self.stuck = False
        """it was immovable in the last substep"""
        self._gravity = (0.0, 0.0)
        self._weight: Any = (0.0, 0.0)
        self._settled = False  # at rest on a stop, where all goes on as in the last substep
        self.kick = self.fall = 0.0
        """N·m, all but contacts and the limit, and of that its weight"""
        lib.cpBodySetAngularVelocity(self._record, self.spin)

    def weigh(self, gravity: tuple[float, float], ground: tuple[float, float]) -> None:
        """Say which gravity acts from now on, m/s², and with which the space itself kicks all bodies."""
        balance = -ground[0] * self.body.mass, -ground[1] * self.body.mass
        self._gravity, self._weight = gravity, ffi.new("cpVect *", balance)[0]  # once: a tuple takes 0.15 µs more
        self._settled = False

    def set(self, level: float) -> None:
        """Ask for another level from now on."""
        self.level, self._settled = level, False

    def before(self) -> None:
        """Prepare the body for a substep."""
        lib.cpBodySetForce(self._record, self._weight)
        if self.spin or not self._settled:
            self._move()
        lib.cpBodySetTorque(self._record, self.kick)
        self._off = self._met = False

    def _move(self) -> None:
        h, law = self._h, self._law
        self.fall = heaviness(self.mount.hinge, self.angle, self._mass, self._gravity)
        angle, spin, self.at, press, self.torque, steady = law.turn(
            self.angle, self.spin, self.torque, self.level, self.fall, h
        )
        self._aim(angle, self.spin)
        self.kick = self.moment * (spin - self.spin) / h
        if self.at:
            self.kick += press
        self._settled = self.at != 0 and steady and not self.spin and angle == self.angle
        self._arm(self.at)
        self.angle = angle

    def _arm(self, at: int) -> None:
        """Let the limit hold at a stop, or at none."""
        if at == self._armed:
            return
        self._armed = at
        low, high = self._angles
        way = at * self._sense
        self.limit.min, self.limit.max = low + 2.0 * WIDE * (way < 0), high - 2.0 * WIDE * (way > 0)

    def met(self, arbiter: pymunk.Arbiter, first: bool) -> None:
        """Look at what the body is about to meet, as the first or as the second of the two."""
        self._met = True
        if not self.at:
            return
        nx, ny = arbiter.normal
        way = self.at * self._sense * (-1.0 if first else 1.0)
        x, y = self._seat
        onto = all(
            way * ((p.point_a[0] - x) * ny - (p.point_a[1] - y) * nx) >= 0.0 for p in arbiter.contact_point_set.points
        )
        if onto and not (self._off or self._stiff):
            self._stiff = True
            lib.cpBodySetAngularVelocity(self._record, 0.0)
            lib.cpBodySetMoment(self._record, math.inf)
            self._arm(0)  # of two that cannot be turned the limit would make nan
        elif not onto:
            self._off = True
            self._soften()

    def _soften(self) -> None:
        if self._stiff:
            self._stiff = False
            lib.cpBodySetMoment(self._record, self.moment)
            self._arm(self.at)

    def after(self) -> None:
        """Look what has become of the body."""
        if self._settled and not (self._met or self._shifted):
            return  # the limit leaves it no speed but rounding
        self.stuck = self._stiff
        self._soften()
        spin = lib.cpBodyGetAngularVelocity(self._record)
        if self.at and abs(spin) <= STILL:
            if spin:
                lib.cpBodySetAngularVelocity(self._record, 0.0)
            spin = 0.0
        self.spin = spin
        if self._met or self._shifted:  # pymunk turns it out of what overlaps it, in the substep after
            lib.cpBodySetAngle(self._record, self.angle)
            self._shifted = self._met

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, torque in N·m, nothing."""
        return self.level, self.torque, 0.0

    @property
    def given(self) -> float:
        """What drive and stops gave in the last substep but for the weight, N·m·s; unknown while it is immovable."""
        held = -self.at * self._sense * abs(self.limit.impulse)
        return (self.kick - self.fall) * self._h + held
