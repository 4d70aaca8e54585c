"""The pymunk space, its static shapes, and the surface values and filters of all shapes.

Every library default that matters is set explicitly. Each static collider is a static body of its own, so that the
bodies of a contact identify the collider.

pymunk multiplies the coefficients of two shapes. So each surface gets factors such that the product of two factors is
the coefficient of the pair. Where no such factors exist, the remaining pairs are set contact by contact
(`PairCallbacks`).
"""

import math
from collections.abc import Iterator
from functools import cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
import pymunk

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.base import FARTHEST, FASTEST
from sandbox.engines.common.colliders import straightened, wall_segments
from sandbox.engines.common.collision_bits import bits_of_static
from sandbox.engines.common.pair_factors import factors, wrong_pairs
from sandbox.engines.common.restitution import segment_fractions
from sandbox.engines.forces.air import Air
from sandbox.engines.pymunk_adapter.callbacks import PairCallbacks, SpaceOneWayWalls
from sandbox.engines.pymunk_adapter.contact_names import is_captured
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BACKING, Point
from sandbox.scene.description.fixed import Plane, PlaneReach, Post, Wall
from sandbox.scene.description.world import Settings, World

SHORTEST_REACH, LONGEST_REACH = 5e3, 5e6
"""m; pymunk's half-planes are segments, whose rounding error grows with their length: 3e-13 m at a reach of 5e3, a
thousand times as much at 5e6"""


def new_space(scene: Scene, settings: Settings) -> pymunk.Space:
    """Return an empty space with every parameter set. `settings` must be resolved."""
    assert settings.slop is not None and settings.bias is not None and settings.persistence is not None
    space = pymunk.Space(threaded=False)  # with two threads, runs are not repeatable
    space.gravity = gravity_of(scene.world, Air.of(scene.world, scene.bodies))
    space.damping = scene.world.damping
    space.iterations = settings.iterations
    space.collision_slop = settings.slop
    space.collision_bias = settings.bias
    space.collision_persistence = settings.persistence
    space.sleep_time_threshold, space.idle_speed_threshold = math.inf, 0.0
    if settings.sleeping:
        assert settings.sleep_time is not None and settings.idle_speed is not None
        space.sleep_time_threshold, space.idle_speed_threshold = settings.sleep_time, settings.idle_speed
    return space


def skip_numbers(space: pymunk.Space, count: int) -> None:
    """Skip numbers of shapes, whose names of contacts could clash (`contact_names`)."""
    for _ in range(count):
        unused = pymunk.Circle(space.static_body, 1.0)
        space.add(unused)
        space.remove(unused)


def gravity_of(world: World, air: Air) -> tuple[float, float]:
    """Return the gravity of the space: 0 where air acts, whose forces then include gravity."""
    return (0.0, 0.0) if air.acts_by_force else world.gravity


@cache
def shape_filter(categories: int, mask: int, group: int = 0) -> pymunk.ShapeFilter:
    """Return the filter of shapes. Shapes of one group other than 0 do not collide."""
    return pymunk.ShapeFilter(group, categories=categories, mask=mask)


def reach_of(starts: FloatArray) -> tuple[FloatArray, float]:
    """Return the centre (2,) of start positions (N, 2), m, and the distance to which half-planes extend at first, m.

    The reach follows from positions only, never from the length of the run: it affects the rounding of contact normals,
    and a shorter run has to be the beginning of a longer one, bit for bit. `StaticShapes.extend` increases it for
    bodies that leave it.
    """
    if not len(starts):
        return np.zeros(2), SHORTEST_REACH
    low, high = starts.min(axis=0), starts.max(axis=0)
    return (low + high) / 2.0, float(np.clip(2.0 * (high - low).max(), SHORTEST_REACH, LONGEST_REACH))


def fixed_shapes(
    collider: Plane | Wall | Post, body: pymunk.Body, centre: FloatArray, reach: float
) -> Iterator[pymunk.Shape]:
    """Yield the shapes of a static collider."""
    if isinstance(collider, Plane):
        yield _half_plane(collider, body, centre, reach)
    elif isinstance(collider, Wall):
        for part in wall_segments(collider):
            segment = pymunk.Segment(body, part.a, part.b, collider.thickness / 2.0)
            segment.set_neighbors(part.before or part.a, part.after or part.b)
            yield segment
    else:
        yield pymunk.Circle(body, collider.radius, collider.position)


def body_shapes(body: pymunk.Body, bodies: Bodies, index: int) -> Iterator[tuple[int, pymunk.Shape]]:
    """Yield the shapes of a body, each with its index among all shapes."""
    if bodies.all_round:
        yield index, pymunk.Circle(body, float(bodies.radius[index]))
        return
    shapes, element = bodies.shapes, bodies.elements[bodies.element[index]]
    is_kept = is_captured(element)
    first, last = np.searchsorted(shapes.body, (index, index + 1)).tolist()
    for piece in range(first, last):
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]].tolist()
        radius = float(shapes.radius[piece])
        match len(corners):
            case 1:
                yield piece, pymunk.Circle(body, radius, corners[0])
            case 2:
                yield piece, pymunk.Segment(body, corners[0], corners[1], radius)
            case _:
                polygon = pymunk.Poly(body, corners, radius=radius)
                if is_kept:
                    polygon.unsafe_set_vertices(corners)
                yield piece, polygon


def _half_plane(plane: Plane, body: pymunk.Body, centre: FloatArray, reach: float) -> pymunk.Segment:
    """Return a long segment, as thick as a plane's backing is deep, sunk until its face is the plane."""
    a, b = half_plane_ends(plane, centre, reach)
    return pymunk.Segment(body, a, b, BACKING)


def half_plane_ends(plane: Plane, centre: FloatArray, reach: float) -> tuple[Point, Point]:
    """Return the ends of the segment that represents a half-plane, m: at twice its reach on both sides.

    Its middle lies below `centre`, so its ends are out of reach however far away the plane's point is.
    """
    normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
    along = np.array([-normal[1], normal[0]])
    point = np.asarray(plane.point)
    middle = point + along * float((centre - point) @ along) - normal * BACKING
    a, b = middle - along * 2.0 * reach, middle + along * 2.0 * reach
    return (float(a[0]), float(a[1])), (float(b[0]), float(b[1]))


class SurfaceFactors(NamedTuple):
    """Factors of S surfaces, by which pymunk computes the coefficients of their pairs."""

    elasticity: list[float]
    friction: list[float]
    unfactored: frozenset[tuple[int, int]]
    """pairs that no factors can represent"""


_KNOWN_FACTORS: "WeakKeyDictionary[ContactMatrix, SurfaceFactors]" = WeakKeyDictionary()
"""Factors of contact matrices, which do not change"""


def _surface_factors(matrix: ContactMatrix) -> SurfaceFactors:
    """Return the factors of each surface, and the pairs that no factors can represent."""
    known = _KNOWN_FACTORS.get(matrix)
    if known is not None:
        return known
    surfaces, touching = matrix.surfaces, matrix.touching
    elasticity = factors(surfaces.restitution, touching, [each.restitution for each in surfaces.surfaces])
    friction = factors(surfaces.friction, touching, [each.friction for each in surfaces.surfaces])
    unfactored = {
        *wrong_pairs(surfaces.restitution, touching, elasticity),
        *wrong_pairs(surfaces.friction, touching, friction),
        *_pairs(touching & ~(surfaces.fixed_coefficients & ~(surfaces.one_way | surfaces.one_way[:, None]))),
        *_pairs(touching & (surfaces.slip_target != 0.0) & (surfaces.friction > 0.0)),
    }
    known = _KNOWN_FACTORS[matrix] = SurfaceFactors(elasticity, friction, frozenset(unfactored))
    return known


class SurfaceSetter:
    """Sets elasticity, friction and surface velocity of shapes, so that every pair has exactly its coefficients."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self.one_way_walls = SpaceOneWayWalls(space, h)
        """one-way walls"""
        self.pair_callbacks = PairCallbacks(space, self.one_way_walls)
        """pairs that no factors can represent"""
        self._elasticity: list[float] = []
        self._friction: list[float] = []
        self._velocity: list[Point] = []
        self._has_velocity = False

    def rebuild(self, matrix: ContactMatrix, jointed: set[int]) -> None:
        """Compute the factors of each surface, and the callbacks of pairs that no factors can represent.

        Args:
            matrix: contact matrix.
            jointed: surfaces of walls of several segments.
        """
        surfaces, touching = matrix.surfaces, matrix.touching
        self._elasticity, self._friction, unfactored = _surface_factors(matrix)
        self._velocity = [each.velocity for each in surfaces.surfaces]
        self._has_velocity = self._has_velocity or any(map(any, self._velocity))
        solid = matrix.solid
        corrected = {(a, b) for a, b in _pairs(touching) if (a in jointed and solid[b]) or (b in jointed and solid[a])}
        self.pair_callbacks.rebuild(surfaces, set(unfactored), corrected)
        if surfaces.one_way.any():
            self.one_way_walls.rebuild(surfaces, touching)

    def set_surface(self, shape: pymunk.Shape, surface: int) -> None:
        """Set the surface of a shape. Values that it has already are not set, which would wake its body."""
        if shape.elasticity != self._elasticity[surface]:
            shape.elasticity = self._elasticity[surface]
        if shape.friction != self._friction[surface]:
            shape.friction = self._friction[surface]
        if self._has_velocity and shape.surface_velocity != self._velocity[surface]:
            shape.surface_velocity = self._velocity[surface]
        if shape.collision_type != surface + 1:
            shape.collision_type = surface + 1  # 0 is pymunk's default for shapes without a type


def _pairs(matrix: BoolArray) -> list[tuple[int, int]]:
    """Return the pairs a ≤ b for which a symmetric matrix (S, S) is true."""
    return [(a, b) for a, b in np.argwhere(np.triu(matrix)).tolist()]


SHUFFLED_FROM = 5_000
"""Shapes from which on they are added in random order: pymunk's tree takes 30 s for 40,000 in a sorted line."""


class StaticShapes:
    """Static colliders in a space, added when the first body joins."""

    def __init__(self, space: pymunk.Space, setter: SurfaceSetter) -> None:
        self._space, self._setter = space, setter
        self._colliders: list[tuple[pymunk.Body, list[pymunk.Shape]]] = []
        self.reach = math.inf
        """m, present extent of half-planes, from the middle of the scene"""
        self._planes: tuple[Plane, ...] = ()
        self._middle, self._limit = np.zeros(6), np.full(6, math.inf)
        self._is_created = False

    def create(self, scene: Scene, plane_reach: PlaneReach | None, bodies: Bodies, surface: IntArray) -> None:
        """Add the static colliders of a scene, once; `surface` (F,) are their surfaces."""
        if self._is_created:
            return
        self._is_created = True
        if plane_reach is None:
            centre, reach = reach_of(bodies.position[~bodies.fixed])
        else:  # resumed from a checkpoint: contacts keep their normals, bit for bit
            centre, reach = np.asarray(plane_reach[:2]), plane_reach[2]
        if scene.planes:
            self._middle[0:2], self.reach, self._planes = centre, reach, scene.planes
        all_shapes: list[pymunk.Shape] = []
        for collider, index in zip(scene.fixed, surface.tolist(), strict=True):
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            shapes = self._shapes(collider, body, centre, reach)
            for shape in shapes:
                shape.filter = shape_filter(*bits_of_static(scene, collider))
                self._setter.set_surface(shape, index)
            self._space.add(body)
            self._colliders.append((body, shapes))
            all_shapes += shapes
        for k in shuffled(len(all_shapes)):
            self._space.add(all_shapes[k])
        self._bound()

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes; None while there are none."""
        if not self._planes:
            return None
        x, y = self._middle[0:2].tolist()
        return x, y, self.reach

    def _bound(self) -> None:
        """Set the limits of `within` from the present reach."""
        max_distance = min(self.reach, FARTHEST)
        self._limit = np.array([max_distance, max_distance, math.inf, FASTEST, FASTEST, math.inf])

    def extend(self, position: FloatArray) -> None:
        """Extend the half-planes to positions (M, 2), m, at most to `LONGEST_REACH`.

        The reach is doubled as often as necessary, by the positions of bodies, so that it does not depend on when a run
        ends. A body that moves farther than the reach within one step can be beyond the ends, at twice the reach,
        before that.
        """
        distance = np.abs(position - self._middle[0:2])
        distance = distance[distance <= LONGEST_REACH]  # no half-plane can reach positions beyond, or nan
        if not len(distance) or distance.max() <= self.reach:
            return
        while self.reach < distance.max():
            self.reach = min(2.0 * self.reach, LONGEST_REACH)
        for plane, (_, shapes) in zip(self._planes, self._colliders, strict=False):  # planes come first
            for shape in shapes:
                assert isinstance(shape, pymunk.Segment)
                shape.unsafe_set_endpoints(*half_plane_ends(plane, self._middle[0:2], self.reach))
                self._space.reindex_shape(shape)
        self._bound()

    def _shapes(
        self, collider: Plane | Wall | Post, body: pymunk.Body, centre: FloatArray, reach: float
    ) -> list[pymunk.Shape]:
        """Return the shapes of a static collider, without filters and surfaces."""
        shapes = list(fixed_shapes(collider, body, centre, reach))
        if isinstance(collider, Wall) and collider.kick is not None:
            parts = segment_fractions(straightened(collider))
            self._setter.pair_callbacks.segment_fractions |= dict(zip(shapes, parts, strict=True))
        if isinstance(collider, Wall):
            joints = {
                shape: part for shape, part in zip(shapes, wall_segments(collider), strict=True) if any(part.joints)
            }
            self._setter.one_way_walls.joints |= joints
        if isinstance(collider, Wall) and collider.one_way:
            self._setter.one_way_walls.walls.update(shapes)
        return shapes

    def reshape(self, before: Scene, after: Scene) -> None:
        """Change the points of walls to those of another scene. `rebuild` must follow."""
        if not self._is_created or before.walls == after.walls:
            return
        first = len(before.planes)
        for index, (old, new) in enumerate(zip(before.walls, after.walls, strict=True), first):
            if old.points == new.points:
                continue
            body, shapes = self._colliders[index]
            self._space.remove(*shapes)
            for shape in shapes:
                self._setter.pair_callbacks.segment_fractions.pop(shape, None)
                self._setter.one_way_walls.joints.pop(shape, None)
                self._setter.one_way_walls.walls.discard(shape)
            shapes[:] = self._shapes(new, body, np.zeros(2), self.reach)  # centre and reach matter for planes only
            for k in shuffled(len(shapes)):
                self._space.add(shapes[k])

    def rebuild(self, scene: Scene, surface: IntArray) -> None:
        """Update the surfaces (F,) and filters of the static colliders."""
        for (_, shapes), collider, index in zip(self._colliders, scene.fixed, surface.tolist(), strict=False):
            chosen = shape_filter(*bits_of_static(scene, collider))
            for shape in shapes:
                self._setter.set_surface(shape, index)
                if shape.filter != chosen:
                    shape.filter = chosen

    @property
    def ids(self) -> dict[int, int]:
        """Index, −1 − k, of each static body by its id."""
        return {body.id: -1 - k for k, (body, _) in enumerate(self._colliders)}

    @property
    def has_several_shapes(self) -> bool:
        """Whether a collider has several shapes, so that a body can have several contacts with it."""
        return any(len(shapes) > 1 for _, shapes in self._colliders)

    def within(self, state: FloatArray) -> BoolArray:
        """Return which values of states (R, 6), x, y, angle, vx, vy, ω, are within bounds; nan is not."""
        return np.asarray(np.abs(state - self._middle) <= self._limit)

    @property
    def quick_bound(self) -> float:
        """Norm below which a state (R, 6) is within bounds, as a vector of numbers."""
        return (min(self.reach, FARTHEST, FASTEST) - float(np.hypot(*self._middle[0:2]))) * (1.0 - 1e-9)

    def reaches(self, position: FloatArray) -> bool:
        """Return whether half-planes can be extended to a position; always true without planes."""
        return math.isinf(self.reach) or bool((np.abs(position - self._middle[0:2]) <= LONGEST_REACH).all())


def jointed_surfaces(scene: Scene, surface: IntArray) -> set[int]:
    """Return the surfaces of walls of several segments; `surface` (F,) are those of the static colliders."""
    walls = zip(scene.walls, surface[len(scene.planes) :].tolist(), strict=False)
    return {index for wall, index in walls if len(wall.points) > 2}


def shuffled(count: int) -> list[int]:
    """Return the order in which to add a number of shapes to a space."""
    if count <= SHUFFLED_FROM:
        return list(range(count))
    return list(map(int, np.random.Generator(np.random.PCG64(0)).permutation(count)))
