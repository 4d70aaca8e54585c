"""Phase: how a sphere on a floor moves just now, and what that does to it until it ends.

    sliding → rolling → spinning → resting

A puck, which never rolls, has fewer: gliding → spinning → resting. In each phase velocity and spin change at constant
rates, so that every path is a parabola; but where a floor curls, a gliding puck's is none: `floor.curl` has it. Contact
slip of a sphere is u = (v_x − Rω_y, v_y + Rω_x). ω_z falls by 5·μ_sp·g / (2R) in every phase, of pucks by 2·μ_sp·g / R.

Source: Leckie & Greenspan 2006; Marlow 1995.
"""

import math
from typing import NamedTuple

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.scene.floor import Floor

RESTING, SPINNING, ROLLING, SLIDING, CAPTURED, GLIDING = range(6)
"""Phases of spheres, from the least to the most lively; in a pocket; and that of a puck that moves."""

SLIP = 1e-9
"""m/s: what slips less rolls."""


class Figures(NamedTuple):
    """Of a floor, for kernels: accelerations, m/s²."""

    sliding: float
    """μ_s·g"""
    rolling: float
    """μ_r·g"""
    spinning: float
    """5/2·μ_sp·g, of pucks twice μ_sp·g; by the radius the rate at which ω_z falls"""
    grip: float
    """μ_s itself"""
    inertia: float
    """of what lies on it, of m·r²: ⅖ of spheres, ½ of pucks"""
    pucks: bool
    """whether that never rolls"""
    curl: float
    """κ"""


def figures_of(floor: Floor | None) -> Figures:
    """Return what a floor does to what lies on it, as kernels count it."""
    if floor is None:
        return Figures(0.0, 0.0, 0.0, 0.0, 0.4, False, 0.0)
    g = floor.gravity
    mu = floor.sliding_friction
    if floor.bodies == "pucks":
        return Figures(mu * g, 0.0, 2.0 * floor.spinning_friction * g, mu, 0.5, True, floor.curl)
    return Figures(mu * g, floor.rolling_friction * g, 2.5 * floor.spinning_friction * g, mu, 0.4, False, 0.0)


@kernel
def phase_of(vx: float, vy: float, wx: float, wy: float, wz: float, radius: float, pucks: bool) -> int:
    """Return the phase of a sphere or puck with a velocity, m/s, and a spin, rad/s."""
    if pucks:
        if vx != 0.0 or vy != 0.0:
            return GLIDING
        return SPINNING if wz != 0.0 else RESTING
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
    if phase == GLIDING and floor.sliding > 0.0:
        speed = math.sqrt(vx * vx + vy * vy)
        if speed == 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.0
        return -floor.sliding * vx / speed, -floor.sliding * vy / speed, 0.0, 0.0, speed / floor.sliding
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
