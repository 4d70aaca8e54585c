"""Workloads of the benches: each function sets one up and returns a function that does it and returns its measure."""

import math
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

import sandbox
from sandbox.action import SetParameter
from sandbox.arrays import FloatArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.reference.compiled_stepper import OPTIONAL_KERNELS
from sandbox.engines.reference.engine import ReferenceEngine
from sandbox.engines.reference.step import WorldState
from sandbox.engines.registry import start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from tools.benchmarks import peers
from tools.benchmarks.clock import cpu_time, wall_time

for _kernel in OPTIONAL_KERNELS:
    _kernel.spent = math.inf  # compiled at once and not after a while: what is measured is the state of later sessions

Timed = Callable[[], float]
"""Does the work once and returns its measure: seconds, or an amount per second."""


def repeat(work: Callable[[], object], times: int) -> None:
    """Call a function a number of times."""
    for _ in range(times):
        work()


def timed(work: Callable[[], object], clock: Callable[[], float] = cpu_time) -> float:
    """Return the seconds that a call takes, by a clock."""
    start_time = clock()
    work()
    return clock() - start_time


def scene(name: str, *overrides: str) -> Scene:
    """Return a shipped scene."""
    return load(find(name), overrides)


def running(which: Scene, audit: bool = True, engine: str = "pymunk", runs: int = 1) -> Timed:
    """Return a workload of complete recorded runs, one after the other; mean seconds of a run."""
    return lambda: timed(lambda: repeat(lambda: run(which, engine, audit=audit), runs)) / runs


def for_one_step(which: Scene) -> Scene:
    """Return a scene that lasts one step."""
    return which.model_copy(update={"world": which.world.model_copy(update={"duration": which.solver.dt})})


def starting(which: Scene, engine: str, runs: int = 50) -> Timed:
    """Return a workload of runs of a scene for one step; runs per second."""
    short = for_one_step(which)
    return lambda: runs / timed(lambda: [run(short, engine) for _ in range(runs)])


def varying(which: Scene, engine: str, runs: int = 200) -> Timed:
    """Return a workload of an ensemble on one thread; runs per second."""
    vary = {"ball.*.velocity": 0.01}
    return lambda: runs / timed(lambda: sandbox.ensemble(which, runs, vary=vary, engine=engine))


def balls_on_plane(count: int, steps: int) -> Scene:
    """Return a scene of a row of equal balls that fall onto a plane and bounce, at 100 frames per second."""
    return from_document(
        {
            "world": {"gravity": [0, -9.81], "duration": steps * 0.01, "seed": 1},
            "solver": {"dt": 0.01},
            "material": [{"name": "rubber"}],
            "pair": [{"between": ["rubber", "rubber"], "restitution": 0.5, "friction": 0.5}],
            "plane": [{"point": [0, 0], "normal": [0, 1], "material": "rubber"}],
            "grid": [
                {
                    "origin": [0, 1],
                    "columns": count,
                    "rows": 1,
                    "spacing": [0.3, 0.3],
                    "jitter": 0.01,
                    "radius": 0.1,
                    "mass": 1.0,
                    "material": "rubber",
                }
            ],
        }
    )


def single_shot(which: Scene) -> Timed:
    """Return a workload of one complete shot to rest with the list of its events; seconds."""
    table = sandbox.Table(which)
    return lambda: timed(lambda: table.shoot().events)


def shooting(which: Scene, shots: int = 200) -> Timed:
    """Return a workload of complete shots to rest with their events as arrays; mean seconds."""
    table = sandbox.Table(which)
    return lambda: timed(lambda: repeat(table.shoot, shots)) / shots


def batch(which: Scene, shots: int = 200) -> Timed:
    """Return a workload of the same shot many times in one call on one thread, without events; mean seconds."""
    table, motions = sandbox.Table(which), np.tile(motion_of_first(which), (shots, 1))
    return lambda: timed(lambda: table.fan_of(motions, which.bodies.names[0])) / shots


def fanning(which: Scene, shots: int, threads: int) -> Timed:
    """Return a workload of a fan of shots of increasing strength; shots per second."""
    table, motions = sandbox.Table(which), np.multiply.outer(np.linspace(0.9, 1.1, shots), motion_of_first(which))
    return lambda: shots / timed(lambda: table.fan_of(motions, which.bodies.names[0], threads=threads), wall_time)


def motion_of_first(which: Scene) -> FloatArray:
    """Return the velocity and spin (5,) of the first ball, that which is struck."""
    bodies = which.bodies
    return np.array([*bodies.velocity[0], *bodies.roll[0], bodies.angular_velocity[0]])


def stepping(
    which: Scene,
    steps: int,
    record: bool = True,
    contacts: bool = True,
    turning: bool = False,
    engine: str = "pymunk",
) -> Timed:
    """Return a workload of the first steps of a simulation that is set up before; seconds."""

    def work() -> float:
        simulation = start(which, engine)
        if contacts:
            simulation.contacts()
        if turning:
            peers.give_moments(simulation, which)

        def run_all() -> None:
            for _ in range(steps):
                simulation.step()
                if record:
                    simulation.frame()

        return timed(run_all)

    return work


def setting(which: Scene, steps: int, path: str, values: tuple[Any, Any]) -> Timed:
    """Return a workload of changes of a parameter between two values, after as many steps; seconds."""

    def work() -> float:
        simulation = start(which)
        simulation.contacts()
        for _ in range(steps):
            simulation.step()

        def run_all() -> None:
            for k in range(steps):
                simulation.apply(SetParameter(time=0.0, path=path, value=values[k % 2]))

        return timed(run_all)

    return work


def flying(count: int, substeps: int = 1, drag: float = 0.0) -> Callable[[], float]:
    """Return a workload of particles without contacts; particle-steps per second, with every substep counted."""
    which = particles_in_flight(count, substeps, drag)

    def work() -> float:
        simulation = start(which, "pymunk")
        simulation.step()
        frames = max(10, 20_000_000 // (count * substeps))
        seconds = timed(lambda: repeat(simulation.step, frames))
        return count * substeps * frames / seconds

    return work


def particles_in_flight(count: int, substeps: int = 1, drag: float = 0.0) -> Scene:
    """Return a scene of particles without contacts, at 100 frames per second."""
    return from_document(
        {
            "world": {"gravity": [0.0, -9.81], "linear_drag": drag, "wind": [1.0, 0.0], "duration": 1e4},
            "solver": {"dt": 0.01, "substeps": substeps},
            "emitter": [
                {"position": [0, 0], "count": count, "velocity_min": [-20, 10], "velocity_max": [20, 40]},
            ],
        }
    )


def playing(which: Scene) -> Timed:
    """Return a workload of a game with a random player and contacts, without audit; simulated seconds per second."""

    def work() -> float:
        start_time = cpu_time()
        game = sandbox.play_out(which, "random", audit=False)
        return float(game.trajectory.time[-1]) / (cpu_time() - start_time)

    return work


def simulated(which: Scene, seconds: float) -> Timed:
    """Return a workload of bare steps without contacts, frames and rules; simulated seconds per second."""
    steps = round(seconds / which.solver.dt)
    bare = stepping(which, steps, record=False, contacts=False)
    return lambda: seconds / bare()


def command(*arguments: str) -> Timed:
    """Return a workload of a Python process from start to end; seconds. Byte code may be cached, as users have it."""
    line = [sys.executable, *arguments]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return lambda: timed(lambda: subprocess.run(line, check=True, capture_output=True, env=environment), wall_time)


def events(count: int) -> Timed:
    """Return a workload of `exact` in an elastic gas, with thousands of events per step; events per second."""

    def work() -> float:
        gas = peers.gas(count, 100.0)
        simulation = start(gas, "exact", gas.solver.replace(dt=160.0 / count))
        simulation.step()
        start_time, before = cpu_time(), simulation.work["events"]
        while simulation.work["events"] < before + 100_000:
            simulation.step()
        return (simulation.work["events"] - before) / (cpu_time() - start_time)

    return work


def rolling(count: int, floor: bool) -> Callable[[], float]:
    """Return a workload of a gas on pymunk, on a surface with three spins or as discs; steps per second."""
    surface = {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.01}
    more = {"surface": surface, "contact_models": {"ball_ball": "frictional"}} if floor else {}

    def work() -> float:
        simulation = start(peers.gas(count, 1.0, **more), "pymunk")
        steps = 200_000 // (count + 100)
        simulation.step()
        return steps / timed(lambda: repeat(simulation.step, steps))

    return work


def staged(which: Scene, name: str, steps: int = 2000) -> Timed:
    """Return a workload of one stage of a reference step of one ball, "move", "look", "resolve" or "step"; seconds."""

    def work() -> float:
        simulation = ReferenceEngine().start(which)
        h = which.solver.h
        world = WorldState(BodyStore(Setup.of(which), h), simulation.settings)
        motion = world.integrate(h)
        contacts = world.solver.detect(motion)

        def resolve() -> None:
            solution = world.solver.solve(motion, contacts, h)
            world.solver.correct(solution, h)
            world.commit(motion, solution, h)

        stages = {
            "move": lambda: world.integrate(h),
            "look": lambda: world.solver.detect(motion),
            "resolve": resolve,
            "step": simulation.step,
        }
        return timed(lambda: [stages[name]() for _ in range(steps)])

    return work
