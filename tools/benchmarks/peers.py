"""Peers of the benchmarks, written as directly as possible."""

import math
import time
from collections.abc import Callable

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.arrays import FloatArray
from sandbox.engines.common.solver_settings import BIAS, SLOP_PER_RADIUS
from sandbox.engines.contract import Simulation
from sandbox.engines.pymunk_adapter.engine import PERSISTENCE
from sandbox.engines.registry import start
from sandbox.measure.analytic import bounces
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

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
    """Return a workload that runs a pile with a minimal pymunk loop, which records the arrays of a `Trajectory`.

    No guard, no audit, no checks, no choice of engine; a contact that lasts is one row.
    """

    def work() -> float:
        start_time = time.perf_counter()
        pile_arrays(scene)
        return time.perf_counter() - start_time

    return work


def pile_space(scene: Scene) -> tuple[pymunk.Space, list[pymunk.Body]]:
    """Return a pymunk space with equal balls and planes of one material, and the bodies of both."""
    radius, mass = float(scene.bodies.radius[0]), float(scene.bodies.mass[0])
    (pair,) = scene.pairs
    # pymunk multiplies the coefficients of two shapes
    friction, restitution = (pair.friction or 0.0) ** 0.5, (pair.restitution or 0.0) ** 0.5
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
    for plane in scene.planes:
        (x, y), (across, up) = plane.point, plane.normal
        x, y = x - 1e3 * across, y - 1e3 * up
        a, b = (x - 1e4 * up, y - 1e4 * across), (x + 1e4 * up, y + 1e4 * across)
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        side = pymunk.Segment(body, a, b, 1e3)
        side.elasticity, side.friction = restitution, friction
        space.add(body, side)
        bodies.append(body)
    return space, bodies


def attribute_loop(scene: Scene) -> Callable[[], float]:
    """Return a workload that runs equal balls with a pymunk loop as most programs have it; seconds.

    It keeps position, angle, velocity and angular velocity of each ball, read by their attributes. No contacts.
    """

    def work() -> float:
        start_time = time.perf_counter()
        attribute_frames(scene)
        return time.perf_counter() - start_time

    return work


def started_loops(scene: Scene, runs: int = 50) -> Callable[[], float]:
    """Return a workload of such loops of one step; runs per second."""
    short = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": scene.solver.dt})})

    def work() -> float:
        start_time = time.perf_counter()
        for _ in range(runs):
            attribute_frames(short)
        return runs / (time.perf_counter() - start_time)

    return work


def looped(scene: Scene) -> Callable[[], float]:
    """Return a workload of such a loop; runs per second."""
    once = attribute_loop(scene)
    return lambda: 1.0 / once()


def attribute_frames(scene: Scene) -> FloatArray:
    """Run equal balls and return their frames, (T, N, 6): x, y, angle, vx, vy, ω."""
    dt, steps = scene.solver.dt, round(scene.world.duration / scene.solver.dt)
    space, bodies = pile_space(scene)
    balls = bodies[: len(scene.bodies)]
    frames = [[(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in balls]]
    for _ in range(steps):
        space.step(dt)
        frames.append([(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in balls])
    return np.array(frames)


def pile_arrays(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Run a pile of equal balls and return its frames (T, N, 6) and its contacts (C, 9).

    A frame has position, angle, velocity and angular velocity of each ball; a contact has time, two indices, normal,
    point and impulse.
    """
    dt, steps = scene.solver.dt, round(scene.world.duration / scene.solver.dt)
    space, bodies = pile_space(scene)
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
        new_rows = slice(rows, rows + len(new))
        contacts[new_rows, 0] = k * dt
        contacts[new_rows, 1], contacts[new_rows, 2] = a[new], b[new]
        contacts[new_rows, 3:5] = table[new, 2:4]
        contacts[new_rows, 5:7] = (table[new, 4:6] + table[new, 6:8]) / 2
        rows += len(new)
        row_of[a, b] = row
        last[row] = k
        contacts[row, 7:9] += table[:, 0:2]
    return frames, contacts[:rows]


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
        start_time = time.perf_counter()
        for _ in range(steps):
            space.step(0.01)
            states.clear()
            get_space_bodies(space, STATE, states)
            np.frombuffer(states.float_buf()).reshape(-1, 6).copy()
        return time.perf_counter() - start_time

    return work


def copying(size: int, times: int) -> Callable[[], float]:
    """Return a workload that copies `size` bytes `times` times; each is read once and written once."""
    source, target = np.ones(size // 8), np.ones(size // 8)

    def work() -> float:
        start_time = time.perf_counter()
        for _ in range(times):
            np.copyto(target, source)
        return time.perf_counter() - start_time

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
        start_time = time.perf_counter()
        fly(position, velocity, 0.01, steps)
        return count * steps / (time.perf_counter() - start_time)

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
        start_time = time.perf_counter()
        for _ in range(2000 if count < 1000 else 400):
            simulation.step()
        seconds = time.perf_counter() - start_time
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
    start_time = time.perf_counter()
    for frame in range(frames):
        for _ in range(substeps):
            space.step(dt)
        heights[frame] = body.position.y - 0.5
    return heights, time.perf_counter() - start_time
