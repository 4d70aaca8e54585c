"""Contact matrix: the pairs of bodies and colliders that can touch, and the coefficients of each pair of surfaces.

The contact matrix is derived from the scene by kind, without simulation. Bodies without possible contacts need no
shape; bodies that can touch only frictionless surfaces need no moment of inertia.

Restitution and friction belong to a *pair* of materials. A `[[pair]]` states them. For other pairs (`mix`) a value
stated on one side of a contact applies, values on both sides multiply (pymunk's rule), and the default is 0. A value
stated on a shape takes precedence over its material's. The same holds for the falloff of restitution with speed, except
that the values of two sides add. Surface speeds add as well: each surface runs clockwise around its object. Surface
velocities of two sides subtract: they are vectors of the world. Of two values of rolling resistance the larger applies
(Box2D's rule), as the softer side is deformed. Kicks and one-way walls belong to one side.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.filters import FilterTable, filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, HasMaterial, SurfaceVelocity
from sandbox.scene.description.bodies import Compound
from sandbox.scene.description.fixed import Plane, Post, Wall, mask_of
from sandbox.scene.description.world import Kick
from sandbox.scene.geometry.shapes import UNTURNABLE, geometry_of


class ContactMaterial(NamedTuple):
    """One side of a contact. The material is kept only if some `[[pair]]` names it."""

    material: str | None
    restitution: float | None
    friction: float | None
    falloff: float | None = None
    """s/m"""
    kick: Kick | None = None
    one_way: bool = False
    speed: float = 0.0
    """m/s"""
    velocity: SurfaceVelocity = (0.0, 0.0)
    """m/s"""
    rolling: float = 0.0


def mix(a: float | None, b: float | None) -> float:
    """Return the coefficient of a contact whose sides state `a` and `b`."""
    if a is None:
        return 0.0 if b is None else b
    return a if b is None else a * b


@dataclass(frozen=True, eq=False)
class PairTable:
    """The S distinct surfaces of a scene, and the surface of each body and collider."""

    surfaces: tuple[ContactMaterial, ...]
    of_body: IntArray
    """(N,) surface index of each body; of a compound, that of its first piece"""
    of_shape: IntArray
    """(S,) surface index of each convex piece, in the order of `Bodies.shapes`"""
    of_fixed: IntArray
    """(F,) surface index of each static collider"""
    restitution: FloatArray
    """(S, S) of each pair, symmetric"""
    friction: FloatArray
    """(S, S) of each pair, symmetric"""
    falloff: FloatArray
    """(S, S) s/m, of each pair, symmetric"""
    rolling: FloatArray
    """(S, S) rolling resistance of each pair, symmetric; it acts on balls"""
    slip_target: FloatArray
    """(S, S) m/s, of each pair, symmetric: velocity of the second body relative to the first, to the left of the normal
    towards the second, at which their surfaces do not slip; without that by surface velocities"""
    slip_velocity: FloatArray
    """(S, S, 2) m/s, of each pair, antisymmetric: velocity of the second body relative to the first, at which surface
    velocities alone do not slip. Its component to the left of the normal adds to `slip_target`"""

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

    @property
    def kicks(self) -> BoolArray:
        """(S,) whether each has a kick."""
        return np.asarray([surface.kick is not None for surface in self.surfaces], np.bool_)

    @property
    def one_way(self) -> BoolArray:
        """(S,) whether each belongs to a one-way wall or body."""
        return np.asarray([surface.one_way for surface in self.surfaces], np.bool_)

    @property
    def fixed_coefficients(self) -> BoolArray:
        """(S, S) whether the restitution of each pair is independent of speed."""
        return np.asarray((self.falloff == 0.0) & ~self.kicks & ~self.kicks[:, None])


def pair_table(scene: Scene, bodies: Bodies) -> PairTable:
    """Return the distinct surfaces of a scene and the coefficients of every pair, O(S²).

    Raises:
        KeyError: an element names a material that the scene does not declare.
    """
    surfaces, of_part = index_surfaces(scene, surface_parts(bodies.elements))
    more, of_fixed = index_surfaces(scene, scene.fixed, surfaces)
    surfaces = (*surfaces, *more)
    restitution, friction = _mix_pairs([s.restitution for s in surfaces]), _mix_pairs([s.friction for s in surfaces])
    falloff = np.add.outer(*[np.asarray([s.falloff or 0.0 for s in surfaces], dtype=np.float64)] * 2)
    rolling = np.maximum.outer(*[np.asarray([s.rolling for s in surfaces], dtype=np.float64)] * 2)
    speed = np.asarray([s.speed for s in surfaces], dtype=np.float64)
    slip_target = 0.0 - np.add.outer(speed, speed)  # without speeds +0, not −0
    velocity = np.asarray([s.velocity for s in surfaces], dtype=np.float64).reshape(-1, 2)
    slip_velocity = velocity[:, None] - velocity
    by_material: dict[str | None, list[int]] = {}
    for index, surface in enumerate(surfaces):
        by_material.setdefault(surface.material, []).append(index)
    for pair in scene.pairs:
        first, second = (by_material.get(name, []) for name in pair.between)
        coefficients = (
            (restitution, pair.restitution),
            (friction, pair.friction),
            (falloff, pair.restitution_falloff),
            (rolling, pair.rolling_resistance),
        )
        for table, stated in coefficients:
            if stated is not None:
                table[np.ix_(first, second)] = table[np.ix_(second, first)] = stated
    counts = np.asarray([len(_surface_parts(element)) for element in bodies.elements], dtype=np.int64)
    begin = np.cumsum(counts) - counts
    of_body = of_part[begin[bodies.element]] if len(bodies) else np.empty(0, np.int64)
    of_shape = of_body
    if not bodies.round.all():
        shapes = bodies.shapes
        of_shape = of_part[begin[bodies.element[shapes.body]] + shapes.part]
    tables = restitution, friction, falloff, rolling, slip_target, slip_velocity
    return PairTable(surfaces, of_body, of_shape, of_fixed, *tables)


def surface_parts(elements: Sequence[BodySource]) -> list[HasMaterial]:
    """Return the parts that have surfaces: each element itself, or each of its parts."""
    return [each for element in elements for each in _surface_parts(element)]


def _surface_parts(element: BodySource) -> Sequence[HasMaterial]:
    if not isinstance(element, Compound):
        return (element,)
    return [_with_body_surface(part, element) for part in element.parts]


def _with_body_surface(part: HasMaterial, body: HasMaterial) -> HasMaterial:
    """Return a part with the surface of its body where it states none; its own material replaces all of it."""
    if part.material is not None:
        return part
    return HasMaterial(
        material=body.material,
        restitution=body.restitution if part.restitution is None else part.restitution,
        restitution_falloff=body.restitution_falloff if part.restitution_falloff is None else part.restitution_falloff,
        friction=body.friction if part.friction is None else part.friction,
        rolling_resistance=body.rolling_resistance if part.rolling_resistance is None else part.rolling_resistance,
        surface_speed=part.surface_speed if "surface_speed" in part.model_fields_set else body.surface_speed,
        surface_velocity=(
            part.surface_velocity if "surface_velocity" in part.model_fields_set else body.surface_velocity
        ),
    )


def index_surfaces(
    scene: Scene, elements: Sequence[HasMaterial], known: tuple[ContactMaterial, ...] = ()
) -> tuple[tuple[ContactMaterial, ...], IntArray]:
    """Return the known surfaces followed by the new distinct ones, and the index of each element's surface.

    Raises:
        KeyError: an element names a material that the scene does not declare.
    """
    materials = {m.name: m for m in scene.materials}
    paired = {name for p in scene.pairs for name in p.between}
    index_by_surface = {surface: k for k, surface in enumerate(known)}

    def index_of(element: HasMaterial) -> int:
        material = None if element.material is None else materials[element.material]
        restitution, friction, falloff = element.restitution, element.friction, element.restitution_falloff
        rolling = element.rolling_resistance
        if material is not None:
            restitution = material.restitution if restitution is None else restitution
            friction = material.friction if friction is None else friction
            falloff = material.restitution_falloff if falloff is None else falloff
            rolling = material.rolling_resistance if rolling is None else rolling
        kept = element.material if element.material in paired else None
        kick = element.kick if isinstance(element, Wall | Post) else None
        one_way = (isinstance(element, Wall) and element.one_way) or (
            isinstance(element, BodySpec) and element.one_way is not None
        )
        surface = ContactMaterial(
            *(kept, restitution, friction, falloff, kick, one_way),
            *(element.surface_speed, element.surface_velocity, rolling or 0.0),
        )
        return index_by_surface.setdefault(surface, len(index_by_surface))

    of_element = np.asarray([index_of(element) for element in elements], dtype=np.int64)
    return tuple(index_by_surface)[len(known) :], of_element


def _mix_pairs(stated: list[float | None]) -> FloatArray:
    """Return `mix` of all pairs of S values, (S, S)."""
    table = np.asarray([[mix(a, b) for b in stated] for a in stated], dtype=np.float64)
    return table.reshape(len(stated), len(stated))


FIXED_KINDS = (Plane, Wall, Post)


@dataclass(frozen=True, eq=False)
class ContactMatrix:
    """Possible contacts of N bodies and F static colliders with S surfaces."""

    surfaces: PairTable
    touches: BoolArray
    """(N,) can touch something"""
    held: BoolArray
    """(N,) has a joint"""
    can_enter_zone: BoolArray
    """(N,) can enter a zone; driven bodies are not detected"""
    turnable: BoolArray
    """(N,) can change its spin: by friction or rolling resistance; for other shapes than balls by any contact; by
    joints, thrusts, tyres, drives, damping of its own or a liquid"""
    mutual: bool
    """whether two bodies can touch"""
    ball_ball: bool
    """whether two balls can touch"""
    solid: BoolArray
    """(S,) surfaces of pieces other than balls that can touch something"""
    ball_fixed: dict[type[Plane] | type[Wall] | type[Post], bool]
    """whether a ball can touch a plane, a wall, a post"""
    touching: BoolArray
    """(S, S) surfaces of which some pair can touch, symmetric"""

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

    @property
    def solids(self) -> bool:
        """Whether a body other than a ball can touch something."""
        return bool(self.solid.any())

    @property
    def free(self) -> BoolArray:
        """(N,) has no possible contact, enters no zone, and has no joint."""
        return ~self.touches & ~self.held & ~self.can_enter_zone

    @property
    def restitution(self) -> float:
        """Largest restitution of any possible contact."""
        return float(np.max(self.surfaces.restitution[self.touching], initial=0.0))

    @property
    def surfaces_with_speed(self) -> int:
        """Number of surfaces with a speed, and with friction against another that can touch them."""
        return self._count_rubbing([each.speed != 0.0 for each in self.surfaces.surfaces])

    @property
    def surfaces_with_velocity(self) -> int:
        """Number of surfaces with a velocity, and with friction against another that can touch them."""
        return self._count_rubbing([any(each.velocity) for each in self.surfaces.surfaces])

    @property
    def moving_surfaces(self) -> bool:
        """Whether a surface with friction against another that can touch it moves."""
        return self.surfaces_with_speed + self.surfaces_with_velocity > 0

    def _count_rubbing(self, wanted: list[bool]) -> int:
        """Return how many of the wanted (S,) surfaces have friction against another that can touch them."""
        rubs = (self.touching & (self.surfaces.friction > 0.0)).any(axis=1)
        return int(np.count_nonzero(np.asarray(wanted, np.bool_) & rubs))

    @property
    def friction(self) -> float:
        """Largest friction of any possible contact."""
        return float(np.max(self.surfaces.friction[self.touching], initial=0.0))

    @property
    def rolling(self) -> float:
        """Largest rolling resistance of any possible contact."""
        return float(np.max(self.surfaces.rolling[self.touching], initial=0.0))


class Kinds(NamedTuple):
    """The K distinct kinds of pieces; pieces of one kind have the same possible contacts."""

    surface: IntArray
    """(K,)"""
    fixed: BoolArray
    """(K,)"""
    kinematic: BoolArray
    """(K,)"""
    to_all: BoolArray
    """(K,) of bodies whose `collides` is `all`"""
    to_any: BoolArray
    """(K,) of bodies whose `collides` is not `none`"""
    layers: IntArray
    """(K,) bit mask of all layers that they can reach"""
    categories: IntArray
    """(K,) bit mask of the collision categories that they belong to"""
    mask: IntArray
    """(K,) bit mask of the collision categories that they collide with"""
    ball: BoolArray
    """(K,) is a single disc"""
    alone: BoolArray
    """(K,) all pieces belong to one body, which does not touch itself"""
    of_piece: IntArray
    """(S,) kind of each piece"""


def contact_matrix(start: Scene | Setup, bodies: Bodies | None = None) -> ContactMatrix:
    """Return the contact matrix: the possible collisions of bodies with each other and with static colliders.

    Args:
        start: scene or setup.
        bodies: bodies after some were added; default: those of `start`.
    """
    return _start_matrix(start) if bodies is None or bodies is start.bodies else _matrix(Setup.of(start), bodies)


@derived_once
def _start_matrix(setup: Setup) -> ContactMatrix:
    return _matrix(setup, setup.bodies)


def _matrix(setup: Setup, bodies: Bodies) -> ContactMatrix:
    """Derive the contact matrix of a setup with given bodies."""
    scene = setup.scene
    surfaces = pair_table(scene, bodies)
    filters = filter_table(scene, bodies)
    kinds = _kinds(bodies, surfaces, filters)
    surface, to_all = kinds.surface, kinds.to_all
    moving, static = ~kinds.fixed & kinds.to_any, kinds.fixed & kinds.to_any
    pushable = moving & ~kinds.kinematic
    pair = np.outer(moving & to_all, moving & to_all) & ~(np.eye(len(surface), dtype=bool) & kinds.alone)
    pair &= pushable[:, None] | pushable
    pair |= np.outer(pushable, static & to_all) | np.outer(static & to_all, pushable)
    pair &= (kinds.layers[:, None] & kinds.layers) != 0
    accepts = (kinds.categories[:, None] & kinds.mask) != 0
    pair &= accepts & accepts.T

    size = len(surfaces.surfaces)
    touching = np.zeros((size, size), dtype=bool)
    rows, columns = np.nonzero(pair)
    touching[surface[rows], surface[columns]] = True
    has_friction = (surfaces.friction > 0) | (surfaces.rolling > 0)
    ground = [
        (
            pushable & (kinds.layers & layers != 0) & (kinds.categories & mask != 0) & (kinds.mask & categories != 0),
            rows,
        )
        for (layers, categories, mask), rows in _equal_colliders(filters)
    ]
    can_touch: BoolArray = np.asarray(pair.any(axis=1))
    for able, _ in ground:
        can_touch |= able
    turned = np.asarray((pair & has_friction[np.ix_(surface, surface)]).any(axis=1)) | (can_touch & ~kinds.ball)

    for able, rows in ground:
        fixed_surface = np.unique(surfaces.of_fixed[rows])
        reaching = surface[able]
        touching[np.ix_(reaching, fixed_surface)] = True
        touching[np.ix_(fixed_surface, reaching)] = True
        turned |= able & has_friction[np.ix_(surface, fixed_surface)].any(axis=1)

    joints, body = setup.joints, _body_of_piece(bodies)
    turnable = _any_of(body, (turned & moving)[kinds.of_piece], len(bodies)) | joints.turned(len(bodies))
    return ContactMatrix(
        surfaces=surfaces,
        touches=_any_of(body, can_touch[kinds.of_piece], len(bodies)),
        held=joints.held(len(bodies)),
        can_enter_zone=_can_enter_zone(scene, bodies, filters.layers) & ~is_driven(scene, bodies),
        turnable=(
            turnable
            | _thrust_turned(scene, bodies)
            | is_driven(scene, bodies, turning=True)
            | (bodies.angular_damping > 0.0)
            | bool(scene.liquids)
        )
        & ~bodies.fixed
        & (bodies.moment < UNTURNABLE),
        mutual=bool(pair.any()),
        ball_ball=bool((pair & np.outer(kinds.ball, kinds.ball)).any()),
        solid=np.isin(np.arange(size), surface[can_touch & ~kinds.ball]),
        ball_fixed={
            kind: any(
                bool((able & kinds.ball).any()) and any(isinstance(scene.fixed[k], kind) for k in rows.tolist())
                for able, rows in ground
            )
            for kind in FIXED_KINDS
        },
        touching=touching,
    )


def _can_enter_zone(scene: Scene, bodies: Bodies, reached: IntArray) -> BoolArray:
    """Return which bodies zones can detect, (N,)."""
    if not scene.zones:
        return np.zeros(len(bodies), np.bool_)
    detectable = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.fixed
    zone_layers = 0
    for zone in scene.zones:
        zone_layers |= mask_of(zone.layers, scene.layers)
    still_inside = bodies.visits.any(axis=1)  # leaving a zone is detected after a change of layer too
    return np.asarray(detectable & ((reached & zone_layers != 0) | still_inside))


def _equal_colliders(filters: FilterTable) -> Iterator[tuple[tuple[int, int, int], IntArray]]:
    """Yield the layers, categories and masks of static colliders as bits, with the indices of those that have them."""
    distinct, row = _distinct_rows(filters.fixed_layers, filters.fixed_categories, filters.fixed_mask)
    for k, (layers, categories, mask) in enumerate(distinct.tolist()):
        yield (layers, categories, mask), np.flatnonzero(row == k)


def _distinct_rows(*columns: IntArray) -> tuple[IntArray, IntArray]:
    """Return the distinct rows of C columns (N,) as (K, C), and for each row the index of its equal, (N,)."""
    table = np.column_stack(columns)
    code = np.zeros(len(table), np.int64)
    if not (table[1:] != table[:-1]).any():  # in most scenes
        return table[:1], code
    for column in columns:  # much faster than sorting rows
        values, index = np.unique(column, return_inverse=True)
        code = code * len(values) + index.reshape(-1)
    _, first, row = np.unique(code, return_index=True, return_inverse=True)
    return table[first], row.reshape(-1)


def _kinds(bodies: Bodies, surfaces: PairTable, filters: FilterTable) -> Kinds:
    """Group pieces by (surface, layers, categories, mask, kinematic, ball, fixed, collides with all, with any)."""
    collides = [element.collides for element in bodies.elements]
    collides_with_all = np.asarray([c == "all" for c in collides], dtype=np.int64)[bodies.element]
    collides_with_any = np.asarray([c != "none" for c in collides], dtype=np.int64)[bodies.element]
    traits = (
        bodies.kinematic.astype(np.int64) << 4
        | bodies.round.astype(np.int64) << 3
        | bodies.fixed.astype(np.int64) << 2
        | collides_with_all << 1
        | collides_with_any
    )
    body = _body_of_piece(bodies)
    distinct, row = _distinct_rows(filters.layers, filters.categories, filters.mask)
    traits |= row << 5
    count = max(len(distinct), 1)
    code = surfaces.of_shape * (count << 5) + (traits if body is None else traits[body])
    counts = np.bincount(code if body is None else np.unique(np.column_stack((code, body)), axis=0)[:, 0])
    present = np.flatnonzero(counts)
    row_of = np.zeros(len(counts), np.int64)
    row_of[present] = np.arange(len(present))
    bits = [(present >> k & 1).astype(bool) for k in range(5)]
    layers, categories, mask = (distinct[(present >> 5) % count] if len(distinct) else distinct).T
    return Kinds(
        surface=(present >> 5) // count,
        layers=layers,
        categories=categories,
        mask=mask,
        fixed=bits[2],
        kinematic=bits[4],
        to_all=bits[1],
        to_any=bits[0],
        ball=bits[3],
        alone=counts[present] < 2,
        of_piece=row_of[code],
    )


def _body_of_piece(bodies: Bodies) -> IntArray | None:
    """Return the body of each piece; None if each body is one piece, as balls are."""
    return None if bodies.round.all() else bodies.shapes.body


def _any_of(body: IntArray | None, pieces: BoolArray, count: int) -> BoolArray:
    """Return which bodies have a piece with a property."""
    if body is None:
        return pieces
    found = np.zeros(count, dtype=np.bool_)
    found[body[pieces]] = True
    return found


def _thrust_turned(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies have a tyre, or a thrust that does not act through their centre of mass."""
    found = np.zeros(len(bodies), dtype=np.bool_)
    for thrust in scene.thrusts:
        if thrust.body in bodies.number_of:
            index = bodies.number_of[thrust.body]
            x, y = geometry_of(bodies.elements[bodies.element[index]]).centre
            found[index] |= (thrust.point[0] - x) * thrust.force[1] != (thrust.point[1] - y) * thrust.force[0]
    found[[bodies.number_of[tyre.body] for tyre in scene.tyres if tyre.body in bodies.number_of]] = True
    return found
