"""Crowds: places where so many bodies lie that pymunk would take minutes to part one more from them."""

import numpy as np

from sandbox.action import ActionError
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Collides
from sandbox.trajectory import BoolArray, FloatArray

CROWD = 100
"""Balls that a ball may be put into: pymunk takes minutes to part a thousand on one spot."""

SWARM = 1000
"""The same for balls that pass through each other, of which pymunk still looks at every pair."""


def check_crowd(
    place: FloatArray, radius: float, collides: Collides, position: FloatArray, bodies: Bodies, present: BoolArray
) -> None:
    """Refuse a place for a body in a crowd.

    Args:
        place: (2,) m.
        radius: of the body, m.
        collides: what it meets.
        position: (N, 2) m, of all bodies.
        bodies: all.
        present: (N,) which are there.

    Raises:
        ActionError: it would overlap too many.
    """
    near = np.hypot(*(position - place).T) < bodies.radius + radius
    into = bodies.element[near & present]
    how = [bodies.elements[element].collides for element in into.tolist()]
    if collides == "all" and how.count("all") >= CROWD:
        raise ActionError(f"it would overlap {how.count('all')} bodies; pymunk parts {CROWD} at most")
    if len(how) - how.count("none") >= SWARM:
        raise ActionError(f"it would overlap {len(how) - how.count('none')} bodies; at most {SWARM}")
