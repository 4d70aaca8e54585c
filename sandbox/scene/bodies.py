"""Bodies: everything in a scene that has a number, as arrays in scene order.

Scene order is that of `Scene.kinds`: balls, then the balls of grids, scatters and emitters, then boxes and so on, each
in the order of the file.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.scene.discs import Disc, Emitter, Grid, Scatter
from sandbox.scene.generators import expand as expand_generator
from sandbox.scene.generators import size
from sandbox.scene.model import Scene, default_name
from sandbox.scene.near import BoolArray, FloatArray, IntArray
from sandbox.scene.part import Point
from sandbox.scene.shapes import Shapes, form_of, shapes_of
from sandbox.scene.surfaced import Mover, Single

COLUMNS = ("position", "velocity", "angle", "angular_velocity", "radius", "core", "thin", "mass", "moment", "fixed")


@dataclass(frozen=True, eq=False)
class Bodies:
    """The bodies of a scene at its start; N of them, from `elements` of the file."""

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
    element: IntArray
    """(N,) index into `elements`"""
    elements: tuple[Mover, ...]
    """What the bodies look like and are made of, in scene order."""

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

    def joined_by(self, single: Single, name: str) -> "Bodies":
        """Return these bodies and one more, which gets the next number."""
        speed = (0.0, 0.0) if single.fixed else single.velocity
        more = _laid_out([name], [single], [1], _rows([centre_of(single)]), _rows([speed]))
        both = {key: np.concatenate((getattr(self, key), getattr(more, key))) for key in COLUMNS}
        element = np.append(self.element, len(self.elements))
        return Bodies(names=(*self.names, name), element=element, elements=(*self.elements, single), **both)

    def some(self, which: IntArray) -> "Bodies":
        """Return some of them, numbered anew."""
        names = self.names if len(which) == len(self) else tuple(self.names[n] for n in which.tolist())
        columns = {key: getattr(self, key)[which] for key in COLUMNS}
        return Bodies(names=names, element=self.element[which], elements=self.elements, **columns)


def mass_of(element: Mover) -> float:
    """Return the mass of one body of an element in kg: stated, or from its density, or 1."""
    return form_of(element).mass


def expand(scene: Scene) -> Bodies:
    """Number the bodies of a scene and lay out their starting state.

    Raises:
        GeneratorError: a generator's balls do not fit.
        OutlineError: an outline cannot be cut into convex pieces.
    """
    names: list[str] = []
    elements: list[Mover] = []
    counts: list[int] = []
    position, velocity = [np.empty((0, 2))], [np.empty((0, 2))]
    for kind, those in scene.kinds.items():
        singles = [each for each in those if isinstance(each, Single)]
        position.append(_rows([centre_of(each) for each in singles]))
        velocity.append(_rows([(0.0, 0.0) if each.fixed else each.velocity for each in singles]))
        for k, each in enumerate(those):
            stem, count = each.name or default_name(kind, k), 1
            if isinstance(each, Grid | Scatter | Emitter):
                count = size(each)
                places, speeds = expand_generator(each, scene.world.seed, k)
                position.append(places)
                velocity.append(speeds)
            names += [stem] if isinstance(each, Single) else [f"{stem}-{n}" for n in range(1, count + 1)]
            elements.append(each)
            counts.append(count)
    return _laid_out(names, elements, counts, np.concatenate(position), np.concatenate(velocity))


def centre_of(single: Single) -> Point:
    """Return where a body's centre of mass starts, m."""
    (x, y), (dx, dy) = single.position, form_of(single).centre
    if not (dx or dy):
        return single.position
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    return x + cos * dx - sin * dy, y + sin * dx + cos * dy


def _laid_out(
    names: list[str], elements: list[Mover], counts: list[int], position: FloatArray, velocity: FloatArray
) -> Bodies:
    def each(values: list[float]) -> FloatArray:
        return np.repeat(np.asarray(values, dtype=np.float64), counts)

    fixed = [isinstance(e, Single) and e.fixed for e in elements]
    forms = [form_of(e) for e in elements]
    return Bodies(
        names=tuple(names),
        position=position,
        velocity=velocity,
        angle=each([e.angle for e in elements]),
        angular_velocity=each([0.0 if still else e.angular_velocity for e, still in zip(elements, fixed, strict=True)]),
        radius=each([form.reach for form in forms]),
        core=each([form.core for form in forms]),
        thin=each([form.thin for form in forms]),
        mass=each([form.mass for form in forms]),
        moment=each([form.moment for form in forms]),
        fixed=np.repeat(np.asarray(fixed, dtype=np.bool_), counts),
        element=np.repeat(np.arange(len(elements)), counts),
        elements=tuple(elements),
    )


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
