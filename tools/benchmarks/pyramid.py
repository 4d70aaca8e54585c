"""A pyramid of 55 boxes on `box2d` and in bare pymunk: time, and how far the boxes move.

    python -m tools.benchmarks.pyramid

prints the largest displacement of a box and the time for many settings of both; the cheapest setting of pymunk whose
displacement is at most that of Box2D is the peer of the row `pyramid-box2d`.
"""

import math
import statistics

import numpy as np
import pymunk
from pymunk.batch import Buffer, get_space_bodies

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES, start
from tools.benchmarks.clock import cpu_time
from tools.benchmarks.pymunk_loops import STATE
from tools.benchmarks.workloads import Timed, scene

FRAMES = 300
"""5 s at 60 Hz."""
SUBSTEPS = 4
"""Substeps of `box2d`, as its documentation recommends."""
EQUAL = (3, 3)
"""Substeps and iterations of the cheapest bare pymunk loop whose boxes move no further than Box2D's."""

SEARCHED_SUBSTEPS = (1, 2, 3, 4, 5, 6)
SEARCHED_ITERATIONS = (*range(1, 11), 12, 15, 20, 40)
REPEATS = 5

SCENE = scene("benchmark/pyramid", "solver.dt=0.016666666666666666", f"solver.substeps={SUBSTEPS}")


def on_box2d(substeps: int = SUBSTEPS) -> FloatArray:
    """Return the frames of the pyramid on the engine `box2d`, (T, N, 2), the start first."""
    simulation = start(SCENE, "box2d", SCENE.solver.replace(substeps=substeps))
    frames = np.empty((FRAMES + 1, len(SCENE.bodies), 2))
    for k in range(FRAMES + 1):
        if k:
            simulation.step()
        frames[k] = simulation.frame().position
    simulation.close()
    return frames


def in_pymunk(substeps: int, iterations: int) -> FloatArray:
    """Return the same of a bare pymunk loop, with boxes and ground as a game makes them and states read in batches."""
    settings = ENGINES["pymunk"].resolve(SCENE, SCENE.solver)
    (stack,), (pair,) = SCENE.stacks, SCENE.pairs
    assert pair.friction is not None and settings.slop is not None
    friction, mass = math.sqrt(pair.friction), float(SCENE.bodies.mass[0])  # pymunk multiplies those of two shapes
    space = pymunk.Space()
    space.gravity, space.iterations, space.collision_slop = SCENE.world.gravity, iterations, settings.slop
    ground = pymunk.Segment(space.static_body, (-50.0, -1.0), (50.0, -1.0), 1.0)
    ground.friction = friction
    space.add(ground)
    for x, y in SCENE.bodies.position.tolist():
        body = pymunk.Body(mass, pymunk.moment_for_box(mass, stack.size))
        body.position = x, y
        box = pymunk.Poly.create_box(body, stack.size)
        box.friction = friction
        space.add(body, box)
    h, count = SCENE.solver.dt / substeps, len(SCENE.bodies)
    frames, read = np.empty((FRAMES + 1, count, 6)), Buffer()
    for k in range(FRAMES + 1):
        for _ in range(substeps if k else 0):
            space.step(h)
        read.clear()
        get_space_bodies(space, STATE, read)
        frames[k] = np.frombuffer(read.float_buf()).reshape(-1, 6)[:count]
    return frames[:, :, :2]


def timing(substeps: int, iterations: int | None = None) -> Timed:
    """Return a workload of `in_pymunk`, or of `on_box2d` without iterations; seconds, with the creation of bodies."""

    def work() -> float:
        start_time = cpu_time()
        _frames(substeps, iterations)
        return cpu_time() - start_time

    return work


def displacement(substeps: int, iterations: int | None = None) -> float:
    """Return the largest distance of a box from its place at the start, m; as `timing`."""
    frames = _frames(substeps, iterations)
    return float(np.linalg.norm(frames - frames[0], axis=2).max())


def same(substeps: int, iterations: int) -> None:
    """Check that both sides begin alike and that both pyramids stand; at `EQUAL`, that pymunk's moves no further."""
    ours, peer = on_box2d(), in_pymunk(substeps, iterations)
    assert np.allclose(ours[0], peer[0], rtol=0.0, atol=1e-6)  # Box2D has 32-bit numbers
    half_box = float(SCENE.bodies.radius.min())
    moved = [float(np.linalg.norm(frames - frames[0], axis=2).max()) for frames in (ours, peer)]
    assert max(moved) < half_box, moved
    assert (substeps, iterations) != EQUAL or moved[1] <= moved[0], moved


def _frames(substeps: int, iterations: int | None) -> FloatArray:
    return on_box2d(substeps) if iterations is None else in_pymunk(substeps, iterations)


def main() -> None:
    """Print displacements and times of both engines, in turns; those of pymunk in the order of their time."""
    settings = [(SUBSTEPS, None), *((s, i) for s in SEARCHED_SUBSTEPS for i in SEARCHED_ITERATIONS)]
    moved = {setting: displacement(*setting) for setting in settings}
    times: dict[tuple[int, int | None], list[float]] = {setting: [] for setting in settings}
    for k in range(REPEATS):
        for setting in settings if k % 2 == 0 else reversed(settings):
            times[setting].append(timing(*setting)())
    medians = {setting: statistics.median(values) for setting, values in times.items()}
    limit = moved[SUBSTEPS, None]
    print(f"box2d, {SUBSTEPS} substeps: {1e3 * limit:.2f} mm, {1e3 * medians[SUBSTEPS, None]:.1f} ms")
    print("pymunk: substeps × iterations, largest displacement, time; * moves no further than box2d")
    for setting in sorted(settings[1:], key=medians.__getitem__):
        mark = "*" if moved[setting] <= limit else " "
        print(f"{setting[0]} × {setting[1]:<3}{1e3 * moved[setting]:10.2f} mm {mark}{1e3 * medians[setting]:8.1f} ms")


if __name__ == "__main__":
    main()
