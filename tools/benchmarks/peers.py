"""Peers of the benchmarks, written as directly as possible."""

import math
from collections.abc import Callable

import numpy as np
import pymunk
from pymunk.batch import Buffer, get_space_bodies

from sandbox.arrays import FloatArray
from sandbox.engines.contract import Simulation
from sandbox.engines.registry import start
from sandbox.measure.analytic import bounces
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tools.benchmarks.clock import cpu_time
from tools.benchmarks.pymunk_loops import STATE


def bodies_without_shapes(count: int, steps: int) -> Callable[[], float]:
    """Return a workload of pymunk bodies in free flight, stepped and read in one batch per frame."""

    def work() -> float:
        space = pymunk.Space()
        space.gravity = 0.0, -9.81
        for k in range(count):
            body = pymunk.Body(1.0, 1.0)
            body.velocity = k % 100, k % 37
            space.add(body)
        states = Buffer()
        space.step(0.01)
        start_time = cpu_time()
        for _ in range(steps):
            space.step(0.01)
            states.clear()
            get_space_bodies(space, STATE, states)
            np.frombuffer(states.float_buf()).reshape(-1, 6).copy()
        return cpu_time() - start_time

    return work


def copying(size: int, times: int) -> Callable[[], float]:
    """Return a workload that copies `size` bytes `times` times; each is read once and written once."""
    source, target = np.ones(size // 8), np.ones(size // 8)

    def work() -> float:
        start_time = cpu_time()
        for _ in range(times):
            np.copyto(target, source)
        return cpu_time() - start_time

    return work


def fly(position: FloatArray, velocity: FloatArray, h: float, steps: int) -> None:
    """Advance particles in free flight in place, in straightforward numpy."""
    gravity = np.array([0.0, -9.81])
    for _ in range(steps):
        position += velocity * h
        velocity += gravity * h


def naive_flight(count: int) -> Callable[[], float]:
    """Return a workload of `fly`; it returns particle-steps per second."""
    position, velocity = np.zeros((count, 2)), np.ones((count, 2))
    steps = max(5, 5_000_000 // count)

    def work() -> float:
        start_time = cpu_time()
        fly(position, velocity, 0.01, steps)
        return count * steps / (cpu_time() - start_time)

    return work


def copied(count: int) -> Callable[[], float]:
    """Return a workload that copies positions and velocities, as a step reads and writes them; particles per second."""
    times = max(10, 20_000_000 // count)
    copy = copying(count * 4 * 8, times)
    return lambda: count * times / copy()


def give_moments(simulation: Simulation, scene: Scene) -> None:
    """Give every body of a pymunk simulation its moment, which the engine omits for bodies that cannot be turned."""
    space_bodies = simulation._store.space_bodies  # type: ignore[attr-defined]
    for number, moment in enumerate(scene.bodies.moment.tolist()):
        space_bodies.give_moment(number, moment)


def gas(count: int, speed: float, **more: object) -> Scene:
    """Return an elastic gas of 16, 100 or 1,000 balls in a box, as dilute as the shipped one, with `more` keys.

    Except for the time scale the gas is the same at any speed, m/s. A fast gas is for `exact`, so that many events lie
    between two frames; pymunk is slow at high speeds, because its tree extends boxes by the motion of a tenth of a
    second.
    """
    columns, rows = {16: (4, 4), 100: (10, 10), 1000: (40, 25)}[count]
    sides = [([0, 0], [1, 0]), ([0, 0], [0, 1]), ([columns, rows], [-1, 0]), ([columns, rows], [0, -1])]
    return from_document(
        {
            "world": {"duration": 1e4, "seed": 1},
            "solver": {"dt": 0.005 / speed},
            "material": [{"name": "elastic"}],
            "pair": [{"between": ["elastic", "elastic"], "restitution": 1.0}],
            "plane": [{"point": point, "normal": normal, "material": "elastic"} for point, normal in sides],
            "grid": [
                {
                    "origin": [0.5, 0.5],
                    "columns": columns,
                    "rows": rows,
                    "spacing": [1.0, 1.0],
                    "radius": 0.25,
                    "velocity_jitter": speed,
                    "material": "elastic",
                }
            ],
            **more,
        }
    )


def contacts_per_second(count: int) -> Callable[[], float]:
    """Return a workload of the same gas on pymunk, 1/50 of a radius per step; it returns contacts per second."""

    def work() -> float:
        simulation = start(gas(count, 1.0), "pymunk")
        simulation.contacts()
        start_time = cpu_time()
        for _ in range(2000 if count < 1000 else 400):
            simulation.step()
        seconds = cpu_time() - start_time
        return len(simulation.contacts()) / seconds

    return work


def bounce_truth(scene: Scene) -> FloatArray:
    """Return the height of a ball dropped from 5 cm, restitution 0.8, at the frames of a scene, m."""
    frames = round(scene.world.duration / scene.solver.dt)
    height, _ = bounces(scene.solver.dt * np.arange(1, frames + 1, dtype=np.float64), 0.05, 0.0, 9.81, 0.8)
    return height


def bounce_to(scene: Scene, tolerance: float) -> Callable[[], float]:
    """Return a workload of a bounce in bare pymunk with the largest dt = scene's / 2ⁿ within a tolerance, m.

    The dt is found first, by comparison with the closed form. Velocities start half a kick ahead, so that flight is
    exact and the only error is that of the time of impact.
    """
    frames, height = round(scene.world.duration / scene.solver.dt), 0.05
    truth = bounce_truth(scene)
    substeps = 1
    while True:
        heights, seconds = _bounced(scene, frames, substeps, height)
        if np.abs(heights - truth).max() <= tolerance:
            break
        if seconds > 60.0:
            raise RuntimeError(f"pymunk does not get within {tolerance:g} m in a minute")
        substeps *= 2
    return lambda: _bounced(scene, frames, substeps, height)[1]


def _bounced(scene: Scene, frames: int, substeps: int, height: float) -> tuple[FloatArray, float]:
    """Return the heights of the ball at the frames, m, with `substeps` steps per frame, and the seconds it took."""
    dt = scene.solver.dt / substeps
    space = pymunk.Space()
    space.gravity, space.collision_slop = (0.0, -9.81), 1e-9
    body, ground = pymunk.Body(1.0, math.inf), pymunk.Body(body_type=pymunk.Body.STATIC)
    body.position, body.velocity = (0.0, 0.5 + height), (0.0, -9.81 * dt / 2)
    ball, floor = pymunk.Circle(body, 0.5), pymunk.Segment(ground, (-1e4, -1e3), (1e4, -1e3), 1e3)
    ball.elasticity, floor.elasticity = 0.8, 1.0
    space.add(body, ball, ground, floor)
    heights = np.empty(frames)
    start_time = cpu_time()
    for frame in range(frames):
        for _ in range(substeps):
            space.step(dt)
        heights[frame] = body.position.y - 0.5
    return heights, cpu_time() - start_time
