"""Corner: a ball at rest on two flats. It stands, or turns on the spot until its spin has faded, or leaves one."""

import math

from sandbox.engines.exact.arena import (
    ALPHA,
    AX,
    AY,
    COAT,
    FORCE,
    FRICTION,
    GX,
    GY,
    LATE,
    LIGHTNESS,
    NX,
    NY,
    RADIUS,
    READINESS,
    SLIDES,
    SPIN,
    SUPPORT,
    SURFACE,
    Arena,
    T,
)
from sandbox.engines.exact.booking import book_spin
from sandbox.engines.exact.hold import REST_TIME, keep, release
from sandbox.engines.kernel import bare_kernel as kernel


@kernel
def pushes(arena: Arena, i: int, turning: float) -> tuple[float, float, float, float]:
    """Return what holds a ball in a corner: normal force and friction of each support, by mass, m/s².

    Args:
        arena: everything.
        i: ball.
        turning: the sign of its spin; 0 leaves friction out, which a ball that stands does not need.
    """
    f, g = arena.tags[i, SUPPORT], arena.tags[i, SUPPORT + 1]
    mine = arena.tags[i, SURFACE]
    mu = turning * arena.surfaces[FRICTION, mine, arena.flat_tags[f, COAT]]
    nu = turning * arena.surfaces[FRICTION, mine, arena.flat_tags[g, COAT]]
    flats = arena.flats
    # A ball that turns left slips to the right of each normal's left: friction acts along + t there.
    ax, ay = flats[f, NX] - mu * flats[f, NY], flats[f, NY] + mu * flats[f, NX]
    bx, by = flats[g, NX] - nu * flats[g, NY], flats[g, NY] + nu * flats[g, NX]
    determinant = ax * by - ay * bx
    if determinant == 0.0:
        return -1.0, -1.0, 0.0, 0.0
    gx, gy = -arena.world[GX], -arena.world[GY]
    first, second = (gx * by - gy * bx) / determinant, (ax * gy - ay * gx) / determinant
    return first, second, mu * first, nu * second


@kernel
def corner(arena: Arena, i: int) -> None:
    """Let a ball stand in a corner, its spin fading; or end the support that does not press."""
    state, r = arena.state, arena.state[i, RADIUS]
    im, ii = arena.state[i, LIGHTNESS], arena.state[i, READINESS]
    if abs(state[i, SPIN]) * r <= REST_TIME * (abs(arena.world[GX]) + abs(arena.world[GY])) and ii > 0.0:
        book_spin(arena, i, 0.0)
        state[i, SPIN] = 0.0
    turning = 0.0
    if state[i, SPIN] != 0.0 and ii > 0.0:
        turning = 1.0 if state[i, SPIN] > 0.0 else -1.0
    first, second, mu, nu = pushes(arena, i, turning)
    if first < 0.0 or second < 0.0:
        calm, other, _, _ = pushes(arena, i, 0.0)
        if turning == 0.0 or calm < 0.0 or other < 0.0 or (first < 0.0) != (second < 0.0):
            release(arena, i, 0 if first < 0.0 else 1)
            return
        book_spin(arena, i, 0.0)
        state[i, SPIN], turning = 0.0, 0.0  # it jams: no two forces within friction let it turn on
        first, second, mu, nu = calm, other, 0.0, 0.0
    keep(arena, i, 1, 0.0, 0.0)
    state[i, AX], state[i, AY] = 0.0, 0.0
    state[i, ALPHA] = -r * (mu + nu) * ii / im
    state[i, SLIDES] = math.inf
    if state[i, ALPHA] != 0.0:
        state[i, SLIDES] = state[i, T] + (state[i, LATE] - state[i, SPIN] / state[i, ALPHA])
    for which in range(2):
        f = arena.tags[i, SUPPORT + which]
        push, rub = (first, mu) if which == 0 else (second, nu)
        arena.state[i, FORCE + 2 * which] = (push * arena.flats[f, NX] - rub * arena.flats[f, NY]) / im
        arena.state[i, FORCE + 2 * which + 1] = (push * arena.flats[f, NY] + rub * arena.flats[f, NX]) / im
