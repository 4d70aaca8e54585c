"""Breaks: how far a break on a floor can be trusted where an engine takes steps, as pymunk does.

pymunk looks for contacts at the end of each substep. Hits are then taken back to when they happened, grazes in between
are found up to `FAR`, and those that hits cause in the same substep with them: so the step matters little. What does
matter is a rack whose balls touch: its hits happen at one instant, and rounding says in which order.

Measured by `tools/breaks.py`, 16 balls broken at 6 m/s, 5 seeds, 60 to 960 Hz: with gaps of 1e-8 m to 1 mm in the rack
no ball was 1 mm from where a sixteenth of the step has it within 2 s; without, some were 0.02 s after the first hit.
"""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import IntArray
from sandbox.measure.forecast.speeds import top_speeds
from sandbox.measure.forecast.warning import Figures, Warning, at_most
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import FLOOR, demands
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.scene import Scene

FEW = 3
"""Balls below which there is no break."""

FAR = 1.28
"""Radii that a ball may go in a substep, as seen from another, and be found if it grazes it: a chord through the skin
of 1/20 of a radius that pymunk's discs have there."""

TOUCHING = 1e-9
"""m, within which balls touch."""


def break_notes(scene: Scene) -> Iterator[Warning]:
    """Yield notes on balls on a floor that can hit each other: on racks that touch, and on steps that hide grazes."""
    bodies = scene.bodies
    if scene.surface is None or not demands(scene) & FLOOR or not bodies.round.all():
        return
    meet = contact_matrix(scene)
    all_meet = np.asarray([element.collides == "all" for element in bodies.elements], np.bool_)[bodies.element]
    balls = np.flatnonzero(all_meet & ~bodies.fixed)
    if len(balls) < FEW:
        return
    radius = float(bodies.radius[balls].max())
    touching = _touching(scene, balls)
    if touching >= FEW - 1:
        message = (
            f"{touching:,} pairs of balls touch: they collide at one instant, and rounding decides in which order; "
            "later positions can depend on dt and engine; gaps of 1e-8 m or more define the order"
        )
        yield Warning("rack", message, {"pairs": touching})
    speed = float(top_speeds(scene, meet)[balls].max())
    way = speed * scene.solver.h / radius
    if way > FAR:
        safe = FAR * radius * scene.solver.substeps / speed
        message = (
            f"balls move up to {way:.3g} radii per substep ({speed:.3g} m/s), and pymunk may miss grazing contacts: "
            f"positions are reliable until about the first one; dt <= {at_most(safe)} s detects all"
        )
        figures: Figures = {"speed": speed, "radii": way, "safe_dt": safe}
        yield Warning("graze", message, figures)


def _touching(scene: Scene, balls: IntArray) -> int:
    """Return how many pairs of balls touch as a scene starts."""
    bodies, pairs = scene.bodies, 0
    position, radius = bodies.position[balls], bodies.radius[balls]
    for i, j in near_pairs(position, 2.0 * float(radius.max()) + 2.0 * TOUCHING):
        away = np.hypot(*(position[i] - position[j]).T) - radius[i] - radius[j]
        pairs += int((away <= TOUCHING).sum())
    return pairs
