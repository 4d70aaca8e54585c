"""Gestures that draw new elements: balls, boxes, capsules, planes, and outlines corner by corner or freehand."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, cast

from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part, Point
from sandbox.scene.description.bodies import Box, Capsule, Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.editing.elements import FIELD_OF, ElementKey, elements_of_table
from sandbox.scene.editing.outlines import simplified, simplified_loop
from sandbox.scene.editing.transforms import plain_value, round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.window.editor.gestures import Gesture, typed_numbers
from sandbox.window.editor.snapping import rounded

BODY_TABLES = ("ball", "box", "capsule", "polygon")
STATIC_TABLES = ("plane", "wall", "post")
FRICTION = 0.7071
"""Friction of a new element: two frictions are multiplied, so that it is 0.5 between two new elements"""


def has_friction(scene: Scene, table: str) -> bool:
    """Return whether a new element of a table states a friction: if a body does, or there is none.

    One side is enough for friction, so that a single element with it would rub on all others of a scene whose bodies
    state none. Balls on a `[surface]` have no friction of this kind.
    """
    if table not in (*BODY_TABLES, *STATIC_TABLES) or scene.surface is not None:
        return False
    surfaces = contact_matrix(scene).surfaces
    frictions = [surfaces.surfaces[k].friction for k in set(surfaces.of_shape.tolist())]
    return not frictions or any(each is not None for each in frictions)


class DrawGesture(Gesture):
    """Draws a new element."""

    def __init__(self, scene: Scene, table: str, name: str, point: Point, default: float) -> None:
        """Begin to draw.

        Args:
            scene: the scene.
            table: heading of the table.
            name: of the new element.
            point: of the press, m.
            default: size of an element that is made by a click, m.
        """
        super().__init__(scene)
        self.table, self.name, self.begin, self.end, self.default = table, name, point, point, default
        self.label = f"add a {table}"

    def move(self, point: Point) -> None:
        """Draw as far as a point."""
        self.end = point

    @property
    def is_click(self) -> bool:
        """Whether the pointer has not moved since the press."""
        return self.begin == self.end and not typed_numbers(self.typed)

    @abstractmethod
    def values(self) -> dict[str, Any] | None:
        """Return the values of the new table; None if it has no size yet."""

    def preview(self) -> Scene:
        """Return the scene with the new element."""
        values = self.values()
        return self.scene if values is None else self._scene_with(values)

    def _scene_with(self, values: dict[str, Any]) -> Scene:
        element = ELEMENT_TYPES[self.table].model_construct(
            None, **{**defaults_of(self.table), **{key: _tuples(value) for key, value in values.items()}}
        )
        elements = (*elements_of_table(self.scene, self.table), element)
        return self.scene.model_copy(update={FIELD_OF[self.table]: elements})

    def changes(self) -> list[Change]:
        """Return the change that adds the element."""
        values = self.values()
        if values is None:
            return []
        drawn = {key: plain_value(value) for key, value in values.items()}
        surface = {"friction": FRICTION} if has_friction(self.scene, self.table) else {}
        return [AddElement(self.table, {"name": self.name, **drawn, **surface})]

    @property
    def selects(self) -> list[ElementKey] | None:
        """The new element."""
        return [ElementKey(self.table, len(elements_of_table(self.scene, self.table)))]


ELEMENT_TYPES: Mapping[str, type[Part]] = {
    "ball": Ball,
    "box": Box,
    "capsule": Capsule,
    "polygon": Polygon,
    "plane": Plane,
    "wall": Wall,
    "post": Post,
    "zone": Zone,
}
"""Types of the elements that can be drawn, by the heading of their tables"""


def defaults_of(table: str) -> dict[str, Any]:
    """Return the default values of the fields of a table."""
    fields = ELEMENT_TYPES[table].model_fields
    return {
        name: field.get_default(call_default_factory=True) for name, field in fields.items() if not field.is_required()
    }


def _tuples(value: Any) -> Any:
    return tuple(_tuples(each) for each in value) if isinstance(value, list | tuple) else value


class DiscGesture(DrawGesture):
    """Draws a ball, a post or a round zone from its centre."""

    def values(self) -> dict[str, Any]:
        """Return centre and radius."""
        return {"position": self.begin, "radius": self._radius()}

    def _radius(self) -> float:
        numbers = typed_numbers(self.typed)
        if numbers and numbers[0] > 0.0:
            return numbers[0]
        return self.default if self.is_click else max(round_value(math.dist(self.begin, self.end)), 1e-9)

    def dimensions(self) -> str:
        """Return the radius."""
        return f"r {self._radius():.4g} m"


class BoxGesture(DrawGesture):
    """Draws a box from corner to corner."""

    def _size(self) -> tuple[float, float]:
        numbers = [each for each in typed_numbers(self.typed) if each > 0.0]
        if numbers:
            return numbers[0], numbers[1] if len(numbers) > 1 else numbers[0]
        if self.is_click:
            return 2.0 * self.default, 2.0 * self.default
        return abs(round_value(self.end[0] - self.begin[0])), abs(round_value(self.end[1] - self.begin[1]))

    def values(self) -> dict[str, Any] | None:
        """Return centre and size; None without an area."""
        width, height = self._size()
        if width <= 0.0 or height <= 0.0:
            return None
        if self.is_click:
            return {"position": self.begin, "size": (width, height)}
        right = 1.0 if self.end[0] >= self.begin[0] else -1.0
        up = 1.0 if self.end[1] >= self.begin[1] else -1.0
        centre = round_value(self.begin[0] + 0.5 * right * width), round_value(self.begin[1] + 0.5 * up * height)
        return {"position": centre, "size": (width, height)}

    def dimensions(self) -> str:
        """Return width and height."""
        width, height = self._size()
        return f"{width:.4g} × {height:.4g} m"


class CapsuleGesture(DrawGesture):
    """Draws a capsule from one end to the other; its radius is a quarter of its length, or typed second."""

    def values(self) -> dict[str, Any]:
        """Return centre, angle, length and radius."""
        length, radius = self._measures()
        dx, dy = self.end[0] - self.begin[0], self.end[1] - self.begin[1]
        angle = math.atan2(dy, dx) if dx or dy else 0.0
        if self.is_click:
            return {"position": self.begin, "length": length, "radius": radius}
        cos, sin = (dx / math.hypot(dx, dy), dy / math.hypot(dx, dy)) if dx or dy else (1.0, 0.0)
        centre = round_value(self.begin[0] + 0.5 * length * cos), round_value(self.begin[1] + 0.5 * length * sin)
        values: dict[str, Any] = {"position": centre, "length": length, "radius": radius}
        return values | ({"angle": round_value(angle)} if angle else {})

    def _measures(self) -> tuple[float, float]:
        numbers = [each for each in typed_numbers(self.typed) if each > 0.0]
        length = numbers[0] if numbers else round_value(math.dist(self.begin, self.end))
        if self.is_click or length <= 0.0:
            length = 2.0 * self.default
        return length, numbers[1] if len(numbers) > 1 else round_value(0.25 * length)

    def dimensions(self) -> str:
        """Return length and radius."""
        length, radius = self._measures()
        return f"length {length:.4g}, r {radius:.4g} m"


class PlaneGesture(DrawGesture):
    """Draws a half-plane along its surface; the solid is to the right of the direction of the pointer."""

    def values(self) -> dict[str, Any]:
        """Return a point and the normal."""
        dx, dy = self.end[0] - self.begin[0], self.end[1] - self.begin[1]
        numbers = typed_numbers(self.typed)
        if numbers:
            dx, dy = math.cos(math.radians(numbers[0])), math.sin(math.radians(numbers[0]))
        if not dx and not dy:
            dx, dy = 1.0, 0.0
        length = math.hypot(dx, dy)
        return {"point": self.begin, "normal": (round_value(-dy / length), round_value(dx / length))}

    def dimensions(self) -> str:
        """Return the angle of the surface."""
        x, y = cast("Point", self.values()["normal"])
        return f"{math.degrees(math.atan2(-x, y)):.4g}°"


class OutlineGesture(DrawGesture):
    """Draws corner by corner: a wall, a polygon or a polygonal zone. It ends at its first corner or with Enter."""

    is_multi_click = True

    def __init__(
        self, scene: Scene, table: str, name: str, point: Point, default: float, reach: float, thickness: float = 0.0
    ) -> None:
        """Begin to draw.

        Args:
            scene: the scene.
            table: heading of the table.
            name: of the new element.
            point: first corner, m.
            default: size that elements have on the screen, m.
            reach: distance from the first corner within which a click closes the outline, m.
            thickness: of a wall, m.
        """
        super().__init__(scene, table, name, point, default)
        self.corners: list[Point] = [point]
        self.is_closed = False
        self._freehand: list[Point] = []
        self._reach, self._thickness = reach, thickness

    @property
    def is_freehand(self) -> bool:
        """Whether the outline is drawn with the button held."""
        return bool(self._freehand)

    def draw_freehand(self, point: Point, tolerance: float) -> None:
        """Draw freehand to a point; the line is simplified within a tolerance, m."""
        if not self._freehand:
            if len(self.corners) > 1:
                return
            self._freehand = [self.begin]
        step = 10.0 ** math.floor(math.log10(tolerance))
        self._freehand.append((rounded(point[0], step), rounded(point[1], step)))
        near = math.dist(self._freehand[0], point) <= self._reach and len(self._freehand) > 8
        self.is_closed = near or self.table != "wall"
        points = self._freehand[:-1] if near else self._freehand
        self.corners = (simplified_loop if self.is_closed else simplified)(points, tolerance)
        self.end = self.corners[-1]

    def click(self, point: Point) -> bool:
        """Add a corner; return whether the outline is finished, at its first or its last corner."""
        numbers = typed_numbers(self.typed)
        if numbers:
            point, self.typed = self._typed_corner(numbers), ""
        if len(self.corners) > 2 and math.dist(point, self.corners[0]) <= self._reach:
            self.is_closed = True
            return True
        if math.dist(point, self.corners[-1]) <= 1e-9:
            return len(self.corners) > 1
        self.corners.append(point)
        self.end = point
        return False

    def _typed_corner(self, numbers: Sequence[float]) -> Point:
        """Return the corner at a typed length in the direction of the pointer, or at a typed angle in degrees."""
        x, y = self.corners[-1]
        angle = math.atan2(self.end[1] - y, self.end[0] - x) if len(numbers) < 2 else math.radians(numbers[1])
        return round_value(x + numbers[0] * math.cos(angle)), round_value(y + numbers[0] * math.sin(angle))

    def remove_corner(self) -> bool:
        """Remove the last corner; return whether any is left."""
        self.corners.pop()
        return bool(self.corners)

    def values(self) -> dict[str, Any] | None:
        """Return the corners; None if there are too few."""
        points = [*self.corners]
        if not self.is_closed and self.end != points[-1] and self._follows:
            points.append(self.end)
        points = [point for k, point in enumerate(points) if k == 0 or point != points[k - 1]]
        if self.table == "wall":
            if len(points) < 2:
                return None
            closed: dict[str, Any] = {"closed": True} if self.is_closed else {}
            return {"points": points, **({"thickness": self._thickness} if self._thickness else {}), **closed}
        if len(points) < 3 or points[0] == points[-1]:
            return None
        if self.table == "polygon":
            x, y = self.corners[0]
            return {"position": (x, y), "points": [(round_value(a - x), round_value(b - y)) for a, b in points]}
        return {"points": points}

    _follows = True

    def finish(self) -> None:
        """End the outline at its last corner, without the point of the pointer."""
        self._follows = False

    def changes(self) -> list[Change]:
        """Return the change that adds the element, without the point of the pointer."""
        self.finish()
        return super().changes()

    def dimensions(self) -> str:
        """Return length and direction of the present side."""
        numbers = typed_numbers(self.typed)
        x, y = self.corners[-1]
        end = self._typed_corner(numbers) if numbers else self.end
        angle = math.degrees(math.atan2(end[1] - y, end[0] - x))
        return f"{math.dist(self.corners[-1], end):.4g} m, {angle:.4g}°"


def default_size(view_size: float) -> float:
    """Return the size of an element that is made by a click, m: a round length of about a thirtieth of the view."""
    power = 10.0 ** math.floor(math.log10(view_size / 30.0))
    return rounded(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= view_size / 30.0), power)
