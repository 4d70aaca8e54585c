"""Overlap: how engines of a fixed step correct it where the scene states nothing."""

import numpy as np

from sandbox.scene.model import Scene

SLOP_PER_RADIUS = 0.01
"""Slop as a part of the smallest radius, or half width. pymunk's own is 0.1 m: a ball of 5 cm would rest 10 cm deep."""

BIAS = (1.0 - 0.1) ** 60
"""pymunk's own: a tenth of an overlap is corrected in 1/60 s."""


def slop_of(scene: Scene) -> float:
    """Return the overlap, m, that is left uncorrected: by the thinnest body that can touch anything."""
    bodies = scene.bodies
    touching = np.asarray([e.collides != "none" for e in bodies.elements], dtype=bool)[bodies.element]
    return SLOP_PER_RADIUS * (float(bodies.thin[touching].min()) if touching.any() else 1.0)
