"""Sensitivity: how far a ball's rest moves for each rad of aim, m/s of speed, and radius of side and height.

A slope is extrapolated from central differences of ever smaller steps (Ridders 1982, Adv. Eng. Software 4, 75), which
also tells how well it is known; a cubic through a fan of shots within the step, fitted by least squares, has to agree.
No step is used within which the ball's course changes. Where any does, there is no slope, and that is what is told.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.measure.shots.attempt import UNITS, VARIABLES, Attempt, Variable, attempt_of
from sandbox.measure.shots.courses import courses
from sandbox.scene.scene import Scene

STEPS = tuple(2.0**-k for k in range(6, 31))
"""Tried from the largest on, in each variable's unit: 0.016 to 1e-9."""

LEVELS = 8
"""Steps from which a slope is extrapolated, at most."""

FEWEST = 3
"""Steps that a slope needs; of fewer nothing tells how well it is known."""

NODES = np.linspace(-1.0, 1.0, 9)
"""Where in a step the fan's shots lie."""

AGREE = 0.01
"""Share by which slope and fit may differ, beyond which there is no telling."""


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

    def document(self) -> dict[str, Any]:
        """Return the slope as one JSON object."""
        figures = {key: getattr(self, key) for key in ("value", "error", "fitted", "holds", "reason")}
        return {"ball": self.ball, "variable": self.variable, "unit": f"m/{UNITS[self.variable]}", **figures}


class _Pair(NamedTuple):
    """The shots to both sides, a step away."""

    step: float
    below: ShotResult
    above: ShotResult
    kept: Mapping[str, bool]
    """whether each ball keeps its course"""


def sensitivity(
    scene: Scene | Attempt, shot: str | None = None, *, variables: Sequence[Variable] = VARIABLES
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
    """
    attempt = attempt_of(scene, shot)
    nominal = attempt.played()
    found: list[Slope] = []
    for variable in variables:
        pairs = _pairs(attempt, nominal, variable)
        fits: dict[float, FloatArray] = {}
        for number, ball in enumerate(nominal.names):
            found.append(_slope(attempt, nominal, variable, pairs, fits, number, ball))
    return tuple(found)


def _pairs(attempt: Attempt, nominal: ShotResult, variable: Variable) -> list[_Pair]:
    meant = courses(nominal)
    pairs = []
    for step in STEPS:
        if variable == "speed" and step >= attempt.stroke.speed:
            continue
        below, above = (attempt.played(attempt.changed(variable, by)) for by in (-step, step))
        to_left, to_right = courses(below), courses(above)
        kept = {ball: to_left[ball] == course == to_right[ball] for ball, course in meant.items()}
        pairs.append(_Pair(step, below, above, kept))
    return pairs


def _slope(
    attempt: Attempt,
    nominal: ShotResult,
    variable: Variable,
    pairs: list[_Pair],
    fits: dict[float, FloatArray],
    number: int,
    ball: str,
) -> Slope:
    # Only steps below which all smaller ones keep the course, too.
    last = next((k for k in range(len(pairs), 0, -1) if not pairs[k - 1].kept[ball]), 0)
    good = pairs[last:]
    holds = good[0].step if good else None
    pocket = nominal.pocketed.get(ball)
    if pocket is not None:
        return Slope(ball, variable, None, None, None, holds, f"falls into {pocket!r}")
    if len(good) < FEWEST:
        least = pairs[-1].step
        reason = (
            f"not smooth: the sequence of contacts changes within {max(least, pairs[last - 1].step):.2g} "
            f"{UNITS[variable]}"
        )
        return Slope(ball, variable, None, None, None, holds, reason)
    # Between steps that keep the course there may be a gap in which it is another; then the fit tells, and farther in
    # there is none.
    off = 0.0
    for start in range(len(good) - FEWEST + 1):
        value, error, step = _extrapolated(good[start : start + LEVELS], number)
        if step not in fits:
            fits[step] = _fitted(attempt, variable, step)
        fitted = fits[step][number]
        off = float(np.hypot(*(fitted - value)))
        (x, y), both = value.tolist(), (float(fitted[0]), float(fitted[1]))
        if off <= AGREE * float(np.hypot(x, y)) + 10.0 * error:
            return Slope(ball, variable, (x, y), max(error, off), both, good[start].step, None)
    reason = f"not smooth: differences and a fit disagree by {off:.2g} m/{UNITS[variable]}"
    return Slope(ball, variable, None, None, None, holds, reason)


def _extrapolated(pairs: list[_Pair], number: int) -> tuple[FloatArray, float, float]:
    """Return the slope that differences tend to, how well it is known, and the smallest step that it is made of."""
    row = [(pair.above.position[number] - pair.below.position[number]) / (2.0 * pair.step) for pair in pairs]
    best, least, step = row[-1], float("inf"), pairs[-1].step
    order = 1.0
    while len(row) > 1:
        order *= 4.0  # errors go with h², h⁴, …
        better = [(order * b - a) / (order - 1.0) for a, b in pairwise(row)]
        for k, each in enumerate(better):
            error = max(float(np.hypot(*(each - row[k]))), float(np.hypot(*(each - row[k + 1]))))
            if error < least:
                best, least, step = each, error, pairs[k + len(pairs) - len(better)].step
        row = better
    return best, least, step


def _fitted(attempt: Attempt, variable: Variable, step: float) -> FloatArray:
    """Return all balls' slopes by a cubic through a fan of shots, (N, 2)."""
    fan = attempt.fan([attempt.changed(variable, float(x)) for x in step * NODES])
    rows = fan.position.reshape(len(NODES), -1)
    middle = rows[len(NODES) // 2]  # else figures of metres would hide changes of nanometres
    cubic = np.linalg.lstsq(np.vander(NODES, 4, increasing=True), rows - middle, rcond=None)[0]
    return np.asarray(cubic[1].reshape(-1, 2) / step)
