"""Plane geometry in kernels; most are functions of `scene.geometry.vectors`, compiled."""

import math

from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.geometry import vectors

nearest_fraction, rotate = bare_kernel(vectors.nearest_fraction), bare_kernel(vectors.rotate)
is_left_of_bend = bare_kernel(vectors.is_left_of_bend)


@bare_kernel
def length_and_direction(x: float, y: float) -> tuple[float, float, float]:
    """Return the length of a vector and its direction; both are 0 for a zero vector."""
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0, 0.0, 0.0
    return length, x / length, y / length
