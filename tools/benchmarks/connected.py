"""Workloads of connected and stacked bodies: cloth, tower, heap of planks; a cloth and a tower of bare pymunk."""

import math
from collections.abc import Callable

import pymunk

from sandbox.engines.registry import ENGINES, start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.joint_arrays import WORLD
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from tools.benchmarks.clock import cpu_time

Timed = Callable[[], float]

CLOTH = """
[world]
gravity = [0.0, -9.81]
duration = 1000.0
[solver]
dt = 0.001
[[cloth]]
name = "sheet"
corner = [0.0, 3.2]
columns = 64
rows = 64
spacing = [0.05, 0.05]
radius = 0.01
mass = 0.002
stiffness = 100.0
damping = 0.02
pins = "top"
"""
"""64 × 64 nodes on 8,001 springs, with the uppermost row pinned."""


def cloth(engine: str, steps: int, **settings: str) -> Timed:
    """Return a workload that steps the cloth; it returns steps per second."""
    scene = loads(CLOTH)

    def work() -> float:
        simulation = start(scene, engine, scene.solver.replace(**settings))
        simulation.step()
        start_time = cpu_time()
        for _ in range(steps):
            simulation.step()
        seconds = cpu_time() - start_time
        simulation.close()
        return steps / seconds

    return work


def springs(steps: int) -> Timed:
    """Return a workload that steps the same cloth of hand-written pymunk springs; it returns steps per second."""
    scene = loads(CLOTH)

    def work() -> float:
        space = cloth_space(scene)
        h = scene.solver.h
        space.step(h)
        start_time = cpu_time()
        for _ in range(steps):
            space.step(h)
        return steps / (cpu_time() - start_time)

    return work


def cloth_space(scene: Scene) -> pymunk.Space:
    """Return a cloth as a space of pymunk's bodies and damped springs."""
    space = pymunk.Space()
    space.gravity = scene.world.gravity
    bodies = []
    for position, mass, fixed in zip(
        scene.bodies.position.tolist(), scene.bodies.mass.tolist(), scene.bodies.fixed.tolist(), strict=True
    ):
        body = pymunk.Body(mass, float("inf"), body_type=pymunk.Body.STATIC if fixed else pymunk.Body.DYNAMIC)
        body.position = position
        space.add(body)
        bodies.append(body)
    links = scene.joint_arrays
    for a, b, (rest, stiffness, damping) in zip(
        links.a.tolist(), links.b.tolist(), links.figures.tolist(), strict=True
    ):
        first = space.static_body if a == WORLD else bodies[a]
        space.add(pymunk.DampedSpring(first, bodies[b], (0, 0), (0, 0), rest, stiffness, damping))
    return space


def standing(scene: Scene, engine: str, max_drift: float, **settings: int) -> Timed:
    """Return a workload that runs a tower on an engine with settings that limit its drift; it returns seconds.

    Raises:
        AssertionError: a box drifted sideways by more than `max_drift`, m.
    """
    solver = scene.solver.replace(record_every=10_000, **settings)
    scene = scene.model_copy(update={"solver": solver})

    def work() -> float:
        start_time = cpu_time()
        done = run(scene, engine, audit=False)
        seconds = cpu_time() - start_time
        drift = float(abs(done.position[-1, :, 0] - done.position[0, :, 0]).max())
        assert drift <= max_drift, f"{engine}: drift of {drift:g} m"
        return seconds

    return work


def bare_standing(scene: Scene, max_drift: float, substeps: int, iterations: int) -> Timed:
    """Return the same workload on a `pymunk.Space` of boxes and a segment, as a game builds it; it returns seconds.

    Raises:
        AssertionError: a box drifted sideways by more than `max_drift`, m.
    """
    settings = ENGINES["pymunk"].resolve(scene, scene.solver)
    (stack,), (pair,) = scene.stacks, scene.pairs
    assert pair.friction is not None and settings.slop is not None
    friction, slop, mass = math.sqrt(pair.friction), settings.slop, float(scene.bodies.mass[0])

    def add(space: pymunk.Space, shape: pymunk.Shape) -> None:
        shape.friction = friction
        space.add(shape)

    def work() -> float:
        start_time = cpu_time()
        space = pymunk.Space()
        space.gravity, space.iterations, space.collision_slop = scene.world.gravity, iterations, slop
        add(space, pymunk.Segment(space.static_body, (-50.0, -1.0), (50.0, -1.0), 1.0))
        for x, y in scene.bodies.position.tolist():
            body = pymunk.Body(mass, pymunk.moment_for_box(mass, stack.size))
            body.position = x, y
            space.add(body)
            add(space, pymunk.Poly.create_box(body, stack.size))
        h = scene.solver.dt / substeps
        for _ in range(round(scene.world.duration / h)):
            space.step(h)
        seconds = cpu_time() - start_time
        drift = max(abs(body.position.x) for body in space.bodies)
        assert drift <= max_drift, f"bare pymunk: drift of {drift:g} m"
        return seconds

    return work


def heap() -> Scene:
    """Return 60 long planks that fall into a box."""
    rows = "".join(
        f'[[box]]\nname = "plank {k}"\nposition = [{0.05 * (k % 3)}, {0.3 + 0.12 * k}]\n'
        f"size = [4.0, 0.08]\nangle = {0.02 * (k % 5 - 2)}\nfriction = 0.3\n"
        for k in range(60)
    )
    return loads(
        "[world]\ngravity = [0.0, -9.81]\nduration = 1.0\n[solver]\ndt = 0.005\n"
        "[[wall]]\npoints = [[-2.5, 9.0], [-2.5, 0.0], [2.5, 0.0], [2.5, 9.0]]\nfriction = 0.3\n" + rows
    )


def planks(broad_phase: str) -> Timed:
    """Return a workload that simulates a second of a heap of planks on the reference; it returns seconds."""
    scene = heap()

    def work() -> float:
        simulation = start(scene, "reference", scene.solver.replace(broad_phase=broad_phase))
        simulation.step()
        start_time = cpu_time()
        for _ in range(200):
            simulation.step()
        return cpu_time() - start_time

    return work
