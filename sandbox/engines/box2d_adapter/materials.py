"""Friction and restitution of shapes, so that Box2D's mixing gives each pair exactly its coefficients.

Box2D takes the square root of the product of two frictions, and the larger of two restitutions. So frictions of
shapes are factors of the squared coefficients, and restitutions the smallest of those of a surface's pairs.

Where no such values exist, as for balls that roll on a rough plane but slide on each other, moving bodies get two
shapes of the same form: one that meets static objects only, and one that meets other moving bodies only. Where that
does not give every pair its coefficients either, the scene is refused.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.common.pair_factors import factors
from sandbox.scene.compile.contacts import ContactMatrix

TOLERANCE = 2.0**-20
"""relative, of a coefficient; eight roundings of 32-bit numbers"""


class Coefficients(NamedTuple):
    """Friction and restitution of the shapes of S surfaces, (S,) each."""

    friction: FloatArray
    restitution: FloatArray


class ShapeMaterials(NamedTuple):
    """Values of the shapes of S surfaces."""

    against_static: Coefficients
    """of shapes of moving bodies that meet static objects"""
    against_moving: Coefficients
    """of shapes of moving bodies that meet moving bodies"""
    static: Coefficients
    """of static objects"""
    is_split: bool
    """whether moving bodies need a shape of each kind"""


def shape_materials(matrix: ContactMatrix, is_moving: BoolArray) -> ShapeMaterials:
    """Return the values of the shapes of each surface.

    Args:
        matrix: contact matrix with S surfaces.
        is_moving: (S, 2) whether moving bodies, and whether static objects, have each surface.
    """
    surfaces, touching = matrix.surfaces, matrix.touching
    tables = surfaces.friction, surfaces.restitution
    plain = _solve(*tables, touching)
    if not _wrong(plain, *tables, touching).any():
        return ShapeMaterials(plain, plain, plain, is_split=False)
    mutual, with_static = _kinds_of_pairs(touching, is_moving)
    # Of moving and of static objects as if they were 2·S surfaces, of which only pairs across the halves touch.
    size, none = len(touching), np.zeros_like(touching)
    across = np.block([[none, with_static], [with_static.T, none]])
    both = _solve(np.tile(surfaces.friction, (2, 2)), np.tile(surfaces.restitution, (2, 2)), across)
    moving = Coefficients(both.friction[:size], both.restitution[:size])
    static = Coefficients(both.friction[size:], both.restitution[size:])
    return ShapeMaterials(moving, _solve(*tables, mutual), static, is_split=True)


def unmixable(matrix: ContactMatrix, is_moving: BoolArray) -> Iterator[str]:
    """Yield which coefficients of pairs Box2D's mixing cannot give; arguments as for `shape_materials`."""
    touching = matrix.touching
    if not touching.any():
        return
    found, tables = shape_materials(matrix, is_moving), (matrix.surfaces.friction, matrix.surfaces.restitution)
    if not found.is_split:
        return
    mutual, with_static = _kinds_of_pairs(touching, is_moving)
    wrong = _wrong(found.against_moving, *tables, mutual)
    wrong |= _wrong(found.against_static, *tables, with_static, found.static)
    for which, (name, rule) in enumerate(
        (("friction", "the square root of the product of two values"), ("restitution", "the larger of two values"))
    ):
        rows, columns = np.nonzero(wrong[which])
        if len(rows):
            value = float(tables[which][rows[0], columns[0]])
            yield f"a {name} of {value:g} beside those of other pairs is not supported: Box2D mixes {name} as {rule}"


def _kinds_of_pairs(touching: BoolArray, is_moving: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Return which surfaces (S, S) of two moving bodies touch, and which of a moving body and a static object."""
    moving, static = is_moving.T
    return touching & np.outer(moving, moving), touching & np.outer(moving, static)


def _solve(friction: FloatArray, restitution: FloatArray, touching: BoolArray) -> Coefficients:
    """Return the values that best match coefficients (S, S) of the pairs that can touch."""
    values = factors(friction**2, touching, [None] * len(touching))
    smallest = np.where(touching, restitution, np.inf).min(axis=1, initial=np.inf)
    return Coefficients(np.asarray(values), np.where(np.isfinite(smallest), smallest, 0.0))


def _wrong(
    found: Coefficients,
    friction: FloatArray,
    restitution: FloatArray,
    pairs: BoolArray,
    others: Coefficients | None = None,
) -> BoolArray:
    """Return which pairs have another friction, and another restitution, (2, S, S).

    `others` are the values of the surfaces in the columns, if they are not those in the rows.
    """
    partner = found if others is None else others
    mixed_friction = np.sqrt(np.outer(found.friction, partner.friction))
    mixed_restitution = np.maximum.outer(found.restitution, partner.restitution)
    differences = (
        np.abs(mixed - wanted) > TOLERANCE * wanted
        for mixed, wanted in ((mixed_friction, friction), (mixed_restitution, restitution))
    )
    return np.asarray([each & pairs for each in differences])
