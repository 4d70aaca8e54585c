"""ZonedRoster: the bodies of a scene with zones, who of them is where, and what zones have done to them."""

import numpy as np

from sandbox.engines.reference.precincts import look_around, precincts_of, within
from sandbox.engines.roster import Roster
from sandbox.engines.visiting import Visiting
from sandbox.scene.model import Scene, Single
from sandbox.scene.part import Point
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray, IntArray

NOT_AHEAD = np.zeros(2)
"""m/s by which velocities run ahead: here they never do."""


class ZonedRoster(Roster):
    """A roster, and the premises of its zones."""

    def __init__(self, scene: Scene, h: float) -> None:
        super().__init__(scene, h)
        self.stirred: set[int] = set()
        """who has come into a zone, or left one, or is to be looked at"""
        self._precincts = precincts_of(scene.zones)
        self._inside: BoolArray = np.zeros(self.visits.shape, np.bool_)
        self._lifts: dict[int, Point] = {}
        self._changed = False
        self.visiting = Visiting(scene, self)
        self._renew()
        self.visiting.begin(np.flatnonzero(self.meet.noted), anew=scene.began == 0.0)

    def _renew(self) -> None:
        more = np.zeros((len(self.visits) - len(self._inside), self.visits.shape[1]), np.bool_)
        self._inside = np.vstack((self._inside, more))
        self._stirred: BoolArray = np.zeros(len(self.visits), np.bool_)
        self._noted: BoolArray = self.meet.noted & self.present
        self.visiting.live_in(self.position, self.velocity, self.angular_velocity, self.layer, self.visits)
        self.visiting.renew(self.meet)

    def look(self, position: FloatArray) -> bool:
        """Look where (N, ≥ 2) centres, m, are at the end of a substep; tell whether somebody is stirred."""
        if look_around(position, self._noted, *self._precincts, self._inside, self._stirred):
            self.stirred.update(np.flatnonzero(self._stirred).tolist())
        return bool(self.stirred)

    def settle(self) -> bool:
        """Let zones do what they do; tell whether that has changed more than who is noted."""
        self._changed = False
        self.visiting.settle(NOT_AHEAD)
        return self._changed

    def at(self, place: FloatArray) -> list[int]:
        """Return the zones that a place, m, is in, in their order."""
        edge, first, reach, _ = self._precincts
        x, y = float(place[0]), float(place[1])
        return [z for z in range(len(reach)) if within(edge, first[z], first[z + 1], reach[z], x, y)]

    def inside(self, number: int) -> list[int]:
        """Return the zones that a body's centre was in at the end of the last substep, in their order."""
        return [int(z) for z in np.flatnonzero(self._inside[number])]

    def noted(self, number: int) -> bool:
        """Tell whether a body is here, and zones can note it."""
        return bool(self._noted[number])

    @property
    def lifted(self) -> list[int]:
        """Who has the gravity of a zone."""
        return list(self._lifts)

    @property
    def gravity(self) -> FloatArray:
        """Of all bodies alike, (2,), or of each, (N, 2), m/s²."""
        gravity = super().gravity
        if self._lifts:
            gravity = np.tile(gravity, (len(self.position), 1))
            gravity[self.lifted] = list(self._lifts.values())
        return gravity

    def set_layer(self, number: int) -> None:
        """Take note that a body is on another layer."""
        del number  # its row says so already
        self._changed = True

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m, as a zone wants it."""
        self.position[number] = position
        self._changed = True

    def hold(self, number: int) -> None:
        """Let a body stand still where it is, whatever it meets, until it is let go."""
        self._stands(number, True)

    def let_go(self, number: int) -> None:
        """Let a body that was held move again."""
        self._stands(number, False)

    def _stands(self, number: int, held: bool) -> None:
        self.velocity[number], self.angular_velocity[number] = 0.0, 0.0
        self.caught[number], self._changed = held, True
        self._assume(self.scene, self.bodies, self.meet)

    def lift(self, number: int, gravity: Point | None) -> None:
        """Let a gravity, m/s², act on a body in the place of the world's from now on; None is the world's."""
        if gravity == self._lifts.get(number):
            return
        self._changed = True
        if gravity is None:
            del self._lifts[number]
        else:
            self._lifts[number] = gravity

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s; a zone that holds it lets it go."""
        self.visiting.free(number)
        super().set_velocity(number, velocity)

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on; a zone that holds it lets it go."""
        if force.any() or torque:
            self.visiting.free(number)
        super().push(number, force, torque)

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m; a zone that holds it lets it go."""
        super().put(number, position)
        self.visiting.free(number)
        self.visiting.put(number)

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a changed scene, as `Roster.change`."""
        super().change(scene, spawned)
        self._renew()

    def add(self, single: Single, name: str) -> int:
        """Add a body and return its number, as `Roster.add`."""
        number = super().add(single, name)
        self._renew()
        self.visiting.put(number)
        return number

    def take_out(self, numbers: IntArray, time: float) -> None:
        """Remove bodies at a time, s: they are in no zone then."""
        super().take_out(numbers, time)
        self.visiting.gone(numbers)
        for number in numbers.tolist():
            self._lifts.pop(number, None)
            self.stirred.discard(number)
        self._renew()
