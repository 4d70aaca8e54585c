"""Premises: what `Visiting` asks of a pymunk space. Who is inside tell the probes, by pymunk's own broad phase."""

import numpy as np

from sandbox.engines.native.meeting import MeetingBodies
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray


class NativePremises:
    """The bodies of a pymunk space, as `engines.visiting.Premises` wants them."""

    def __init__(self, meeting: MeetingBodies) -> None:
        self._meeting = meeting

    def renew(self, scene: Scene, bodies: Bodies) -> None:
        """Go on with a scene's changed gravity, or with more bodies."""
        self._gravity, self._bodies = np.asarray(scene.world.gravity), bodies

    @property
    def stirred(self) -> set[int]:
        """Who has come into a zone, or left one, or is to be looked at."""
        return self._meeting.probes.stirred

    @stirred.setter
    def stirred(self, stirred: set[int]) -> None:
        self._meeting.probes.stirred = stirred

    def at(self, place: FloatArray) -> list[int]:
        """Return the zones that a place, m, is in, in their order."""
        return self._meeting.probes.at(place)

    def inside(self, number: int) -> list[int]:
        """Return the zones that a body's centre was in at the end of the last substep, in their order."""
        return self._meeting.probes.inside(number)

    def noted(self, number: int) -> bool:
        """Tell whether a body is here, and zones can note it."""
        return self._meeting.noted(number)

    @property
    def lifted(self) -> list[int]:
        """Who has the gravity of a zone."""
        return self._meeting.steady.lifted

    def set_layer(self, number: int) -> None:
        """Let a body meet what is on its layer from now on; what it touched elsewhere it touches no more."""
        self._meeting.set_layer(number, self._bodies)

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        self._meeting.set_position(number, position)

    def hold(self, number: int) -> None:
        """Let a body stand still where it is, whatever it meets, until it is let go."""
        self._meeting.hold(number)

    def let_go(self, number: int) -> None:
        """Let a body that was held move again."""
        self._meeting.let_go(number)

    def lift(self, number: int, gravity: Point | None) -> None:
        """Let a gravity, m/s², act on a body in the place of the world's, by a force that makes up the difference."""
        more = None if gravity is None else (np.asarray(gravity) - self._gravity) * self._bodies.mass[number]
        self._meeting.steady.lift(number, more)
