"""Bodies of a scene as arrays, in scene order.

Scene order is that of `Scene.kinds`: balls, then the balls of grids, scatters and emitters, then boxes and so on, each
in the order of the file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.layout import NO_LAYOUT, Layout
from sandbox.scene.description.base import GROUND, BodySource, BodySpec, Point
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.description.scene import default_name
from sandbox.scene.description.surface import Spin
from sandbox.scene.geometry.shapes import Shapes, form_of, shapes_of

STATE = ("position", "velocity", "angle", "angular_velocity")
FORM = ("radius", "core", "thin", "mass", "moment")
COLUMNS = (*STATE, *FORM, "fixed", "group", "born", "lifetime", "roll", "layer", "visits")

OF_SPHERE = 0.8
"""Moment of inertia of a sphere, ⅖ m r², relative to that of a disc, ½ m r²."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """N bodies of a scene at its start."""

    names: tuple[str, ...]
    position: FloatArray
    """(N, 2) m, centres of mass"""
    velocity: FloatArray
    """(N, 2) m/s"""
    angle: FloatArray
    """(N,) rad"""
    angular_velocity: FloatArray
    """(N,) rad/s"""
    radius: FloatArray
    """(N,) m, distance from the centre of mass to the farthest point"""
    core: FloatArray
    """(N,) radius of the largest disc about the centre of mass inside the body, m; of a disc its radius"""
    thin: FloatArray
    """(N,) half the smallest width of the thinnest piece, m; of a disc its radius"""
    mass: FloatArray
    """(N,) kg; also for fixed bodies"""
    moment: FloatArray
    """(N,) moment of inertia about the centre of mass, kg·m²"""
    fixed: BoolArray
    """(N,) never moves"""
    group: IntArray
    """(N,) bodies of one group do not collide, such as the limbs of a ragdoll; 0 is no group"""
    born: FloatArray
    """(N,) s, start of its life"""
    lifetime: FloatArray
    """(N,) s, after which it is removed; inf if never"""
    roll: FloatArray
    """(N, 2) rad/s, angular velocity of spheres on a surface about x and y; `angular_velocity` is about z"""
    layer: IntArray
    """(N,) collision layer, as an index into `layers`"""
    visits: IntArray
    """(N, Z) state of each body in each zone: `AWAY`, `INSIDE`, `HELD` or `LET_GO`"""
    element: IntArray
    """(N,) index into `elements`"""
    elements: tuple[BodySource, ...]
    """shape and material of the bodies, in scene order"""
    spheres: bool = False
    """whether balls are spheres, as on a surface, and not discs"""
    layers: tuple[str, ...] = (GROUND,)
    """collision layers of the scene"""

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def number_of(self) -> dict[str, int]:
        """Index of each body by its name; of two of one name, that of the first."""
        return {name: k for k, name in reversed(list(enumerate(self.names)))}

    @cached_property
    def round(self) -> BoolArray:
        """(N,) whether each is a single disc about its centre of mass."""
        return np.asarray([isinstance(e, Disc) for e in self.elements], dtype=np.bool_)[self.element]

    @cached_property
    def shapes(self) -> Shapes:
        """Convex pieces of the bodies."""
        return shapes_of(self.element, self.elements)

    def new_name(self, kind: str, others: Sequence[str]) -> str:
        """Return an unused name for a new body of a kind."""
        taken, number = {*self.names, *others}, len(self)
        while (name := default_name(kind, number)) in taken:
            number += 1
        return name

    def joined_by(self, single: BodySpec, name: str) -> "Bodies":
        """Return these bodies with one more, which gets the next index."""
        more = join_layouts(
            [name], (single,), [layout_of_singles([single])], self.spheres, self.layers, self.visits.shape[1]
        )
        both = {key: np.concatenate((getattr(self, key), getattr(more, key))) for key in COLUMNS}
        element = np.append(self.element, len(self.elements))
        elements = (*self.elements, single)
        return Bodies(
            names=(*self.names, name),
            element=element,
            elements=elements,
            spheres=self.spheres,
            layers=self.layers,
            **both,
        )

    def some(self, which: IntArray) -> "Bodies":
        """Return a selection of these bodies, with new indices."""
        names = self.names if len(which) == len(self) else tuple(self.names[n] for n in which.tolist())
        columns = {key: getattr(self, key)[which] for key in COLUMNS}
        return replace(self, names=names, element=self.element[which], **columns)


def centre_of(single: BodySpec) -> Point:
    """Return the start position of a body's centre of mass, m."""
    (x, y), (dx, dy) = single.position, form_of(single).centre
    if not (dx or dy):
        return single.position
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    return x + cos * dx - sin * dy, y + sin * dx + cos * dy


def layout_of_singles(singles: list[BodySpec]) -> Layout:
    """Return the start state of bodies that are elements of their own."""
    spins = [(0.0, 0.0, 0.0) if each.fixed else _spin(each) for each in singles]
    return Layout(
        position=_rows([centre_of(each) for each in singles]),
        velocity=_rows([(0.0, 0.0) if each.fixed else each.velocity for each in singles]),
        angle=np.asarray([each.angle for each in singles], dtype=np.float64),
        angular_velocity=np.asarray([spin[2] for spin in spins], dtype=np.float64),
        fixed=np.asarray([each.fixed for each in singles], dtype=np.bool_),
        element=np.arange(len(singles)),
        elements=len(singles),
        roll=_rows([spin[:2] for spin in spins]),
    )


def _spin(single: BodySpec) -> Spin:
    """Return the initial angular velocity of a body, rad/s."""
    if isinstance(single, Ball) and single.spin is not None:
        return single.spin
    return 0.0, 0.0, single.angular_velocity


def join_layouts(
    names: list[str],
    elements: tuple[BodySource, ...],
    layouts: list[Layout],
    spheres: bool,
    layers: tuple[str, ...],
    zones: int,
) -> Bodies:
    """Concatenate layouts; each has as many elements as its bodies refer to."""
    layouts = [*layouts, NO_LAYOUT]
    used = np.cumsum([0, *(each.elements for each in layouts)])
    element = np.concatenate([each.element + first for each, first in zip(layouts, used.tolist(), strict=False)])
    alone = np.cumsum([each.alone for each in layouts])
    group = [np.full(len(each), number if each.alone else 0) for each, number in zip(layouts, alone, strict=True)]
    lives = [np.full(len(each), np.inf) if each.lifetime is None else each.lifetime for each in layouts]
    rolls = [np.zeros((len(each), 2)) if each.roll is None else each.roll for each in layouts]
    forms = [form_of(each) for each in elements]
    of_sphere = [OF_SPHERE if spheres and isinstance(each, Disc) else 1.0 for each in elements]

    def of_form(values: list[float]) -> FloatArray:
        return np.asarray(np.asarray(values, dtype=np.float64)[element])

    return Bodies(
        names=tuple(names),
        # −0.0 becomes 0.0: a document without default values would not keep its sign, and a replay would end in
        # another state, bit for bit.
        **{key: np.concatenate([getattr(each, key) for each in layouts]) + 0.0 for key in STATE},
        fixed=np.concatenate([each.fixed for each in layouts]),
        radius=of_form([form.reach for form in forms]),
        core=of_form([form.core for form in forms]),
        thin=of_form([form.thin for form in forms]),
        mass=of_form([form.mass for form in forms]),
        moment=of_form([form.moment * fraction for form, fraction in zip(forms, of_sphere, strict=True)]),
        group=np.concatenate(group),
        born=np.zeros(len(names)),
        lifetime=np.concatenate(lives),
        roll=np.concatenate(rolls) + 0.0,
        layer=np.asarray([layers.index(each.layer) for each in elements], dtype=np.int64)[element],
        visits=np.zeros((len(names), zones), dtype=np.int64),
        element=element,
        elements=elements,
        spheres=spheres,
        layers=layers,
    )


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
