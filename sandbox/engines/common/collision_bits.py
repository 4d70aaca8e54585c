"""Collision filters as bits: categories and masks of bodies and static colliders, for engines that filter by them."""

from sandbox.scene.description.base import Collides

STATIC, COLLIDES_ALL, COLLIDES_FIXED = 0b001, 0b010, 0b100
"""Collision categories: static and fixed bodies; bodies that collide with everything; bodies that collide with the
first category only."""

CATEGORIES_PER_LAYER = 3
"""number of categories on each layer: those of layer k are shifted by 3·k bits"""


def collision_bits(fixed: bool, collides: Collides, layers: int = 1) -> tuple[int, int]:
    """Return the categories of a shape on some layers, given as bits, and the categories that it collides with."""
    if fixed:
        categories, mask = STATIC, COLLIDES_ALL | COLLIDES_FIXED if collides == "all" else 0
    elif collides == "all":
        categories, mask = COLLIDES_ALL, STATIC | COLLIDES_ALL
    else:
        categories, mask = COLLIDES_FIXED, STATIC
    layer_bits = sum(1 << CATEGORIES_PER_LAYER * k for k in range(layers.bit_length()) if layers >> k & 1)
    return categories * layer_bits, mask * layer_bits
