"""Axle: a body in a space that a drive holds, and how pymunk is made to move it where its drive wants it.

A space moves bodies by their old velocity and kicks them afterwards. So before each step a driven body is put back
from where it has to be by as much as that will carry it; what it meets, meets it there, at its speed.
"""

from typing import Any, NamedTuple

import pymunk
from pymunk._chipmunk_cffi import lib

from sandbox.engines.driving.arc import seated
from sandbox.scene.driven import Mount
from sandbox.scene.drives import PlungerDrive

HEAVY = 2.0**100
"""kg, which nothing moves: the mass of what turns on a hinge. A power of 2, so that its weight is balanced exactly."""


def on_axle(mount: Mount, angle: float, place: tuple[float, float], kind: int, moment: float) -> pymunk.Body:
    """Return a body whose centre of gravity, as far as pymunk knows, is its hinge: about which it turns exactly.

    Args:
        mount: how it is held.
        angle: rad.
        place: of its own centre of mass, m.
        kind: pymunk's: dynamic, or kinematic.
        moment: of inertia about the hinge, kg·m².
    """
    dynamic = kind == pymunk.Body.DYNAMIC
    body = pymunk.Body(HEAVY, moment) if dynamic else pymunk.Body(body_type=kind)
    body.center_of_gravity = mount.hinge
    body.angle = angle
    body.position = place
    return body


class Start(NamedTuple):
    """What a driven body begins with, or goes on with."""

    number: int
    """of the body"""
    mount: Mount
    body: pymunk.Body
    """in the space"""
    mass: float
    """kg"""
    place: tuple[float, float]
    """of its centre of mass, m"""
    velocity: tuple[float, float]
    """m/s"""
    angle: float
    spin: float
    """rad/s"""
    state: tuple[float, float, float]
    """of its drive: level, torque or pull, pace"""
    h: float
    """the substep, s"""


class Axle:
    """A driven body: which one, and where it is, beside what the space knows of it."""

    def __init__(self, start: Start) -> None:
        self.number, self.mount, self.body, self._h = start.number, start.mount, start.body, start.h
        self._record: Any = start.body._body
        self.level = start.state[0]
        self.angle, self.spin = start.angle, start.spin
        self.place, self.velocity = start.place, start.velocity
        """of its centre of mass, m and m/s"""
        drive = start.mount.drive
        self._seat = start.mount.home if isinstance(drive, PlungerDrive) else drive.pivot

    def before(self) -> None:
        """Prepare the body for a substep."""

    def after(self) -> None:
        """Look what has become of it."""

    def set(self, level: float) -> None:
        """Ask for another level from now on."""
        self.level = level

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, torque or pull, pace: as a frame tells them of a drive."""
        return self.level, 0.0, 0.0

    def settle(self) -> None:
        """Work out where the centre of mass of a body on a hinge is, and how fast."""
        self.place, self.velocity = seated(self.mount.hinge, self._seat, self.angle, self.spin)

    def seated(self, angle: float, spin: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return where the centre of mass is at an angle, rad, and how fast at a spin, rad/s: m and m/s."""
        return seated(self.mount.hinge, self._seat, angle, spin)

    def _aim(self, angle: float, spin: float) -> None:
        """Have the next step bring the body to an angle, by a rate that it has meanwhile."""
        lib.cpBodySetAngle(self._record, angle - spin * self._h)
