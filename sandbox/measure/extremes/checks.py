"""Checks of a run: rules that every run of a scenario must satisfy, and the verdict.

The state is finite and bounded; energy does not rise beyond the scenario's tolerance; momentum is conserved up to
rounding; no centre passes an obstacle; no overlap exceeds slop + v·h; bodies come to rest, and stacked bodies do
not move; joint errors stay below a hundredth; and the result is accurate enough to be useful.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.measure.extremes.experiment import Scenario
from sandbox.measure.extremes.outcome import Outcome
from sandbox.measure.metrics.contacts import max_penetration, sampled_frames
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.invariants import momentum_drift
from sandbox.measure.preflight.tunnelling import intervals
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

MAX_REACH_FACTOR = 10.0
"""Factor of the distance that a body can cover by its initial speed and its fall: diverging chains have stretched to
1e9 m without a nan.
"""
MAX_MOMENTUM_CHANGE = 1e-12 / 2.0**-52
"""Relative, in units of the engine's `epsilon`: some thousand roundings."""
MAX_JOINT_ERROR = 0.01
"""Largest joint error as a fraction of the length of the joint."""
REST_FRACTION = 0.02
"""Fraction of √(g·width) below which a body is at rest."""
MAX_STACK_DISPLACEMENT = 0.5
"""Fraction of its width by which a stacked body may have moved."""
SLOP_FACTOR = 2.0
CONTACT_TOLERANCE = 1e-9
"""m, clearance up to which engines count bodies as touching."""


@dataclass(frozen=True)
class RunUnderTest:
    """Run of a scenario, and the quantities that its rules need."""

    case: Scenario
    scene: Scene
    settings: Settings
    """as the engine resolved them"""
    run: Trajectory

    @cached_property
    def sampled(self) -> Trajectory:
        """The run with as many of its frames as can be examined in detail."""
        frames = sampled_frames(self.run, self.scene)
        return self.run if len(frames) == len(self.run.time) else self.run.at(frames)

    @cached_property
    def energy_scale(self) -> float:
        """Energy that a gain is compared with, J."""
        return self.case.energy_scale(self.scene)

    @cached_property
    def displacement(self) -> FloatArray:
        """Largest distance of each body from its initial position, (N,) m."""
        away = self.run.position - self.run.position[0]
        return np.asarray(np.hypot(away[..., 0], away[..., 1]).max(axis=0))

    @cached_property
    def width(self) -> FloatArray:
        """Smallest width of each body, (N,) m."""
        return 2.0 * self.scene.bodies.thin

    @cached_property
    def energy_gain(self) -> float:
        """Largest excess of the energy over its initial value, as a fraction of the energy scale."""
        total = energies(self.run, self.scene).total
        gain = float(total.max() - total[0])
        return gain / self.energy_scale if self.energy_scale > 0.0 else (math.inf if gain > 0.0 else 0.0)


def bounded(tested: RunUnderTest) -> str | None:
    """The state is finite, and no body moves farther than is possible."""
    run, bodies = tested.run, tested.scene.bodies
    state = (run.position, run.velocity, run.angle, run.angular_velocity)
    if not all(bool(np.isfinite(each).all()) for each in state):
        return "the state is not finite"
    world, time = tested.scene.world, tested.scene.world.duration
    start = bodies.position
    extent = float(np.hypot(*(start.max(axis=0) - start.min(axis=0)))) + 2.0 * float(bodies.radius.max())
    fastest = float(np.hypot(*bodies.velocity.T).max())
    reach = MAX_REACH_FACTOR * (extent + fastest * time + 0.5 * math.hypot(*world.gravity) * time**2)
    worst = int(tested.displacement.argmax())
    if tested.displacement[worst] > reach:
        return (
            f"{bodies.names[worst]!r} moved {tested.displacement[worst]:.3g} m; the limit is {reach:.3g} m, "
            f"{MAX_REACH_FACTOR:g} times the possible distance"
        )
    return None


def energy(tested: RunUnderTest) -> str | None:
    """Energy does not rise beyond the tolerance of the scenario."""
    gain = tested.case.energy_tolerance
    band = gain(tested.scene, tested.settings, str(tested.run.info["engine"])) if callable(gain) else gain
    if tested.energy_gain > band:
        scale = f"the {tested.energy_scale:.3g} J available"
        return f"energy rose by {tested.energy_gain:.3g} of {scale}; the limit is {band:.3g}"
    return None


def momentum(tested: RunUnderTest) -> str | None:
    """Momentum is conserved, apart from gravity and impulses of static bodies."""
    drift = momentum_drift(tested.run, tested.scene)
    limit = MAX_MOMENTUM_CHANGE * ENGINES[str(tested.run.info["engine"])].epsilon
    if drift is not None and drift > limit:
        return f"momentum changed by {drift:.3g}; the limit for rounding is {limit:.3g}"
    return None


def through(tested: RunUnderTest) -> str | None:
    """No centre passes an obstacle."""
    return tested.case.through(tested.scene, tested.run) if tested.case.through is not None else None


def overlap(tested: RunUnderTest) -> str | None:
    """No overlap exceeds slop + v·h, with the largest speed so far and the fall of one step.

    h is the time between two searches for contacts. The slop counts twice: position correction removes the excess
    gradually, so a resting body lies a little deeper.
    """
    run, scene, settings = tested.sampled, tested.scene, tested.settings
    h = settings.dt / intervals(settings, str(tested.run.info["engine"]))
    fastest = np.maximum.accumulate(np.hypot(run.velocity[..., 0], run.velocity[..., 1]).max(axis=1))
    closing = (2.0 if contact_matrix(scene).mutual else 1.0) * (fastest + math.hypot(*scene.world.gravity) * h)
    deep, allowed = (
        max_penetration(run, scene),
        SLOP_FACTOR * (tested.settings.slop or 0.0) + closing * h + CONTACT_TOLERANCE,
    )
    worst = int((deep - allowed).argmax())
    if deep[worst] > allowed[worst]:
        limit = f"the limit {SLOP_FACTOR:g} slop + v·h is {allowed[worst]:.3g} m"
        return f"an overlap of {deep[worst]:.3g} m at {run.time[worst]:.3g} s; {limit}"
    return None


def separates(tested: RunUnderTest) -> str | None:
    """At the end no overlap exceeds the slop."""
    last = tested.run.at([-1])
    left, slop = float(max_penetration(last, tested.scene)[0]), tested.settings.slop or 0.0
    if left > SLOP_FACTOR * slop + CONTACT_TOLERANCE:
        return f"an overlap of {left:.3g} m remains; slop is {slop:.3g} m"
    return None


def settles(tested: RunUnderTest) -> str | None:
    """At the end all bodies are at rest."""
    bodies, strength = tested.scene.bodies, math.hypot(*tested.scene.world.gravity)
    speed = np.where(bodies.fixed, 0.0, np.hypot(*tested.run.velocity[-1].T) / np.sqrt(strength * tested.width))
    worst = int(speed.argmax())
    if speed[worst] > REST_FRACTION:
        remaining = float(np.hypot(*tested.run.velocity[-1, worst]))
        return f"{bodies.names[worst]!r} still moves at {remaining:.3g} m/s after {tested.run.time[-1]:g} s"
    return None


def stands(tested: RunUnderTest) -> str | None:
    """Stacked bodies do not move."""
    fraction = np.where(tested.scene.bodies.fixed, 0.0, tested.displacement / tested.width)
    worst = int(fraction.argmax())
    if fraction[worst] > MAX_STACK_DISPLACEMENT:
        return f"{tested.scene.bodies.names[worst]!r} moved by {fraction[worst]:.3g} of its width"
    return None


def joints(tested: RunUnderTest) -> str | None:
    """The error of no joint exceeds a hundredth of its length."""
    error = tested.run.info["joint_error"]
    if error is not None and error > MAX_JOINT_ERROR:
        return f"the error of a joint is {error:.3g} of its length"
    return None


Rule = Callable[[RunUnderTest], str | None]

RULES: dict[str, Rule] = {
    "bounded": bounded,
    "through": through,
    "joints": joints,
    "energy": energy,
    "momentum": momentum,
    "stands": stands,
    "overlap": overlap,
    "parted": separates,
    "settles": settles,
}
"""Rules in the order in which they are checked; the first broken one is reported."""


EXACT_ERROR = 1e-6
"""Error up to which a result counts as exact."""


def classify(tested: RunUnderTest) -> Outcome:
    """Return the outcome of a run that was not refused: the first broken rule, or the size of the error.

    A run that ended early has broken the rule `bounded` if it diverged, or `work` if the engine gave up.
    """
    run, case = tested.run, tested.case
    if run.status == "diverged":
        return Outcome("failed", str(run.reason), "bounded")
    if run.status != "ok":
        return Outcome("failed", str(run.reason), "work")
    figures: dict[str, float] = {}
    for name, rule in RULES.items():
        if name == "bounded" or name in case.rules:
            wrong = rule(tested)
            if wrong is not None:
                return Outcome("failed", wrong, name, figures=figures)
        if name == "bounded":  # a state that is not finite has no figures
            figures |= {"moved": float((tested.displacement / tested.width).max()), "gained": tested.energy_gain}
            if run.info["joint_error"] is not None:
                figures["joints"] = run.info["joint_error"]
    error = case.error(tested.scene, run) if case.error is not None else math.nan
    if math.isnan(error):
        return Outcome("degraded", "no rule is broken; the exact solution is not known", figures=figures)
    if error > case.fail_above:
        reason = f"the error is {error:.3g} of {case.error_of}; the limit is {case.fail_above:g}"
        return Outcome("failed", reason, "truth", error, figures=figures)
    if error <= EXACT_ERROR:
        return Outcome("exact", f"within {EXACT_ERROR:g} of {case.error_of}", None, error, figures=figures)
    return Outcome("degraded", f"the error is {error:.3g} of {case.error_of}", None, error, figures=figures)
