"""Visiting: what zones do to those whose centres come in, by rules that are the same on every engine."""

import math
from typing import Protocol

import numpy as np

from sandbox.engines.touching import Touching
from sandbox.scene.meetings import Meetings
from sandbox.scene.model import Scene
from sandbox.scene.part import Point
from sandbox.scene.precinct import middle_of
from sandbox.scene.zone import AWAY, HELD, INSIDE, LET_GO, mask_of
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Premises(Protocol):
    """What an engine finds, and does, for zones. Bodies and zones go by their numbers."""

    stirred: set[int]
    """who has come into a zone, or left one, or is to be looked at"""

    def at(self, place: FloatArray) -> list[int]:
        """Return the zones that a place, m, is in, in their order."""

    def inside(self, number: int) -> list[int]:
        """Return the zones that a body's centre was in at the end of the last substep, in their order."""

    def noted(self, number: int) -> bool:
        """Tell whether a body is here, and zones can note it."""

    @property
    def lifted(self) -> list[int]:
        """Who has the gravity of a zone."""

    def set_layer(self, number: int) -> None:
        """Let a body meet what is on its layer from now on; what it touched elsewhere it touches no more."""

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""

    def hold(self, number: int) -> None:
        """Let a body stand still where it is, whatever it meets, until it is let go."""

    def let_go(self, number: int) -> None:
        """Let a body that was held move again."""

    def lift(self, number: int, gravity: Point | None) -> None:
        """Let a gravity, m/s², act on a body in the place of the world's from now on; None is the world's."""


class Visiting:
    """The zones of a running scene, and who is in them. It writes to rows of the arrays that an engine lives in."""

    def __init__(self, scene: Scene, premises: Premises) -> None:
        self._zones, self._premises = scene.zones, premises
        self._masks = [mask_of(zone.layers, scene.layers) for zone in scene.zones]
        self._to = [None if zone.to_layer is None else scene.layers.index(zone.to_layer) for zone in scene.zones]
        self._first = len(scene.fixed) + len(scene.pockets)
        self._rows: list[tuple[int, int, complex, complex]] = []

    def live_in(
        self, position: FloatArray, velocity: FloatArray, spin: FloatArray, layer: IntArray, visits: IntArray
    ) -> None:
        """Go on with these arrays, which hold all N bodies."""
        self._position, self._velocity, self._spin = position, velocity, spin
        self.layer, self.visits = layer, visits

    def renew(self, meet: Meetings) -> None:
        """Go on with a scene's changed gravity, or with more bodies."""
        self._joined: BoolArray = meet.held
        for number in self._premises.lifted:
            self._lift(number, self._premises.at(self._position[number]))

    @property
    def held(self) -> BoolArray:
        """(N,) which bodies are held."""
        return np.asarray((self.visits == HELD).any(axis=1))

    def begin(self, numbers: IntArray, anew: bool) -> None:
        """Take note of where bodies that zones can note are; anew, as if they had come this moment."""
        for number in numbers.tolist():
            inside = self._premises.at(self._position[number])
            if anew:
                self._come(number, inside, np.zeros(2))
            if (self.visits[number] == HELD).any():
                self._premises.hold(number)
            self._lift(number, inside)
            self._premises.stirred.add(number)  # by the end of the first substep it may have left again

    def put(self, number: int) -> None:
        """Take note that a body was put where it is; what it comes into there it comes into within the next substep."""
        if not self._premises.noted(number):
            return
        inside = self._premises.at(self._position[number])
        self._leave(number, inside)
        self._lift(number, inside)
        self._premises.stirred.add(number)

    def free(self, number: int) -> None:
        """Let a body go, if it is held."""
        where = self.visits[number] == HELD
        if where.any():
            self.visits[number, where] = LET_GO
            self._premises.let_go(number)

    def gone(self, numbers: IntArray) -> None:
        """Take note that bodies are no longer there."""
        self.visits[numbers] = AWAY

    def settle(self, ahead: FloatArray) -> None:
        """Let zones note who came in during the last substep, and do what they do.

        Args:
            ahead: (2,) m/s by which velocities run ahead.
        """
        premises = self._premises
        stirred, premises.stirred = sorted(premises.stirred), set()
        for number in stirred:
            inside = premises.inside(number)
            self._come(number, inside, ahead)
            self._lift(number, inside)

    def _leave(self, number: int, inside: list[int]) -> None:
        for zone in np.flatnonzero(self.visits[number]).tolist():
            if zone not in inside:
                self.visits[number, zone] = AWAY

    def _come(self, number: int, inside: list[int], ahead: FloatArray) -> None:
        """Let a body visit the zones that it is inside of: each once, until it has left it."""
        self._leave(number, inside)
        waiting = [zone for zone in inside if self.visits[number, zone] == AWAY]
        while (zone := next((z for z in waiting if self._masks[z] >> self.layer[number] & 1), None)) is not None:
            waiting.remove(zone)
            self.visits[number, zone] = INSIDE
            self._note(number, zone, self._velocity[number] - ahead)
            to = self._to[zone]
            if to is not None and to != self.layer[number]:
                self.layer[number] = to
                self._premises.set_layer(number)
            if self._zones[zone].holds and self._can_hold(number, zone):
                self._hold(number, zone)
                return

    def _note(self, number: int, zone: int, velocity: FloatArray) -> None:
        motion, place = complex(*velocity), complex(*self._position[number])
        size = abs(motion)
        direction = motion / size if 0.0 < size < math.inf else 1j
        self._rows.append((number, -1 - self._first - zone, direction, place))

    def _can_hold(self, number: int, zone: int) -> bool:
        """Tell whether a zone can hold a body: one at a time, and none that hangs on something."""
        return (
            not self._joined[number]
            and not (self.visits[:, zone] == HELD).any()
            and not (self.visits[number] == HELD).any()
        )

    def _hold(self, number: int, zone: int) -> None:
        self.visits[number, zone] = HELD
        self._position[number] = middle_of(self._zones[zone])
        self._velocity[number], self._spin[number] = 0.0, 0.0
        self._premises.set_position(number, self._position[number])
        self._premises.hold(number)
        self._premises.stirred.add(number)  # at the centre it may be in other zones

    def _lift(self, number: int, inside: list[int]) -> None:
        """Let the gravity of the last zone that a body is in take the place of the world's."""
        gravity = None
        for zone in inside:
            if self._masks[zone] >> self.layer[number] & 1 and self._zones[zone].gravity is not None:
                gravity = self._zones[zone].gravity
        self._premises.lift(number, gravity)

    def told(self, again: bool = False) -> Touching | None:
        """Return who has come in since this was last asked, or none; with `again`, the next call tells of it too."""
        if not self._rows:
            return None
        numbers, zones, direction, place = zip(*self._rows, strict=True)
        if not again:
            self._rows = []
        nothing = np.zeros(len(numbers), np.complex128)
        return Touching(np.asarray(numbers), np.asarray(zones), nothing, np.asarray(direction), np.asarray(place))
