"""Picking: which body lies under the hand, and which overlap something."""

from itertools import pairwise

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.scene.near import near_pairs
from sandbox.trajectory import BoolArray, FloatArray, Frame


def picked(bodies: Bodies, frame: Frame, place: tuple[float, float], reach: float = 0.0) -> int | None:
    """Return the body at a place, m; of several the one whose centre is nearest for its size, else one within reach.

    Args:
        bodies: N of them.
        frame: where they are.
        place: m.
        reach: how far beside a body one may point, m.
    """
    count = min(len(bodies), len(frame.position))
    with np.errstate(all="ignore"):
        distance = np.hypot(*(frame.position[:count] - np.asarray(place)).T)
        radius = bodies.radius[:count]
        able = frame.present[:count] & (distance <= radius + reach)
        if not able.any():
            return None
        score = np.where(able, np.where(distance <= radius, distance / radius, 1.0 + distance - radius), np.inf)
    return int(np.argmin(score))


def overlapping(scene: Scene, bodies: Bodies, frame: Frame) -> BoolArray:
    """Tell which bodies overlap a plane, wall, post or one another, (N,); what just touches does not."""
    position, radius, there = frame.position, bodies.radius[: len(frame.position)], frame.present
    found = np.zeros(len(position), np.bool_)
    with np.errstate(all="ignore"):
        for plane in scene.planes:
            normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
            found |= (position - np.asarray(plane.point)) @ normal < radius
        for wall in scene.walls:
            points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
            for a, b in pairwise(points):
                found |= _to_segment(position, a, b) < radius + wall.thickness / 2.0
        for post in scene.posts:
            found |= np.hypot(*(position - np.asarray(post.position)).T) < radius + post.radius
    able = np.flatnonzero(there & np.isfinite(position).all(axis=1))
    reach = 2.0 * float(radius[able].max()) if len(able) else 0.0
    for i, j in near_pairs(position[able], reach):
        a, b = able[i], able[j]
        over = np.hypot(*(position[a] - position[b]).T) < radius[a] + radius[b]
        found[a[over]] = found[b[over]] = True
    return found & there


def _to_segment(position: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    along = b - a
    share = np.clip((position - a) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.hypot(*(position - a - share[:, None] * along).T))
