"""Checks of outlines: what a polygon of a scene file must be so that it is one."""

import math
from collections.abc import Iterator

from sandbox.scene.decompose import convex_parts
from sandbox.scene.faults import Location
from sandbox.scene.model import Compound, Scene
from sandbox.scene.outline import OutlineError, anticlockwise, extent_of, fault_of, signed_area
from sandbox.scene.part import Point
from sandbox.scene.solids import AnyPart, BallPart, BoxPart, CapsulePart, PolygonPart

SLIGHTEST = 1e-9
"""How thin a part of a body may be, as a share of how far the body reaches from its position."""


def outlines(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield the faults of a scene's polygons, and of bodies that have no part."""
    for location, points in drawn(scene):
        fault = fault_of(points)
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
            message = "has no part; give it a [[body.ball]], [[body.box]], [[body.capsule]] or [[body.polygon]]"
            yield ("body", k), message
        if all(_is_sound(part.points) for part in compound.polygons):
            yield from _slight(k, compound)


def _is_sound(points: tuple[Point, ...]) -> bool:
    try:
        return fault_of(points) is None and bool(convex_parts(anticlockwise(points)))
    except OutlineError:
        return False


def _slight(k: int, compound: Compound) -> Iterator[tuple[Location, str]]:
    """Yield the parts of a body that rounding would leave nothing of, as far out or as slanting as they lie."""
    drawn = [(location, *_measured(part)) for location, part in _parts(compound)]
    far = max((math.hypot(*part.position) + reach for _, part, reach, _ in drawn), default=0.0)
    for location, _, _, thin in drawn:
        if thin < SLIGHTEST * far:
            message = (
                f"is {thin:g} m thin in a body that reaches {far:g} m from its position; "
                f"at least {SLIGHTEST:g} of that, or rounding would leave nothing of it"
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


def _measured(part: AnyPart) -> tuple[AnyPart, float, float]:
    """Return a part, how far it reaches from its own position, and how thin it is, m."""
    match part:
        case BallPart():
            return part, part.radius, part.radius
        case BoxPart():
            return part, math.hypot(*part.size), min(part.size)
        case CapsulePart():
            return part, part.length + part.radius, part.radius
        case PolygonPart():
            points = anticlockwise(part.points)
            pieces = convex_parts(points)
            extents = [extent_of(piece) for piece in pieces]
            thin = min(signed_area(piece) / extent for piece, extent in zip(pieces, extents, strict=True))
            return part, max(math.hypot(*point) for point in points), thin


def sound(scene: Scene) -> Scene:
    """Return a scene with a triangle for each outline, and a disc for each body; all meet nothing."""
    triangle = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    aloof = {"collides": "none", "mass": 1.0, "density": None}
    polygons = tuple(each.model_copy(update={"points": triangle, **aloof}) for each in scene.polygons)
    nothing = {"boxes": (), "capsules": (), "polygons": ()}
    disc = {"balls": (BallPart(radius=1.0),), **nothing, **aloof}
    compounds = tuple(each.model_copy(update=disc) for each in scene.compounds)
    return scene.model_copy(update={"polygons": polygons, "compounds": compounds})


def drawn(scene: Scene) -> Iterator[tuple[Location, tuple[Point, ...]]]:
    """Yield every outline with its location."""
    for k, polygon in enumerate(scene.polygons):
        yield ("polygon", k, "points"), polygon.points
    for k, compound in enumerate(scene.compounds):
        for n, part in enumerate(compound.polygons):
            yield ("body", k, "polygon", n, "points"), part.points
