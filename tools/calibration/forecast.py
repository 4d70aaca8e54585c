"""Calibration of forecasts: warnings of `sandbox check` compared with runs from other starts, on random scenes.

    python -m tools.calibration.forecast [--half fit|held-out] [--kinds NAME,…] [--seeds N] [--from SEED]
                                         [--engines A,B] [--fresh N] [--workers N] [--json FILE] [--plot FILE]

Every scene of `random_scenes.py` is forecast on each engine in three ways: as `check --engine` does it; as for a scene
twice as long as its trial runs, which then cover half of it; and by formulas alone. Then it is run in full from fresh
starts, whose numbers the forecasts do not use, and rules of this file, independent of the forecasts, decide in how many
of them each trouble occurs. A case is a scene, an engine and a trouble that is possible there.

- Recall: of the cases with the trouble in at least half of the starts, the fraction with a warning.
- Precision: of the cases with a warning, the fraction with the trouble in the file or in at least one of the starts.
- Stated odds: the fraction of the trial runs that show it; the upper bound of a formula where none does; 0 without a
  warning. Brier score: mean square of the difference to what happened in a start.

The forecasts were fitted on one half, every second kind with even seeds; `held-out` is the other kinds with odd seeds,
to which the kinds with features that no forecast was fitted to belong. The results are reproducible: nothing depends on
the clock.
"""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.invariants import CONSTRAINT_KINDS
from sandbox.measure.preflight import Diagnostic, run_preflight, warnings
from sandbox.measure.proportion import Proportion
from sandbox.measure.run.runner import run
from sandbox.measure.starts import Starts
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import MOTORS
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tools.calibration.random_scenes import KINDS, document

TROUBLES = {
    "tunnelling": ("tunnelling",),
    "depth": ("depth",),
    "chain": ("joint",),
    "mass_ratio": ("joint", "stack"),
    "stack": ("stack",),
    "spring": ("energy",),
    "energy": ("energy",),
    "iterations": ("energy",),
    "diverged": ("energy", "joint", "stack"),
    "orbit": ("energy",),
    "event_rate": ("events",),
}
"""Troubles that each kind of warning forecasts, where they are possible; other kinds forecast none of these."""

JOINT_OFF, MOVED, ENERGY_GAIN = 0.1, 0.5, 0.1
"""Thresholds of trouble, as fractions of a joint's length, of a stacked body's width, and of the energy at stake."""

FIRST_FRESH = 1_000
"""Number of the first fresh start: those of forecasts are smaller."""
MAX_EXACT_FRESH = 3
"""Fresh starts on `exact`, whose failures take long and hardly depend on the start."""

STORED = Path(__file__).resolve().parent / "forecast.json"
"""Cases of the held-out half, which docs/results/forecast.md states"""

WAYS = ("check", "long scene", "formulas")
"""Ways to forecast; the second with trial runs of half the scene"""

BINS = (0.0, 1e-9, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0 + 1e-9)
"""Bounds of the bins of stated odds; the first has those of 0."""
MIN_DRAWN = 5
"""A bin with fewer cases is not drawn."""
RESAMPLES = 2_000
"""Resamples of the cases of a bin, for the interval of its frequency."""


@dataclass(frozen=True)
class Case:
    """One kind of trouble of one scene on one engine."""

    kind: str
    seed: int
    engine: str
    trouble: str
    odds: Mapping[str, float | None]
    """stated odds by way of forecasting; None: no warning; -1: a warning without odds"""
    hits: int
    """fresh starts in which it occurs"""
    starts: int
    """number of fresh starts"""
    in_file: bool
    """whether it occurs from the start of the file"""
    covered: bool
    """whether the trial runs covered the whole scene"""

    @property
    def frequency(self) -> float:
        """Fraction of the fresh starts in which it occurs."""
        return self.hits / self.starts

    def is_warned(self, way: str) -> bool:
        """Return whether there is a warning."""
        return self.odds[way] is not None

    @property
    def happened(self) -> bool:
        """Whether it occurs from any start."""
        return self.in_file or self.hits > 0


NEW_KINDS = 8
"""Kinds at the end of the list, all held out: their features were added after the forecasts were fitted."""


def halves() -> dict[str, tuple[tuple[str, ...], int]]:
    """Return the kinds and the parity of the seeds of each half."""
    names, new = sorted([*KINDS][:-NEW_KINDS]), [*KINDS][-NEW_KINDS:]
    return {"fit": (tuple(names[::2]), 0), "held-out": (tuple(sorted([*names[1::2], *new])), 1)}


def cases_of(kind: str, seed: int, engines: Iterable[str], fresh: int) -> list[Case]:
    """Forecast a scene, run it from fresh starts, and return its cases on each engine that models it."""
    scene = from_document(document(kind, seed))
    found = []
    for engine in engines:
        if ENGINES[engine].missing(scene, scene.solver):
            continue
        checked = run_preflight(scene, engine=engine)
        forecasts = {
            "check": odds_of(scene, checked.warnings),
            "long scene": odds_of(scene, run_preflight(scene, engine=engine, cover=0.5).warnings),
            "formulas": odds_of(scene, warnings(scene, engine=engine)),
        }
        in_file = judge(scene, run(scene, engine), engine)
        drawn, count = Starts(scene), min(fresh, MAX_EXACT_FRESH) if engine == "exact" else fresh
        starts = [drawn.start(FIRST_FRESH + k) for k in range(count)]
        occurred = [judge(scene, run(start, engine), engine) for start in starts]
        for trouble in sorted(in_file):
            odds = {way: forecast.get(trouble) for way, forecast in forecasts.items()}
            hits = sum(each[trouble] for each in occurred)
            found.append(Case(kind, seed, engine, trouble, odds, hits, len(starts), in_file[trouble], checked.covered))
    return found


def odds_of(scene: Scene, found: Iterable[Diagnostic]) -> dict[str, float]:
    """Return the stated odds of each trouble that warnings forecast; −1 if none of its warnings states any."""
    stated: dict[str, float] = {}
    for each in found:
        for trouble in TROUBLES.get(each.kind, ()):
            if each.kind == "mass_ratio" and (trouble == "joint") != bool(len(scene.joint_arrays)):
                continue
            stated[trouble] = max(stated.get(trouble, -1.0), -1.0 if each.odds is None else each.odds)
    return stated


def judge(scene: Scene, done: Trajectory, engine: str) -> dict[str, bool]:
    """Return for each trouble that is possible in a run of a scene, from any start, whether it occurred."""
    if engine == "exact":
        return {"events": done.status == "failed"}
    completed = done.status == "ok" and bool(np.isfinite(done.position).all())
    found = {"energy": not completed or energy_gain(scene, done) > ENERGY_GAIN}
    if contact_matrix(scene).touches.any():
        found["tunnelling"] = len(done.missed_time) > 0
    if scene.planes:
        found["depth"] = completed and is_behind_plane(scene, done)
    if len(scene.joint_arrays.of(*CONSTRAINT_KINDS)):
        error = done.info["joint_error"]
        found["joint"] = not completed or (error is not None and not error <= JOINT_OFF)
    starts_at_rest = not scene.bodies.velocity.any() and not scene.bodies.fixed.any()
    is_carried = any(each.surface_speed for each in scene.fixed)
    others = scene.balls or scene.thrusts or scene.joints or is_carried
    if (scene.stacks or len(scene.boxes) > 1) and starts_at_rest and not others:
        displacement = np.hypot(*np.moveaxis(done.position - done.position[0], 2, 0)).max(axis=0)
        found["stack"] = not completed or bool((displacement > MOVED * 2.0 * scene.bodies.thin).any())
    # Broken joints and falling stacks gain energy too, and a run that diverges has all of these: one trouble.
    if "joint" in found or "stack" in found:
        del found["energy"]
    return found


def energy_gain(scene: Scene, done: Trajectory) -> float:
    """Return the gain of energy, as a fraction of the initial kinetic energy and the range of the potential energy.

    The reference is at least the energy that lifts every body by its own width, for bodies at rest. The result is 0 if
    thrusts, motors, moving surfaces, kinematic bodies or wind do work.
    """
    motors = len(scene.joint_arrays.of(*MOTORS))
    belts = any(each.surface_speed for each in scene.fixed)
    if scene.thrusts or any(scene.world.wind) or motors or belts or scene.bodies.kinematic.any():
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


def recall(cases: Iterable[Case], way: str) -> Proportion:
    """Return how many of the cases with the trouble in at least half of the starts have a warning."""
    frequent = [each.is_warned(way) for each in cases if each.frequency >= 0.5]
    return Proportion(sum(frequent), len(frequent))


def precision(cases: Iterable[Case], way: str) -> Proportion:
    """Return how many of the cases with a warning have the trouble in the file or in any fresh start."""
    warned = [each.happened for each in cases if each.is_warned(way)]
    return Proportion(sum(warned), len(warned))


@dataclass(frozen=True)
class OddsBin:
    """Cases whose stated odds are in one interval."""

    cases: int
    stated: float
    """mean of the stated odds"""
    frequency: float
    """fraction of the fresh starts with the trouble, mean over the cases"""
    low: float
    """lower end of the 95 % interval of the frequency, from resampled cases"""
    high: float
    """upper end"""

    @property
    def holds(self) -> bool:
        """Whether the stated odds lie within the interval of the frequency."""
        return self.low <= self.stated <= self.high


def reliability(cases: Iterable[Case], way: str) -> list[OddsBin]:
    """Return the bins of the stated odds, without empty ones; warnings without odds are left out.

    The interval is that of the mean frequency over resampled cases, widened to Wilson's interval of one trial for each
    case: cases that all agree, as all with odds of 1, would give an interval without width.
    """
    stated, happened = odds_and_frequencies(cases, way)
    random = np.random.default_rng(0)
    found = []
    for low, high in pairwise(BINS):
        inside = (stated >= low) & (stated < high)
        if not inside.any():
            continue
        some = happened[inside]
        means = random.choice(some, (RESAMPLES, len(some))).mean(axis=1)
        bounds = np.quantile(means, (0.025, 0.975))
        wilson = Proportion(round(float(some.sum())), len(some)).interval
        ends = min(float(bounds[0]), wilson[0]), max(float(bounds[1]), wilson[1])
        found.append(OddsBin(len(some), float(stated[inside].mean()), float(some.mean()), *ends))
    return found


def odds_and_frequencies(cases: Iterable[Case], way: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the stated odds of cases, 0 without a warning, and the frequencies; without warnings that state none."""
    pairs = [(each.odds[way] or 0.0, each.frequency) for each in cases if each.odds[way] != -1.0]
    table = np.asarray(pairs, np.float64).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def brier_score(cases: Iterable[Case], way: str) -> float:
    """Return the mean over cases and starts of (stated odds − outcome)², with 1 for the trouble and 0 without it."""
    stated, frequency = odds_and_frequencies(cases, way)
    return float(((stated - frequency) ** 2 + frequency * (1.0 - frequency)).mean())


def subsets(cases: Sequence[Case]) -> Iterator[tuple[str, list[Case]]]:
    """Yield all cases, and those of each engine, trouble and group of kinds."""
    yield "all", [*cases]
    for key in ("engine", "trouble"):
        for name in sorted({getattr(each, key) for each in cases}):
            yield f"{key} {name}", [each for each in cases if getattr(each, key) == name]
    new = {*[*KINDS][-NEW_KINDS:]}
    if recent := [each for each in cases if each.kind in new]:
        yield "kinds with later features", recent


def summary(cases: Sequence[Case]) -> dict[str, Any]:
    """Return the scores of each way to forecast, over all cases and by subsets."""
    found: dict[str, Any] = {}
    for way in WAYS:
        scores = {
            name: {"recall": recall(some, way), "precision": precision(some, way)} for name, some in subsets(cases)
        }
        found[way] = {"scores": scores, "bins": reliability(cases, way), "brier": brier_score(cases, way)}
    return found


def write_cases(cases: Iterable[Case], half: str, path: Path) -> None:
    """Write cases, one a line, with four digits of the odds."""
    rows = []
    for each in cases:
        odds = {way: None if stated is None else round(stated, 4) for way, stated in each.odds.items()}
        rows.append(json.dumps({**asdict(each), "odds": odds}, separators=(",", ":")))
    path.write_text(f'{{"half":"{half}","cases":[\n' + ",\n".join(rows) + "\n]}\n", encoding="utf-8")


def read_cases(path: Path) -> list[Case]:
    """Return the cases of a file."""
    return [Case(**each) for each in json.loads(path.read_text(encoding="utf-8"))["cases"]]


def plot(found: Mapping[str, Any], path: Path) -> None:
    """Draw the reliability diagram of the first two ways to forecast, with the number of cases at each point."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5.2, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1)
    axes.annotate("line: stated odds are right", (0.58, 0.06), color="0.45", fontsize=9)
    for way, colour, shift in (("check", "#2b6cb0", -0.006), ("long scene", "#c05621", 0.006)):
        bins = [each for each in found[way]["bins"] if each.cases >= MIN_DRAWN]
        x = [each.stated + shift for each in bins]
        y = [each.frequency for each in bins]
        reach = [[each.frequency - each.low for each in bins], [each.high - each.frequency for each in bins]]
        axes.errorbar(x, y, reach, fmt="o", color=colour, capsize=3, label=way)
        for at, each in zip(x, bins, strict=True):
            side = -1 if way == "check" else 1
            axes.annotate(f"{each.cases}", (at, each.frequency), (side * 7, 4), textcoords="offset points",
                          ha="right" if side < 0 else "left", fontsize=8, color=colour)  # fmt: skip
    axes.set(xlabel="stated odds", ylabel="frequency in fresh starts", xlim=(-0.08, 1.08), ylim=(-0.04, 1.04))
    axes.legend(loc="upper left", frameon=False)
    figure.savefig(path, dpi=80)


def print_summary(found: Mapping[str, Any]) -> None:
    """Print the scores and the bins."""
    for way, each in found.items():
        print(f"\n{way}: Brier score {each['brier']:.3f}")
        for name, scores in each["scores"].items():
            counts = (f"{scores[key].hits:>4} of {scores[key].trials:<4} {scores[key]!s:<42}" for key in scores)
            print(f"  {name:<28}{''.join(counts)}")
        for each_bin in each["bins"]:
            mark = "" if each_bin.holds else "  outside"
            print(
                f"  stated {100 * each_bin.stated:5.1f} %: {100 * each_bin.frequency:5.1f} % "
                f"({100 * each_bin.low:.1f} to {100 * each_bin.high:.1f} %) of {each_bin.cases} cases{mark}"
            )


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--kinds", metavar="NAME[,NAME]", help=f"which; by default those of the half: {', '.join(KINDS)}"
    )
    parser.add_argument("--seeds", type=int, default=4, metavar="N", help="scenes of each kind")
    parser.add_argument("--from", type=int, default=0, dest="first", metavar="SEED", help="the first seed, rounded up")
    parser.add_argument("--engines", default="pymunk,box2d,reference,exact", metavar="NAME[,NAME]")
    parser.add_argument("--half", choices=("fit", "held-out"), default="held-out")
    parser.add_argument("--fresh", type=int, default=20, metavar="N", help="fresh starts of each scene")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all cases")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="draw the reliability diagram")
    arguments = parser.parse_args()
    names, parity = halves()[arguments.half]
    names = tuple(arguments.kinds.split(",")) if arguments.kinds else names
    unknown = [name for name in names if name not in KINDS]
    if unknown:
        parser.error(f"no kind {', '.join(unknown)}")
    first = arguments.first + (parity - arguments.first) % 2
    scenes = [(name, seed) for name in names for seed in range(first, first + 2 * arguments.seeds, 2)]
    forecast = partial(cases_of, engines=arguments.engines.split(","), fresh=arguments.fresh)
    cases: list[Case] = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for (name, seed), found in zip(scenes, pool.map(forecast, *zip(*scenes, strict=True)), strict=True):
            cases += found
            print(f"\r\033[K{name} {seed}", end="", file=sys.stderr, flush=True)
    print("\r\033[K", end="", file=sys.stderr)
    scores = summary(cases)
    print_summary(scores)
    for each in cases:
        if each.frequency >= 0.5 and not each.is_warned("check"):
            print(f"unforeseen: {each.trouble} in {each.kind}, seed {each.seed}, on {each.engine}", file=sys.stderr)
        if each.is_warned("check") and not each.happened:
            print(f"false alarm: {each.trouble} in {each.kind}, seed {each.seed}, on {each.engine}", file=sys.stderr)
    if arguments.json:
        write_cases(cases, arguments.half, arguments.json)
    if arguments.plot:
        plot(scores, arguments.plot)
    return 0


if __name__ == "__main__":
    sys.exit(main())
