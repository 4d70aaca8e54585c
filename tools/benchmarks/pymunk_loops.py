"""Hand-written pymunk loops for equal balls on planes: the peers of `sandbox.run`.

Three loops differ in what they keep of each step:

- `states_and_contacts`: states, read with `pymunk.batch`, and contacts, merged into one row for each that lasts, as the
  arrays of a `Trajectory`;
- `states`: positions, angles and velocities, read with `pymunk.batch`;
- `attributes`: the same states, read attribute by attribute in Python, as most programs do.

None has a guard, an audit, checks, or a choice of engine.
"""

from collections.abc import Callable

import numpy as np
import pymunk
from pymunk.batch import ArbiterFields, BodyFields, Buffer, get_space_arbiters, get_space_bodies

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.solver_settings import BIAS, SLOP_PER_RADIUS
from sandbox.engines.pymunk_adapter.engine import PERSISTENCE
from sandbox.scene.compile.scene import Scene
from tools.benchmarks.clock import cpu_time

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

Loop = Callable[[Scene], object]

MANY = 500
"""Number of balls from which on contacts are merged in each step; fewer are merged at the end. Each is faster there:
merged in each step and at the end, a pile of 1,000 balls takes 1.0 and 1.1 s, ten balls for 1,000 steps 28 and 9 ms."""


def make_space(scene: Scene) -> tuple[pymunk.Space, list[pymunk.Body]]:
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


def attributes(scene: Scene) -> FloatArray:
    """Run a scene and return its frames, (T, N, 6): x, y, angle, vx, vy, ω."""
    dt, steps = scene.solver.dt, round(scene.world.duration / scene.solver.dt)
    space, bodies = make_space(scene)
    balls = bodies[: len(scene.bodies)]
    frames = [[(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in balls]]
    for _ in range(steps):
        space.step(dt)
        frames.append([(*b.position, b.angle, *b.velocity, b.angular_velocity) for b in balls])
    return np.array(frames)


def states(scene: Scene) -> FloatArray:
    """Run a scene and return its frames as `attributes` does."""
    dt, steps, count = scene.solver.dt, round(scene.world.duration / scene.solver.dt), len(scene.bodies)
    space, _ = make_space(scene)
    frames, read = np.empty((steps + 1, count, 6)), Buffer()
    for k in range(steps + 1):
        if k:
            space.step(dt)
        read.clear()
        get_space_bodies(space, STATE, read)
        frames[k] = np.frombuffer(read.float_buf()).reshape(-1, 6)[:count]
    return frames


def states_and_contacts(scene: Scene) -> tuple[FloatArray, FloatArray]:
    """Run a scene and return its frames, as `attributes` does, and its contacts (C, 9) in the order of their begin.

    A contact has time, two indices, normal, point, and impulse on the second; planes are numbered after the balls.
    """
    dt, steps, count = scene.solver.dt, round(scene.world.duration / scene.solver.dt), len(scene.bodies)
    space, bodies = make_space(scene)
    log = MergedAtOnce(bodies) if count >= MANY else MergedAtEnd(bodies)
    frames, read, touches = np.empty((steps + 1, count, 6)), Buffer(), Buffer()
    for k in range(steps + 1):
        if k:
            space.step(dt)
        read.clear()
        get_space_bodies(space, STATE, read)
        frames[k] = np.frombuffer(read.float_buf()).reshape(-1, 6)[:count]
        touches.clear()
        get_space_arbiters(space, TOUCH, touches)
        log.add(k, touches)
    contacts = log.merged()
    contacts[:, 0] *= dt
    return frames, contacts


class MergedAtOnce:
    """Contacts of which each is put into its row in every step."""

    def __init__(self, bodies: list[pymunk.Body]) -> None:
        self.touching = _Touching(bodies)
        self.row_of = np.full((len(bodies), len(bodies)), -1, np.int32)
        self.last, self.contacts = np.full(100_000, -9, np.int64), np.zeros((100_000, 9))
        self.rows = 0

    def add(self, step: int, touches: Buffer) -> None:
        """Add the arbiters of a step."""
        words = np.frombuffer(touches.int_buf(), np.int64).reshape(-1, 3)
        _, a, b, sign, table = self.touching(words, np.frombuffer(touches.float_buf()).reshape(-1, 8))
        row = self.row_of[a, b]
        new = np.flatnonzero((row < 0) | (self.last[row] < step - 1))
        row[new] = self.rows + np.arange(len(new))
        begun = self.contacts[self.rows : self.rows + len(new)]
        begun[:, 0], begun[:, 1], begun[:, 2] = step, a[new], b[new]
        _write_geometry(begun, sign[new], table[new])
        self.rows += len(new)
        self.row_of[a, b] = row
        self.last[row] = step
        self.contacts[row, 7:9] -= sign * table[:, 0:2]  # pymunk's impulse is that on the first body

    def merged(self) -> FloatArray:
        """Return the contacts (C, 9) with the step in place of the time."""
        return self.contacts[: self.rows]


class MergedAtEnd:
    """Contacts that are kept as bytes and merged at the end of the run."""

    def __init__(self, bodies: list[pymunk.Body]) -> None:
        self.touching, self.count = _Touching(bodies), len(bodies)
        self.words: list[bytes] = []
        self.floats: list[bytes] = []

    def add(self, step: int, touches: Buffer) -> None:  # noqa: ARG002
        """Add the arbiters of a step."""
        self.words.append(bytes(touches.int_buf()))
        self.floats.append(bytes(touches.float_buf()))

    def merged(self) -> FloatArray:
        """Return the contacts (C, 9) with the step in place of the time."""
        words = np.frombuffer(b"".join(self.words), np.int64).reshape(-1, 3)
        table = np.frombuffer(b"".join(self.floats)).reshape(-1, 8)
        step = np.repeat(np.arange(len(self.words)), [len(each) // 24 for each in self.words])
        live, a, b, sign, table = self.touching(words, table)
        pair, step = a * self.count + b, step[live]
        order = np.argsort(pair, kind="stable")
        pair, step = pair[order], step[order]
        is_first = np.ones(len(pair), bool)
        is_first[1:] = (pair[1:] != pair[:-1]) | (step[1:] != step[:-1] + 1)
        first = np.flatnonzero(is_first)
        contacts = np.zeros((len(first), 9))
        contacts[:, 0], contacts[:, 1], contacts[:, 2] = step[first], *np.divmod(pair[first], self.count)
        _write_geometry(contacts, sign[order[first]], table[order[first]])
        if len(first):  # pymunk's impulse is that on the first body
            contacts[:, 7:9] = -np.add.reduceat((sign * table[:, 0:2])[order], first)
        return contacts[np.argsort(step[first], kind="stable")]


class _Touching:
    """Conversion of pymunk's arbiters into pairs of indices, the smaller first."""

    def __init__(self, bodies: list[pymunk.Body]) -> None:
        ids = np.array([body.id for body in bodies])
        self.order = np.argsort(ids)
        self.ids = ids[self.order]

    def __call__(
        self, words: IntArray, table: FloatArray
    ) -> tuple[np.ndarray, IntArray, IntArray, FloatArray, FloatArray]:
        """Return which of the arbiters touch; of these both indices, −1 (K, 1) if they were swapped, and the table."""
        live = words[:, 2] > 0
        words = words[live]
        a, b = self.order[np.searchsorted(self.ids, words[:, 0])], self.order[np.searchsorted(self.ids, words[:, 1])]
        return live, np.minimum(a, b), np.maximum(a, b), np.where(a < b, 1.0, -1.0)[:, None], table[live]


def _write_geometry(contacts: FloatArray, sign: FloatArray, table: FloatArray) -> None:
    """Write normal and point into rows of contacts."""
    contacts[:, 3:5] = sign * table[:, 2:4]
    contacts[:, 5:7] = (table[:, 4:6] + table[:, 6:8]) / 2


def looping(loop: Loop, scene: Scene, runs: int = 1) -> Callable[[], float]:
    """Return a workload of runs of a loop; mean seconds of a run."""

    def work() -> float:
        start_time = cpu_time()
        for _ in range(runs):
            loop(scene)
        return (cpu_time() - start_time) / runs

    return work


def looped(loop: Loop, scene: Scene, runs: int = 1) -> Callable[[], float]:
    """Return a workload of runs of a loop; runs per second."""
    seconds = looping(loop, scene, runs)
    return lambda: 1.0 / seconds()
