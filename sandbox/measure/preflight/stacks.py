"""Stacks: whether the solver iterations suffice for stacked bodies.

Measured on pymunk 7.3.1, boxes placed in contact, friction 0.5, gravity 9.81 m/s².

A tower of n boxes of height s, 5 to 20 of 0.5 and 1 m, 60 to 480 Hz, 10 s: it falls if iterations/h is below c·n·√(g/s)
with c = 55 to 65, leans by up to a box and a half up to c = 100, and stands within a third from 150 on. So 10 boxes of
1 m need 1900 a second to stand at all: 16 iterations at 120 Hz or 10 at 240 suffice, 10 at 120 do not. A tower that
falls in 10 s only leans before: 6 boxes of 0.5 m at 60 Hz and 10 iterations lean 0.63 of a box in 3 s, with 20
iterations 0.51, with 27 (c = 61) 0.37. At c = 150 towers of 5 to 10 boxes lean by at most 0.05 of a box in 3 s and 0.52
in 10 s, whether by more iterations (67) or by substeps (7); 15 boxes by 0.2 and 1.7, by substeps 0.02 and 0.9. Fewer
than 5 boxes stand with less, smaller boxes need more: at 0.1 m 10 fall with 15,000.

A heavy box on a light one, M times as heavy, both 1 m, 60 to 240 Hz, 4 s: the light one is crushed below 16·M
iterations a second for M = 30, below 24·M for 100 (2400: 40 iterations at 60 Hz hold, 20 at 120 do not), below 32·M for
300. In 10 s it is gradually pushed out at up to twice that.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import IntArray
from sandbox.measure.preflight.diagnostic import (
    ROUNDING,
    Details,
    Diagnostic,
    floor_3_digits,
    required_iterations,
)
from sandbox.measure.preflight.initial_contacts import InitialContacts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

TOWER_ITERATIONS = 60.0
"""Iterations in the time √(s/g) for each box of a tower, below which it falls."""
UPRIGHT_ITERATIONS = 150.0
"""The same for a tower that is still upright after some seconds, which the diagnostic advises."""
MIN_TOWER = 5
"""Smallest number of boxes of a tower."""
CRUSH_ITERATIONS = 24.0
"""Iterations per second for each unit of the mass ratio of the upper to the lower body."""
MIN_MASS_RATIO = 10.0
"""Smallest mass ratio that gives a diagnostic."""


def stack_warnings(scene: Scene, settings: Settings, close: InitialContacts) -> Iterator[Diagnostic]:
    """Yield a diagnostic for the tallest tower that will lean or fall, and for the most crushed light body.

    Args:
        scene: the scene; without gravity nothing is stacked.
        settings: iterations and substep.
        close: bodies in contact at the start.
    """
    gravity = math.hypot(*scene.world.gravity)
    if not gravity or not len(close.clearance) or settings.response == "penalty":
        return
    upper, lower = _resting(scene, close)
    has = settings.iterations / settings.h
    yield from _crushed_bodies(scene, settings, upper, lower, has)

    base, count = _tower(upper, lower, len(scene.bodies))
    if count < MIN_TOWER:
        return
    height = 2.0 * float(scene.bodies.thin[base])
    needed = TOWER_ITERATIONS * count * math.sqrt(gravity / height)
    if needed > has * (1.0 + ROUNDING):
        name = scene.bodies.names[base]
        advised = needed * UPRIGHT_ITERATIONS / TOWER_ITERATIONS
        iterations, dt = required_iterations(advised, settings)
        substeps = math.ceil(advised * settings.dt / settings.iterations * (1.0 - ROUNDING))
        remedy = f"solver.substeps >= {substeps:,}, solver.iterations >= {iterations:,} or dt <= {floor_3_digits(dt)} s"
        message = (
            f"{count} bodies are stacked, {name!r} at the bottom; {_available_text(settings, has)} the tower would "
            f"lean or fall; use {remedy} ({advised:.3g} a second)"
        )
        yield Diagnostic(
            "stack", message, _details(needed, has, settings) | {"body": name, "bodies": count, "safe_dt": dt}
        )


def _crushed_bodies(
    scene: Scene, settings: Settings, upper: IntArray, lower: IntArray, has: float
) -> Iterator[Diagnostic]:
    bodies = scene.bodies
    able = ~bodies.immovable[upper] & ~bodies.immovable[lower]
    if not able.any():
        return
    ratio = np.where(able, bodies.mass[upper] / bodies.mass[lower], 0.0)
    # A body on several others is divided among them.
    ratio /= np.bincount(upper[able], minlength=len(bodies))[upper].clip(1)
    k = int(ratio.argmax())
    needed = CRUSH_ITERATIONS * float(ratio[k])
    if ratio[k] >= MIN_MASS_RATIO and needed > has * (1.0 + ROUNDING):
        heavy, light = bodies.names[int(upper[k])], bodies.names[int(lower[k])]
        message = (
            f"{heavy!r} stands on {light!r} and is {ratio[k]:.3g} times as heavy; {_available_text(settings, has)} it "
            f"would sink into it; {_remedy(needed, settings)}"
        )
        details: Details = {"body": heavy, "other": light, "ratio": float(ratio[k])}
        yield Diagnostic("mass_ratio", message, _details(needed, has, settings) | details)


def _resting(scene: Scene, close: InitialContacts) -> tuple[IntArray, IntArray]:
    """Return the upper and the lower body of each contact that is steep enough to carry, (K,) each."""
    down = np.asarray(scene.world.gravity) / math.hypot(*scene.world.gravity)
    between = scene.bodies.position[close.second] - scene.bodies.position[close.first]
    along = between @ down
    steep = np.abs(along) > 0.7 * np.hypot(*between.T)  # a body beside another does not carry it
    upper, lower = np.where(along > 0.0, (close.first, close.second), (close.second, close.first))
    return upper[steep], lower[steep]


def _tower(upper: IntArray, lower: IntArray, count: int) -> tuple[int, int]:
    """Return the lowest body of the tallest tower and its number of bodies; each rests on one body and carries one."""
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


def _available_text(settings: Settings, has: float) -> str:
    return f"with {settings.iterations} iterations every {settings.h:.3g} s ({has:.3g} a second)"


def _remedy(needed: float, settings: Settings) -> str:
    iterations, dt = required_iterations(needed, settings)
    return f"use solver.iterations >= {iterations:,} or dt <= {floor_3_digits(dt)} s ({needed:.3g} a second)"


def _details(needed: float, has: float, settings: Settings) -> Details:
    return {"needed": needed, "has": has, "safe_dt": required_iterations(needed, settings)[1]}
