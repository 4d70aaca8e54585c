"""Collision filters: which bodies and static colliders can collide, by layers, categories and groups.

Two objects can collide if they are on a common layer, if the mask of each has a category of the other, and if they
are not two bodies of one group. A body on several layers is one that zones move between them. The key `collides` is not
part of a filter: it depends on which of two bodies is fixed (`contacts.py`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import Collider
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.description.scene import SceneDescription


@dataclass(frozen=True, eq=False)
class FilterTable:
    """Layers, categories, masks and groups of N bodies and F static colliders; all but groups are bit masks."""

    layers: IntArray
    """(N,) layers that each body can reach"""
    categories: IntArray
    """(N,) collision categories of each body"""
    mask: IntArray
    """(N,) collision categories that each body collides with"""
    group: IntArray
    """(N,) collision group of each body; 0 is none"""
    fixed_layers: IntArray
    """(F,) layers of each static collider"""
    fixed_categories: IntArray
    """(F,) collision categories of each static collider"""
    fixed_mask: IntArray
    """(F,) collision categories that each static collider collides with"""

    def meets(self, first: IntArray, second: IntArray) -> BoolArray:
        """Return which pairs (K,) of bodies can collide."""
        on_layer = self.layers[first] & self.layers[second] != 0
        in_group = (self.group[first] != 0) & (self.group[first] == self.group[second])
        return np.asarray(on_layer & ~in_group & self.share_categories(first, second))

    def share_categories(self, first: IntArray, second: IntArray) -> BoolArray:
        """Return which pairs (K,) of bodies can collide by their categories, on any layer."""
        return np.asarray(
            (self.categories[first] & self.mask[second] != 0) & (self.mask[first] & self.categories[second] != 0)
        )

    def meets_fixed(self, index: int) -> BoolArray:
        """Return which bodies can collide with a static collider, (N,)."""
        bodies = np.arange(len(self.layers))
        on_layer = self.layers & self.fixed_layers[index] != 0
        return np.asarray(on_layer & self.share_categories_with_fixed(bodies, np.asarray(index)))

    def share_categories_with_fixed(self, bodies: IntArray, colliders: IntArray) -> BoolArray:
        """Return which pairs (K,) of a body and a static collider can collide by their categories, on any layer."""
        return np.asarray(
            (self.categories[bodies] & self.fixed_mask[colliders] != 0)
            & (self.mask[bodies] & self.fixed_categories[colliders] != 0)
        )


def filter_table(scene: SceneDescription, bodies: Bodies) -> FilterTable:
    """Return the filters of bodies and of the static colliders of a scene."""
    categories, mask = category_bits(bodies.elements, scene.categories)
    fixed_categories, fixed_mask = category_bits(scene.fixed, scene.categories)
    return FilterTable(
        layers=reachable_layers(scene, bodies),
        categories=categories[bodies.element],
        mask=mask[bodies.element],
        group=bodies.group,
        fixed_layers=fixed_layers(scene),
        fixed_categories=fixed_categories,
        fixed_mask=fixed_mask,
    )


def category_bits(colliders: Sequence[Collider], known: tuple[str, ...]) -> tuple[IntArray, IntArray]:
    """Return the categories and the masks of K colliders as bits, (K,) and (K,).

    A scene without categories has a single one, to which all belong.
    """
    if not known:
        every = np.ones(len(colliders), np.int64)
        return every, every
    bits = np.asarray([bits_of_categories(each, known) for each in colliders], np.int64).reshape(-1, 2)
    return bits[:, 0], bits[:, 1]


def bits_of_categories(collider: Collider, known: tuple[str, ...]) -> tuple[int, int]:
    """Return the categories and the mask of a collider as bits; without any names there is one, to which all belong."""
    if collider.categories is None and collider.mask is None:
        every = (1 << max(len(known), 1)) - 1
        return every, every
    return mask_of(collider.categories, known), mask_of(collider.mask, known)


def fixed_layers(scene: SceneDescription) -> IntArray:
    """Return the layers of each static collider as bits, (F,)."""
    return np.asarray([mask_of(each.layers, scene.layers) for each in scene.fixed], np.int64)


def reachable_layers(scene: SceneDescription, bodies: Bodies) -> IntArray:
    """Return the bit mask of all layers that each body can reach from its own, (N,)."""
    layers = scene.layers
    if len(layers) == 1:
        return np.ones(len(bodies), np.int64)
    of_layer = [1 << k for k in range(len(layers))]
    transitions = [
        (mask_of(z.layers, layers), 1 << layers.index(z.to_layer)) for z in scene.zones if z.to_layer is not None
    ]
    for _ in layers:  # a path between two layers is no longer than their number
        for mask, to in transitions:
            of_layer = [bits | to if bits & mask else bits for bits in of_layer]
    can_move = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.fixed
    return np.asarray(np.where(can_move, np.asarray(of_layer)[bodies.layer], 1 << bodies.layer))


def bits_of_layers(layer: IntArray | None, count: int) -> IntArray:
    """Return the layers of bodies as bit masks, (N,), from a frame's indices; default: the first layer."""
    return np.ones(count, np.int64) if layer is None else 1 << layer
