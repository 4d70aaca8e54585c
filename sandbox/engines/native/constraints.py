"""Constraints: the links of a scene as pymunk's own, with every parameter stated."""

import math

import pymunk

from sandbox.scene.links import LinkKind, Links


def constraint_of(links: Links, k: int, a: pymunk.Body, b: pymunk.Body, bias: float) -> pymunk.Constraint:
    """Return link k between two bodies of a space.

    Args:
        links: of the scene.
        k: which.
        a: the first body; the space's own static body where that is the world.
        b: the second.
        bias: the share of a joint's error that still remains one second later.
    """
    constraint = _made(links, k, a, b)
    constraint.collide_bodies = bool(links.collide[k])
    constraint.error_bias = bias
    constraint.max_bias = math.inf
    constraint.max_force = float(links.most_force[k])
    return constraint


def _made(links: Links, k: int, a: pymunk.Body, b: pymunk.Body) -> pymunk.Constraint:
    x, y, z = links.figures[k].tolist()
    at, on = tuple(links.anchor_a[k].tolist()), tuple(links.anchor_b[k].tolist())
    match LinkKind(int(links.kind[k])):
        case LinkKind.ROD:
            rod = pymunk.PinJoint(a, b, at, on)
            rod.distance = x
            return rod
        case LinkKind.PIVOT:
            return pymunk.PivotJoint(a, b, at, on)
        case LinkKind.SLIDE:
            return pymunk.SlideJoint(a, b, at, on, x, y)
        case LinkKind.GROOVE:
            return pymunk.GrooveJoint(a, b, at, (x, y), on)
        case LinkKind.ROTARY_LIMIT:
            return pymunk.RotaryLimitJoint(a, b, x, y)
        case LinkKind.MOTOR:
            return pymunk.SimpleMotor(a, b, -x)  # its rate is that of the first as seen from the second
        case LinkKind.GEAR:
            return pymunk.GearJoint(a, b, x, y)
        case LinkKind.SPRING:
            return pymunk.DampedSpring(a, b, at, on, x, y, z)
        case LinkKind.ROTARY_SPRING:
            return pymunk.DampedRotarySpring(a, b, -x, y, z)  # its angle is that of the first as seen from the second
