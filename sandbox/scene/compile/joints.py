"""Joints of a scene as arrays, including those of ropes, cloths and ragdolls."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.articulated import ENDS_AT, STARTS_AT, cloth_joints, limb_joints, rope_joints
from sandbox.scene.compile.bodies import Bodies, rotated
from sandbox.scene.compile.drives import is_immovable
from sandbox.scene.compile.generators import count_of
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind, last_click
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.generators import ENDS, Cloth, Ragdoll, Rope, SoftBody
from sandbox.scene.description.joints import (
    Anchored,
    ErrorCorrecting,
    ForceLimited,
    Gear,
    Groove,
    Joint,
    Motor,
    Pivot,
    Pulley,
    Ratchet,
    Rod,
    RotaryLimit,
    RotarySpring,
    Slide,
    Spring,
)
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.geometry.vectors import rotate, to_world


def generator_joints(scene: SceneDescription, bodies: Bodies) -> JointArrays:
    """Return the joints of a scene's generators, in their order, each numbered from 0.

    The bodies that ropes are tied to must exist. Joints between bodies that cannot move are omitted.
    """
    joint_arrays = JointArrays.none()
    if not (scene.ropes or scene.cloths or scene.ragdolls):
        return joint_arrays
    first, immovable = 0, np.append(is_immovable(scene, bodies), True)  # the world, −1, selects the last row
    for kind, sources in scene.kinds.items():
        for k, source in enumerate(sources):
            joints = _joints_of(source, first, bodies)
            first += count_of(source)
            joints = joints.some(~(immovable[joints.a] & immovable[joints.b]))
            if isinstance(source, SoftBody) and source.strength is not None:
                joints = replace(joints, strength=np.full(len(joints), source.strength))
            stem = source.name or default_name(kind, k)
            joint_arrays = joint_arrays.joined(
                replace(joints, names=tuple(f"{stem}-joint-{n}" for n in range(1, len(joints) + 1)))
            )
    return joint_arrays


def _joints_of(source: BodySource, first: int, bodies: Bodies) -> JointArrays:
    """Return the joints of one generator, given the index of its first body."""
    match source:
        case Rope():
            return _attach_rope_ends(_with_body_indices(rope_joints(source), first), source, bodies)
        case Cloth():
            return _with_body_indices(cloth_joints(source), first)
        case Ragdoll():
            return _with_body_indices(limb_joints(source), first)
        case _:
            return JointArrays.none()


def _with_body_indices(joints: JointArrays, first: int) -> JointArrays:
    """Return joints by the indices of a scene's bodies; negative indices stand for the world or the ends of a rope."""
    return replace(
        joints,
        a=np.where(joints.a < 0, joints.a, joints.a + first),
        b=np.where(joints.b < 0, joints.b, joints.b + first),
    )


def _attach_rope_ends(joints: JointArrays, rope: Rope, bodies: Bodies) -> JointArrays:
    """Return the joints of a rope with the bodies at its ends, anchored where the ends start."""
    for end, position, placeholder in zip(ENDS, (rope.start, rope.end), (STARTS_AT, ENDS_AT), strict=True):
        name = rope.tied(end)
        if name is not None:
            number = bodies.number_of[name]
            anchor = _to_body_frame(position, number, bodies)
            first, second = joints.a == placeholder, joints.b == placeholder
            joints = replace(
                joints,
                a=np.where(first, number, joints.a),
                b=np.where(second, number, joints.b),
                anchor_a=np.where(first[:, None], anchor, joints.anchor_a),
                anchor_b=np.where(second[:, None], anchor, joints.anchor_b),
            )
    return joints


def _to_body_frame(position: Point, number: int, bodies: Bodies) -> FloatArray:
    """Return a position in the world in the frame of a body about its centre of mass, (2,) m."""
    return rotated(np.asarray([position]) - bodies.position[number], -float(bodies.angle[number])).reshape(2)


KINDS: dict[type, JointKind] = {
    Rod: JointKind.ROD,
    Pivot: JointKind.PIVOT,
    Slide: JointKind.SLIDE,
    Groove: JointKind.GROOVE,
    RotaryLimit: JointKind.ROTARY_LIMIT,
    Motor: JointKind.MOTOR,
    Gear: JointKind.GEAR,
    Spring: JointKind.SPRING,
    RotarySpring: JointKind.ROTARY_SPRING,
    Pulley: JointKind.PULLEY,
    Ratchet: JointKind.RATCHET,
}


def compile_joints(scene: SceneDescription, bodies: Bodies) -> JointArrays:
    """Return the joints of a scene between its bodies: those of the file, then those of generators."""
    return _file_joints(scene, bodies).joined(generator_joints(scene, bodies)).counted()


def _file_joints(scene: SceneDescription, bodies: Bodies) -> JointArrays:
    """Return the joints of the file."""
    if not scene.joints:
        return JointArrays.none()
    number = {name: k for k, name in enumerate(bodies.names)}
    rows = [_row(joint, bodies, number) for joint in scene.joints]
    a, b, anchor_a, anchor_b, figures = (list(column) for column in zip(*rows, strict=True))
    max_force, max_bias, bias = zip(*map(_limits, scene.joints), strict=True)
    wheels = [
        (*joint.wheels[0], *joint.wheels[1]) if isinstance(joint, Pulley) else (0.0,) * 4 for joint in scene.joints
    ]
    return JointArrays(
        kind=np.asarray([KINDS[type(joint)] for joint in scene.joints], dtype=np.int64),
        a=np.asarray(a, dtype=np.int64),
        b=np.asarray(b, dtype=np.int64),
        anchor_a=np.asarray(anchor_a, dtype=np.float64).reshape(-1, 2),
        anchor_b=np.asarray(anchor_b, dtype=np.float64).reshape(-1, 2),
        figures=np.asarray(figures, dtype=np.float64).reshape(-1, 3),
        wheels=np.asarray(wheels, dtype=np.float64).reshape(-1, 4),
        max_force=_column(max_force, math.inf),
        max_bias=_column(max_bias, math.inf),
        bias=_column(bias, math.nan),
        collide=np.asarray([joint.collide for joint in scene.joints], dtype=np.bool_),
        strength=_column([joint.strength for joint in scene.joints], math.inf),
        number=np.arange(len(scene.joints)),
        names=tuple(joint.name or default_name("joint", k) for k, joint in enumerate(scene.joints)),
    )


def _limits(joint: Joint) -> tuple[float | None, float | None, float | None]:
    """Return the largest force, N or N·m, the largest speed of correction, m/s or rad/s, and the bias of a joint."""
    match joint:
        case ErrorCorrecting():
            return joint.max_force, joint.max_bias, joint.bias
        case ForceLimited():
            return joint.max_force, None, None
        case Motor():
            return joint.max_torque, None, None
        case _:
            return None, None, None


def _column(values: Sequence[float | None], default: float) -> FloatArray:
    return np.asarray([default if value is None else value for value in values], dtype=np.float64)


def ends_of(joint: Rod | Pulley, bodies: Bodies, number: dict[str, int]) -> tuple[Point, Point]:
    """Return the start positions of the two anchors of a joint, m; `number` has the index of each body."""
    a, b, anchor_a, anchor_b, _ = _row(joint, bodies, number)
    return _world(anchor_a, a, bodies), _world(anchor_b, b, bodies)


JointRow = tuple[int, int, Point, Point, tuple[float, float, float]]


def _row(joint: Joint, bodies: Bodies, number: dict[str, int]) -> JointRow:
    """Return bodies, anchors about the centres of mass, and parameters of a joint; the world comes first."""
    if len(joint.between) == 1:
        a, b = WORLD, number[joint.between[0]]
    else:
        a, b = number[joint.between[0]], number[joint.between[1]]
    anchors: tuple[Point, Point] = (0.0, 0.0), (0.0, 0.0)
    match joint:
        case Pivot(at=(_, _) as at):
            return a, b, _local(at, a, bodies), _local(at, b, bodies), (0.0, 0.0, 0.0)
        case Anchored() | Pivot(anchors=(_, _)):
            assert joint.anchors is not None
            anchors = joint.anchors if a != WORLD else (joint.anchors[1], joint.anchors[0])
        case Groove():
            anchors = joint.groove[0], joint.anchor
            end = _about_centre(joint.groove[1], a, bodies)
            start = _about_centre(joint.groove[0], a, bodies)
            return a, b, start, _about_centre(joint.anchor, b, bodies), (*end, 0.0)
        case _:
            pass
    anchor_a, anchor_b = _about_centre(anchors[0], a, bodies), _about_centre(anchors[1], b, bodies)
    return a, b, anchor_a, anchor_b, _figures(joint, a, b, anchor_a, anchor_b, bodies)


def _figures(
    joint: Joint, a: int, b: int, anchor_a: Point, anchor_b: Point, bodies: Bodies
) -> tuple[float, float, float]:
    end_a, end_b = _world(anchor_a, a, bodies), _world(anchor_b, b, bodies)
    length = math.dist(end_a, end_b)
    angle_a = 0.0 if a == WORLD else float(bodies.angle[a])
    angle_b = float(bodies.angle[b])
    match joint:
        case Rod():
            return length if joint.length is None else joint.length, 0.0, 0.0
        case Slide():
            return joint.least, joint.most, 0.0
        case RotaryLimit():
            return joint.least, joint.most, 0.0
        case Motor():
            return joint.rate, 0.0, 0.0
        case Gear():
            phase = angle_b * joint.ratio - angle_a if joint.phase is None else joint.phase
            return phase, joint.ratio, 0.0
        case Ratchet():
            start = last_click(angle_b - angle_a, joint.phase, joint.ratchet)
            return float(start) if joint.angle is None else joint.angle, joint.phase, joint.ratchet
        case Spring():
            return length if joint.rest_length is None else joint.rest_length, joint.stiffness, joint.damping
        case RotarySpring():
            rest = angle_b - angle_a if joint.rest_angle is None else joint.rest_angle
            return rest, joint.stiffness, joint.damping
        case Pulley():
            total = math.dist(end_a, joint.wheels[0]) + joint.ratio * math.dist(end_b, joint.wheels[1])
            return total if joint.length is None else joint.length, joint.ratio, 0.0
        case _:
            return 0.0, 0.0, 0.0


def _about_centre(point: Point, number: int, bodies: Bodies) -> Point:
    """Return a point of a body's described frame relative to its centre of mass."""
    if number == WORLD:
        return point
    x, y = geometry_of(bodies.elements[bodies.element[number]]).centre
    return point[0] - x, point[1] - y


def _world(anchor: Point, number: int, bodies: Bodies) -> Point:
    if number == WORLD:
        return anchor
    x, y = bodies.position[number].tolist()
    return to_world(anchor, math.cos(bodies.angle[number]), math.sin(bodies.angle[number]), (x, y))


def _local(at: Point, number: int, bodies: Bodies) -> Point:
    """Return a position in the world in the frame of a body about its centre of mass."""
    if number == WORLD:
        return at
    x, y = at[0] - float(bodies.position[number, 0]), at[1] - float(bodies.position[number, 1])
    return rotate(x, y, math.cos(bodies.angle[number]), -math.sin(bodies.angle[number]))
