"""A bare loop over the binding of Box2D, for balls on planes: the peer of the engine `box2d`."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.scene.compile.scene import Scene
from tools.benchmarks.clock import cpu_time


class Arrays(NamedTuple):
    """What the loop records of a run of T steps with N balls."""

    position: FloatArray
    """(T + 1, N, 2) Box2D's lengths"""
    began: list[tuple[int, int, int, float, float, float, float]]
    """step, both objects, normal and point of each pair that began to touch; planes are numbered from −1 down"""
    ended: list[tuple[int, int, int]]
    """step and both objects of each pair that ceased to touch"""


def missing() -> str | None:
    """Return the reason why Box2D is not installed, or None."""
    return None if "box2d" in ENGINES else "pyb2d3 is not installed"


def scale_of(scene: Scene) -> float:
    """Return the number of Box2D's lengths in a metre, as the engine chooses it."""
    from sandbox.engines.box2d_adapter.limits import scale_for

    return scale_for(ENGINES["box2d"].resolve(scene, scene.solver))


def make_world(scene: Scene) -> tuple[Any, list[Any]]:
    """Return a world with equal balls and planes of one material, and the balls."""
    import pyb2d3 as box2d

    scale, bodies = scale_of(scene), scene.bodies
    (pair,) = scene.pairs
    world = box2d.World(
        gravity=tuple(scale * g for g in scene.world.gravity), restitution_threshold=0.0, maximum_linear_speed=1e9
    )
    world.sleeping_enabled = False
    world.create_static_body(position=(0.0, 0.0))
    material = box2d.shape_def().material
    material.friction, material.restitution = pair.friction, pair.restitution
    middle = 0.5 * (bodies.position.min(axis=0) + bodies.position.max(axis=0))
    for k, plane in enumerate(scene.planes):
        nx, ny = np.asarray(plane.normal) / math.hypot(*plane.normal)
        half, depth = 2048.0, 8000.0
        ends = [(ny * half, -nx * half), (-ny * half, nx * half)]
        corners = [*ends, *((x - nx * depth, y - ny * depth) for x, y in reversed(ends))]
        nearest = middle - np.asarray((nx, ny)) * float((middle - np.asarray(plane.point)) @ (nx, ny))
        ground = world.create_static_body(position=(float(nearest[0]) * scale, float(nearest[1]) * scale))
        definition = box2d.shape_def(material=material, enable_contact_events=True)
        definition.user_data = k
        ground.create_shape(
            definition, box2d.polygon(hull=box2d.compute_hull(np.asarray(corners, np.float32)), radius=0.0)
        )
    balls, circle = [], box2d.circle(radius=float(bodies.radius[0]) * scale, center=(0.0, 0.0))
    for k, (x, y) in enumerate(bodies.position.tolist()):
        ball = world.create_dynamic_body(position=(x * scale, y * scale))
        definition = box2d.shape_def(material=material, enable_contact_events=True)
        definition.user_data = len(scene.planes) + k
        ball.create_shape(definition, circle)
        # Of a density, the last bit of the mass would decide which contacts rebound: Box2D's threshold is 0 here.
        mass = box2d.MassData()
        mass.mass, mass.rotational_inertia = float(bodies.mass[k]), float(bodies.moment[k]) * scale**2
        ball.mass_data = mass
        balls.append(ball)
    return world, balls


def run_arrays(scene: Scene) -> Arrays:
    """Run balls on planes, and record states, and the pairs that begin and cease to touch."""
    import pyb2d3 as box2d

    dt, steps, count = scene.solver.dt, round(scene.world.duration / scene.solver.dt), len(scene.bodies)
    world, balls = make_world(scene)
    batch, planes = box2d.Bodies(), len(scene.planes)
    for ball in balls:
        batch.append(ball.id)
    transform = np.empty((steps + 1, count, 4), np.float32)
    velocity, spin = np.empty((steps + 1, count, 2), np.float32), np.empty((steps + 1, count), np.float32)
    began, ended = [], []
    for k in range(steps + 1):
        if k:
            world.step(dt, scene.solver.substeps)
        batch.get_transforms(transform[k])
        batch.get_linear_velocities(velocity[k])
        batch.get_angular_velocities(spin[k])
        events = world.get_contact_events()
        for event in events.begin_events():
            manifold = event.manifold
            normal, point = manifold.normal, next(iter(manifold.points())).point
            a, b = event.shape_a.user_data - planes, event.shape_b.user_data - planes
            began.append((k, a, b, normal.x, normal.y, point.x, point.y))
        ended += [(k, e.shape_a.user_data - planes, e.shape_b.user_data - planes) for e in events.end_events()]
    world.destroy()
    return Arrays(transform[:, :, :2].astype(np.float64), began, ended)


def loop(scene: Scene) -> Callable[[], float]:
    """Return a workload of such a run; seconds."""

    def work() -> float:
        start_time = cpu_time()
        run_arrays(scene)
        return cpu_time() - start_time

    return work
