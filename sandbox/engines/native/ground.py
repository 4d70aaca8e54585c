"""Ground: the planes, walls and posts of a scene in a pymunk space, and how far out planes are planes."""

import math

import numpy as np
import pymunk

from sandbox.engines.fixtures import straightened, wall_segments
from sandbox.engines.limits import FARTHEST, FASTEST
from sandbox.engines.native.space import LONGEST_REACH, SurfaceSetter, category, fixed_shapes, half_plane_ends, reach_of
from sandbox.engines.rebound import stretches
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Plane, Post, Scene, Wall
from sandbox.scene.zone import mask_of
from sandbox.trajectory import BoolArray, FloatArray, IntArray

MANY = 5_000
"""Shapes from which on they are added shuffled: pymunk's tree takes 30 s for 40,000 in a sorted line."""


class Ground:
    """What never moves, from the moment on that there is something to meet it."""

    def __init__(self, space: pymunk.Space, setter: SurfaceSetter) -> None:
        self._space, self._setter = space, setter
        self._things: list[tuple[pymunk.Body, list[pymunk.Shape]]] = []
        self.reach = math.inf
        """m, how far from the middle of the scene planes are planes at present"""
        self._planes: tuple[Plane, ...] = ()
        self._middle, self._limit = np.zeros(6), np.full(6, math.inf)
        self._laid = False

    def lay(self, scene: Scene, bodies: Bodies, surface: IntArray) -> None:
        """Add the fixed things of a scene, once; `surface` (F,) are theirs."""
        if self._laid:
            return
        self._laid = True
        centre, reach = reach_of(bodies.position[~bodies.fixed])
        if scene.planes:
            self._middle[0:2], self.reach, self._planes = centre, reach, scene.planes
        every: list[pymunk.Shape] = []
        for thing, number in zip(scene.fixed, surface.tolist(), strict=True):
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            shapes = self._shapes(thing, body, centre, reach)
            for shape in shapes:
                shape.filter = _filter(thing, scene)
                self._setter.dress(shape, number)
            self._space.add(body)
            self._things.append((body, shapes))
            every += shapes
        for k in shuffled(len(every)):
            self._space.add(every[k])
        self._bound()

    def _bound(self) -> None:
        """Bound what `within` asks for by the present reach."""
        where = min(self.reach, FARTHEST)
        self._limit = np.array([where, where, math.inf, FASTEST, FASTEST, math.inf])

    def extend(self, place: FloatArray) -> None:
        """Lengthen the half-planes until they reach as far as (M, 2) m, at most `LONGEST_REACH`.

        The reach doubles as often as it has to, by where bodies are, so that it is the same whenever a run ends. A
        body that moves farther than the reach within one step can be beyond the ends, at twice the reach, before that.
        """
        far = np.abs(place - self._middle[0:2])
        far = far[far <= LONGEST_REACH]  # whatever is beyond, or not a number, nothing can reach
        if not len(far) or far.max() <= self.reach:
            return
        while self.reach < far.max():
            self.reach = min(2.0 * self.reach, LONGEST_REACH)
        for plane, (_, shapes) in zip(self._planes, self._things, strict=False):  # planes come first
            for shape in shapes:
                assert isinstance(shape, pymunk.Segment)
                shape.unsafe_set_endpoints(*half_plane_ends(plane, self._middle[0:2], self.reach))
                self._space.reindex_shape(shape)
        self._bound()

    def _shapes(
        self, thing: Plane | Wall | Post, body: pymunk.Body, centre: FloatArray, reach: float
    ) -> list[pymunk.Shape]:
        """Return the shapes of a fixed thing; what they meet, and their surfaces, are yet to be said."""
        shapes = list(fixed_shapes(thing, body, centre, reach))
        if isinstance(thing, Wall) and thing.kick is not None:
            parts = stretches(straightened(thing))
            self._setter.laws.stretches |= dict(zip(shapes, parts, strict=True))
        if isinstance(thing, Wall):
            joints = {shape: part for shape, part in zip(shapes, wall_segments(thing), strict=True) if any(part.joints)}
            self._setter.gates.joints |= joints
        if isinstance(thing, Wall) and thing.one_way:
            self._setter.gates.walls.update(shapes)
        return shapes

    def reshape(self, before: Scene, after: Scene) -> bool:
        """Let walls take the course that they have in another scene; `renew` has to follow. Tell whether some do."""
        if not self._laid or before.walls == after.walls:
            return False
        first, changed = len(before.planes), False
        for number, (old, new) in enumerate(zip(before.walls, after.walls, strict=True), first):
            if old.points == new.points:
                continue
            changed = True
            body, shapes = self._things[number]
            self._space.remove(*shapes)
            for shape in shapes:
                self._setter.laws.stretches.pop(shape, None)
                self._setter.gates.joints.pop(shape, None)
                self._setter.gates.walls.discard(shape)
            shapes[:] = self._shapes(new, body, np.zeros(2), self.reach)  # a wall is as long as it is
            for k in shuffled(len(shapes)):
                self._space.add(shapes[k])
        return changed

    def renew(self, scene: Scene, surface: IntArray) -> None:
        """Give the fixed things their surfaces (F,) anew, and let those be met that now are solid."""
        for (_, shapes), thing, number in zip(self._things, scene.fixed, surface.tolist(), strict=False):
            passes = _filter(thing, scene)
            for shape in shapes:
                self._setter.dress(shape, number)
                if shape.filter != passes:
                    shape.filter = passes

    @property
    def ids(self) -> dict[int, int]:
        """What each one's body id stands for: −1 − k."""
        return {body.id: -1 - k for k, (body, _) in enumerate(self._things)}

    @property
    def several(self) -> bool:
        """Whether one of them has several shapes, so that a body can touch it in several places at once."""
        return any(len(shapes) > 1 for _, shapes in self._things)

    def within(self, state: FloatArray) -> BoolArray:
        """Tell which figures of states (R, 6), x, y, angle, vx, vy, ω, are within bounds; no nan is."""
        return np.asarray(np.abs(state - self._middle) <= self._limit)

    def reaches(self, place: FloatArray) -> bool:
        """Tell whether planes can be made to reach a place; they can until there are some."""
        return math.isinf(self.reach) or bool((np.abs(place - self._middle[0:2]) <= LONGEST_REACH).all())


def jointed_surfaces(scene: Scene, surface: IntArray) -> set[int]:
    """Return the surfaces of walls of several segments; `surface` (F,) are those of the fixed things."""
    walls = zip(scene.walls, surface[len(scene.planes) :].tolist(), strict=False)
    return {number for wall, number in walls if len(wall.points) > 2}


def _filter(thing: Plane | Wall | Post, scene: Scene) -> pymunk.ShapeFilter:
    """Return whom a fixed thing meets."""
    solid = isinstance(thing, Plane) or thing.solid
    return category(True, "all" if solid else "none", layers=mask_of(thing.layers, scene.layers))


def shuffled(count: int) -> list[int]:
    """Return the order in which to add so many shapes to a space."""
    if count <= MANY:
        return list(range(count))
    return list(map(int, np.random.Generator(np.random.PCG64(0)).permutation(count)))
