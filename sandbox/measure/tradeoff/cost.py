"""Cost of settings, timed on this machine in milliseconds per simulated second; nothing is recorded meanwhile."""

import statistics
from collections.abc import Sequence
from typing import NamedTuple

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import start
from sandbox.interrupt import heeded
from sandbox.measure.bounded_run import working
from sandbox.measure.schedule import schedule
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

WARM_UP_STEPS = 5
"""Steps that are run before a setting is timed: the first ones load what later ones find in place."""


class Cost(NamedTuple):
    """Of separate repeats."""

    least: float
    """ms per simulated second"""
    median: float
    """ms per simulated second"""
    repeats: int

    @classmethod
    def of(cls, seconds: Sequence[float], duration: float) -> "Cost":
        """Return the cost of runs that took so many seconds each, of a scene of a duration, s."""
        scale = 1e3 / duration
        return cls(min(seconds) * scale, statistics.median(seconds) * scale, len(seconds))


@heeded()
def seconds_of(scene: Scene, engine: str, settings: Settings) -> float | None:
    """Step a scene from start to end as a game does, reading every frame, and return the seconds that took.

    Setting up and compiling do not count. None where the run does not get to its end.

    Raises:
        Refusal: the engine lacks something.
    """
    stretches = schedule(scene.world.duration, settings.dt)
    part = stretches[-1].part
    simulation = start(scene, engine, settings)
    try:
        began = working()
        for stretch in stretches:
            for _ in range(stretch.steps):
                simulation.step()
                simulation.frame()
        if part > 0.0:
            simulation.finish(part)
            simulation.frame()
        return working() - began
    except (Divergence, Exhaustion):
        return None
    finally:
        simulation.close()


def warm_up(scene: Scene, engine: str, settings: Settings) -> None:
    """Run the first steps of a scene, so that what is loaded and compiled at first is not timed.

    Raises:
        Refusal: the engine lacks something.
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


def costs(scene: Scene, ways: Sequence[tuple[str, Settings]], repeats: int) -> list[Cost | None]:
    """Time several ways to run a scene, in turns, so that a machine that slows down does so for all of them.

    Args:
        scene: what to run.
        ways: engine and settings of each.
        repeats: how often each is run, after a warm-up.

    Returns:
        The cost of each; None where a way does not get to its end.
    """
    taken: list[list[float]] = [[] for _ in ways]
    failed = [False] * len(ways)
    for engine, settings in ways:
        warm_up(scene, engine, settings)
    for _ in range(repeats):
        for k, (engine, settings) in enumerate(ways):
            if failed[k]:
                continue
            seconds = seconds_of(scene, engine, settings)
            if seconds is None:
                failed[k] = True
            else:
                taken[k].append(seconds)
    duration = scene.world.duration
    return [Cost.of(each, duration) if each and not failed[k] else None for k, each in enumerate(taken)]
