"""Probes: whose centre is in which zone, found by pymunk's own broad phase.

Zones are shapes of a static body, and each body that zones can note has a probe: a disc of no radius at its centre.
Both are sensors in categories of their own, so that probes meet zones and nothing else does, and what does not change
costs nothing. pymunk tells when two come together and when they part, at the end of each substep.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import pymunk

from sandbox.scene.model import Zone
from sandbox.scene.precinct import pieces_of
from sandbox.trajectory import FloatArray

PROBE, ZONE = 1 << 30, 1 << 31
"""Categories of shapes, above those of all layers."""

OF_PROBE, OF_ZONE = 1 << 20, (1 << 20) + 1
"""Collision types, above those of all surfaces."""

SEARCH = pymunk.ShapeFilter(categories=PROBE, mask=ZONE)


class Probes:
    """The zones of a scene and the probes of its bodies, in a space."""

    def __init__(self, space: pymunk.Space, zones: Sequence[Zone]) -> None:
        self._space = space
        self._zone_of: dict[pymunk.Shape, int] = {}
        self._number_of: dict[pymunk.Shape, int] = {}
        self._probe_of: dict[int, pymunk.Shape] = {}
        self._within: dict[int, Counter[int]] = {}  # how many pieces of each zone each body's centre is in
        self.stirred: set[int] = set()
        """who has come into a zone, or left one, or is to be looked at"""
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        for k, zone in enumerate(zones):
            for shape in _shapes(zone, body):
                shape.sensor, shape.filter, shape.collision_type = True, pymunk.ShapeFilter(0, ZONE, PROBE), OF_ZONE
                self._zone_of[shape] = k
        if zones:
            space.add(body, *self._zone_of)
            space.on_collision(OF_PROBE, OF_ZONE, begin=self._come, separate=self._part)

    def add(self, number: int, body: pymunk.Body) -> None:
        """Give a body a probe."""
        probe = pymunk.Circle(body, 0.0)
        probe.sensor, probe.filter, probe.collision_type = True, SEARCH, OF_PROBE
        self._number_of[probe], self._probe_of[number], self._within[number] = number, probe, Counter()
        self._space.add(probe)

    def drop(self, number: int) -> None:
        """Take the probe of a body out, if it has one."""
        probe = self._probe_of.pop(number, None)
        if probe is not None:
            del self._number_of[probe], self._within[number]
            self._space.remove(probe)
            self.stirred.discard(number)

    def inside(self, number: int) -> list[int]:
        """Return the zones that a body's centre was in at the end of the last substep, in their order."""
        return sorted(zone for zone, pieces in self._within[number].items() if pieces > 0)

    def at(self, place: FloatArray) -> list[int]:
        """Return the zones that a place, m, is in now, in their order."""
        found = self._space.point_query((float(place[0]), float(place[1])), 0.0, SEARCH)
        return sorted({self._zone_of[each.shape] for each in found if each.shape in self._zone_of})

    def _come(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        self._count(arbiter, 1)

    def _part(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        self._count(arbiter, -1)

    def _count(self, arbiter: pymunk.Arbiter, by: int) -> None:
        probe, zone = arbiter.shapes
        number = self._number_of.get(probe)
        if number is not None:  # None: it is being taken out
            self._within[number][self._zone_of[zone]] += by
            self.stirred.add(number)


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
