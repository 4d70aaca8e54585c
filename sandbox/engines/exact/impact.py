"""Impact: what a hit does to velocity and spin. Discs: normal and tangential impulse do not disturb each other."""

import math

from sandbox.engines.exact.arena import (
    ABOVE,
    ACCOUNTING,
    ANGLE,
    AX,
    AY,
    BALL,
    COAT,
    FALLOFF,
    FRICTION,
    HOP,
    KICKS,
    KNOB,
    KNOB_TO_APPROACH,
    LAST_KIND,
    LAST_TIME,
    LAST_WHO,
    LATE,
    LIGHTNESS,
    RADIUS,
    READINESS,
    RESTITUTION,
    SPIN,
    SURFACE,
    THING,
    VX,
    VY,
    Arena,
    T,
    X,
    Y,
)
from sandbox.engines.exact.booking import book_strike
from sandbox.engines.exact.log import add_impulse, log_rest, open_row
from sandbox.engines.exact.motion import place, turned
from sandbox.engines.exact.roots import NOISE
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.rebound import compiled_kick_gain, compiled_kicked, compiled_rebound
from sandbox.trajectory import FloatArray, IntArray

ALMOST_STILL = 1e-9
"""m/s: two things, at least one of them round, that meet more slowly than this, or than a hop where there is gravity,
part as fast as they met. This ends the endless series of hits into which inelastic balls otherwise collapse."""


@kernel
def bring(state: FloatArray, tags: IntArray, log: FloatArray, i: int, t: float, late: float) -> None:
    """Bring a ball's row to a time, that of an event of its own."""
    log_rest(state, tags, log, i, t)
    x, y, vx, vy = place(state, i, t, late)
    angle, spin = turned(state, i, t, late)
    state[i, X], state[i, Y], state[i, VX], state[i, VY] = x, y, vx, vy
    state[i, ANGLE], state[i, SPIN] = angle, spin
    state[i, T], state[i, LATE] = t, late


@kernel
def note(state: FloatArray, tags: IntArray, i: int, kind: int, partner: int) -> None:
    """Note whom a ball has just met."""
    tags[i, LAST_KIND], tags[i, LAST_WHO] = kind, partner
    state[i, LAST_TIME] = state[i, T]


@kernel
def rubbed(slip: float, mass: float, friction: float, normal: float) -> float:
    """Return the impulse that friction gives: what would end the slip, and no more than μ of the normal one."""
    most = friction * normal
    return max(min(-slip / mass, most), -most)


@kernel
def strike(
    arena: Arena, i: int, nx: float, ny: float, parting: float, kick: float, friction: float
) -> tuple[float, float]:
    """Let a ball bounce off something fixed.

    Args:
        arena: everything.
        i: ball.
        nx: normal out of the fixed thing.
        ny: likewise.
        parting: speed along the normal after it, m/s, by itself.
        kick: on top of that, m/s.
        friction: coefficient.

    Returns:
        The impulse on the ball, N·s.
    """
    state, r = arena.state, arena.state[i, RADIUS]
    im, ii = arena.state[i, LIGHTNESS], arena.state[i, READINESS]
    closing = -(state[i, VX] * nx + state[i, VY] * ny)
    normal = max((closing + parting + kick) / im, 0.0)
    across = 0.0
    if friction > 0.0:
        slip = -state[i, VX] * ny + state[i, VY] * nx - state[i, SPIN] * r
        across = rubbed(slip, im + r * r * ii, friction, normal)
    jx, jy = normal * nx - across * ny, normal * ny + across * nx
    state[i, VX] += jx * im
    state[i, VY] += jy * im
    state[i, SPIN] -= r * across * ii
    if arena.counts[ACCOUNTING] != 0:
        # From `parting` on the impulse is the kick's: half of it finds the speed before it, half that after.
        book_strike(arena, i, nx, ny, normal, across, kick / im * (parting + 0.5 * kick))
    return jx, jy


@kernel
def parting_speed(hop: float, closing: float, restitution: float, falloff: float, press: float) -> float:
    """Return how fast two things part of which at least one is round.

    e times the closing speed; all of it where that is next to nothing; and where gravity presses them together, no
    less than a hop's speed: there is no rest on anything round.
    """
    parting = compiled_rebound(restitution, falloff, closing)
    if closing <= max(hop, ALMOST_STILL):
        parting = max(closing, 0.0)
    if press > 0.0:
        parting = max(parting, hop)
    return parting


@kernel
def hit_knob(arena: Arena, i: int, k: int) -> None:
    """Let a ball hit a post or the end of a segment."""
    state = arena.state
    dx, dy = arena.knobs[k, 0] - state[i, X], arena.knobs[k, 1] - state[i, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return
    nx, ny = dx / distance, dy / distance
    closing = state[i, VX] * nx + state[i, VY] * ny
    across = -state[i, VX] * ny + state[i, VY] * nx
    press = state[i, AX] * nx + state[i, AY] * ny - across * across / distance
    mine, its = arena.tags[i, SURFACE], arena.knob_tags[k, COAT]
    restitution, falloff = arena.surfaces[RESTITUTION, mine, its], arena.surfaces[FALLOFF, mine, its]
    parting = parting_speed(arena.world[HOP], closing, restitution, falloff, press)
    kick = compiled_kicked(arena.knobs[k, KICKS], arena.knobs[k, ABOVE], False, 0.5, closing)
    kick = compiled_kick_gain(restitution, falloff, kick, arena.knobs[k, KNOB_TO_APPROACH] != 0.0, closing)
    jx, jy = strike(arena, i, -nx, -ny, parting, kick, arena.surfaces[FRICTION, mine, its])
    r = arena.state[i, RADIUS]
    row = open_row(arena, i, -1 - arena.knob_tags[k, THING], state[i, X] + r * nx, state[i, Y] + r * ny, nx, ny)
    add_impulse(arena, row, -jx, -jy)
    note(state, arena.tags, i, KNOB, k)


@kernel
def hit_ball(
    state: FloatArray, tags: IntArray, surfaces: FloatArray, hop: float, i: int, j: int
) -> tuple[float, float, float, float]:
    """Let two balls hit each other, of which the second may be fixed.

    Args:
        state: of all balls.
        tags: likewise.
        surfaces: of all pairs.
        hop: m/s, as in `Arena`.
        i: ball.
        j: ball.

    Returns:
        The impulse that i gives to j, N·s, and the normal from i to j.
    """
    dx, dy = state[j, X] - state[i, X], state[j, Y] - state[i, Y]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    nx, ny = dx / distance, dy / distance
    vx, vy = state[j, VX] - state[i, VX], state[j, VY] - state[i, VY]
    closing, across = -(vx * nx + vy * ny), -vx * ny + vy * nx
    pull = (state[j, AX] - state[i, AX]) * nx + (state[j, AY] - state[i, AY]) * ny
    press = -pull - across * across / distance
    if abs(pull) <= NOISE * (abs(state[i, AX]) + abs(state[i, AY]) + abs(state[j, AX]) + abs(state[j, AY])):
        press = 0.0  # they fall alike: nothing presses them together
    mine, its = tags[i, SURFACE], tags[j, SURFACE]
    parting = parting_speed(hop, closing, surfaces[RESTITUTION, mine, its], surfaces[FALLOFF, mine, its], press)
    ri, rj = state[i, RADIUS], state[j, RADIUS]
    mi, mj = state[i, LIGHTNESS], state[j, LIGHTNESS]
    ii, ij = state[i, READINESS], state[j, READINESS]
    normal = max((closing + parting) / (mi + mj), 0.0)
    rub = 0.0
    friction = surfaces[FRICTION, mine, its]
    if friction > 0.0:
        slip = across - (state[i, SPIN] * ri + state[j, SPIN] * rj)
        rub = rubbed(slip, mi + mj + ri * ri * ii + rj * rj * ij, friction, normal)
    jx, jy = normal * nx - rub * ny, normal * ny + rub * nx  # given by i to j
    state[i, VX] -= jx * mi
    state[i, VY] -= jy * mi
    state[j, VX] += jx * mj
    state[j, VY] += jy * mj
    state[i, SPIN] -= ri * rub * ii
    state[j, SPIN] -= rj * rub * ij
    note(state, tags, i, BALL, j)
    note(state, tags, j, BALL, i)
    return jx, jy, nx, ny


@kernel
def log_hit(arena: Arena, i: int, j: int, jx: float, jy: float, nx: float, ny: float) -> None:
    """Log that two balls have hit each other."""
    state = arena.state
    r = state[i, RADIUS]
    px, py = state[i, X] + r * nx, state[i, Y] + r * ny
    if i < j:
        add_impulse(arena, open_row(arena, i, j, px, py, nx, ny), jx, jy)
    else:
        add_impulse(arena, open_row(arena, j, i, px, py, -nx, -ny), -jx, -jy)
