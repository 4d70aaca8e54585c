"""Cost: what a setting takes, counted and timed.

The counted cost is the same on every machine: the steps and the work counters of a run, each weighted by the seconds
that one takes on the machine it was measured on. It decides what is tried, and in which order. The timed cost is of
this machine, in milliseconds per simulated second; nothing is recorded while it is timed.
"""

import math
import statistics
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import ENGINES, start
from sandbox.interrupt import heeded
from sandbox.measure.compare.patience import TookTooLongError, working
from sandbox.measure.run import run
from sandbox.measure.schedule import schedule
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory

WARM_UP_STEPS = 5
"""Steps that are run before a setting is timed: the first ones load what later ones find in place."""

SECONDS: Mapping[str, Mapping[str, float]] = {
    "pymunk": {
        "steps": 2e-5,
        "step_bodies": 1e-8,
        "substeps": 1e-6,
        "meeting": 1.5e-7,
        "dragged": 5e-6,
        "attracted": 3.5e-5,
        "driven": 1.3e-5,
        "joined": 8e-7,
        "on_floor": 2e-4,
        "contact_iterations": 7e-8,
        "joint_iterations": 1e-8,
    },
    "reference": {
        "steps": 1e-5,
        "step_bodies": 2.5e-8,
        "substeps": 1.6e-5,
        "bodies": 1.2e-8,
        "bodies_rk4": 3e-7,
        "impact_times": 6e-5,
        "attracted": 2e-5,
        "driven": 3e-5,
        "joined": 2e-7,
        "broad_tests": 8e-8,
        "pair_tests": 3e-8,
        "contact_iterations": 2.6e-8,
        "joint_iterations": 1.1e-7,
    },
    "exact": {"steps": 1.3e-5, "step_bodies": 3e-8, "events": 5e-7, "pair_tests": 1e-8},
}
"""s that one of each takes (`_amounts`). Fitted to 199 runs of 21 shipped scenes, two shared x86-64 cores, compiled:
within a factor of 2.5 of the time that was measured, but for 8 runs. An engine that is not here counts as reference."""


def counted_cost(scene: Scene, engine: str, settings: Settings, steps: int, work: Mapping[str, int]) -> float:
    """Return what a run cost by its counters, s of the machine that the weights are of.

    Args:
        scene: what ran.
        engine: its name.
        settings: as the engine filled them in.
        steps: that were made.
        work: as the run counted it.
    """
    amounts = _amounts(scene, settings, steps, work)
    weights = SECONDS.get(engine, SECONDS["reference"])
    return sum(weight * amounts.get(name, 0.0) for name, weight in weights.items())


def _amounts(scene: Scene, settings: Settings, steps: int, work: Mapping[str, int]) -> dict[str, float]:
    """Return how often each of what costs was done; per body and substep where nothing else is said."""
    bodies, substeps = len(scene.bodies), work.get("substeps", 0)
    drag = scene.world.linear_drag or scene.world.quadratic_drag
    meeting = int(meetings(scene).touches.sum())
    return {
        **work,
        "steps": steps,
        "step_bodies": steps * bodies,
        "bodies": substeps * bodies,
        "bodies_rk4": substeps * bodies * (settings.integrator == "rk4"),
        "impact_times": substeps * (settings.detection in ("bisect", "swept", "shrink")),
        "meeting": substeps * meeting,
        "dragged": substeps * meeting * bool(drag),
        "attracted": substeps * bodies * len(scene.attractions),
        "driven": substeps * (len(scene.thrusts) + len(scene.drives)),
        "joined": substeps * len(scene.links),
        "on_floor": substeps * (scene.surface is not None),
    }


def bounded_run(
    scene: Scene, engine: str, settings: Settings, limit: float, deadline: float = math.inf, *, audit: bool = True
) -> tuple[Trajectory, float]:
    """Run a scene, but give it up where it counts more work than a limit.

    Whether it is given up depends on the counters alone, unless there is a deadline.

    Args:
        scene: what to run.
        engine: its name.
        settings: all of them; the scene's own do not count.
        limit: counted cost that it may have, s.
        deadline: by the clock of `working`, s.
        audit: count the contacts that the engine misses.

    Returns:
        The run, and its counted cost.

    Raises:
        TookTooLongError: it went beyond either.
        TooLargeError: the frames would not fit into memory.
    """
    filled = ENGINES[engine].resolve(scene, settings)

    def watch(steps: int, work: Mapping[str, int]) -> None:
        if counted_cost(scene, engine, filled, steps, work) > limit:
            raise TookTooLongError(f"more counted work than the {limit:.3g} that one run may take")
        if working() > deadline:
            raise TookTooLongError("the time limit was reached")

    found = run(scene, engine, audit=audit, watch=watch, **settings.model_dump())
    return found, counted_cost(scene, engine, filled, found.info["steps"], found.info["work"])


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
        for _ in range(min(WARM_UP_STEPS, schedule(scene.world.duration, settings.dt)[0].steps)):
            simulation.step()
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
