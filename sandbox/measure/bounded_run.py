"""Bounded runs: a run is given up where it counts more work than a limit.

The counted cost is the same on every machine: the steps and the work counters of a run, each weighted by the seconds
that one takes on the machine it was measured on. So what is given up depends on no clock, and neither does an answer
that is found by trying runs: a truth, a trade-off.
"""

import math
from collections.abc import Mapping
from time import perf_counter

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.registry import ENGINES
from sandbox.measure.run import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

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


def counted_cost(start: Scene | Setup, engine: str, settings: Settings, steps: int, work: Mapping[str, int]) -> float:
    """Return what a run cost by its counters, s of the machine that the weights are of.

    Args:
        start: scene or setup that ran.
        engine: its name.
        settings: as the engine filled them in.
        steps: that were made.
        work: as the run counted it.
    """
    amounts = _amounts(Setup.of(start), settings, steps, work)
    weights = SECONDS.get(engine, SECONDS["reference"])
    return sum(weight * amounts.get(name, 0.0) for name, weight in weights.items())


def _amounts(setup: Setup, settings: Settings, steps: int, work: Mapping[str, int]) -> dict[str, float]:
    """Return how often each of what costs was done; per body and substep where nothing else is said."""
    scene, bodies, substeps = setup.scene, len(setup.bodies), work.get("substeps", 0)
    drag = scene.world.linear_drag or scene.world.quadratic_drag
    meeting = int(contact_matrix(setup).touches.sum())
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
        "joined": substeps * len(setup.links),
        "on_floor": substeps * (scene.surface is not None),
    }


def bounded_run(
    start: Scene | Setup,
    engine: str,
    settings: Settings,
    limit: float,
    deadline: float = math.inf,
    *,
    audit: bool = True,
) -> tuple[Trajectory, float]:
    """Run a scene, but give it up where it counts more work than a limit.

    Whether it is given up depends on the counters alone, unless there is a deadline.

    Args:
        start: scene or setup to run.
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
    setup = Setup.of(start)
    filled = ENGINES[engine].resolve(setup, settings)

    def watch(steps: int, work: Mapping[str, int]) -> None:
        if counted_cost(setup, engine, filled, steps, work) > limit:
            raise TookTooLongError(f"more counted work than the limit of {limit:.3g} for one run")
        if working() > deadline:
            raise TookTooLongError("the time limit was reached")

    found = run(setup, engine, audit=audit, watch=watch, **settings.model_dump())
    return found, counted_cost(setup, engine, filled, found.info["steps"], found.info["work"])


class TookTooLongError(Exception):
    """A run was given up."""


def working() -> float:
    """Return the time by a clock that stands still while something is compiled, s: only differences mean anything."""
    return perf_counter() - COMPILE_CLOCK.seconds
