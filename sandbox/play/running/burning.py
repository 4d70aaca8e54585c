"""Burning: the thrusts that fire at a moment, as the flames that are drawn of them."""

import math
from collections.abc import Mapping
from functools import lru_cache

from sandbox.action import Throttle
from sandbox.play.sight import Flame
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.forces import Thrust
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import form_of
from sandbox.scene.scene import Scene

LONG = 1.1
"""of a body's reach, the flame of its strongest thrust, fully open"""


def burning(scene: Scene, bodies: Bodies, throttles: Mapping[str, Throttle], time: float) -> tuple[Flame, ...]:
    """Return the flames of the thrusts that act.

    Args:
        scene: what runs.
        bodies: by number.
        throttles: that were set, by the names of their thrusts.
        time: s.
    """
    found = []
    for k, thrust in enumerate(scene.thrusts):
        level = _level(thrust, throttles.get(thrust.name or default_name("thrust", k)), time)
        force = math.hypot(*thrust.force)
        if level * force == 0.0 or thrust.body not in bodies.number_of:
            continue
        number = bodies.number_of[thrust.body]
        strongest = max(math.hypot(*each.force) for each in scene.thrusts if each.body == thrust.body)
        x, y = _centre(bodies.elements[int(bodies.element[number])])
        place = thrust.point[0] - x, thrust.point[1] - y
        # By the root: a thrust of a tenth is seen too.
        long = LONG * float(bodies.radius[number]) * math.sqrt(level * force / strongest)
        found.append(Flame(number, place, (-thrust.force[0] / force * long, -thrust.force[1] / force * long)))
    return tuple(found)


def _level(thrust: Thrust, throttle: Throttle | None, time: float) -> float:
    if time < thrust.begin or (thrust.end is not None and time >= thrust.end):
        return 0.0
    if throttle is not None:
        return throttle.level
    return 0.0 if thrust.key is not None else 1.0


@lru_cache(maxsize=64)
def _centre(element: BodySource) -> Point:
    """Return the centre of mass in the frame that an element was drawn in, m."""
    return form_of(element).centre
