"""Prediction: the next event of a ball, from closed-form motion.

The earliest over all lines, vertices and balls is found by computing each time of impact; a ball costs O(F + K + N).
Each later candidate is bounded by the best time so far.
"""

import math

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import ALL
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.common.kernel import inline_kernel
from sandbox.engines.exact.common import state as c
from sandbox.engines.exact.common.roots import NOISE, curved_entry, line_entry, pair_entry
from sandbox.engines.exact.common.state import EventState
from sandbox.engines.exact.impact import position_at


@kernel
def nearest_vertex(
    vertices: FloatArray,
    state: FloatArray,
    i: int,
    now: float,
    residual: float,
    best: float,
    just_hit: int,
    end_a: int,
    end_b: int,
) -> tuple[int, float]:
    """Return the vertex that a ball hits first and the time until then, s, if less than `best`; else −1.

    Args:
        vertices: all vertices.
        state: of all balls.
        i: ball.
        now: s.
        residual: s, part of the time that rounding has cut off `now`.
        best: s.
        just_hit: vertex of the collision that the ball has just had, or −1.
        end_a: vertex at an end of the supporting line, to which the path of the ball is tangent; or −1.
        end_b: likewise.
    """
    x, y, vx, vy = position_at(state, i, now, residual)
    ax, ay, radius = state[i, c.AX], state[i, c.AY], state[i, c.RADIUS]
    straight, speed, partner = ax == 0.0 and ay == 0.0, abs(vx) + abs(vy), -1
    for k in range(len(vertices)):
        if k in (end_a, end_b) or (straight and k == just_hit) or vertices[k, c.SOLID] == 0.0:
            continue
        dx, dy, radius_sum = (
            vertices[k, c.CENTRE_X] - x,
            vertices[k, c.CENTRE_Y] - y,
            vertices[k, c.CIRCLE_RADIUS] + radius,
        )
        if straight:
            tau = pair_entry(dx, dy, -vx, -vy, radius_sum, speed)
        else:
            tau = curved_entry(dx, dy, -vx, -vy, -ax, -ay, radius_sum, k == just_hit, best)
        if tau < best:
            best, partner = tau, k
    return partner, best


@kernel
def nearest_ball(
    state: FloatArray, tags: IntArray, targets: IntArray, i: int, now: float, residual: float, best: float
) -> tuple[int, float]:
    """Return the ball that a ball hits first and the time until then, s, if less than `best`; else −1."""
    x, y, vx, vy = position_at(state, i, now, residual)
    ax, ay, radius = state[i, c.AX], state[i, c.AY], state[i, c.RADIUS]
    hits_all = tags[i, c.COLLISION_MASK] == ALL
    just_hit = state[i, c.LAST_TIME] == now and tags[i, c.LAST_KIND] == c.BALL
    last, partner, speed = tags[i, c.LAST_PARTNER], -1, abs(vx) + abs(vy)
    for k in range(len(targets)):
        j = targets[k]
        if j == i or not (hits_all or state[j, c.INVERSE_MASS] == 0.0):
            continue
        tau = (now - state[j, c.T]) + (residual - state[j, c.TIME_RESIDUAL])
        bx, by, radius_sum = state[j, c.AX] - ax, state[j, c.AY] - ay, radius + state[j, c.RADIUS]
        straight = bx == 0.0 and by == 0.0
        wx, wy = state[j, c.VX] + state[j, c.AX] * tau, state[j, c.VY] + state[j, c.AY] * tau
        ux, uy = wx - vx, wy - vy
        dx = state[j, c.X] + 0.5 * (state[j, c.VX] + wx) * tau - x
        dy = state[j, c.Y] + 0.5 * (state[j, c.VY] + wy) * tau - y
        # Most balls recede, or cannot arrive before `best`. The tests are combined with |, because separate branches
        # would be mispredicted. The slack exceeds rounding.
        horizon = best * 1.000001
        cannot_hit = (
            (dx * ux + dy * uy >= 0.0)
            | (abs(dx) > radius_sum + abs(ux) * horizon)
            | (abs(dy) > radius_sum + abs(uy) * horizon)
        )
        if straight & cannot_hit:
            continue
        has_just_hit = just_hit and last == j
        if has_just_hit and state[j, c.INVERSE_MASS] > 0.0:
            has_just_hit = (
                state[j, c.LAST_TIME] == now and tags[j, c.LAST_KIND] == c.BALL and tags[j, c.LAST_PARTNER] == i
            )
        if not straight:
            tau_hit = curved_entry(dx, dy, ux, uy, bx, by, radius_sum, has_just_hit, best)
        elif has_just_hit:
            continue
        else:
            tau_hit = pair_entry(dx, dy, ux, uy, radius_sum, speed + abs(wx) + abs(wy))
        if tau_hit < best:
            best, partner = tau_hit, j
    return partner, best


PARALLEL_ANGLE = 1e-5
"""rad: lines whose normals differ by less are continuous: a ball rolls from one on to the other. A collision at so flat
a joint would change its velocity by 1e-5 of it, and rounding would decide whether it is found."""


@kernel
def are_parallel(lines: FloatArray, f: int, g: int) -> bool:
    """Return whether two lines have the same normal, within `PARALLEL_ANGLE`."""
    cross = lines[f, c.NX] * lines[g, c.NY] - lines[f, c.NY] * lines[g, c.NX]
    dot = lines[f, c.NX] * lines[g, c.NX] + lines[f, c.NY] * lines[g, c.NY]
    return bool(dot > 0.0 and abs(cross) <= PARALLEL_ANGLE)


@kernel
def line_time(
    lines: FloatArray,
    f: int,
    x: float,
    y: float,
    vx: float,
    vy: float,
    ax: float,
    ay: float,
    radius: float,
    has_just_hit: bool,
) -> float:
    """Return the time until a ball hits a line, s, or infinity.

    Args:
        lines: all lines.
        f: index of the line.
        x: position of the ball, m.
        y: likewise.
        vx: its velocity, m/s.
        vy: likewise.
        ax: its acceleration, m/s².
        ay: likewise.
        radius: m.
        has_just_hit: whether they have just collided; a speed of approach is rounding error then.
    """
    nx, ny, length = lines[f, c.NX], lines[f, c.NY], lines[f, c.LENGTH]
    b, a = vx * nx + vy * ny, ax * nx + ay * ny
    if abs(b) <= NOISE * (abs(vx) + abs(vy)) or (has_just_hit and b < 0.0):
        b = 0.0
    if abs(a) <= NOISE * (abs(ax) + abs(ay)):
        a = 0.0
    if b >= 0.0 and a >= 0.0:
        return math.inf
    rx, ry = x - lines[f, c.PX], y - lines[f, c.PY]
    gap = rx * nx + ry * ny - radius
    if length == math.inf:
        return line_entry(max(gap, 0.0), b, a)
    foot = rx * lines[f, c.UX] + ry * lines[f, c.UY]
    if 0.0 <= foot <= length and gap + radius + lines[f, c.HALF_THICKNESS] > 0.0:
        gap = max(gap, 0.0)  # in contact: an overlap is rounding, or tolerated at the start
    tau = line_entry(gap, b, a)
    if tau < math.inf:
        along = foot + ((vx + 0.5 * ax * tau) * lines[f, c.UX] + (vy + 0.5 * ay * tau) * lines[f, c.UY]) * tau
        if along < 0.0 or along > length:
            return math.inf
    return tau


@kernel
def line_end_time(lines: FloatArray, f: int, x: float, y: float, vx: float, vy: float, ax: float, ay: float) -> float:
    """Return the time until a supported ball reaches an end of its line, s, or infinity."""
    length, ux, uy = lines[f, c.LENGTH], lines[f, c.UX], lines[f, c.UY]
    if length == math.inf:
        return math.inf
    foot = min(max((x - lines[f, c.PX]) * ux + (y - lines[f, c.PY]) * uy, 0.0), length)
    v, a = vx * ux + vy * uy, ax * ux + ay * uy
    return min(line_entry(foot, v, a), line_entry(length - foot, -v, -a))


@inline_kernel
def predict_next_event(data: EventState, i: int, now: float, residual: float) -> None:
    """Predict and store the earliest event of a ball after `now`."""
    data.counts[c.PREDICTIONS] += 1
    data.counts[c.PAIR_TESTS] += len(data.lines) + len(data.vertices) + len(data.targets)
    find_next_event(
        data.state,
        data.tags,
        data.next_time,
        data.lines,
        data.line_tags,
        data.vertices,
        data.targets,
        i,
        now,
        residual,
    )


@inline_kernel
def find_next_event(
    state: FloatArray,
    tags: IntArray,
    next_time: FloatArray,
    lines: FloatArray,
    line_tags: IntArray,
    vertices: FloatArray,
    targets: IntArray,
    i: int,
    now: float,
    residual: float,
) -> None:
    """Do so, with few arrays as arguments instead of `EventState`, which saves reference counting.

    Of simultaneous events the first in this order counts: end of slip, end of the line, lines, vertices, balls, each by
    ascending index.
    """
    x, y, vx, vy = position_at(state, i, now, residual)
    ax, ay, radius = state[i, c.AX], state[i, c.AY], state[i, c.RADIUS]
    best, kind, partner = math.inf, c.NONE, -1
    just_hit = state[i, c.LAST_TIME] == now
    last_kind, last_partner = tags[i, c.LAST_KIND], tags[i, c.LAST_PARTNER]
    support, second_support = tags[i, c.SUPPORT], tags[i, c.SUPPORT + 1]
    if state[i, c.SLIP_END_TIME] < math.inf:
        best, kind = max((state[i, c.SLIP_END_TIME] - now) - residual, 0.0), c.SLIP_END
    if support >= 0 and second_support < 0:
        tau = line_end_time(lines, support, x, y, vx, vy, ax, ay)
        if tau < best:
            best, kind, partner = tau, c.LINE_END, support

    for f in range(len(lines)):
        if support >= 0 and (f in (support, second_support) or are_parallel(lines, f, support)):
            continue
        if vx * lines[f, c.NX] + vy * lines[f, c.NY] >= 0.0 and ax * lines[f, c.NX] + ay * lines[f, c.NY] >= 0.0:
            continue
        if just_hit and last_kind == c.LINE_END and last_partner == f:
            continue  # it has just left this line over its end
        has_just_hit = just_hit and last_kind == c.LINE and last_partner == f
        tau = line_time(lines, f, x, y, vx, vy, ax, ay, radius, has_just_hit)
        if tau < best:
            best, kind, partner = tau, c.LINE, f

    hit_vertex, end_a, end_b = -1, -1, -1
    if just_hit and last_kind == c.VERTEX:
        hit_vertex = last_partner
    if support >= 0:
        end_a, end_b = line_tags[support, c.ENDS], line_tags[support, c.ENDS + 1]
    k, tau = -1, math.inf
    if len(vertices) > 0:
        k, tau = nearest_vertex(vertices, state, i, now, residual, best, hit_vertex, end_a, end_b)
    if k >= 0:
        best, kind, partner = tau, c.VERTEX, k
    j, tau = nearest_ball(state, tags, targets, i, now, residual, best)
    if j >= 0:
        best, kind, partner = tau, c.BALL, j
        tags[i, c.PARTNER_VERSION] = tags[j, c.VERSION]
    # Two-sum (Knuth): times grow, and their rounding error would dominate the error of a long run.
    after = best + residual
    time = now + after
    virtual = time - now
    state[i, c.NEXT_RESIDUAL] = 0.0
    if time < math.inf:
        state[i, c.NEXT_RESIDUAL] = (now - (time - virtual)) + (after - virtual)
    next_time[i] = time
    tags[i, c.NEXT_KIND], tags[i, c.NEXT_PARTNER] = kind, partner
