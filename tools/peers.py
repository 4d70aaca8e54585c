"""Peers: what the benchmarks compare with, written as directly as it can be done."""

import time
from collections.abc import Callable

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.engines.contract import Simulation
from sandbox.engines.native.engine import PERSISTENCE
from sandbox.engines.overlap import BIAS, SLOP_PER_RADIUS
from sandbox.scene.model import Scene

STATE = BodyFields.POSITION | BodyFields.ANGLE | BodyFields.VELOCITY | BodyFields.ANGULAR_VELOCITY
TOUCH = (
    ArbiterFields.BODY_A_ID
    | ArbiterFields.BODY_B_ID
    | ArbiterFields.TOTAL_IMPULSE
    | ArbiterFields.NORMAL
    | ArbiterFields.CONTACT_COUNT
    | ArbiterFields.POINT_A_1
    | ArbiterFields.POINT_B_1
)


def pile_loop(scene: Scene) -> Callable[[], float]:
    """Time a pile as one would write it for pymunk alone, recording what a `Trajectory` holds.

    No guard, no audit, no checks, no choice of engine; contacts are rows of a pair while it lasts.
    """
    return lambda: _pile(scene)


def _pile(scene: Scene) -> float:
    began = time.perf_counter()
    radius, mass, friction, restitution = 0.05, 0.1, 0.5**0.5, 0.1**0.5
    dt, steps = scene.solver.dt, round(scene.world.duration / scene.solver.dt)
    space = pymunk.Space()
    space.gravity = scene.world.gravity
    space.iterations = scene.solver.iterations
    space.collision_slop, space.collision_bias = SLOP_PER_RADIUS * radius, BIAS
    space.collision_persistence = PERSISTENCE

    bodies = []
    for x, y in scene.bodies.position.tolist():
        body = pymunk.Body(mass, 0.5 * mass * radius**2)
        body.position = x, y
        shape = pymunk.Circle(body, radius)
        shape.elasticity, shape.friction = restitution, friction
        space.add(body, shape)
        bodies.append(body)
    for a, b in (((-1e4, -1e3), (1e4, -1e3)), ((-1e3, -1e4), (-1e3, 1e4)), ((1002.8, -1e4), (1002.8, 1e4))):
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        shape = pymunk.Segment(body, a, b, 1e3)
        shape.elasticity, shape.friction = restitution, friction
        space.add(body, shape)
        bodies.append(body)

    count, ids = len(scene.bodies), np.array([body.id for body in bodies])
    order = np.argsort(ids)
    ids = ids[order]
    frames = np.empty((steps + 1, count, 6))
    states, touches = Buffer(), Buffer()
    row_of = np.full((len(bodies), len(bodies)), -1, np.int32)
    last, contacts = np.full(100_000, -9, np.int64), np.zeros((100_000, 9))
    rows = 0
    for k in range(steps + 1):
        if k:
            space.step(dt)
        states.clear()
        get_space_bodies(space, STATE, states)
        frames[k] = np.frombuffer(states.float_buf()).reshape(-1, 6)[:count]
        touches.clear()
        get_space_arbiters(space, TOUCH, touches)
        words = np.frombuffer(touches.int_buf(), np.int64).reshape(-1, 3)
        table = np.frombuffer(touches.float_buf()).reshape(-1, 8)
        live = words[:, 2] > 0
        words, table = words[live], table[live]
        a, b = order[np.searchsorted(ids, words[:, 0])], order[np.searchsorted(ids, words[:, 1])]
        row = row_of[a, b]
        new = np.flatnonzero((row < 0) | (last[row] < k - 1))
        row[new] = rows + np.arange(len(new))
        opened = slice(rows, rows + len(new))
        contacts[opened, 0] = k * dt
        contacts[opened, 1], contacts[opened, 2] = a[new], b[new]
        contacts[opened, 3:5] = table[new, 2:4]
        contacts[opened, 5:7] = (table[new, 4:6] + table[new, 6:8]) / 2
        rows += len(new)
        row_of[a, b] = row
        last[row] = k
        contacts[row, 7:9] += table[:, 0:2]
    return time.perf_counter() - began


def bodies_without_shapes(count: int, steps: int) -> Callable[[], float]:
    """Time pymunk bodies in free flight, stepped and read in one batch each frame."""

    def work() -> float:
        space = pymunk.Space()
        space.gravity = 0.0, -9.81
        for k in range(count):
            body = pymunk.Body(1.0, 1.0)
            body.velocity = k % 100, k % 37
            space.add(body)
        states = Buffer()
        space.step(0.01)
        began = time.perf_counter()
        for _ in range(steps):
            space.step(0.01)
            states.clear()
            get_space_bodies(space, STATE, states)
            np.frombuffer(states.float_buf()).reshape(-1, 6).copy()
        return time.perf_counter() - began

    return work


def copying(size: int, times: int) -> Callable[[], float]:
    """Time copying so many bytes so often: each is read once and written once."""
    source, target = np.ones(size // 8), np.ones(size // 8)

    def work() -> float:
        began = time.perf_counter()
        for _ in range(times):
            np.copyto(target, source)
        return time.perf_counter() - began

    return work


def give_moments(simulation: Simulation, scene: Scene) -> None:
    """Give every body of a pymunk simulation the moment that the engine left out as nothing can turn it."""
    half = simulation._population.meeting  # type: ignore[attr-defined]
    for number, moment in enumerate(scene.bodies.moment.tolist()):
        half.give_moment(number, moment)
