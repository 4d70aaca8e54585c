"""Recommended settings from other starts: in how many of them a setting holds that `tradeoff` recommends.

    python -m tools.calibration.starts [--scenes NAME …] [--effort X] [--runs N]

For each scene and each engine with a time step, the cheapest setting within the default tolerance is searched with the
start of the scene only (`starts=1`), and with 30 perturbed starts. Both are then run from N starts that neither search
has seen, each against its own truth.
"""

import argparse
import sys
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

import sandbox
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.proportion import Proportion
from sandbox.measure.starts import DEFAULT_STARTS, Starts
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.provenance import machine, versions
from sandbox.scene.compile.scene import Scene

ENGINES = ("pymunk", "box2d", "reference")
FRAME = 1.0 / 60.0
"""s, longest dt of a recommended setting, unless the scene has a longer one"""
SCENES = (
    "bounce",
    "circle_half_plane",
    "bullet",
    "incline",
    "newtons_cradle",
    "restitution_row",
    "two_balls",
    "oblique",
    "friction_ramp",
    "spring",
    "heavy_on_light",
    "elastic_ball",
    "half_ball",
    "throw",
    "stun_draw_follow",
)
"""Scenes whose truth is trusted to the end and computed within a second, also from other starts."""
FIRST = 1000
"""Number of the first start; the searches use those up to 60."""
HELD = 0.95
"""A setting holds if it is within the tolerance in this fraction of the starts."""


@dataclass(frozen=True)
class Trial:
    """A recommended setting from other starts."""

    scene: str
    engine: str
    starts: int
    """number of starts of the search"""
    point: Evaluation
    tolerance: float
    """m"""
    held: Proportion


def held_in(scene: Scene, point: Evaluation, tolerance: float, runs: int) -> Proportion:
    """Return in how many fresh starts a setting is within the tolerance."""
    starts, hits = Starts(scene, step=max(scene.solver.dt, FRAME)), 0
    for number in range(FIRST, FIRST + runs):
        start = starts.start(number)
        run = sandbox.run(start, point.engine, audit=False, **point.asked.model_dump())
        context = EvaluationContext(start, truth_of(start, scene.solver, tolerance), 1.0)
        error = METRICS["max_position"].measure(run, context) if run.status == "ok" else None
        hits += error is not None and error <= tolerance
    return Proportion(hits, runs)


def trials(name: str, effort: float, runs: int) -> list[Trial]:
    """Return the trials of a scene: of each engine that has a recommended setting with both searches."""
    scene, found = sandbox.load(name), []
    tolerance = default_tolerance(scene)
    for engine in ENGINES:
        picks: list[Trial] = []
        for starts in (1, DEFAULT_STARTS):
            study = sandbox.tradeoff(
                scene, (engine,), metric="max_position", tolerance=tolerance, effort=effort, repeats=1, starts=starts,
                is_explained=False,
            )  # fmt: skip
            best = study.within_tolerance
            if best is not None:
                held = held_in(scene, best.point, tolerance, runs)
                picks.append(Trial(name, engine, starts, best.point, tolerance, held))
        found += picks if len(picks) == 2 else []
    return found


def main() -> int:
    """Print the trials as a table, and the fraction of settings that hold."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="NAME")
    parser.add_argument("--effort", type=float, default=3.0)
    parser.add_argument("--runs", type=int, default=40)
    arguments = parser.parse_args()
    print("| scene | engine | starts | error / tolerance | counted ms per s | held |\n|---|---|---|---|---|---|")
    found: list[Trial] = []
    for name in arguments.scenes:
        for trial in trials(name, arguments.effort, arguments.runs):
            found.append(trial)
            ratio = (trial.point.error or 0.0) / trial.tolerance
            cells = (name, trial.engine, trial.starts, f"{ratio:.2f}", f"{trial.point.counted:.3g}")
            print("|", " | ".join(map(str, cells)), f"| {trial.held.hits} of {trial.held.trials} |", flush=True)
    for starts in (1, DEFAULT_STARTS):
        own = [trial for trial in found if trial.starts == starts]
        holding = Proportion(sum(trial.held.probability >= HELD for trial in own), len(own))
        cost = float(np.exp(np.mean([np.log(trial.point.counted or np.nan) for trial in own])))
        print(f"{starts} starts: {holding.hits} of {holding.trials} hold, {holding}; counted cost {cost:.3g} ms per s")
    print(f"{datetime.now(UTC):%Y-%m-%d}", machine(), versions())
    return 0


if __name__ == "__main__":
    sys.exit(main())
