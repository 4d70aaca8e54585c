"""Collision filters as bits: categories and masks of bodies and static colliders, for engines that filter by them.

An engine's category stands for a kind of body on one layer and in one category of the scene. Two shapes then collide
exactly if their kinds, layers and categories all allow it, because each side of that condition is an intersection.
"""

from collections.abc import Iterator
from functools import lru_cache

from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.filters import bits_of_categories
from sandbox.scene.description.base import Collides
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.description.scene import SceneDescription

STATIC, COLLIDES_ALL, COLLIDES_FIXED = 0b001, 0b010, 0b100
"""Kinds: static and fixed bodies; bodies that collide with everything; bodies that collide with the first kind only."""

KINDS = 3
"""number of kinds; bit 3·(C·layer + category) + kind belongs to a kind, with C categories in the scene"""


def bits_of_body(scene: SceneDescription, bodies: Bodies, index: int, layer: int) -> tuple[int, int]:
    """Return the categories of a body on a layer, and those that it collides with."""
    element = bodies.elements[bodies.element[index]]
    names = bits_of_categories(element, scene.categories)
    return collision_bits(bool(bodies.fixed[index]), element.collides, 1 << layer, *names, len(scene.categories))


def bits_of_static(scene: SceneDescription, collider: Plane | Wall | Post) -> tuple[int, int]:
    """Return the categories of a static collider, and those that it collides with: none if it is not solid."""
    is_solid = isinstance(collider, Plane) or collider.solid
    names = bits_of_categories(collider, scene.categories)
    layers = mask_of(collider.layers, scene.layers)
    return collision_bits(True, "all" if is_solid else "none", layers, *names, len(scene.categories))


def collision_bits(
    fixed: bool, collides: Collides, layers: int = 1, categories: int = 1, mask: int = 1, count: int = 1
) -> tuple[int, int]:
    """Return the categories of a shape as an engine has them, and those that it collides with.

    Args:
        fixed: whether its body never moves.
        collides: what it collides with.
        layers: that it is on, as bits.
        categories: of the scene that it belongs to, as bits.
        mask: categories of the scene that it collides with, as bits.
        count: number of categories in the scene; 0 is one, to which all belong.
    """
    if fixed:
        kind, kinds = STATIC, COLLIDES_ALL | COLLIDES_FIXED if collides == "all" else 0
    elif collides == "all":
        kind, kinds = COLLIDES_ALL, STATIC | COLLIDES_ALL
    else:
        kind, kinds = COLLIDES_FIXED, STATIC
    return _repeated(kind, layers, categories, count), _repeated(kinds, layers, mask, count)


def bits_of_sensor(scene: SceneDescription, detects: tuple[str, ...] | None, *, static: bool) -> tuple[int, int]:
    """Return all categories, and those that a sensor detects on any layer.

    Args:
        scene: the scene.
        detects: categories of the scene; None means all.
        static: whether it detects static objects and fixed bodies too.
    """
    layers, count = (1 << len(scene.layers)) - 1, max(len(scene.categories), 1)
    every = (1 << KINDS * count * len(scene.layers)) - 1
    kinds = COLLIDES_ALL | COLLIDES_FIXED | (STATIC if static else 0)
    wanted = (1 << count) - 1 if detects is None else mask_of(detects, scene.categories)
    return every, _repeated(kinds, layers, wanted, count)


@lru_cache(maxsize=1024)  # scenes have many colliders, and few different ones
def _repeated(kinds: int, layers: int, categories: int, count: int) -> int:
    """Return the bits of some kinds on some layers and in some categories."""
    return sum(kinds << KINDS * (max(count, 1) * layer + k) for layer in _ones(layers) for k in _ones(categories))


def repeated(bits: int, count: int, which: int) -> int:
    """Return bits of which each is replaced by `count` ones, of which those in `which` are set."""
    return sum(which << count * k for k in _ones(bits))


def _ones(bits: int) -> Iterator[int]:
    """Yield the positions of the bits that are set."""
    return (k for k in range(bits.bit_length()) if bits >> k & 1)


def static_categories(scene: SceneDescription) -> int:
    """Return all categories that static objects of a scene can have."""
    layers, categories = len(scene.layers), max(len(scene.categories), 1)
    return _repeated(STATIC, (1 << layers) - 1, (1 << categories) - 1, categories)


def too_many_categories(scene: SceneDescription, max_bits: int) -> list[str]:
    """Return why the filters of an engine have too few bits for a scene; nothing if they have enough."""
    layers, categories = len(scene.layers), max(len(scene.categories), 1)
    if KINDS * layers * categories <= max_bits:
        return []
    of_layers = f" on {layers} layers" if layers > 1 else ""
    most = max_bits // (KINDS * layers)
    return [f"{categories} categories{of_layers} are not supported; its collision filters have bits for {most}"]
