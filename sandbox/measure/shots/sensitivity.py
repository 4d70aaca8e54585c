"""Sensitivity: derivatives of the final position of a ball by aim, speed and tip offset.

If two strokes lead a ball through the same sequence of contacts, its final position is a smooth function of the stroke
between them. Where the sequence changes, for example because a ball begins to miss another, it has a kink or a jump.

A slope is extrapolated from central differences of decreasing steps (Ridders 1982, Adv. Eng. Software 4, 75), which
also gives an estimate of its error. A least-squares cubic through shots within the step has to agree with it. No step
is used within which the sequence of contacts changes; if it changes within all steps, there is no slope.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.measure.shots.shot import UNITS, VARIABLES, ShotSetup, Variable, shot_setup
from sandbox.scene.compile.scene import Scene


def collision_histories(outcome: ShotResult) -> Mapping[str, int]:
    """Return a hash of each ball's sequence of contacts; it is only comparable within one process.

    It depends on the contacts of the ball and of those that led to them, but not on the order of independent ones.
    """
    history = dict.fromkeys(outcome.names, 0)
    for event in outcome.events:
        own = history[event.ball]
        if event.kind == "ball" and event.partner is not None:
            other = history[event.partner]
            history[event.ball] = hash((event.kind, event.partner, own, other))
            history[event.partner] = hash((event.kind, event.ball, other, own))
        else:
            history[event.ball] = hash((event.kind, event.partner, own))
    return history


STEPS = tuple(2.0**-k for k in range(6, 31))
"""Steps to be tried from the largest on, in the unit of each variable: 0.016 to 1e-9."""

MAX_LEVELS = 8
"""Largest number of steps from which a slope is extrapolated."""

MIN_STEPS = 3
"""Smallest number of steps for a slope: with fewer its error cannot be estimated."""

FIT_NODES = np.linspace(-1.0, 1.0, 9)
"""Relative positions within a step of the shots of the fit."""

MAX_FIT_DISAGREEMENT = 0.01
"""Largest relative difference of slope and fit."""


@dataclass(frozen=True, slots=True)
class Slope:
    """Derivative of the final position of one ball with respect to one variable of the stroke."""

    ball: str
    """name of the ball"""
    variable: Variable
    """variable of the stroke"""
    value: tuple[float, float] | None
    """m per unit of the variable; None if the final position is not smooth, or the ball falls into a pocket"""
    error: float | None
    """estimated error of `value`, in the same unit"""
    fitted: tuple[float, float] | None
    """slope of a cubic fit through a fan of shots, in the same unit"""
    holds: float | None
    """largest step tried on both sides up to which the ball has the same sequence of contacts, as far as the shots
    show; None if there is none"""
    reason: str | None
    """reason why there is no value"""

    json_head: ClassVar = ("ball", "variable", "unit")
    json_name: ClassVar = "SlopeDocument"

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return f"m/{UNITS[self.variable]}"


class _ShotPair(NamedTuple):
    """Shots with a variable changed to both sides by a step."""

    step: float
    below: ShotResult
    above: ShotResult
    same_history: Mapping[str, bool]
    """whether each ball has the sequence of contacts of the intended shot in both"""


def sensitivity(
    scene: Scene | ShotSetup, shot: str | None = None, *, variables: Sequence[Variable] = VARIABLES
) -> tuple[Slope, ...]:
    """Return the derivative of each ball's final position with respect to each variable of the stroke.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`.
        shot: name of the shot; default: the first.
        variables: variables of the stroke.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
        Exhaustion: a shot has too many events.

    Example:
        >>> slope = sandbox.sensitivity(sandbox.load("8-ball"))[1]
        >>> slope.ball, slope.variable
        ('1', 'aim')
    """
    setup = shot_setup(scene, shot)
    nominal = setup.simulate()
    found: list[Slope] = []
    for variable in variables:
        slopes = _Slopes(setup, nominal, variable)
        found += [slopes.slope(number, ball) for number, ball in enumerate(nominal.names)]
    return tuple(found)


class _Slopes:
    """Shots and fits for the slopes of all balls by one variable."""

    def __init__(self, setup: ShotSetup, nominal: ShotResult, variable: Variable) -> None:
        self._setup, self._nominal, self._variable = setup, nominal, variable
        self._fits: dict[float, FloatArray] = {}
        """slopes of all balls by step"""
        histories = collision_histories(nominal)
        self._pairs: list[_ShotPair] = []
        for step in STEPS:
            if variable == "speed" and step >= setup.stroke.speed:
                continue
            below, above = (setup.simulate(setup.changed(variable, change)) for change in (-step, step))
            lower, upper = collision_histories(below), collision_histories(above)
            same = {ball: lower[ball] == history == upper[ball] for ball, history in histories.items()}
            self._pairs.append(_ShotPair(step, below, above, same))

    def slope(self, number: int, ball: str) -> Slope:
        """Return the slope of a ball."""
        pairs, unit = self._pairs, UNITS[self._variable]
        # A step is usable if all smaller ones keep the sequence of contacts, too.
        last = next((k for k in range(len(pairs), 0, -1) if not pairs[k - 1].same_history[ball]), 0)
        usable = pairs[last:]
        holds = usable[0].step if usable else None
        pocket = self._nominal.pocketed.get(ball)
        if pocket is not None:
            return self._no_slope(ball, holds, f"falls into {pocket!r}")
        if len(usable) < MIN_STEPS:
            step = max(pairs[-1].step, pairs[last - 1].step)
            return self._no_slope(ball, holds, f"not smooth: the sequence of contacts changes within {step:.2g} {unit}")
        # The sequence can also change between two steps that keep it; then the fit disagrees, and smaller steps are
        # tried.
        difference = 0.0
        for start in range(len(usable) - MIN_STEPS + 1):
            value, error, step = _extrapolate(usable[start : start + MAX_LEVELS], number)
            fitted = self._fit(step)[number]
            difference = float(np.hypot(*(fitted - value)))
            (x, y), both = value.tolist(), (float(fitted[0]), float(fitted[1]))
            if difference <= MAX_FIT_DISAGREEMENT * float(np.hypot(x, y)) + 10.0 * error:
                return Slope(
                    ball, self._variable, (x, y), max(error, difference), both, usable[start].step, reason=None
                )
        reason = f"not smooth: differences and a fit disagree by {difference:.2g} m/{unit}"
        return self._no_slope(ball, holds, reason)

    def _no_slope(self, ball: str, holds: float | None, reason: str) -> Slope:
        return Slope(ball, self._variable, None, None, None, holds, reason)

    def _fit(self, step: float) -> FloatArray:
        """Return the slopes of all balls by a cubic fit to shots within a step, (N, 2)."""
        if step not in self._fits:
            changes = (step * FIT_NODES).tolist()
            batch = self._setup.simulate_batch([self._setup.changed(self._variable, change) for change in changes])
            rows = batch.position.reshape(len(FIT_NODES), -1)
            middle = rows[len(FIT_NODES) // 2]  # otherwise rounding of metres would hide changes of nanometres
            powers = np.vander(FIT_NODES, 4, increasing=True)
            cubic = np.linalg.lstsq(powers, rows - middle, rcond=None)[0]
            self._fits[step] = np.asarray(cubic[1].reshape(-1, 2) / step)
        return self._fits[step]


def _extrapolate(pairs: list[_ShotPair], number: int) -> tuple[FloatArray, float, float]:
    """Return the limit of the central differences of a ball, its estimated error, and the smallest step used."""
    estimates = [(pair.above.position[number] - pair.below.position[number]) / (2.0 * pair.step) for pair in pairs]
    best, min_error, step = estimates[-1], float("inf"), pairs[-1].step
    order = 1.0
    while len(estimates) > 1:
        order *= 4.0  # errors are of order h², h⁴, …
        improved = [(order * b - a) / (order - 1.0) for a, b in pairwise(estimates)]
        for k, each in enumerate(improved):
            error = max(float(np.hypot(*(each - estimates[k]))), float(np.hypot(*(each - estimates[k + 1]))))
            if error < min_error:
                best, min_error, step = each, error, pairs[k + len(pairs) - len(improved)].step
        estimates = improved
    return best, min_error, step
