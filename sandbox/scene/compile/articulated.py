"""Ropes, cloths and ragdolls: their bodies and joints."""

import math
import sys
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.bodies import Layout, link_length, rotated, uniform_layout
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind
from sandbox.scene.description.base import Point
from sandbox.scene.description.generators import ENDS, STRIDE, BodySegment, Cloth, Ragdoll, Rope, RopeEnd, segments
from sandbox.scene.geometry.vectors import to_world

STARTS_AT, ENDS_AT = -2, -3
"""Placeholders for the bodies that the start and the end of a rope are tied to, in the joints of the rope."""


def node_count(rope: Rope) -> int:
    """Return the number of bodies of a rope: planks, or nodes without tied ends, which are other bodies."""
    if rope.kind == "planks":
        return rope.links
    return rope.links + 1 - sum(rope.tied(end) is not None for end in ENDS)


def rope_layout(rope: Rope, gravity: Point) -> Layout:
    """Return the start state of the nodes or planks of a rope, from its start to its end."""
    position = rope_course(rope, (rope.gravity_scale * gravity[0], rope.gravity_scale * gravity[1]))
    if rope.kind == "planks":
        step = np.diff(position, axis=0)
        return uniform_layout(
            0.5 * (position[:-1] + position[1:]), rope.velocity, np.arctan2(step[:, 1], step[:, 0]), 0.0
        )
    fixed = np.zeros(len(position), np.bool_)
    fixed[[0, -1]] = [rope.holds(end) for end in ENDS]
    is_node = np.ones(len(position), np.bool_)
    is_node[[0, -1]] = [rope.tied(end) is None for end in ENDS]
    return uniform_layout(position[is_node], rope.velocity, rope.angle, rope.angular_velocity, fixed[is_node])


def rope_course(rope: Rope, gravity: Point) -> FloatArray:
    """Return the ends of a rope's links, (links + 1, 2) m: on a straight line, or on an arc for a longer rope."""
    start, end = np.asarray(rope.start), np.asarray(rope.end)
    chord = end - start
    distance, length = float(math.hypot(*chord)), link_length(rope)
    fraction = np.arange(rope.links + 1)[:, None] / rope.links
    half = half_turn(rope.links, distance / length)
    if half == 0.0:
        return start * (1.0 - fraction) + end * fraction
    down = np.asarray(gravity) if any(gravity) else np.asarray((0.0, -1.0))
    apart = distance >= sys.float_info.min  # smaller values have too few digits for a direction
    along = chord / distance if apart else np.asarray((-down[1], down[0])) / math.hypot(*down)
    across = np.asarray((along[1], -along[0]))  # to the right of the chord, for an arc that turns left
    if across @ down < 0.0:
        across = -across
    # Adjacent chords differ by twice the half turn; the first deviates by half the total turn.
    tilt = half * (rope.links - 1 - 2 * np.arange(rope.links))
    step = length * (np.outer(np.cos(tilt), along) + np.outer(np.sin(tilt), across))
    return start + np.vstack((np.zeros(2), np.cumsum(step, axis=0)))


def half_turn(links: int, ratio: float) -> float:
    """Return half the angle between adjacent equal chords of an arc; 0 for a straight line.

    Args:
        links: number of chords, n.
        ratio: distance of the ends in lengths of a chord: sin(n·a) / sin(a), solved for a.
    """
    if ratio >= links:
        return 0.0
    low, high = 0.0, math.pi / links
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return middle
        if math.sin(links * middle) > ratio * math.sin(middle):
            low = middle
        else:
            high = middle


def rope_joints(rope: Rope) -> JointArrays:
    """Return the joints of a rope by the indices of its own bodies, with `STARTS_AT` and `ENDS_AT` for other bodies."""
    length, count = link_length(rope), node_count(rope)
    if rope.kind != "planks":
        first, last = (rope.tied(end) is not None for end in ENDS)
        node = np.concatenate(([STARTS_AT] * first, np.arange(count), [ENDS_AT] * last)).astype(np.int64)
        if rope.kind == "rods":
            return JointArrays.alike(JointKind.ROD, node[:-1], node[1:], figures=(length, 0.0, 0.0))
        assert rope.stiffness is not None
        figures = length, rope.stiffness, rope.damping
        return JointArrays.alike(JointKind.SPRING, node[:-1], node[1:], figures=figures)
    half, plank = 0.5 * length, np.arange(count)
    joints = JointArrays.alike(JointKind.PIVOT, plank[:-1], plank[1:], (half, 0.0), (-half, 0.0))
    ends: tuple[tuple[RopeEnd, int, Point, int, float], ...] = (
        ("start", 0, rope.start, STARTS_AT, -half),
        ("end", count - 1, rope.end, ENDS_AT, half),
    )
    for end, body, position, placeholder, anchor in ends:
        if rope.tied(end) is not None:
            joint = JointArrays.alike(JointKind.PIVOT, [placeholder], [body], (0.0, 0.0), (anchor, 0.0))
        elif rope.holds(end):
            joint = JointArrays.alike(JointKind.PIVOT, [WORLD], [body], position, (anchor, 0.0))
        else:
            continue
        joints = joints.joined(joint)
    return joints


def cloth_layout(cloth: Cloth) -> Layout:
    """Return the start state of the nodes of a cloth, row by row from the top, each from the left."""
    row, column = np.divmod(np.arange(cloth.columns * cloth.rows), cloth.columns)
    position = np.asarray(cloth.corner) + np.column_stack((column, -row)) * np.asarray(cloth.spacing)
    fixed = np.zeros(len(position), np.bool_)
    fixed[[column + row * cloth.columns for column, row in cloth.pinned]] = True
    return uniform_layout(position, cloth.velocity, cloth.angle, cloth.angular_velocity, fixed)


def cloth_joints(cloth: Cloth) -> JointArrays:
    """Return the joints of a cloth by the indices of its nodes: rows, columns, diagonals, then next-but-one nodes."""
    across, down = cloth.spacing
    if cloth.kind == "rods":
        joints = _mesh(cloth, 1, 0, across).joined(_mesh(cloth, 0, 1, down))
    else:
        joints = _mesh(cloth, 1, 0, across, cloth.stiffness).joined(_mesh(cloth, 0, 1, down, cloth.stiffness))
    if cloth.shear is not None:
        for direction in (1, -1):
            joints = joints.joined(_mesh(cloth, direction, 1, math.hypot(across, down), cloth.shear))
    if cloth.bend is not None:
        joints = joints.joined(_mesh(cloth, 2, 0, 2.0 * across, cloth.bend))
        joints = joints.joined(_mesh(cloth, 0, 2, 2.0 * down, cloth.bend))
    return joints


def _mesh(cloth: Cloth, right: int, down: int, length: float, stiffness: float | None = None) -> JointArrays:
    """Join every node to the one at an offset of columns and rows: by springs, or by rods without a stiffness."""
    index = np.arange(cloth.columns * cloth.rows).reshape(cloth.rows, cloth.columns)
    height, width = max(cloth.rows - down, 0), max(cloth.columns - abs(right), 0)
    left, other = max(-right, 0), max(right, 0)
    a = index[:height, left : left + width].ravel()
    b = index[down : down + height, other : other + width].ravel()
    if stiffness is None:
        return JointArrays.alike(JointKind.ROD, a, b, figures=(length, 0.0, 0.0))
    return JointArrays.alike(JointKind.SPRING, a, b, figures=(length, stiffness, cloth.damping))


class Pose(NamedTuple):
    """Position and rotation of a segment."""

    middle: Point
    """centre of the segment, m"""
    joint: Point
    """joint to its parent, m"""
    tilt: float
    """rotation from the anatomical position, rad, counter-clockwise for a figure that faces right"""


def limb_layout(ragdoll: Ragdoll) -> Layout:
    """Return the start state of the segments of a ragdoll in mid-stride, with the lower foot on the ground."""
    parts, flip = segments(ragdoll), _flip(ragdoll)
    poses: dict[str, Pose] = {}
    for name in parts:
        _pose(name, parts, poses)
    ground = min(poses[name].middle[1] - parts[name].radius for name in parts if name.endswith("foot"))
    offset = np.asarray([(flip * pose.middle[0], pose.middle[1] - ground) for pose in (poses[name] for name in parts)])
    offset = rotated(offset * ragdoll.height, ragdoll.angle)
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


def limb_joints(ragdoll: Ragdoll) -> JointArrays:
    """Return the pivots of a ragdoll, then the limits of the same joints, by the indices of its segments."""
    parts, flip = segments(ragdoll), _flip(ragdoll)
    index = {name: k for k, name in enumerate(parts)}
    joined = [(name, part) for name, part in parts.items() if part.parent]
    a, b = [index[part.parent] for _, part in joined], [index[name] for name, _ in joined]
    anchor_a = [_anchor(parts[part.parent], part.joint, flip, ragdoll.height) for _, part in joined]
    anchor_b = [_anchor(part, part.joint, flip, ragdoll.height) for _, part in joined]
    pivots = JointArrays.alike(JointKind.PIVOT, a, b, np.asarray(anchor_a), np.asarray(anchor_b))
    bounds = [_bounds(part, parts[part.parent], flip) for _, part in joined]
    return pivots.joined(JointArrays.alike(JointKind.ROTARY_LIMIT, a, b, figures=np.asarray(bounds)))


def _flip(ragdoll: Ragdoll) -> float:
    """Return the factor of x and angles: 1 facing right, −1 facing left."""
    return 1.0 if ragdoll.facing == "right" else -1.0


def _pose(name: str, parts: dict[str, BodySegment], poses: dict[str, Pose]) -> Pose:
    """Return the pose of a segment from that of its parent, in fractions of the height, facing right."""
    if name in poses:
        return poses[name]
    part, (side, _, limb) = parts[name], name.partition("-")
    tilt, joint = math.radians(STRIDE.get(side, {}).get(limb, 0.0)), part.joint
    if part.parent:
        parent, parent_part = _pose(part.parent, parts, poses), parts[part.parent]
        tilt += parent.tilt
        base, parent_tilt = parent_part.joint if parent_part.parent else middle_of(parent_part), parent.tilt
        parent_joint = parent.joint if parent_part.parent else parent.middle
        joint = _follow_parent(part.joint, base, parent_joint, parent_tilt)
    middle = _follow_parent(middle_of(part), part.joint, joint, tilt) if part.parent else middle_of(part)
    poses[name] = Pose(middle, joint, tilt)
    return poses[name]


def _follow_parent(point: Point, base: Point, at: Point, tilt: float) -> Point:
    """Return a point of a segment after a rotation about a base point that has moved."""
    return to_world((point[0] - base[0], point[1] - base[1]), math.cos(tilt), math.sin(tilt), at)


def middle_of(part: BodySegment) -> Point:
    """Return the centre of a segment in the anatomical position."""
    (ax, ay), (bx, by) = part.ends[0], part.ends[-1]
    return 0.5 * (ax + bx), 0.5 * (ay + by)


def axis_of(part: BodySegment, flip: float) -> float:
    """Return the angle of a segment's body in the anatomical position: of a capsule's line; 0 for a ball."""
    if len(part.ends) == 1:
        return 0.0
    (ax, ay), (bx, by) = part.ends
    axis = math.atan2(by - ay, bx - ax)
    return axis if flip > 0.0 else -math.pi - axis  # a limb that hangs down is the same in both directions


def _anchor(part: BodySegment, joint: Point, flip: float, height: float) -> FloatArray:
    """Return the position of a joint in the frame of a segment, (2,) m."""
    x, y = middle_of(part)
    away = np.asarray([[flip * (joint[0] - x), joint[1] - y]]) * height
    return rotated(away, -axis_of(part, flip)).reshape(2)


def _bounds(part: BodySegment, parent: BodySegment, flip: float) -> tuple[float, float, float]:
    """Return the limits of a joint as limits of the angle between its bodies, rad."""
    straight = axis_of(part, flip) - axis_of(parent, flip)
    lower, upper = sorted(flip * math.radians(bound) for bound in part.bounds)
    return straight + lower, straight + upper, 0.0
