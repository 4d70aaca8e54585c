"""Stacks: whether the iterations suffice for what stands on what.

Measured on pymunk 7.3.1, boxes laid out to touch, friction 0.5, gravity 9.81 m/s².

A tower of n boxes, s high each, 5 to 20 of 0.5 and 1 m, 60 to 480 Hz, 10 s: it falls while iterations/h is below
c·n·√(g/s) with c = 55 to 65, leans by up to a box and a half up to c = 100, and stands within a third from 150 on. So
10 boxes of 1 m take 1900 a second to stand at all: 16 iterations at 120 Hz or 10 at 240 do, 10 at 120 do not. A tower
that falls in 10 s only leans before: 6 boxes of 0.5 m at 60 Hz and 10 iterations lean 0.63 of a box in 3 s, with 20
iterations 0.51, with 27 (c = 61) 0.37. At c = 150 towers of 5 to 10 boxes lean by at most 0.05 of a box in 3 s and 0.52
in 10 s, whether by more iterations (67) or by substeps (7); 15 boxes by 0.2 and 1.7, by substeps 0.02 and 0.9. Fewer
than 5 boxes stand with less, smaller boxes fall with more: at 0.1 m 10 fall with 15,000.

A heavy box on a light one, M times as heavy, both 1 m, 60 to 240 Hz, 4 s: the light one is crushed below 16·M
iterations a second for M = 30, below 24·M for 100 (2400: 40 iterations at 60 Hz hold, 20 at 120 do not), below 32·M for
300. In 10 s it is in time pushed out from under at up to twice that.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import IntArray
from sandbox.measure.forecast.laid import Laid
from sandbox.measure.forecast.warning import ROUNDING, Figures, Warning, at_most, enough_work
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

TOWER = 60.0
"""Iterations in the time √(s/g) for each box of a tower."""
UPRIGHT = 150.0
"""The same, with which a tower still stands upright after some seconds: what the warning advises."""
TALL = 5
"""Boxes from which on it is one."""
CRUSHED = 24.0
"""Iterations a second for each time that the upper is as heavy as the lower."""
UNEQUAL = 10.0
"""How much heavier the upper is before it is told of."""


def stack_warnings(scene: Scene, settings: Settings, close: Laid) -> Iterator[Warning]:
    """Yield a warning for the tallest tower that will lean or fall, and for the light body that will be crushed worst.

    Args:
        scene: of what; without gravity nothing stands.
        settings: give iterations and the substep.
        close: which of its bodies lie on each other.
    """
    gravity = math.hypot(*scene.world.gravity)
    if not gravity or not len(close.gap) or settings.response == "penalty":
        return
    upper, lower = _resting(scene, close)
    has = settings.iterations / settings.h
    yield from _crushed(scene, settings, upper, lower, has)

    base, count = _tower(upper, lower, len(scene.bodies))
    if count < TALL:
        return
    height = 2.0 * float(scene.bodies.thin[base])
    needed = TOWER * count * math.sqrt(gravity / height)
    if needed > has * (1.0 + ROUNDING):
        name = scene.bodies.names[base]
        advised = needed * UPRIGHT / TOWER
        iterations, _ = enough_work(advised, settings.h, settings.substeps)
        dt = settings.iterations * settings.substeps / advised
        substeps = math.ceil(advised * settings.dt / settings.iterations * (1.0 - ROUNDING))
        remedy = f"solver.substeps >= {substeps:,}, solver.iterations >= {iterations:,} or dt <= {at_most(dt)} s"
        message = (
            f"{count} bodies are stacked, {name!r} at the bottom; {_short(settings, has)} the tower would lean "
            f"or fall; use {remedy} ({advised:.3g} a second)"
        )
        yield Warning(
            "stack", message, _figures(needed, has, settings) | {"body": name, "bodies": count, "safe_dt": dt}
        )


def _crushed(scene: Scene, settings: Settings, upper: IntArray, lower: IntArray, has: float) -> Iterator[Warning]:
    bodies = scene.bodies
    able = ~bodies.fixed[upper] & ~bodies.fixed[lower]
    if not able.any():
        return
    ratio = np.where(able, bodies.mass[upper] / bodies.mass[lower], 0.0)
    # What several carry is shared among them.
    ratio /= np.bincount(upper[able], minlength=len(bodies))[upper].clip(1)
    k = int(ratio.argmax())
    needed = CRUSHED * float(ratio[k])
    if ratio[k] >= UNEQUAL and needed > has * (1.0 + ROUNDING):
        heavy, light = bodies.names[int(upper[k])], bodies.names[int(lower[k])]
        message = (
            f"{heavy!r} stands on {light!r} and is {ratio[k]:.3g} times as heavy; {_short(settings, has)} it would "
            f"sink into it; {_right(needed, settings)}"
        )
        figures: Figures = {"body": heavy, "other": light, "ratio": float(ratio[k])}
        yield Warning("mass_ratio", message, _figures(needed, has, settings) | figures)


def _resting(scene: Scene, close: Laid) -> tuple[IntArray, IntArray]:
    """Return who rests on whom, (K,) each: those close together of which one is right above the other."""
    down = np.asarray(scene.world.gravity) / math.hypot(*scene.world.gravity)
    between = scene.bodies.position[close.second] - scene.bodies.position[close.first]
    along = between @ down
    steep = np.abs(along) > 0.7 * np.hypot(*between.T)  # side by side, nobody carries
    upper, lower = np.where(along > 0.0, (close.first, close.second), (close.second, close.first))
    return upper[steep], lower[steep]


def _tower(upper: IntArray, lower: IntArray, count: int) -> tuple[int, int]:
    """Return the lowest body of the tallest tower, and of how many it is: each rests on one, and bears one, alone."""
    bears, rests = np.bincount(lower, minlength=count), np.bincount(upper, minlength=count)
    alone = (bears[lower] == 1) & (rests[upper] == 1)
    above = dict(zip(lower[alone].tolist(), upper[alone].tolist(), strict=True))
    tallest = -1, 0
    for base in set(above) - set(above.values()):
        body, height = base, 1
        while body in above:
            body, height = above[body], height + 1
        tallest = max(tallest, (base, height), key=lambda each: each[1])
    return tallest


def _short(settings: Settings, has: float) -> str:
    return f"with {settings.iterations} iterations every {settings.h:.3g} s ({has:.3g} a second)"


def _right(needed: float, settings: Settings) -> str:
    iterations, dt = enough_work(needed, settings.h, settings.substeps)
    return f"use solver.iterations >= {iterations:,} or dt <= {at_most(dt)} s ({needed:.3g} a second)"


def _figures(needed: float, has: float, settings: Settings) -> Figures:
    return {"needed": needed, "has": has, "safe_dt": settings.substeps / needed}
