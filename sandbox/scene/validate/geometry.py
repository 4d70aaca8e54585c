"""Checks of polygons, zones, sensors, layers and repeated elements.

Static colliders repeated at one position are limited, because a tree of bounding boxes, which most engines use, cannot
separate equal boxes: inserting n of them takes O(n²).
"""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.description.bodies import AnyPart, BallPart, BoxPart, CapsulePart, Compound, PolygonPart
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import (
    MAX_CATEGORIES,
    MAX_LAYERS,
    MAX_SENSORS,
    MAX_ZONES,
    Plane,
    Sensor,
    Wall,
    Zone,
)
from sandbox.scene.errors import LocatedMessage, Location
from sandbox.scene.geometry.polygon import OutlineError, anticlockwise, extent_of, outline_fault, signed_area
from sandbox.scene.geometry.shapes import contains, geometry_of, middle_of
from sandbox.scene.geometry.triangulation import convex_parts
from sandbox.scene.geometry.vectors import to_world

MIN_THICKNESS = 1e-9
"""Smallest thickness of a part, as a fraction of the body's extent from its position."""


def check_outlines(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of polygons, and of bodies without parts."""
    for location, points in polygon_outlines(scene):
        fault = outline_fault(points)
        if fault is not None:
            corner, message = fault
            yield (location if corner is None else (*location, corner)), message
            continue
        try:
            convex_parts(anticlockwise(points))
        except OutlineError as error:
            yield location, str(error)
    for k, compound in enumerate(scene.compounds):
        if not compound.parts:
            message = "has no parts; add a [[body.ball]], [[body.box]], [[body.capsule]] or [[body.polygon]]"
            yield ("body", k), message
        for n, capsule in enumerate(compound.capsules):
            if (capsule.length is None) == (capsule.ends is None):
                yield ("body", k, "capsule", n), "must have either `length` (along x) or `ends`, and not both"
            elif capsule.ends is not None and capsule.ends[0] == capsule.ends[1]:
                yield ("body", k, "capsule", n, "ends"), "are the same point; use a [[body.ball]]"
        if all(_is_sound(part.points) for part in compound.polygons):
            yield from _check_part_thickness(k, compound)


def _is_sound(points: tuple[Point, ...]) -> bool:
    try:
        return outline_fault(points) is None and bool(convex_parts(anticlockwise(points)))
    except OutlineError:
        return False


def _check_part_thickness(k: int, compound: Compound) -> Iterator[LocatedMessage]:
    """Yield the parts of a body that rounding would reduce to nothing at their position and angle."""
    polygon_outlines = [(location, *_part_size(part)) for location, part in _parts(compound)]
    extent = max((math.hypot(*part.position) + reach for _, part, reach, _ in polygon_outlines), default=0.0)
    for location, _, _, thin in polygon_outlines:
        if thin < MIN_THICKNESS * extent:
            message = (
                f"is {thin:g} m thin in a body that reaches {extent:g} m from its position; "
                f"at least {MIN_THICKNESS:g} of that, or rounding would leave nothing of it"
            )
            yield ("body", k, *location), message


def _parts(compound: Compound) -> Iterator[tuple[Location, AnyPart]]:
    kinds: dict[str, tuple[AnyPart, ...]] = {
        "ball": compound.balls,
        "box": compound.boxes,
        "capsule": compound.capsules,
        "polygon": compound.polygons,
    }
    for kind, parts in kinds.items():
        for n, part in enumerate(parts):
            yield (kind, n), part


def _part_size(part: AnyPart) -> tuple[AnyPart, float, float]:
    """Return a part, its extent from its own position, and its thickness, m."""
    match part:
        case BallPart():
            return part, part.radius, part.radius
        case BoxPart():
            return part, math.hypot(*part.size) + part.radius, min(part.size) + part.radius
        case CapsulePart():
            return part, max(math.hypot(*end) for end in part.centres) + part.radius, part.radius
        case PolygonPart():
            points = anticlockwise(part.points)
            pieces = convex_parts(points)
            extents = [extent_of(piece) for piece in pieces]
            thin = min(signed_area(piece) / extent for piece, extent in zip(pieces, extents, strict=True))
            return part, max(math.hypot(*point) for point in points) + part.radius, thin + part.radius


def with_placeholder_shapes(scene: Scene) -> Scene:
    """Return the scene with a triangle for each polygon and a disc for each compound; they do not collide."""
    triangle = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    isolated = {"collides": "none", "mass": 1.0, "density": None}
    polygons = tuple(each.model_copy(update={"points": triangle, **isolated}) for each in scene.polygons)
    no_parts = {"boxes": (), "capsules": (), "polygons": (), "centre_of_mass": None}
    disc = {"balls": (BallPart(radius=1.0),), **no_parts, **isolated}
    compounds = tuple(each.model_copy(update=disc) for each in scene.compounds)
    return scene.model_copy(update={"polygons": polygons, "compounds": compounds})


def without_paths(scene: Scene) -> Scene:
    """Return the scene with all kinematic bodies at rest."""
    kinds = ("balls", "boxes", "capsules", "polygons", "compounds")
    at_rest = {kind: tuple(each.model_copy(update={"path": None}) for each in getattr(scene, kind)) for kind in kinds}
    return scene.model_copy(update=at_rest)


def polygon_outlines(scene: Scene) -> Iterator[tuple[Location, tuple[Point, ...]]]:
    """Yield every outline with its location."""
    for k, polygon in enumerate(scene.polygons):
        yield ("polygon", k, "points"), polygon.points
    for k, compound in enumerate(scene.compounds):
        for n, part in enumerate(compound.polygons):
            yield ("body", k, "polygon", n, "points"), part.points


MAX_REPEATS = 5_000
"""Identical shapes; half a second."""

ShapeKey = tuple[float | str, ...]


def check_repeats(scene: Scene) -> list[LocatedMessage]:
    """Return a fault for every kind of static collider that is repeated too often."""
    found: list[LocatedMessage] = []
    seen: Counter[ShapeKey] = Counter()
    for location, key in _shapes(scene):
        seen[key] += 1
        if seen[key] == MAX_REPEATS + 1:
            found.append((location, f"more than {MAX_REPEATS:,} identical objects are at this place; keep one"))
    return found


def _shapes(scene: Scene) -> Iterator[tuple[Location, ShapeKey]]:
    for k, plane in enumerate(scene.planes):
        yield ("plane", k), _plane(plane)
    for k, wall in enumerate(scene.walls):
        for n, segment in enumerate(_segments(wall)):
            yield ("wall", k, "points", n), segment
    for k, post in enumerate(scene.posts):
        yield ("post", k), _disc(post.position, post.radius)
    for kind, sources in scene.kinds.items():
        for k, single in enumerate(sources):
            if isinstance(single, BodySpec) and single.fixed and single.collides != "none":
                for key in _boxes(single):
                    yield (kind, k), key


def _disc(position: Point, radius: float) -> ShapeKey:
    return "disc", *position, radius


def _boxes(single: BodySpec) -> Iterator[ShapeKey]:
    """Yield the bounding box of each piece of a fixed body; bodies with equal boxes count as identical."""
    if isinstance(single, Ball):
        yield _disc(single.position, single.radius)
        return
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    form = geometry_of(single)
    x, y = form.centre
    for piece in form.pieces:
        corners = [to_world((a + x, b + y), cos, sin, single.position) for a, b in piece.corners]
        xs, ys = [a for a, _ in corners], [b for _, b in corners]
        r = piece.radius
        yield "box", *(round(each, 9) for each in (min(xs) - r, max(xs) + r, min(ys) - r, max(ys) + r))


def _plane(plane: Plane) -> ShapeKey:
    """Return direction and distance from the origin of a plane; its point may be any point on it."""
    length = math.hypot(*plane.normal)
    x, y = (component / length for component in plane.normal) if length > 0 else plane.normal
    return "plane", round(x, 9), round(y, 9), round(x * plane.point[0] + y * plane.point[1], 9)


def _segments(wall: Wall) -> Iterator[ShapeKey]:
    ends = (*wall.points, wall.points[0]) if wall.closed else wall.points
    for a, b in pairwise(ends):
        low, high = sorted((a, b))
        yield "segment", *low, *high, wall.thickness


SHORTEST = 1e-9
"""m, smallest length of a segment of a strip"""


def check_zones(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of zones."""
    if len(scene.zones) > MAX_ZONES:
        yield ("zone", MAX_ZONES), f"a scene has at most {MAX_ZONES:,} zones"
    for k, zone in enumerate(scene.zones):
        wrong = list(_check_area(("zone", k), zone))
        yield from wrong
        if zone.liquid is not None and (zone.points is None or zone.thickness is not None):
            yield ("zone", k, "liquid"), "needs a polygon: `points` without `thickness`, and no `position` and `radius`"
        if not wrong and zone.holds and not contains(zone, middle_of(zone)):
            x, y = middle_of(zone)
            yield ("zone", k, "holds"), f"its centre, ({x:g}, {y:g}) m, is outside the zone, so it cannot hold a body"
    if scene.zones and scene.surface is not None:
        yield ("zone", 0), "zones are not supported in a scene with a [surface]; remove one of the two"


def check_sensors(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of sensors, except those of their bodies."""
    if len(scene.sensors) > MAX_SENSORS:
        yield ("sensor", MAX_SENSORS), f"a scene has at most {MAX_SENSORS:,} sensors"
    for k, sensor in enumerate(scene.sensors):
        yield from _check_area(("sensor", k), sensor)
        for n, name in enumerate(sensor.detects or ()):
            if name not in scene.categories:
                known = ", ".join(map(repr, scene.categories)) or "none"
                yield ("sensor", k, "detects", n), f"no object names the category {name!r}; those of the scene: {known}"


def check_layers(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of collision layers."""
    layers = scene.layers
    if len(layers) > MAX_LAYERS:
        yield (), f"uses {len(layers)} layers, {', '.join(layers)}; the limit is {MAX_LAYERS}"
    if len(layers) > 1 and scene.surface is not None:
        yield (), f"has a [surface] and the layer {layers[1]!r}; a scene with a [surface] has a single layer"


def check_categories(scene: Scene) -> Iterator[LocatedMessage]:
    """Yield the faults of collision categories."""
    categories = scene.categories
    if len(categories) > MAX_CATEGORIES:
        yield (), f"uses {len(categories)} categories; the limit is {MAX_CATEGORIES}"
    if categories and scene.surface is not None:
        yield (
            (),
            f"has a [surface] and the category {categories[0]!r}; balls and pucks on a [surface] have no categories",
        )


def _check_area(at: Location, zone: Zone | Sensor) -> Iterator[LocatedMessage]:
    """Yield the faults of the shape of a zone or sensor."""
    if zone.points is None:
        if zone.position is None or zone.radius is None:
            yield at, "has no shape; add `position` and `radius`, or `points`, or `points` and `thickness`"
        elif zone.thickness is not None:
            yield (*at, "thickness"), "applies to a strip (`points`) only, not to a circle; remove it"
        return
    for key in ("position", "radius"):
        if getattr(zone, key) is not None:
            yield (*at, key), "applies to a circle and cannot be combined with `points`; remove one of the two"
            return
    if zone.thickness is not None:
        for n, (a, b) in enumerate(zip(zone.points, zone.points[1:], strict=False)):
            if math.dist(a, b) < SHORTEST:
                yield (
                    (*at, "points", n),
                    f"is at the same place as the next point; they must be at least {SHORTEST:g} m apart",
                )
        return
    if len(zone.points) < 3:
        yield (*at, "points"), "must be at least three points, or have a `thickness`"
        return
    fault = outline_fault(zone.points)
    if fault is not None:
        corner, message = fault
        yield (*at, "points") if corner is None else (*at, "points", corner), message
        return
    try:
        convex_parts(anticlockwise(zone.points))
    except OutlineError as error:
        yield (*at, "points"), str(error)
