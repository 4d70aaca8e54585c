"""Requirements of the exact engine: demands, settings, number of pairs, and no overlap at the start.

This module imports no kernels, because every validation of a scene for this engine uses it.
"""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.colliders import StaticColliders, static_colliders
from sandbox.engines.common.solver_settings import setting_faults
from sandbox.engines.tabletop.requirements import pockets_at, unsupported_on_surface
from sandbox.resource_limits import MEMORY, PAIRS
from sandbox.scene.compile.demands import BALLS, FLOOR, SURFACES, Demand, demands, on_floor, unmodelled
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.geometry.vectors import nearest_fractions

REASONS = {
    Demand.DRAG: "with drag the time of an impact is the root of no polynomial",
    Demand.LIFT: "with lift the time of an impact is the root of no polynomial",
    Demand.DAMPING: "with damping the time of an impact is the root of no polynomial",
    Demand.ZONES: "a change of gravity or layer within a flight is no event of this engine",
    Demand.ONE_WAY: "whether a wall stops a ball depends on its path before, which an event does not keep",
}
"""Why it does not model a demand that other engines of balls model"""

CAPABILITIES = BALLS - {Demand.DRAG} | FLOOR | SURFACES - {Demand.ONE_WAY, Demand.SURFACE_VELOCITY}
"""Demands that the engine models"""

STEPS = ("integrator", "detection", "response", "impact", "broad_phase", "joints", "stretch", "half_kick")
"""Settings of solvers with time steps"""

OVERLAP = ("slop", "bias", "persistence", "stiffness", "damping")
"""Settings of solvers that detect overlaps and correct them, or let penalty springs do so"""

ABSENT = {
    **dict.fromkeys(STEPS, "it uses no time steps; remove it"),
    **dict.fromkeys(OVERLAP, "it allows no overlap; remove it"),
}
"""Settings that the engine does not have, with the reason"""

TOUCH_OVERLAP = 1e-9
"""m: bodies that overlap by no more than this touch."""


ROUNDING = 4.0 * 2.0**-52
"""Rounding error of the difference of two coordinates, relative to the larger."""


def touch_tolerance(*coordinates: FloatArray) -> FloatArray:
    """Return the overlap, m, (K,), that counts as contact at positions (K, 2), m."""
    largest = np.max([np.abs(each).max(axis=-1) for each in coordinates], axis=0)
    return np.asarray(TOUCH_OVERLAP + ROUNDING * largest)


def overlapping_balls(
    position: FloatArray, radius: FloatArray, to_all: BoolArray, to_fixed: BoolArray, fixed: BoolArray
) -> tuple[int, int, float] | None:
    """Return the first pair of balls that can collide and overlap, and the depth, m; None if there is none.

    Args:
        position: (N, 2) m.
        radius: (N,) m.
        to_all: (N,) collides with everything.
        to_fixed: (N,) collides with static colliders and fixed bodies only.
        fixed: (N,) never moves.
    """
    chosen = np.flatnonzero(to_all | to_fixed)
    if len(chosen) < 2:
        return None
    found: list[tuple[int, int, float]] = []
    for a, b in near_pairs(position[chosen], 2.0 * float(radius[chosen].max()) * (1.0 + 1e-9)):
        i, j = chosen[np.minimum(a, b)], chosen[np.maximum(a, b)]
        offset = position[j] - position[i]
        depth = radius[i] + radius[j] - np.hypot(offset[:, 0], offset[:, 1])
        collides = (to_all[i] & to_all[j] & ~(fixed[i] & fixed[j])) | (to_all[i] & fixed[i] & ~fixed[j])
        collides |= to_all[j] & fixed[j] & ~fixed[i]
        overlapping = np.flatnonzero(collides & (depth > touch_tolerance(position[i], position[j])))
        if len(overlapping):
            first = overlapping[np.lexsort((j[overlapping], i[overlapping]))[0]]
            found.append((int(i[first]), int(j[first]), float(depth[first])))
    return min(found, default=None)


def overlapping_collider(
    position: FloatArray, radius: FloatArray, static: StaticColliders
) -> tuple[int, int, float] | None:
    """Return the first static collider that a ball overlaps, as (ball, collider, depth in m); None if there is none.

    Args:
        position: (N, 2) m, of balls that can collide with it.
        radius: (N,) m.
        static: static colliders.
    """
    if not len(position):
        return None
    for (px, py, nx, ny), collider in zip(static.planes, static.plane_collider.tolist(), strict=True):
        gap = (position[:, 0] - px) * nx + (position[:, 1] - py) * ny
        point = np.broadcast_to(np.array([px, py]), position.shape)
        overlapping = np.flatnonzero(radius - gap > touch_tolerance(position, point))
        if len(overlapping):
            return int(overlapping[0]), collider, float(radius[overlapping[0]] - gap[overlapping[0]])
    for k, candidates in _near_segments(position, float(radius.max()), static):
        gap = _gap(position[candidates], static.segments[k])
        ends = np.broadcast_to(static.segments[k, :4], (len(candidates), 4))
        overlapping = np.flatnonzero(radius[candidates] - gap > touch_tolerance(position[candidates], ends))
        if len(overlapping):
            ball = int(candidates[overlapping[0]])
            return ball, int(static.segment_collider[k]), float(radius[ball] - gap[overlapping[0]])
    return None


def _near_segments(position: FloatArray, max_radius: float, static: StaticColliders) -> Iterator[tuple[int, IntArray]]:
    """Yield each segment with the indices, ascending, of the balls near it in x, or in y if those are fewer.

    Args:
        position: (N, 2) m.
        max_radius: largest radius, m.
        static: static colliders.
    """
    ends, extent = static.segments[:, :4].reshape(-1, 2, 2), static.segments[:, 4:] + max_radius
    slack = 1e-9 + 8.0 * ROUNDING * np.abs(ends).max(axis=(1, 2), initial=0.0)[:, None]
    low, high = ends.min(axis=1) - extent - slack, ends.max(axis=1) + extent + slack
    orders = [np.argsort(position[:, axis], kind="stable") for axis in range(2)]
    coordinates = [position[order, axis] for axis, order in enumerate(orders)]
    first = np.column_stack([np.searchsorted(coordinates[axis], low[:, axis], "left") for axis in range(2)])
    last = np.column_stack([np.searchsorted(coordinates[axis], high[:, axis], "right") for axis in range(2)])
    axes = np.argmin(last - first, axis=1)
    for k, axis in enumerate(axes.tolist()):
        begin, end = int(first[k, axis]), int(last[k, axis])
        if begin < end:
            yield k, np.sort(orders[axis][begin:end])


def _gap(position: FloatArray, segment: FloatArray) -> FloatArray:
    """Return the distances (N,) of centres from a segment, m."""
    ax, ay, bx, by, half = segment
    x, y = position.T
    fraction = nearest_fractions(ax, ay, bx, by, x, y)
    return np.asarray(np.hypot(x - ax - fraction * (bx - ax), y - ay - fraction * (by - ay)) - half)


def overlap_message(first: str, second: str, depth: float) -> str:
    """Return the message for two overlapping objects."""
    return f"{first!r} and {second!r} overlap by {depth:.3g} m, and it cannot separate overlapping bodies"


def unsupported(setup: Setup, settings: Settings) -> tuple[str, ...]:
    """Return each demand and setting of a scene that the engine does not support."""
    missing = unmodelled(setup, CAPABILITIES) + setting_faults(settings, "exact", {}, ABSENT)
    wanted = demands(setup)
    missing += [f"{demand}: {reason}" for demand, reason in REASONS.items() if demand in wanted]
    if on_floor(setup):
        missing += unsupported_on_surface(setup)
    too_many = too_many_pairs(setup)
    if too_many is not None:
        return (*missing, too_many)
    overlap = _overlap_at_start(setup)
    return (*missing, overlap) if overlap else tuple(missing)


def too_many_pairs(setup: Setup) -> str | None:
    """Return why a scene has too many balls, or None: all pairs of balls and colliders are tested."""
    scene, bodies = setup.scene, setup.bodies
    touching = np.asarray([element.collides != "none" for element in bodies.elements], np.bool_)[bodies.element]
    balls, moving = int(touching.sum()), int((touching & ~bodies.fixed).sum())
    if on_floor(setup):  # the table of pairs has a row for every ball
        refusal = MEMORY.refusal(f"the table of pairs of {len(bodies):,} balls takes", 8 * len(bodies) ** 2)
        if refusal is not None:
            return refusal
    fixed = sum(2 * len(wall.points) for wall in scene.walls) + len(scene.planes) + len(scene.posts)
    pairs = moving * (balls + fixed + len(scene.pockets))
    return PAIRS.refusal(
        f"the number of pairs of {moving:,} moving balls with {balls + fixed:,} balls and surfaces is", pairs
    )


@derived_once
def _overlap_at_start(setup: Setup) -> str | None:
    return overlap_of(setup, setup.bodies.position)


def overlap_of(start: Scene | Setup, position: FloatArray) -> str | None:
    """Return a message naming two overlapping objects with the bodies at positions (N, 2), m; None without overlap."""
    setup = Setup.of(start)
    scene, bodies = setup.scene, setup.bodies
    if not bodies.round.any():
        return None
    kinds = np.asarray([element.collides for element in bodies.elements])[bodies.element]
    in_play = bodies.round & (pockets_at(scene, position) < 0)  # captured balls do not collide
    to_all, to_fixed = (kinds == "all") & in_play, (kinds == "fixed") & in_play
    pair = overlapping_balls(position, bodies.radius, to_all, to_fixed, bodies.fixed)
    if pair is not None:
        return overlap_message(bodies.names[pair[0]], bodies.names[pair[1]], pair[2])
    candidates = np.flatnonzero((to_all | to_fixed) & ~bodies.fixed)
    found = overlapping_collider(position[candidates], bodies.radius[candidates], static_colliders(scene))
    if found is not None:
        return overlap_message(bodies.names[candidates[found[0]]], scene.fixed_names[found[1]], found[2])
    return None
