"""Nearest: which knob or ball a ball meets first."""

from sandbox.engines.exact.arena import (
    AX,
    AY,
    BALL,
    LAST_KIND,
    LAST_TIME,
    LAST_WHO,
    LATE,
    LIGHTNESS,
    MEETS,
    RADIUS,
    SOLID,
    VX,
    VY,
    T,
    X,
    Y,
)
from sandbox.engines.exact.motion import place
from sandbox.engines.exact.quartic import curved_entry
from sandbox.engines.exact.roots import pair_entry
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.roster import ALL
from sandbox.trajectory import FloatArray, IntArray


@kernel
def nearest_knob(
    knobs: FloatArray,
    state: FloatArray,
    i: int,
    now: float,
    late: float,
    best: float,
    met: int,
    skip: int,
    other: int,
) -> tuple[int, float]:
    """Return which knob a ball meets first and after what time, less than `best`; −1 for none.

    Args:
        knobs: all knobs.
        state: of all balls.
        i: ball.
        now: s.
        late: what rounding has cut off it, s.
        best: s.
        met: knob that it has just met, or −1.
        skip: knob at an end of what it rests on, whose circle its path only touches; or −1.
        other: likewise.
    """
    x, y, vx, vy = place(state, i, now, late)
    ax, ay, radius = state[i, AX], state[i, AY], state[i, RADIUS]
    straight, speed, partner = ax == 0.0 and ay == 0.0, abs(vx) + abs(vy), -1
    for k in range(len(knobs)):
        if k in (skip, other) or (straight and k == met) or knobs[k, SOLID] == 0.0:
            continue
        dx, dy, reach = knobs[k, 0] - x, knobs[k, 1] - y, knobs[k, 2] + radius
        if straight:
            tau = pair_entry(dx, dy, -vx, -vy, reach, speed)
        else:
            tau = curved_entry(dx, dy, -vx, -vy, -ax, -ay, reach, k == met, best)
        if tau < best:
            best, partner = tau, k
    return partner, best


@kernel
def nearest_ball(
    state: FloatArray, tags: IntArray, others: IntArray, i: int, now: float, late: float, best: float
) -> tuple[int, float]:
    """Return which ball a ball meets first and after what time, less than `best`; −1 for none."""
    x, y, vx, vy = place(state, i, now, late)
    ax, ay, size = state[i, AX], state[i, AY], state[i, RADIUS]
    everybody = tags[i, MEETS] == ALL
    fresh = state[i, LAST_TIME] == now and tags[i, LAST_KIND] == BALL
    last, partner, speed = tags[i, LAST_WHO], -1, abs(vx) + abs(vy)
    for k in range(len(others)):
        j = others[k]
        if j == i or not (everybody or state[j, LIGHTNESS] == 0.0):
            continue
        tau = (now - state[j, T]) + (late - state[j, LATE])
        bx, by, reach = state[j, AX] - ax, state[j, AY] - ay, size + state[j, RADIUS]
        straight = bx == 0.0 and by == 0.0
        wx, wy = state[j, VX] + state[j, AX] * tau, state[j, VY] + state[j, AY] * tau
        ux, uy = wx - vx, wy - vy
        dx = state[j, X] + 0.5 * (state[j, VX] + wx) * tau - x
        dy = state[j, Y] + 0.5 * (state[j, VY] + wy) * tau - y
        # Most leave, or cannot come near before the best so far. One test for all: each alone is a coin's throw, which
        # a processor guesses wrong. A little slack keeps rounding from deciding.
        ahead = best * 1.000001
        far = (dx * ux + dy * uy >= 0.0) | (abs(dx) > reach + abs(ux) * ahead) | (abs(dy) > reach + abs(uy) * ahead)
        if straight & far:
            continue
        met = fresh and last == j
        if met and state[j, LIGHTNESS] > 0.0:
            met = state[j, LAST_TIME] == now and tags[j, LAST_KIND] == BALL and tags[j, LAST_WHO] == i
        if not straight:
            after = curved_entry(dx, dy, ux, uy, bx, by, reach, met, best)
        elif met:
            continue
        else:
            after = pair_entry(dx, dy, ux, uy, reach, speed + abs(wx) + abs(wy))
        if after < best:
            best, partner = after, j
    return partner, best
