"""Resting contact: a ball that rests, slides or rolls on a line, or rests in a corner of two lines.

Motion on a line is in closed form. The slip of the contact point is u = v·t − ω R, where t is the normal rotated left
by 90°. While u ≠ 0, friction μ N acts against it, u changes at a constant rate and its zero is an event. Afterwards the
ball rolls (a = ⅔ g·t for a disc) as long as that needs no more friction than μ N, that is while |g·t| ≤ 3 μ |g·n|;
beyond that it keeps sliding. On a moving surface the slip is relative to it: u = v·t − ω R − s.
"""

import math

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.restitution_kernels import compiled_kick_gain, compiled_kicked, compiled_rebound
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.record import account_spin, account_velocity, add_impulse, add_row, open_support_row
from sandbox.engines.exact.common.roots import NOISE
from sandbox.engines.exact.common.state import EventState, is_in_corner, is_solid, is_supported
from sandbox.engines.exact.impact import collide_fixed, record_partner
from sandbox.engines.exact.prediction import PARALLEL_ANGLE, are_parallel

REST_TIME = 1e-13
"""s: when the remaining bounces of a decaying series take less than this in total, the ball is put to rest, as if all
of them had happened."""


@kernel
def release_support(data: EventState, i: int, slot: int) -> None:
    """Remove the support in a slot, 0 or 1; the second of two moves to slot 0."""
    if slot == 0:
        data.tags[i, c.SUPPORT], data.tags[i, c.LOG_ROW] = data.tags[i, c.SUPPORT + 1], data.tags[i, c.LOG_ROW + 1]
    data.tags[i, c.SUPPORT + 1], data.tags[i, c.LOG_ROW + 1] = -1, -1
    data.state[i, c.SUPPORT_FORCE + 2], data.state[i, c.SUPPORT_FORCE + 3] = 0.0, 0.0


@kernel
def release_supports(data: EventState, i: int) -> None:
    """Remove all supports of a ball. Their impulses must have been logged."""
    release_support(data, i, 0)
    release_support(data, i, 0)


@kernel
def set_supported_velocity(data: EventState, i: int, slot: int, vx: float, vy: float) -> None:
    """Set the velocity of a supported ball, m/s; log and account the small change as that of the support in a slot."""
    state, inverse_mass = data.state, data.state[i, c.INVERSE_MASS]
    add_impulse(
        data,
        data.tags[i, c.LOG_ROW + slot],
        (state[i, c.VX] - vx) / inverse_mass,
        (state[i, c.VY] - vy) / inverse_mass,
    )
    account_velocity(data, i, vx, vy)
    state[i, c.VX], state[i, c.VY] = vx, vy


@kernel
def slip_target_of(data: EventState, i: int, slot: int) -> float:
    """Return the velocity of a ball's rim along the support in a slot, m/s, at which nothing slips."""
    surface, other = data.tags[i, c.SURFACE], data.line_tags[data.tags[i, c.SUPPORT + slot], c.COLLIDER_SURFACE]
    if data.surfaces[c.FRICTION, surface, other] == 0.0:
        return 0.0
    return float(data.surfaces[c.SLIP_TARGET, surface, other])


@kernel
def corner_forces(data: EventState, i: int, spin_sign: float) -> tuple[float, float, float, float]:
    """Return the forces on a ball in a corner: normal force and friction of each support, per mass, m/s².

    Args:
        data: state arrays.
        i: ball.
        spin_sign: sign of the spin; 0 omits friction, which a ball without spin does not need.
    """
    f, g = data.tags[i, c.SUPPORT], data.tags[i, c.SUPPORT + 1]
    surface = data.tags[i, c.SURFACE]
    mu = spin_sign * data.surfaces[c.FRICTION, surface, data.line_tags[f, c.COLLIDER_SURFACE]]
    nu = spin_sign * data.surfaces[c.FRICTION, surface, data.line_tags[g, c.COLLIDER_SURFACE]]
    lines = data.lines
    # Spin > 0 makes the contact point slip along −t, so friction acts along +t.
    ax, ay = lines[f, c.NX] - mu * lines[f, c.NY], lines[f, c.NY] + mu * lines[f, c.NX]
    bx, by = lines[g, c.NX] - nu * lines[g, c.NY], lines[g, c.NY] + nu * lines[g, c.NX]
    determinant = ax * by - ay * bx
    if determinant == 0.0:
        return -1.0, -1.0, 0.0, 0.0
    gx, gy = -data.world[c.GX], -data.world[c.GY]
    first, second = (gx * by - gy * bx) / determinant, (ax * gy - ay * gx) / determinant
    return first, second, mu * first, nu * second


@kernel
def rest_in_corner(data: EventState, i: int) -> None:
    """Hold a ball in a corner while friction decelerates its spin; release a support that does not press."""
    state, r = data.state, data.state[i, c.RADIUS]
    inverse_mass, inverse_inertia = data.state[i, c.INVERSE_MASS], data.state[i, c.INVERSE_INERTIA]
    if inverse_inertia > 0.0 and (slip_target_of(data, i, 0) != 0.0 or slip_target_of(data, i, 1) != 0.0):
        data.counts[c.IN_MOVING_CORNER] = 1
    if (
        abs(state[i, c.SPIN]) * r <= REST_TIME * (abs(data.world[c.GX]) + abs(data.world[c.GY]))
        and inverse_inertia > 0.0
    ):
        account_spin(data, i, 0.0)
        state[i, c.SPIN] = 0.0
    spin_sign = 0.0
    if state[i, c.SPIN] != 0.0 and inverse_inertia > 0.0:
        spin_sign = 1.0 if state[i, c.SPIN] > 0.0 else -1.0
    first, second, first_friction, second_friction = corner_forces(data, i, spin_sign)
    if first < 0.0 or second < 0.0:
        first_frictionless, second_frictionless, _, _ = corner_forces(data, i, 0.0)
        if spin_sign == 0.0 or first_frictionless < 0.0 or second_frictionless < 0.0 or (first < 0.0) != (second < 0.0):
            release_support(data, i, 0 if first < 0.0 else 1)
            return
        account_spin(data, i, 0.0)
        state[i, c.SPIN], spin_sign = 0.0, 0.0  # jammed: no pair of forces within the friction cones lets it rotate
        first, second, first_friction, second_friction = first_frictionless, second_frictionless, 0.0, 0.0
    set_supported_velocity(data, i, 1, 0.0, 0.0)
    state[i, c.AX], state[i, c.AY] = 0.0, 0.0
    state[i, c.ALPHA] = -r * (first_friction + second_friction) * inverse_inertia / inverse_mass
    state[i, c.SLIP_END_TIME] = math.inf
    if state[i, c.ALPHA] != 0.0:
        state[i, c.SLIP_END_TIME] = state[i, c.T] + (state[i, c.TIME_RESIDUAL] - state[i, c.SPIN] / state[i, c.ALPHA])
    for slot in range(2):
        f = data.tags[i, c.SUPPORT + slot]
        normal_force, friction_force = (first, first_friction) if slot == 0 else (second, second_friction)
        data.state[i, c.SUPPORT_FORCE + 2 * slot] = (
            normal_force * data.lines[f, c.NX] - friction_force * data.lines[f, c.NY]
        ) / inverse_mass
        data.state[i, c.SUPPORT_FORCE + 2 * slot + 1] = (
            normal_force * data.lines[f, c.NY] + friction_force * data.lines[f, c.NX]
        ) / inverse_mass


REST_FRACTION = 8.0 * 2.0**-52
"""As `REST_TIME`, for one bounce and relative to the time: shorter bounces are below the resolution of time."""

ABSORBED_SPEED = 1e-3
"""m/s: a collision that drives a supported ball into its support more slowly than this leaves it supported."""

JOIN_GAP = 1e-9
"""m: largest distance between the ends of two lines for a ball to roll from one to the other."""


@kernel
def hit_line(data: EventState, i: int, f: int) -> None:
    """Collide a ball with a line: it bounces, or is supported from now on."""
    state = data.state
    nx, ny = data.lines[f, c.NX], data.lines[f, c.NY]
    surface, other_surface = data.tags[i, c.SURFACE], data.line_tags[f, c.COLLIDER_SURFACE]
    restitution, friction = (
        data.surfaces[c.RESTITUTION, surface, other_surface],
        data.surfaces[c.FRICTION, surface, other_surface],
    )
    closing = max(-(state[i, c.VX] * nx + state[i, c.VY] * ny), 0.0)
    press = -(state[i, c.AX] * nx + state[i, c.AY] * ny)
    falloff = data.surfaces[c.FALLOFF, surface, other_surface]
    separation = compiled_rebound(restitution, falloff, closing)
    kick = 0.0
    if data.lines[f, c.KICK_SPEED] > 0.0:
        kick = line_kick(data.lines, f, state[i, c.X], state[i, c.Y], closing)
        kick = compiled_kick_gain(restitution, falloff, kick, data.lines[f, c.KICK_TO_APPROACH] != 0.0, closing)
    comes_to_rest = False
    if press > 0.0 and kick == 0.0:
        flight_time = 2.0 * separation / press
        comes_to_rest = flight_time <= REST_FRACTION * abs(state[i, c.T]) or flight_time <= REST_TIME * (
            1.0 - restitution
        )
    slip_target = data.surfaces[c.SLIP_TARGET, surface, other_surface]
    jx, jy = collide_fixed(data, i, nx, ny, 0.0 if comes_to_rest else separation, kick, friction, slip_target)
    record_partner(state, data.tags, i, c.LINE, f)
    recheck_supports(data, i)
    if comes_to_rest and not is_in_corner(data.tags, i):
        slot = 1 if is_supported(data.tags, i) else 0
        data.tags[i, c.SUPPORT + slot] = f
        open_support_row(data, i, slot)
        add_impulse(data, data.tags[i, c.LOG_ROW + slot], -jx, -jy)
    else:
        r = data.state[i, c.RADIUS]
        collider = -1 - data.line_tags[f, c.COLLIDER]
        row = add_row(data, i, collider, state[i, c.X] - r * nx, state[i, c.Y] - r * ny, -nx, -ny)
        add_impulse(data, row, -jx, -jy)


@kernel
def line_kick(lines: FloatArray, f: int, x: float, y: float, closing: float) -> float:
    """Return the kick speed of a line that a ball at (x, y) hits, m/s."""
    fraction = ((x - lines[f, c.PX]) * lines[f, c.UX] + (y - lines[f, c.PY]) * lines[f, c.UY]) / lines[
        f, c.SOLID_LENGTH
    ]
    fraction = lines[f, c.WALL_BEGIN] + lines[f, c.WALL_SPAN] * min(max(fraction, 0.0), 1.0)
    return compiled_kicked(
        lines[f, c.KICK_SPEED], lines[f, c.KICK_THRESHOLD], lines[f, c.KICK_PROFILE] != 0.0, fraction, closing
    )


@kernel
def recheck_supports(data: EventState, i: int) -> None:
    """Decide which supports a ball keeps after its velocity or its supports have changed."""
    state = data.state
    for slot in (1, 0):
        f = data.tags[i, c.SUPPORT + slot]
        if f < 0:
            continue
        if not is_solid(data.lines, f):
            release_support(data, i, slot)
            continue
        nx, ny = data.lines[f, c.NX], data.lines[f, c.NY]
        press = -(data.world[c.GX] * nx + data.world[c.GY] * ny)
        tolerance = REST_TIME * abs(press) + NOISE * (abs(state[i, c.VX]) + abs(state[i, c.VY]))
        normal_velocity = state[i, c.VX] * nx + state[i, c.VY] * ny
        if normal_velocity > tolerance or normal_velocity < -max(ABSORBED_SPEED, tolerance):
            release_support(data, i, slot)
        elif normal_velocity < -tolerance:
            friction = data.surfaces[c.FRICTION, data.tags[i, c.SURFACE], data.line_tags[f, c.COLLIDER_SURFACE]]
            jx, jy = collide_fixed(data, i, nx, ny, 0.0, 0.0, friction, slip_target_of(data, i, slot))
            add_impulse(data, data.tags[i, c.LOG_ROW + slot], -jx, -jy)


@kernel
def update_supported_motion(data: EventState, i: int) -> None:
    """Recompute the acceleration of a ball from its supports; without one it is in free fall."""
    state = data.state
    if is_in_corner(data.tags, i):
        rest_in_corner(data, i)
    if is_supported(data.tags, i) and not is_in_corner(data.tags, i):
        f = data.tags[i, c.SUPPORT]
        press = -(data.world[c.GX] * data.lines[f, c.NX] + data.world[c.GY] * data.lines[f, c.NY])
        if press <= NOISE * (abs(data.world[c.GX]) + abs(data.world[c.GY])):
            release_support(data, i, 0)
        else:
            move_on_one_line(data, i, f, press)
    if not is_supported(data.tags, i):
        set_free_fall(state, data.world, i)
        data.state[i, c.SUPPORT_FORCE], data.state[i, c.SUPPORT_FORCE + 1] = 0.0, 0.0
    state[i, c.LOGGED_UNTIL] = state[i, c.T]


@kernel
def set_free_fall(state: FloatArray, world: FloatArray, i: int) -> None:
    """Set the acceleration of a ball without supports to gravity."""
    state[i, c.AX], state[i, c.AY], state[i, c.ALPHA] = world[c.GX], world[c.GY], 0.0
    state[i, c.SLIP_END_TIME] = math.inf


@kernel
def move_on_one_line(data: EventState, i: int, f: int, press: float) -> None:
    """Set the motion of a ball that slides, rolls or rests on one line; `press` is gravity's normal component, m/s²."""
    state, r = data.state, data.state[i, c.RADIUS]
    inverse_mass, inverse_inertia = data.state[i, c.INVERSE_MASS], data.state[i, c.INVERSE_INERTIA]
    nx, ny = data.lines[f, c.NX], data.lines[f, c.NY]
    tx, ty = -ny, nx
    tangential_gravity = data.world[c.GX] * tx + data.world[c.GY] * ty
    if abs(tangential_gravity) <= NOISE * press:
        tangential_gravity = 0.0
    v = state[i, c.VX] * tx + state[i, c.VY] * ty
    friction = data.surfaces[c.FRICTION, data.tags[i, c.SURFACE], data.line_tags[f, c.COLLIDER_SURFACE]]
    # acceleration of the contact point relative to that of the centre
    contact_gain = 1.0 + r * r * inverse_inertia / inverse_mass
    slip_target = slip_target_of(data, i, 0)
    slip = v - state[i, c.SPIN] * r - slip_target
    slip_end, max_friction = math.inf, friction * press
    friction_acceleration = 0.0  # friction per mass, m/s²
    speeds = abs(v) + abs(state[i, c.SPIN] * r) + abs(slip_target)
    if abs(slip) <= NOISE * speeds + REST_TIME * max_friction * contact_gain:
        slip = 0.0
    if slip == 0.0 and abs(tangential_gravity) <= max_friction * contact_gain:
        friction_acceleration = -tangential_gravity / contact_gain
        if inverse_inertia > 0.0 and friction > 0.0:
            account_spin(data, i, (v - slip_target) / r)
            state[i, c.SPIN] = (v - slip_target) / r
    else:
        slip_direction = slip if slip != 0.0 else tangential_gravity
        friction_acceleration = -max_friction if slip_direction > 0.0 else max_friction
        rate = tangential_gravity + friction_acceleration * contact_gain
        if slip * rate < 0.0:
            slip_end = state[i, c.T] + (state[i, c.TIME_RESIDUAL] - slip / rate)
    a = tangential_gravity + friction_acceleration
    set_supported_velocity(data, i, 0, v * tx, v * ty)
    state[i, c.AX], state[i, c.AY] = a * tx, a * ty
    state[i, c.ALPHA] = -r * friction_acceleration * inverse_inertia / inverse_mass
    state[i, c.SLIP_END_TIME] = slip_end
    data.state[i, c.SUPPORT_FORCE] = (state[i, c.AX] - data.world[c.GX]) / inverse_mass
    data.state[i, c.SUPPORT_FORCE + 1] = (state[i, c.AY] - data.world[c.GY]) / inverse_mass


@kernel
def end_slip(data: EventState, i: int) -> None:
    """Set slip (in a corner: spin) to exactly zero at the end of sliding."""
    state, f = data.state, data.tags[i, c.SUPPORT]
    if is_in_corner(data.tags, i):
        account_spin(data, i, 0.0)
        state[i, c.SPIN] = 0.0
    elif data.state[i, c.INVERSE_INERTIA] > 0.0:
        v = -state[i, c.VX] * data.lines[f, c.NY] + state[i, c.VY] * data.lines[f, c.NX]
        spin = (v - slip_target_of(data, i, 0)) / state[i, c.RADIUS]
        account_spin(data, i, spin)
        state[i, c.SPIN] = spin
    else:
        v = state[i, c.SPIN] * data.state[i, c.RADIUS] + slip_target_of(data, i, 0)
        set_supported_velocity(data, i, 0, -v * data.lines[f, c.NY], v * data.lines[f, c.NX])


@kernel
def pass_line_end(data: EventState, i: int) -> None:
    """Move a ball at the end of its line to the next parallel line, or release it."""
    state, lines, f = data.state, data.lines, data.tags[i, c.SUPPORT]
    # At a convex joint the centre reaches the end of one line before it is above the next.
    tolerance = JOIN_GAP + PARALLEL_ANGLE * state[i, c.RADIUS]
    for g in range(len(lines)):
        if g == f or not are_parallel(lines, f, g):
            continue
        x, y = state[i, c.X] - lines[g, c.PX], state[i, c.Y] - lines[g, c.PY]
        if abs(x * lines[g, c.NX] + y * lines[g, c.NY] - data.state[i, c.RADIUS]) > JOIN_GAP:
            continue
        foot, v = (
            x * lines[g, c.UX] + y * lines[g, c.UY],
            state[i, c.VX] * lines[g, c.UX] + state[i, c.VY] * lines[g, c.UY],
        )
        if v == 0.0:
            v = state[i, c.AX] * lines[g, c.UX] + state[i, c.AY] * lines[g, c.UY]
        if (v > 0.0 and -tolerance <= foot < lines[g, c.LENGTH] - tolerance) or (
            v < 0.0 and tolerance < foot <= lines[g, c.LENGTH] + tolerance
        ):
            data.tags[i, c.SUPPORT] = g
            if data.line_tags[g, c.COLLIDER] != data.line_tags[f, c.COLLIDER]:
                open_support_row(data, i, 0)
            return
    release_support(data, i, 0)
    record_partner(state, data.tags, i, c.LINE_END, f)
