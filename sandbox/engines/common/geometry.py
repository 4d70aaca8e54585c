"""Plane geometry in kernels: the functions of `scene.geometry.segments`, compiled."""

from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.geometry import segments

nearest_fraction, rotate = bare_kernel(segments.nearest_fraction), bare_kernel(segments.rotate)
