"""Gaps: how far apart the two of a pair are, frame by frame."""

import math
from itertools import pairwise

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Plane, Post, Scene
from sandbox.trajectory import FloatArray


def gap(scene: Scene, bodies: Bodies, position: FloatArray, pair: tuple[int, int]) -> FloatArray:
    """Return the distance between two surfaces, (T,) m, negative where they overlap.

    Args:
        scene: gives the fixed things.
        bodies: its bodies.
        position: (T, N, 2) m.
        pair: numbers as in `Contacts`: the second may be −1 − k for the k-th fixed thing.
    """
    first, second = pair
    centre = position[:, first]
    radius = float(bodies.radius[first])
    if second >= 0:
        return _distance(centre - position[:, second]) - radius - float(bodies.radius[second])
    thing = scene.fixed[-1 - second]
    if isinstance(thing, Plane):
        normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
        return np.asarray((centre - np.asarray(thing.point)) @ normal - radius)
    if isinstance(thing, Post):
        return _distance(centre - np.asarray(thing.position)) - radius - thing.radius
    points = [*thing.points, thing.points[0]] if thing.closed else list(thing.points)
    nearest = np.full(len(centre), np.inf)
    for tail, tip in pairwise(points):
        nearest = np.fmin(nearest, _from_segment(centre, np.asarray(tail), np.asarray(tip)))
    return nearest - radius - 0.5 * thing.thickness


def _distance(vector: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.hypot(vector[:, 0], vector[:, 1]))


def _from_segment(centre: FloatArray, tail: FloatArray, tip: FloatArray) -> FloatArray:
    along = tip - tail
    squared = float(along @ along)
    share = ((centre - tail) @ along / squared).clip(0.0, 1.0) if squared > 0.0 else np.zeros(len(centre))
    return _distance(centre - tail - share[:, None] * along)
