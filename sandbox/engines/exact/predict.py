"""Prediction: a ball's earliest event, as all motions now are."""

import math

from sandbox.engines.exact.arena import (
    AX,
    AY,
    BALL,
    EDGE,
    ENDS,
    FLAT,
    HALF,
    KNOB,
    LAST_KIND,
    LAST_TIME,
    LAST_WHO,
    LENGTH,
    NEXT_KIND,
    NEXT_LATE,
    NEXT_STAMP,
    NEXT_WHO,
    NONE,
    NX,
    NY,
    PAIR_TESTS,
    PREDICTIONS,
    PX,
    PY,
    RADIUS,
    SLIDES,
    SLIP_ENDS,
    STAMP,
    SUPPORT,
    UX,
    UY,
    Arena,
)
from sandbox.engines.exact.motion import place
from sandbox.engines.exact.nearest import nearest_ball, nearest_knob
from sandbox.engines.exact.roots import NOISE, flat_entry
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray, IntArray

PARALLEL = 1e-5
"""Flats whose normals differ by less, rad, are one: a ball rolls from one on to the other. At so flat a joint an impact
would change its velocity by 1e-5 of it, and rounding would decide whether it is found."""


@kernel
def parallel(flats: FloatArray, f: int, g: int) -> bool:
    """Tell whether two flats face the same way."""
    cross = flats[f, NX] * flats[g, NY] - flats[f, NY] * flats[g, NX]
    dot = flats[f, NX] * flats[g, NX] + flats[f, NY] * flats[g, NY]
    return bool(dot > 0.0 and abs(cross) <= PARALLEL)


@kernel
def flat_time(
    flats: FloatArray,
    f: int,
    x: float,
    y: float,
    vx: float,
    vy: float,
    ax: float,
    ay: float,
    radius: float,
    met: bool,
) -> float:
    """Return after what time a ball hits a flat.

    Args:
        flats: all flats.
        f: which.
        x: of the ball, m.
        y: likewise.
        vx: its velocity, m/s.
        vy: likewise.
        ax: its acceleration, m/s².
        ay: likewise.
        radius: m.
        met: they have just met, and do not close, whatever rounding says.
    """
    nx, ny, length = flats[f, NX], flats[f, NY], flats[f, LENGTH]
    b, a = vx * nx + vy * ny, ax * nx + ay * ny
    if abs(b) <= NOISE * (abs(vx) + abs(vy)) or (met and b < 0.0):
        b = 0.0
    if abs(a) <= NOISE * (abs(ax) + abs(ay)):
        a = 0.0
    if b >= 0.0 and a >= 0.0:
        return math.inf
    rx, ry = x - flats[f, PX], y - flats[f, PY]
    c = rx * nx + ry * ny - radius
    if length == math.inf:
        return flat_entry(max(c, 0.0), b, a)
    foot = rx * flats[f, UX] + ry * flats[f, UY]
    if 0.0 <= foot <= length and c + radius + flats[f, HALF] > 0.0:
        c = max(c, 0.0)  # in touch: what lies below zero is rounding, or an overlap that a start may have
    tau = flat_entry(c, b, a)
    if tau < math.inf:
        along = foot + ((vx + 0.5 * ax * tau) * flats[f, UX] + (vy + 0.5 * ay * tau) * flats[f, UY]) * tau
        if along < 0.0 or along > length:
            return math.inf
    return tau


@kernel
def edge_time(flats: FloatArray, f: int, x: float, y: float, vx: float, vy: float, ax: float, ay: float) -> float:
    """Return after what time a ball that rests on a flat comes to an end of it."""
    length, ux, uy = flats[f, LENGTH], flats[f, UX], flats[f, UY]
    if length == math.inf:
        return math.inf
    foot = min(max((x - flats[f, PX]) * ux + (y - flats[f, PY]) * uy, 0.0), length)
    v, a = vx * ux + vy * uy, ax * ux + ay * uy
    return min(flat_entry(foot, v, a), flat_entry(length - foot, -v, -a))


@kernel
def predict(arena: Arena, i: int, now: float, late: float) -> None:
    """Write down a ball's earliest event from now on."""
    arena.counts[PREDICTIONS] += 1
    arena.counts[PAIR_TESTS] += len(arena.flats) + len(arena.knobs) + len(arena.others)
    foresee(
        arena.state,
        arena.tags,
        arena.next_time,
        arena.flats,
        arena.flat_tags,
        arena.knobs,
        arena.others,
        i,
        now,
        late,
    )


@kernel
def foresee(
    state: FloatArray,
    tags: IntArray,
    next_time: FloatArray,
    flats: FloatArray,
    flat_tags: IntArray,
    knobs: FloatArray,
    others: IntArray,
    i: int,
    now: float,
    late: float,
) -> None:
    """Do so; passing few arrays instead of the arena saves counting references to all.

    Of several at one instant the first in this order: its sliding ends, it comes to an edge, flats, knobs, balls, each
    by number.
    """
    x, y, vx, vy = place(state, i, now, late)
    ax, ay, radius = state[i, AX], state[i, AY], state[i, RADIUS]
    best, kind, partner = math.inf, NONE, -1
    fresh = state[i, LAST_TIME] == now
    last_kind, last_who = tags[i, LAST_KIND], tags[i, LAST_WHO]
    s1, s2 = tags[i, SUPPORT], tags[i, SUPPORT + 1]
    if state[i, SLIDES] < math.inf:
        best, kind = max((state[i, SLIDES] - now) - late, 0.0), SLIP_ENDS
    if s1 >= 0 and s2 < 0:
        tau = edge_time(flats, s1, x, y, vx, vy, ax, ay)
        if tau < best:
            best, kind, partner = tau, EDGE, s1

    for f in range(len(flats)):
        if s1 >= 0 and (f in (s1, s2) or parallel(flats, f, s1)):
            continue
        if vx * flats[f, NX] + vy * flats[f, NY] >= 0.0 and ax * flats[f, NX] + ay * flats[f, NY] >= 0.0:
            continue
        if fresh and last_kind == EDGE and last_who == f:
            continue  # it has just come to the end of this one
        met = fresh and last_kind == FLAT and last_who == f
        tau = flat_time(flats, f, x, y, vx, vy, ax, ay, radius, met)
        if tau < best:
            best, kind, partner = tau, FLAT, f

    met_knob, skip, other = -1, -1, -1
    if fresh and last_kind == KNOB:
        met_knob = last_who
    if s1 >= 0:
        skip, other = flat_tags[s1, ENDS], flat_tags[s1, ENDS + 1]
    k, tau = -1, math.inf
    if len(knobs) > 0:
        k, tau = nearest_knob(knobs, state, i, now, late, best, met_knob, skip, other)
    if k >= 0:
        best, kind, partner = tau, KNOB, k
    j, tau = nearest_ball(state, tags, others, i, now, late, best)
    if j >= 0:
        best, kind, partner = tau, BALL, j
        tags[i, NEXT_STAMP] = tags[j, STAMP]
    # Two-sum: times grow, and what rounding cuts off them would be the largest error of a long run.
    after = best + late
    time = now + after
    virtual = time - now
    state[i, NEXT_LATE] = 0.0
    if time < math.inf:
        state[i, NEXT_LATE] = (now - (time - virtual)) + (after - virtual)
    next_time[i] = time
    tags[i, NEXT_KIND], tags[i, NEXT_WHO] = kind, partner
