"""What actions do to the bodies of a pymunk run, one at a time."""

import math

import numpy as np

from sandbox.action import ActionError
from sandbox.engines.native.crowds import check_crowd
from sandbox.engines.native.free import FreeFlight
from sandbox.engines.native.meeting import MeetingBodies
from sandbox.engines.native.population import Population
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Collides, Scene, Single
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray


class NativeCast:
    """The population as `engines.cast.Cast` wants it."""

    def __init__(self, population: Population) -> None:
        self._all = population

    @property
    def scene(self) -> Scene:
        """What runs, with all that was set since."""
        return self._all.scene

    @property
    def bodies(self) -> Bodies:
        """The bodies by number; spawned ones at the end."""
        return self._all.bodies

    @property
    def h(self) -> float:
        """The substep, s."""
        return self._all.h

    @property
    def present(self) -> BoolArray:
        """(N,) which bodies are there."""
        return self._all.present

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a changed scene, as `Population.change`."""
        self._all.change(scene, spawned)

    def add(self, single: Single, name: str) -> int:
        """Add a body and return its number, as `Population.add`."""
        return self._all.add(single, name)

    def motion(self, number: int) -> tuple[FloatArray, float]:
        """Return a body's velocity (2,), m/s, and angular velocity, rad/s."""
        self._all.refresh()
        return self._all.velocity[number] - self._all.ahead, float(self._all.angular_velocity[number])

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._plays(number):
            self._all.velocity[number] = velocity
        else:
            self._free(number)
            self._home(number).set_velocity(number, velocity + self._all.ahead)

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._plays(number):
            self._all.angular_velocity[number] = spin
        else:
            self._home(number).set_spin(number, spin)

    def set_roll(self, number: int, roll: tuple[float, float]) -> None:
        """Give a ball on a floor an angular velocity about x and y, rad/s; on one that asks for nothing it is none.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._plays(number):
            self._all.roll[number] = roll

    def _free(self, number: int) -> None:
        """Let a body go that a zone holds."""
        if self._all.visiting is not None:
            self._all.visiting.free(number)

    def _plays(self, number: int) -> bool:
        """Tell whether a body is a ball on a floor.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._all.felt is None:
            return False
        if self._all.pocketed(number):
            raise ActionError(f"{self._all.bodies.names[number]!r} lies in a pocket; move it back into play first")
        return True

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._plays(number)
        if force.any() or torque:
            self._free(number)
        half = self._home(number)
        if torque and half is self._all.meeting and not math.isfinite(half.moment(number)):
            half.give_moment(number, float(self._all.bodies.moment[number]))
        half.push(number, force, torque)

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        self._all.refresh()
        self._all.position[number] = position
        if self._all.felt is not None and self._all.pocketed(number):
            self._all.felt.free(number)
            self._all.place(np.asarray([number]))
            return
        self._free(number)
        half = self._all.half_of(number)
        if half is not None:
            half.set_position(number, position)
        if self._all.visiting is not None:
            self._all.visiting.put(number)

    def _home(self, number: int) -> FreeFlight | MeetingBodies:
        return self._all.free if self._all.free.holds(number) else self._all.meeting

    def throttle(self, number: int, level: float) -> None:
        """Open the scene's thrust of that number to a share of its force."""
        self._all.meeting.field.level[number] = level

    def drive(self, number: int, level: float) -> None:
        """Ask the scene's drive of that number for a level."""
        self._all.meeting.drives.set(number, level)

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Refuse a place that pymunk cannot start from.

        Raises:
            ActionError: it lies out of reach, or in a crowd.
        """
        place = np.asarray(position)
        self._all.refresh()
        if not self._all.meeting.reaches(place):
            raise ActionError(f"{position} m is out of reach: pymunk's half-planes end before it")
        check_crowd(place, radius, collides, self._all.position, self._all.bodies, self._all.present)
