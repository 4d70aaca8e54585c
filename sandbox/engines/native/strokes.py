"""Strokes: drives that nothing stops, in a pymunk space, where what they move is kinematic."""

from pymunk._chipmunk_cffi import lib

from sandbox.engines.driving.plunger import along, asked, placed, pulled
from sandbox.engines.driving.stroke import struck
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
        angle, spin, self._arrives = struck(self._drive, self.level, self.angle, self._h)
        if not spin:
            if self.spin:
                self._halt()
            return
        if spin != self.spin:
            self.spin = spin
            lib.cpBodySetAngularVelocity(self._record, spin)
        self.angle = angle
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
        self._along = along(self._drive)
        _, self.pull, self.rate = start.state
        """how far it is drawn back, m, and how fast that grows, m/s"""
        lib.cpBodySetVelocity(self._record, self.velocity)

    def set(self, level: float) -> None:
        """Ask for another level from now on."""
        self.level, self.rate = level, asked(self.level, level, self.rate)

    def before(self) -> None:
        """Prepare the body for a substep."""
        if self.pull == self.level * self._drive.travel and not self.rate:  # it stands where it has to
            self._arrives = False
            return
        h = self._h
        self.pull, self.rate, self._arrives = pulled(self._drive, self.level, self.pull, self.rate, h)
        self.place, self.velocity = placed(self.mount.home, self._along, self.pull, self.rate)
        (x, y), (vx, vy) = self.place, self.velocity
        lib.cpBodySetPosition(self._record, (x - vx * h, y - vy * h))
        lib.cpBodySetVelocity(self._record, (vx, vy))

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
