"""Booking: what each impulse and each slide took of the energy, or gave.

An impulse J changes the energy by J times the mean of the velocities before and after it where it acts, to the bit of
rounding: the mean is that after it less half of what it changed. Nothing here touches the state.
"""

from sandbox.engines.exact.arena import (
    ACCOUNTING,
    ALPHA,
    AX,
    AY,
    BOOKED,
    BOOKED_LATE,
    BY_KICKS,
    BY_NORMAL,
    BY_PHANTOM,
    BY_RUBBING,
    FORCE,
    FRICTION,
    LATE,
    LIGHTNESS,
    NX,
    NY,
    RADIUS,
    READINESS,
    SPIN,
    SUPPORT,
    SURFACE,
    VX,
    VY,
    Arena,
    T,
)
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray


@kernel
def enter(world: FloatArray, place: int, energy: float) -> None:
    """Book what one slide took under its place; what it gave is phantom."""
    if energy > 0.0:
        world[BY_PHANTOM] += energy
    else:
        world[place] += energy


@kernel
def touch(world: FloatArray, along: float, across: float) -> None:
    """Book what a contact brought along its normal and along its surface, as `Account.touch` does."""
    both = along + across
    if both > 0.0:
        world[BY_PHANTOM] += both
    elif along > 0.0:
        world[BY_RUBBING] += both
    elif across > 0.0:
        world[BY_NORMAL] += both
    else:
        world[BY_NORMAL] += along
        world[BY_RUBBING] += across


@kernel
def rim(state: FloatArray, i: int) -> float:
    """Return how fast a ball's rim turns, m/s; of one that nothing can turn no impulse finds any of it."""
    if state[i, READINESS] > 0.0:
        return float(state[i, SPIN] * state[i, RADIUS])
    return 0.0


@kernel
def readiness(state: FloatArray, i: int) -> float:
    """Return how readily an impulse along a ball's rim sets that in motion, 1/kg."""
    return float(state[i, LIGHTNESS] + state[i, RADIUS] * state[i, RADIUS] * state[i, READINESS])


@kernel
def book_hit(arena: Arena, i: int, j: int, jx: float, jy: float, nx: float, ny: float) -> None:
    """Book what has happened between two balls.

    Args:
        arena: everything, after it.
        i: ball.
        j: ball.
        jx: the impulse that i gave to j, N·s.
        jy: likewise.
        nx: normal from i to j.
        ny: likewise.
    """
    state, world = arena.state, arena.world
    normal, rub = jx * nx + jy * ny, jy * nx - jx * ny
    vx, vy = state[j, VX] - state[i, VX], state[j, VY] - state[i, VY]
    parting = vx * nx + vy * ny
    along = normal * (parting - 0.5 * normal * (state[i, LIGHTNESS] + state[j, LIGHTNESS]))
    across = 0.0  # what rounding leaves of no impulse is no friction
    if arena.surfaces[FRICTION, arena.tags[i, SURFACE], arena.tags[j, SURFACE]] > 0.0:
        slip = vy * nx - vx * ny - (rim(state, i) + rim(state, j))
        across = rub * (slip - 0.5 * rub * (readiness(state, i) + readiness(state, j)))
    touch(world, along, across)


@kernel
def book_strike(arena: Arena, i: int, nx: float, ny: float, normal: float, across: float, kick: float) -> None:
    """Book what has happened between a ball and something fixed.

    Args:
        arena: everything, after it.
        i: ball.
        nx: normal out of the fixed thing.
        ny: likewise.
        normal: impulse on the ball along it, N·s.
        across: impulse along the surface, to the normal's left.
        kick: what a kick brought, J.
    """
    state, world = arena.state, arena.world
    out = state[i, VX] * nx + state[i, VY] * ny
    slip = state[i, VY] * nx - state[i, VX] * ny - rim(state, i)
    took = across * (slip - 0.5 * across * readiness(state, i))
    touch(world, normal * (out - 0.5 * normal * state[i, LIGHTNESS]) - kick, took)
    world[BY_KICKS] += kick


@kernel
def book_velocity(arena: Arena, i: int, vx: float, vy: float) -> None:
    """Book that a ball's supports are about to set its velocity, m/s."""
    if arena.counts[ACCOUNTING] != 0:
        state = arena.state
        dx, dy = vx - state[i, VX], vy - state[i, VY]
        mean = dx * (vx + state[i, VX]) + dy * (vy + state[i, VY])
        enter(arena.world, BY_NORMAL, 0.5 * mean / state[i, LIGHTNESS])


@kernel
def book_spin(arena: Arena, i: int, spin: float) -> None:
    """Book that friction is about to set a ball's spin, rad/s."""
    if arena.counts[ACCOUNTING] != 0 and arena.state[i, READINESS] > 0.0:
        before = arena.state[i, SPIN]
        enter(arena.world, BY_RUBBING, 0.5 * (spin - before) * (spin + before) / arena.state[i, READINESS])


@kernel
def book_slide(arena: Arena, i: int, t: float, late: float) -> None:
    """Book what friction took of a ball on its supports up to a time, t and `late`, what rounding has cut off it.

    The force is constant and the slip changes evenly, so this is in closed form: force times the way slipped.
    """
    state = arena.state
    begin = (state[i, BOOKED] - state[i, T]) + (state[i, BOOKED_LATE] - state[i, LATE])
    end = (t - state[i, T]) + (late - state[i, LATE])
    state[i, BOOKED], state[i, BOOKED_LATE] = t, late
    span = end - begin
    if span <= 0.0:
        return
    middle = begin + 0.5 * span
    for which in range(2):
        f = arena.tags[i, SUPPORT + which]
        if f < 0:
            continue
        tx, ty = -arena.flats[f, NY], arena.flats[f, NX]
        force = state[i, FORCE + 2 * which] * tx + state[i, FORCE + 2 * which + 1] * ty
        vx, vy = state[i, VX] + state[i, AX] * middle, state[i, VY] + state[i, AY] * middle
        turning = 0.0
        if state[i, READINESS] > 0.0:
            turning = (state[i, SPIN] + state[i, ALPHA] * middle) * state[i, RADIUS]
        enter(arena.world, BY_RUBBING, force * (vx * tx + vy * ty - turning) * span)


@kernel
def book_slides(arena: Arena, t: float, late: float) -> None:
    """Do so for every ball."""
    for k in range(len(arena.movers)):
        book_slide(arena, arena.movers[k], t, late)
