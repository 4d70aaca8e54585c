"""Surfaces: what restitution and friction two things have when they touch.

Both belong to a *pair* of materials. The one place that states them is a `[[pair]]`; where a pair is not
listed, `mix` holds: a figure stated on one side of a contact holds for it, on both they multiply (pymunk's own
rule), on neither it is 0. A figure stated on a shape outranks its material's.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene, Surfaced
from sandbox.scene.near import FloatArray, IntArray


class Surface(NamedTuple):
    """One side of a contact. The material is kept only where some `[[pair]]` names it."""

    material: str | None
    restitution: float | None
    friction: float | None


def mix(a: float | None, b: float | None) -> float:
    """Return the coefficient of a contact whose sides state `a` and `b`."""
    if a is None:
        return 0.0 if b is None else b
    return a if b is None else a * b


@dataclass(frozen=True, eq=False)
class Surfaces:
    """The distinct surfaces of a scene, S of them, and who has which."""

    surfaces: tuple[Surface, ...]
    of_body: IntArray
    """(N,) surface number of each body"""
    of_fixed: IntArray
    """(F,) surface number of each fixed thing"""
    restitution: FloatArray
    """(S, S) of each pair, symmetric"""
    friction: FloatArray
    """(S, S) of each pair, symmetric"""


def surfaces_of(scene: Scene, bodies: Bodies) -> Surfaces:
    """Number the distinct surfaces of a scene and work out the coefficients of every pair, O(S²).

    Raises:
        KeyError: a thing names a material that the scene does not declare.
    """
    materials = {m.name: m for m in scene.materials}
    pairs = {frozenset(p.between): p for p in scene.pairs}
    paired = {name for p in scene.pairs for name in p.between}
    numbers: dict[Surface, int] = {}

    def number(thing: Surfaced) -> int:
        material = None if thing.material is None else materials[thing.material]
        restitution, friction = thing.restitution, thing.friction
        if material is not None:
            restitution = material.restitution if restitution is None else restitution
            friction = material.friction if friction is None else friction
        kept = thing.material if thing.material in paired else None
        return numbers.setdefault(Surface(kept, restitution, friction), len(numbers))

    def coefficients(a: Surface, b: Surface) -> tuple[float, float]:
        restitution, friction = mix(a.restitution, b.restitution), mix(a.friction, b.friction)
        if a.material is not None and b.material is not None:
            pair = pairs.get(frozenset((a.material, b.material)))
            if pair is not None:
                restitution = restitution if pair.restitution is None else pair.restitution
                friction = friction if pair.friction is None else pair.friction
        return restitution, friction

    of_element = np.asarray([number(e) for e in bodies.elements], dtype=np.int64)
    of_fixed = np.asarray([number(f) for f in scene.fixed], dtype=np.int64)
    surfaces = tuple(numbers)
    both = np.asarray([[coefficients(a, b) for b in surfaces] for a in surfaces], dtype=np.float64)
    both = both.reshape(len(surfaces), len(surfaces), 2)
    return Surfaces(surfaces, of_element[bodies.element], of_fixed, both[..., 0], both[..., 1])
