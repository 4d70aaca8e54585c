"""Stability: up to which step penalty springs are stable, by the integrator's own amplification."""

import math

import numpy as np

from sandbox.engines.reference.integrators import INTEGRATORS, amplification
from sandbox.engines.reference.springs import LEAST_RESTITUTION, damping_of
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

ROUNDING = 1e-9
"""Amplification above 1 that is rounding: a scheme that conserves energy has exactly 1."""


def lightest(scene: Scene) -> float:
    """Return the smallest reduced mass, kg, of a pair that can meet: two equal balls have half the mass of one."""
    meet, bodies = meetings(scene), scene.bodies
    masses = bodies.mass[~meet.free & ~bodies.fixed]
    if not len(masses):
        return 1.0
    return float(masses.min()) * (0.5 if meet.ball_ball else 1.0)


def unstable(scene: Scene, settings: Settings) -> str | None:
    """Return why penalty springs cannot work as set, or None where they can.

    The stiffest that can come about is a ball held by several springs: against fixed things by two, in a close packing
    by six, which swings √3 times as fast as a pair alone (its mode of shortest waves has ω² = 6 k/m; a pair, 2 k/m).
    """
    assert settings.stiffness is not None and settings.integrator is not None
    meet = meetings(scene)
    if not meet.touching.any():
        return None
    table = meet.surfaces.restitution[meet.touching]
    if settings.damping is None and table.min() < LEAST_RESTITUTION:
        return (
            f"a penalty contact always rebounds: restitution {table.min():g} cannot be had, {LEAST_RESTITUTION:g} can; "
            "state solver.damping, 1 for critical, to take what it gives"
        )
    dampings = [settings.damping] if settings.damping is not None else [damping_of(float(e)) for e in np.unique(table)]
    crowd = np.sqrt(3.0) if meet.ball_ball else np.sqrt(2.0)
    frequency = crowd * np.sqrt(settings.stiffness / lightest(scene))
    worst = max(dampings, key=lambda z: _growth(settings, frequency, crowd * z, settings.h))
    if _growth(settings, frequency, crowd * worst, settings.h) <= 1.0 + ROUNDING:
        return None
    bound = _largest(settings, frequency, crowd * worst)
    remedy = (
        f"stable up to h = {_rounded_down(bound):g} s"
        if bound
        else "stable at no step; semi_implicit_euler is, up to some h"
    )
    return (
        f"penalty springs of {settings.stiffness:g} N/m would gain energy at h = {settings.h:g} s "
        f"with {settings.integrator}: {remedy}, or state a smaller solver.stiffness"
    )


def _rounded_down(value: float) -> float:
    """Return three digits of a value, no larger than it: who is told a bound may try just that."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / unit) * unit


def _growth(settings: Settings, frequency: float, damping: float, h: float) -> float:
    assert settings.integrator is not None
    return amplification(INTEGRATORS[settings.integrator].step, frequency, damping, h)


def _largest(settings: Settings, frequency: float, damping: float) -> float:
    """Return the largest stable step, s, below the present one; 0 where there is none worth the name."""
    low, high = 0.0, settings.h
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _growth(settings, frequency, damping, middle) <= 1.0 + ROUNDING else (low, middle)
    return low if low > 1e-6 * settings.h else 0.0
