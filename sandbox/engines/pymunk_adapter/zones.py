"""Zone sensors: which body centres are in which zones, found by pymunk's broad phase.

Zones are shapes of a static body, and each body that zones sense has a probe: a disc of radius 0 at its centre. Both
are sensors in categories of their own: probes collide with zones only, and zones with probes only. pymunk reports when
a probe enters and leaves a zone, at the end of each substep, so that bodies that stay cost nothing.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import pymunk

from sandbox.arrays import FloatArray
from sandbox.scene.description.fixed import Zone
from sandbox.scene.geometry.shapes import pieces_of

PROBE, ZONE = 1 << 30, 1 << 31
"""Categories of shapes, above those of all layers."""

OF_PROBE, OF_ZONE = 1 << 20, (1 << 20) + 1
"""Collision types, above those of all surfaces."""

SEARCH = pymunk.ShapeFilter(categories=PROBE, mask=ZONE)


class ZoneSensors:
    """Zones of a scene and probes of its bodies, in a space."""

    def __init__(self, space: pymunk.Space, zones: Sequence[Zone]) -> None:
        self._space = space
        self._zone_of: dict[pymunk.Shape, int] = {}
        self._index_of: dict[pymunk.Shape, int] = {}
        self._probe_of: dict[int, pymunk.Shape] = {}
        self._within: dict[int, Counter[int]] = {}  # number of shapes of each zone that contain each body's centre
        self.pending: set[int] = set()
        """bodies that have entered or left a zone, or are to be checked"""
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        for k, zone in enumerate(zones):
            for shape in _shapes(zone, body):
                shape.sensor, shape.filter, shape.collision_type = True, pymunk.ShapeFilter(0, ZONE, PROBE), OF_ZONE
                self._zone_of[shape] = k
        if zones:
            space.add(body, *self._zone_of)
            space.on_collision(OF_PROBE, OF_ZONE, begin=self._on_begin, separate=self._on_separate)

    def add(self, index: int, body: pymunk.Body) -> None:
        """Add a probe to a body."""
        probe = pymunk.Circle(body, 0.0)
        probe.sensor, probe.filter, probe.collision_type = True, SEARCH, OF_PROBE
        self._index_of[probe], self._probe_of[index], self._within[index] = index, probe, Counter()
        self._space.add(probe)

    def drop(self, index: int) -> None:
        """Remove the probe of a body, if it has one."""
        probe = self._probe_of.pop(index, None)
        if probe is not None:
            del self._index_of[probe], self._within[index]
            self._space.remove(probe)
            self.pending.discard(index)

    def inside(self, index: int) -> list[int]:
        """Return the zones that contained a body's centre at the end of the last substep, in ascending order."""
        return sorted(zone for zone, pieces in self._within[index].items() if pieces > 0)

    def at(self, position: FloatArray) -> list[int]:
        """Return the zones that contain a position, m, now, in ascending order."""
        found = self._space.point_query((float(position[0]), float(position[1])), 0.0, SEARCH)
        return sorted({self._zone_of[each.shape] for each in found if each.shape in self._zone_of})

    def _on_begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        self._count(arbiter, 1)

    def _on_separate(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        self._count(arbiter, -1)

    def _count(self, arbiter: pymunk.Arbiter, change: int) -> None:
        probe, zone = arbiter.shapes
        index = self._index_of.get(probe)
        if index is not None:  # None while it is being removed
            self._within[index][self._zone_of[zone]] += change
            self.pending.add(index)


def _shapes(zone: Zone, body: pymunk.Body) -> list[pymunk.Shape]:
    """Return the shapes of a zone."""
    found: list[pymunk.Shape] = []
    for corners, radius in pieces_of(zone):
        match len(corners):
            case 1:
                found.append(pymunk.Circle(body, radius, corners[0]))
            case 2:
                found.append(pymunk.Segment(body, corners[0], corners[1], radius))
            case _:
                found.append(pymunk.Poly(body, corners))
    return found
