"""Bodies of a scene as arrays, in scene order, and the start states of its elements.

Scene order is that of `Scene.kinds`: balls, then the balls of grids, scatters and emitters, then boxes and so on, each
in the order of the file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.paths import PathMotion
from sandbox.scene.description.base import GROUND, BodySource, BodySpec, Point
from sandbox.scene.description.bodies import Capsule
from sandbox.scene.description.discs import Ball, Disc
from sandbox.scene.description.generators import (
    DEFAULT_MASS,
    FAR_LIMB_COLOUR,
    NEAR_LIMB_COLOUR,
    Cloth,
    Ragdoll,
    Rope,
    segments,
)
from sandbox.scene.description.scene import SceneDescription, default_name
from sandbox.scene.description.surface import Spin
from sandbox.scene.geometry.shapes import Shapes, geometry_of, shapes_of
from sandbox.scene.geometry.vectors import rotate, to_world


@dataclass(frozen=True, eq=False)
class Layout:
    """Start state of n bodies."""

    position: FloatArray
    """(n, 2) m, centres of mass"""
    velocity: FloatArray
    """(n, 2) m/s"""
    angle: FloatArray
    """(n,) rad"""
    angular_velocity: FloatArray
    """(n,) rad/s"""
    fixed: BoolArray
    """(n,) never moves"""
    element: IntArray
    """(n,) index of each body's prototype within the element"""
    endings: tuple[str, ...] | None = None
    """suffix of each body's name; None if they are numbered from 1"""
    alone: bool = False
    """whether they do not collide with each other"""
    elements: int = 1
    """number of prototypes of the element"""
    roll: FloatArray | None = None
    """(n, 2) rad/s, angular velocity of spheres on a surface about x and y; None without rolling"""
    lifetime: FloatArray | None = None
    """(n,) s, lifetime of each; None if unlimited"""

    def __len__(self) -> int:
        return len(self.position)


NO_LAYOUT = Layout(
    position=np.empty((0, 2)),
    velocity=np.empty((0, 2)),
    angle=np.empty(0),
    angular_velocity=np.empty(0),
    fixed=np.empty(0, np.bool_),
    element=np.empty(0, np.int64),
    elements=0,
)
"""Start state of no bodies."""


def uniform_layout(
    position: FloatArray,
    velocity: FloatArray | Point,
    angle: FloatArray | float,
    spin: FloatArray | float,
    fixed: BoolArray | None = None,
) -> Layout:
    """Return the start state of n bodies of one prototype; fixed ones are at rest."""
    count = len(position)
    is_fixed = np.zeros(count, np.bool_) if fixed is None else fixed
    return Layout(
        position=position,
        velocity=np.where(is_fixed[:, None], 0.0, np.asarray(velocity, dtype=np.float64)),
        angle=np.broadcast_to(np.asarray(angle, dtype=np.float64), (count,)).copy(),
        angular_velocity=np.where(is_fixed, 0.0, np.asarray(spin, dtype=np.float64)),
        fixed=is_fixed,
        element=np.zeros(count, np.int64),
    )


def rotated(offset: FloatArray, angle: float) -> FloatArray:
    """Return offsets (n, 2) rotated by an angle."""
    x, y = offset.T
    return np.column_stack(rotate(x, y, np.cos(angle), np.sin(angle)))


SURFACE = (
    *("material", "restitution", "restitution_falloff", "friction", "rolling_resistance", "surface_speed", "colour"),
    *("collides", "categories", "mask", "layer"),
)
MOTION = ("gravity_scale", "linear_damping", "angular_damping", "max_speed", "max_angular_velocity")
"""Fields of how a body moves, which generators pass on to their prototypes, as `SURFACE`"""


def elements_of(source: BodySource) -> tuple[BodySource, ...]:
    """Return the prototypes of an element: itself, a rope's node or plank, a cloth's node, a ragdoll's segments."""
    match source:
        case Rope(kind="planks"):
            plank = Capsule(
                position=(0.0, 0.0), length=link_length(source), radius=source.radius, **_mass_and_surface(source)
            )
            return (plank,)
        case Rope() | Cloth():
            return (Ball(position=(0.0, 0.0), radius=source.radius, **_mass_and_surface(source)),)
        case Ragdoll():
            return _ragdoll_elements(source)
        case _:
            return (source,)


def elements_in(scene: SceneDescription) -> tuple[BodySource, ...]:
    """Return shape and material of the bodies of a scene, in scene order."""
    return tuple(element for source in scene.body_sources for element in elements_of(source))


def link_length(rope: Rope) -> float:
    """Return the rest length of a rope's links, m."""
    return (math.dist(rope.start, rope.end) if rope.length is None else rope.length) / rope.links


def _surface(source: BodySource) -> dict[str, Any]:
    return {key: getattr(source, key) for key in (*SURFACE, *MOTION)}


def _mass_and_surface(source: BodySource) -> dict[str, Any]:
    return {"mass": source.mass, "density": source.density, **_surface(source)}


@lru_cache(maxsize=256)
def _ragdoll_elements(ragdoll: Ragdoll) -> tuple[BodySource, ...]:
    """Return the segments of a ragdoll: capsules, and a ball as its head."""
    elements: list[BodySource] = []
    parts, height = segments(ragdoll), ragdoll.height
    far_side = next(iter(parts)).partition("-")[0]
    total_mass = DEFAULT_MASS if ragdoll.mass is None else ragdoll.mass
    for name, segment in parts.items():
        fields: dict[str, Any] = {
            "position": (0.0, 0.0),
            "radius": segment.radius * height,
            "mass": segment.mass_percent * 0.01 * total_mass,
        }
        fields |= _surface(ragdoll)
        if ragdoll.colour is None:
            fields["colour"] = FAR_LIMB_COLOUR if name.startswith(far_side) else NEAR_LIMB_COLOUR
        if len(segment.ends) == 1:
            elements.append(Ball(**fields))
        else:
            elements.append(Capsule(length=math.dist(*segment.ends) * height, **fields))
    return tuple(elements)


STATE = ("position", "velocity", "angle", "angular_velocity")
FORM = ("radius", "core", "thin", "mass", "moment")
COLUMNS = (*STATE, *FORM, "fixed", "group", "born", "lifetime", "roll", "layer", "visits")

FIRST_NAMED_GROUP = 2**20
"""Number of the first group that is named in a scene; ragdolls have lower ones."""

SPHERE_MOMENT_RATIO = 0.8
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
    """(N, Z) state of each body in each zone: `AWAY`, `INSIDE`, `HELD` or `RELEASED`"""
    element: IntArray
    """(N,) index into `elements`"""
    elements: tuple[BodySource, ...]
    """shape and material of the bodies, in scene order"""
    spheres: bool = False
    """whether balls are spheres, as on a surface, and not discs"""
    layers: tuple[str, ...] = (GROUND,)
    """collision layers of the scene"""
    groups: tuple[str, ...] = ()
    """names of groups; bodies of the k-th are in the group `FIRST_NAMED_GROUP + k`"""

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

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
    def kinematic(self) -> BoolArray:
        """(N,) whether each moves at its velocity and angular velocity, which no collision or force changes."""
        return np.asarray([isinstance(e, BodySpec) and e.kinematic for e in self.elements], np.bool_)[self.element]

    @cached_property
    def paths(self) -> dict[int, PathMotion]:
        """Motion of each body with a path, by its index."""
        with_path = {k: e for k, e in enumerate(self.elements) if isinstance(e, BodySpec) and e.path is not None}
        if not with_path:
            return {}
        motions = {k: PathMotion(single) for k, single in with_path.items()}
        elements = self.element.tolist()
        return {n: motions[element] for n, element in enumerate(elements) if element in motions}

    @cached_property
    def one_way(self) -> dict[int, Point]:
        """Direction in its frame from which each one-way body is solid, of length 1, by its index."""
        directions: dict[int, Point] = {}
        for k, each in enumerate(self.elements):
            if isinstance(each, BodySpec) and each.one_way is not None:
                x, y = each.one_way
                length = math.hypot(x, y)
                directions[k] = x / length, y / length
        if not directions:
            return {}
        return {n: directions[element] for n, element in enumerate(self.element.tolist()) if element in directions}

    @cached_property
    def lift(self) -> FloatArray:
        """(N,) lift coefficient of each: s of the acceleration s ω ẑ × w."""
        each = [e.lift if isinstance(e, BodySpec) else 0.0 for e in self.elements]
        return np.asarray(each, dtype=np.float64)[self.element]

    @cached_property
    def gravity_scale(self) -> FloatArray:
        """(N,) factor of the gravity that acts on each; 1 for immovable bodies."""
        return self._of_movable([e.gravity_scale for e in self.elements], 1.0)

    @cached_property
    def scales_gravity(self) -> bool:
        """Whether gravity acts on a body by another factor than 1."""
        return bool((self.gravity_scale != 1.0).any())

    @cached_property
    def largest_gravity_scale(self) -> float:
        """Largest factor, without its sign, of the gravity that acts on a movable body; 1 without such bodies."""
        movable = ~self.immovable
        return float(np.abs(self.gravity_scale[movable]).max()) if movable.any() else 1.0

    @cached_property
    def linear_damping(self) -> FloatArray:
        """(N,) 1/s, rate of the own damping of each velocity; 0 for immovable bodies."""
        return self._of_movable([e.linear_damping for e in self.elements], 0.0)

    @cached_property
    def angular_damping(self) -> FloatArray:
        """(N,) 1/s, rate of the own damping of each angular velocity; 0 for immovable bodies."""
        return self._of_movable([e.angular_damping for e in self.elements], 0.0)

    @cached_property
    def max_speed(self) -> FloatArray:
        """(N,) m/s, largest speed of each; inf if it is unlimited."""
        return self._of_movable([math.inf if e.max_speed is None else e.max_speed for e in self.elements], math.inf)

    @cached_property
    def max_angular_velocity(self) -> FloatArray:
        """(N,) rad/s, largest angular speed of each; inf if it is unlimited."""
        limits = [math.inf if e.max_angular_velocity is None else e.max_angular_velocity for e in self.elements]
        return self._of_movable(limits, math.inf)

    @cached_property
    def limited(self) -> BoolArray:
        """(N,) whether the speed or the angular speed of each is limited."""
        return np.asarray(np.isfinite(np.minimum(self.max_speed, self.max_angular_velocity)))

    def _of_movable(self, of_element: list[float], of_immovable: float) -> FloatArray:
        """Return the value of each body (N,), from that of each element."""
        values = np.asarray(of_element, np.float64)[self.element]
        return np.where(self.immovable, of_immovable, values)

    @cached_property
    def immovable(self) -> BoolArray:
        """(N,) whether nothing can push each: it is fixed or kinematic."""
        return self.fixed | self.kinematic

    @cached_property
    def all_round(self) -> bool:
        """Whether all bodies are single discs about their centres of mass."""
        return bool(self.round.all())

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
        layouts, zones = [layout_of_singles([single])], self.visits.shape[1]
        added = join_layouts([name], (single,), layouts, self.spheres, self.layers, zones, self.groups)
        columns = {key: np.concatenate((getattr(self, key), getattr(added, key))) for key in COLUMNS}
        element = np.append(self.element, len(self.elements))
        elements = (*self.elements, single)
        return Bodies(
            names=(*self.names, name),
            element=element,
            elements=elements,
            spheres=self.spheres,
            layers=self.layers,
            groups=added.groups,
            **columns,
        )

    def some(self, which: IntArray) -> "Bodies":
        """Return a selection of these bodies, with new indices."""
        names = self.names if len(which) == len(self) else tuple(self.names[n] for n in which.tolist())
        columns = {key: getattr(self, key)[which] for key in COLUMNS}
        return replace(self, names=names, element=self.element[which], **columns)


def centre_of(single: BodySpec) -> Point:
    """Return the start position of a body's centre of mass, m."""
    centre = geometry_of(single).centre
    if not any(centre):
        return single.position
    return to_world(centre, math.cos(single.angle), math.sin(single.angle), single.position)


def start_pose(single: BodySpec) -> tuple[Point, float]:
    """Return the position of a body's centre of mass, m, and its angle, rad, at time 0."""
    if single.path is None:
        return centre_of(single), single.angle
    pose = PathMotion(single).pose(0.0)
    return (pose.x, pose.y), pose.angle


def layout_of_singles(singles: list[BodySpec]) -> Layout:
    """Return the start state of single bodies, each with its own prototype."""
    poses = [start_pose(each) for each in singles]
    spins = [(0.0, 0.0, 0.0) if each.fixed else _spin(each) for each in singles]
    return Layout(
        position=_rows([position for position, _ in poses]),
        velocity=_rows([(0.0, 0.0) if each.fixed else each.velocity for each in singles]),
        angle=np.asarray([angle for _, angle in poses], dtype=np.float64),
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
    groups: tuple[str, ...] = (),
) -> Bodies:
    """Concatenate layouts; each has as many elements as its bodies refer to. `groups` are known already."""
    layouts = [*layouts, NO_LAYOUT]
    used = np.cumsum([0, *(each.elements for each in layouts)])
    element = np.concatenate([each.element + first for each, first in zip(layouts, used.tolist(), strict=False)])
    alone = np.cumsum([each.alone for each in layouts])
    group = np.concatenate(
        [np.full(len(each), number if each.alone else 0) for each, number in zip(layouts, alone, strict=True)]
    )
    named = [each.group if isinstance(each, BodySpec) else None for each in elements]
    groups = tuple(dict.fromkeys((*groups, *(name for name in named if name is not None))))
    if groups:
        number = np.asarray([0 if name is None else FIRST_NAMED_GROUP + groups.index(name) for name in named], np.int64)
        group = np.where(number[element] > 0, number[element], group)
    lives = [np.full(len(each), np.inf) if each.lifetime is None else each.lifetime for each in layouts]
    rolls = [np.zeros((len(each), 2)) if each.roll is None else each.roll for each in layouts]
    shapes = [geometry_of(each) for each in elements]
    of_sphere = [SPHERE_MOMENT_RATIO if spheres and isinstance(each, Disc) else 1.0 for each in elements]

    def of_element(values: list[float]) -> FloatArray:
        return np.asarray(np.asarray(values, dtype=np.float64)[element])

    return Bodies(
        names=tuple(names),
        # −0.0 becomes 0.0: a document without default values would not keep its sign, and a replay would end in
        # another state, bit for bit.
        **{key: np.concatenate([getattr(each, key) for each in layouts]) + 0.0 for key in STATE},
        fixed=np.concatenate([each.fixed for each in layouts]),
        radius=of_element([shape.bounding_radius for shape in shapes]),
        core=of_element([shape.inner_radius for shape in shapes]),
        thin=of_element([shape.half_width for shape in shapes]),
        mass=of_element([shape.mass for shape in shapes]),
        moment=of_element([shape.moment * fraction for shape, fraction in zip(shapes, of_sphere, strict=True)]),
        group=group,
        born=np.zeros(len(names)),
        lifetime=np.concatenate(lives),
        roll=np.concatenate(rolls) + 0.0,
        layer=np.asarray([layers.index(each.layer) for each in elements], dtype=np.int64)[element],
        visits=np.zeros((len(names), zones), dtype=np.int64),
        element=element,
        elements=elements,
        spheres=spheres,
        layers=layers,
        groups=groups,
    )


def _rows(pairs: list[tuple[float, float]]) -> FloatArray:
    return np.asarray(pairs, dtype=np.float64).reshape(-1, 2)
