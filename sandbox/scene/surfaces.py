"""Surfaces: what restitution and friction two things have when they touch, and what else their surfaces do.

Both belong to a *pair* of materials. The one place that states them is a `[[pair]]`; where a pair is not
listed, `mix` holds: a figure stated on one side of a contact holds for it, on both they multiply (pymunk's own
rule), on neither it is 0. A figure stated on a shape outranks its material's. So it is with how restitution falls with
speed, but that the figures of two sides add. What kicks, or lets pass from one side, is a thing of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.kick import Kick
from sandbox.scene.model import Mover, Post, Scene, Surfaced, Wall
from sandbox.scene.near import BoolArray, FloatArray, IntArray
from sandbox.scene.solids import Compound


class Surface(NamedTuple):
    """One side of a contact. The material is kept only where some `[[pair]]` names it."""

    material: str | None
    restitution: float | None
    friction: float | None
    falloff: float | None = None
    """s/m"""
    kick: Kick | None = None
    one_way: bool = False


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
    """(N,) surface number of each body; of one in pieces, that of the first"""
    of_shape: IntArray
    """(S,) surface number of each convex piece, as `Bodies.shapes` lists them"""
    of_fixed: IntArray
    """(F,) surface number of each fixed thing"""
    restitution: FloatArray
    """(S, S) of each pair, symmetric"""
    friction: FloatArray
    """(S, S) of each pair, symmetric"""
    falloff: FloatArray
    """(S, S) s/m, of each pair, symmetric"""

    @property
    def kicks(self) -> BoolArray:
        """(S,) which kick."""
        return np.asarray([surface.kick is not None for surface in self.surfaces], np.bool_)

    @property
    def one_way(self) -> BoolArray:
        """(S,) which let pass from one side."""
        return np.asarray([surface.one_way for surface in self.surfaces], np.bool_)

    @property
    def fixed_coefficients(self) -> BoolArray:
        """(S, S) which pairs part at one and the same share of any speed of approach."""
        return np.asarray((self.falloff == 0.0) & ~self.kicks & ~self.kicks[:, None])


def surfaces_of(scene: Scene, bodies: Bodies) -> Surfaces:
    """Number the distinct surfaces of a scene and work out the coefficients of every pair, O(S²).

    Raises:
        KeyError: a thing names a material that the scene does not declare.
    """
    surfaces, of_bearer = numbered(scene, bearers_of(bodies.elements))
    more, of_fixed = numbered(scene, scene.fixed, surfaces)
    surfaces = (*surfaces, *more)
    restitution, friction = _mixed([s.restitution for s in surfaces]), _mixed([s.friction for s in surfaces])
    falloff = np.add.outer(*[np.asarray([s.falloff or 0.0 for s in surfaces], dtype=np.float64)] * 2)
    bearers: dict[str | None, list[int]] = {}
    for number, surface in enumerate(surfaces):
        bearers.setdefault(surface.material, []).append(number)
    for pair in scene.pairs:
        first, second = (bearers.get(name, []) for name in pair.between)
        figures = (restitution, pair.restitution), (friction, pair.friction), (falloff, pair.restitution_falloff)
        for table, stated in figures:
            if stated is not None:
                table[np.ix_(first, second)] = table[np.ix_(second, first)] = stated
    counts = np.asarray([len(_bearers(element)) for element in bodies.elements], dtype=np.int64)
    begin = np.cumsum(counts) - counts
    of_body = of_bearer[begin[bodies.element]] if len(bodies) else np.empty(0, np.int64)
    of_shape = of_body
    if not bodies.round.all():
        shapes = bodies.shapes
        of_shape = of_bearer[begin[bodies.element[shapes.body]] + shapes.bearer]
    return Surfaces(surfaces, of_body, of_shape, of_fixed, restitution, friction, falloff)


def bearers_of(elements: Sequence[Mover]) -> list[Surfaced]:
    """Return what has the surfaces of elements, one after the other: an element itself, or each of its parts."""
    return [each for element in elements for each in _bearers(element)]


def _bearers(element: Mover) -> Sequence[Surfaced]:
    if not isinstance(element, Compound):
        return (element,)
    return [_dressed(part, element) for part in element.parts]


def _dressed(part: Surfaced, body: Surfaced) -> Surfaced:
    """Return a part with the surface of its body where it states none of its own; a material of its own is all its."""
    if part.material is not None:
        return part
    return Surfaced(
        material=body.material,
        restitution=body.restitution if part.restitution is None else part.restitution,
        restitution_falloff=body.restitution_falloff if part.restitution_falloff is None else part.restitution_falloff,
        friction=body.friction if part.friction is None else part.friction,
    )


def numbered(
    scene: Scene, things: Sequence[Surfaced], known: tuple[Surface, ...] = ()
) -> tuple[tuple[Surface, ...], IntArray]:
    """Return the distinct surfaces of things that are not known yet, and the number of each thing's, known first.

    Raises:
        KeyError: a thing names a material that the scene does not declare.
    """
    materials = {m.name: m for m in scene.materials}
    paired = {name for p in scene.pairs for name in p.between}
    numbers = {surface: k for k, surface in enumerate(known)}

    def number(thing: Surfaced) -> int:
        material = None if thing.material is None else materials[thing.material]
        restitution, friction, falloff = thing.restitution, thing.friction, thing.restitution_falloff
        if material is not None:
            restitution = material.restitution if restitution is None else restitution
            friction = material.friction if friction is None else friction
            falloff = material.restitution_falloff if falloff is None else falloff
        kept = thing.material if thing.material in paired else None
        kick = thing.kick if isinstance(thing, Wall | Post) else None
        one_way = isinstance(thing, Wall) and thing.one_way
        return numbers.setdefault(Surface(kept, restitution, friction, falloff, kick, one_way), len(numbers))

    of_thing = np.asarray([number(thing) for thing in things], dtype=np.int64)
    return tuple(numbers)[len(known) :], of_thing


def _mixed(stated: list[float | None]) -> FloatArray:
    """Return `mix` of every two of S figures, (S, S)."""
    table = np.asarray([[mix(a, b) for b in stated] for a in stated], dtype=np.float64)
    return table.reshape(len(stated), len(stated))
