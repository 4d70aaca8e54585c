"""Internal edges: corrects contacts of polygons at the joints of a wall, whose segments have no edges there.

`Segment.set_neighbors` makes Munk2D reject contacts with an end of a segment if the normal points over it towards the
neighbour. For discs that is exact. For other shapes Munk2D compares the nearest point with the end bit by bit, which
fails by rounding once the two overlap: then the end of the next segment stops a sliding box. Such contacts are
corrected here: a normal that leans over an end, towards the continuation of the wall, is turned to the nearest normal
of the whole wall.
"""

from collections.abc import Mapping

import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.engines.common.colliders import LEAN, SIDEWAYS, WallSegment


def smooth(arbiter: pymunk.Arbiter, joints: Mapping[pymunk.Shape, WallSegment]) -> None:
    """Correct the normal of a contact if it leans over a joint of a wall."""
    first, second = arbiter.shapes
    part = joints.get(second) or joints.get(first)
    other = first if second in joints else second
    if part is None or isinstance(other, pymunk.Circle):
        return
    normal = arbiter.normal if part is joints.get(first) else -arbiter.normal  # from the wall to the body
    turned = _corrected_normal(normal, part, other)
    if turned is None:
        return
    points = lib.cpArbiterGetContactPointSet(arbiter._arbiter)
    sign = 1.0 if part is joints.get(first) else -1.0
    points.normal = (sign * turned.x, sign * turned.y)  # pymunk's setter would merge its two points
    lib.cpArbiterSetContactPointSet(arbiter._arbiter, ffi.addressof(points))


def _corrected_normal(normal: pymunk.Vec2d, part: WallSegment, other: pymunk.Shape) -> pymunk.Vec2d | None:
    """Return the normal of the wall nearest to one that leans over a joint; None if it does not lean."""
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
