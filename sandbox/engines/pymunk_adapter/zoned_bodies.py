"""Bodies of a scene with zones on pymunk."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.zoned_bodies import ZonedBodyStore, distance_to_outlines
from sandbox.engines.pymunk_adapter.bodies import PymunkBodies
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.world import Settings

FEW_SENSED = 12
"""Number of bodies up to which positions are read one by one, rather than the states of all bodies at once"""


NO_ROOM = 0.0, 0.0, 0.0
"""Position, m, and squared distance, m², to the nearest outline of a body that has not been looked at"""


class ZonedPymunkBodies(PymunkBodies, ZonedBodyStore):
    """Bodies of a scene with zones, whose effects act on the bodies in the space too."""

    def __init__(self, setup: Setup, settings: Settings) -> None:
        super().__init__(setup, settings)
        for index in np.flatnonzero(self.held_by_zone).tolist():
            self.space_bodies.hold(index)

    def find_zones(self) -> bool:
        """Find the zones of the centres after a substep; return whether effects have to be applied.

        A few bodies are looked at one by one, and not again before they may have crossed an outline.
        """
        if len(self._rooms) > FEW_SENSED:
            self.refresh()
            return self.detect(self.position)
        crossing = False
        for index, (x0, y0, squared_room) in self._rooms.items():
            x, y = self.space_bodies.position_of(index)
            if not (x - x0) ** 2 + (y - y0) ** 2 < squared_room:
                room = distance_to_outlines(self._shapes, x, y) * (1.0 - 1e-9)  # a margin for rounding
                self.position[index], self._rooms[index], crossing = (x, y), (x, y, room * room), True
        return self.detect(self.position) if crossing else bool(self.pending)

    def _rebuild_zones(self) -> None:
        super()._rebuild_zones()
        self._rooms = dict.fromkeys(np.flatnonzero(self._can_enter_zone).tolist(), NO_ROOM)

    def set_layer(self, index: int) -> None:
        """Apply a changed collision layer from now on. Contacts of the body on the old layer end."""
        super().set_layer(index)
        if self.space_bodies.holds(index):
            self.space_bodies.set_layer(index, self.bodies)

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m, for a zone."""
        super().set_position(index, position)
        if self.space_bodies.holds(index):
            self.space_bodies.set_position(index, position)

    def hold(self, index: int) -> None:
        """Hold a body in place, whatever it collides with, until `release`."""
        super().hold(index)
        if self.space_bodies.holds(index):
            self.space_bodies.hold(index)

    def release(self, index: int) -> None:
        """Release a body that was held."""
        super().release(index)
        self.space_bodies.release(index)

    def set_gravity(self, index: int, gravity: Point | None) -> None:
        """Replace the world's gravity on a body by another, m/s², by a force that makes up the difference."""
        super().set_gravity(index, gravity)
        self._update_gravity(index)

    def _zone_gravity(self, index: int) -> Point | None:
        return self._gravities.get(index)
