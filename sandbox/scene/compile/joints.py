"""Joints of a scene as arrays, including those of ropes, cloths and ragdolls."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

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
    Joined,
    Joint,
    Motor,
    Pivot,
    Prismatic,
    Pulley,
    Ratchet,
    Rod,
    RotaryLimit,
    RotarySpring,
    Slide,
    Spring,
    Weld,
    Wheel,
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


KINDS: dict[type[Joined], JointKind] = {
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
    Weld: JointKind.PIVOT,
    Prismatic: JointKind.GROOVE,
    Wheel: JointKind.GROOVE,
}
"""Kind of the first row of each joint"""


def compile_joints(scene: SceneDescription, bodies: Bodies) -> JointArrays:
    """Return the joints of a scene between its bodies.

    Those of the file come first, then those of generators, then the further rows of compound joints.
    """
    number = {name: k for k, name in enumerate(bodies.names)}
    first = [_first_row(joint, k, bodies, number) for k, joint in enumerate(scene.joints)]
    parts = [part for row, joint in zip(first, scene.joints, strict=True) for part in _parts(row, joint, bodies)]
    joints = _as_arrays(first).joined(generator_joints(scene, bodies))
    owner = np.concatenate((np.arange(len(joints)), np.asarray([part.part_of for part in parts], np.int64)))
    joints = joints.joined(_as_arrays(parts))
    return replace(joints, number=np.arange(len(joints)), part_of=owner)


def compile_added_joint(joint: Joint, name: str, bodies: Bodies, first: int) -> JointArrays:
    """Return the rows of a joint that is added to a running scene.

    Args:
        joint: between the bodies.
        name: of the joint.
        bodies: in their present state.
        first: index of its first row, the number of rows before it.
    """
    row = replace(_first_row(joint, 0, bodies, bodies.number_of), name=name, part_of=first)
    rows = _as_arrays([row, *_parts(row, joint, bodies)])
    return replace(rows, number=first + np.arange(len(rows)))


@dataclass(frozen=True)
class _Row:
    """A row of `JointArrays`."""

    name: str
    kind: JointKind
    a: int
    b: int
    anchor_a: Point
    anchor_b: Point
    figures: tuple[float, float, float]
    collide: bool
    part_of: int
    wheels: tuple[float, ...] = (0.0,) * 4
    max_force: float | None = None
    max_bias: float | None = None
    bias: float | None = None
    strength: float | None = None
    pulls_only: bool = False


def _as_arrays(rows: Sequence[_Row]) -> JointArrays:
    """Return rows as arrays."""
    if not rows:
        return JointArrays.none()
    return JointArrays(
        kind=np.asarray([row.kind for row in rows], dtype=np.int64),
        a=np.asarray([row.a for row in rows], dtype=np.int64),
        b=np.asarray([row.b for row in rows], dtype=np.int64),
        anchor_a=np.asarray([row.anchor_a for row in rows], dtype=np.float64),
        anchor_b=np.asarray([row.anchor_b for row in rows], dtype=np.float64),
        figures=np.asarray([row.figures for row in rows], dtype=np.float64),
        wheels=np.asarray([row.wheels for row in rows], dtype=np.float64),
        max_force=_column([row.max_force for row in rows], math.inf),
        max_bias=_column([row.max_bias for row in rows], math.inf),
        bias=_column([row.bias for row in rows], math.nan),
        pulls_only=np.asarray([row.pulls_only for row in rows], dtype=np.bool_),
        collide=np.asarray([row.collide for row in rows], dtype=np.bool_),
        strength=_column([row.strength for row in rows], math.inf),
        number=np.arange(len(rows)),
        part_of=np.asarray([row.part_of for row in rows], dtype=np.int64),
        names=tuple(row.name for row in rows),
    )


def _first_row(joint: Joint, k: int, bodies: Bodies, number: dict[str, int]) -> _Row:
    """Return the row at the place of a joint; of most joints, the only one."""
    a, b, anchor_a, anchor_b, figures = _geometry(joint, bodies, number)
    max_force, max_bias, bias = _limits(joint)
    return _Row(
        name=joint.name or default_name("joint", k),
        kind=KINDS[type(joint)],
        a=a,
        b=b,
        anchor_a=anchor_a,
        anchor_b=anchor_b,
        figures=figures,
        collide=joint.collide,
        part_of=k,
        wheels=(*joint.wheels[0], *joint.wheels[1]) if isinstance(joint, Pulley) else (0.0,) * 4,
        max_force=max_force,
        max_bias=max_bias,
        bias=bias,
        strength=joint.strength,
        pulls_only=isinstance(joint, Spring) and joint.pulls_only,
    )


def _parts(first: _Row, joint: Joint, bodies: Bodies) -> Iterator[_Row]:
    """Yield the rows of a compound joint after its first, which holds a point of the second body.

    A weld is a pivot whose angle is held. A prismatic joint is a groove whose angle is held, with a motor along it. A
    wheel is a groove with a spring along it and a motor of the angle.
    """
    rest = replace(first, figures=(0.0, 0.0, 0.0), strength=None)
    free = replace(rest, anchor_a=(0.0, 0.0), anchor_b=(0.0, 0.0))  # of the angle only
    match joint:
        case Weld() | Prismatic():
            turned = _angle_between(first.a, first.b, bodies)
            strength = joint.torque_strength if isinstance(joint, Weld) else None
            phase = turned, 1.0, 0.0  # of a gear: limits that are equal act only after an error
            yield replace(free, name=f"{first.name} angle", kind=JointKind.GEAR, figures=phase, strength=strength)
            if isinstance(joint, Prismatic) and joint.rate is not None:
                far_x, far_y, _ = first.figures
                figures = far_x, far_y, joint.rate
                kind = JointKind.LINEAR_MOTOR
                yield replace(rest, name=f"{first.name} motor", kind=kind, figures=figures, max_force=joint.max_force)
        case Wheel():
            yield _suspension(rest, joint, first)
            if joint.rate is not None:
                figures = joint.rate, 0.0, 0.0
                yield replace(
                    free,
                    name=f"{first.name} motor",
                    kind=JointKind.MOTOR,
                    figures=figures,
                    max_force=joint.max_torque,
                )
        case _:
            pass


def _suspension(rest: _Row, wheel: Wheel, first: _Row) -> _Row:
    """Return the spring of a wheel, whose upper end is on the axis beyond the travel: its length stays above 0."""
    least, most = wheel.travel
    length = most - least
    x, y = (end - start for start, end in zip(first.anchor_a, first.figures[:2], strict=True))
    beyond = length + max(wheel.rest, most) - most
    far_x, far_y, _ = first.figures
    top = far_x + x * beyond / length, far_y + y * beyond / length
    figures = most + beyond - wheel.rest, wheel.stiffness, wheel.damping
    return replace(rest, name=f"{first.name} spring", kind=JointKind.SPRING, anchor_a=top, figures=figures)


def _angle_between(a: int, b: int, bodies: Bodies) -> float:
    """Return the angle of the second body relative to the first at the start, rad."""
    return float(bodies.angle[b]) - (0.0 if a == WORLD else float(bodies.angle[a]))


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
    a, b, anchor_a, anchor_b, _ = _geometry(joint, bodies, number)
    return _world(anchor_a, a, bodies), _world(anchor_b, b, bodies)


_Geometry: TypeAlias = tuple[int, int, Point, Point, tuple[float, float, float]]


def _geometry(joint: Joint, bodies: Bodies, number: dict[str, int]) -> _Geometry:
    """Return bodies, anchors about the centres of mass, and figures of a joint's first row; the world comes first."""
    if len(joint.between) == 1:
        a, b = WORLD, number[joint.between[0]]
    else:
        a, b = number[joint.between[0]], number[joint.between[1]]
    anchors: tuple[Point, Point] = (0.0, 0.0), (0.0, 0.0)
    match joint:
        case Pivot(at=(_, _) as at):
            return a, b, _local(at, a, bodies), _local(at, b, bodies), (0.0, 0.0, 0.0)
        case Weld() | Prismatic() | Wheel():
            x, y = bodies.position[b].tolist()
            at = (x, y) if joint.at is None else joint.at
            start = _local(at, a, bodies)
            near, far = start, (0.0, 0.0)
            if not isinstance(joint, Weld):
                length = math.hypot(*joint.axis)
                near, far = (_along(start, joint.axis, way / length) for way in joint.travel)
            return a, b, near, _local(at, b, bodies), (*far, 0.0)
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


def _along(start: Point, axis: Point, factor: float) -> Point:
    return start[0] + factor * axis[0], start[1] + factor * axis[1]


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
