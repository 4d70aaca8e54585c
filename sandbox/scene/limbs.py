"""Limbs: where the segments of a ragdoll start, and the joints that hold them within their bounds."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.scene.layout import Layout, turned
from sandbox.scene.links import LinkKind, Links
from sandbox.scene.near import FloatArray
from sandbox.scene.part import Point
from sandbox.scene.ragdoll import STRIDE, Ragdoll, Segment, segments


class Pose(NamedTuple):
    """Where a segment is, and what turns with it."""

    middle: Point
    """of the segment, m"""
    joint: Point
    """to its parent, m"""
    tilt: float
    """how far it is turned from where it is when the figure stands straight, rad, anticlockwise as it faces right"""


def limb_layout(ragdoll: Ragdoll) -> Layout:
    """Lay out the segments of a ragdoll in stride, the lower foot on the ground."""
    parts, flip = segments(ragdoll), _flip(ragdoll)
    poses: dict[str, Pose] = {}
    for name in parts:
        _pose(name, parts, poses)
    ground = min(poses[name].middle[1] - parts[name].radius for name in parts if name.endswith("foot"))
    offset = np.asarray([(flip * pose.middle[0], pose.middle[1] - ground) for pose in (poses[name] for name in parts)])
    offset = turned(offset * ragdoll.height, ragdoll.angle)
    spin = ragdoll.angular_velocity
    count = len(parts)
    angle = [axis_of(part, flip) + flip * poses[name].tilt + ragdoll.angle for name, part in parts.items()]
    return Layout(
        position=np.asarray(ragdoll.position) + offset,
        velocity=np.asarray(ragdoll.velocity) + spin * np.column_stack((-offset[:, 1], offset[:, 0])),
        angle=np.asarray(angle),
        angular_velocity=np.full(count, spin),
        fixed=np.zeros(count, np.bool_),
        element=np.arange(count),
        endings=tuple(parts),
        alone=True,
        elements=count,
    )


def limb_links(ragdoll: Ragdoll) -> Links:
    """Return a ragdoll's pivots, then the bounds of the same joints, by the numbers of its segments."""
    parts, flip = segments(ragdoll), _flip(ragdoll)
    number = {name: k for k, name in enumerate(parts)}
    joined = [(name, part) for name, part in parts.items() if part.parent]
    a, b = [number[part.parent] for _, part in joined], [number[name] for name, _ in joined]
    anchor_a = [_anchor(parts[part.parent], part.joint, flip, ragdoll.height) for _, part in joined]
    anchor_b = [_anchor(part, part.joint, flip, ragdoll.height) for _, part in joined]
    pivots = Links.alike(LinkKind.PIVOT, a, b, np.asarray(anchor_a), np.asarray(anchor_b))
    bounds = [_bounds(part, parts[part.parent], flip) for _, part in joined]
    return pivots.joined(Links.alike(LinkKind.ROTARY_LIMIT, a, b, figures=np.asarray(bounds)))


def _flip(ragdoll: Ragdoll) -> float:
    """Return what x and angles are multiplied by."""
    return 1.0 if ragdoll.facing == "right" else -1.0


def _pose(name: str, parts: dict[str, Segment], poses: dict[str, Pose]) -> Pose:
    """Find a segment's pose from its parent's, in shares of the height, facing right."""
    if name in poses:
        return poses[name]
    part, (side, _, limb) = parts[name], name.partition("-")
    tilt, joint = math.radians(STRIDE.get(side, {}).get(limb, 0.0)), part.joint
    if part.parent:
        parent, drawn = _pose(part.parent, parts, poses), parts[part.parent]
        tilt += parent.tilt
        base, away = drawn.joint if drawn.parent else middle_of(drawn), parent.tilt
        at = parent.joint if drawn.parent else parent.middle
        joint = _carried(part.joint, base, at, away)
    middle = _carried(middle_of(part), part.joint, joint, tilt) if part.parent else middle_of(part)
    poses[name] = Pose(middle, joint, tilt)
    return poses[name]


def _carried(point: Point, base: Point, at: Point, tilt: float) -> Point:
    """Return where a point is after its segment was turned about a base, which now is somewhere."""
    x, y = point[0] - base[0], point[1] - base[1]
    cos, sin = math.cos(tilt), math.sin(tilt)
    return at[0] + cos * x - sin * y, at[1] + sin * x + cos * y


def middle_of(part: Segment) -> Point:
    """Return the middle of a segment as it is drawn."""
    (ax, ay), (bx, by) = part.ends[0], part.ends[-1]
    return 0.5 * (ax + bx), 0.5 * (ay + by)


def axis_of(part: Segment, flip: float) -> float:
    """Return the angle of a segment's body when the figure stands straight: that of a capsule's line, of a ball 0."""
    if len(part.ends) == 1:
        return 0.0
    (ax, ay), (bx, by) = part.ends
    axis = math.atan2(by - ay, bx - ax)
    return axis if flip > 0.0 else -math.pi - axis  # what hangs down does so either way


def _anchor(part: Segment, joint: Point, flip: float, height: float) -> FloatArray:
    """Return where a segment's own frame has a joint, (2,) m."""
    x, y = middle_of(part)
    away = np.asarray([[flip * (joint[0] - x), joint[1] - y]]) * height
    return turned(away, -axis_of(part, flip)).reshape(2)


def _bounds(part: Segment, parent: Segment, flip: float) -> tuple[float, float, float]:
    """Return the bounds of a joint as those of the angle between its bodies, rad."""
    straight = axis_of(part, flip) - axis_of(parent, flip)
    least, most = sorted(flip * math.radians(bound) for bound in part.bounds)
    return straight + least, straight + most, 0.0
