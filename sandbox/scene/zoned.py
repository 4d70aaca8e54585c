"""Checks of zones and layers: that each zone has one shape, and holds whom it holds within itself."""

import math
from collections.abc import Iterator

from sandbox.scene.decompose import convex_parts
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene, Zone
from sandbox.scene.outline import OutlineError, anticlockwise, fault_of
from sandbox.scene.precinct import contains, middle_of
from sandbox.scene.zone import MAX_LAYERS, MAX_ZONES

Found = tuple[Location, str]

SHORTEST = 1e-9
"""m, the least length of a strip's segment"""


def zoned(scene: Scene) -> Iterator[Found]:
    """Yield the faults of a scene's zones."""
    if len(scene.zones) > MAX_ZONES:
        yield ("zone", MAX_ZONES), f"a scene has at most {MAX_ZONES:,} zones"
    for k, zone in enumerate(scene.zones):
        wrong = list(_shape(k, zone))
        yield from wrong
        if not wrong and zone.holds and not contains(zone, middle_of(zone)):
            x, y = middle_of(zone)
            yield ("zone", k, "holds"), f"its centre, ({x:g}, {y:g}) m, lies outside of it, where nobody can be held"
    if scene.zones and scene.surface is not None:
        yield ("zone", 0), "balls on a [surface] roll through everything but pockets; leave one of the two out"


def layered(scene: Scene) -> Iterator[Found]:
    """Yield the faults of a scene's layers."""
    layers = scene.layers
    if len(layers) > MAX_LAYERS:
        yield (), f"speaks of {len(layers)} layers, {', '.join(layers)}; at most {MAX_LAYERS}"
    if len(layers) > 1 and scene.surface is not None:
        yield (), f"has a [surface] and, besides it, the layer {layers[1]!r}; balls roll on the ground alone"


def _shape(k: int, zone: Zone) -> Iterator[Found]:
    at: Location = ("zone", k)
    if zone.points is None:
        if zone.position is None or zone.radius is None:
            yield at, "has no shape; give it `position` and `radius`, or `points`, or `points` and `thickness`"
        elif zone.thickness is not None:
            yield (*at, "thickness"), "is of a strip, which has `points`; a circle has none"
        return
    for key in ("position", "radius"):
        if getattr(zone, key) is not None:
            yield (*at, key), "is of a circle, and `points` are not; state one of the two"
            return
    if zone.thickness is not None:
        for n, (a, b) in enumerate(zip(zone.points, zone.points[1:], strict=False)):
            if math.dist(a, b) < SHORTEST:
                yield (*at, "points", n), f"lies on the point after it; neighbours are at least {SHORTEST:g} m apart"
        return
    if len(zone.points) < 3:
        yield (*at, "points"), "two points enclose nothing; give it three or more, or a `thickness`"
        return
    fault = fault_of(zone.points)
    if fault is not None:
        corner, message = fault
        yield (*at, "points") if corner is None else (*at, "points", corner), message
        return
    try:
        convex_parts(anticlockwise(zone.points))
    except OutlineError as error:
        yield (*at, "points"), str(error)
