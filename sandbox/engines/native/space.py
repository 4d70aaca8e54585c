"""Assembly: the pymunk objects that a scene demands, and none that it does not.

Every library default that matters is stated here. Each fixed thing gets a static body of its own, so that a contact
tells by its bodies alone who touched.
"""

import math
from collections.abc import Iterator
from functools import cache

import numpy as np
import pymunk

from sandbox.engines.fixtures import wall_segments
from sandbox.engines.native.coefficients import factors, wrong_pairs
from sandbox.engines.native.drag import is_dragged
from sandbox.engines.native.gates import Gates
from sandbox.engines.native.laws import Laws
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import Meetings
from sandbox.scene.model import Collides, Plane, Post, Scene, Wall
from sandbox.scene.near import BoolArray, FloatArray
from sandbox.scene.part import BACKING, Point
from sandbox.scene.settings import Settings

FIXED, LOOSE, SOLITARY = 0b001, 0b010, 0b100
"""Collision categories: what never moves, bodies that meet everything, bodies that meet only what is fixed."""

KINDS = 3
"""how many of these there are on each layer: the bits of layer k are theirs, shifted by 3·k"""

SHORTEST_REACH, LONGEST_REACH = 5e3, 5e6
"""m; pymunk's half-planes are segments, whose noise grows with their length: 3e-13 m at a reach of 5e3, and a
thousand times as much at 5e6."""


def new_space(scene: Scene, settings: Settings) -> pymunk.Space:
    """Return an empty space with every parameter stated. `settings` must be resolved."""
    assert settings.slop is not None and settings.bias is not None and settings.persistence is not None
    space = pymunk.Space(threaded=False)  # two threads are not repeatable
    space.gravity = gravity_of(scene)
    space.damping = 1.0  # drag is `drag.py`'s: pymunk's damping would slow spins too, and know no wind
    space.iterations = settings.iterations
    space.collision_slop = settings.slop
    space.collision_bias = settings.bias
    space.collision_persistence = settings.persistence
    space.sleep_time_threshold = math.inf  # a sleeping pile would be another model
    space.idle_speed_threshold = 0.0
    return space


def gravity_of(scene: Scene) -> tuple[float, float]:
    """Return the gravity that the space itself applies: with drag none, the drag's force holds it then."""
    return (0.0, 0.0) if is_dragged(scene.world) else scene.world.gravity


@cache
def category(fixed: bool, collides: Collides, group: int = 0, layers: int = 1) -> pymunk.ShapeFilter:
    """Return the filter of what is on some layers, as bits; those of one group other than 0 pass through each other."""
    if fixed:
        own, others = FIXED, LOOSE | SOLITARY if collides == "all" else 0
    elif collides == "all":
        own, others = LOOSE, FIXED | LOOSE
    else:
        own, others = SOLITARY, FIXED
    each = sum(1 << KINDS * k for k in range(layers.bit_length()) if layers >> k & 1)
    return pymunk.ShapeFilter(group, categories=own * each, mask=others * each)


def reach_of(starts: FloatArray) -> tuple[FloatArray, float]:
    """Return the centre (2,) of where bodies start, (N, 2) m, and how far from it half-planes reach at first, m.

    The reach follows from places alone, never from the length of the run: contact normals are rounded by it, and a
    shorter run has to be the beginning of a longer one, bit for bit. `Ground.extend` lengthens it for those that stray.
    """
    if not len(starts):
        return np.zeros(2), SHORTEST_REACH
    low, high = starts.min(axis=0), starts.max(axis=0)
    return (low + high) / 2.0, float(np.clip(2.0 * (high - low).max(), SHORTEST_REACH, LONGEST_REACH))


def fixed_shapes(
    thing: Plane | Wall | Post, body: pymunk.Body, centre: FloatArray, reach: float
) -> Iterator[pymunk.Shape]:
    """Yield the shapes of a fixed thing."""
    if isinstance(thing, Plane):
        yield _half_plane(thing, body, centre, reach)
    elif isinstance(thing, Wall):
        for part in wall_segments(thing):
            segment = pymunk.Segment(body, part.a, part.b, thing.thickness / 2.0)
            segment.set_neighbors(part.before or part.a, part.after or part.b)
            yield segment
    else:
        yield pymunk.Circle(body, thing.radius, thing.position)


def body_shapes(
    body: pymunk.Body, bodies: Bodies, number: int, skin: float = 0.0
) -> Iterator[tuple[int, pymunk.Shape]]:
    """Yield the shapes of a body with the number of each among all pieces of all bodies; lone discs with a skin."""
    if bodies.round.all():
        yield number, pymunk.Circle(body, float(bodies.radius[number]) * (1.0 + skin))
        return
    shapes = bodies.shapes
    first, last = np.searchsorted(shapes.body, (number, number + 1)).tolist()
    for piece in range(first, last):
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]].tolist()
        radius = float(shapes.radius[piece])
        match len(corners):
            case 1:
                yield piece, pymunk.Circle(body, radius, corners[0])
            case 2:
                yield piece, pymunk.Segment(body, corners[0], corners[1], radius)
            case _:
                yield piece, pymunk.Poly(body, corners, radius=radius)


def _half_plane(plane: Plane, body: pymunk.Body, centre: FloatArray, reach: float) -> pymunk.Segment:
    """Return a long segment, as thick as a plane's backing is deep, sunk until its face is the plane."""
    a, b = half_plane_ends(plane, centre, reach)
    return pymunk.Segment(body, a, b, BACKING)


def half_plane_ends(plane: Plane, centre: FloatArray, reach: float) -> tuple[Point, Point]:
    """Return the ends of the segment that stands for a half-plane, m: twice its reach to both sides.

    Its middle lies below `centre`, so its ends are out of reach however far off the plane's own point is.
    """
    normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
    along = np.array([-normal[1], normal[0]])
    point = np.asarray(plane.point)
    middle = point + along * float((centre - point) @ along) - normal * BACKING
    a, b = middle - along * 2.0 * reach, middle + along * 2.0 * reach
    return (float(a[0]), float(a[1])), (float(b[0]), float(b[1]))


class SurfaceSetter:
    """Gives shapes their elasticity and friction, so that every pair has exactly its own coefficients."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self.gates = Gates(space, h)
        """walls that let pass from one side"""
        self.laws = Laws(space, self.gates)
        """what no factors can serve"""
        self._elasticity: list[float] = []
        self._friction: list[float] = []

    def renew(self, meet: Meetings, jointed: set[int]) -> None:
        """Work out each surface's factors, and laws for the pairs that no factors can serve.

        Args:
            meet: what meets what.
            jointed: surfaces of walls of several segments.
        """
        surfaces, touching = meet.surfaces, meet.touching
        stated = [(s.restitution, s.friction) for s in surfaces.surfaces]
        self._elasticity = factors(surfaces.restitution, touching, [e for e, _ in stated])
        self._friction = factors(surfaces.friction, touching, [mu for _, mu in stated])
        wrong = {
            *wrong_pairs(surfaces.restitution, touching, self._elasticity),
            *wrong_pairs(surfaces.friction, touching, self._friction),
            *_pairs(touching & ~(surfaces.fixed_coefficients & ~(surfaces.one_way | surfaces.one_way[:, None]))),
        }
        solid = meet.solid
        mended = {(a, b) for a, b in _pairs(touching) if (a in jointed and solid[b]) or (b in jointed and solid[a])}
        self.laws.renew(surfaces, wrong, mended)
        if surfaces.one_way.any():
            self.gates.renew(surfaces, touching)

    def dress(self, shape: pymunk.Shape, surface: int) -> None:
        """Give a shape its surface."""
        shape.elasticity = self._elasticity[surface]
        shape.friction = self._friction[surface]
        shape.collision_type = surface + 1  # 0 is what pymunk gives to shapes of no type


def _pairs(which: BoolArray) -> list[tuple[int, int]]:
    """Return the pairs a ≤ b of which something holds, of a symmetric (S, S)."""
    return [(a, b) for a, b in np.argwhere(np.triu(which)).tolist()]
