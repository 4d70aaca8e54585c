"""Motion on a surface: sliding, rolling and spinning of spheres, and curling stones.

Phases of a sphere on a surface:

    sliding → rolling → spinning → resting

A puck never rolls: gliding → spinning → resting. In each phase velocity and spin change at constant rates, so that
every path is a parabola, except for a gliding puck that curls: see `curled`. The slip at the contact of a sphere is u =
(v_x − Rω_y, v_y + Rω_x). |ω_z| falls by 5·μ_sp·g / (2R) in every phase, for pucks by 2·μ_sp·g / R.

Source: Leckie & Greenspan 2006; Marlow 1995.

Curl: the path of a puck that turns while it slides, as curling stones do.

    a = −μ·g·v̂ + κ·μ·g·sgn(ω)·ẑ×v̂

This is an empirical law, not derived from the physics of ice: real stones come to rest about 1 m beside their line
after some 28 m, almost independently of their spin (Penner 2019, "A scratch-guide model for the motion of a curling
rock"; Maeno 2014, "Dynamics and curl ratio of a curling stone", Sports Engineering 17), and the reason is still
disputed (Nyberg, Hogmark & Jacobson 2013, "Calculated trajectories of curling stones sliding under asymmetrical
friction"). Under this law the speed falls as on a straight path, and the direction turns by κ·ln(1/s), s the fraction
of the speed that is left: most in the last metres, as on ice. So, as complex numbers relative to the initial direction
and its left, v = v₀·s^(1−iκ), and the position is (v₀² / μg)·(1 − s^(2−iκ)) / (2 − iκ).

`rolled` advances spheres or pucks by a time in closed form, across the ends of their phases. It is exact for a ball
without contacts, for any time: within a phase the path is a parabola or has the closed form of a curl, and where a
phase ends within the time the next one begins. A ball that has come to rest has velocity and spin of exactly 0.
"""

import math
from typing import NamedTuple

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.geometry import rotate
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.tabletop.collisions import Five
from sandbox.scene.description.surface import Floor

RESTING, SPINNING, ROLLING, SLIDING, CAPTURED, GLIDING = range(6)
"""Phases of spheres, in the order in which they end; then in a pocket; then that of a moving puck."""

SLIP = 1e-9
"""m/s: a ball with less slip rolls"""


class SurfaceFriction(NamedTuple):
    """Parameters of a surface, for kernels: accelerations, m/s²."""

    sliding: float
    """μ_s·g"""
    rolling: float
    """μ_r·g"""
    spinning: float
    """5/2·μ_sp·g, of pucks 2·μ_sp·g; divided by the radius, the rate at which |ω_z| falls"""
    grip: float
    """μ_s itself"""
    inertia: float
    """moment of inertia of bodies on it, in units of m·r²: ⅖ of spheres, ½ of pucks"""
    pucks: bool
    """whether bodies on it are pucks, which never roll"""
    curl: float
    """κ"""


def figures_of(floor: Floor | None) -> SurfaceFriction:
    """Return the parameters of a surface for kernels; all 0 for None."""
    if floor is None:
        return SurfaceFriction(0.0, 0.0, 0.0, 0.0, 0.4, False, 0.0)
    g = floor.gravity
    mu = floor.sliding_friction
    if floor.bodies == "pucks":
        return SurfaceFriction(mu * g, 0.0, 2.0 * floor.spinning_friction * g, mu, 0.5, True, floor.curl)
    return SurfaceFriction(mu * g, floor.rolling_friction * g, 2.5 * floor.spinning_friction * g, mu, 0.4, False, 0.0)


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
    phase: int, vx: float, vy: float, wx: float, wy: float, wz: float, radius: float, floor: SurfaceFriction
) -> tuple[float, float, float, float, float]:
    """Return the acceleration, m/s², the rates of ω_x and ω_y, rad/s², and the duration of the phase, s."""
    if phase == SLIDING and floor.sliding > 0.0:
        ux, uy = vx - radius * wy, vy + radius * wx
        slip = math.sqrt(ux * ux + uy * uy)
        if slip == 0.0:  # its square underflowed: the phase is over
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
def decayed_spin(wz: float, drop: float) -> float:
    """Return a spin about z, rad/s, moved towards 0 by a drop, rad/s."""
    if wz > drop:
        return wz - drop
    if wz < -drop:
        return wz + drop
    return 0.0


SHORT = 1e-9
"""Fraction of the speed lost below which the path is a parabola to rounding."""


@kernel
def curled(vx: float, vy: float, slowing: float, curl: float, time: float) -> tuple[float, float, float, float]:
    """Return the displacement of a puck after a time, m, and its velocity then, m/s.

    Args:
        vx: velocity, m/s, not 0.
        vy: likewise.
        slowing: μ·g, m/s², above 0.
        curl: κ, to the left.
        time: s, within which its spin does not end; it may come to rest within it.
    """
    speed = math.sqrt(vx * vx + vy * vy)
    lost = slowing * time / speed
    if lost >= 1.0:
        along, left = _curl_term(-1.0, 0.0, curl)
        scale = speed / slowing
        return scale * (along * vx - left * vy), scale * (along * vy + left * vx), 0.0, 0.0
    if lost < SHORT:
        along, left = 1.0 - 0.5 * lost, 0.5 * lost * curl
        x, y = time * (along * vx - left * vy), time * (along * vy + left * vx)
    else:
        rate = math.log1p(-lost)
        sine, half = math.sin(-curl * rate), math.sin(-0.5 * curl * rate)
        # s^(2−iκ) − 1, computed without cancellation where s is near 1
        real_part = math.expm1(2.0 * rate) * (1.0 - 2.0 * half * half) - 2.0 * half * half
        along, left = _curl_term(real_part, math.exp(2.0 * rate) * sine, curl)
        scale = time / lost
        x, y = scale * (along * vx - left * vy), scale * (along * vy + left * vx)
    angle = -curl * math.log1p(-lost)
    cos, sin, fraction = math.cos(angle), math.sin(angle), 1.0 - lost
    vx, vy = rotate(vx, vy, cos, sin)
    return x, y, fraction * vx, fraction * vy


@kernel
def _curl_term(real: float, imaginary: float, curl: float) -> tuple[float, float]:
    """Return −(real + i·imaginary) / (2 − iκ)."""
    norm = 4.0 + curl * curl
    return -(2.0 * real - curl * imaginary) / norm, -(2.0 * imaginary + curl * real) / norm


MAX_PHASES = 3
"""Number of phases that a ball can pass through until it rests: sliding, rolling, and one more for a slide whose end
rounding has delayed."""


class TabletopBalls(NamedTuple):
    """N spheres or pucks, for kernels. The first five are the arrays of all bodies."""

    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""
    roll: FloatArray
    """(N, 2) rad/s, about x and y"""
    spin: FloatArray
    """(N,) rad/s, about z"""
    angle: FloatArray
    """(N,) rad, about z"""
    anchor: FloatArray
    """(N, 8) position, angle, velocity and spins from which each ball moves without contacts: at its last collision
    within the substep, or at the start of the substep"""
    age: FloatArray
    """(N,) s, time since then"""
    moved: BoolArray
    """(N,) whether it was moved by a collision within the substep, or out of an overlap"""
    in_play: BoolArray
    """(N,) whether it is present, not fixed, and in no pocket"""
    collision_mask: IntArray
    """(N,) collision mask, as in `BodyStore.collision_mask`"""
    radius: FloatArray
    """(N,) m"""
    inverse_mass: FloatArray
    """(N,) 1/mass, 1/kg; 0 for fixed balls"""
    surface: IntArray
    """(N,)"""
    floor: SurfaceFriction
    """parameters of the surface"""


@kernel
def motion_of(balls: TabletopBalls, i: int) -> Five:
    """Return a ball's velocity and spin."""
    velocity, roll = balls.velocity, balls.roll
    return velocity[i, 0], velocity[i, 1], roll[i, 0], roll[i, 1], balls.spin[i]


@kernel
def set_motion(balls: TabletopBalls, i: int, motion: Five) -> None:
    """Set a ball's velocity and spin."""
    velocity, roll = balls.velocity, balls.roll
    velocity[i, 0], velocity[i, 1], roll[i, 0], roll[i, 1], balls.spin[i] = motion


@kernel
def rolled(motion: Five, radius: float, floor: SurfaceFriction, time: float) -> tuple[float, float, float, Five]:
    """Return a ball's displacement after a time, m, its change of angle about z, rad, and its velocity and spin.

    Args:
        motion: initial velocity and spin.
        radius: m.
        floor: parameters of the surface.
        time: s.
    """
    vx, vy, wx, wy, wz = motion
    x = y = 0.0
    remaining = time
    spin_decay = floor.spinning / radius
    spin_time = min(time, abs(wz) / spin_decay) if spin_decay > 0.0 else time
    if floor.curl != 0.0 and wz != 0.0 and floor.sliding > 0.0 and (vx != 0.0 or vy != 0.0):
        x, y, vx, vy = curled(vx, vy, floor.sliding, math.copysign(floor.curl, floor.curl * wz), spin_time)
        remaining -= spin_time
    for _ in range(MAX_PHASES):
        phase = phase_of(vx, vy, wx, wy, wz, radius, floor.pucks)
        if phase in (RESTING, SPINNING) or remaining <= 0.0:
            break
        ax, ay, bx, by, duration = rates(phase, vx, vy, wx, wy, wz, radius, floor)
        dt = min(remaining, duration)
        x, y = x + (vx + 0.5 * ax * dt) * dt, y + (vy + 0.5 * ay * dt) * dt
        vx, vy, wx, wy = vx + ax * dt, vy + ay * dt, wx + bx * dt, wy + by * dt
        if phase in (ROLLING, GLIDING) and duration <= remaining:
            vx = vy = 0.0
        if phase == ROLLING or (phase == SLIDING and duration <= remaining):
            wx, wy = 0.0 - vy / radius, vx / radius  # no −0.0 at rest
        remaining -= dt
    angle = (wz - math.copysign(0.5 * spin_decay * spin_time, wz)) * spin_time
    return x, y, angle, (vx, vy, wx, wy, decayed_spin(wz, spin_decay * time))


@kernel
def state_at(balls: TabletopBalls, i: int, time_before_end: float) -> tuple[float, float, float, Five]:
    """Return a ball's position at a time, m, its angle, and its velocity and spin; at most back to its anchor."""
    if time_before_end == 0.0 or not balls.in_play[i]:
        return balls.position[i, 0], balls.position[i, 1], balls.angle[i], motion_of(balls, i)
    anchor = balls.anchor[i]
    start = anchor[3], anchor[4], anchor[5], anchor[6], anchor[7]
    x, y, angle, motion = rolled(start, balls.radius[i], balls.floor, balls.age[i] - time_before_end)
    return anchor[0] + x, anchor[1] + y, anchor[2] + angle, motion


@kernel
def advance_ball(balls: TabletopBalls, i: int, time: float) -> None:
    """Set a ball's anchor, and advance it by a time, s, as if without contacts."""
    anchor, motion = balls.anchor[i], motion_of(balls, i)
    anchor[0], anchor[1], anchor[2] = balls.position[i, 0], balls.position[i, 1], balls.angle[i]
    for k in range(5):
        anchor[3 + k] = motion[k]
    balls.age[i] = time
    x, y, angle, motion = rolled(motion, balls.radius[i], balls.floor, time)
    balls.position[i, 0] += x
    balls.position[i, 1] += y
    balls.angle[i] += angle
    set_motion(balls, i, motion)


@kernel
def advance_all(balls: TabletopBalls, time: float, displacement: FloatArray) -> None:
    """Advance all balls in play by a time, s.

    Args:
        balls: all.
        time: s.
        displacement: (N, 2) m, displacement of each; written to.
    """
    for i in range(len(balls.in_play)):
        balls.moved[i] = False
        displacement[i, 0] = displacement[i, 1] = 0.0
        if balls.in_play[i]:
            x, y = balls.position[i, 0], balls.position[i, 1]
            advance_ball(balls, i, time)
            displacement[i, 0], displacement[i, 1] = balls.position[i, 0] - x, balls.position[i, 1] - y


@kernel
def find_in_pockets(balls: TabletopBalls, pockets: FloatArray, pocket_index: IntArray) -> int:
    """Find the balls in play whose centres are within a pocket; return their number.

    Args:
        balls: all.
        pockets: (P, 3) centre and radius, m.
        pocket_index: (N,) index of the pocket of each, −1 for none; written to.
    """
    count = 0
    for i in range(len(pocket_index)):
        pocket_index[i] = -1
        for k in range(len(pockets)):
            dx, dy = balls.position[i, 0] - pockets[k, 0], balls.position[i, 1] - pockets[k, 1]
            if balls.in_play[i] and pocket_index[i] < 0 and dx * dx + dy * dy < pockets[k, 2] * pockets[k, 2]:
                pocket_index[i] = k
                count += 1
    return count
