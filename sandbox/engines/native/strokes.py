"""Strokes: drives that nothing stops, in a pymunk space, where what they move is kinematic."""

import math

from pymunk._chipmunk_cffi import lib

from sandbox.engines.native.axle import Axle, Start
from sandbox.scene.drives import PlungerDrive, StrokeDrive


class Stroke(Axle):
    """A body on a hinge that turns at a rate."""

    def __init__(self, start: Start) -> None:
        """Go on from a start."""
        super().__init__(start)
        assert isinstance(start.mount.drive, StrokeDrive)
        self._drive, self._arrives = start.mount.drive, False
        lib.cpBodySetAngularVelocity(self._record, self.spin)

    def before(self) -> None:
        """Prepare the body for a substep."""
        drive, pressed = self._drive, self.level > 0.0
        stop = drive.stops[pressed]
        left = stop - self.angle
        rate = drive.rate if pressed or drive.return_rate is None else drive.return_rate
        self._arrives = abs(left) <= rate * self._h
        if not left or not rate:
            if self.spin:
                self._halt()
            return
        spin = math.copysign(rate, left)
        if spin != self.spin:
            self.spin = spin
            lib.cpBodySetAngularVelocity(self._record, spin)
        self.angle = stop if self._arrives else self.angle + spin * self._h
        self._aim(self.angle, spin)

    def after(self) -> None:
        """Stand still once a stop is reached."""
        if self._arrives and self.spin:
            self._halt()

    def _halt(self) -> None:
        self.spin = 0.0
        lib.cpBodySetAngularVelocity(self._record, 0.0)


class Plunger(Axle):
    """A body that is drawn back along a line, and springs forward."""

    def __init__(self, start: Start) -> None:
        """Go on from a start."""
        super().__init__(start)
        assert isinstance(start.mount.drive, PlungerDrive)
        self._drive, self._arrives = start.mount.drive, False
        x, y = self._drive.direction
        length = math.hypot(x, y)
        self._ux, self._uy = x / length, y / length
        _, self.pull, self.rate = start.state
        """how far it is drawn back, m, and how fast that grows, m/s"""
        lib.cpBodySetVelocity(self._record, self.velocity)

    def set(self, level: float) -> None:
        """Ask for another level from now on; a hand that lets go has stood still."""
        if not level > 0.0 and self.level > 0.0:
            self.rate = 0.0
        self.level = level

    def before(self) -> None:
        """Prepare the body for a substep."""
        wanted = self.level * self._drive.travel
        if self.pull == wanted:  # which no spring has reached that was not halted there
            self._arrives = False
            return
        if wanted > 0.0:
            self._draw(wanted)
        else:
            self._spring()
        x, y = self.mount.home
        vx, vy = 0.0 - self.rate * self._ux, 0.0 - self.rate * self._uy  # never −0
        self.place, self.velocity = (x - self.pull * self._ux, y - self.pull * self._uy), (vx, vy)
        lib.cpBodySetPosition(self._record, (self.place[0] - vx * self._h, self.place[1] - vy * self._h))
        lib.cpBodySetVelocity(self._record, (vx, vy))

    def _draw(self, wanted: float) -> None:
        """Go towards the wanted pull, m, as fast as a hand does."""
        rate = self._drive.travel / self._drive.draw_time
        self.rate = math.copysign(rate, wanted - self.pull)
        self._arrives = abs(wanted - self.pull) <= rate * self._h
        self.pull = wanted if self._arrives else self.pull + self.rate * self._h

    def _spring(self) -> None:
        """Spring forward for a substep, or onto the stop, at the speed of that moment."""
        omega = self._drive.speed / self._drive.travel
        cos, sin = math.cos(omega * self._h), math.sin(omega * self._h)
        pull, rate = self.pull, self.rate
        self.pull, self.rate = pull * cos + rate / omega * sin, rate * cos - pull * omega * sin
        self._arrives = self.pull <= 0.0
        if self._arrives:
            self.pull, self.rate = 0.0, -math.hypot(pull * omega, rate)

    def after(self) -> None:
        """Stand still once the body is where it has to be."""
        if self._arrives:
            self.rate, self.velocity = 0.0, (0.0, 0.0)
            lib.cpBodySetVelocity(self._record, (0.0, 0.0))

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, pull in m, and how fast that grows, m/s."""
        return self.level, self.pull, self.rate

    def settle(self) -> None:
        """Its place is known at any time."""
