"""Phase: how a sphere on a floor moves just now, and what that does to it until it ends.

    sliding → rolling → spinning → resting

In each phase velocity and spin change at constant rates, so that every path is a parabola. Contact slip is
u = (v_x − Rω_y, v_y + Rω_x). ω_z falls by 5·μ_sp·g / (2R) in every phase.

Source: Leckie & Greenspan 2006; Marlow 1995.
"""

import math
from typing import NamedTuple

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.scene.floor import Floor

RESTING, SPINNING, ROLLING, SLIDING, CAPTURED = range(5)
"""Phases, from the least to the most lively; and in a pocket."""

SLIP = 1e-9
"""m/s: what slips less rolls."""


class Figures(NamedTuple):
    """Of a floor, for kernels: accelerations, m/s²."""

    sliding: float
    """μ_s·g"""
    rolling: float
    """μ_r·g"""
    spinning: float
    """5/2·μ_sp·g, by the radius the rate at which ω_z falls"""
    grip: float
    """μ_s itself"""


def figures_of(floor: Floor | None) -> Figures:
    """Return what a floor does to spheres, as kernels count it."""
    if floor is None:
        return Figures(0.0, 0.0, 0.0, 0.0)
    g = floor.gravity
    mu = floor.sliding_friction
    return Figures(mu * g, floor.rolling_friction * g, 2.5 * floor.spinning_friction * g, mu)


@kernel
def phase_of(vx: float, vy: float, wx: float, wy: float, wz: float, radius: float) -> int:
    """Return the phase of a sphere with a velocity, m/s, and a spin, rad/s."""
    ux, uy = vx - radius * wy, vy + radius * wx
    moving = vx != 0.0 or vy != 0.0
    if ux * ux + uy * uy > SLIP * SLIP or (not moving and (wx != 0.0 or wy != 0.0)):
        return SLIDING
    if moving:
        return ROLLING
    return SPINNING if wz != 0.0 else RESTING


@kernel
def rates(
    phase: int, vx: float, vy: float, wx: float, wy: float, wz: float, radius: float, floor: Figures
) -> tuple[float, float, float, float, float]:
    """Return the acceleration, m/s², the rates of ω_x and ω_y, rad/s², and how long the phase lasts, s."""
    if phase == SLIDING and floor.sliding > 0.0:
        ux, uy = vx - radius * wy, vy + radius * wx
        slip = math.sqrt(ux * ux + uy * uy)
        if slip == 0.0:  # so slow that its square is nothing: it is over
            return 0.0, 0.0, 0.0, 0.0, 0.0
        ax, ay = -floor.sliding * ux / slip, -floor.sliding * uy / slip
        turn = 2.5 / radius
        return ax, ay, turn * ay, -turn * ax, 2.0 * slip / (7.0 * floor.sliding)
    if phase == ROLLING and floor.rolling > 0.0:
        speed = math.sqrt(vx * vx + vy * vy)
        if speed == 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.0
        ax, ay = -floor.rolling * vx / speed, -floor.rolling * vy / speed
        return ax, ay, -ay / radius, ax / radius, speed / floor.rolling
    if phase == SPINNING and floor.spinning > 0.0:
        return 0.0, 0.0, 0.0, 0.0, abs(wz) * radius / floor.spinning
    return 0.0, 0.0, 0.0, 0.0, math.inf


@kernel
def fallen(wz: float, drop: float) -> float:
    """Return a spin about z after it has fallen towards nothing by so much, rad/s."""
    if wz > drop:
        return wz - drop
    if wz < -drop:
        return wz + drop
    return 0.0
