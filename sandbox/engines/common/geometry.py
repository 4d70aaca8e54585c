"""Plane geometry in kernels: functions of `scene.geometry.vectors`, compiled."""

from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.geometry import vectors

nearest_fraction, rotate = bare_kernel(vectors.nearest_fraction), bare_kernel(vectors.rotate)
