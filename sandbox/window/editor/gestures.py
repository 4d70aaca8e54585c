"""Gestures: what happens between the press and the release of the mouse, or between the clicks, of an editor tool.

A gesture follows the pointer, previews its effect as a scene that is not validated, states dimensions for the overlay,
and ends in changes of the draft. Numbers that are typed replace dimensions. Positions are in m.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from typing import Any, cast

import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Part, Point
from sandbox.scene.editing.elements import (
    ElementKey,
    element_at,
    with_elements,
    with_moved_bodies,
)
from sandbox.scene.editing.transforms import Similarity, plain_value, round_value, transform_elements
from sandbox.scene.files.toml_changes import Change, SetValue
from sandbox.window.editor.picking import elements_within
from sandbox.window.editor.snapping import Pointer, SnappedPoint, anchor_of, snap_point, surface_shift
from sandbox.window.render.draw_context import FARTHEST, Canvas
from sandbox.window.render.palette import SKY
from sandbox.window.render.text import draw_box


class Gesture(ABC):
    """A gesture that has begun."""

    label = ""
    """what it does, for the menu of undo"""
    snaps = True
    """whether the pointer snaps to the grid, to centres and to corners"""
    edits = True
    """whether it changes the draft; otherwise only the selection"""
    is_one_click = False
    """whether the press of the button finishes it"""
    is_multi_click = False
    """whether it continues after the release of the button, with further clicks"""

    def __init__(self, scene: Scene, begin: Point = (0.0, 0.0)) -> None:
        self.scene, self.begin, self.end = scene, begin, begin
        self.typed = ""
        """numbers that were typed"""
        self.corners: list[Point] = []
        """corners that were set one by one; Backspace removes the last one"""
        self.snapped: SnappedPoint | None = None
        """where the pointer has snapped"""

    def move(self, point: Point) -> None:
        """Follow the pointer to a point, m."""
        self.end = point

    def drag(self, pointer: Pointer) -> None:
        """Follow the pointer."""
        self.move(self.snap(pointer) if self.snaps else pointer.point)

    def snap(self, pointer: Pointer) -> Point:
        """Return the point to which the pointer snaps, m."""
        self.snapped = None if pointer.is_free else snap_point(self.scene, pointer.point, pointer.view)
        return pointer.point if self.snapped is None else self.snapped.point

    def click(self, pointer: Pointer) -> bool:
        """Take a further click; return whether the gesture is finished."""
        self.drag(pointer)
        return True

    def confirm(self) -> bool:
        """Take the key Enter; return whether the gesture is finished."""
        return True

    def type_text(self, text: str) -> None:
        """Replace dimensions by typed numbers."""
        self.typed = text

    @abstractmethod
    def changes(self) -> Sequence[Change]:
        """Return the changes of the draft; empty if there are none."""

    @property
    def selects(self) -> list[ElementKey] | None:
        """The elements that are selected afterwards; None to keep the selection."""
        return None

    @property
    def note(self) -> str:
        """Message after the changes; empty without one."""
        return ""

    def preview(self) -> Scene:
        """Return the scene as it will be, not validated."""
        return self.scene

    def dimensions(self) -> str:
        """Return the present dimensions, such as `r 0.35 m`."""
        return ""

    def draw(self, canvas: Canvas) -> None:  # noqa: B027, most gestures show no more than their preview
        """Draw what the preview does not show."""


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

    def __init__(self, scene: Scene, keys: Collection[ElementKey], begin: Point) -> None:
        super().__init__(scene, begin)
        self.keys = tuple(keys)
        self.by = Similarity()

    def values(self) -> Mapping[ElementKey, dict[str, Any]]:
        """Return the new values of each element."""
        return transform_elements(self.scene, self.keys, self.by)

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

    def move(self, point: Point) -> None:
        """Move the elements by the way from the press to a point."""
        self.shift_by((point[0] - self.begin[0], point[1] - self.begin[1]))

    def drag(self, pointer: Pointer) -> None:
        """Move the elements so that the first one lies on the grid, or touches a surface that is near."""
        self.move(pointer.point)
        self.snapped = None
        if pointer.is_free:
            return
        anchor, (x, y) = anchor_of(self.scene, self.keys[0]), pointer.point
        if anchor is not None:
            target = anchor[0] + (x - self.begin[0]), anchor[1] + (y - self.begin[1])
            self.snapped = snap_point(self.scene, target, pointer.view, self.keys)
            self.shift_by((self.snapped.point[0] - anchor[0], self.snapped.point[1] - anchor[1]))
        contact = surface_shift(self.preview(), self.keys, pointer.view)
        if contact is not None:
            x, y = self.by.shift
            self.shift_by((x + contact[0], y + contact[1]))

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
        super().__init__(scene, keys, begin)
        self.centre, self._begin_angle = centre, math.atan2(begin[1] - centre[1], begin[0] - centre[0])
        self._is_free = False

    def drag(self, pointer: Pointer) -> None:
        """Turn the elements towards the pointer."""
        self._is_free = pointer.is_free
        self.move(pointer.point)

    def move(self, point: Point) -> None:
        """Turn the elements towards a point."""
        angle = math.atan2(point[1] - self.centre[1], point[0] - self.centre[0]) - self._begin_angle
        angle = math.remainder(angle, math.tau)
        if not self._is_free:
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
        super().__init__(scene, keys, begin)
        self._fixed = fixed

    def move(self, point: Point) -> None:
        """Scale so that the corner follows a point."""
        before = self.begin[0] - self._fixed[0], self.begin[1] - self._fixed[1]
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
    snaps = False

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


class SelectGesture(Gesture):
    """Rubber band: selects the elements that are wholly within a rectangle."""

    label = "select"
    snaps = edits = False

    def __init__(self, scene: Scene, begin: Point, kept: Sequence[ElementKey] = ()) -> None:
        super().__init__(scene, begin)
        self.kept = tuple(kept)

    def changes(self) -> list[Change]:
        """Return no changes: only the selection changes."""
        return []

    @property
    def selects(self) -> list[ElementKey] | None:
        """The elements within, and those that were selected before if Shift is held."""
        found = elements_within(self.scene, self.begin, self.end)
        return [*self.kept, *(key for key in found if key not in self.kept)]

    def draw(self, canvas: Canvas) -> None:
        """Draw the rectangle."""
        (ax, ay), (bx, by) = canvas.pixels((self.begin, self.end), FARTHEST)
        rect = pygame.Rect(round(min(ax, bx)), round(min(ay, by)), round(abs(ax - bx)), round(abs(ay - by)))
        draw_box(canvas.surface, rect, 0, SKY, 40, SKY)
