"""Stability: up to which step penalty springs are stable, by the integrator's own amplification."""

import math

import numpy as np

from sandbox.engines.reference.integrators import INTEGRATORS, amplification
from sandbox.engines.reference.springs import LEAST_RESTITUTION, damping_of
from sandbox.scene.driven import mounts
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

ROUNDING = 1e-9
"""Amplification above 1 that is rounding: a scheme that conserves energy has exactly 1."""

SPRING = 0.3
"""ω·h of a contact whose stiffness is left to the engine: ten substeps a contact."""

WORTH = 1e-3
"""ω·h below which a stable step is none worth the name: thousands of substeps a contact."""

DAMPER = 1.3
"""Times the damping ratio: by how much softer such a contact is where its damper is what limits the step."""


def lightest(scene: Scene) -> float:
    """Return the smallest reduced mass, kg, of a pair that can meet: two equal balls have half the mass of one."""
    meet, bodies = meetings(scene), scene.bodies
    mass, moving, hinged = bodies.mass, ~bodies.fixed, False
    if scene.drives:
        mass, moving = mass.copy(), moving.copy()
        for name, mount in mounts(scene).items():
            if name in bodies.names:
                n = bodies.names.index(name)
                moving[n] = mount.drive.kind == "torque"
                hinged = hinged or bool(moving[n])
                arm = math.hypot(*mount.hinge)  # at its far end it is lightest: I / r²
                mass[n] = (bodies.moment[n] + bodies.mass[n] * arm * arm) / (bodies.radius[n] + arm) ** 2
    masses = mass[~meet.free & moving]
    if not len(masses):
        return 1.0
    return float(masses.min()) * (0.5 if meet.ball_ball or hinged else 1.0)


def suited(scene: Scene, settings: Settings) -> float:
    """Return a stiffness, N/m, that goes with a step and the dampings that are asked for."""
    stiffest_damper = max(_dampings(meetings(scene), settings), default=0.0)
    return lightest(scene) * (SPRING / max(1.0, DAMPER * stiffest_damper) / settings.h) ** 2


def _dampings(meet: Meetings, settings: Settings) -> list[float]:
    """Return the damping ratios of all contacts that can come about."""
    if settings.damping is not None:
        return [settings.damping]
    restitution = np.unique(meet.surfaces.restitution[meet.touching])
    return [damping_of(max(e, LEAST_RESTITUTION)) for e in restitution.tolist()]


def unstable(scene: Scene, settings: Settings, stiffness_stated: bool = True) -> str | None:
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
    dampings = _dampings(meet, settings)
    crowd = np.sqrt(3.0) if meet.ball_ball else np.sqrt(2.0)
    frequency = crowd * np.sqrt(settings.stiffness / lightest(scene))
    worst = max(dampings, key=lambda z: _growth(settings, frequency, crowd * z, settings.h))
    if _growth(settings, frequency, crowd * worst, settings.h) <= 1.0 + ROUNDING:
        return None
    bound = _largest(settings, frequency, crowd * worst)
    if not bound:
        remedy = "stable at no step; semi_implicit_euler is, up to some h"
    else:
        # Only ω·h counts, so that a bound of the one is a bound of the other.
        softer = settings.stiffness * (bound / settings.h) ** 2
        remedy = f"stable up to a solver.stiffness of {_rounded_down(softer):g} N/m"
        if stiffness_stated:  # the engine's own grows as h falls
            remedy += f", or up to h = {_rounded_down(bound):g} s"
    return (
        f"penalty springs of {settings.stiffness:g} N/m would gain energy at h = {settings.h:g} s "
        f"with {settings.integrator}: {remedy}"
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
    return low if frequency * low > WORTH else 0.0
