"""Members: the bodies in a pymunk space, each by its number."""

from typing import NamedTuple

import pymunk

from sandbox.trajectory import FloatArray, IntArray


class Member(NamedTuple):
    """A body in the space, with its shapes; what can meet nothing has none."""

    body: pymunk.Body
    shapes: tuple[tuple[int, pymunk.Shape], ...]
    """each with its number among the pieces of all bodies"""

    @property
    def moves(self) -> bool:
        """It is not fixed."""
        return self.body.body_type != pymunk.Body.STATIC  # kinematic is what a zone holds, or a drive leads


class Members:
    """The bodies in a space, and what is done to one alone."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._members: dict[int, Member] = {}
        self._resting: dict[int, tuple[float, float]] = {}  # mass and moment of those that zones hold
        self._state: tuple[IntArray, FloatArray] | None = None  # as last read, while nothing has changed

    def holds(self, number: int) -> bool:
        """Tell whether a body is in the space."""
        return number in self._members

    def movers(self) -> list[int]:
        """Return the numbers of the bodies that are not fixed."""
        return [number for number, member in self._members.items() if member.moves]

    def moment(self, number: int) -> float:
        """Return a body's moment of inertia, kg·m²; infinite where nothing in the scene can turn it."""
        return self._resting[number][1] if number in self._resting else self._members[number].body.moment

    def give_moment(self, number: int, moment: float) -> None:
        """Let a body turn from now on."""
        if number in self._resting:
            self._resting[number] = self._resting[number][0], moment
        else:
            self._members[number].body.moment = moment

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        body = self._members[number].body
        body.position = float(position[0]), float(position[1])
        self._space.reindex_shapes_for_body(body)
        self._state = None

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""
        self._members[number].body.velocity = float(velocity[0]), float(velocity[1])
        self._state = None

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""
        self._members[number].body.angular_velocity = spin
        self._state = None

    def hold(self, number: int) -> None:
        """Let a body stand still where it is, whatever it meets, until it is let go."""
        if number in self._resting:  # it rests already: what pymunk tells then is no mass
            return
        body = self._members[number].body
        self._resting[number] = body.mass, body.moment
        body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        body.body_type = pymunk.Body.KINEMATIC
        pymunk.Body.update_position(body, 0.0)  # forgets by how much overlaps would still have shifted it
        self._state = None

    def let_go(self, number: int) -> None:
        """Let a body that was held move again."""
        body = self._members[number].body
        body.body_type = pymunk.Body.DYNAMIC
        body.mass, body.moment = self._resting.pop(number)
        body.force, body.torque = (0.0, 0.0), 0.0  # what thrusts have added up
        self._state = None
