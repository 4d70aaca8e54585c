"""Gestures: what happens between the press and the release of the mouse, or between the clicks, of an editor tool.

A gesture previews its effect as a scene that is not validated, states dimensions for the overlay, and ends in changes
of the draft. Positions are snapped by the editor before they come here, m. Numbers that are typed replace dimensions.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Any, cast

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Part, Point
from sandbox.scene.description.bodies import Box, Capsule, Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall, Zone
from sandbox.scene.editing.elements import (
    FIELD_OF,
    ElementKey,
    element_at,
    elements_of_table,
    with_elements,
    with_moved_bodies,
)
from sandbox.scene.editing.outlines import simplified, simplified_loop
from sandbox.scene.editing.transforms import Similarity, plain_value, round_value, transformation
from sandbox.scene.files.toml_changes import AddElement, Change, SetValue
from sandbox.window.editor.snapping import rounded


class Gesture(ABC):
    """A gesture that has begun."""

    label = ""
    """what it does, for the menu of undo"""
    is_multi_click = False
    """whether it continues after the release of the button, until it is finished"""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.typed = ""
        """numbers that were typed"""

    @abstractmethod
    def move(self, point: Point) -> None:
        """Move the pointer to a point, m."""

    @abstractmethod
    def changes(self) -> Sequence[Change]:
        """Return the changes of the draft; empty if there are none."""

    def preview(self) -> Scene:
        """Return the scene as it will be, not validated."""
        return self.scene

    def dimensions(self) -> str:
        """Return the present dimensions, such as `r 0.35 m`."""
        return ""

    def type_text(self, text: str) -> None:
        """Replace dimensions by typed numbers."""
        self.typed = text

    def click(self, point: Point) -> bool:
        """Take a further click; return whether the gesture is finished."""
        self.move(point)
        return True

    @property
    def selects(self) -> list[ElementKey] | None:
        """The elements that are selected afterwards; None to keep the selection."""
        return None


def typed_numbers(text: str) -> list[float]:
    """Return the complete numbers of a typed text, separated by commas, spaces or `x`."""
    found = []
    for part in text.replace("×", " ").replace("x", " ").replace(",", " ").split():
        try:
            value = float(part)
        except ValueError:
            continue
        if math.isfinite(value):
            found.append(value)
    return found


class TransformGesture(Gesture):
    """Moves, rotates or scales elements."""

    def __init__(self, scene: Scene, keys: Collection[ElementKey]) -> None:
        super().__init__(scene)
        self.keys = tuple(keys)
        self.by = Similarity()

    def values(self) -> Mapping[ElementKey, dict[str, Any]]:
        """Return the new values of each element."""
        return transformation(self.scene, self.keys, self.by)

    def preview(self) -> Scene:
        """Return the scene with the elements transformed."""
        return preview_of(self.scene, self.values())

    def changes(self) -> list[Change]:
        """Return the changes of all transformed elements."""
        return set_values(self.values())


def set_values(values: Mapping[ElementKey, Mapping[str, Any]]) -> list[Change]:
    """Return the changes that give elements new values."""
    return [
        SetValue((*key.location, name), plain_value(value))
        for key, changed in values.items()
        for name, value in changed.items()
    ]


def preview_of(scene: Scene, values: Mapping[ElementKey, Mapping[str, Any]]) -> Scene:
    """Return a scene with new values of elements, not validated."""
    replaced: dict[ElementKey, Part] = {}
    for key, changed in values.items():
        element = element_at(scene, key)
        fields = {name: value for name, value in changed.items() if name in type(element).model_fields}
        replaced[key] = element.model_copy(update=fields)
    bodies = {key: each for key, each in replaced.items() if isinstance(each, BodySpec)}
    others = {key: each for key, each in replaced.items() if key not in bodies}
    if bodies and all(changed.keys() <= {"position", "angle"} for key, changed in values.items() if key in bodies):
        scene, replaced = with_moved_bodies(with_elements(scene, others) if others else scene, bodies), {}
    return with_elements(scene, replaced) if replaced else scene


class MoveGesture(TransformGesture):
    """Moves elements by the way of the pointer."""

    label = "move"

    def __init__(self, scene: Scene, keys: Collection[ElementKey], begin: Point) -> None:
        super().__init__(scene, keys)
        self._begin = begin

    def move(self, point: Point) -> None:
        """Move the elements by the way from the press to a point."""
        self.shift_by((point[0] - self._begin[0], point[1] - self._begin[1]))

    def shift_by(self, shift: Point) -> None:
        """Move the elements by a vector, m."""
        self.by = Similarity(shift=(round_value(shift[0]), round_value(shift[1])))

    def type_text(self, text: str) -> None:
        """Move by typed distances: Δx, Δy."""
        super().type_text(text)
        numbers = typed_numbers(text)
        if numbers:
            self.by = Similarity(shift=(numbers[0], numbers[1] if len(numbers) > 1 else 0.0))

    def dimensions(self) -> str:
        """Return the way."""
        x, y = self.by.shift
        return f"Δ {x:.4g}, {y:.4g} m"


class RotateGesture(TransformGesture):
    """Rotates elements about a centre; in steps of 15° unless the snap is suspended."""

    label = "rotate"
    STEP = math.radians(15.0)

    def __init__(self, scene: Scene, keys: Collection[ElementKey], centre: Point, begin: Point) -> None:
        super().__init__(scene, keys)
        self.centre, self._begin = centre, math.atan2(begin[1] - centre[1], begin[0] - centre[0])
        self.is_snapped = True

    def move(self, point: Point) -> None:
        """Turn the elements towards a point."""
        angle = math.atan2(point[1] - self.centre[1], point[0] - self.centre[0]) - self._begin
        angle = math.remainder(angle, math.tau)
        if self.is_snapped:
            angle = round(angle / self.STEP) * self.STEP
        self.by = Similarity(self.centre, angle)

    def type_text(self, text: str) -> None:
        """Rotate by a typed angle, degrees."""
        super().type_text(text)
        numbers = typed_numbers(text)
        if numbers:
            self.by = Similarity(self.centre, math.radians(numbers[0]))

    def dimensions(self) -> str:
        """Return the angle."""
        return f"{math.degrees(self.by.angle):.4g}°"


class ScaleGesture(TransformGesture):
    """Scales elements about a fixed corner."""

    label = "scale"
    SMALLEST = 1e-3

    def __init__(self, scene: Scene, keys: Collection[ElementKey], fixed: Point, begin: Point) -> None:
        super().__init__(scene, keys)
        self._fixed, self._begin = fixed, begin

    def move(self, point: Point) -> None:
        """Scale so that the corner follows a point."""
        before = self._begin[0] - self._fixed[0], self._begin[1] - self._fixed[1]
        squared = before[0] ** 2 + before[1] ** 2
        along = (point[0] - self._fixed[0]) * before[0] + (point[1] - self._fixed[1]) * before[1]
        factor = max(along / squared if squared else 1.0, self.SMALLEST)
        self.by = Similarity(self._fixed, scale=float(f"{factor:.3g}"))

    def type_text(self, text: str) -> None:
        """Scale by a typed factor."""
        super().type_text(text)
        numbers = typed_numbers(text)
        if numbers and numbers[0] > 0.0:
            self.by = Similarity(self._fixed, scale=numbers[0])

    def dimensions(self) -> str:
        """Return the factor."""
        return f"× {self.by.scale:.4g}"


class VertexGesture(Gesture):
    """Moves one corner of a wall, zone or polygon."""

    label = "move a corner"

    def __init__(self, scene: Scene, key: ElementKey, corner: int, offset: Point = (0.0, 0.0)) -> None:
        """Begin to move a corner.

        Args:
            scene: the scene.
            key: the element.
            corner: index of the corner.
            offset: place of the origin of the corners, m.
        """
        super().__init__(scene)
        self._key, self._corner, self._offset = key, corner, offset
        self._points = list(cast("tuple[Point, ...]", getattr(element_at(scene, key), "points", ())))

    def move(self, point: Point) -> None:
        """Move the corner to a point."""
        self._points[self._corner] = (
            round_value(point[0] - self._offset[0]),
            round_value(point[1] - self._offset[1]),
        )

    def type_text(self, text: str) -> None:
        """Move the corner to typed coordinates."""
        super().type_text(text)
        numbers = typed_numbers(text)
        if len(numbers) > 1:
            self.move((numbers[0], numbers[1]))

    def preview(self) -> Scene:
        """Return the scene with the corner moved."""
        return preview_of(self.scene, {self._key: {"points": tuple(self._points)}})

    def changes(self) -> list[Change]:
        """Return the change of the corner."""
        point = self._points[self._corner]
        return [SetValue((*self._key.location, "points", self._corner, k), point[k]) for k in (0, 1)]

    def dimensions(self) -> str:
        """Return the place of the corner."""
        x, y = self._points[self._corner]
        return f"({x + self._offset[0]:.4g}, {y + self._offset[1]:.4g}) m"


class VelocityGesture(Gesture):
    """Sets the velocity of a body by the tip of its arrow."""

    label = "set a velocity"

    def __init__(self, scene: Scene, key: ElementKey, body: int, time: float) -> None:
        """Begin to set a velocity.

        Args:
            scene: the scene.
            key: the element of the body.
            body: index of the body.
            time: s, way of the arrow divided by the velocity.
        """
        super().__init__(scene)
        self._key, self._time = key, time
        x, y = scene.bodies.position[body].tolist()
        self._centre: Point = x, y
        element = element_at(scene, key)
        self.velocity: Point = cast("Point", getattr(element, "velocity", (0.0, 0.0)))

    def move(self, point: Point) -> None:
        """Point the arrow to a point."""
        vx, vy = ((a - b) / self._time for a, b in zip(point, self._centre, strict=True))
        speed = math.hypot(vx, vy)
        digits = 1 - math.floor(math.log10(speed)) if speed > 0.0 else 0
        self.velocity = round(vx, digits) + 0.0, round(vy, digits) + 0.0

    def type_text(self, text: str) -> None:
        """Set typed components."""
        super().type_text(text)
        numbers = typed_numbers(text)
        if numbers:
            self.velocity = numbers[0], numbers[1] if len(numbers) > 1 else 0.0

    def preview(self) -> Scene:
        """Return the scene with the velocity."""
        return preview_of(self.scene, {self._key: {"velocity": self.velocity}})

    def changes(self) -> list[Change]:
        """Return the change of the velocity."""
        return set_values({self._key: {"velocity": self.velocity}})

    def dimensions(self) -> str:
        """Return speed and components."""
        x, y = self.velocity
        return f"{math.hypot(x, y):.3g} m/s ({x:g}, {y:g})"


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
        if values is None:
            return self.scene
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
        return [AddElement(self.table, {"name": self.name, **{key: plain_value(v) for key, v in values.items()}})]

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


class SelectGesture(Gesture):
    """Rubber band: selects the elements that are wholly within a rectangle."""

    label = "select"

    def __init__(self, scene: Scene, begin: Point, kept: Sequence[ElementKey] = ()) -> None:
        super().__init__(scene)
        self.begin, self.end, self.kept = begin, begin, tuple(kept)

    def move(self, point: Point) -> None:
        """Draw the rectangle as far as a point."""
        self.end = point

    def changes(self) -> list[Change]:
        """Return no changes: only the selection changes."""
        return []

    @property
    def selects(self) -> list[ElementKey] | None:
        """The elements within, and those that were selected before if Shift is held."""
        from sandbox.window.editor.picking import elements_within

        found = elements_within(self.scene, self.begin, self.end)
        return [*self.kept, *(key for key in found if key not in self.kept)]


def default_size(view_size: float) -> float:
    """Return the size of an element that is made by a click, m: a round length of about a thirtieth of the view."""
    power = 10.0 ** math.floor(math.log10(view_size / 30.0))
    return rounded(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= view_size / 30.0), power)
