"""Held: how far bodies can fall that hang on something by rods, strings and pivots."""

import heapq
import math

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.joint_arrays import WORLD, LinkKind
from sandbox.scene.scene import Scene

Ways = list[list[tuple[int, float]]]


def farthest_fall(scene: Scene, down: FloatArray) -> FloatArray:
    """Return how far along `down` each body can get at most, (N,) m; inf where nothing holds it to what stands still.

    From each place in the world, or on a fixed body, that something hangs on: as far as the rods, the slides at their
    longest, and the ways through the bodies between their joints add up to.
    """
    bodies, links = scene.bodies, scene.links
    links = links.of(LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE)
    length = np.where(links.kind == LinkKind.ROD, links.figures[:, 0], 0.0)
    length = np.where(links.kind == LinkKind.SLIDE, links.figures[:, 1], length)
    arm_a, arm_b = (np.hypot(*each.T) for each in (links.anchor_a, links.anchor_b))
    still = np.append(bodies.fixed, True)  # the world is −1, the last
    ways: Ways = [[] for _ in range(len(bodies))]
    begin: list[tuple[int, float, FloatArray]] = []
    first, second = links.ends(bodies.position, bodies.angle)
    for k, (a, b) in enumerate(zip(links.a.tolist(), links.b.tolist(), strict=True)):
        if still[a] and not still[b]:
            begin.append((b, float(length[k] + arm_b[k]), first[k]))
        elif a != WORLD and still[b] and not still[a]:
            begin.append((a, float(length[k] + arm_a[k]), second[k]))
        elif not still[a] and not still[b]:
            way = float(length[k] + arm_a[k] + arm_b[k])
            ways[a].append((b, way))
            ways[b].append((a, way))
    fall = np.full(len(bodies), math.inf)
    for place, reach in _by_place(begin):
        lowest = float(place @ down) + _reached(reach, ways)
        fall = np.minimum(fall, lowest - bodies.position @ down)
    return fall


def _by_place(begin: list[tuple[int, float, FloatArray]]) -> list[tuple[FloatArray, list[tuple[float, int]]]]:
    """Gather what hangs on the same place."""
    found: dict[tuple[float, float], list[tuple[float, int]]] = {}
    for number, way, place in begin:
        found.setdefault((float(place[0]), float(place[1])), []).append((way, number))
    few = list(found.items())[:MOST_PLACES]
    return [(np.asarray(place), reach) for place, reach in few]


MOST_PLACES = 100
"""Places looked at: each costs a walk over all joints. Of more, the bounds of the others are left out."""


def _reached(reach: list[tuple[float, int]], ways: Ways) -> FloatArray:
    """Return the shortest way to each body, (N,) m, from where some are reached (E. W. Dijkstra 1959)."""
    shortest = np.full(len(ways), math.inf)
    heap = list(reach)
    heapq.heapify(heap)
    while heap:
        way, number = heapq.heappop(heap)
        if way >= shortest[number]:
            continue
        shortest[number] = way
        for other, more in ways[number]:
            if way + more < shortest[other]:
                heapq.heappush(heap, (way + more, other))
    return shortest
