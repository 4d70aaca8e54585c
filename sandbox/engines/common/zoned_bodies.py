"""State of bodies in scenes with zones: bodies inside zones, and the effects of zones on them.

A zone is a circle, a strip with round ends, or a polygon. A point is inside a polygon if a ray from it crosses the
outline an odd number of times (Shimrat 1962), so that polygons need no convex decomposition.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.geometry import nearest_fraction
from sandbox.engines.common.kernel import kernel
from sandbox.engines.common.zones import ZoneTracker
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Point
from sandbox.scene.description.fixed import Zone


class ZoneShapes(NamedTuple):
    """Outlines of Z zones as E edges; a circle is one edge of length 0."""

    edge: FloatArray
    """(E, 4) both ends, m"""
    first: IntArray
    """(Z + 1,) row of the first edge of each zone"""
    radius: FloatArray
    """(Z,) m, radius of circles, half thickness of strips; 0 for polygons"""
    box: FloatArray
    """(Z, 4) m, left, bottom, right and top"""


def make_zone_shapes(zones: Sequence[Zone]) -> ZoneShapes:
    """Return the shapes of zones as arrays."""
    edges, first, radius, box = [], [0], [], []
    for zone in zones:
        if zone.points is None:
            assert zone.position is not None and zone.radius is not None
            own, extent = [(*zone.position, *zone.position)], zone.radius
        elif zone.thickness is not None:
            own, extent = [(*a, *b) for a, b in pairwise(zone.points)], 0.5 * zone.thickness
        else:
            own, extent = [(*a, *b) for a, b in pairwise((*zone.points, zone.points[0]))], 0.0
        edges += own
        first.append(len(edges))
        radius.append(extent)
        ends = np.asarray(own).reshape(-1, 2)
        box.append((*(ends.min(axis=0) - extent), *(ends.max(axis=0) + extent)))
    return ZoneShapes(np.asarray(edges), np.asarray(first), np.asarray(radius), np.asarray(box))


def distance_to_outlines(shapes: ZoneShapes, x: float, y: float) -> float:
    """Return the distance, m, from a point to the nearest outline of a zone; less inside of strips with corners."""
    start, along = shapes.edge[:, :2], shapes.edge[:, 2:] - shapes.edge[:, :2]
    offset, squared = (x, y) - start, np.einsum("ek,ek->e", along, along)
    fraction = np.einsum("ek,ek->e", offset, along) / np.where(squared, squared, 1.0)
    gap = offset - np.clip(fraction, 0.0, 1.0)[:, None] * along
    radius = np.repeat(shapes.radius, np.diff(shapes.first))
    return float(np.abs(np.hypot(gap[:, 0], gap[:, 1]) - radius).min())


@kernel
def is_inside(edge: FloatArray, first: int, end: int, radius: float, x: float, y: float) -> bool:
    """Return whether a point, m, is inside the zone with the edges first…end."""
    inside = False
    for k in range(first, end):
        ax, ay, bx, by = edge[k, 0], edge[k, 1], edge[k, 2], edge[k, 3]
        if radius == 0.0:
            # Edges are half-open at the upper end, so that a ray through a corner is counted correctly.
            if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
                inside = not inside
            continue
        fraction = nearest_fraction(ax, ay, bx, by, x, y)
        dx, dy = x - ax - fraction * (bx - ax), y - ay - fraction * (by - ay)
        if dx * dx + dy * dy < radius * radius:
            return True
    return inside


@kernel
def find_zones(edge: FloatArray, first: IntArray, radius: FloatArray, x: float, y: float, out: BoolArray) -> None:
    """Write which zones contain a point, m."""
    for z in range(len(radius)):
        out[z] = is_inside(edge, first[z], first[z + 1], radius[z], x, y)


@kernel
def update_inside(
    position: FloatArray,
    can_enter_zone: BoolArray,
    edge: FloatArray,
    first: IntArray,
    radius: FloatArray,
    box: FloatArray,
    inside: BoolArray,
    pending: BoolArray,
) -> int:
    """Update which centres are inside which zones, and mark the bodies with a change; return their number.

    Args:
        position: (N, ≥ 2) centres, m.
        can_enter_zone: (N,) whether zones detect the body; others are in no zone.
        edge: (E, 4) of `ZoneShapes`, as the next three arguments.
        first: (Z + 1,).
        radius: (Z,) m.
        box: (Z, 4) m.
        inside: (N, Z) before; updated.
        pending: (N,) bodies with a change; written.
    """
    count = 0
    for i in range(len(inside)):
        x, y = position[i, 0], position[i, 1]
        pending[i] = False
        for z in range(len(radius)):
            now = False
            if can_enter_zone[i] and box[z, 0] <= x and x <= box[z, 2] and box[z, 1] <= y and y <= box[z, 3]:
                now = is_inside(edge, first[z], first[z + 1], radius[z], x, y)
            if now != inside[i, z]:
                inside[i, z] = now
                pending[i] = True
        if pending[i]:
            count += 1
    return count


class ZonedBodyStore(BodyStore):
    """Body store of a scene with zones: the host that `ZoneTracker` acts on."""

    def __init__(self, setup: Setup, h: float) -> None:
        super().__init__(setup, h)
        scene = setup.scene
        self.pending: set[int] = set()
        """bodies that entered or left a zone, or have to be checked"""
        self._shapes = make_zone_shapes(scene.zones)
        self._inside: BoolArray = np.zeros(self.visits.shape, np.bool_)
        self._gravities: dict[int, Point] = {}
        self._changed = False
        self.tracker = ZoneTracker(scene, self)
        self._rebuild_zones()
        self.tracker.begin(np.flatnonzero(self._can_enter_zone).tolist(), entering=setup.time == 0.0)

    def _rebuild_zones(self) -> None:
        more = np.zeros((len(self.visits) - len(self._inside), self.visits.shape[1]), np.bool_)
        self._inside = np.vstack((self._inside, more))
        self._changed_bodies: BoolArray = np.zeros(len(self.visits), np.bool_)
        self._can_enter_zone: BoolArray = self._sensed()
        self.tracker.rebuild_arrays(self.position, self.velocity, self.angular_velocity, self.layer, self.visits)
        self.tracker.rebuild(self.contact_matrix)

    def _sensed(self) -> BoolArray:
        """Return which bodies (N,) zones detect."""
        return self.contact_matrix.can_enter_zone & self.present

    def detect(self, position: FloatArray) -> bool:
        """Find the zones of (N, ≥ 2) centres, m, at the end of a substep; return whether effects have to be applied."""
        if update_inside(position, self._can_enter_zone, *self._shapes, self._inside, self._changed_bodies):
            self.pending.update(np.flatnonzero(self._changed_bodies).tolist())
        return bool(self.pending)

    @property
    def ahead(self) -> FloatArray:
        """Velocity, (2,) m/s, by which velocities are ahead of time: 0 unless an engine kicks by half a step."""
        return np.zeros(2)

    def apply_zones(self) -> bool:
        """Apply the effects of zones; return whether that changed more than the visits."""
        self._changed = False
        self.tracker.apply_effects(self.ahead)
        return self._changed

    def at(self, position: FloatArray) -> list[int]:
        """Return the indices of the zones that contain a point, m, ascending."""
        edge, first, radius, _ = self._shapes
        found = np.empty(len(radius), np.bool_)
        find_zones(edge, first, radius, float(position[0]), float(position[1]), found)
        return [int(z) for z in np.flatnonzero(found)]

    def inside(self, index: int) -> list[int]:
        """Return the zones that contained the centre of a body at the end of the last substep, ascending."""
        return [int(z) for z in np.flatnonzero(self._inside[index])]

    def is_sensed(self, index: int) -> bool:
        """Return whether a body is present, and zones detect it."""
        return bool(self._can_enter_zone[index])

    @property
    def with_own_gravity(self) -> list[int]:
        """Bodies with the gravity of a zone."""
        return list(self._gravities)

    @property
    def gravity(self) -> FloatArray:
        """Gravity of all bodies, (2,), or of each body, (N, 2), m/s²."""
        gravity = np.asarray(self.scene.world.gravity, dtype=np.float64)
        if self._gravities:
            gravity = np.tile(gravity, (len(self.position), 1))
            gravity[self.with_own_gravity] = list(self._gravities.values())
        return self._scaled(gravity)

    def set_layer(self, index: int) -> None:
        """Record that the layer of a body has changed."""
        del index  # the array of layers has the change already
        self._changed = True

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m, for a zone."""
        self.position[index] = position
        self._changed = True

    def hold(self, index: int) -> None:
        """Hold a body in place, whatever it collides with, until `release`."""
        self._set_held(index, True)

    def release(self, index: int) -> None:
        """Release a body that was held."""
        self._set_held(index, False)

    def _set_held(self, index: int, held: bool) -> None:
        self.velocity[index], self.angular_velocity[index] = 0.0, 0.0
        self.held_by_zone[index], self._changed = held, True
        self._rebuild(self.setup, self.bodies, self.contact_matrix)

    def set_gravity(self, index: int, gravity: Point | None) -> None:
        """Set the gravity of a body, m/s²; None restores that of the world."""
        if gravity == self._gravities.get(index):
            return
        self._changed = True
        if gravity is None:
            del self._gravities[index]
        else:
            self._gravities[index] = gravity

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s; a zone that holds it releases it."""
        self.tracker.release_body(index)
        super().set_velocity(index, velocity)

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Set the constant force (N) and torque (N·m) on a body; a zone that holds it releases it."""
        if force.any() or torque:
            self.tracker.release_body(index)
        super().set_constant_force(index, force, torque)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m; a zone that holds it releases it."""
        super().move_body(index, position)
        self.tracker.release_body(index)
        self.tracker.update_position(index)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Change the scene, as `BodyStore.change`."""
        matrix = self.contact_matrix
        super().change(setup, spawned)
        if self.contact_matrix is matrix:  # the same bodies, under another gravity
            self.tracker.rebuild(matrix)
        else:
            self._rebuild_zones()

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body and return its index, as `BodyStore.add`."""
        index = super().add(single, name)
        self._rebuild_zones()
        self.tracker.update_position(index)
        return index

    def remove_bodies(self, numbers: IntArray, time: float) -> None:
        """Remove bodies at a time, s, also from their zones."""
        super().remove_bodies(numbers, time)
        self.tracker.forget(numbers)
        for index in numbers.tolist():
            self._gravities.pop(index, None)
            self.pending.discard(index)
        self._rebuild_zones()
