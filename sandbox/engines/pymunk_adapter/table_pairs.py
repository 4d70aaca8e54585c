"""Pairs of balls and cushions on a surface in contact after a substep, by a pymunk space.

pymunk has no balls that roll. On a surface it is the collision detector of `engines.tabletop`: its space moves a disc
for each ball, and lists the discs that touch. They touch without an effect: without restitution and friction, at any
overlap. Half-planes, which pymunk does not have, are compared with all discs.
"""

from collections.abc import Mapping
from copy import copy
from typing import Any, Self

import numpy as np
import pymunk

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import NOTHING
from sandbox.engines.common.collision_bits import bits_of_body, bits_of_static
from sandbox.engines.pymunk_adapter.colliders import fixed_shapes, new_space, shape_filter, shuffled
from sandbox.engines.pymunk_adapter.reader import SpaceReader
from sandbox.engines.tabletop.contacts import SKIN
from sandbox.engines.tabletop.simulation import TabletopBodyStore
from sandbox.scene.description.fixed import Plane
from sandbox.scene.description.world import Settings

UNCORRECTED = 1e9
"""m of overlap that pymunk leaves uncorrected: all, as the stepper corrects it"""


class SpacePairFinder:
    """`CollisionDetector` that uses a pymunk space. A ball that passes another within a substep is not found."""

    def __init__(self, store: TabletopBodyStore, settings: Settings) -> None:
        """Create the space.

        Args:
            store: the bodies, whose positions the stepper writes.
            settings: with every choice filled in.
        """
        self._store, self._settings = store, settings
        self._found = 0
        self._create()

    def _create(self) -> None:
        store = self._store
        self._fixed = store.scene.fixed
        self._space = new_space(store.scene, self._settings.replace(slop=UNCORRECTED))
        self._reader = SpaceReader(self._space, can_sleep=False)
        self._discs: dict[int, tuple[pymunk.Body, pymunk.Circle]] = {}  # by index, of bodies that can touch
        self._static: dict[int, int] = {}  # index, −1 − k, by the id of the body
        for k, collider in enumerate(store.scene.fixed):
            if isinstance(collider, Plane):
                continue
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            shapes = list(fixed_shapes(collider, body, np.zeros(2), 0.0))
            for shape in shapes:
                shape.filter = shape_filter(*bits_of_static(store.scene, collider))
            self._space.add(body, *shapes)
            self._static[body.id] = -1 - k
        self.rebuild()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return a detector of the copied store, with a space of its own."""
        copied = copy(self)
        copied._store = memo[id(self._store)]
        copied._create()
        return copied

    @property
    def work(self) -> Mapping[str, int]:
        """Number of pairs that were found. pymunk does not report the number of pairs that it tests."""
        return {"contacts": self._found}

    def rebuild(self) -> None:
        """Update after a change of the bodies, of their positions or layers, or of the static colliders."""
        store, space = self._store, self._space
        if store.scene.fixed != self._fixed:
            self._create()
            return
        in_play = np.flatnonzero((store.collision_mask > NOTHING) & (store.pocket < 0))
        for index in set(self._discs) - set(in_play.tolist()):
            space.remove(*self._discs.pop(index))
        for row in shuffled(len(in_play)):
            index = int(in_play[row])
            if index not in self._discs:
                is_fixed = bool(store.bodies.fixed[index])
                body = pymunk.Body(1.0, np.inf, pymunk.Body.STATIC if is_fixed else pymunk.Body.DYNAMIC)
                self._discs[index] = body, pymunk.Circle(body, float(store.radius[index]) * (1.0 + SKIN))
                space.add(*self._discs[index])
            bits = bits_of_body(store.scene, store.bodies, index, int(store.layer[index]))
            self._discs[index][1].filter = shape_filter(*bits, int(store.bodies.group[index]))
            self.set_position(index, store.position[index])
        of_planes = [bits_of_static(store.scene, plane) for plane in store.scene.planes]
        self._meets_plane = np.zeros((len(store.bodies), len(of_planes)), np.bool_)
        for index, (_, disc) in self._discs.items():
            own = disc.filter
            self._meets_plane[index] = [bool(own.categories & mask and own.mask & kinds) for kinds, mask in of_planes]
        ids = {body.id: index for index, (body, _) in self._discs.items()}
        fixed = {body_id: index for body_id, index in ids.items() if store.bodies.fixed[index]}
        self._reader.assign({key: ids[key] for key in ids.keys() - fixed.keys()}, self._static | fixed)

    def find_pairs(self, velocity: FloatArray) -> IntArray:
        """Return the pairs (K, 2) in contact after a substep with mean velocities (N, 2), m/s."""
        self._reader.set_velocities(velocity)
        self._space.step(self._settings.h)
        pairs = self._reader.pairs()
        if self._store.scene.planes:
            pairs = np.concatenate((pairs, self._on_planes()))
        self._found += len(pairs)
        return pairs

    def _on_planes(self) -> IntArray:
        """Return the pairs (K, 2) of a ball and a half-plane that touch."""
        store, planes = self._store, self._store.static_colliders.planes
        gap = ((store.position[:, None] - planes[:, 0:2]) * planes[:, 2:4]).sum(axis=2)  # (N, P) m
        balls, k = np.nonzero(self._meets_plane & (gap < store.radius[:, None] * (1.0 + SKIN)))
        return np.column_stack((balls, -1 - k))

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position, (2,) m, of a ball."""
        body, _ = self._discs[index]
        body.position = float(position[0]), float(position[1])
        if body.body_type == pymunk.Body.STATIC:
            self._space.reindex_shapes_for_body(body)
