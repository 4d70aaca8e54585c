"""Linking: from the joints of a scene file to arrays by the numbers of bodies. What is not stated is as it starts."""

import math

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.joints import (
    Anchored,
    Gear,
    Groove,
    Joint,
    Motor,
    Pivot,
    Rod,
    RotaryLimit,
    RotarySpring,
    Slide,
    Spring,
)
from sandbox.scene.links import WORLD, LinkKind, Links
from sandbox.scene.model import Scene, default_name
from sandbox.scene.part import Point
from sandbox.scene.seams import seams_of
from sandbox.scene.shapes import form_of

KINDS: dict[type, LinkKind] = {
    Rod: LinkKind.ROD,
    Pivot: LinkKind.PIVOT,
    Slide: LinkKind.SLIDE,
    Groove: LinkKind.GROOVE,
    RotaryLimit: LinkKind.ROTARY_LIMIT,
    Motor: LinkKind.MOTOR,
    Gear: LinkKind.GEAR,
    Spring: LinkKind.SPRING,
    RotarySpring: LinkKind.ROTARY_SPRING,
}


def links_of(scene: Scene) -> Links:
    """Lay out the joints of a scene, whose names must be those of its bodies: those of the file, then of generators."""
    return _stated(scene, scene.bodies).joined(seams_of(scene, scene.bodies)).counted()


def _stated(scene: Scene, bodies: Bodies) -> Links:
    """Lay out the joints that the file states."""
    if not scene.joints:
        return Links.none()
    number = {name: k for k, name in enumerate(bodies.names)}
    rows = [_row(joint, bodies, number) for joint in scene.joints]
    a, b, anchor_a, anchor_b, figures = (list(column) for column in zip(*rows, strict=True))
    motors = [joint.max_torque if isinstance(joint, Motor) else None for joint in scene.joints]
    strengths = [joint.strength for joint in scene.joints]
    return Links(
        kind=np.asarray([KINDS[type(joint)] for joint in scene.joints], dtype=np.int64),
        a=np.asarray(a, dtype=np.int64),
        b=np.asarray(b, dtype=np.int64),
        anchor_a=np.asarray(anchor_a, dtype=np.float64).reshape(-1, 2),
        anchor_b=np.asarray(anchor_b, dtype=np.float64).reshape(-1, 2),
        figures=np.asarray(figures, dtype=np.float64).reshape(-1, 3),
        most_force=np.asarray([math.inf if most is None else most for most in motors]),
        collide=np.asarray([joint.collide for joint in scene.joints], dtype=np.bool_),
        strength=np.asarray([math.inf if most is None else most for most in strengths]),
        number=np.arange(len(scene.joints)),
        names=tuple(joint.name or default_name("joint", k) for k, joint in enumerate(scene.joints)),
    )


def ends_of(joint: Rod, bodies: Bodies, number: dict[str, int]) -> tuple[Point, Point]:
    """Return where the two points that a joint holds start, m; `number` is each body's."""
    a, b, anchor_a, anchor_b, _ = _row(joint, bodies, number)
    return _world(anchor_a, a, bodies), _world(anchor_b, b, bodies)


Row = tuple[int, int, Point, Point, tuple[float, float, float]]


def _row(joint: Joint, bodies: Bodies, number: dict[str, int]) -> Row:
    """Return a joint's bodies, anchors about their centres of mass, and figures; the world comes first."""
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
    length = math.dist(_world(anchor_a, a, bodies), _world(anchor_b, b, bodies))
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
        case Spring():
            return length if joint.rest_length is None else joint.rest_length, joint.stiffness, joint.damping
        case RotarySpring():
            rest = angle_b - angle_a if joint.rest_angle is None else joint.rest_angle
            return rest, joint.stiffness, joint.damping
        case _:
            return 0.0, 0.0, 0.0


def _about_centre(point: Point, number: int, bodies: Bodies) -> Point:
    """Return a point of a body's own frame, as it was drawn, as seen from its centre of mass."""
    if number == WORLD:
        return point
    x, y = form_of(bodies.elements[bodies.element[number]]).centre
    return point[0] - x, point[1] - y


def _world(anchor: Point, number: int, bodies: Bodies) -> Point:
    if number == WORLD:
        return anchor
    cos, sin = math.cos(bodies.angle[number]), math.sin(bodies.angle[number])
    x, y = bodies.position[number].tolist()
    return x + cos * anchor[0] - sin * anchor[1], y + sin * anchor[0] + cos * anchor[1]


def _local(at: Point, number: int, bodies: Bodies) -> Point:
    """Return a place in the world as a body sees it from its centre of mass."""
    if number == WORLD:
        return at
    cos, sin = math.cos(bodies.angle[number]), math.sin(bodies.angle[number])
    x, y = at[0] - float(bodies.position[number, 0]), at[1] - float(bodies.position[number, 1])
    return cos * x + sin * y, -sin * x + cos * y
