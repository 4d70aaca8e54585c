"""Bounded runs: a run is stopped once its counted work exceeds a limit.

The counted cost is the same on every machine: the steps and the work counters of a run, each weighted with its time on
the machine on which the weights were measured. Which runs are stopped therefore depends on no clock, and neither do
results that are found by trying runs: a truth, a trade-off.
"""

import math
from collections.abc import Mapping
from time import perf_counter

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

COST_WEIGHTS: Mapping[str, Mapping[str, float]] = {
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
"""s per unit of each amount (`_amounts`), by engine. Fitted to 199 compiled runs of 21 shipped scenes on two shared
x86-64 cores: within a factor of 2.5 of the measured time in all but 8 runs. Other engines have the weights of
reference.
"""


class RunTimeoutError(Exception):
    """A run was stopped because it exceeded a limit of work or time."""


def bounded_run(
    start: Scene | Setup,
    engine: str,
    settings: Settings,
    limit: float,
    deadline: float = math.inf,
    *,
    audit: bool = True,
) -> tuple[Trajectory, float]:
    """Run a scene, but stop once its counted cost exceeds a limit.

    Without a deadline, whether the run is stopped depends on the counters alone.

    Args:
        start: scene or setup to run.
        engine: name of the engine.
        settings: all settings; those of the scene are not used.
        limit: counted cost that the run may have, s.
        deadline: time of `clock_without_compilation` after which the run is stopped, s.
        audit: count the contacts that the engine misses.

    Returns:
        The run, and its counted cost, s.

    Raises:
        RunTimeoutError: the run exceeded the limit or the deadline.
        TooLargeError: the frames would not fit into memory.
    """
    setup = Setup.of(start)
    resolved = ENGINES[engine].resolve(setup, settings)

    def check(steps: int, work: Mapping[str, int]) -> None:
        if counted_cost(setup, engine, resolved, steps, work) > limit:
            raise RunTimeoutError(f"more counted work than the limit of {limit:.3g} for one run")
        if clock_without_compilation() > deadline:
            raise RunTimeoutError("the time limit was reached")

    found = run(setup, engine, audit=audit, on_work=check, **settings.model_dump())
    return found, counted_cost(setup, engine, resolved, found.info["steps"], found.info["work"])


def counted_cost(start: Scene | Setup, engine: str, settings: Settings, steps: int, work: Mapping[str, int]) -> float:
    """Return the cost of a run computed from its counters, s on the machine of the weights.

    Args:
        start: scene or setup of the run.
        engine: name of the engine.
        settings: settings as the engine resolved them.
        steps: number of steps.
        work: work counters of the run.
    """
    amounts = _amounts(Setup.of(start), settings, steps, work)
    weights = COST_WEIGHTS.get(engine, COST_WEIGHTS["reference"])
    return sum(weight * amounts.get(name, 0.0) for name, weight in weights.items())


def _amounts(setup: Setup, settings: Settings, steps: int, work: Mapping[str, int]) -> dict[str, float]:
    """Return the amount of each kind of work; unless stated otherwise, bodies × substeps."""
    scene, bodies, substeps = setup.scene, len(setup.bodies), work.get("substeps", 0)
    colliding = int(contact_matrix(setup).touches.sum())
    return {
        **work,
        "steps": steps,
        "step_bodies": steps * bodies,
        "bodies": substeps * bodies,
        "bodies_rk4": substeps * bodies * (settings.integrator == "rk4"),
        "impact_times": substeps * (settings.detection in ("bisect", "swept", "shrink")),
        "meeting": substeps * colliding,
        "dragged": substeps * colliding * scene.world.has_drag,
        "attracted": substeps * bodies * len(scene.attractions),
        "driven": substeps * (len(scene.thrusts) + len(scene.drives)),
        "joined": substeps * len(setup.links),
        "on_floor": substeps * (scene.surface is not None),
    }


def clock_without_compilation() -> float:
    """Return the time of a clock that stops while code is compiled, s; only differences are meaningful."""
    return perf_counter() - COMPILE_CLOCK.seconds
