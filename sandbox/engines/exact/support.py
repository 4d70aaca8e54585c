"""Support: a ball at rest on a flat. It slides, rolls or stands, each in closed form; on two it is in a corner.

Slip of the contact point u = v·t − ω R, with t the normal turned left. While it slips friction is μ N against it; the
slip changes at a constant rate and its end is an event. Then the ball rolls (a = ⅔ g·t for a disc) while that takes
no more than μ N, that is while |g·t| ≤ 3 μ |g·n|, and slides on otherwise.
"""

import math

from sandbox.engines.exact.arena import (
    ALPHA,
    AX,
    AY,
    BEGIN,
    COAT,
    EDGE,
    FALLOFF,
    FLAT,
    FORCE,
    FRICTION,
    GX,
    GY,
    KICK,
    LATE,
    LENGTH,
    LIGHTNESS,
    MIDDLE,
    NX,
    NY,
    PX,
    PY,
    RADIUS,
    READINESS,
    RESTITUTION,
    ROW,
    SINCE,
    SLIDES,
    SPAN,
    SPIN,
    SUPPORT,
    SURFACE,
    THING,
    THRESHOLD,
    TO_APPROACH,
    UX,
    UY,
    VX,
    VY,
    WHOLE,
    Arena,
    T,
    X,
    Y,
)
from sandbox.engines.exact.booking import book_spin
from sandbox.engines.exact.corner import corner
from sandbox.engines.exact.hold import REST_TIME, keep, release
from sandbox.engines.exact.impact import note, strike
from sandbox.engines.exact.log import add_impulse, open_rest, open_row
from sandbox.engines.exact.predict import PARALLEL, parallel
from sandbox.engines.exact.roots import NOISE
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.rebound import compiled_kick_gain, compiled_kicked, compiled_rebound
from sandbox.trajectory import FloatArray

TICKS = 8.0 * 2.0**-52
"""As `REST_TIME`, for a single bounce and as a share of the time: what is shorter cannot be told from nothing."""

ABSORBED = 1e-3
"""m/s: a ball at rest that is knocked into its support more slowly than this stays at rest."""

TOUCH = 1e-9
"""m: how far off the next flat may begin for a ball to roll on to it."""


@kernel
def hit_flat(arena: Arena, i: int, f: int) -> None:
    """Let a ball hit a flat: it bounces, or begins to rest."""
    state = arena.state
    nx, ny = arena.flats[f, NX], arena.flats[f, NY]
    mine, its = arena.tags[i, SURFACE], arena.flat_tags[f, COAT]
    restitution, friction = arena.surfaces[RESTITUTION, mine, its], arena.surfaces[FRICTION, mine, its]
    closing = max(-(state[i, VX] * nx + state[i, VY] * ny), 0.0)
    press = -(state[i, AX] * nx + state[i, AY] * ny)
    falloff = arena.surfaces[FALLOFF, mine, its]
    parting = compiled_rebound(restitution, falloff, closing)
    kick = 0.0
    if arena.flats[f, KICK] > 0.0:
        kick = flat_kick(arena.flats, f, state[i, X], state[i, Y], closing)
        kick = compiled_kick_gain(restitution, falloff, kick, arena.flats[f, TO_APPROACH] != 0.0, closing)
    rests = False
    if press > 0.0 and kick == 0.0:
        hop = 2.0 * parting / press
        rests = hop <= TICKS * abs(state[i, T]) or hop <= REST_TIME * (1.0 - restitution)
    jx, jy = strike(arena, i, nx, ny, 0.0 if rests else parting, kick, friction)
    note(state, arena.tags, i, FLAT, f)
    knocked(arena, i)
    if rests and arena.tags[i, SUPPORT + 1] < 0:
        which = 0 if arena.tags[i, SUPPORT] < 0 else 1
        arena.tags[i, SUPPORT + which] = f
        open_rest(arena, i, which)
        add_impulse(arena, arena.tags[i, ROW + which], -jx, -jy)
    else:
        r = arena.state[i, RADIUS]
        thing = -1 - arena.flat_tags[f, THING]
        row = open_row(arena, i, thing, state[i, X] - r * nx, state[i, Y] - r * ny, -nx, -ny)
        add_impulse(arena, row, -jx, -jy)


@kernel
def flat_kick(flats: FloatArray, f: int, x: float, y: float, closing: float) -> float:
    """Return the speed with which a flat that is hit from (x, y) kicks, m/s."""
    share = ((x - flats[f, PX]) * flats[f, UX] + (y - flats[f, PY]) * flats[f, UY]) / flats[f, WHOLE]
    share = flats[f, BEGIN] + flats[f, SPAN] * min(max(share, 0.0), 1.0)
    return compiled_kicked(flats[f, KICK], flats[f, THRESHOLD], flats[f, MIDDLE] != 0.0, share, closing)


@kernel
def knocked(arena: Arena, i: int) -> None:
    """Decide which supports a ball keeps, whose velocity something has changed."""
    state = arena.state
    for which in (1, 0):
        f = arena.tags[i, SUPPORT + which]
        if f < 0:
            continue
        if arena.flats[f, LENGTH] < 0.0:  # it has ceased to be solid
            release(arena, i, which)
            continue
        nx, ny = arena.flats[f, NX], arena.flats[f, NY]
        press = -(arena.world[GX] * nx + arena.world[GY] * ny)
        least = REST_TIME * abs(press) + NOISE * (abs(state[i, VX]) + abs(state[i, VY]))
        out = state[i, VX] * nx + state[i, VY] * ny
        if out > least or out < -max(ABSORBED, least):
            release(arena, i, which)
        elif out < -least:
            friction = arena.surfaces[FRICTION, arena.tags[i, SURFACE], arena.flat_tags[f, COAT]]
            jx, jy = strike(arena, i, nx, ny, 0.0, 0.0, friction)
            add_impulse(arena, arena.tags[i, ROW + which], -jx, -jy)


@kernel
def settle(arena: Arena, i: int) -> None:
    """Work out how a ball moves on from now, by what it rests on."""
    state = arena.state
    if arena.tags[i, SUPPORT + 1] >= 0:
        corner(arena, i)
    if arena.tags[i, SUPPORT] >= 0 and arena.tags[i, SUPPORT + 1] < 0:
        f = arena.tags[i, SUPPORT]
        press = -(arena.world[GX] * arena.flats[f, NX] + arena.world[GY] * arena.flats[f, NY])
        if press <= NOISE * (abs(arena.world[GX]) + abs(arena.world[GY])):
            release(arena, i, 0)
        else:
            single(arena, i, f, press)
    if arena.tags[i, SUPPORT] < 0:
        fly(state, arena.world, i)
        arena.state[i, FORCE], arena.state[i, FORCE + 1] = 0.0, 0.0
    state[i, SINCE] = state[i, T]


@kernel
def fly(state: FloatArray, world: FloatArray, i: int) -> None:
    """Let a ball that nothing supports fall."""
    state[i, AX], state[i, AY], state[i, ALPHA] = world[GX], world[GY], 0.0
    state[i, SLIDES] = math.inf


@kernel
def single(arena: Arena, i: int, f: int, press: float) -> None:
    """Let a ball slide, roll or stand on one flat, which gravity presses it on to with `press`, m/s²."""
    state, r = arena.state, arena.state[i, RADIUS]
    im, ii = arena.state[i, LIGHTNESS], arena.state[i, READINESS]
    nx, ny = arena.flats[f, NX], arena.flats[f, NY]
    tx, ty = -ny, nx
    pull = arena.world[GX] * tx + arena.world[GY] * ty
    if abs(pull) <= NOISE * press:
        pull = 0.0
    v = state[i, VX] * tx + state[i, VY] * ty
    friction = arena.surfaces[FRICTION, arena.tags[i, SURFACE], arena.flat_tags[f, COAT]]
    ease = 1.0 + r * r * ii / im  # how much more readily the contact point moves than the centre
    slip = v - state[i, SPIN] * r
    slides, most = math.inf, friction * press
    drive = 0.0  # friction by mass
    if abs(slip) <= NOISE * (abs(v) + abs(state[i, SPIN] * r)) + REST_TIME * most * ease:
        slip = 0.0
    if slip == 0.0 and abs(pull) <= most * ease:
        drive = -pull / ease
        if ii > 0.0 and friction > 0.0:
            book_spin(arena, i, v / r)
            state[i, SPIN] = v / r
    else:
        downhill = slip if slip != 0.0 else pull
        drive = -most if downhill > 0.0 else most
        rate = pull + drive * ease
        if slip * rate < 0.0:
            slides = state[i, T] + (state[i, LATE] - slip / rate)
    a = pull + drive
    keep(arena, i, 0, v * tx, v * ty)
    state[i, AX], state[i, AY] = a * tx, a * ty
    state[i, ALPHA] = -r * drive * ii / im
    state[i, SLIDES] = slides
    arena.state[i, FORCE] = (state[i, AX] - arena.world[GX]) / im
    arena.state[i, FORCE + 1] = (state[i, AY] - arena.world[GY]) / im


@kernel
def slip_ends(arena: Arena, i: int) -> None:
    """Let a ball's slip be zero, or in a corner its spin, as it is at the end of sliding but for rounding."""
    state, f = arena.state, arena.tags[i, SUPPORT]
    if arena.tags[i, SUPPORT + 1] >= 0:
        book_spin(arena, i, 0.0)
        state[i, SPIN] = 0.0
    elif arena.state[i, READINESS] > 0.0:
        spin = (-state[i, VX] * arena.flats[f, NY] + state[i, VY] * arena.flats[f, NX]) / state[i, RADIUS]
        book_spin(arena, i, spin)
        state[i, SPIN] = spin
    else:
        v = state[i, SPIN] * arena.state[i, RADIUS]
        keep(arena, i, 0, -v * arena.flats[f, NY], v * arena.flats[f, NX])


@kernel
def pass_edge(arena: Arena, i: int) -> None:
    """Let a ball that has come to the end of a flat roll on to the next, or leave."""
    state, flats, f = arena.state, arena.flats, arena.tags[i, SUPPORT]
    # Over a joint that falls off, its centre comes to the end of the one flat before it is over the next.
    beside = TOUCH + PARALLEL * state[i, RADIUS]
    for g in range(len(flats)):
        if g == f or not parallel(flats, f, g):
            continue
        x, y = state[i, X] - flats[g, PX], state[i, Y] - flats[g, PY]
        if abs(x * flats[g, NX] + y * flats[g, NY] - arena.state[i, RADIUS]) > TOUCH:
            continue
        foot, v = x * flats[g, UX] + y * flats[g, UY], state[i, VX] * flats[g, UX] + state[i, VY] * flats[g, UY]
        if v == 0.0:
            v = state[i, AX] * flats[g, UX] + state[i, AY] * flats[g, UY]
        if (v > 0.0 and -beside <= foot < flats[g, LENGTH] - beside) or (
            v < 0.0 and beside < foot <= flats[g, LENGTH] + beside
        ):
            arena.tags[i, SUPPORT] = g
            if arena.flat_tags[g, THING] != arena.flat_tags[f, THING]:
                open_rest(arena, i, 0)
            return
    release(arena, i, 0)
    note(state, arena.tags, i, EDGE, f)
