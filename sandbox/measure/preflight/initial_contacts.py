"""Bodies in contact or overlap at the start of a scene."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.solver_settings import SLOP_PER_RADIUS
from sandbox.formatting import format_plural
from sandbox.measure.metrics.clearance import bounding_clearances, clearance, posed_pieces
from sandbox.measure.preflight.diagnostic import Details, Diagnostic
from sandbox.measure.preflight.tunnelling import collide_with_all
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.geometry.hulls import hull_distance
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.validate.bodies import OVERLAP_BUDGET

CONTACT_FRACTION = 0.02
"""Largest clearance of a contact as a fraction of the half width of the thinner body."""
MAX_PAIRS = 4000
"""Largest number of measured pairs, at about 0.1 ms each; the others are ignored."""


class InitialContacts(NamedTuple):
    """K pairs of bodies close together; at least one of each pair is not a ball."""

    first: IntArray
    """(K,)"""
    second: IntArray
    """(K,)"""
    clearance: FloatArray
    """(K,) m, negative for an overlap"""


def initial_contacts(scene: Scene) -> InitialContacts:
    """Return the pairs that can collide and are in contact or overlap (`CONTACT_FRACTION`).

    At least one of a pair can move, and at least one is not a ball.
    """
    bodies = scene.bodies
    colliding = np.flatnonzero(collide_with_all(bodies) & (bodies.core >= 0.0))
    found: list[tuple[int, int, float]] = []
    apart = {(a, b) for a, b in scene.joint_arrays.apart().tolist()}
    if len(colliding) < 2 or bodies.round[colliding].all():
        return InitialContacts(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
    examined, filters = 0, filter_table(scene, bodies)
    for i, j in near_pairs(bodies.position[colliding], 2.05 * float(bodies.radius[colliding].max())):
        a, b = np.minimum(colliding[i], colliding[j]), np.maximum(colliding[i], colliding[j])
        slack = CONTACT_FRACTION * np.minimum(bodies.thin[a], bodies.thin[b])
        away = np.hypot(*(bodies.position[a] - bodies.position[b]).T) - bodies.radius[a] - bodies.radius[b]
        able = filters.meets(a, b) & (away < slack)
        able &= ~(bodies.round[a] & bodies.round[b]) & ~(bodies.immovable[a] & bodies.immovable[b])
        for first, second, limit in zip(a[able].tolist(), b[able].tolist(), slack[able].tolist(), strict=True):
            examined += 1
            if examined > MAX_PAIRS:
                break
            if (first, second) not in apart and (gap := _pair_clearance(bodies, first, second)) <= limit:
                found.append((first, second, gap))
        if examined > MAX_PAIRS:
            break
    firsts, seconds, gaps = ([row[k] for row in found] for k in range(3))
    return InitialContacts(
        np.asarray(firsts, dtype=np.int64), np.asarray(seconds, dtype=np.int64), np.asarray(gaps, dtype=np.float64)
    )


def _pair_clearance(bodies: Bodies, first: int, second: int) -> float:
    """Return the clearance of two bodies at the start, m."""
    one, other = (
        list(posed_pieces(bodies, n, bodies.position[n][None], bodies.angle[n][None])) for n in (first, second)
    )
    return min(float(hull_distance(a, b)[0]) - r - s for a, r in one for b, s in other)


MIN_DESCENT = 0.7
"""Cosine of the largest slope of a support: a steeper contact is one beside the body, which does not carry it."""


def is_supported(scene: Scene, number: int, down: FloatArray) -> bool:
    """Return whether a body stands on another one or on a static object at the start.

    Args:
        scene: the scene.
        number: index of the body.
        down: unit vector of gravity, (2,).
    """
    bodies, filters = scene.bodies, filter_table(scene, scene.bodies)
    slack = CONTACT_FRACTION * float(bodies.thin[number])
    away = np.hypot(*(bodies.position - bodies.position[number]).T) - bodies.radius - float(bodies.radius[number])
    near = np.flatnonzero(collide_with_all(bodies) & (away <= slack))
    near = near[(near != number) & filters.meets(np.full(len(near), number), near)]
    bounds = bodies.position[number][None], bodies.radius[number][None]
    below = [-1 - k for k, thing in enumerate(scene.fixed) if bounding_clearances(thing, *bounds)[0] <= slack]
    below = [other for other in below if filters.meets_fixed(-1 - other)[number]]
    lowered = bodies.position.copy()
    lowered[number] += slack * down
    positions, angles = np.stack((bodies.position, lowered)), np.stack((bodies.angle, bodies.angle))
    for other in [*near.tolist(), *below]:
        gap, gap_below = clearance(scene, bodies, positions, angles, (number, other)).tolist()
        if gap <= slack and gap - gap_below >= MIN_DESCENT * slack:
            return True
    return False


GRAZE_FRACTION = 1e-6
"""Overlap by rounding of bodies that are placed in contact, as a fraction of a half width."""

Overlap = tuple[float, str, str]
"""Depth of an overlap, m, and the names of the two objects."""


def overlap_warnings(scene: Scene, matrix: ContactMatrix, close: InitialContacts) -> Iterator[Diagnostic]:
    """Yield a diagnostic for the overlaps of moving bodies at the start, and one for those with fixed ones.

    Each names the deepest. Pairs whose collisions a joint disables do not count. Of bodies in planes, walls, posts and
    fixed bodies, only overlaps deeper than the slop of the engines count.
    """
    pairs, deepest, kinds = 0, (0.0, "", ""), "balls"
    if matrix.mutual:
        balls, pair = _balls(scene, matrix)
        if balls > 0:
            pairs, deepest = balls, pair
        bodies = scene.bodies
        deep = close.clearance < -GRAZE_FRACTION * np.minimum(bodies.thin[close.first], bodies.thin[close.second])
        deep &= ~bodies.fixed[close.first] & ~bodies.fixed[close.second]
        if bodies.one_way:  # a body in one may pass it
            deep &= ~np.isin(close.first, [*bodies.one_way]) & ~np.isin(close.second, [*bodies.one_way])
        if deep.any():
            k = int(np.argmin(np.where(deep, close.clearance, 0.0)))
            names = bodies.names[int(close.first[k])], bodies.names[int(close.second[k])]
            pairs, kinds = pairs + int(deep.sum()), "bodies"
            deepest = max(deepest, (-float(close.clearance[k]), *names))
    if pairs > 0:
        depth, first, second = deepest
        count = "overlapping pair" if pairs == 1 else "overlapping pairs"
        message = (
            f"{pairs:,} {count} of {kinds} at the start, {first!r} and {second!r} by {depth:.3g} m; "
            "the engine will push them apart"
        )
        yield Diagnostic("overlap", message, {"pairs": pairs, "depth": depth, "first": first, "second": second})
    inside = [*_overlaps_with_static(scene), *_overlaps_with_fixed_bodies(scene, close)]
    if inside:
        depth, first, second = max(inside)
        others = f", and {format_plural(len(inside) - 1, 'other pair')} overlap" if len(inside) > 1 else ""
        message = (
            f"{first!r} starts inside the fixed {second!r}, {depth:.3g} m deep{others}; move it, because the engine "
            "will push it out, which adds energy"
        )
        details: Details = {"pairs": len(inside), "depth": depth, "first": first, "second": second}
        yield Diagnostic("overlap", message, details)


def _balls(scene: Scene, matrix: ContactMatrix) -> tuple[int, Overlap]:
    """Return the number of overlapping pairs of moving balls that can collide, and the deepest of them."""
    bodies, filters = scene.bodies, filter_table(scene, scene.bodies)
    balls = np.flatnonzero(collide_with_all(bodies) & matrix.touches & ~bodies.fixed & bodies.round)
    first, second = scene.joint_arrays.apart().T
    joined = np.minimum(first, second) * len(bodies) + np.maximum(first, second)
    count, deepest, examined = 0, (0.0, "", ""), 0
    for i, j in near_pairs(bodies.position[balls], 2.0 * float(bodies.radius[balls].max(initial=0.0))):
        low, high = np.minimum(balls[i], balls[j]), np.maximum(balls[i], balls[j])
        depth = bodies.radius[low] + bodies.radius[high] - np.hypot(*(bodies.position[low] - bodies.position[high]).T)
        apart = ~filters.meets(low, high) | (bodies.kinematic[low] & bodies.kinematic[high])
        depth[apart | np.isin(low * len(bodies) + high, joined)] = 0.0
        count += int(np.count_nonzero(depth > 0.0))
        k = int(depth.argmax()) if len(depth) else -1
        if k >= 0 and depth[k] > deepest[0]:
            deepest = float(depth[k]), bodies.names[int(low[k])], bodies.names[int(high[k])]
        examined += len(i)
        if examined > OVERLAP_BUDGET:
            break
    return count, deepest


def _find_static_overlaps(scene: Scene) -> Iterator[Overlap]:
    """Yield the bodies that start in a plane, wall or post, deeper than the slop of the engines.

    Scenes with a `[surface]`, one-way walls and driven bodies are left out: cushions are hit at a height, a body in a
    one-way wall may pass it, and a driven body keeps the position that its drive prescribes.
    """
    if scene.surface is not None:
        return
    bodies, filters = scene.bodies, filter_table(scene, scene.bodies)
    able = contact_matrix(scene).touches & ~bodies.fixed & (bodies.thin > 0.0) & ~is_driven(scene, bodies)
    examined = measured = 0
    for k, (thing, name) in enumerate(zip(scene.fixed, scene.fixed_names, strict=False)):
        if (not isinstance(thing, Plane) and not thing.solid) or (isinstance(thing, Wall) and thing.one_way):
            continue
        candidates = np.flatnonzero(able & filters.meets_fixed(k) & _near(bodies, thing))
        examined += len(candidates) * (len(thing.points) if isinstance(thing, Wall) else 1)
        if examined > OVERLAP_BUDGET:
            return
        depths = -bounding_clearances(thing, bodies.position[candidates], bodies.radius[candidates])
        for number, depth in zip(candidates[depths > 0.0].tolist(), depths[depths > 0.0].tolist(), strict=True):
            if not bodies.round[number]:
                measured += 1
                if measured > MAX_PAIRS:
                    return
                pose = bodies.position[None], bodies.angle[None]
                depth = -float(clearance(scene, bodies, *pose, (number, -1 - k))[0])
            if depth > SLOP_PER_RADIUS * float(bodies.thin[number]):
                yield depth, bodies.names[number], name


_overlaps_with_static = derived_once(lambda setup: tuple(_find_static_overlaps(setup.scene)))


def _overlaps_with_fixed_bodies(scene: Scene, close: InitialContacts) -> Iterator[Overlap]:
    """Yield the moving bodies that start in a fixed body, deeper than the slop of the engines."""
    bodies = scene.bodies
    for a, b, gap in zip(close.first.tolist(), close.second.tolist(), close.clearance.tolist(), strict=True):
        if bodies.fixed[a] != bodies.fixed[b] and not {a, b} & bodies.one_way.keys():
            mover, fixed = (b, a) if bodies.fixed[a] else (a, b)
            if -gap > SLOP_PER_RADIUS * float(bodies.thin[mover]):
                yield -gap, bodies.names[mover], bodies.names[fixed]


def _near(bodies: Bodies, thing: Plane | Wall | Post) -> BoolArray:
    """Return which bounding discs overlap the box about a wall or post, (N,); for a plane, all."""
    if isinstance(thing, Plane):
        return np.ones(len(bodies), dtype=np.bool_)
    corners = np.asarray(thing.points if isinstance(thing, Wall) else [thing.position])
    half = thing.thickness / 2.0 if isinstance(thing, Wall) else thing.radius
    low, high = corners.min(axis=0) - half, corners.max(axis=0) + half
    away = np.maximum(low - bodies.position, 0.0) + np.maximum(bodies.position - high, 0.0)
    return np.asarray(np.hypot(*away.T) < bodies.radius)
