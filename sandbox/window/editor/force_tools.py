"""Thrusts and attractions, drawn as arrows and points."""

import math
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.editing.elements import naming
from sandbox.scene.editing.transforms import round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.window.editor.gestures import Gesture, typed_numbers
from sandbox.window.editor.joint_tools import PlacementError
from sandbox.window.editor.picking import bodies_at, body_pose, to_body

ACCELERATION_PER_METRE = 10.0
"""m/s² that a thrust gives its body for each metre of its arrow"""
ATTRACTION = 10.0
"""m/s², acceleration of a new attraction at a quarter of the view from it"""


class ThrustGesture(Gesture):
    """Draws a thrust: from a point of a body, as an arrow of its force."""

    label = "add a thrust"

    def __init__(self, scene: Scene, name: str, point: Point, tolerance: float) -> None:
        """Begin to draw.

        Args:
            scene: the scene.
            name: of the thrust.
            point: where it acts on a body, m.
            tolerance: m, distance beside a body at which a press still hits it.

        Raises:
            PlacementError: there is no body that moves.
        """
        super().__init__(scene)
        found = [k for k in bodies_at(scene, point, tolerance) if not scene.bodies.immovable[k]]
        if not found:
            raise PlacementError("a thrust needs a body that moves: press on it, and drag the arrow of the force")
        self._body, self.name, self.begin, self.end = found[0], name, point, point

    def move(self, point: Point) -> None:
        """Draw the arrow as far as a point."""
        self.end = point

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
        return [*naming(self.scene, self._body), AddElement("thrust", values)]

    def dimensions(self) -> str:
        """Return the magnitude of the force."""
        return f"{math.hypot(*self.force()):.3g} N"


def attraction_changes(scene: Scene, name: str, point: Point, click: Point, view_size: float) -> list[Change]:
    """Return the changes that add an attraction towards a point, or towards a body that is there.

    Args:
        scene: the scene.
        name: of the attraction.
        point: the place, m.
        click: m, where a body is looked for.
        view_size: m, shorter side of the view.
    """
    strength = float(f"{ATTRACTION * (0.25 * view_size) ** 2:.2g}")
    softening = float(f"{0.02 * view_size:.1g}")
    found = bodies_at(scene, click)
    toward: Any = [round_value(x) for x in point]
    changes: list[Change] = []
    if found:
        toward, changes = scene.bodies.names[found[0]], naming(scene, found[0])
    values = {"name": name, "toward": toward, "strength": strength, "softening": softening}
    return [*changes, AddElement("attraction", values)]
