"""Bounded runs: a run is stopped once its counted work exceeds a limit.

The counted cost is the same on every machine: the steps and the work counters of a run, each weighted with its time on
the machine on which the weights were measured. Which runs are stopped therefore depends on no clock, and neither do
results that are found by trying runs: a truth, a trade-off.
"""

import math
from collections.abc import Mapping

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

COST_WEIGHTS: Mapping[str, Mapping[str, float]] = {
    "pymunk": {
        "steps": 3.4e-6,
        "step_bodies": 3.9e-7,
        "substeps": 1.3e-6,
        "meeting": 2.7e-7,
        "dragged": 1.1e-4,
        "attracted": 1e-4,
        "driven": 1.3e-5,
        "joined": 4.5e-7,
        "springs": 4.2e-7,
        "on_floor": 1.4e-4,
        "zoned": 2.4e-5,
        "tyred": 5e-6,
        "tyres": 3.4e-6,
        "liquids": 1.4e-4,
        "immersed": 1.2e-6,
        "contact_iterations": 1.6e-7,
        "joint_iterations": 1.5e-8,
    },
    "box2d": {
        "steps": 1.4e-5,
        "step_bodies": 6.4e-7,
        "meeting": 3.3e-7,
        "attracted": 3.9e-4,
        "driven": 3e-5,
        "springs": 1.2e-3,
        "tyred": 1.2e-4,
        "tyres": 2.2e-6,
        "liquids": 1.5e-4,
        "immersed": 2.7e-6,
    },
    "reference": {
        "steps": 1e-6,
        "step_bodies": 3.3e-7,
        "substeps": 1.2e-7,
        "bodies_rk4": 7.8e-9,
        "impact_times": 6e-5,
        "attracted": 7e-5,
        "attracted_rk4": 1.3e-4,
        "driven": 3e-5,
        "joined": 1.3e-7,
        "springs": 1.7e-4,
        "on_floor": 2.2e-4,
        "tyred": 1.1e-4,
        "tyres": 1.8e-6,
        "liquids": 7.6e-5,
        "immersed": 4e-7,
        "broad_tests": 4.8e-8,
        "pair_tests": 1.9e-8,
        "contact_iterations": 7.6e-8,
        "joint_iterations": 3.3e-8,
    },
    "exact": {"steps": 1.3e-5, "step_bodies": 3e-8, "events": 5e-7, "pair_tests": 1e-8},
}
"""s per unit of each amount (`_amounts`), by engine. Fitted to 210 runs of the shipped scenes up to 3,000 bodies, by
relative error, on two shared x86-64 cores: within a factor of 2.5 of the measured time in all but 18. Other engines
have the weights of reference. `zoned` on pymunk is that of `overpass`, whose substeps are observed one by one.
`liquids` and `immersed` follow from 300 steps with 1 and 200 boxes afloat, less those without the liquid,
`tyred` and `tyres` from 300 steps with 1 and 50 cars on four tyres each, less those without tyres.
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

    Without a deadline, whether the run is stopped depends on the counters alone. Bodies that events of the scene add
    are left out of the result.

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
    cost = counted_cost(setup, engine, resolved, found.info["steps"], found.info["work"])
    return found.of_first(len(setup.bodies)), cost


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
        "bodies_rk4": substeps * bodies * (settings.integrator == "rk4"),
        "impact_times": substeps * (settings.detection in ("bisect", "swept", "shrink")),
        "meeting": substeps * colliding,
        "dragged": substeps * colliding * scene.world.has_drag,
        "attracted": substeps * bodies * len(scene.attractions),
        "attracted_rk4": substeps * bodies * len(scene.attractions) * (settings.integrator == "rk4"),
        "driven": substeps * (len(scene.thrusts) + len(scene.drives)),
        "joined": substeps * len(setup.joints),
        "springs": substeps * len(setup.joints.of(JointKind.SPRING, JointKind.ROTARY_SPRING)),
        "on_floor": substeps * (scene.surface is not None),
        "zoned": substeps * bool(scene.zones),
        "tyred": substeps * bool(scene.tyres),
        "tyres": substeps * len(scene.tyres),
        "liquids": substeps * bool(scene.liquids),
        "immersed": substeps * bodies * len(scene.liquids),
    }
