"""Lead: a body that a drive holds, as a stage has it. What turns about a hinge has its hinge for a centre there.

So contacts have their levers from the hinge: its mass nothing can move, and about it the body has one moment.
"""

from abc import ABC, abstractmethod

import numpy as np

from sandbox.engines.driving.arc import about, heaviness, seated
from sandbox.engines.driving.plunger import along, placed, pulled
from sandbox.engines.driving.stroke import struck
from sandbox.engines.driving.torque import Torque, Turned
from sandbox.engines.reference.motion import State
from sandbox.engines.roster import Roster
from sandbox.scene.driven import Mount, about_hinge
from sandbox.scene.drives import PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray

STILL = 1e-9
"""rad/s that rounding leaves to a body that is pressed onto its stop"""


class Lead(ABC):
    """What all of them have. A substep: `plan`, `begin`, `place`; after contacts, `done`."""

    def __init__(self, roster: Roster, number: int, mount: Mount) -> None:
        self.number, self.mount = number, mount
        self.mass = float(roster.bodies.mass[number])
        self.moment = about_hinge(mount, self.mass, float(roster.bodies.moment[number]))
        """of inertia about the hinge, kg·m²"""
        self.gravity: Point = roster.scene.world.gravity
        self.state: FloatArray = roster.drives[mount.number]
        """(3,) of its drive, as a frame tells it; written to"""
        drive = mount.drive
        self._seat = mount.home if isinstance(drive, PlungerDrive) else drive.pivot

    @abstractmethod
    def plan(self, x: State, h: float) -> None:
        """Work out where h, s, brings the body from a state (2, N, 3), as if it met nothing."""

    @abstractmethod
    def begin(self, x: State) -> None:
        """Write the velocity into a state that the body has through the planned substep."""

    def glide(self, x: State, h: float) -> None:
        """Write the velocity into a state with which it gets to the end of the planned substep of h, s, evenly."""
        n = self.number
        end = np.zeros_like(x)
        self.place(end)
        x[1, n] = (end[0, n] - x[0, n]) / h

    @abstractmethod
    def place(self, moved: State) -> None:
        """Write the end of the planned substep into a state."""

    @abstractmethod
    def done(self, after: State) -> None:
        """Take the planned substep as done; its contacts are resolved."""

    def enter(self, x: State) -> None:
        """Write the hinge into a state, in the place of the centre of mass."""
        n = self.number
        x[0, n, 0], x[0, n, 1] = self._seat
        x[1, n, 0] = x[1, n, 1] = 0.0

    def centre(self, pose: FloatArray, rate: FloatArray) -> tuple[Point, Point]:
        """Return where the centre of mass is, m, and how fast, m/s, by poses and rates (N, 3)."""
        return seated(self.mount.hinge, self._seat, float(pose[self.number, 2]), float(rate[self.number, 2]))

    def kinetic(self, rate: FloatArray) -> float:
        """Return its kinetic energy, J, by rates (N, 3)."""
        return 0.5 * self.moment * float(rate[self.number, 2]) ** 2

    def height(self, pose: FloatArray) -> float:
        """Return what gravity stores in it, J, but for a constant."""
        x, y = about(self.mount.hinge, float(pose[self.number, 2]))
        return -self.mass * (self.gravity[0] * x + self.gravity[1] * y)


class Hinge(Lead):
    """A body on a hinge, driven by a torque."""

    turned: Turned
    fall: float
    """torque of its weight in the planned substep, N·m"""

    def __init__(self, roster: Roster, number: int, mount: Mount) -> None:
        super().__init__(roster, number, mount)
        assert isinstance(mount.drive, TorqueDrive)
        self._law = Torque(mount.drive, self.moment)
        self._h = 0.0
        self._planned = 0.0, 0.0, 0.0, 0.0  # angle, spin, torque of the drive, its level
        self._held = 0, 0.0, 0.0  # by a stop: at which, N·m·s, in which time
        self._low, self._high = sorted(mount.drive.stops)

    @property
    def way(self) -> float:
        """In which sense the planned substep presses it onto a stop: 1, −1, or 0 for none."""
        return self.turned.at * self._law.sense

    @property
    def given(self) -> float:
        """What the stop gives to begin with, N·m·s: what it gave before, never more by time than then."""
        at, impulse, h = self._held
        return impulse * min(self._h / h, 1.0) if at and at == self.turned.at else 0.0

    def hold(self, given: float) -> None:
        """Remember what the stop gave."""
        self._held = self.turned.at, given, self._h

    def follow(self, old: "Hinge") -> None:
        """Go on where another left off, with what its stop gave."""
        self._held = old._held

    def plan(self, x: State, h: float) -> None:
        """Let the torque ramp, and the body glide."""
        level, torque, _ = self.state.tolist()
        angle, spin = float(x[0, self.number, 2]), float(x[1, self.number, 2])
        self.fall = heaviness(self.mount.hinge, angle, self.mass, self.gravity)
        self._planned = angle, spin, torque, level
        self.turned, self._h = self._law.turn(*self._planned, self.fall, h), h

    def begin(self, x: State) -> None:
        """Leave it the velocity that it has: its torque is a force among the others."""

    def place(self, moved: State) -> None:
        """Write the end of the planned substep; what presses onto a stop is a spin for that to take away."""
        n, turned = self.number, self.turned
        self.enter(moved)
        moved[0, n, 2] = turned.angle
        moved[1, n, 2] = turned.spin + turned.press * self._h / self.moment

    @property
    def stands(self) -> bool:
        """It is pressed onto a stop from beginning to end of the planned substep."""
        return self.turned.at != 0 and not self._planned[1] and self._planned[0] == self.turned.angle

    def sprung(self, spun: float) -> bool:
        """Take what springs did to the spin in the planned substep, rad/s, as a torque among the others.

        Return whether that leaves it pressed onto a stop on which it stands.
        """
        stood = self.stands
        turned = self._law.turn(*self._planned, self.fall + self.moment * spun / self._h, self._h)
        self.turned = turned._replace(press=0.0)
        return stood and self.stands

    def done(self, after: State) -> None:
        """Stay between the stops, where a contact had a part in the way, and at rest on one."""
        n = self.number
        after[0, n, 2] = min(max(after[0, n, 2], self._low), self._high)
        if self.turned.at and abs(after[1, n, 2]) <= STILL:
            after[1, n, 2] = 0.0
        self.state[1] = self.turned.torque


class Stroke(Lead):
    """A body on a hinge that turns at a rate."""

    def plan(self, x: State, h: float) -> None:
        """Turn."""
        assert isinstance(self.mount.drive, StrokeDrive)
        self._planned = struck(self.mount.drive, float(self.state[0]), float(x[0, self.number, 2]), h)

    def begin(self, x: State) -> None:
        """Turn at the rate from the first."""
        x[1, self.number, 2] = self._planned.spin

    def place(self, moved: State) -> None:
        """Write the end of the planned substep."""
        self.enter(moved)
        moved[0, self.number, 2], moved[1, self.number, 2] = self._planned.angle, self._planned.spin

    def done(self, after: State) -> None:
        """Stand still once a stop is reached."""
        if self._planned.arrives:
            after[1, self.number, 2] = 0.0


class Plunger(Lead):
    """A body that is drawn back along a line, and springs forward. Its centre is its own."""

    def __init__(self, roster: Roster, number: int, mount: Mount) -> None:
        super().__init__(roster, number, mount)
        assert isinstance(mount.drive, PlungerDrive)
        self._drive, self._along = mount.drive, along(mount.drive)

    def plan(self, x: State, h: float) -> None:
        """Draw it, or let it spring; which of the two its level says."""
        del x
        level, pull, rate = self.state.tolist()
        self._planned = pulled(self._drive, level, pull, rate, h)

    def enter(self, x: State) -> None:
        """Leave it where it is."""

    def begin(self, x: State) -> None:
        """Go as fast as at the end from the first."""
        x[1, self.number, :2] = self._where()[1]

    def _where(self) -> tuple[Point, Point]:
        return placed(self._seat, self._along, self._planned.pull, self._planned.rate)

    def place(self, moved: State) -> None:
        """Write the end of the planned substep."""
        n = self.number
        moved[0, n, :2], moved[1, n, :2] = self._where()
        moved[1, n, 2] = 0.0

    def done(self, after: State) -> None:
        """Stand still once the body is where it has to be."""
        rate = 0.0 if self._planned.arrives else self._planned.rate
        if not rate:
            after[1, self.number, :2] = 0.0
        self.state[1:] = self._planned.pull, rate

    def centre(self, pose: FloatArray, rate: FloatArray) -> tuple[Point, Point]:
        """Return where it is, m, and how fast, m/s."""
        x, y = pose[self.number, :2].tolist()
        vx, vy = rate[self.number, :2].tolist()
        return (x, y), (vx, vy)

    def kinetic(self, rate: FloatArray) -> float:
        """Return its kinetic energy, J, by rates (N, 3)."""
        return 0.5 * self.mass * float(rate[self.number, 0] ** 2 + rate[self.number, 1] ** 2)

    def height(self, pose: FloatArray) -> float:
        """Return what gravity stores in it, J, but for a constant."""
        return -self.mass * float(np.dot(self.gravity, pose[self.number, :2]))


def lead_of(roster: Roster, number: int, mount: Mount) -> Lead:
    """Return what leads a body of that number."""
    kinds: dict[str, type[Hinge] | type[Stroke] | type[Plunger]]
    kinds = {"torque": Hinge, "stroke": Stroke, "plunger": Plunger}
    return kinds[mount.drive.kind](roster, number, mount)
