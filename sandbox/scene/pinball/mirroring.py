"""Mirroring: the second one of what stands on both sides of a table."""

import math
from collections.abc import Iterator
from typing import Any, TypeVar

from sandbox.scene.part import Point
from sandbox.scene.pinball.element import Element
from sandbox.scene.pinball.solids import Gate

Built = TypeVar("Built", bound=Element)

PLACES = ("position", "pivot", "light")
WAYS = ("facing", "direction", "out")


def both(element: Built, kind: str, number: int, axis: float) -> Iterator[tuple[str, Built]]:
    """Yield what an element stands for, with names: itself, or one on each side of the axis."""
    name = element.name or f"{kind}-{number + 1}"
    if not element.mirrored:
        yield name, element
        return
    for one in (element, reflected(element, axis)):
        yield f"{'left' if middle_of(one)[0] < axis else 'right'} {name}", one


def reflected(element: Built, axis: float) -> Built:
    """Return an element as a mirror along x = axis shows it."""
    changes: dict[str, Any] = {}
    for key in type(element).model_fields:
        value = getattr(element, key)
        if value is None:
            continue
        if key in PLACES:
            changes[key] = (2.0 * axis - value[0], *value[1:])
        elif key == "points":
            # What has a left and a right keeps them if it runs the other way.
            order = reversed(value) if isinstance(element, Gate) else value
            changes[key] = tuple((2.0 * axis - point[0], *point[1:]) for point in order)
        elif key in WAYS:
            changes[key] = (-value[0], value[1])
        elif key == "stops":
            changes[key] = tuple(math.pi - angle for angle in value)
        elif key == "side":
            changes[key] = "right" if value == "left" else "left"
    return element.model_copy(update=changes)


def middle_of(element: Element) -> Point:
    """Return about where an element is, m."""
    for key in ("position", "pivot"):
        place = getattr(element, key, None)
        if place is not None:
            return float(place[0]), float(place[1])
    points: tuple[tuple[float, ...], ...] = getattr(element, "points", None) or ((0.0, 0.0),)
    return sum(p[0] for p in points) / len(points), sum(p[1] for p in points) / len(points)
