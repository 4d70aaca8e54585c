"""Approach: how fast two that pymunk has found to touch close in on each other."""

import pymunk


def closing_speed(arbiter: pymunk.Arbiter) -> float:
    """Return how fast two approach along their normal, m/s; of two points that of the faster one."""
    a, b = arbiter.shapes
    first, second, n = a.body, b.body, arbiter.normal
    assert first is not None and second is not None
    along = (first.velocity - second.velocity).dot(n)
    if not (_turns(a) or _turns(b)):
        return float(along)
    return float(
        max(
            along + _turning(first, point.point_a, n) - _turning(second, point.point_b, n)
            for point in arbiter.contact_point_set.points
        )
    )


def _turns(shape: pymunk.Shape) -> bool:
    """Tell whether the spin of a body moves its surface along a normal there: not that of a disc about its centre."""
    body = shape.body
    assert body is not None
    return body.angular_velocity != 0.0 and not (
        isinstance(shape, pymunk.Circle) and shape.offset == body.center_of_gravity
    )


def _turning(body: pymunk.Body, point: pymunk.Vec2d, normal: pymunk.Vec2d) -> float:
    """Return how fast a body's spin moves a point of it along a normal, m/s."""
    arm = point - body.local_to_world(body.center_of_gravity)  # on a hinge that is the hinge
    return float(body.angular_velocity * (arm.x * normal.y - arm.y * normal.x))
