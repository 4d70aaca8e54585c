"""Ensemble of trial runs: the first part of a scene from several perturbed starts.

Formulas bound speeds, but cannot predict the phase of the step in which a ball reaches a wall, the ball that a crowd
ejects, or how a tower settles. A single run shows one phase. The fraction of perturbed starts in which a problem occurs
estimates its odds, with Wilson's interval. Counted work bounds the number of starts, so that it does not depend on the
machine.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.preflight.diagnostic import Diagnostic, Occurrence
from sandbox.measure.preflight.trial_run import TrialRun, Unseen, run_trial, trial_duration
from sandbox.measure.preflight.tunnelling import ANOTHER, ANOTHER_BODY, collide_with_all
from sandbox.measure.proportion import Proportion
from sandbox.measure.run.bounded_run import counted_cost
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS, Starts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

STARTS_EFFORT = 1.0
"""s, counted work of the trial runs from other starts than that of the file."""
PREPARATION, PREPARATION_OF_BODY = 4e-3, 3e-5
"""s, counted for the preparation of a run from a start, and for each body of it."""

MAX_SPEED_UP, MAX_SPEED_UP_PAST_PEAK = 2.0, 1.2
"""Factors by which bodies may become faster in the rest of a scene than in its first part, while speeds grow and after
they have stopped to do so."""

NAMING_KINDS = frozenset({"tunnelling", "depth"})
"""Kinds for which a trial run names each body at risk with its own speed, and the formulas only bounds."""
INDISTINGUISHABLE = {"mass_ratio": "stack", "energy": "iterations", "orbit": "iterations"}
"""Kinds that a trial run cannot distinguish: it shows that a stack falls, or that energy grows."""


@dataclass(frozen=True)
class TrialEnsemble:
    """Trial runs of a scene from its first starts, number 0 being that of the file."""

    scene: Scene
    settings: Settings
    """settings of the runs as asked for"""
    engine: str
    """name of the engine"""
    starts: Starts
    duration: float
    """s, of each run"""
    findings: tuple[tuple[Diagnostic, ...], ...]
    """problems that occurred, by start"""
    top_speeds: tuple[float, float]
    """largest speed of any body in the first and in the second half of the runs, m/s"""
    unseen: Unseen
    """bodies whose passages the audit does not see in some run"""
    run_cost: float
    """s, counted work of the run from the start of the file"""

    @property
    def whole(self) -> bool:
        """Whether the runs cover the whole duration of the scene."""
        return self.duration == self.scene.world.duration

    @property
    def affordable(self) -> int:
        """Number of starts that `STARTS_EFFORT` allows, that of the file among them."""
        return 1 + affordable_others(self.scene, self.run_cost)

    @property
    def has_diverged(self) -> bool:
        """Whether a run diverged, which hides other problems."""
        return any(each.kind == "diverged" for found in self.findings for each in found)

    def occurrence(self, starts: Iterable[int], event: str = "occurs") -> Occurrence:
        """Return the frequency of a problem that occurs in some of the starts, by their numbers."""
        numbers = set(starts)
        count = Proportion(len(numbers), len(self.findings))
        return Occurrence(self.engine, None if self.whole else self.duration, count, 0 in numbers, event)

    def starts_with(self, problem: Diagnostic) -> list[int]:
        """Return the starts in which the problem of a diagnostic occurs, or the run diverges."""
        return [k for k, found in enumerate(self.findings) if is_among(problem, found, self.scene)]

    def may_pass(self, predicted: Diagnostic) -> bool:
        """Return whether a body may tunnel, or sink too deep, in the rest of the scene, as far as its first part shows.

        Formulas overestimate speeds by far, of impacts and of bodies that never get where they would be so fast. A
        predicted speed counts if bodies reached it to within a factor: `MAX_SPEED_UP` for impacts; for others, while
        speeds grow, that of the durations of the scene and the runs, as under constant forces, and at least
        `MAX_SPEED_UP`; `MAX_SPEED_UP_PAST_PEAK` if no body was faster in the second half of the runs.
        """
        before, after = self.top_speeds
        longer = 1.0 if predicted.details.get("struck") else self.scene.world.duration / self.duration
        factor = max(MAX_SPEED_UP, longer) if after > before else MAX_SPEED_UP_PAST_PEAK
        reach = float(predicted.details["safe_dt"]) / self.settings.substeps * float(predicted.details["speed"])
        return factor * max(before, after) * self.settings.h > reach

    def is_blind_to(self, predicted: Diagnostic) -> bool:
        """Return whether the audit does not see all passages of the bodies that may tunnel."""
        if predicted.kind != "tunnelling":
            return False
        bodies, thing = self.scene.bodies, predicted.details["thing"]
        is_static = thing in self.scene.fixed_names
        if predicted.details.get("other_bodies") or thing in (ANOTHER, ANOTHER_BODY):
            concerned = collide_with_all(bodies) | (is_static & ~bodies.fixed)
        else:
            concerned = np.asarray(bodies.names) == predicted.details["ball"]
        unseen = self.unseen.through_static if is_static else self.unseen.through_bodies
        return bool((unseen & concerned).any())


def run_trials(
    scene: Scene,
    settings: Settings,
    engine: str,
    starts: int = DEFAULT_STARTS,
    spread: float = DEFAULT_SPREAD,
    cover: float = 1.0,
) -> TrialEnsemble | None:
    """Run a scene, or its first part, from up to a number of starts, as far as `STARTS_EFFORT` allows.

    Args:
        scene: the scene.
        settings: settings of the runs.
        engine: name of the engine.
        starts: number of starts, that of the file among them.
        spread: largest change of a start, as a fraction.
        cover: fraction of the scene that a run may cover at most.

    Returns:
        The runs; None if the engine refuses the scene, or the part would be too short.
    """
    if ENGINES[engine].missing(scene, settings) or (duration := trial_duration(scene, settings, cover)) is None:
        return None
    first = run_trial(scene, scene, settings, engine, duration)
    if first is None:
        return None
    cost, drawn = cost_of(first), Starts(scene, spread, settings.dt)
    others = min(starts - 1, affordable_others(scene, cost))
    others = others if others and drawn.can_vary else 0
    findings, top_speeds, unseen = [tuple(first.findings())], first.top_speeds, first.unseen
    for number in range(1, others + 1):
        trial = run_trial(scene, drawn.start(number), settings, engine, duration)
        if trial is None:
            break
        findings.append(tuple(trial.findings()))
        top_speeds = max(top_speeds[0], trial.top_speeds[0]), max(top_speeds[1], trial.top_speeds[1])
        unseen = Unseen(*(a | b for a, b in zip(unseen, trial.unseen, strict=True)))
    return TrialEnsemble(scene, settings, engine, drawn, duration, tuple(findings), top_speeds, unseen, cost)


def affordable_others(scene: Scene, run_cost: float) -> int:
    """Return the number of starts other than that of the file that `STARTS_EFFORT` allows, by the cost of a run, s."""
    return int(STARTS_EFFORT / (run_cost + preparation_of(scene)))


def preparation_of(scene: Scene) -> float:
    """Return the work counted for the preparation of a run from a start, s."""
    return PREPARATION + PREPARATION_OF_BODY * len(scene.bodies)


def cost_of(trial: TrialRun) -> float:
    """Return the counted work of a trial run, s."""
    info = trial.run.info
    return counted_cost(trial.scene, trial.engine, trial.settings, info["steps"], info["work"])


def is_among(problem: Diagnostic, found: Sequence[Diagnostic], scene: Scene) -> bool:
    """Return whether the problem of a diagnostic is among those of a run, or the run diverges."""
    return any(each.kind == "diverged" or shows(each, problem, scene) for each in found)


def shows(found: Diagnostic, problem: Diagnostic, scene: Scene) -> bool:
    """Return whether what occurred in a run is the problem of a diagnostic.

    A diagnostic that stands for other bodies too is shown by any of them, and one that stands for other static objects
    by the body at any of these.
    """
    if family_of(found) != family_of(problem):
        return False
    if found.kind not in NAMING_KINDS:
        return True
    details, thing = problem.details, obstacle_of(found, scene)
    is_own = bool(details.get("other_bodies")) or found.details["ball"] == details["ball"]
    is_alike = bool(details.get("others")) and thing in scene.fixed_names
    return is_own and (is_alike or thing == obstacle_of(problem, scene))


def family_of(found: Diagnostic) -> str:
    """Return the kind of a diagnostic, or that of all which a trial run cannot tell from it."""
    if "joint" in found.details and found.kind == "mass_ratio":
        return "chain"
    return INDISTINGUISHABLE.get(found.kind, found.kind)


def obstacle_of(found: Diagnostic, scene: Scene) -> str | None:
    """Return the obstacle of a body at risk as the formulas name it; None for kinds without one."""
    if found.kind not in NAMING_KINDS:
        return None
    thing = str(found.details["thing"])
    if thing in scene.bodies.names and not scene.bodies.fixed[scene.bodies.names.index(thing)]:
        return ANOTHER if scene.bodies.round[~scene.bodies.fixed].all() else ANOTHER_BODY
    return thing
