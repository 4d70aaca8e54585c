"""Calibration of forecasts: warnings of `sandbox check` compared with the events of the run, on random scenes.

    python -m tools.calibration.forecast [--half fit|held-out] [--kinds NAME,…] [--seeds N] [--from SEED]
                                         [--engines A,B] [--json]

Every scene of `random_scenes.py` is forecast first, by the formulas alone and with a trial run, and then run in full on
each engine. Rules of this file, independent of the forecasts, decide which troubles occurred. Precision is the fraction
of warnings that came true, recall the fraction of troubles that were forecast; both count (scene, engine, trouble). The
forecasts were fitted on one half, every second kind with even seeds; `held-out` is the other kinds with odd seeds. The
results are reproducible: nothing depends on the clock.
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.energy import energies
from sandbox.measure.preflight import run_preflight, warnings
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tools.calibration.random_scenes import KINDS, document

TROUBLES = {
    "tunnelling": "tunnelling",
    "depth": "depth",
    "chain": "joint",
    "mass_ratio": "joint or stack",
    "stack": "stack",
    "spring": "energy",
    "energy": "energy",
    "iterations": "energy",
    "diverged": "energy",
    "orbit": "energy",
    "event_rate": "events",
}
"""Trouble that each kind of warning forecasts; warnings of other kinds forecast none of these."""

JOINT_OFF, MOVED, ENERGY_GAIN = 0.1, 0.5, 0.1
"""Thresholds of trouble, as fractions of a joint's length, of a stacked body's width, and of the energy at stake."""

Key = tuple[str, int, str, str]
"""kind of scene, seed, engine, trouble"""


@dataclass(frozen=True)
class Observation:
    """One kind of trouble in one run."""

    kind: str
    seed: int
    engine: str
    trouble: str
    formulas: bool
    """whether the formulas alone forecast it"""
    foretold: bool
    """whether the formulas and the trial run forecast it"""
    happened: bool
    half_foretold: bool
    """whether the formulas and a trial run of at most half the scene forecast it"""
    elsewhere: bool | None
    """on the reference: whether formulas and a trial run on pymunk, as without `--engine`, forecast it; else None"""
    covered: bool
    """whether the trial run covered the whole scene"""


def halves() -> dict[str, tuple[tuple[str, ...], int]]:
    """Return the kinds and the parity of the seeds of each half."""
    names = sorted(KINDS)
    return {"fit": (tuple(names[::2]), 0), "held-out": (tuple(names[1::2]), 1)}


def observe(kind: str, seed: int, engines: Iterable[str]) -> Iterator[Observation]:
    """Forecast a scene, run it, and yield forecasts and occurrences on each engine that models it."""
    scene = from_document(document(kind, seed))
    default_preflight = run_preflight(scene)
    default_troubles = troubles(scene, (each.kind for each in default_preflight.warnings))
    for engine in engines:
        if ENGINES[engine].missing(scene, scene.solver):
            continue
        preflight = run_preflight(scene, engine=engine)
        by_formulas = troubles(scene, (each.kind for each in warnings(scene, engine=engine)))
        forecast = troubles(scene, (each.kind for each in preflight.warnings))
        half = troubles(scene, (each.kind for each in run_preflight(scene, engine=engine, cover=0.5).warnings))
        occurred = judge(scene, run(scene, engine), engine)
        for trouble in sorted(occurred):
            elsewhere = (
                trouble in default_troubles if engine == "reference" and default_preflight.tried is not None else None
            )
            row = (
                trouble in by_formulas,
                trouble in forecast,
                occurred[trouble],
                trouble in half,
                elsewhere,
                preflight.covered,
            )
            yield Observation(kind, seed, engine, trouble, *row)


def troubles(scene: Scene, kinds: Iterable[str]) -> set[str]:
    """Return the troubles that warnings of these kinds forecast for a scene."""
    found = {TROUBLES[kind] for kind in kinds if kind in TROUBLES}
    if "joint or stack" in found:
        found = found - {"joint or stack"} | {"joint" if len(scene.joint_arrays) else "stack"}
    return found


def judge(scene: Scene, done: Trajectory, engine: str) -> dict[str, bool]:
    """Return for each trouble that is possible in a run whether it occurred."""
    if engine == "exact":
        return {"events": done.status == "failed"}
    completed = done.status == "ok" and bool(np.isfinite(done.position).all())
    found = {"energy": not completed or energy_gain(scene, done) > ENERGY_GAIN}
    if contact_matrix(scene).touches.any():
        found["tunnelling"] = len(done.missed_time) > 0
    if scene.planes and completed:
        found["depth"] = is_behind_plane(scene, done)
    if done.info["joint_error"] is not None:
        found["joint"] = not done.info["joint_error"] <= JOINT_OFF
    starts_at_rest = not scene.bodies.velocity.any() and not scene.bodies.fixed.any()
    if (scene.stacks or len(scene.boxes) > 1) and starts_at_rest and not (scene.balls or scene.thrusts or scene.joints):
        displacement = np.hypot(*np.moveaxis(done.position - done.position[0], 2, 0)).max(axis=0)
        found["stack"] = not completed or bool((displacement > MOVED * 2.0 * scene.bodies.thin).any())
    if found.get("joint") or found.get("stack"):
        del found["energy"]  # broken joints and falling stacks gain energy too: one trouble, counted once
    return found


def energy_gain(scene: Scene, done: Trajectory) -> float:
    """Return the gain of energy, as a fraction of the initial kinetic energy and the range of the potential energy.

    The reference is at least the energy that lifts every body by its own width, for bodies at rest. The result is 0 if
    thrusts, motors or wind do work.
    """
    if scene.thrusts or any(scene.world.wind) or len(scene.joint_arrays.of(JointKind.MOTOR)):
        return 0.0
    kinetic, potential, total = energies(done, scene)
    bodies = scene.bodies
    lift_energy = float(np.hypot(*scene.world.gravity)) * float((bodies.mass * 2.0 * bodies.thin)[~bodies.fixed].sum())
    stake = max(float(kinetic[0]) + float(np.ptp(potential)), lift_energy)
    return float(total.max() - total[0]) / stake if stake > 0.0 else 0.0


def is_behind_plane(scene: Scene, done: Trajectory) -> bool:
    """Return whether a centre that started in front of a plane was behind it later."""
    for plane in scene.fixed:
        if isinstance(plane, Plane):
            normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
            height = (done.position[:, ~scene.bodies.fixed] - np.asarray(plane.point)) @ normal
            if bool(((height < 0.0) & (height[0] > 0.0)).any()):
                return True
    return False


def confusion(rows: Iterable[Observation], of: str = "foretold") -> Counter[tuple[bool, bool]]:
    """Count by (foretold, happened)."""
    return Counter((bool(getattr(row, of)), row.happened) for row in rows)


def shares(count: Counter[tuple[bool, bool]]) -> dict[str, Any]:
    """Return a confusion table with precision and recall; None for a ratio without cases."""
    hits, alarms, missed = count[True, True], count[True, False], count[False, True]
    return {
        "true_positives": hits,
        "false_positives": alarms,
        "false_negatives": missed,
        "true_negatives": count[False, False],
        "precision": hits / (hits + alarms) if hits + alarms else None,
        "recall": hits / (hits + missed) if hits + missed else None,
    }


def summary(rows: list[Observation]) -> dict[str, Any]:
    """Return all confusion tables: over all, and by trouble, kind of scene and engine."""
    subsets = {
        "all": rows,
        "trial run covers all": [row for row in rows if row.covered],
        "trial run covers a part": [row for row in rows if not row.covered],
    }
    return {
        "foretold": {name: shares(confusion(subset)) for name, subset in subsets.items()},
        "trial run on another engine": {
            "all": shares(confusion((row for row in rows if row.elsewhere is not None), "elsewhere"))
        },
        "trial run of half": {name: shares(confusion(subset, "half_foretold")) for name, subset in subsets.items()},
        "by formulas alone": {name: shares(confusion(subset, "formulas")) for name, subset in subsets.items()},
        **{
            f"by {key}": {
                name: shares(confusion(row for row in rows if getattr(row, key) == name))
                for name in sorted({getattr(row, key) for row in rows})
            }
            for key in ("trouble", "kind", "engine")
        },
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kinds", metavar="NAME[,NAME]", help=f"which; by default those of the half: {', '.join(KINDS)}"
    )
    parser.add_argument("--seeds", type=int, default=4, metavar="N", help="scenes of each kind")
    parser.add_argument("--from", type=int, default=0, dest="first", metavar="SEED", help="the first seed, rounded up")
    parser.add_argument("--engines", default="pymunk,reference,exact", metavar="NAME[,NAME]")
    parser.add_argument("--half", choices=("fit", "held-out"), default="held-out")
    parser.add_argument("--json", action="store_true", dest="as_json")
    arguments = parser.parse_args()
    names, parity = halves()[arguments.half]
    names = tuple(arguments.kinds.split(",")) if arguments.kinds else names
    unknown = [name for name in names if name not in KINDS]
    if unknown:
        parser.error(f"no kind {', '.join(unknown)}")
    first = arguments.first + (parity - arguments.first) % 2
    rows: list[Observation] = []
    for name in names:
        for seed in range(first, first + 2 * arguments.seeds, 2):
            rows += observe(name, seed, arguments.engines.split(","))
            print(f"\r\033[K{name} {seed}", end="", file=sys.stderr, flush=True)
    print("\r\033[K", end="", file=sys.stderr)
    found = summary(rows)
    wrong = [row for row in rows if row.foretold != row.happened]
    if arguments.as_json:
        print(json.dumps({"half": arguments.half, **found, "wrong": [vars(row) for row in wrong]}, indent=1))
        return 0
    for title, tables in found.items():
        print(f"\n{title:<28}{'came':>6}{'did not':>9}{'unforeseen':>12}{'silent':>8}{'precision':>11}{'recall':>8}")
        for name, each in tables.items():
            counts = [each[key] for key in ("true_positives", "false_positives", "false_negatives", "true_negatives")]
            ratios = ("–" if each[key] is None else f"{each[key]:.1%}" for key in ("precision", "recall"))
            print(
                f"{name:<28}{counts[0]:>6}{counts[1]:>9}{counts[2]:>12}{counts[3]:>8}" + "{:>11}{:>8}".format(*ratios)
            )
    for row in wrong:
        label = "unforeseen" if row.happened else "false alarm"
        print(f"{label}: {row.trouble} in {row.kind}, seed {row.seed}, on {row.engine}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
