"""Precincts: which centres lie in which zones, by the zones' own outlines.

A zone is a circle, a strip with round ends, or a polygon. A polygon is not cut into convex pieces for this: a ray from
the place crosses its outline an odd number of times if the place is inside (Shimrat 1962).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.engines.kernel import kernel
from sandbox.scene.model import Zone
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Precincts(NamedTuple):
    """The outlines of Z zones, as E edges: of a circle one of no length."""

    edge: FloatArray
    """(E, 4) both ends, m"""
    first: IntArray
    """(Z + 1,) row of each one's first edge"""
    reach: FloatArray
    """(Z,) m, of circles and strips, about their edges; of polygons 0"""
    box: FloatArray
    """(Z, 4) m, left, bottom, right and top"""


def precincts_of(zones: Sequence[Zone]) -> Precincts:
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
    return Precincts(np.asarray(edges), np.asarray(first), np.asarray(reach), np.asarray(box))


@kernel
def within(edge: FloatArray, first: int, end: int, reach: float, x: float, y: float) -> bool:
    """Tell whether a place, m, is inside the zone of some edges."""
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
        share = 0.0
        if square > 0.0:
            share = min(max(((x - ax) * ux + (y - ay) * uy) / square, 0.0), 1.0)
        dx, dy = x - ax - share * ux, y - ay - share * uy
        if dx * dx + dy * dy < reach * reach:
            return True
    return inside


@kernel
def look_around(
    position: FloatArray,
    noted: BoolArray,
    edge: FloatArray,
    first: IntArray,
    reach: FloatArray,
    box: FloatArray,
    inside: BoolArray,
    stirred: BoolArray,
) -> int:
    """Bring up to date who is inside of what, and mark for whom that has changed; return how many those are.

    Args:
        position: (N, ≥ 2) centres, m.
        noted: (N,) whom zones can note; others are inside of none.
        edge: (E, 4), and so on, of `Precincts`.
        first: (Z + 1,).
        reach: (Z,) m.
        box: (Z, 4) m.
        inside: (N, Z) as it was; written to.
        stirred: (N,) written to.
    """
    count = 0
    for i in range(len(inside)):
        x, y = position[i, 0], position[i, 1]
        stirred[i] = False
        for z in range(len(reach)):
            now = False
            if noted[i] and box[z, 0] <= x and x <= box[z, 2] and box[z, 1] <= y and y <= box[z, 3]:
                now = within(edge, first[z], first[z + 1], reach[z], x, y)
            if now != inside[i, z]:
                inside[i, z] = now
                stirred[i] = True
        if stirred[i]:
            count += 1
    return count
