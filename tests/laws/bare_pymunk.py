"""Scenes in a `pymunk.Space` as its users build it: `create_box`, segments as ground, one friction a shape."""

import math
import random
from collections.abc import Iterator

import numpy as np
import pymunk

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.joint_arrays import WORLD, LinkKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.generators import Stack

ORDERS = (
    ("ground", None),
    ("bodies", None),
    ("ground", "reversed"),
    ("bodies", "reversed"),
    ("ground", 1),
    ("ground", 2),
)
"""What is added first, and the order of the bodies: that of the file, the opposite, or a random one of a seed."""


def displacements(scene: Scene) -> list[float]:
    """Return the largest distance of a body from its start at the end of the run, m, for each order."""
    return [float(np.hypot(*(final - scene.bodies.position).T).max()) for final in map(_final, _spaces(scene))]


def _final(space_and_bodies: tuple[pymunk.Space, list[pymunk.Body], float, int]) -> FloatArray:
    space, bodies, h, steps = space_and_bodies
    for _ in range(steps):
        space.step(h)
    return np.array([body.position for body in bodies])


def _spaces(scene: Scene) -> Iterator[tuple[pymunk.Space, list[pymunk.Body], float, int]]:
    settings = ENGINES["pymunk"].resolve(scene, scene.solver)
    steps = round(scene.world.duration / settings.h)
    for first, order in ORDERS:
        space = pymunk.Space()
        space.gravity, space.iterations, space.collision_slop = scene.world.gravity, settings.iterations, settings.slop
        space.collision_bias = settings.bias
        if first == "ground":
            _add_static(space, scene)
        count = len(scene.bodies)
        indices = list(range(count))
        if order == "reversed":
            indices.reverse()
        elif isinstance(order, int):
            random.Random(order).shuffle(indices)
        bodies = {k: _add_body(space, scene, k) for k in indices}
        if first == "bodies":
            _add_static(space, scene)
        _add_joints(space, scene, bodies)
        yield space, [bodies[k] for k in range(count)], settings.h, steps


def _coefficients(scene: Scene, shape: pymunk.Shape) -> None:
    """Set the factors of a shape, in a scene whose bodies all have one pair of coefficients."""
    (pair,) = scene.pairs
    shape.friction, shape.elasticity = math.sqrt(pair.friction or 0.0), math.sqrt(pair.restitution or 0.0)


def _add_static(space: pymunk.Space, scene: Scene) -> None:
    for plane in scene.planes:
        normal = np.array(plane.normal) / math.hypot(*plane.normal)
        along, middle = np.array([-normal[1], normal[0]]), np.array(plane.point) - normal
        a, b = (middle - 100.0 * along).tolist(), (middle + 100.0 * along).tolist()
        ground = pymunk.Segment(space.static_body, (a[0], a[1]), (b[0], b[1]), 1.0)
        _coefficients(scene, ground)
        space.add(ground)


def _add_body(space: pymunk.Space, scene: Scene, k: int) -> pymunk.Body:
    bodies, element = scene.bodies, scene.bodies.elements[scene.bodies.element[k]]
    mass = float(bodies.mass[k])
    shape: pymunk.Shape
    if isinstance(element, Box | Stack):
        body = pymunk.Body(mass, pymunk.moment_for_box(mass, element.size))
        shape = pymunk.Poly.create_box(body, element.size)
    else:
        assert isinstance(element, Ball)
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0.0, element.radius))
        shape = pymunk.Circle(body, element.radius)
    (x, y), (vx, vy) = bodies.position[k].tolist(), bodies.velocity[k].tolist()
    body.position, body.velocity, body.angle = (x, y), (vx, vy), float(bodies.angle[k])
    _coefficients(scene, shape)
    space.add(body, shape)
    return body


def _add_joints(space: pymunk.Space, scene: Scene, bodies: dict[int, pymunk.Body]) -> None:
    links = scene.links
    for k in range(len(links)):
        a, b = (space.static_body if n == WORLD else bodies[n] for n in (int(links.a[k]), int(links.b[k])))
        kind = {LinkKind.ROD: pymunk.PinJoint, LinkKind.PIVOT: pymunk.PivotJoint}[LinkKind(int(links.kind[k]))]
        joint = kind(a, b, tuple(links.anchor_a[k].tolist()), tuple(links.anchor_b[k].tolist()))
        joint.collide_bodies = False
        space.add(joint)
