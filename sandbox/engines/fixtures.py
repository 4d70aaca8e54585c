"""Fixtures: the planes, walls and posts of a scene as arrays, for the engines written by hand."""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.scene.model import Plane, Scene, Wall
from sandbox.trajectory import FloatArray, IntArray


class Fixtures(NamedTuple):
    """What never moves. Fixed thing k (planes, walls, posts in scene order) is numbered k here, −1 − k in contacts."""

    planes: FloatArray
    """(P, 4) a point of the surface, m, and the unit normal out of the solid"""
    plane_thing: IntArray
    """(P,) which fixed thing each is"""
    segments: FloatArray
    """(G, 5) both ends and half the thickness, m; a post is a segment of no length"""
    segment_thing: IntArray
    """(G,) which fixed thing each belongs to"""


def fixtures_of(scene: Scene, everything: bool = False) -> Fixtures:
    """Lay out a scene's fixed things: those that are solid, or everything."""
    planes, segments = [], []
    for k, thing in enumerate(scene.fixed):
        if not (isinstance(thing, Plane) or thing.solid or everything):
            continue
        if isinstance(thing, Plane):
            # Scaled first: the square of a very long or short normal would leave the range of doubles.
            largest = max(abs(thing.normal[0]), abs(thing.normal[1]))
            x, y = thing.normal[0] / largest, thing.normal[1] / largest
            length = math.hypot(x, y)
            planes.append((k, *thing.point, x / length, y / length))
        elif isinstance(thing, Wall):
            ends = (*thing.points, thing.points[0]) if thing.closed else thing.points
            segments += [(k, *a, *b, thing.thickness / 2.0) for a, b in pairwise(ends)]
        else:
            segments.append((k, *thing.position, *thing.position, thing.radius))
    flat = np.asarray(planes, dtype=np.float64).reshape(-1, 5)
    thin = np.asarray(segments, dtype=np.float64).reshape(-1, 6)
    return Fixtures(flat[:, 1:].copy(), flat[:, 0].astype(np.int64), thin[:, 1:].copy(), thin[:, 0].astype(np.int64))
