"""Cost of configurations, timed on this machine in milliseconds per simulated second, without recording."""

import statistics
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import start
from sandbox.measure.run.bounded_run import clock_without_compilation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.schedule import schedule
from sandbox.signals import reraise_interrupt

WARM_UP_STEPS = 5
"""Steps made before a configuration is timed: the first steps load code and allocate memory."""


class Timing(NamedTuple):
    """Cost from separate repeats."""

    least: float
    """ms per simulated second"""
    median: float
    """ms per simulated second"""
    repeats: int

    @classmethod
    def of(cls, seconds: Sequence[float], duration: float) -> "Timing":
        """Return the cost of runs from the time that each took, s, and the simulated duration, s."""
        scale = 1e3 / duration
        return cls(min(seconds) * scale, statistics.median(seconds) * scale, len(seconds))


class TimedRun(NamedTuple):
    """A run to be timed."""

    scene: Scene
    engine: str
    settings: Settings


def time_in_turns(runs: Sequence[TimedRun], repeats: int) -> list[Timing | None]:
    """Time several runs in turns, so that a change of the machine's speed affects all of them.

    Args:
        runs: the runs.
        repeats: number of runs of each, after a warm-up.

    Returns:
        The cost of each run; None if it does not reach its end.
    """
    for run in runs:
        warm_up(*run)
    taken = take_turns([partial(run_seconds, *run) for run in runs], repeats)
    return [Timing.of(each, run.scene.world.duration) if each else None for run, each in zip(runs, taken, strict=True)]


def take_turns(timers: Sequence[Callable[[], float | None]], repeats: int) -> list[list[float]]:
    """Call several timers in turns and return the times of each, s; an empty list for a timer that failed.

    A timer that failed is not called again.

    Args:
        timers: each returns a time, s, or None if it failed.
        repeats: number of turns.
    """
    times: list[list[float]] = [[] for _ in timers]
    failed = [False] * len(timers)
    for _ in range(repeats):
        for k, timer in enumerate(timers):
            if failed[k]:
                continue
            seconds = timer()
            if seconds is None:
                failed[k] = True
                times[k].clear()
            else:
                times[k].append(seconds)
    return times


@reraise_interrupt()
def run_seconds(scene: Scene, engine: str, settings: Settings) -> float | None:
    """Step a scene to its end as a game does, reading every frame, and return the time that this took, s.

    Start-up and compilation do not count. None if the run does not reach its end.

    Raises:
        Refusal: the engine does not support the scene or a setting.
    """
    stretches = schedule(scene.world.duration, settings.dt)
    part = stretches[-1].part
    simulation = start(scene, engine, settings)
    try:
        began = clock_without_compilation()
        for stretch in stretches:
            for _ in range(stretch.steps):
                simulation.step()
                simulation.frame()
        if part > 0.0:
            simulation.finish(part)
            simulation.frame()
        return clock_without_compilation() - began
    except (Divergence, Exhaustion):
        return None
    finally:
        simulation.close()


def warm_up(scene: Scene, engine: str, settings: Settings) -> None:
    """Make the first steps of a run, so that loading and compilation are not timed.

    Raises:
        Refusal: the engine does not support the scene or a setting.
    """
    simulation = start(scene, engine, settings)
    try:
        stretches = schedule(scene.world.duration, settings.dt)
        for _ in range(min(WARM_UP_STEPS, stretches[0].steps)):
            simulation.step()
            simulation.frame()
        if not stretches[0].steps:
            simulation.finish(stretches[-1].part)
            simulation.frame()
    except (Divergence, Exhaustion):
        return
    finally:
        simulation.close()
