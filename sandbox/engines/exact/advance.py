"""Advance: event after event up to a time, all in one kernel call."""

from sandbox.engines.exact.arena import (
    ACCOUNTING,
    AT_INSTANT,
    BALL,
    BATCH,
    BATCH_BEFORE,
    BUDGET,
    EDGE,
    EVENTS,
    FLAT,
    HOP,
    IN_BATCH,
    IN_SECOND,
    INSTANT,
    KNOB,
    LIGHTNESS,
    NEXT_KIND,
    NEXT_LATE,
    NEXT_STAMP,
    NEXT_WHO,
    NOW,
    NOW_LATE,
    RECORDING,
    ROWS,
    SECOND,
    STAMP,
    SUPPORT,
    WHAT,
    WHO,
    WITH,
    Arena,
)
from sandbox.engines.exact.booking import book_hit, book_slide
from sandbox.engines.exact.impact import bring, hit_ball, hit_knob, log_hit
from sandbox.engines.exact.log import ROOM
from sandbox.engines.exact.motion import place, turned
from sandbox.engines.exact.predict import predict
from sandbox.engines.exact.support import fly, hit_flat, knocked, pass_edge, settle, slip_ends
from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.trajectory import FloatArray, IntArray

DONE, PAUSED, FULL, TOO_MANY, TOO_DENSE, TOO_FAST = range(6)
"""What `advance` returns: up to the time; after `PAUSE` events; the log is full; more events within one second than
the budget; more within one instant; two batches of events so close together that the budget will not last."""

PAUSE = 10_000
"""Events after which a kernel lets Python see to signals: a third of a second with 1,000 balls, compiled."""

MOMENT = 1e-9
"""s: events closer together than this count as one instant."""

PER_BALL = 10_000
"""Events that an instant may have for each ball."""

BATCHES = 8
"""Batches of events in the budget of one second."""

RUSH = 8.0
"""How many times the rate of the budget two batches in a row may reach. Of 234 random scenes of 2 to 120 balls, the 116
that got to their end reached at most 4.9 times that rate, in a fifth of the budget."""


@kernel
def start(arena: Arena) -> None:
    """Let every ball move and look ahead, from the time on that the clock says."""
    for i in range(len(arena.state)):
        if arena.state[i, LIGHTNESS] > 0.0:
            changed(arena, i)
    look_ahead(arena)


@kernel
def arrive(arena: Arena, i: int, t: float, late: float) -> None:
    """Bring a ball to a time, and book what its sliding took until then."""
    if arena.counts[ACCOUNTING] != 0:
        book_slide(arena, i, t, late)
    bring(arena.state, arena.tags, arena.log, i, t, late)


@kernel
def look_ahead(arena: Arena) -> None:
    """Predict every ball's earliest event anew."""
    for k in range(len(arena.movers)):
        predict(arena, arena.movers[k], arena.world[NOW], arena.world[NOW_LATE])


@kernel
def renew(arena: Arena, t: float) -> None:
    """Let every ball go on under what now holds, which an action has changed at a time."""
    arena.world[NOW], arena.world[NOW_LATE] = t, 0.0
    for i in range(len(arena.state)):
        if arena.state[i, LIGHTNESS] > 0.0:
            arrive(arena, i, t, 0.0)
            knocked(arena, i)
    start(arena)


@kernel
def changed(arena: Arena, i: int) -> None:
    """Note that a ball moves otherwise from now on."""
    if arena.tags[i, SUPPORT] >= 0:
        settle(arena, i)
    else:
        fly(arena.state, arena.world, i)
    arena.tags[i, STAMP] += 1


@kernel
def earliest(movers: IntArray, times: FloatArray) -> int:
    """Return the ball whose event is next, of several at one time the lowest; −1 where none moves."""
    who = -1
    if len(movers) > 0:
        who = movers[0]
        best = times[who]
        for k in range(1, len(movers)):
            if times[movers[k]] < best:
                who = movers[k]
                best = times[who]
    return who


@kernel
def within(counts: IntArray, world: FloatArray, balls: int, t: float) -> int:
    """Count an event; return `DONE`, or which bound is passed."""
    counts[EVENTS] += 1
    if t > world[SECOND] + 1.0:
        world[SECOND], counts[IN_SECOND] = t, 0
    if t > world[INSTANT] + MOMENT:
        world[INSTANT], counts[AT_INSTANT] = t, 0
    counts[IN_SECOND] += 1
    counts[AT_INSTANT] += 1
    counts[IN_BATCH] += 1
    if counts[AT_INSTANT] > PER_BALL * (balls + 1):
        return TOO_DENSE
    if counts[IN_SECOND] > counts[BUDGET]:
        return TOO_MANY
    if counts[IN_BATCH] * BATCHES >= counts[BUDGET]:
        span = t - world[BATCH_BEFORE]
        world[BATCH_BEFORE], world[BATCH], counts[IN_BATCH] = world[BATCH], t, 0
        if span * RUSH * BATCHES < 2.0:
            return TOO_FAST
    return DONE


@kernel
def happen(arena: Arena, i: int, kind: int, partner: int, t: float, late: float) -> None:
    """Let a ball's event happen, and look ahead for those whom it concerns.

    Others that were to meet them are left: their times stay bounds, and are looked at when they come up.
    """
    state, tags = arena.state, arena.tags
    arrive(arena, i, t, late)
    both = kind == BALL and state[partner, LIGHTNESS] > 0.0
    if kind == BALL:
        arrive(arena, partner, t, late)
        jx, jy, nx, ny = hit_ball(state, tags, arena.surfaces, arena.world[HOP], i, partner)
        if arena.counts[RECORDING] != 0:
            log_hit(arena, i, partner, jx, jy, nx, ny)
        if arena.counts[ACCOUNTING] != 0:
            book_hit(arena, i, partner, jx, jy, nx, ny)
    elif kind == FLAT:
        hit_flat(arena, i, partner)
    elif kind == KNOB:
        hit_knob(arena, i, partner)
    elif kind == EDGE:
        pass_edge(arena, i)
    else:
        slip_ends(arena, i)
    if kind in (BALL, KNOB) and tags[i, SUPPORT] >= 0:
        knocked(arena, i)
    if both and tags[partner, SUPPORT] >= 0:
        knocked(arena, partner)
    changed(arena, i)
    if both:
        changed(arena, partner)
        predict(arena, partner, t, late)
    predict(arena, i, t, late)


@kernel
def advance(arena: Arena, until: float) -> int:
    """Let all events up to a time happen; return why it stopped."""
    state, tags, times = arena.state, arena.tags, arena.next_time
    movers, counts, world = arena.movers, arena.counts, arena.world
    for _ in range(PAUSE):
        i = earliest(movers, times)
        if i < 0 or times[i] > until:
            return DONE
        if counts[RECORDING] != 0 and counts[ROWS] + ROOM > len(arena.log):
            return FULL
        t, late = times[i], state[i, NEXT_LATE]
        kind, partner = tags[i, NEXT_KIND], tags[i, NEXT_WHO]
        if kind == BALL and tags[i, NEXT_STAMP] != tags[partner, STAMP]:
            predict(arena, i, t, late)
            continue
        world[NOW], world[NOW_LATE] = t, late
        counts[WHO], counts[WHAT], counts[WITH] = i, kind, partner
        bound = within(counts, world, len(movers), t)
        if bound != DONE:
            return bound
        happen(arena, i, kind, partner, t, late)
    return PAUSED


@kernel
def evaluate(
    arena: Arena, t: float, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray
) -> None:
    """Write down where every ball is at a time; their rows stay as they are."""
    state = arena.state
    for i in range(len(state)):
        if state[i, LIGHTNESS] > 0.0:
            position[i, 0], position[i, 1], velocity[i, 0], velocity[i, 1] = place(state, i, t, 0.0)
            angle[i], spin[i] = turned(state, i, t, 0.0)
