"""Stacks: whether the solver iterations suffice for stacked bodies.

Measured on pymunk 7.3.1, boxes placed in contact, friction 0.5, gravity 9.81 m/s². `reference` agrees within
the scatter.

A tower of n boxes of height s leans in 3 s by about n^2.5·g·h²/(s·iterations^0.8) of a box, from 0.4 to 2.9 times that
(3 to 20 boxes of 0.1 to 1 m, 60 to 240 substeps a second, 2 to 40 iterations, 270 towers). Above 0.2 it falls within
10 s, below it stands; 10 towers in 270 do otherwise, all between 0.15 and 0.35. So a substep half as long helps as much
as six times the iterations.

A heavy box on a light one, M times as heavy, crushes it if M^1.25·g·h²/(s·iterations) exceeds 0.045, with s the side of
both, 0.3 and 1 m (M 10 to 1000, 60 to 480 substeps a second, 2 to 160 iterations, 10 s, 280 pairs); 8 pairs do
otherwise, all between 0.019 and 0.072.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from sandbox.arrays import IntArray
from sandbox.formatting import format_plural
from sandbox.measure.preflight.diagnostic import ROUNDING, Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.initial_contacts import InitialContacts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings


class Law(NamedTuple):
    """Measured condition of a stack: load·h²/iterations^exponent is at most a limit."""

    exponent: float
    limit: float
    """largest value at which it stands for 10 s"""
    advised: float
    """value that the remedies reach, at which it moves by less than a tenth of a box in 3 s"""


TOWER = Law(exponent=0.8, limit=0.2, advised=0.05)
"""Tower of n boxes of height s, whose load is n^2.5·g/s, 1/s²."""
CRUSHED = Law(exponent=1.0, limit=0.045, advised=0.015)
"""Box of height s under one that is M times as heavy; its load is M^1.25·g/s, 1/s²."""
MIN_TOWER = 5
"""Smallest number of boxes of a tower."""
MIN_MASS_RATIO = 10.0
"""Smallest mass ratio that gives a diagnostic."""


def stack_warnings(scene: Scene, settings: Settings, close: InitialContacts) -> Iterator[Diagnostic]:
    """Yield a diagnostic for the tallest tower that will lean or fall, and for the most crushed light body.

    Args:
        scene: the scene; without gravity nothing is stacked.
        settings: iterations and substep.
        close: bodies in contact at the start.
    """
    gravity = math.hypot(*scene.world.gravity) * scene.bodies.largest_gravity_scale
    if not gravity or not len(close.clearance) or settings.response == "penalty":
        return
    upper, lower = _resting(scene, close)
    yield from _crushed_bodies(scene, settings, upper, lower, gravity)

    base, count = _tower(upper, lower, len(scene.bodies))
    if count < MIN_TOWER:
        return
    load = count**2.5 * gravity / (2.0 * float(scene.bodies.thin[base]))
    if _is_excessive(load, TOWER, settings):
        name = scene.bodies.names[base]
        remedy, details = _remedy(load, TOWER, settings)
        message = (
            f"{count} bodies are stacked, {name!r} at the bottom; with {_available_text(settings)} the tower would "
            "lean or fall"
        )
        yield Diagnostic("stack", message, details | {"body": name, "bodies": count}, remedy)


def _crushed_bodies(
    scene: Scene, settings: Settings, upper: IntArray, lower: IntArray, gravity: float
) -> Iterator[Diagnostic]:
    bodies = scene.bodies
    able = ~bodies.immovable[upper] & ~bodies.immovable[lower]
    if not able.any():
        return
    ratio = np.where(able, bodies.mass[upper] / bodies.mass[lower], 0.0)
    # A body on several others is divided among them.
    ratio /= np.bincount(upper[able], minlength=len(bodies))[upper].clip(1)
    k = int(ratio.argmax())
    load = float(ratio[k]) ** 1.25 * gravity / (2.0 * float(bodies.thin[lower[k]]))
    if ratio[k] >= MIN_MASS_RATIO and _is_excessive(load, CRUSHED, settings):
        heavy, light = bodies.names[int(upper[k])], bodies.names[int(lower[k])]
        remedy, details = _remedy(load, CRUSHED, settings)
        message = (
            f"{heavy!r} stands on {light!r} and is {ratio[k]:.3g} times as heavy; with {_available_text(settings)} it "
            "would sink into it"
        )
        details |= {"body": heavy, "other": light, "ratio": float(ratio[k])}
        yield Diagnostic("mass_ratio", message, details, remedy)


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


def _is_excessive(load: float, law: Law, settings: Settings) -> bool:
    allowed: float = law.limit * settings.iterations**law.exponent
    return load * settings.h**2 > allowed * (1.0 + ROUNDING)


def _available_text(settings: Settings) -> str:
    return f"{format_plural(settings.iterations, 'iteration')} every {settings.h:.3g} s"


def _remedy(load: float, law: Law, settings: Settings) -> tuple[str, Details]:
    """Return what to change, as text and as details: substeps, iterations or dt, each alone."""
    iterations = (load * settings.h**2 / law.advised) ** (1.0 / law.exponent)
    h = math.sqrt(law.advised * settings.iterations**law.exponent / load)
    details: Details = {
        "substeps": math.ceil(settings.dt / h * (1.0 - ROUNDING)),
        "iterations": math.ceil(iterations * (1.0 - ROUNDING)),
        "safe_dt": settings.substeps * h,
    }
    text = (
        f"use solver.substeps >= {details['substeps']:,}, solver.iterations >= {details['iterations']:,} or "
        f"dt <= {floor_3_digits(settings.substeps * h)} s"
    )
    return text, details
