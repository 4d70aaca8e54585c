"""Events: whether `exact` would have more of them than it allows.

What would rest on a ball, or on anything round, hops there instead, at g·5e-5 s or 5e-4 m/s, whichever is less, and
each hop is felt by all that it touches. Measured, balls of 5 cm, g = 1 to 100 m/s², two layers of 3 to 20 and single
ones: a ball upright on another costs 30,000 events a second, one between two others 56,000 to 77,000 while nothing
rubs; where it rubs, the three knock each other ever more often, 1.4 million times a second before they exceed the
bound. Above 10 m/s² it is in proportion to g.
"""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.measure.forecast.warning import Figures, Warning
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.scene import Scene

ALLOWED, ALLOWED_EACH = 1_000_000, 1_000
"""Events a simulated second: the first, or the second for each ball where that is more, as `exact` has them."""
UPRIGHT, SMOOTH, ROUGH = 3.0e4, 6.4e4, 1.4e6
"""Events a second of a ball on one other, and of one between others without friction and with."""
STEADY = 10.0
"""m/s² of gravity up to which that holds."""


def event_rate(scene: Scene, meet: ContactMatrix) -> float:
    """Return an upper estimate of the events a second that `exact` has once all balls lie on each other.

    Counted are the balls that start above others: they may yet come to lie beside them. 0 where nothing can come to
    lie on anything: without gravity, without anything fixed, or where something bounces for ever.
    """
    bodies, pull = scene.bodies, math.hypot(*scene.world.gravity)
    movers = meet.touches & ~bodies.fixed
    count = int(movers.sum())
    if pull == 0.0 or count == 0 or not meet.mutual or not bodies.round.all() or not scene.fixed:
        return 0.0
    if meet.restitution >= 1.0:
        return 0.0
    columns = _columns(scene)
    each = UPRIGHT if columns == 1 else ROUGH if meet.friction > 0.0 else SMOOTH
    return (count - columns) * each * max(1.0, pull / STEADY)


def _columns(scene: Scene) -> int:
    """Return how many balls have, as they start, none below them: those will lie on the ground, at least."""
    bodies = scene.bodies
    down = np.asarray(scene.world.gravity) / math.hypot(*scene.world.gravity)
    across = bodies.position[~bodies.fixed] @ np.asarray([-down[1], down[0]])
    width = 2.0 * float(bodies.radius.min())
    last, columns = -math.inf, 0
    for place in np.sort(across).tolist():
        if place - last >= width:
            last, columns = place, columns + 1
    return columns


def event_warnings(scene: Scene, meet: ContactMatrix) -> Iterator[Warning]:
    """Yield a warning where `exact` would give up, as it has more events than it allows."""
    warning = event_warning(event_rate(scene, meet), len(scene.bodies))
    if warning is not None:
        yield warning


def event_warning(rate: float, bodies: int) -> Warning | None:
    """Return a warning where a rate of events, 1/s, is more than `exact` allows for so many bodies."""
    allowed = max(ALLOWED, ALLOWED_EACH * bodies)
    if rate <= allowed:
        return None
    many = f"{rate:.2g} times a second" if math.isfinite(rate) else "without bound"
    message = (
        f"balls that come to rest on each other collide {many} on `exact`, which allows {allowed:,} events a simulated "
        "second and stops with an error beyond; pymunk and reference let them rest"
    )
    figures: Figures = {"rate": min(rate, MOST_RATE), "allowed": allowed}
    return Warning("event_rate", message, figures)


MOST_RATE = 1e12
"""Figure that is given for a rate without bound, 1/s."""
