"""Lying: where the pieces of a body are, frame by frame, and how far it reaches."""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.bodies import Bodies


def pieces_over_time(
    bodies: Bodies, number: int, position: FloatArray, angle: FloatArray
) -> Iterator[tuple[FloatArray, float]]:
    """Yield the corners (T, V, 2) m, counter-clockwise, and the radius, m, of each convex piece of a body.

    Args:
        bodies: whose shapes.
        number: of the body.
        position: (T, 2) m, of its centre of mass.
        angle: (T,) rad.
    """
    shapes = bodies.shapes
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    begin, end = np.searchsorted(shapes.body, (number, number + 1)).tolist()
    for piece in range(begin, end):
        x, y = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]].T
        turned = np.stack((cos * x - sin * y, sin * x + cos * y), axis=2)
        yield position[:, None] + turned, float(shapes.radius[piece])


def gap_above(
    bodies: Bodies, number: int, position: FloatArray, angle: FloatArray, point: FloatArray, normal: FloatArray
) -> FloatArray:
    """Return how far a body is from a plane, (T,) m, negative where it is behind it in part.

    Args:
        bodies: of which one.
        number: which.
        position: (T, 2) m.
        angle: (T,) rad.
        point: (2,) of the plane, m.
        normal: (2,) of length 1.
    """
    if bodies.round[number]:
        return np.asarray((position - point) @ normal - float(bodies.radius[number]))
    gaps = [
        ((corners - point) @ normal).min(axis=1) - radius
        for corners, radius in pieces_over_time(bodies, number, position, angle)
    ]
    return np.asarray(np.minimum.reduce(gaps))
