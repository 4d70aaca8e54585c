"""Thrusts, attractions, flippers and plungers: forces and drives, made by a click or by a drag from a body."""

import math
from typing import Any, cast

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.editing.elements import (
    ElementKey,
    all_names,
    element_at,
    element_of_body,
    naming_changes,
    unique_name,
)
from sandbox.scene.editing.transforms import round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.window.editor.gestures import Gesture, typed_numbers
from sandbox.window.editor.joint_tools import PlacementError
from sandbox.window.editor.picking import bodies_at, body_pose, to_body
from sandbox.window.editor.snapping import Pointer
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import draw_arrow
from sandbox.window.render.palette import BACKGROUND, ORANGE

ACCELERATION_PER_METRE = 10.0
"""m/s² that a thrust gives its body for each metre of its arrow"""
ATTRACTION = 10.0
"""m/s², acceleration of a new attraction at a quarter of the view from it"""
FLIPPER_SWING = math.radians(50.0)
"""rad from the rest angle of a new flipper to its end"""
STROKE_TIME = 0.04
"""s, duration of the stroke of a new flipper"""
PLUNGER_RATE = 10.0
"""1/s, speed of a new plunger at its stop by the length of its pull"""


def _draw_arrow(canvas: Canvas, gesture: Gesture) -> None:
    a, b = canvas.pixels((gesture.begin, gesture.end))
    draw_arrow(canvas.surface, a, b, ORANGE, 3.0 * canvas.ui_scale, edge=BACKGROUND)


class ThrustGesture(Gesture):
    """Draws a thrust: from a point of a body, as an arrow of its force."""

    label = "add a thrust"
    snaps = False

    def __init__(self, scene: Scene, tool: str, pointer: Pointer) -> None:
        """Begin to draw.

        Raises:
            PlacementError: there is no body that moves.
        """
        super().__init__(scene, pointer.point)
        found = [k for k in bodies_at(scene, pointer.point, pointer.pick_reach) if not scene.bodies.immovable[k]]
        if not found:
            raise PlacementError("a thrust needs a body that moves: press on it, and drag the arrow of the force")
        self._body, self.name = found[0], unique_name(tool, all_names(scene))

    def force(self) -> Point:
        """Return the force in the world, N."""
        mass = float(self.scene.bodies.mass[self._body])
        dx, dy = self.end[0] - self.begin[0], self.end[1] - self.begin[1]
        factor, numbers = mass * ACCELERATION_PER_METRE, typed_numbers(self.typed)
        if numbers:
            length = math.hypot(dx, dy)
            dx, dy, factor = (dx / length, dy / length, numbers[0]) if length else (0.0, 1.0, numbers[0])
        return float(f"{factor * dx:.3g}") + 0.0, float(f"{factor * dy:.3g}") + 0.0

    def changes(self) -> list[Change]:
        """Return the changes that add the thrust; empty without a force."""
        force, body = self.force(), self.scene.bodies.names[self._body]
        if force == (0.0, 0.0):
            return []
        pose = body_pose(self.scene, body)
        angle = 0.0 if pose is None else pose[1]
        cos, sin = math.cos(angle), math.sin(angle)
        own = float(f"{cos * force[0] + sin * force[1]:.4g}"), float(f"{cos * force[1] - sin * force[0]:.4g}")
        point = [round_value(x) for x in to_body(self.scene, body, self.begin)]
        values: dict[str, Any] = {"name": self.name, "body": body, "force": [x + 0.0 for x in own]}
        if any(point):
            values["point"] = point
        return [*naming_changes(self.scene, self._body), AddElement("thrust", values)]

    def dimensions(self) -> str:
        """Return the magnitude of the force."""
        return f"{math.hypot(*self.force()):.3g} N"

    def draw(self, canvas: Canvas) -> None:
        """Draw the arrow."""
        _draw_arrow(canvas, self)


class AttractionGesture(Gesture):
    """Adds an attraction towards a point, or towards a body that is there."""

    label = "add an attraction"
    is_one_click = True

    def __init__(self, scene: Scene, tool: str, pointer: Pointer) -> None:
        super().__init__(scene)
        self._tool, self._pointer = tool, pointer

    def changes(self) -> list[Change]:
        """Return the changes that add the attraction."""
        scene, size = self.scene, self._pointer.view.size
        found = bodies_at(scene, self._pointer.point)
        values = {
            "name": unique_name(self._tool, all_names(scene)),
            "toward": scene.bodies.names[found[0]] if found else [round_value(x) for x in self.snap(self._pointer)],
            "strength": float(f"{ATTRACTION * (0.25 * size) ** 2:.2g}"),
            "softening": float(f"{0.02 * size:.1g}"),
        }
        return [*(naming_changes(scene, found[0]) if found else ()), AddElement("attraction", values)]

    @property
    def selects(self) -> list[ElementKey] | None:
        """The new element."""
        return [ElementKey("attraction", len(self.scene.attractions))]


class DriveGesture(Gesture):
    """Drives a body."""

    request = ""
    """message where there is no body"""

    def __init__(self, scene: Scene, tool: str, pointer: Pointer) -> None:
        """Begin at the topmost body that can be driven: a moving one that is an element of its own.

        Raises:
            PlacementError: there is none.
        """
        super().__init__(scene)
        driven = {drive.body for drive in scene.drives}
        found = (
            body
            for body in bodies_at(scene, pointer.point, pointer.pick_reach)
            if isinstance(element_at(scene, element_of_body(scene, body)), BodySpec)
            and not scene.bodies.immovable[body]
        )
        body = next(found, None)
        if body is None:
            raise PlacementError(self.request)
        if scene.bodies.names[body] in driven:
            raise PlacementError(f"{scene.bodies.names[body]} has a drive already; its properties show it")
        self.body, self.name = body, unique_name(tool, all_names(scene))
        self.begin = self.end = self.snap(pointer)

    @property
    def selects(self) -> list[ElementKey] | None:
        """The body, whose properties show the drive as well."""
        return [element_of_body(self.scene, self.body)]


class FlipperGesture(DriveGesture):
    """Makes a body a flipper, which turns upwards about the point that is clicked."""

    label = "add a flipper"
    request = "a flipper needs a body that moves: click it at its hinge"
    is_one_click = True

    def changes(self) -> list[Change]:
        """Return the changes that add the drive."""
        scene, body, hinge = self.scene, self.body, self.begin
        single = cast("BodySpec", element_at(scene, element_of_body(scene, body)))
        x, y = scene.bodies.position[body].tolist()
        is_left = x >= hinge[0]
        mass, inertia = float(scene.bodies.mass[body]), float(scene.bodies.moment[body])
        moment = inertia + mass * math.dist(hinge, (x, y)) ** 2
        end = single.angle + (FLIPPER_SWING if is_left else -FLIPPER_SWING)
        values: dict[str, Any] = {
            "name": self.name,
            "kind": "torque",
            "body": scene.bodies.names[body],
            "key": "left" if is_left else "right",
            "pivot": [round_value(hinge[0]), round_value(hinge[1])],
            "stops": [single.angle, round_value(end)],
            "torque": float(f"{moment * 2.0 * FLIPPER_SWING / STROKE_TIME**2:.2g}"),
            "bounce": 0.2,
        }
        return [*naming_changes(scene, body), AddElement("drive", values)]


class PlungerGesture(DriveGesture):
    """Makes a body a plunger: dragged from the body as far as it can be pulled."""

    label = "add a plunger"
    request = "a plunger needs a body that moves: press on it, and drag it back as far as it can be pulled"

    def travel(self) -> float:
        """Return the length of the pull, m."""
        numbers = typed_numbers(self.typed)
        return numbers[0] if numbers else round_value(math.dist(self.begin, self.end))

    def changes(self) -> list[Change]:
        """Return the changes that add the drive.

        Raises:
            PlacementError: it is not pulled.
        """
        x, y = self.begin[0] - self.end[0], self.begin[1] - self.end[1]
        travel, length = self.travel(), math.hypot(x, y)
        if travel <= 0.0:
            raise PlacementError("a plunger needs a way: drag it back as far as it can be pulled")
        direction = [float(f"{x / length:.4g}") + 0.0, float(f"{y / length:.4g}") + 0.0] if length else [0.0, 1.0]
        values: dict[str, Any] = {
            "name": self.name,
            "kind": "plunger",
            "body": self.scene.bodies.names[self.body],
            "key": "space",
            "direction": direction,
            "travel": travel,
            "speed": float(f"{PLUNGER_RATE * travel:.2g}"),
        }
        return [*naming_changes(self.scene, self.body), AddElement("drive", values)]

    def dimensions(self) -> str:
        """Return the length of the pull."""
        return f"{self.travel():.4g} m"

    def draw(self, canvas: Canvas) -> None:
        """Draw the arrow."""
        _draw_arrow(canvas, self)
