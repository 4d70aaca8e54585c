"""Chains: whether the iterations suffice for the joints that hang together.

An iterative solver passes on what it knows from joint to joint, once an iteration. What it lacks after a substep it
makes up for in the next ones, as impulses are kept, but only as long as it settles faster than the correction of what
is off pulls at it; else the joints are torn apart. It settles, of impulses v of the slowest mode, at 2λ an iteration,
with λ the least eigenvalue of the joints' matrix J·M⁻¹·Jᵀ, its diagonal scaled to 1. The correction's rate is
r = (1 − bias^h)/h, with pymunk's own bias 6.3 a second. So iterations/h has to be r/(2λ).

Measured on pymunk 7.3.1, chains of n equal balls on rods, and of boxes on pivots, hung up at one end, links of 0.025
to 1.6 m, 60 to 480 Hz, 4 s: they hold from iterations/h = 2.4 n² on, which is 60 for 5 links, 240 for 10, 960 for 20,
3840 for 40, and are torn apart (joint error 0.2 to 20 of a link) below 0.75 of it; r/(2λ) is 2.56 n². With n = 2 and a
load of 100 times a link's mass at the end it takes between 480 and 960 (r/(2λ): 637), of 1000 times 4800 to 7680
(6325); with n = 10 and 100 times 3840 to 7680 (5862). With another bias, 1e-6, 2.2 times r, it takes 2.2 times as
much. What the rule does not tell: what a joint stretches while the chain swings, which falls with h alone (20 links
from the horizontal at 480 Hz: by 40 % of a link), and pivots of links so short that g·h²·n is more than half of one.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.base import BIAS
from sandbox.measure.forecast.modes import Product, extremes, groups
from sandbox.measure.forecast.warning import ROUNDING, Figures, Warning, at_most, enough_work
from sandbox.scene.compile.joint_arrays import JointArrays, LinkKind
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

MEASURED = 0.93
"""The share of r/(2λ) at which chains were found to hold."""
HOLDING = (LinkKind.ROD, LinkKind.PIVOT, LinkKind.SLIDE, LinkKind.GROOVE)
UNEQUAL = 10.0
"""A joint between masses that differ by this factor is told of by name."""


def chain_warnings(scene: Scene, settings: Settings) -> Iterator[Warning]:
    """Yield a warning for each group of joints that the iterations do not suffice for.

    It is of kind `mass_ratio` where with equal masses they would, else `chain`. Only joints that are held by impulses
    are told of; springs and motors hold nothing.
    """
    if settings.joints not in (None, "impulses"):
        return
    links = scene.links.of(*HOLDING)
    if len(links) < 2:
        return
    bodies, has = scene.bodies, settings.iterations / settings.h
    bias = BIAS if settings.bias is None else settings.bias
    rate = (1.0 - bias**settings.h) / settings.h
    free = np.where(bodies.fixed, -1, np.arange(len(bodies)))
    a, b = np.where(links.a >= 0, free[links.a], -1), free[links.b]
    home = groups(a, b, len(bodies))[np.where(b >= 0, b, a)]
    for group in np.unique(home).tolist():
        mine = np.flatnonzero(home == group)
        some = links.some(mine)
        inverse = np.where(bodies.fixed, 0.0, 1.0 / bodies.mass)
        needed = MEASURED * 0.5 * rate / slowest(some, inverse)
        if needed <= has * (1.0 + ROUNDING):
            continue
        alike = MEASURED * 0.5 * rate / slowest(some, (inverse > 0.0).astype(np.float64))
        iterations, dt = enough_work(needed, settings.h, settings.substeps)
        figures: Figures = {"joints": len(some), "joint": some.names[0], "needed": needed, "has": has, "safe_dt": dt}
        right = f"use solver.iterations >= {iterations:,} or dt <= {at_most(dt)} s ({needed:.3g} a second)"
        short = f"with {settings.iterations} iterations every {settings.h:.3g} s ({has:.3g} a second)"
        k, ratio = _most_unequal(some, inverse)
        if alike <= has * (1.0 + ROUNDING) and ratio >= UNEQUAL:
            first, second = bodies.names[int(some.a[k])], bodies.names[int(some.b[k])]
            message = (
                f"the joint {some.names[k]!r} connects {first!r} and {second!r}, one of which is {ratio:.3g} times as "
                f"heavy; {short} it would come apart; {right}"
            )
            yield Warning("mass_ratio", message, {**figures, "joint": some.names[k], "ratio": ratio})
        else:
            name = f"the joint {some.names[0]!r} is heavily loaded"
            if len(some) > 1:
                name = f"{len(some):,} joints, {some.names[0]!r} among them, are connected"
            message = f"{name}; {short} {'it' if len(some) == 1 else 'they'} would come apart; {right}"
            yield Warning("chain", message, figures)


def slowest(links: JointArrays, inverse_mass: FloatArray) -> float:
    """Return λ, the least eigenvalue but 0 of the matrix of joints that hang together, its diagonal scaled to 1.

    They are taken to lie in one line, as they do where it matters: then one joint is one row, with 1/m at its bodies
    and −1/m to the joints beside it. The same eigenvalues has M^−½ Jᵀ D⁻¹ J M^−½, which knows no joints too many.

    Args:
        links: of one group.
        inverse_mass: (N,) 1/kg, 0 for what is fixed.
    """
    known, place = np.unique(np.concatenate((np.where(links.a >= 0, links.a, links.b), links.b)), return_inverse=True)
    place = place.reshape(-1)
    first, second = place[: len(links)], place[len(links) :]
    root = np.sqrt(inverse_mass[known])
    on_a, on_b = -root[first] * (links.a >= 0), root[second]
    own = on_a**2 + on_b**2

    def product(vector: FloatArray) -> FloatArray:
        pull = (on_a * vector[first] + on_b * vector[second]) / own
        both = np.bincount(first, pull * on_a, len(known)) + np.bincount(second, pull * on_b, len(known))
        return both.astype(np.float64)

    moving = np.flatnonzero(root > 0.0)
    anchored = bool(((on_a == 0.0) | (on_b == 0.0)).any())
    null = None
    if not anchored:  # all may move on together
        null = np.zeros(len(known))
        null[moving] = 1.0 / root[moving]
        null /= np.linalg.norm(null)
    least, _ = extremes(_among(product, moving, len(known)), len(moving), null if null is None else null[moving])
    return max(least, 1e-12)


def _among(product: Product, moving: IntArray, count: int) -> Product:
    """Return the product of the rows and columns that move."""

    def inner(vector: FloatArray) -> FloatArray:
        whole = np.zeros(count)
        whole[moving] = vector
        return np.asarray(product(whole)[moving])

    return inner


def _most_unequal(links: JointArrays, inverse_mass: FloatArray) -> tuple[int, float]:
    """Return which joint is between the most unequal masses that move, and their ratio."""
    first = np.where(links.a >= 0, inverse_mass[links.a], 0.0)
    second = inverse_mass[links.b]
    both = (first > 0.0) & (second > 0.0)
    ratio = np.where(both, np.maximum(first, second) / np.where(both, np.minimum(first, second), 1.0), 1.0)
    k = int(ratio.argmax())
    return k, float(ratio[k]) if math.isfinite(ratio[k]) else 1.0
