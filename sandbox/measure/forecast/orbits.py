"""Orbits: whether the step is short enough where attraction bends a body's way most.

Taken is the orbit of each body about each centre alone (Kepler's, for no softening), to where it is nearest: there the
attraction a turns the velocity v by a·h/v in a substep. Where a body flies straight through a softened centre, the
direction of the force flips within one substep, and energy is off by about that share of v² each time.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.forecast.speeds import Speeds
from sandbox.measure.forecast.warning import Figures, Warning, at_most
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

TURN = 0.2
"""rad: with less, symplectic schemes keep the energy of an orbit within some percent."""


def orbit_warnings(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    """Yield a warning for each attraction that turns a body's velocity by more than `TURN` in a substep."""
    bodies, speeds = scene.bodies, Speeds(scene, meet)
    for number, each in enumerate(scene.attractions):
        if each.strength <= 0.0:
            continue
        own = bodies.number_of[each.toward] if isinstance(each.toward, str) else None
        place = bodies.position[own] if own is not None else np.asarray(each.toward)
        away, velocity = bodies.position - place, bodies.velocity
        distance, speed = np.hypot(*away.T), np.hypot(*velocity.T)
        able = ~bodies.fixed & (distance > 0.0)
        if own is not None:
            able[own] = False
        if not able.any():
            continue
        solid = speeds.core(each)
        momentum = np.abs(away[:, 0] * velocity[:, 1] - away[:, 1] * velocity[:, 0])
        nearest = _periapsis(each.strength, distance, speed, momentum)
        able &= (nearest > solid) | (solid == 0.0)  # what strikes the centre is not bent there
        if not able.any():
            continue
        near = np.maximum(nearest, np.maximum(each.softening, np.finfo(float).tiny))
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            drop = np.where(
                each.softening > 0.0,
                (np.arctan(distance / max(each.softening, 1e-300)) - np.arctan(nearest / max(each.softening, 1e-300)))
                / max(each.softening, 1e-300),
                1.0 / near - 1.0 / distance,
            )
            there = np.sqrt(np.square(speed) + 2.0 * each.strength * np.maximum(drop, 0.0))
            turn = each.strength / (np.square(nearest) + each.softening**2 + np.finfo(float).tiny) / there * settings.h
        turn = np.where(able & np.isfinite(turn), turn, np.where(able & ~np.isfinite(turn), MOST_TURN, 0.0))
        k = int(turn.argmax())
        if turn[k] <= TURN:
            continue
        name = each.name or f"attraction {number + 1}"
        safe = settings.dt * TURN / float(turn[k])
        message = (
            f"{name!r} turns the velocity of {bodies.names[k]!r} by {min(float(turn[k]), MOST_TURN):.3g} rad in one "
            f"substep at its closest distance, {nearest[k]:.3g} m, so energy is not conserved; "
            + (f"dt <= {at_most(safe)} s is safe" if safe > 0.0 else "add softening")
        )
        figures: Figures = {"body": bodies.names[k], "turn": min(float(turn[k]), MOST_TURN), "safe_dt": safe}
        yield Warning("orbit", message, figures)


MOST_TURN = 1e12
"""Figure that is given where there is no bound."""


def _periapsis(
    strength: float,
    distance: FloatArray,
    speed: FloatArray,
    momentum: FloatArray,
) -> FloatArray:
    """Return the least distance of each body from a centre, (N,) m; of a softened one an upper estimate.

    Kepler: r = L²/(GM·(1 + e)), e² = 1 + 2·E·L²/GM².
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        scaled = momentum / math.sqrt(strength)
        energy = 0.5 * np.square(speed) / strength - 1.0 / distance
        eccentricity = np.sqrt(np.maximum(1.0 + 2.0 * energy * np.square(scaled), 0.0))
        nearest = np.square(scaled) / (1.0 + eccentricity)
    return np.where(np.isfinite(nearest), np.minimum(nearest, distance), distance)
