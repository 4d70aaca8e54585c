"""Tables of a scene from shapes of a level: the values of their geometry and keys."""

import math
import re
from collections.abc import Sequence
from functools import cache
from typing import Any, Literal

from sandbox.levels.outlines import (
    CircleShape,
    LevelShape,
    LineShape,
    PolygonShape,
    RectangleShape,
    centroid,
    outline_of,
)
from sandbox.scene.description.base import Part, Point
from sandbox.scene.description.bodies import BallPart, Box, BoxPart, Compound, Polygon, PolygonPart
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post, Wall, Zone
from sandbox.scene.geometry.polygon import extent_of

LevelRole = Literal["static", "dynamic", "zone", "ignore"]
"""What an element becomes: a static object, a body, a zone, or nothing."""

MODELS: dict[str, type[Part]] = {
    "wall": Wall,
    "post": Post,
    "zone": Zone,
    "ball": Ball,
    "box": Box,
    "polygon": Polygon,
    "body": Compound,
}
"""Model of each table that an element can become, in the order of the file."""
PART_MODELS: dict[str, type[Part]] = {"ball": BallPart, "box": BoxPart, "polygon": PolygonPart}
"""Model of each part of a body."""

_DRAWN = frozenset(
    {"name", "position", "radius", "size", "points", "thickness", "closed", "angle", "fixed", "spin", "height"}
    | {"ball", "box", "capsule", "polygon"}
)
"""Keys that the drawing gives, or that need a table around them."""
_TEXTS = frozenset({"material", "collides", "layer", "to_layer", "colour"})
"""Keys whose values are text, even one that looks like a number."""
_LISTS = frozenset({"layers"})
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


@cache
def keys_of(model: type[Part]) -> frozenset[str]:
    """Return the keys of a table that a level can give."""
    return frozenset(field.alias or name for name, field in model.model_fields.items()) - _DRAWN


class LengthRounding:
    """Rounds lengths to a millionth of a user unit, and those of small shapes to seven digits."""

    def __init__(self, scale: float) -> None:
        self._decimals = 6 - math.floor(math.log10(scale))

    def point(self, point: Point, extent: float) -> Point:
        """Return a point of a shape of some extent, m."""
        decimals = self._decimals_of(extent)
        x, y = (round(each, decimals) + 0.0 for each in point)  # + 0.0 turns −0 into 0
        return x, y

    def length(self, value: float) -> float:
        """Return a length, m."""
        return round(value, self._decimals_of(value))

    def _decimals_of(self, extent: float) -> int:
        if extent <= 0.0:
            return self._decimals
        return max(self._decimals, 6 - math.floor(math.log10(extent)))


def table_of(shape: LevelShape, role: LevelRole, rounding: LengthRounding) -> tuple[str, dict[str, Any]]:
    """Return the table of a shape, and the values that give its geometry."""
    fixed = {"fixed": True} if role == "static" else {}
    values: dict[str, Any]
    match shape:
        case CircleShape(centre, radius):
            table = {"static": "post", "dynamic": "ball", "zone": "zone"}[role]
            return table, {"position": rounding.point(centre, radius), "radius": rounding.length(radius)}
        case RectangleShape(centre, size, angle, radius) if role != "zone":
            position, (width, height) = rounding.point(centre, max(size)), size
            values = {"position": position, "size": (rounding.length(width), rounding.length(height))}
            round_corners = {"radius": rounding.length(radius)} if radius else {}
            turned = round(angle, 12)
            return "box", values | round_corners | ({"angle": turned} if turned else {}) | fixed
        case RectangleShape():
            extent = max(shape.size)
            return "zone", {"points": tuple(rounding.point(each, extent) for each in outline_of(shape, extent))}
        case PolygonShape(points):
            extent = extent_of(points)
            if role == "zone":
                return "zone", {"points": tuple(rounding.point(each, extent) for each in points)}
            x, y = rounding.point(centroid(points), extent)
            moved = tuple(rounding.point((px - x, py - y), extent) for px, py in points)
            return "polygon", {"position": (x, y), "points": moved} | fixed
        case LineShape(points, thickness, closed):
            if closed and role == "zone":
                return table_of(PolygonShape(points), role, rounding)
            corners = tuple(rounding.point(each, extent_of(points)) for each in points)
            values = {"points": corners, "thickness": rounding.length(thickness)}
            table = "zone" if role == "zone" else "wall"
            return table, values | ({"closed": True} if closed else {})
    raise AssertionError(shape)


def bounds_of(shape: LevelShape) -> Sequence[Point]:
    """Return points that have the same bounding box as a shape, m."""
    match shape:
        case CircleShape((x, y), radius):
            return ((x - radius, y - radius), (x + radius, y + radius))
        case RectangleShape(radius=radius) if radius:
            corners = outline_of(shape._replace(radius=0.0), 0.0)
            return [(x + side * radius, y + side * radius) for x, y in corners for side in (-1.0, 1.0)]
        case _:
            return outline_of(shape, 0.0)


def colour_values(colour: str | None) -> dict[str, str]:
    """Return the key `colour`, if there is a colour."""
    return {} if colour is None else {"colour": colour}


def parse_value(key: str, text: str) -> Any:
    """Return the value of a key from the text of an attribute: a number, numbers, true or false, or text."""
    text = text.strip()
    if key in _TEXTS:
        return text
    words = [word for word in re.split(r"[\s,]+", text.strip("[]()")) if word]
    if key in _LISTS:
        return words
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    if words and all(_NUMBER.fullmatch(word) and math.isfinite(float(word)) for word in words):
        numbers = [float(word) for word in words]
        if key == "kick" and len(numbers) == 1:
            return {"speed": numbers[0]}
        return numbers[0] if len(numbers) == 1 else numbers
    return text
