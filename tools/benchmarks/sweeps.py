"""Workloads of sweeps: many runs in worker processes, the store, and resuming, against hand-written programs.

The hand-written loops record frames and contacts, as a run does, and return the last frame.

A workload measures the time of the last `MEASURED` of its runs, so that starting the processes, a second on each side,
does not count.
"""

import multiprocessing
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.batch.driver import Driver
from sandbox.batch.executors import InProcessExecutor
from sandbox.batch.job import Job, RunOptions, run_job
from sandbox.batch.plan import Plan
from sandbox.batch.process_pool import ProcessExecutor
from sandbox.batch.store import Store
from sandbox.measure.run.ensemble import ensemble
from sandbox.measure.run.runner import run
from sandbox.measure.shots import odds
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, load
from sandbox.scene.files.shipped_scenes import find
from tools.benchmarks import agreement
from tools.benchmarks.clock import wall_time
from tools.benchmarks.pymunk_loops import states_and_contacts
from tools.benchmarks.workloads import Timed, balls_on_plane, timed

WORKERS = 2
MEASURED = 0.75
"""fraction of the runs that is timed, the last ones"""
STEPS = {50: 550, 5: 50}
"""Steps of a hundred balls on a plane that take a pymunk loop with its records about so many milliseconds"""
SUMMARY = RunOptions(audit=False, keep="summary", final=False)
ENDS = RunOptions(audit=False, keep="end", final=False)


def hundred_balls(milliseconds: int) -> Scene:
    """Return a scene of a hundred balls that fall onto a plane, which takes pymunk about so long."""
    return balls_on_plane(100, STEPS[milliseconds])


@contextmanager
def _planned(scene: Scene, seeds: int, engine: str = "pymunk", keeps_ends: bool = False) -> Iterator[tuple[Plan, Path]]:
    """Yield the plan of a scene with many seeds, checked, and a folder for its store."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(dumps(scene), encoding="utf-8")
        plan = Plan([("scene", str(path))], [engine], seeds=seeds, keeps_ends=keeps_ends)
        plan.check()
        yield plan, Path(folder) / "runs"


def sweeping(milliseconds: int, runs: int) -> Timed:
    """Return a workload of a sweep of seeds in worker processes, stored as summaries; seconds."""
    scene = hundred_balls(milliseconds)

    def work() -> float:
        times: list[float] = []
        with _planned(scene, runs) as (plan, folder), Store(folder) as store:
            executor = ProcessExecutor(WORKERS)
            Driver(plan, runs, executor, SUMMARY, store, lambda *_: times.append(wall_time())).run()
        return _latest(times)

    return work


def pooled(milliseconds: int, runs: int, work_on: Callable[[Scene], object]) -> Timed:
    """Return a workload of the same runs by a function of a scene in a bare `multiprocessing` pool; seconds."""
    scenes = _seeded(hundred_balls(milliseconds), runs)

    def work() -> float:
        times: list[float] = []
        with multiprocessing.get_context("spawn").Pool(WORKERS) as pool:
            ends = pool.imap_unordered(work_on, scenes, chunksize=max(50 // milliseconds, 1))
            times.extend(wall_time() for _ in ends)
        return _latest(times)

    return work


def loop_ends(scene: Scene) -> FloatArray:
    """Run balls with a hand-written pymunk loop that records frames and contacts; return the last frame, (N, 6)."""
    return np.asarray(states_and_contacts(scene)[0][-1])


def run_ends(scene: Scene) -> FloatArray:
    """Run balls with `sandbox.run`, and return their last positions, (N, 2) m."""
    ends: FloatArray = run(scene, audit=False).position[-1]
    return ends


def same_ends(milliseconds: int) -> None:
    """Check that runs of the sweep end where the hand-written loops do."""
    for seeded in _seeded(hundred_balls(milliseconds), 3):
        # The same calls of the same solver; rounding of constants, 1e-16, grows in the contacts of balls that rest.
        assert np.allclose(run_ends(seeded), loop_ends(seeded)[:, :2], rtol=0.0, atol=1e-6)


def ensemble_run(engine: str, runs: int) -> Timed:
    """Return a workload of an ensemble of ten balls for 1,000 steps, on `WORKERS` threads; seconds a run."""
    scene = balls_on_plane(10, 1000)

    def compute() -> None:
        found = ensemble(scene, runs, vary={"ball.*.velocity": 0.01}, engine=engine, threads=WORKERS)
        assert found.compiled.all()

    return lambda: timed(compute, wall_time) / runs


def seed_sweep(engine: str, runs: int, *, keeps_ends: bool) -> Timed:
    """Return a workload of a sweep of ten balls for 1,000 steps in worker processes, stored; seconds a run.

    The scenes of ordinary runs are read before, as by `sandbox run`; those of members are not.
    """
    scene, options = balls_on_plane(10, 1000), ENDS if keeps_ends else SUMMARY

    def work() -> float:
        times: list[float] = []
        with _planned(scene, runs, engine, keeps_ends) as (plan, folder), Store(folder) as store:
            executor = ProcessExecutor(WORKERS)
            Driver(plan, runs, executor, options, store, lambda *_: times.append(wall_time())).run()
        return _latest(times) / (runs * MEASURED)

    return work


def pooled_runs(scene: Scene, engine: str, runs: int) -> Timed:
    """Return a workload of single runs of a scene in a bare pool, which return their last positions; seconds a run."""

    def work() -> float:
        times: list[float] = []
        with multiprocessing.get_context("spawn").Pool(WORKERS) as pool:
            ends = pool.imap_unordered(partial(end_on, engine), [scene] * runs, chunksize=5)
            times.extend(wall_time() for _ in ends)
        return _latest(times) / (runs * MEASURED)

    return work


def end_on(engine: str, scene: Scene) -> FloatArray:
    """Run a scene, recording its ends only, and return the last positions, (N, 2) m."""
    steps = round(scene.world.duration / scene.solver.dt)
    ends: FloatArray = run(scene, engine, audit=False, record_every=steps).position[-1]
    return ends


def shot_run(shots: int) -> Timed:
    """Return a workload of billiard shots with errors of the stroke, on `WORKERS` threads; seconds a shot."""
    scene = load(find("9-ball"))
    return lambda: timed(lambda: odds(scene, count=shots, threads=WORKERS), wall_time) / shots


def same_members(engine: str) -> None:
    """Check that runs of an ensemble end as single runs of the same starts do, bit for bit."""
    scene = balls_on_plane(10, 1000)
    agreement.members(scene, engine)


def storing(milliseconds: int, runs: int) -> Timed:
    """Return a workload of runs in this process that are stored as summaries; seconds."""
    scene = hundred_balls(milliseconds)

    def work() -> float:
        times: list[float] = []
        with _planned(scene, runs) as (plan, folder), Store(folder) as store:
            driver = Driver(plan, runs, InProcessExecutor(), SUMMARY, store, lambda *_: times.append(wall_time()))
            driver.run()
        return _latest(times)

    return work


def not_storing(milliseconds: int, runs: int) -> Timed:
    """Return a workload of the same runs as jobs in a loop, whose rows are dropped; seconds."""
    jobs = [Job("scene", seeded, "pymunk") for seeded in _seeded(hundred_balls(milliseconds), runs)]

    def work() -> float:
        times: list[float] = []
        for job in jobs:
            run_job(job, SUMMARY)
            times.append(wall_time())
        return _latest(times)

    return work


def resuming(runs: int) -> tuple[Timed, Timed]:
    """Return workloads of a sweep of which all runs are stored, and of reading their rows by hand; seconds."""
    scene = balls_on_plane(1, 1)
    folder = tempfile.TemporaryDirectory()  # kept until the process ends, as both workloads use it
    path = Path(folder.name) / "scene.toml"
    path.write_text(dumps(scene), encoding="utf-8")

    def sweep() -> None:
        plan = Plan([("scene", str(path))], ["pymunk"], seeds=runs)
        with Store(Path(folder.name) / "runs") as store:
            plan.check(store.has_planned)
            Driver(plan, runs, InProcessExecutor(), SUMMARY, store, lambda *_: None).run()

    def read() -> None:
        with Store(Path(folder.name) / "runs") as store:
            assert len(store.rows()) == runs

    sweep()
    return lambda: timed(sweep), lambda: timed(read)


def _seeded(scene: Scene, count: int) -> list[Scene]:
    """Return a scene with the seeds 1 to a count."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(dumps(scene), encoding="utf-8")
        return [load(path, [("world.seed", seed)]) for seed in range(1, count + 1)]


def _latest(times: list[float]) -> float:
    """Return the time in which the last `MEASURED` of some completions came, s."""
    return times[-1] - times[round(len(times) * (1.0 - MEASURED)) - 1]


def resumed(runs: int) -> tuple[Callable[[], Timed], Callable[[], Timed]]:
    """Return the two sides of a row for `resuming`, which share one store."""
    made: list[tuple[Timed, Timed]] = []

    def side(k: int) -> Callable[[], Timed]:
        def setup() -> Timed:
            if not made:
                made.append(resuming(runs))
            return made[0][k]

        return setup

    return side(0), side(1)
