"""Tableau: a Runge–Kutta method as its table of weights (Butcher 1964), and the one driver that runs any."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sandbox.engines.reference.motion import Inputs, State, Transition


class Tableau(NamedTuple):
    """An explicit Runge–Kutta method of s stages."""

    a: tuple[tuple[float, ...], ...]
    """Row i holds the weights of the slopes before stage i."""
    b: tuple[float, ...]
    """(s,) weights of the slopes in the step; they sum to 1"""
    c: tuple[float, ...]
    """(s,) where in the step each stage stands; the sum of its row of `a`"""


EULER = Tableau(a=((),), b=(1.0,), c=(0.0,))

CLASSIC_4 = Tableau(
    a=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)),
    b=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
    c=(0.0, 0.5, 0.5, 1.0),
)
"""The classic method of fourth order, Kutta 1901."""


def runge_kutta(table: Tableau) -> Callable[[Transition, float, State, Inputs, float], State]:
    """Return the step function of a table: kᵢ = f(t + cᵢ h, x + h Σ aᵢⱼ kⱼ, u), x ← x + h Σ bᵢ kᵢ."""

    def step(f: Transition, t: float, x: State, u: Inputs, h: float) -> State:
        slopes: list[State] = []
        for weights, c in zip(table.a, table.c, strict=True):
            slopes.append(f(t + c * h, _moved(x, h, weights, slopes), u))
        return _moved(x, h, table.b, slopes)

    return step


def _moved(x: State, h: float, weights: tuple[float, ...], slopes: list[State]) -> State:
    """Return x + h Σ wⱼ kⱼ."""
    total: State | None = None
    for weight, slope in zip(weights, slopes, strict=True):
        if weight:
            term = slope if weight == 1.0 else weight * slope
            total = term if total is None else total + term
    return x if total is None else np.asarray(x + h * total)
