"""Checks of outlines: what a polygon of a scene file must be so that it is one."""

from collections.abc import Iterator

from sandbox.scene.decompose import convex_parts
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene
from sandbox.scene.outline import OutlineError, anticlockwise, fault_of
from sandbox.scene.part import Point


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


def drawn(scene: Scene) -> Iterator[tuple[Location, tuple[Point, ...]]]:
    """Yield every outline with its location."""
    for k, polygon in enumerate(scene.polygons):
        yield ("polygon", k, "points"), polygon.points
    for k, compound in enumerate(scene.compounds):
        for n, part in enumerate(compound.polygons):
            yield ("body", k, "polygon", n, "points"), part.points
