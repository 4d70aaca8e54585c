"""Pieces: the convex pieces of bodies, and after them the segments of walls and posts, laid out in the world."""

from typing import NamedTuple

import numpy as np

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.meeting import pair_key
from sandbox.engines.roster import NOTHING, Roster
from sandbox.scene.links import Links
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class Hulls(NamedTuple):
    """P pieces in the world, of which the first S belong to bodies."""

    corner: FloatArray
    """(V, 2) m"""
    first: IntArray
    """(P + 1,) row of each one's first corner"""
    radius: FloatArray
    """(P,) m"""
    body: IntArray
    """(S,) number of each one's body"""
    surface: IntArray
    """(S,)"""


class Pieces:
    """S pieces of bodies and G segments, which a piece of two corners or one is just as well."""

    def __init__(self, roster: Roster) -> None:
        shapes, segments = roster.bodies.shapes, roster.fixtures.segments
        self.count = len(shapes)
        self.body: IntArray = shapes.body
        self.surface: IntArray = roster.meet.surfaces.of_shape
        self.local: FloatArray = shapes.corner
        self.local_middle: FloatArray = shapes.middle
        if roster.held:  # poses are those of hinges
            self.local = shapes.corner - np.repeat(roster.hinge[shapes.body], np.diff(shapes.first), axis=0)
            self.local_middle = shapes.middle - roster.hinge[shapes.body]
        self.reach: FloatArray = shapes.reach
        self.radius: FloatArray = np.concatenate((shapes.radius, segments[:, 4]))
        ends = segments[:, :4].reshape(-1, 2)
        self.first: IntArray = np.concatenate((shapes.first, shapes.first[-1] + 2 * np.arange(1, len(segments) + 1)))
        self.corner: FloatArray = np.concatenate((self.local, ends))
        """(V + 2G, 2) m, in the world as it was last laid out"""
        self.middle: FloatArray = np.empty((self.count, 2))
        """(S, 2) m, likewise"""
        self.meets: IntArray = roster.meets[self.body]
        self.moves: BoolArray = roster.mobile[self.body]
        self.able: BoolArray = roster.moving[self.body] & (self.meets > NOTHING)
        self.apart: IntArray = apart_keys(roster.links)
        if roster.held:
            self.able = self.able & ~roster.led[self.body]
            self.apart = np.union1d(self.apart, led_keys(roster))
        self.group: IntArray = roster.bodies.group
        """(N,) of each body"""

    @property
    def hulls(self) -> Hulls:
        """Where and what they are, as they were last laid out."""
        return Hulls(self.corner, self.first, self.radius, self.body, self.surface)

    def lay_out(self, position: FloatArray, angle: FloatArray) -> None:
        """Put corners and middles where bodies now lie, at (N, ≥ 2) m and (N,) rad."""
        lay_out(self.body, self.first, self.local, self.local_middle, position, angle, self.corner, self.middle)


def apart_keys(links: Links) -> IntArray:
    """Return keys of the pairs of bodies that joints keep from meeting, (K,), ascending."""
    return np.sort([pair_key(a, b) for a, b in links.apart().tolist()]).astype(np.int64)


def led_keys(roster: Roster) -> IntArray:
    """Return keys of the pairs of bodies of which nothing moves either, (K,), ascending: led ones, and fixed ones."""
    firm = np.flatnonzero(roster.led | roster.bodies.fixed)
    led = np.flatnonzero(roster.led)
    keys = [pair_key(min(a, b), max(a, b)) for a in led.tolist() for b in firm.tolist() if a != b]
    return np.unique(np.asarray(keys, np.int64))


@kernel
def lay_out(
    body: IntArray,
    first: IntArray,
    local: FloatArray,
    local_middle: FloatArray,
    position: FloatArray,
    angle: FloatArray,
    corner: FloatArray,
    middle: FloatArray,
) -> None:
    """Turn and move the corners and middles of pieces into the world."""
    for p in range(len(body)):
        b = body[p]
        x, y, cos, sin = position[b, 0], position[b, 1], np.cos(angle[b]), np.sin(angle[b])
        for k in range(first[p], first[p + 1]):
            u, v = local[k, 0], local[k, 1]
            corner[k, 0], corner[k, 1] = x + cos * u - sin * v, y + sin * u + cos * v
        u, v = local_middle[p, 0], local_middle[p, 1]
        middle[p, 0], middle[p, 1] = x + cos * u - sin * v, y + sin * u + cos * v
