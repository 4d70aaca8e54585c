"""Laid: which bodies lie on or in each other as a scene starts."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.measure.distance import hull_distance
from sandbox.measure.forecast.passages import meet_each_other
from sandbox.measure.lying import pieces_over_time
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.scene import Scene

CLOSE = 0.02
"""The share of the thinner one's half width within which two bodies lie on each other."""
MOST = 4000
"""Pairs measured; of the others nothing is told. One takes some 0.1 ms."""


class Laid(NamedTuple):
    """K pairs of bodies close together, at least one of each pair no ball."""

    first: IntArray
    """(K,)"""
    second: IntArray
    """(K,)"""
    gap: FloatArray
    """(K,) m, negative where they overlap"""


def laid(scene: Scene) -> Laid:
    """Return the pairs that can meet, of which one moves and one is no ball, and that are `CLOSE` or overlap."""
    bodies = scene.bodies
    among = np.flatnonzero(meet_each_other(bodies) & (bodies.core >= 0.0))
    found: list[tuple[int, int, float]] = []
    apart = {(a, b) for a, b in scene.links.apart().tolist()}
    if len(among) < 2 or bodies.round[among].all():
        return Laid(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
    looked = 0
    for i, j in near_pairs(bodies.position[among], 2.05 * float(bodies.radius[among].max())):
        a, b = np.minimum(among[i], among[j]), np.maximum(among[i], among[j])
        slack = CLOSE * np.minimum(bodies.thin[a], bodies.thin[b])
        away = np.hypot(*(bodies.position[a] - bodies.position[b]).T) - bodies.radius[a] - bodies.radius[b]
        able = (bodies.group[a] == 0) | (bodies.group[a] != bodies.group[b])
        able &= (away < slack) & ~(bodies.round[a] & bodies.round[b]) & ~(bodies.fixed[a] & bodies.fixed[b])
        for first, second, most in zip(a[able].tolist(), b[able].tolist(), slack[able].tolist(), strict=True):
            looked += 1
            if looked > MOST:
                break
            if (first, second) not in apart and (gap := _gap(bodies, first, second)) <= most:
                found.append((first, second, gap))
        if looked > MOST:
            break
    ones, others, gaps = ([row[k] for row in found] for k in range(3))
    return Laid(
        np.asarray(ones, dtype=np.int64), np.asarray(others, dtype=np.int64), np.asarray(gaps, dtype=np.float64)
    )


def _gap(bodies: Bodies, first: int, second: int) -> float:
    """Return the distance of two bodies as they start, m."""
    one, other = (
        list(pieces_over_time(bodies, n, bodies.position[n][None], bodies.angle[n][None])) for n in (first, second)
    )
    return min(float(hull_distance(a, b)[0]) - r - s for a, r in one for b, s in other)
