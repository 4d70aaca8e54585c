"""State of bodies in scenes with zones: bodies inside zones, and the effects of zones on them.

ZoneShapes: which centres lie in which zones, by the zones' own outlines.

A zone is a circle, a strip with round ends, or a polygon. A polygon is not cut into convex pieces for this: a ray from
the place crosses its outline an odd number of times if the place is inside (Shimrat 1962).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.kernel import kernel
from sandbox.engines.common.zones import ZoneTracker
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Point
from sandbox.scene.description.fixed import Zone


class ZoneShapes(NamedTuple):
    """Outlines of Z zones as E edges; a circle has one edge of length 0."""

    edge: FloatArray
    """(E, 4) both ends, m"""
    first: IntArray
    """(Z + 1,) row of the first edge of each zone"""
    reach: FloatArray
    """(Z,) m, of circles and strips, about their edges; of polygons 0"""
    box: FloatArray
    """(Z, 4) m, left, bottom, right and top"""


def precincts_of(zones: Sequence[Zone]) -> ZoneShapes:
    """Lay out zones that have shapes."""
    edges, first, reach, box = [], [0], [], []
    for zone in zones:
        if zone.points is None:
            assert zone.position is not None and zone.radius is not None
            own, wide = [(*zone.position, *zone.position)], zone.radius
        elif zone.thickness is not None:
            own, wide = [(*a, *b) for a, b in pairwise(zone.points)], 0.5 * zone.thickness
        else:
            own, wide = [(*a, *b) for a, b in pairwise((*zone.points, zone.points[0]))], 0.0
        edges += own
        first.append(len(edges))
        reach.append(wide)
        ends = np.asarray(own).reshape(-1, 2)
        box.append((*(ends.min(axis=0) - wide), *(ends.max(axis=0) + wide)))
    return ZoneShapes(np.asarray(edges), np.asarray(first), np.asarray(reach), np.asarray(box))


@kernel
def within(edge: FloatArray, first: int, end: int, reach: float, x: float, y: float) -> bool:
    """Return whether a point, m, is inside the zone of these edges."""
    inside = False
    for k in range(first, end):
        ax, ay, bx, by = edge[k, 0], edge[k, 1], edge[k, 2], edge[k, 3]
        if reach == 0.0:
            # Each edge without its upper end, so that a ray through a corner crosses it once or twice, as it does.
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
            continue
        ux, uy = bx - ax, by - ay
        square = ux * ux + uy * uy
        fraction = 0.0
        if square > 0.0:
            fraction = min(max(((x - ax) * ux + (y - ay) * uy) / square, 0.0), 1.0)
        dx, dy = x - ax - fraction * ux, y - ay - fraction * uy
        if dx * dx + dy * dy < reach * reach:
            return True
    return inside


@kernel
def look_around(
    position: FloatArray,
    can_enter_zone: BoolArray,
    edge: FloatArray,
    first: IntArray,
    reach: FloatArray,
    box: FloatArray,
    inside: BoolArray,
    pending: BoolArray,
) -> int:
    """Update which centres are inside which zones, and mark the bodies for which that changed; return their number.

    Args:
        position: (N, ≥ 2) centres, m.
        can_enter_zone: (N,) whether zones detect the body; others are inside of none.
        edge: (E, 4), and so on, of `ZoneShapes`.
        first: (Z + 1,).
        reach: (Z,) m.
        box: (Z, 4) m.
        inside: (N, Z) as it was; written to.
        pending: (N,) written to.
    """
    count = 0
    for i in range(len(inside)):
        x, y = position[i, 0], position[i, 1]
        pending[i] = False
        for z in range(len(reach)):
            now = False
            if can_enter_zone[i] and box[z, 0] <= x and x <= box[z, 2] and box[z, 1] <= y and y <= box[z, 3]:
                now = within(edge, first[z], first[z + 1], reach[z], x, y)
            if now != inside[i, z]:
                inside[i, z] = now
                pending[i] = True
        if pending[i]:
            count += 1
    return count


NOT_AHEAD = np.zeros(2)
"""m/s by which velocities are ahead of time: never, in this engine."""


class ZonedBodyStore(BodyStore):
    """Body store of a scene with zones: the host that `ZoneTracker` acts on."""

    def __init__(self, setup: Setup, h: float) -> None:
        super().__init__(setup, h)
        scene = setup.scene
        self.pending: set[int] = set()
        """bodies that entered or left a zone, or are to be checked"""
        self._precincts = precincts_of(scene.zones)
        self._inside: BoolArray = np.zeros(self.visits.shape, np.bool_)
        self._lifts: dict[int, Point] = {}
        self._changed = False
        self.visiting = ZoneTracker(scene, self)
        self._rebuild_zones()
        self.visiting.begin(np.flatnonzero(self.contact_matrix.can_enter_zone).tolist(), anew=setup.time == 0.0)

    def _rebuild_zones(self) -> None:
        more = np.zeros((len(self.visits) - len(self._inside), self.visits.shape[1]), np.bool_)
        self._inside = np.vstack((self._inside, more))
        self._stirred: BoolArray = np.zeros(len(self.visits), np.bool_)
        self._can_enter_zone: BoolArray = self.contact_matrix.can_enter_zone & self.present
        self.visiting.set_arrays(self.position, self.velocity, self.angular_velocity, self.layer, self.visits)
        self.visiting.rebuild(self.contact_matrix)

    def look(self, position: FloatArray) -> bool:
        """Find the zones of (N, ≥ 2) centres, m, at the end of a substep; return whether zones have to act."""
        if look_around(position, self._can_enter_zone, *self._precincts, self._inside, self._stirred):
            self.pending.update(np.flatnonzero(self._stirred).tolist())
        return bool(self.pending)

    def settle(self) -> bool:
        """Let zones act on bodies; return whether that changed more than the visits."""
        self._changed = False
        self.visiting.apply_effects(NOT_AHEAD)
        return self._changed

    def at(self, place: FloatArray) -> list[int]:
        """Return the indices of the zones that contain a point, m, ascending."""
        edge, first, reach, _ = self._precincts
        x, y = float(place[0]), float(place[1])
        return [z for z in range(len(reach)) if within(edge, first[z], first[z + 1], reach[z], x, y)]

    def inside(self, number: int) -> list[int]:
        """Return the zones that contained the centre of a body at the end of the last substep, ascending."""
        return [int(z) for z in np.flatnonzero(self._inside[number])]

    def is_sensed(self, number: int) -> bool:
        """Return whether a body is present, and zones detect it."""
        return bool(self._can_enter_zone[number])

    @property
    def with_own_gravity(self) -> list[int]:
        """Bodies with the gravity of a zone."""
        return list(self._lifts)

    @property
    def gravity(self) -> FloatArray:
        """Gravity of all bodies, (2,), or of each body, (N, 2), m/s²."""
        gravity = super().gravity
        if self._lifts:
            gravity = np.tile(gravity, (len(self.position), 1))
            gravity[self.with_own_gravity] = list(self._lifts.values())
        return gravity

    def set_layer(self, number: int) -> None:
        """Mark that a body has changed its layer."""
        del number  # its row says so already
        self._changed = True

    def set_position(self, number: int, position: FloatArray) -> None:
        """Set the position of a body, m, for a zone."""
        self.position[number] = position
        self._changed = True

    def hold(self, number: int) -> None:
        """Hold a body at rest where it is, whatever hits it, until it is released."""
        self._stands(number, True)

    def release(self, number: int) -> None:
        """Release a body that was held."""
        self._stands(number, False)

    def _stands(self, number: int, held: bool) -> None:
        self.velocity[number], self.angular_velocity[number] = 0.0, 0.0
        self.held_by_zone[number], self._changed = held, True
        self._rebuild(self.setup, self.bodies, self.contact_matrix)

    def set_gravity(self, number: int, gravity: Point | None) -> None:
        """Set the gravity of a body, m/s²; None restores that of the world."""
        if gravity == self._lifts.get(number):
            return
        self._changed = True
        if gravity is None:
            del self._lifts[number]
        else:
            self._lifts[number] = gravity

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s; a zone that holds it releases it."""
        self.visiting.release_body(number)
        super().set_velocity(number, velocity)

    def set_constant_force(self, number: int, force: FloatArray, torque: float) -> None:
        """Set the constant force (N) and torque (N·m) on a body; a zone that holds it releases it."""
        if force.any() or torque:
            self.visiting.release_body(number)
        super().set_constant_force(number, force, torque)

    def move_body(self, number: int, position: FloatArray) -> None:
        """Set the position of a body, m; a zone that holds it releases it."""
        super().move_body(number, position)
        self.visiting.release_body(number)
        self.visiting.update_position(number)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Change the scene, as `BodyStore.change`."""
        super().change(setup, spawned)
        self._rebuild_zones()

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body and return its index, as `BodyStore.add`."""
        number = super().add(single, name)
        self._rebuild_zones()
        self.visiting.update_position(number)
        return number

    def remove_bodies(self, numbers: IntArray, time: float) -> None:
        """Remove bodies at a time, s, also from their zones."""
        super().remove_bodies(numbers, time)
        self.visiting.forget(numbers)
        for number in numbers.tolist():
            self._lifts.pop(number, None)
            self.pending.discard(number)
        self._rebuild_zones()
