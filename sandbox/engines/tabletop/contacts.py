"""Contacts of a step on a surface: time of impact, cushions as arrays, and collision response in order.

Pairs in contact at the end of a substep are taken back to their time of impact, resolved there by the models of
`collisions`, and advanced again for the rest of the substep: so directions and paths do not depend on the substep,
though balls overlap by up to v·h when they are found. Collisions are resolved one by one, the earliest first. A ball
that a collision drives into another ball or a cushion is found here, by a test against all others.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import ALL
from sandbox.engines.common.colliders import StaticColliders
from sandbox.engines.common.geometry import nearest_fraction
from sandbox.engines.common.kernel import bare_kernel as kernel
from sandbox.engines.tabletop.collisions import ELASTIC, STILL, Five, collide_balls, collide_cushion, collide_pucks
from sandbox.engines.tabletop.motion import TabletopBalls, advance_ball, motion_of, set_motion, state_at
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Post, Wall


class Cushions(NamedTuple):
    """C cushions: P planes, then the G segments of walls and posts.

    Each edge of a wall is a cushion of its own, so that a ball in a corner of the wall collides with both.
    """

    planes: FloatArray
    """(P, 4) a point of the surface, m, and the unit normal pointing out of the solid"""
    segments: FloatArray
    """(G, 5) both ends and half the thickness, m; a post is a segment of length 0"""
    joints: FloatArray
    """(G, 4) m, as in `StaticColliders.joints`"""
    collider: IntArray
    """(C,) index of the plane, wall or post, in ascending order"""
    height: FloatArray
    """(C,) m, of the nose above the surface; 0 means the height of the ball's centre"""
    surface: IntArray
    """(C,)"""


def cushions_of(scene: Scene, static: StaticColliders, surface: IntArray) -> Cushions:
    """Return the cushions of a scene; `surface` (F,) are the surfaces of its static colliders."""
    collider = np.concatenate((static.plane_collider, static.segment_collider))
    height = [collider.height or 0.0 if isinstance(collider, Wall | Post) else 0.0 for collider in scene.fixed]
    return Cushions(
        static.planes,
        static.segments,
        static.joints,
        collider,
        np.asarray(height, dtype=np.float64)[collider],
        surface[collider],
    )


@kernel
def distance_to_cushion(
    cushions: Cushions, k: int, x: float, y: float, vx: float, vy: float
) -> tuple[float, float, float]:
    """Return the distance of a point from the surface of a cushion, m, and the unit normal into the cushion.

    Args:
        cushions: all cushions.
        k: index of the cushion.
        x: of the point, m.
        y: likewise.
        vx: its velocity, whose direction is the normal if the point is exactly on the middle of a wall.
        vy: likewise.
    """
    if k < len(cushions.planes):
        plane = cushions.planes[k]
        return (x - plane[0]) * plane[2] + (y - plane[1]) * plane[3], -plane[2], -plane[3]
    ax, ay, bx, by, half = cushions.segments[k - len(cushions.planes)]
    fraction = nearest_fraction(ax, ay, bx, by, x, y)
    dx, dy = ax + fraction * (bx - ax) - x, ay + fraction * (by - ay) - y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance > 0.0:
        return distance - half, dx / distance, dy / distance
    speed = math.sqrt(vx * vx + vy * vy)
    nx, ny = (vx / speed, vy / speed) if speed > 0.0 else (1.0, 0.0)
    return -half, nx, ny


@kernel
def is_nearer_to_neighbour(cushions: Cushions, k: int, x: float, y: float) -> bool:
    """Return whether a point is nearer to the next edge of the wall than to cushion k.

    An end that two edges share acts only where both are nearest there; otherwise a ball that slides along a slightly
    bent wall would bounce off the ends of its edges.
    """
    s = k - len(cushions.planes)
    if s < 0:
        return False
    ax, ay, bx, by, _ = cushions.segments[s]
    to_before_x, to_before_y, to_after_x, to_after_y = cushions.joints[s]
    fraction = nearest_fraction(ax, ay, bx, by, x, y)
    if fraction <= 0.0:
        return bool((x - ax) * to_before_x + (y - ay) * to_before_y > 0.0)
    if fraction >= 1.0:
        return bool((x - bx) * to_after_x + (y - by) * to_after_y > 0.0)
    return False


DUE, IMPULSE_X, IMPULSE_Y, NORMAL_X, NORMAL_Y, POINT_X, POINT_Y, GAP, WIDTH = range(9)
"""Columns of a contact: time before the end of the substep at which its next collision is due, s, below 0 for none; the
impulse of the first on the second, N·s; the normal from the first to the second; the contact point, m; the gap, m."""

RESTING_SPEED = 1e-9
"""m/s: a pair that approaches more slowly is resting"""

SKIN = 0.05
"""Fraction of its radius by which a disc is larger in pymunk. Balls that graze each other between two steps are then
found near each other, if their relative displacement in a substep is below 1.28 radii."""

MAX_ITERATIONS = 60
"""Limit of iterations for the time of impact, which is found to rounding in about eight."""

NEAREST_TOLERANCE = 1e-6
"""Fraction of the time to which the time of the smallest distance is found: the gap hardly changes there."""

ROUNDING_TOLERANCE = 1e-15
"""Fraction of a radius, and of a time, that is negligible."""


@kernel
def approach(
    balls: TabletopBalls, cushions: Cushions, i: int, other: int, time_before_end: float
) -> tuple[float, float, float, float]:
    """Return a pair's gap at a time, m, the normal from the first to the second, and the closing speed, m/s."""
    x, y, _, motion = state_at(balls, i, time_before_end)
    if other < 0:
        gap, nx, ny = distance_to_cushion(cushions, -1 - other, x, y, motion[0], motion[1])
        return gap - balls.radius[i], nx, ny, motion[0] * nx + motion[1] * ny
    px, py, _, other_motion = state_at(balls, other, time_before_end)
    dx, dy = px - x, py - y
    ux, uy = motion[0] - other_motion[0], motion[1] - other_motion[1]
    distance = math.sqrt(dx * dx + dy * dy)
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    else:  # centres coincide: along the relative velocity, or along x
        speed = math.sqrt(ux * ux + uy * uy)
        nx, ny = (ux / speed, uy / speed) if speed > 0.0 else (1.0, 0.0)
    return distance - balls.radius[i] - balls.radius[other], nx, ny, ux * nx + uy * ny


@kernel
def can_touch(balls: TabletopBalls, cushions: Cushions, i: int, other: int, time_before_end: float) -> bool:
    """Return whether a pair can collide at a time: a ball does not where the wall's next edge is nearer."""
    if other >= 0:
        return True
    x, y, _, _ = state_at(balls, i, time_before_end)
    return not is_nearer_to_neighbour(cushions, -1 - other, x, y)


@kernel
def time_of_nearest(balls: TabletopBalls, cushions: Cushions, i: int, other: int, max_time: float) -> float:
    """Return the time before the end at which a separating pair was nearest, s; 0 if it separated all the time."""
    if approach(balls, cushions, i, other, max_time)[3] <= 0.0:
        return 0.0
    low, high = 0.0, max_time
    for _ in range(MAX_ITERATIONS):
        middle = 0.5 * (low + high)
        if approach(balls, cushions, i, other, middle)[3] > 0.0:
            high = middle
        else:
            low = middle
        if high - low <= NEAREST_TOLERANCE * max_time:
            break
    return low


@kernel
def time_of_impact(balls: TabletopBalls, cushions: Cushions, i: int, other: int) -> float:
    """Return the time before the end at which a pair that overlaps, or has overlapped, collided, s; below 0 if none."""
    latest, (end_gap, _, _, closing) = 0.0, approach(balls, cushions, i, other, 0.0)
    max_time = balls.age[i] if other < 0 or not balls.in_play[other] else min(balls.age[i], balls.age[other])
    if not end_gap < 0.0:
        latest = time_of_nearest(balls, cushions, i, other, max_time) if closing < 0.0 else 0.0
        end_gap = approach(balls, cushions, i, other, latest)[0]
        if not end_gap < 0.0:
            return -1.0
    start_gap, _, _, earlier_closing = approach(balls, cushions, i, other, max_time)
    if start_gap <= 0.0:  # in contact all the time
        if earlier_closing > RESTING_SPEED and start_gap > end_gap:
            return max_time if can_touch(balls, cushions, i, other, max_time) else -1.0
        return 0.0 if closing > RESTING_SPEED and can_touch(balls, cushions, i, other, 0.0) else -1.0
    # Between a time of overlap and one before it: false position, by the Illinois rule.
    low, high, low_gap, high_gap, last_side = latest, max_time, end_gap, start_gap, 0
    for _ in range(MAX_ITERATIONS):
        middle = (low * high_gap - high * low_gap) / (high_gap - low_gap)
        gap, _, _, earlier_closing = approach(balls, cushions, i, other, middle)
        if abs(gap) <= ROUNDING_TOLERANCE * balls.radius[i] or high - low <= ROUNDING_TOLERANCE * max_time:
            break
        if gap < 0.0:
            low, low_gap = middle, gap
            high_gap = 0.5 * high_gap if last_side < 0 else high_gap
            last_side = -1
        else:
            high, high_gap = middle, gap
            low_gap = 0.5 * low_gap if last_side > 0 else low_gap
            last_side = 1
    return middle if earlier_closing > RESTING_SPEED and can_touch(balls, cushions, i, other, middle) else -1.0


@kernel
def separate(balls: TabletopBalls, cushions: Cushions, i: int, other: int, depth: float) -> None:
    """Move two bodies apart by a depth, m, in proportion to their inverse masses."""
    _, nx, ny, _ = approach(balls, cushions, i, other, 0.0)
    own_inverse_mass, other_inverse_mass = balls.inverse_mass[i], 0.0 if other < 0 else balls.inverse_mass[other]
    own_depth = depth * own_inverse_mass / (own_inverse_mass + other_inverse_mass)
    balls.position[i, 0] -= own_depth * nx
    balls.position[i, 1] -= own_depth * ny
    balls.moved[i] = True
    if other_inverse_mass > 0.0:
        balls.position[other, 0] += (depth - own_depth) * nx
        balls.position[other, 1] += (depth - own_depth) * ny
        balls.moved[other] = True


@kernel
def is_listed(pairs: IntArray, count: int, i: int, other: int) -> bool:
    """Return whether a pair is among the first `count` pairs, in either order."""
    for k in range(count):
        a, b = pairs[k, 0], pairs[k, 1]
        if (a == i and b == other) or (a == other and b == i):
            return True
    return False


@kernel
def append_new_pairs(
    balls: TabletopBalls, cushions: Cushions, i: int, pairs: IntArray, rows: FloatArray, count: int
) -> int:
    """Append the pairs that a ball now overlaps and that are not listed yet; return the number of pairs."""
    x, y = balls.position[i, 0], balls.position[i, 1]
    for k in range(-len(cushions.collider), len(balls.in_play)):
        if count == len(pairs):
            return count
        if k < 0:
            is_near = approach(balls, cushions, i, k, 0.0)[0] < SKIN * balls.radius[i]
        else:
            can_collide = (
                k != i
                and balls.collision_mask[k] == ALL
                and (balls.collision_mask[i] == ALL or balls.inverse_mass[k] == 0.0)
            )
            dx, dy = balls.position[k, 0] - x, balls.position[k, 1] - y
            contact_distance = (1.0 + SKIN) * (balls.radius[i] + balls.radius[k])
            is_near = can_collide and dx * dx + dy * dy < contact_distance * contact_distance
        if is_near and not is_listed(pairs, count, i, k):
            pairs[count, 0], pairs[count, 1] = i, k
            rows[count, DUE] = -1.0
            write_geometry(balls, cushions, i, k, rows[count])
            count += 1
    return count


@kernel
def write_geometry(balls: TabletopBalls, cushions: Cushions, i: int, other: int, row: FloatArray) -> None:
    """Write the geometry of a contact to its row, with no impulse yet."""
    gap, nx, ny, _ = approach(balls, cushions, i, other, 0.0)
    contact_distance = balls.radius[i] + 0.5 * gap
    row[IMPULSE_X] = row[IMPULSE_Y] = 0.0
    row[NORMAL_X], row[NORMAL_Y] = nx, ny
    row[GAP] = gap if can_touch(balls, cushions, i, other, 0.0) else math.inf
    row[POINT_X], row[POINT_Y] = (
        balls.position[i, 0] + contact_distance * nx,
        balls.position[i, 1] + contact_distance * ny,
    )


MIN_BOUNCE_SPEED = 1e-3
"""m/s: slower collisions do not bounce, so that balls pressed together come to rest"""

MAX_HITS_PER_CONTACT = 20
"""Largest number of collisions for each contact in one substep; further collisions happen in the next one."""


class HitParameters(NamedTuple):
    """Parameters of collisions."""

    ball_ball: int
    cushion: int
    restitution: FloatArray
    """(S, S) by surface"""
    friction: FloatArray
    """(S, S) by surface"""
    grip: float
    """friction of ball and surface"""
    slop: float
    """m of overlap that is not corrected"""
    correction: float
    """fraction of the overlap beyond it that is corrected in a substep"""


@kernel
def kinetic_energy(motion: Five, inverse_mass: float, radius: float, inertia: float) -> float:
    """Return the energy of a ball, J, with a moment of inertia in units of m·r²; 0 for a fixed body."""
    vx, vy, wx, wy, wz = motion
    squared = vx * vx + vy * vy + inertia * radius * radius * (wx * wx + wy * wy + wz * wz)
    return 0.5 * squared / inverse_mass if inverse_mass > 0.0 else 0.0


@kernel
def restore_state(balls: TabletopBalls, i: int, time_before_end: float) -> Five:
    """Set a ball to its state at a time before the end of the substep, s; return its velocity and spin."""
    balls.position[i, 0], balls.position[i, 1], balls.angle[i], motion = state_at(balls, i, time_before_end)
    set_motion(balls, i, motion)
    balls.moved[i] = True
    return motion


@kernel
def resolve_hit(
    balls: TabletopBalls,
    cushions: Cushions,
    parameters: HitParameters,
    i: int,
    other: int,
    time_before_end: float,
    row: FloatArray,
    work: FloatArray,
) -> None:
    """Resolve the collision of a pair at its time of impact, and record it.

    Args:
        balls: all.
        cushions: all.
        parameters: of collisions.
        i: index of a ball.
        other: index of another ball, or of a cushion, −1 − k.
        time_before_end: of the impact, before the end of the substep, s.
        row: (WIDTH,) of the contact; written to.
        work: (3,) J, energy changes of collisions by normal impulses, by friction impulses, and of friction with the
            surface on the path that the collision replaces; added to.
    """
    _, nx, ny, closing = approach(balls, cushions, i, other, time_before_end)
    radius, inverse_mass, floor = balls.radius[i], balls.inverse_mass[i], balls.floor
    inertia = floor.inertia
    energy_without_hit = kinetic_energy(motion_of(balls, i), inverse_mass, radius, inertia)
    motion = restore_state(balls, i, time_before_end)
    energy_before = kinetic_energy(motion, inverse_mass, radius, inertia)
    if other < 0:
        k = -1 - other
        height = cushions.height[k] if cushions.height[k] > 0.0 else radius
        restitution = (
            parameters.restitution[balls.surface[i], cushions.surface[k]] if closing > MIN_BOUNCE_SPEED else 0.0
        )
        friction = parameters.friction[balls.surface[i], cushions.surface[k]]
        if floor.pucks:
            inverse_masses_and_radii = (inverse_mass, 0.0), (radius, 0.0)
            after, _ = collide_pucks(restitution, 0.0, motion, STILL, *inverse_masses_and_radii, nx, ny)
            energy_frictionless = kinetic_energy(after, inverse_mass, radius, inertia)
            after, _ = collide_pucks(restitution, friction, motion, STILL, *inverse_masses_and_radii, nx, ny)
        else:
            after = collide_cushion(parameters.cushion, restitution, 0.0, 0.0, motion, radius, height, nx, ny)
            energy_frictionless = kinetic_energy(after, inverse_mass, radius, inertia)
            after = collide_cushion(
                parameters.cushion, restitution, friction, parameters.grip, motion, radius, height, nx, ny
            )
        energy_after = kinetic_energy(after, inverse_mass, radius, inertia)
        other_energy_end = 0.0
    else:
        other_without_hit = motion_of(balls, other)
        other_motion = restore_state(balls, other, time_before_end) if balls.in_play[other] else other_without_hit
        other_inverse_mass, other_radius = balls.inverse_mass[other], balls.radius[other]
        energy_without_hit += kinetic_energy(other_without_hit, other_inverse_mass, other_radius, inertia)
        energy_before += kinetic_energy(other_motion, other_inverse_mass, other_radius, inertia)
        restitution = (
            parameters.restitution[balls.surface[i], balls.surface[other]] if closing > MIN_BOUNCE_SPEED else 0.0
        )
        inverse_masses, radii = (inverse_mass, other_inverse_mass), (radius, other_radius)
        friction = parameters.friction[balls.surface[i], balls.surface[other]]
        if floor.pucks:
            after, other_after = collide_pucks(restitution, 0.0, motion, other_motion, inverse_masses, radii, nx, ny)
        else:
            after, other_after = collide_balls(
                ELASTIC, restitution, motion, other_motion, inverse_masses, radius, nx, ny
            )
        energy_frictionless = kinetic_energy(after, inverse_mass, radius, inertia) + kinetic_energy(
            other_after, other_inverse_mass, other_radius, inertia
        )
        if floor.pucks:
            after, other_after = collide_pucks(
                restitution, friction, motion, other_motion, inverse_masses, radii, nx, ny
            )
        else:
            after, other_after = collide_balls(
                parameters.ball_ball, restitution, motion, other_motion, inverse_masses, radius, nx, ny
            )
        energy_after = kinetic_energy(after, inverse_mass, radius, inertia) + kinetic_energy(
            other_after, other_inverse_mass, other_radius, inertia
        )
        if balls.in_play[other]:
            set_motion(balls, other, other_after)
            advance_ball(balls, other, time_before_end)
            other_after = motion_of(balls, other)
        other_energy_end = kinetic_energy(other_after, other_inverse_mass, other_radius, inertia)
    if row[IMPULSE_X] == 0.0 and row[IMPULSE_Y] == 0.0:
        row[NORMAL_X], row[NORMAL_Y] = nx, ny
        row[POINT_X], row[POINT_Y] = balls.position[i, 0] + radius * nx, balls.position[i, 1] + radius * ny
    row[IMPULSE_X] += (motion[0] - after[0]) / inverse_mass
    row[IMPULSE_Y] += (motion[1] - after[1]) / inverse_mass
    work[0] += energy_frictionless - energy_before
    work[1] += energy_after - energy_frictionless
    set_motion(balls, i, after)
    advance_ball(balls, i, time_before_end)
    work[2] += (
        energy_before
        - energy_without_hit
        + other_energy_end
        + kinetic_energy(motion_of(balls, i), inverse_mass, radius, inertia)
        - energy_after
    )


@kernel
def resolve(
    balls: TabletopBalls,
    cushions: Cushions,
    parameters: HitParameters,
    pairs: IntArray,
    rows: FloatArray,
    work: FloatArray,
    count: int,
    max_tests: int,
) -> int:
    """Resolve all collisions of the substep that has just ended; return the number of pairs.

    After each collision all pairs and all balls are tested.

    Args:
        balls: all.
        cushions: all.
        parameters: of collisions.
        pairs: (M, 2) distinct pairs, first those in contact: a ball in play, and another ball or a cushion −1 − k.
            The rest is room for pairs that collisions bring into contact.
        rows: (M, WIDTH) row of each pair; written to.
        work: (3,) as of `resolve_hit`.
        count: number of pairs in contact.
        max_tests: limit of the tests of pairs and balls; −1 is returned if there would be more.
    """
    hits, tests = 0, 0
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        write_geometry(balls, cushions, i, other, rows[k])
        rows[k, DUE] = time_of_impact(balls, cushions, i, other)
    while hits < MAX_HITS_PER_CONTACT * count:
        first, time_before_end = -1, -1.0
        for k in range(count):
            if rows[k, DUE] > time_before_end:
                first, time_before_end = k, rows[k, DUE]
        if first < 0 or time_before_end < 0.0:
            break
        i, other = pairs[first, 0], pairs[first, 1]
        resolve_hit(balls, cushions, parameters, i, other, time_before_end, rows[first], work)
        hits += 1
        tests += 2 * (count + len(balls.in_play))
        if tests > max_tests:
            return -1
        count = append_new_pairs(balls, cushions, i, pairs, rows, count)
        if other >= 0 and balls.in_play[other]:
            count = append_new_pairs(balls, cushions, other, pairs, rows, count)
        for k in range(count):
            a, b = pairs[k, 0], pairs[k, 1]
            if a == i or b == i or (other >= 0 and (a == other or b == other)):
                rows[k, DUE] = time_of_impact(balls, cushions, a, b)
    for k in range(count):
        i, other = pairs[k, 0], pairs[k, 1]
        depth = -approach(balls, cushions, i, other, 0.0)[0] if can_touch(balls, cushions, i, other, 0.0) else 0.0
        was_hit = rows[k, IMPULSE_X] != 0.0 or rows[k, IMPULSE_Y] != 0.0
        if was_hit and 0.0 < depth <= parameters.slop:
            separate(balls, cushions, i, other, depth)
        elif depth > parameters.slop:
            separate(balls, cushions, i, other, parameters.correction * (depth - parameters.slop))
    return count
