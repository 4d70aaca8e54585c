"""Motion of a ball between events, and collision response: restitution, Coulomb friction and kicks.

Collisions are instantaneous and act on one pair. The tangential impulse ends the slip or is limited by μ times the
normal impulse.
"""

import math

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.restitution_kernels import compiled_kick_gain, compiled_kicked, compiled_rebound
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.record import account_fixed_hit, add_impulse, add_row, log_support
from sandbox.engines.exact.common.roots import NOISE
from sandbox.engines.exact.common.state import EventState


@kernel
def position_at(state: FloatArray, i: int, t: float, residual: float) -> tuple[float, float, float, float]:
    """Return position, m, and velocity, m/s, of a ball at time t + residual."""
    tau = (t - state[i, c.T]) + (residual - state[i, c.TIME_RESIDUAL])
    vx, vy = state[i, c.VX] + state[i, c.AX] * tau, state[i, c.VY] + state[i, c.AY] * tau
    x = state[i, c.X] + (state[i, c.VX] + 0.5 * state[i, c.AX] * tau) * tau
    y = state[i, c.Y] + (state[i, c.VY] + 0.5 * state[i, c.AY] * tau) * tau
    return x, y, vx, vy


@kernel
def angle_at(state: FloatArray, i: int, t: float, residual: float) -> tuple[float, float]:
    """Return angle, rad, and spin, rad/s, of a ball at time t + residual."""
    tau = (t - state[i, c.T]) + (residual - state[i, c.TIME_RESIDUAL])
    spin = state[i, c.SPIN] + state[i, c.ALPHA] * tau
    return state[i, c.ANGLE] + (state[i, c.SPIN] + 0.5 * state[i, c.ALPHA] * tau) * tau, spin


ALMOST_STILL = 1e-9
"""m/s: two bodies, at least one of them round, that approach more slowly than this (or than a micro-bounce, under
gravity) separate with the speed of approach. This ends the infinite series of collisions of inelastic collapse (Zeno
behaviour)."""


@kernel
def move_to(state: FloatArray, tags: IntArray, log: FloatArray, i: int, t: float, residual: float) -> None:
    """Advance the row of a ball to time t + residual, the time of its event."""
    log_support(state, tags, log, i, t)
    x, y, vx, vy = position_at(state, i, t, residual)
    angle, spin = angle_at(state, i, t, residual)
    state[i, c.X], state[i, c.Y], state[i, c.VX], state[i, c.VY] = x, y, vx, vy
    state[i, c.ANGLE], state[i, c.SPIN] = angle, spin
    state[i, c.T], state[i, c.TIME_RESIDUAL] = t, residual


@kernel
def record_partner(state: FloatArray, tags: IntArray, i: int, kind: int, partner: int) -> None:
    """Store kind and partner of a ball's latest event."""
    tags[i, c.LAST_KIND], tags[i, c.LAST_PARTNER] = kind, partner
    state[i, c.LAST_TIME] = state[i, c.T]


@kernel
def friction_impulse(slip: float, mass: float, friction: float, normal: float) -> float:
    """Return the tangential impulse: the one that ends the slip, limited to μ times the normal impulse."""
    limit = friction * normal
    return max(min(-slip / mass, limit), -limit)


@kernel
def collide_fixed(
    data: EventState,
    i: int,
    nx: float,
    ny: float,
    separation: float,
    kick: float,
    friction: float,
    slip_target: float,
) -> tuple[float, float]:
    """Apply a collision with a static collider to a ball.

    Args:
        data: state arrays.
        i: ball.
        nx: normal out of the collider.
        ny: likewise.
        separation: speed of separation without the kick, m/s.
        kick: speed that a kick adds, m/s.
        friction: coefficient of friction.
        slip_target: velocity of the ball's rim along the surface without slip, m/s.

    Returns:
        The impulse on the ball, N·s.
    """
    state, r = data.state, data.state[i, c.RADIUS]
    inverse_mass, inverse_inertia = data.state[i, c.INVERSE_MASS], data.state[i, c.INVERSE_INERTIA]
    closing = -(state[i, c.VX] * nx + state[i, c.VY] * ny)
    normal = max((closing + separation + kick) / inverse_mass, 0.0)
    across = 0.0
    if friction > 0.0:
        slip = -state[i, c.VX] * ny + state[i, c.VY] * nx - state[i, c.SPIN] * r - slip_target
        across = friction_impulse(slip, inverse_mass + r * r * inverse_inertia, friction, normal)
    jx, jy = normal * nx - across * ny, normal * ny + across * nx
    state[i, c.VX] += jx * inverse_mass
    state[i, c.VY] += jy * inverse_mass
    state[i, c.SPIN] -= r * across * inverse_inertia
    if data.counts[c.ACCOUNTING] != 0:
        # The kick takes the speed from `separation` to `separation + kick`: work is impulse times their mean.
        kick_work = kick / inverse_mass * (separation + 0.5 * kick)
        account_fixed_hit(data, i, nx, ny, normal, across, kick_work, slip_target)
    return jx, jy


@kernel
def separation_speed(micro_bounce: float, closing: float, restitution: float, falloff: float, press: float) -> float:
    """Return the speed of separation, m/s, of two bodies of which at least one is round.

    It is e times the speed of approach; the full speed of approach if that is negligible; and at least the speed of a
    micro-bounce if acceleration presses the two together, because balls do not rest on round bodies.
    """
    separation = compiled_rebound(restitution, falloff, closing)
    if closing <= max(micro_bounce, ALMOST_STILL):
        separation = max(closing, 0.0)
    if press > 0.0:
        separation = max(separation, micro_bounce)
    return separation


@kernel
def hit_vertex(data: EventState, i: int, k: int) -> None:
    """Collide a ball with a vertex: a post or the end of a segment."""
    state = data.state
    dx, dy = data.vertices[k, c.CENTRE_X] - state[i, c.X], data.vertices[k, c.CENTRE_Y] - state[i, c.Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return
    nx, ny = dx / distance, dy / distance
    closing = state[i, c.VX] * nx + state[i, c.VY] * ny
    across = -state[i, c.VX] * ny + state[i, c.VY] * nx
    press = state[i, c.AX] * nx + state[i, c.AY] * ny - across * across / distance
    surface, other_surface = data.tags[i, c.SURFACE], data.vertex_tags[k, c.COLLIDER_SURFACE]
    restitution, falloff = (
        data.surfaces[c.RESTITUTION, surface, other_surface],
        data.surfaces[c.FALLOFF, surface, other_surface],
    )
    separation = separation_speed(data.world[c.MICRO_BOUNCE], closing, restitution, falloff, press)
    kick = compiled_kicked(data.vertices[k, c.VERTEX_KICK], data.vertices[k, c.VERTEX_THRESHOLD], False, 0.5, closing)
    kick = compiled_kick_gain(restitution, falloff, kick, data.vertices[k, c.VERTEX_TO_APPROACH] != 0.0, closing)
    friction, slip_target = (
        data.surfaces[c.FRICTION, surface, other_surface],
        data.surfaces[c.SLIP_TARGET, surface, other_surface],
    )
    jx, jy = collide_fixed(data, i, -nx, -ny, separation, kick, friction, slip_target)
    r = data.state[i, c.RADIUS]
    row = add_row(data, i, -1 - data.vertex_tags[k, c.COLLIDER], state[i, c.X] + r * nx, state[i, c.Y] + r * ny, nx, ny)
    add_impulse(data, row, -jx, -jy)
    record_partner(state, data.tags, i, c.VERTEX, k)


@kernel
def hit_ball(
    state: FloatArray, tags: IntArray, surfaces: FloatArray, micro_bounce: float, i: int, j: int
) -> tuple[float, float, float, float]:
    """Collide two balls, of which the second may be fixed.

    Args:
        state: of all balls.
        tags: likewise.
        surfaces: coefficients of all pairs of surfaces.
        micro_bounce: speed of a micro-bounce, m/s.
        i: ball.
        j: ball.

    Returns:
        The impulse of i on j, N·s, and the normal from i to j.
    """
    dx, dy = state[j, c.X] - state[i, c.X], state[j, c.Y] - state[i, c.Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    nx, ny = dx / distance, dy / distance
    vx, vy = state[j, c.VX] - state[i, c.VX], state[j, c.VY] - state[i, c.VY]
    closing, across = -(vx * nx + vy * ny), -vx * ny + vy * nx
    relative_acceleration = (state[j, c.AX] - state[i, c.AX]) * nx + (state[j, c.AY] - state[i, c.AY]) * ny
    press = -relative_acceleration - across * across / distance
    if abs(relative_acceleration) <= NOISE * (
        abs(state[i, c.AX]) + abs(state[i, c.AY]) + abs(state[j, c.AX]) + abs(state[j, c.AY])
    ):
        press = 0.0  # equal accelerations do not press them together
    surface, other_surface = tags[i, c.SURFACE], tags[j, c.SURFACE]
    separation = separation_speed(
        micro_bounce,
        closing,
        surfaces[c.RESTITUTION, surface, other_surface],
        surfaces[c.FALLOFF, surface, other_surface],
        press,
    )
    radius_i, radius_j = state[i, c.RADIUS], state[j, c.RADIUS]
    inverse_mass_i, inverse_mass_j = state[i, c.INVERSE_MASS], state[j, c.INVERSE_MASS]
    inverse_inertia_i, inverse_inertia_j = state[i, c.INVERSE_INERTIA], state[j, c.INVERSE_INERTIA]
    normal = max((closing + separation) / (inverse_mass_i + inverse_mass_j), 0.0)
    tangential = 0.0
    friction = surfaces[c.FRICTION, surface, other_surface]
    if friction > 0.0:
        slip = across - (state[i, c.SPIN] * radius_i + state[j, c.SPIN] * radius_j)
        slip -= surfaces[c.SLIP_TARGET, surface, other_surface]
        tangential = friction_impulse(
            slip,
            inverse_mass_i
            + inverse_mass_j
            + radius_i * radius_i * inverse_inertia_i
            + radius_j * radius_j * inverse_inertia_j,
            friction,
            normal,
        )
    jx, jy = normal * nx - tangential * ny, normal * ny + tangential * nx  # of i on j
    state[i, c.VX] -= jx * inverse_mass_i
    state[i, c.VY] -= jy * inverse_mass_i
    state[j, c.VX] += jx * inverse_mass_j
    state[j, c.VY] += jy * inverse_mass_j
    state[i, c.SPIN] -= radius_i * tangential * inverse_inertia_i
    state[j, c.SPIN] -= radius_j * tangential * inverse_inertia_j
    record_partner(state, tags, i, c.BALL, j)
    record_partner(state, tags, j, c.BALL, i)
    return jx, jy, nx, ny


@kernel
def log_hit(data: EventState, i: int, j: int, jx: float, jy: float, nx: float, ny: float) -> None:
    """Add a collision of two balls to the contact log."""
    state = data.state
    r = state[i, c.RADIUS]
    px, py = state[i, c.X] + r * nx, state[i, c.Y] + r * ny
    if i < j:
        add_impulse(data, add_row(data, i, j, px, py, nx, ny), jx, jy)
    else:
        add_impulse(data, add_row(data, j, i, px, py, -nx, -ny), -jx, -jy)
