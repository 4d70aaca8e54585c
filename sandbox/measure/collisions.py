"""Collisions: which contacts of a run are not notes of zones, when the first one is, and which bodies can touch."""

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.scene.compile.contacts import reach
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SOLID = ("plane", "wall", "post", "pocket")


def are_collisions(run: Trajectory) -> BoolArray:
    """Tell which contacts of a run are collisions, or falls into pockets, (C,)."""
    scene = run.info["scene"]
    if not scene.get("zone"):
        return np.ones(len(run.contact_pair), np.bool_)
    return np.asarray(run.contact_pair[:, 1] >= -sum(len(scene.get(kind, ())) for kind in SOLID))


def collisions(run: Trajectory) -> int:
    """Return how many contacts of a run are collisions."""
    return int(are_collisions(run).sum())


def first_collision(run: Trajectory) -> float | None:
    """Return the time at which the first collision of a run begins, s; None where there is none."""
    times = run.contact_time[are_collisions(run)]
    return float(times.min()) if len(times) else None


def layers_of_fixed(scene: Scene) -> IntArray:
    """Return the layers of each fixed thing as bits, (F,)."""
    return np.asarray([mask_of(thing.layers, scene.layers) for thing in scene.fixed], dtype=np.int64)


def together(run: Trajectory, scene: Scene, pair: tuple[int, int]) -> BoolArray:
    """Tell in which frames two share a layer, (T,); of what zones note and of pockets that is always so."""
    always = np.ones(len(run.time), np.bool_)
    first, second = pair
    if not len(run.layer) or -1 - second >= len(scene.fixed):
        return always
    own = 1 << run.layer[:, first].clip(0).astype(np.int64)
    if second < 0:
        return np.asarray(own & layers_of_fixed(scene)[-1 - second] != 0)
    return np.asarray(run.layer[:, first] == run.layer[:, second])


def can_meet(scene: Scene, pair: tuple[int, int]) -> bool:
    """Tell whether two can ever be on one layer."""
    first, second = pair
    own = reach(scene, scene.bodies)
    other = own[second] if second >= 0 else layers_of_fixed(scene)[-1 - second]
    return bool(own[first] & other)
