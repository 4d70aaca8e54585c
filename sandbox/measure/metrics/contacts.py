"""Contacts of a run: collisions, contact rows merged into contact episodes, and the deepest penetration.

A ball that comes to rest bounces ever lower and faster, and different engines count its last bounces differently. Rows
of one pair that follow each other closely are therefore one episode, which lasts.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.metrics.clearance import IndexPair, clearance, plane_clearance
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.filters import filter_table, fixed_layers, reachable_layers
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane
from sandbox.scene.description.scene import first_sensor
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.trajectory import Trajectory

SOLID_KINDS = ("plane", "wall", "post", "pocket")


def are_collisions(run: Trajectory) -> BoolArray:
    """Return which contacts of a run are collisions or falls into pockets, (C,); all in a run without a scene."""
    scene = run.info.get("scene", {})
    if not scene.get("zone") and not scene.get("sensor"):
        return np.ones(len(run.contact_pair), np.bool_)
    return np.asarray(run.contact_pair[:, 1] >= -sum(len(scene.get(kind, ())) for kind in SOLID_KINDS))


def collisions(run: Trajectory) -> int:
    """Return the number of collisions of a run."""
    return int(are_collisions(run).sum())


def first_collision(run: Trajectory) -> float | None:
    """Return the start of the first collision of a run, s; None if there is none."""
    times = run.contact_time[are_collisions(run)]
    return float(times.min()) if len(times) else None


def share_layer(run: Trajectory, scene: Scene, pair: tuple[int, int]) -> BoolArray:
    """Return in which frames two bodies share a layer, (T,); always true for zones and pockets."""
    always = np.ones(len(run.time), np.bool_)
    first, second = pair
    if not len(run.layer) or -1 - second >= len(scene.fixed):
        return always
    layer_bit = 1 << run.layer[:, first].clip(0).astype(np.int64)
    if second < 0:
        return np.asarray(layer_bit & fixed_layers(scene)[-1 - second] != 0)
    return np.asarray(run.layer[:, first] == run.layer[:, second])


def can_share_layer(scene: Scene, pair: tuple[int, int]) -> bool:
    """Return whether two bodies can ever be on one layer."""
    first, second = pair
    reachable = reachable_layers(scene, scene.bodies)
    other = reachable[second] if second >= 0 else fixed_layers(scene)[-1 - second]
    return bool(reachable[first] & other)


MAX_EPISODE_GAP = 4.0
"""Rows of one pair that follow each other within this many steps are one episode."""


@dataclass(frozen=True)
class ContactEpisode:
    """Contact of a pair, or several contacts that follow each other closely."""

    start: float
    """s"""
    end: float
    """s, time of the last contact; `start` for a single impact"""
    point: tuple[float, float]
    """m, contact point of the first contact"""
    impulse: tuple[float, float]
    """N·s, total impulse of the first of the pair on the second"""


def contact_episodes(
    run: Trajectory, scene: Scene, dt: float, reach: float, until: float
) -> dict[IndexPair, list[ContactEpisode]]:
    """Return the contact episodes of each pair in the order of time, without visits of sensors.

    A row continues an episode if it follows within `MAX_EPISODE_GAP` steps, or if the clearance of the pair stays
    within `reach` in all frames between them.

    Args:
        run: the run.
        scene: scene of the run.
        dt: common step of the compared runs, s.
        reach: largest clearance of a lasting contact, m.
        until: start of the last row that counts, s.
    """
    order = np.lexsort((run.contact_time, run.contact_pair[:, 1], run.contact_pair[:, 0]))
    order = order[(run.contact_time[order] <= until) & (run.contact_pair[order, 1] > first_sensor(scene))]
    pairs = run.contact_pair[order]
    cuts = np.flatnonzero((np.diff(pairs, axis=0) != 0).any(axis=1)) + 1
    found: dict[IndexPair, list[ContactEpisode]] = {}
    for rows in np.split(order, cuts) if len(order) else []:
        pair = (int(run.contact_pair[rows[0], 0]), int(run.contact_pair[rows[0], 1]))
        time = run.contact_time[rows]
        ends = _end_times(run, scene, pair, time, reach)
        found[pair] = _merged_rows(time, ends, run.contact_point[rows], run.contact_impulse[rows], MAX_EPISODE_GAP * dt)
    return found


def _end_times(run: Trajectory, scene: Scene, pair: IndexPair, time: FloatArray, reach: float) -> FloatArray:
    """Return the end of contact after each of some times, s: the last frame in which the pair stays within reach."""
    apart = ~(clearance(scene, scene.bodies, run.position, run.angle, pair) <= reach) | ~share_layer(run, scene, pair)
    # For every frame the index of the first frame from it on in which the pair is apart.
    index = np.where(apart, np.arange(len(apart)), len(apart))
    following = np.minimum.accumulate(index[::-1])[::-1]
    first = np.searchsorted(run.time, time, side="left")
    next_apart = np.append(following, len(apart))[first]
    return np.asarray(np.maximum(time, run.time[(next_apart - 1).clip(0)]))


def _merged_rows(
    time: FloatArray, ends: FloatArray, points: FloatArray, impulses: FloatArray, close: float
) -> list[ContactEpisode]:
    touching: list[ContactEpisode] = []
    groups = np.flatnonzero(time[1:] > np.maximum(np.maximum.accumulate(ends)[:-1], time[:-1] + close)) + 1
    for rows in np.split(np.arange(len(time)), groups):
        x, y = points[rows[0]].tolist()
        jx, jy = impulses[rows].sum(axis=0).tolist()
        end = float(max(ends[rows].max(), time[rows[-1]]))
        touching.append(ContactEpisode(float(time[rows[0]]), end, (x, y), (jx, jy)))
    return touching


MAX_DISCS, MAX_SHAPES = 100_000, 10_000
"""Frames × bodies that are examined, of discs and of other shapes; beyond it, frames are left out."""
MAX_PAIRED_BODIES = 50
"""Bodies up to which pairs of other shapes, and static objects other than planes, are examined one by one."""


def sampled_frames(run: Trajectory, scene: Scene) -> list[int]:
    """Return the indices of the frames that are examined: evenly spaced, with the first and the last."""
    frames, bodies = run.position.shape[:2]
    max_values = MAX_DISCS if scene.bodies.round.all() else MAX_SHAPES
    count = min(frames, max(2, max_values // max(bodies, 1)))
    return [int(k) for k in np.unique(np.linspace(0, frames - 1, count).round())]


def max_penetration(run: Trajectory, scene: Scene) -> FloatArray:
    """Return the deepest overlap in each frame, (T,) m; 0 without an overlap.

    Of bodies other than discs, only pairs that are neighbours at the start are examined: in a stack, no others collide
    before it has fallen.

    Args:
        run: the run, with T finite frames.
        scene: scene of the run.
    """
    bodies = scene.bodies
    found = np.zeros(len(run.time))
    can_touch, filters = contact_matrix(scene).touches & ~bodies.immovable, filter_table(scene, bodies)
    for k, plane in enumerate(scene.planes):
        able = np.flatnonzero(can_touch & filters.meets_fixed(k))
        point, normal = np.asarray(plane.point), np.asarray(plane.normal) / math.hypot(*plane.normal)
        discs = able[bodies.round[able]]
        if len(discs):
            above = (run.position[:, discs] - point) @ normal - bodies.radius[discs]
            found = np.maximum(found, -above.min(axis=1))
        for number in able[~bodies.round[able]].tolist():
            above = plane_clearance(bodies, number, run.position[:, number], run.angle[:, number], point, normal)
            found = np.maximum(found, -above)
    others = [-1 - k for k, thing in enumerate(scene.fixed) if not isinstance(thing, Plane) and thing.solid]
    paired = np.flatnonzero(can_touch)[:MAX_PAIRED_BODIES]
    pairs = [(body, thing) for thing in others for body in paired[filters.meets_fixed(-1 - thing)[paired]].tolist()]
    mutual = contact_matrix(scene).mutual and len(scene.layers) == 1  # bodies on different layers can pass each other
    if mutual and not bodies.round[can_touch].all():
        neighbours = np.asarray(_initial_neighbours(scene), np.int64).reshape(-1, 2)
        pairs += [(a, b) for a, b in neighbours[filters.meets(*neighbours.T)].tolist()]
    # A body that can change its layer can be above another without colliding: only bodies that cannot are examined.
    if len(scene.layers) > 1:
        reachable = reachable_layers(scene, bodies)
        pairs = [pair for pair in pairs if reachable[pair[0]].bit_count() == 1 and can_share_layer(scene, pair)]
    for pair in pairs:
        found = np.maximum(found, -clearance(scene, bodies, run.position, run.angle, pair))
    if mutual and bodies.round.all():
        colliding = np.flatnonzero(contact_matrix(scene).touches)
        max_distance = 2.0 * float(bodies.radius[colliding].max())
        for k, position in enumerate(run.position[:, colliding]):
            for i, j in near_pairs(position, max_distance):
                a, b = colliding[i], colliding[j]
                apart = np.hypot(*(position[i] - position[j]).T) - bodies.radius[a] - bodies.radius[b]
                apart[~filters.meets(a, b)] = np.inf
                found[k] = max(found[k], -float(apart.min(initial=np.inf)))
    return found


def _initial_neighbours(scene: Scene) -> list[tuple[int, int]]:
    """Return the pairs of bodies whose bounding discs overlap at the start and whose collisions no joint disables."""
    bodies = scene.bodies
    apart = {(a, b) for a, b in scene.joint_arrays.apart().tolist()}
    found = []
    for i, j in near_pairs(bodies.position, 2.0 * float(bodies.radius.max())):
        overlapping = np.hypot(*(bodies.position[i] - bodies.position[j]).T) < bodies.radius[i] + bodies.radius[j]
        for a, b in zip(i[overlapping].tolist(), j[overlapping].tolist(), strict=True):
            pair = (min(a, b), max(a, b))
            if pair not in apart and not (bodies.immovable[a] and bodies.immovable[b]):
                found.append(pair)
    return sorted(found)[: 4 * MAX_PAIRED_BODIES]
