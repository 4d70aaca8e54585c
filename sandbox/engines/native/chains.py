"""Chains: contacts of polygons near the joints of a wall, which are no edges of it.

`Segment.set_neighbors` makes Munk2D refuse contacts with an end of a segment beyond which the wall comes nearer. For
discs that is exact. For other shapes Munk2D compares the nearest point with the end bit by bit, which rounding defeats
once the two overlap: then the end of the next segment stops a box that slides. Such contacts are corrected here: a
normal that leans over an end, towards where the wall runs on, is turned to the nearest that the whole wall would give.
"""

from collections.abc import Mapping

import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.engines.fixtures import WallSegment

LEAN = 1e-9
"""Sine of the angle up to which a normal does not lean: what is level is so but for rounding."""

SIDEWAYS = 0.1
"""A normal nearer than this to a segment's own direction, as a sine, does not say on which side of it a body lies."""


def smooth(arbiter: pymunk.Arbiter, joints: Mapping[pymunk.Shape, WallSegment]) -> None:
    """Turn the normal of a contact that leans over a joint of a wall."""
    first, second = arbiter.shapes
    part = joints.get(second) or joints.get(first)
    other = first if second in joints else second
    if part is None or isinstance(other, pymunk.Circle):
        return
    normal = arbiter.normal if part is joints.get(first) else -arbiter.normal  # from the wall to the body
    turned = _turned(normal, part, other)
    if turned is None:
        return
    points = lib.cpArbiterGetContactPointSet(arbiter._arbiter)
    sign = 1.0 if part is joints.get(first) else -1.0
    points.normal = (sign * turned.x, sign * turned.y)  # pymunk's own setter makes its two points one
    lib.cpArbiterSetContactPointSet(arbiter._arbiter, ffi.addressof(points))


def _turned(normal: pymunk.Vec2d, part: WallSegment, other: pymunk.Shape) -> pymunk.Vec2d | None:
    """Return the normal of the wall nearest to one that leans over a joint; none for one that does not."""
    a, b = pymunk.Vec2d(*part.a), pymunk.Vec2d(*part.b)
    along = (b - a).normalized()
    lean = normal.dot(along)
    if abs(lean) <= LEAN:
        return None
    end, sign = (part.after, 1.0) if lean > 0.0 else (part.before, -1.0)
    if end is None:
        return None
    onward = (pymunk.Vec2d(*end) - (b if lean > 0.0 else a)).normalized()
    if normal.dot(onward) <= LEAN:
        return None
    left = along.perpendicular()
    side = normal.dot(left)
    if abs(side) < SIDEWAYS:
        side = (other.bb.center() - a).dot(left)
    side = 1.0 if side >= 0.0 else -1.0
    own, its = side * left, side * sign * onward.perpendicular()
    return own if normal.dot(own) >= normal.dot(its) else its
