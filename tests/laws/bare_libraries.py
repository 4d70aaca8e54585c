"""Scenes in a `pymunk.Space` and in a Box2D world as users of these libraries build them, without an adapter."""

import math
import random
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pyb2d3 as box2d
import pymunk

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import WORLD, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box, Capsule
from sandbox.scene.description.fixed import Plane, Wall
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.world import Settings

WAYS = (
    ("ground", None, 50.0),
    ("bodies", None, 1e4),
    ("ground", "reversed", 50.0),
    ("bodies", "reversed", 1e4),
    ("ground", 1, 1e4),
    ("bodies", 2, 50.0),
)
"""What is added first, the order of the bodies: that of the file, the opposite, or a random one of a seed, and half the
length of planes, m."""


def displacements(scene: Scene, engine: str) -> list[float]:
    """Return the largest distance of a body from its start at the end of the run, m, for each way."""
    found = []
    for world in _worlds(scene, engine):
        for _ in range(round(scene.world.duration / scene.solver.dt)):
            world.step()
        found.append(float(np.hypot(*(world.positions() - scene.bodies.position).T).max()))
    return found


def _worlds(scene: Scene, engine: str) -> "Iterator[BareSpace | BareBox2D]":
    settings = ENGINES[engine].resolve(scene, scene.solver)
    of_ground, of_body = _coefficients(scene, engine)
    kind = BareSpace if engine == "pymunk" else BareBox2D
    for first, order, half_length in WAYS:
        indices = list(range(len(scene.bodies)))
        if order == "reversed":
            indices.reverse()
        elif isinstance(order, int):
            random.Random(order).shuffle(indices)
        world = kind(scene, settings, half_length)
        for part in (first, "bodies" if first == "ground" else "ground"):
            if part == "ground":
                for collider in (*scene.planes, *scene.walls):
                    world.add_static(collider, *of_ground)
            else:
                for k in indices:
                    world.add_body(k, *of_body[k])
        for k in range(len(scene.joint_arrays)):
            world.add_joint(k)
        yield world


def _coefficients(scene: Scene, engine: str) -> tuple[tuple[float, float], list[tuple[float, float]]]:
    """Return friction and restitution of static shapes and of each body, in a scene that needs no more.

    pymunk multiplies both values of a pair; Box2D takes the root of the product, and the larger restitution.
    """
    surfaces = contact_matrix(scene).surfaces
    of_body = surfaces.of_body.tolist()
    static = int(surfaces.of_fixed[0]) if len(surfaces.of_fixed) else of_body[0]
    pairs = [(float(surfaces.friction[static, k]), float(surfaces.restitution[static, k])) for k in of_body]
    if engine == "box2d":
        return (pairs[0], pairs) if len(set(pairs)) == 1 else ((1.0, 0.0), [(mu**2, e) for mu, e in pairs])
    if len(set(pairs)) > 1:
        return (1.0, 1.0), pairs
    factors = math.sqrt(pairs[0][0]), math.sqrt(pairs[0][1])
    return factors, [factors] * len(pairs)


def _ends(collider: Plane | Wall, scene: Scene, half_length: float) -> list[tuple[float, float]]:
    """Return points that segments connect; of a plane, those on both sides of the point nearest to the bodies."""
    if isinstance(collider, Wall):
        return list(collider.points)
    normal, point = np.array(collider.normal) / math.hypot(*collider.normal), np.array(collider.point)
    along, middle = np.array([-normal[1], normal[0]]), scene.bodies.position.mean(axis=0)
    nearest = middle - normal * float((middle - point) @ normal)
    return [tuple((nearest + side * half_length * along).tolist()) for side in (1.0, -1.0)]


class BareSpace:
    """Space with segments as ground and `create_box` for boxes."""

    def __init__(self, scene: Scene, settings: Settings, half_length: float) -> None:
        self._scene, self._settings, self._half_length = scene, settings, half_length
        self._bodies = dict[int, pymunk.Body]()
        self._space = space = pymunk.Space()
        space.gravity, space.iterations, space.collision_slop = scene.world.gravity, settings.iterations, settings.slop
        space.collision_bias = settings.bias

    def add_static(self, collider: Plane | Wall, friction: float, restitution: float) -> None:
        points, radius = np.array(_ends(collider, self._scene, self._half_length)), 1.0
        if isinstance(collider, Wall):
            radius = 0.5 * collider.thickness
        else:
            points -= radius * np.array(collider.normal) / math.hypot(*collider.normal)
        for a, b in pairwise(points.tolist()):
            segment = pymunk.Segment(self._space.static_body, tuple(a), tuple(b), radius)
            segment.friction, segment.elasticity = friction, restitution
            self._space.add(segment)

    def add_body(self, k: int, friction: float, restitution: float) -> None:
        bodies, element = self._scene.bodies, self._scene.bodies.elements[self._scene.bodies.element[k]]
        mass = float(bodies.mass[k])
        shape: pymunk.Shape
        if isinstance(element, Box | Stack):
            body = pymunk.Body(mass, pymunk.moment_for_box(mass, element.size))
            shape = pymunk.Poly.create_box(body, element.size)
        else:
            body = pymunk.Body(mass, float(bodies.moment[k]))
            shape = pymunk.Circle(body, float(bodies.radius[k]))
            if isinstance(element, Capsule):
                half = 0.5 * element.length
                shape = pymunk.Segment(body, (-half, 0.0), (half, 0.0), element.radius)
        if bodies.fixed[k]:
            body.body_type = pymunk.Body.STATIC
        (x, y), (vx, vy) = bodies.position[k].tolist(), bodies.velocity[k].tolist()
        body.position, body.velocity, body.angle = (x, y), (vx, vy), float(bodies.angle[k])
        body.angular_velocity = float(bodies.angular_velocity[k])
        shape.friction, shape.elasticity = friction, restitution
        self._space.add(body, shape)
        self._bodies[k] = body

    def add_joint(self, k: int) -> None:
        links = self._scene.joint_arrays
        a, b = (self._space.static_body if n == WORLD else self._bodies[n] for n in (int(links.a[k]), int(links.b[k])))
        kind = {JointKind.ROD: pymunk.PinJoint, JointKind.PIVOT: pymunk.PivotJoint}[JointKind(int(links.kind[k]))]
        joint = kind(a, b, tuple(links.anchor_a[k].tolist()), tuple(links.anchor_b[k].tolist()))
        joint.collide_bodies = False
        self._space.add(joint)

    def step(self) -> None:
        for _ in range(self._settings.substeps):
            self._space.step(self._settings.h)

    def positions(self) -> FloatArray:
        return np.array([self._bodies[k].position for k in range(len(self._bodies))])


class BareBox2D:
    """World with boxes as ground, capsules as walls and `box` for boxes; its lengths make Box2D's slop the scene's."""

    def __init__(self, scene: Scene, settings: Settings, half_length: float) -> None:
        self._scene, self._settings, self._half_length = scene, settings, half_length
        self._bodies = dict[int, Any]()
        assert settings.slop is not None
        self._scale = 0.005 / settings.slop  # B2_LINEAR_SLOP
        self._world = box2d.World(
            gravity=self._vector(scene.world.gravity),
            restitution_threshold=0.0,
            maximum_linear_speed=1e3 * self._scale,
        )
        self._world.sleeping_enabled = False
        self._ground = self._world.create_static_body(position=(0.0, 0.0))

    def _vector(self, vector: Sequence[float] | FloatArray) -> tuple[float, float]:
        return self._scale * float(vector[0]), self._scale * float(vector[1])

    def _shape_def(self, friction: float, restitution: float, density: float = 1.0) -> Any:
        definition = box2d.shape_def(density=density)
        material = definition.material
        material.friction, material.restitution = friction, restitution
        definition.material = material
        return definition

    def add_static(self, collider: Plane | Wall, friction: float, restitution: float) -> None:
        definition, points = self._shape_def(friction, restitution), _ends(collider, self._scene, self._half_length)
        if isinstance(collider, Wall):
            for a, b in pairwise(points):
                self._ground.create_shape(
                    definition, box2d.capsule(self._vector(a), self._vector(b), 0.5 * collider.thickness * self._scale)
                )
            return
        angle = math.atan2(-collider.normal[0], collider.normal[1])
        middle = 0.5 * (np.array(points[0]) + np.array(points[1])) - np.array(collider.normal) / math.hypot(
            *collider.normal
        )
        body = self._world.create_static_body(position=self._vector(middle), rotation=box2d.make_rot(angle))
        # 32-bit numbers resolve no longer ground
        body.create_shape(definition, box2d.box(100.0 * self._scale, self._scale))

    def add_body(self, k: int, friction: float, restitution: float) -> None:
        bodies, element = self._scene.bodies, self._scene.bodies.elements[self._scene.bodies.element[k]]
        create = self._world.create_static_body if bodies.fixed[k] else self._world.create_dynamic_body
        body = create(
            position=self._vector(bodies.position[k]),
            rotation=box2d.make_rot(float(bodies.angle[k])),
        )
        if isinstance(element, Box | Stack):
            width, height = self._vector(element.size)
            geometry, area = box2d.box(0.5 * width, 0.5 * height), width * height
        else:
            radius = float(bodies.radius[k]) * self._scale
            geometry, area = box2d.circle(radius=radius, center=(0.0, 0.0)), math.pi * radius**2
            if isinstance(element, Capsule):
                length, radius = self._vector((element.length, element.radius))
                geometry = box2d.capsule((-0.5 * length, 0.0), (0.5 * length, 0.0), radius)
                area = math.pi * radius**2 + 2.0 * radius * length
        body.create_shape(self._shape_def(friction, restitution, float(bodies.mass[k]) / area), geometry)
        if not bodies.fixed[k]:
            body.linear_velocity = self._vector(bodies.velocity[k])
            body.angular_velocity = float(bodies.angular_velocity[k])
        self._bodies[k] = body

    def add_joint(self, k: int) -> None:
        links = self._scene.joint_arrays
        is_rod = JointKind(int(links.kind[k])) == JointKind.ROD
        joint = box2d.DistanceJointDef() if is_rod else box2d.RevoluteJointDef()
        if is_rod:
            joint.length = float(links.figures[k, 0]) * self._scale
        a, b = int(links.a[k]), int(links.b[k])
        joint.body_a, joint.body_b = (self._ground if n == WORLD else self._bodies[n] for n in (a, b))
        joint.local_anchor_a = self._vector(links.anchor_a[k])
        joint.local_anchor_b = self._vector(links.anchor_b[k])
        self._world.create_joint(joint)

    def step(self) -> None:
        self._world.step(self._settings.dt, self._settings.substeps)

    def positions(self) -> FloatArray:
        return np.array([tuple(self._bodies[k].position) for k in range(len(self._bodies))]) / self._scale
