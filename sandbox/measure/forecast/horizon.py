"""Horizon: until when positions in a crowd of balls can be told at all.

Each impact of two discs multiplies the angle between two nearby paths by some 4λ/d, with λ the mean free path and d
the diameter (N. S. Krylov, Works on the Foundations of Statistical Physics, 1979), so that 1e-12 m grow at the rate
ν·ln(1 + 4λ/d). A disc has ν = 2·n·d·√π·σ·χ impacts a second, with n discs on a square metre, σ² the mean square of one
component of their velocities, and χ = (1 − 7φ/16)/(1 − φ)² for the covered share φ (D. Henderson 1975).

That is the mean over the balls. The horizon is that of the ball whose error grows fastest, `FASTEST` times as fast.
Measured against `exact`, gases of 16 to 625 balls that cover 3 to 50 % of their box, three seeds each, all balls
perturbed (`compare.horizon.perturb`): the rate is 0.75 to 1.45 times that, the more the more balls there are.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.compare.horizon import NUDGE
from sandbox.measure.forecast.warning import Figures, Warning
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.scene import Scene

TOLERANCE = 0.01
"""The share of the smallest radius that is too much, as where engines are compared."""
FASTEST = 1.25
"""How much faster than the mean the error of the first ball grows: the geometric mean of what was measured."""
FEWEST = 10
"""Balls from which on there is a crowd."""
DENSEST = 0.85
"""The covered share beyond which it is no gas."""


def horizon(scene: Scene) -> float | None:
    """Return about when a perturbation of 1e-12 m has grown to a hundredth of a radius, s; None where there is no gas.

    A gas are balls that meet each other in a box of level and upright planes, without gravity, joints or drag.
    """
    bodies, world, meet = scene.bodies, scene.world, contact_matrix(scene)
    movers = meet.touches & ~bodies.fixed
    count = int(movers.sum())
    if not meet.mutual or count < FEWEST or not bodies.round.all() or len(scene.links) or scene.attractions:
        return None
    if any(world.gravity) or world.linear_drag or world.quadratic_drag:
        return None
    area = _area(scene)
    if area is None:
        return None
    radius = float(bodies.radius[movers].mean())
    spread = math.sqrt(0.5 * float((bodies.velocity[movers] ** 2).sum(axis=1).mean()))
    covered = math.pi * float((bodies.radius[movers] ** 2).sum()) / area
    if not 0.0 < covered < DENSEST or spread == 0.0:
        return None
    crowding = (1.0 - 7.0 * covered / 16.0) / (1.0 - covered) ** 2
    impacts = 4.0 * radius * count / area * math.sqrt(math.pi) * spread * crowding
    free_path = math.sqrt(0.5 * math.pi) * spread / impacts
    rate = FASTEST * impacts * math.log1p(2.0 * free_path / radius)
    return math.log(TOLERANCE * float(bodies.radius[movers].min()) / NUDGE) / rate


def _area(scene: Scene) -> float | None:
    """Return the area of the box that the planes make, m²; None where they leave a side open, or are slanted."""
    sides: dict[tuple[int, int], float] = {}
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        axis = int(np.abs(normal).argmax())
        if abs(normal[1 - axis]) > 0.0:
            return None
        sides[axis, int(np.sign(normal[axis]))] = plane.point[axis]
    if len(sides) < 4:
        return None
    width, height = (sides[axis, -1] - sides[axis, 1] for axis in (0, 1))
    return width * height if width > 0.0 and height > 0.0 else None


def horizon_notes(scene: Scene) -> Iterator[Warning]:
    """Yield a note where positions cannot be told to the end of the run."""
    until = horizon(scene)
    if until is not None and until < scene.world.duration:
        message = (
            f"positions are chaotic: an error of 1e-12 m grows to 1 % of a radius in about {until:.2g} s of "
            f"{scene.world.duration:g} s; after that, compare only energy, momentum and speeds"
        )
        figures: Figures = {"until": until}
        yield Warning("horizon", message, figures)
