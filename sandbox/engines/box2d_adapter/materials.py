"""Coefficients of shapes, so that Box2D's mixing gives each pair exactly its own.

Box2D takes the square root of the product of two frictions, the larger of two restitutions, and the larger of two
rolling resistances. So frictions of shapes are factors of the squared coefficients, and restitutions and rolling
resistances the smallest of those of a surface's pairs.

Where no such values exist, as for balls that roll on a rough plane but slide on each other, a moving body has a shape
of the same form for each surface that it can touch, which meets that surface only and has the coefficients of the
pair; see `roles`.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.common.collision_bits import KINDS, repeated
from sandbox.engines.common.pair_factors import factors
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.description.scene import SceneDescription

TOLERANCE = 2.0**-20
"""relative, of a coefficient; eight roundings of 32-bit numbers"""
FILTER_BITS = 64
"""collision categories that Box2D has"""


class ShapeRole(NamedTuple):
    """Values of a shape, and the partners for which they hold."""

    column: int
    """its values in `ShapeMaterials`"""
    categories: int
    """collision categories that it belongs to, as bits"""
    mask: int
    """collision categories of its partners"""


class ShapeMaterials(NamedTuple):
    """Values of shapes with each of S surfaces."""

    friction: FloatArray
    """(S, K): K = 1 if one shape serves all partners; else against static objects of each surface, moving bodies of
    each surface, and of a static object against all"""
    restitution: FloatArray
    """(S, K), of the same"""
    rolling: FloatArray
    """(S, K), rolling resistance, of the same"""

    @property
    def is_split(self) -> bool:
        """Whether a moving body has a shape for each surface that it can touch."""
        return bool(self.friction.shape[1] > 1)


def shape_materials(matrix: ContactMatrix) -> ShapeMaterials:
    """Return the values of shapes with the S surfaces of a contact matrix."""
    friction, restitution, touching = matrix.surfaces.friction, matrix.surfaces.restitution, matrix.touching
    rolling = matrix.surfaces.rolling
    factor = np.asarray(factors(friction**2, touching, [None] * len(touching)))
    bounce, roll = _smallest(restitution, touching), _smallest(rolling, touching)
    mixed = (
        (np.sqrt(np.outer(factor, factor)), friction),
        (np.maximum.outer(bounce, bounce), restitution),
        (np.maximum.outer(roll, roll), rolling),
    )
    if not any(((np.abs(found - wanted) > TOLERANCE * wanted) & touching).any() for found, wanted in mixed):
        return ShapeMaterials(factor[:, None], bounce[:, None], roll[:, None])
    # A static object has friction 1 and the others 0, which leaves a square root and the values of the other shape.
    one = np.ones((len(touching), 1))
    larger = (np.hstack((table, table, 0.0 * one)) for table in (restitution, rolling))
    return ShapeMaterials(np.hstack((friction**2, friction, one)), *larger)


def _smallest(table: FloatArray, touching: BoolArray) -> FloatArray:
    """Return the smallest value of each surface with those that it can touch, (S,); 0 if it can touch none."""
    smallest = np.where(touching, table, np.inf).min(axis=1, initial=np.inf)
    return np.where(np.isfinite(smallest), smallest, 0.0)


def roles(
    materials: ShapeMaterials, matrix: ContactMatrix, surface: int, bits: tuple[int, int], static: int | None
) -> Iterator[ShapeRole]:
    """Yield the role of each shape that an object needs for a part with a surface.

    If it is more than one, each collision category of the scene becomes one for each surface. The shape of surface i
    that meets surface j belongs to categories of i and has a mask of those of j, so that of two bodies only the two
    shapes meet which were made for each other.

    Args:
        materials: values of the shapes.
        matrix: contact matrix of the scene.
        surface: index of the surface.
        bits: categories and mask of the object in the scene.
        static: categories of static objects in the scene, for a moving body; None for a static object.
    """
    categories, mask = bits
    if not materials.is_split:
        yield ShapeRole(0, categories, mask)
        return
    size = len(matrix.touching)
    own = repeated(categories, size, 1 << surface)
    if static is None:
        yield ShapeRole(2 * size, own, repeated(mask, size, (1 << size) - 1))
        return
    for k, partners in enumerate((mask & static, mask & ~static)):
        for partner in np.flatnonzero(matrix.touching[surface]).tolist() if partners else ():
            yield ShapeRole(k * size + partner, own, repeated(partners, size, 1 << partner))


def mixing_faults(scene: SceneDescription, matrix: ContactMatrix) -> Iterator[str]:
    """Yield why Box2D cannot give each pair of surfaces its coefficients."""
    size, bits = len(matrix.touching), KINDS * len(scene.layers) * max(len(scene.categories), 1)
    if size * bits > FILTER_BITS and shape_materials(matrix).is_split:
        yield (
            f"{size} materials whose pairs have coefficients of their own, which need as many shapes of each body; its "
            f"collision filters have bits for {FILTER_BITS // bits}. Box2D takes the square root of the product of two "
            "frictions and the larger of two restitutions: give more pairs such values, or more bodies the same "
            "material"
        )
