"""Gestures that draw new elements: balls, boxes, capsules, planes, and outlines corner by corner or freehand."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Part, Point, is_required
from sandbox.scene.description.bodies import Box, Capsule, Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.editing.elements import FIELD_OF, ElementKey, all_names, elements_of_table, unique_name
from sandbox.scene.editing.transforms import plain_value, round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.scene.geometry.simplification import simplify_loop, simplify_polyline
from sandbox.window.editor.gestures import Gesture, typed_numbers
from sandbox.window.editor.snapping import SNAP_DISTANCE, Pointer, rounded
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import draw_dashes, draw_line
from sandbox.window.render.palette import INK, SKY

BODY_TABLES = ("ball", "box", "capsule", "polygon")
STATIC_TABLES = ("plane", "wall", "post")
FRICTION = 0.7071
"""Friction of a new element: two frictions are multiplied, so that it is 0.5 between two new elements"""
FREEHAND_TOLERANCE = 2.5
"""px at UI scale 1 by which a freehand outline may be simplified"""
WALL_THICKNESS = 0.2
"""of a new wall, as a fraction of the size of an element that is made by a click"""


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

    def __init__(self, scene: Scene, table: str, pointer: Pointer) -> None:
        """Begin to draw an element of a table."""
        super().__init__(scene)
        self.table, self.name = table, unique_name(table, all_names(scene))
        self.begin = self.end = self.snap(pointer)
        self.default = default_size(pointer.view.size)
        """size of an element that is made by a click, m"""
        self.label = f"add a {table}"

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
        name: field.get_default(call_default_factory=True) for name, field in fields.items() if not is_required(field)
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

    def __init__(self, scene: Scene, table: str, pointer: Pointer) -> None:
        """Begin at the first corner."""
        super().__init__(scene, table, pointer)
        self.corners = [self.begin]
        self.is_closed = False
        self._freehand: list[Point] = []  # drawn with the button held
        self._reach = pointer.view.metres(SNAP_DISTANCE)  # of the first corner, within which a click closes the outline
        self._thickness = WALL_THICKNESS * self.default if table == "wall" else 0.0

    def drag(self, pointer: Pointer) -> None:
        """Draw the next side as far as the pointer, or freehand while the button is held."""
        if pointer.is_dragging:
            self._draw_freehand(pointer.point, pointer.view.metres(FREEHAND_TOLERANCE))
        else:
            super().drag(pointer)

    def _draw_freehand(self, point: Point, tolerance: float) -> None:
        """Draw freehand to a point; the line is simplified within a tolerance, m."""
        if not self._freehand:
            if len(self.corners) > 1:
                return
            self._freehand, self.is_multi_click = [self.begin], False
        step = 10.0 ** math.floor(math.log10(tolerance))
        self._freehand.append((rounded(point[0], step), rounded(point[1], step)))
        near = math.dist(self._freehand[0], point) <= self._reach and len(self._freehand) > 8
        self.is_closed = near or self.table != "wall"
        points = self._freehand[:-1] if near else self._freehand
        self.corners = (simplify_loop if self.is_closed else simplify_polyline)(points, tolerance)
        self.end = self.corners[-1]

    def click(self, pointer: Pointer) -> bool:
        """Add a corner; return whether the outline is finished, at its first or its last corner."""
        return self._add_corner(self.snap(pointer))

    def confirm(self) -> bool:
        """Add the corner that is typed; without one, the outline is finished."""
        if not self.typed:
            return True
        self._add_corner(self.end)
        return False

    def _add_corner(self, point: Point) -> bool:
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

    _follows = True  # whether the point of the pointer is a corner, too

    def changes(self) -> list[Change]:
        """Return the change that adds the element, without the point of the pointer."""
        self._follows = False
        return super().changes()

    def dimensions(self) -> str:
        """Return length and direction of the present side."""
        numbers = typed_numbers(self.typed)
        x, y = self.corners[-1]
        end = self._typed_corner(numbers) if numbers else self.end
        angle = math.degrees(math.atan2(end[1] - y, end[0] - x))
        return f"{math.dist(self.corners[-1], end):.4g} m, {angle:.4g}°"

    def draw(self, canvas: Canvas) -> None:
        """Draw the sides, the side that would close the outline, and the corners."""
        surface, unit = canvas.surface, canvas.ui_scale
        *corners, end = canvas.pixels((*self.corners, self.end))
        for a, b in pairwise((*corners, end)):
            draw_line(surface, a, b, SKY, 1.6 * unit)
        if len(corners) > 2:
            draw_dashes(surface, [(end, corners[0])], SKY, 5 * unit)
        for corner in corners:
            draw_disc(surface, corner, 4 * unit, SKY)
        draw_disc(surface, corners[0], 6 * unit, INK, 4 * unit)


def default_size(view_size: float) -> float:
    """Return the size of an element that is made by a click, m: a round length of about a thirtieth of the view."""
    power = 10.0 ** math.floor(math.log10(view_size / 30.0))
    return rounded(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= view_size / 30.0), power)
