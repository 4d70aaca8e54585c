"""Bodies: everything in a scene that has a number, as arrays in scene order.

Scene order is that of `Scene.kinds`: balls, then the balls of grids, scatters and emitters, then boxes and so on, each
in the order of the file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sandbox.scene.cue import Stroke, struck
from sandbox.scene.discs import Ball, Disc
from sandbox.scene.floor import Spin
from sandbox.scene.layout import NOBODY, Layout
from sandbox.scene.layouts import layout_of
from sandbox.scene.model import Scene, default_name
from sandbox.scene.near import BoolArray, FloatArray, IntArray
from sandbox.scene.part import Point
from sandbox.scene.shapes import Shapes, form_of, shapes_of
from sandbox.scene.surfaced import GROUND, Mover, Single

STATE = ("position", "velocity", "angle", "angular_velocity", "fixed")
COLUMNS = (*STATE, "radius", "core", "thin", "mass", "moment", "group", "born", "lifetime", "roll", "layer", "visits")

OF_SPHERE = 0.8
"""of the moment of inertia of a disc, ½ m r²: ⅖ m r²"""


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of a scene at its start; N of them."""

    names: tuple[str, ...]
    position: FloatArray
    """(N, 2) m, of the centres of mass"""
    velocity: FloatArray
    """(N, 2) m/s"""
    angle: FloatArray
    """(N,) rad"""
    angular_velocity: FloatArray
    """(N,) rad/s"""
    radius: FloatArray
    """(N,) from the centre of mass to the farthest point, m"""
    core: FloatArray
    """(N,) radius of the largest disc about the centre of mass inside the body, m; of a disc its radius"""
    thin: FloatArray
    """(N,) half the width of the thinnest piece where that is narrowest, m; of a disc its radius"""
    mass: FloatArray
    """(N,) kg; what a fixed body would weigh"""
    moment: FloatArray
    """(N,) of inertia about the centre of mass, kg·m²"""
    fixed: BoolArray
    """(N,) never moves"""
    group: IntArray
    """(N,) bodies of one group pass through each other, such as the limbs of a ragdoll; 0 is none"""
    born: FloatArray
    """(N,) s, when its life began"""
    lifetime: FloatArray
    """(N,) s, after which it is gone; inf for ever"""
    roll: FloatArray
    """(N, 2) rad/s, of spheres on a floor, about x and y; about z it is `angular_velocity`"""
    layer: IntArray
    """(N,) on which each is, as an index into `layers`"""
    visits: IntArray
    """(N, Z) in which zones each is, and how: `zone.AWAY`, `INSIDE`, `HELD` or `LET_GO`"""
    element: IntArray
    """(N,) index into `elements`"""
    elements: tuple[Mover, ...]
    """What the bodies look like and are made of, in scene order."""
    spheres: bool = False
    """whether balls are spheres, as on a floor, and not discs"""
    layers: tuple[str, ...] = (GROUND,)
    """the layers of the scene"""

    def __len__(self) -> int:
        return len(self.names)

    @cached_property
    def round(self) -> BoolArray:
        """(N,) which are lone discs about their centres."""
        return np.asarray([isinstance(e, Disc) for e in self.elements], dtype=np.bool_)[self.element]

    @cached_property
    def shapes(self) -> Shapes:
        """The convex pieces that the bodies consist of."""
        return shapes_of(self.element, self.elements)

    def new_name(self, kind: str, others: Sequence[str]) -> str:
        """Return a name for one more body of a kind, that nobody has, nor any of the others."""
        taken, number = {*self.names, *others}, len(self)
        while (name := default_name(kind, number)) in taken:
            number += 1
        return name

    def joined_by(self, single: Single, name: str) -> "Bodies":
        """Return these bodies and one more, which gets the next number."""
        more = _joined([name], (single,), [_singles([single])], self.spheres, self.layers, self.visits.shape[1])
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
        """Return some of them, numbered anew."""
        names = self.names if len(which) == len(self) else tuple(self.names[n] for n in which.tolist())
        columns = {key: getattr(self, key)[which] for key in COLUMNS}
        return replace(self, names=names, element=self.element[which], **columns)


def expand(scene: Scene) -> Bodies:
    """Number the bodies of a scene and lay out their starting state.

    Raises:
        GeneratorError: a generator's balls do not fit.
        OutlineError: an outline cannot be cut into convex pieces.
        ValueError: the scene was made by hand, and has a preset that nobody has written out.
    """
    if scene.billiards is not None:
        raise ValueError("its [billiards] is not written out; sandbox.scene.billiards.expanding.expanded does that")
    if scene.pinball is not None:
        raise ValueError("its [pinball] is not written out; sandbox.scene.pinball.expanding.expanded does that")
    names: list[str] = []
    layouts: list[Layout] = []
    for kind, those in scene.kinds.items():
        singles = [each for each in those if isinstance(each, Single)]
        if singles:
            layouts.append(_singles(singles))
            names += [each.name or default_name(kind, k) for k, each in enumerate(those)]
            continue
        for k, each in enumerate(those):
            layout, stem = layout_of(each, scene.world.seed, k, scene.world.gravity), each.name or default_name(kind, k)
            layouts.append(layout)
            names += [f"{stem}-{ending}" for ending in layout.endings or range(1, len(layout) + 1)]
    spheres = scene.surface is not None and scene.surface.bodies == "spheres"
    bodies = _joined(names, scene.elements, layouts, spheres, scene.layers, len(scene.zones))
    for shot in scene.shots:
        if shot.ball in names:
            strike(bodies, names.index(shot.ball), shot)
    if scene.drives:
        from sandbox.scene.driven import weighed  # which looks at bodies itself

        return weighed(scene, bodies)
    return bodies


def strike(bodies: Bodies, number: int, stroke: Stroke) -> None:
    """Give a sphere the velocity and spin of a stroke, in place."""
    velocity, spin = struck(stroke, float(bodies.mass[number]), float(bodies.radius[number]))
    bodies.velocity[number] = velocity
    bodies.roll[number], bodies.angular_velocity[number] = spin[:2], spin[2]


def centre_of(single: Single) -> Point:
    """Return where a body's centre of mass starts, m."""
    (x, y), (dx, dy) = single.position, form_of(single).centre
    if not (dx or dy):
        return single.position
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    return x + cos * dx - sin * dy, y + sin * dx + cos * dy


def _singles(singles: list[Single]) -> Layout:
    """Lay out bodies that each are an element of their own."""
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


def _spin(single: Single) -> Spin:
    """Return how a body starts to turn, rad/s."""
    if isinstance(single, Ball) and single.spin is not None:
        return single.spin
    return 0.0, 0.0, single.angular_velocity


def _joined(
    names: list[str],
    elements: tuple[Mover, ...],
    layouts: list[Layout],
    spheres: bool,
    layers: tuple[str, ...],
    zones: int,
) -> Bodies:
    """Put layouts one after the other; each has as many of the elements as its bodies are numbered by."""
    layouts = [*layouts, NOBODY]
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
        **{key: np.concatenate([getattr(each, key) for each in layouts]) for key in STATE},
        radius=of_form([form.reach for form in forms]),
        core=of_form([form.core for form in forms]),
        thin=of_form([form.thin for form in forms]),
        mass=of_form([form.mass for form in forms]),
        moment=of_form([form.moment * share for form, share in zip(forms, of_sphere, strict=True)]),
        group=np.concatenate(group),
        born=np.zeros(len(names)),
        lifetime=np.concatenate(lives),
        roll=np.concatenate(rolls),
        layer=np.asarray([layers.index(each.layer) for each in elements], dtype=np.int64)[element],
        visits=np.zeros((len(names), zones), dtype=np.int64),
        element=element,
        elements=elements,
        spheres=spheres,
        layers=layers,
    )


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
