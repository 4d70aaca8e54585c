"""Flippers and plungers: drives of a body, made by a click at its hinge or by a drag of the pull."""

import math
from typing import Any, cast

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.editing.elements import element_at, element_of_body, naming
from sandbox.scene.editing.transforms import round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.window.editor.gestures import Gesture, typed_numbers
from sandbox.window.editor.joint_tools import PlacementError
from sandbox.window.editor.picking import bodies_at

SWING = math.radians(50.0)
"""rad from the rest angle of a new flipper to its end"""
STROKE_TIME = 0.04
"""s, duration of the stroke of a new flipper"""
PLUNGER_RATE = 10.0
"""1/s, speed of a new plunger at its stop by the length of its pull"""


def flipper_changes(scene: Scene, name: str, hinge: Point, click: Point, tolerance: float) -> list[Change]:
    """Return the changes that make a body a flipper, which turns upwards about a hinge.

    Args:
        scene: the scene.
        name: of the drive.
        hinge: m, snapped.
        click: m, where the body is looked for.
        tolerance: m, distance beside a body at which a click still hits it.

    Raises:
        PlacementError: there is no body that can be driven.
    """
    body = _body_at(scene, click, tolerance, "a flipper needs a body that moves: click it at its hinge")
    single = cast("BodySpec", element_at(scene, element_of_body(scene, body)))
    x, y = scene.bodies.position[body].tolist()
    is_left = x >= hinge[0]
    mass, inertia = float(scene.bodies.mass[body]), float(scene.bodies.moment[body])
    moment = inertia + mass * math.dist(hinge, (x, y)) ** 2
    end = single.angle + (SWING if is_left else -SWING)
    values: dict[str, Any] = {
        "name": name,
        "kind": "torque",
        "body": scene.bodies.names[body],
        "key": "left" if is_left else "right",
        "pivot": [round_value(hinge[0]), round_value(hinge[1])],
        "stops": [single.angle, round_value(end)],
        "torque": float(f"{moment * 2.0 * SWING / STROKE_TIME**2:.2g}"),
        "bounce": 0.2,
    }
    return [*naming(scene, body), AddElement("drive", values)]


class PlungerGesture(Gesture):
    """Makes a body a plunger: dragged from the body as far as it can be pulled."""

    label = "add a plunger"

    def __init__(self, scene: Scene, name: str, click: Point, start: Point, tolerance: float) -> None:
        """Begin to draw.

        Args:
            scene: the scene.
            name: of the drive.
            click: m, where the body is looked for.
            start: m, the same point, snapped.
            tolerance: m, distance beside a body at which a press still hits it.

        Raises:
            PlacementError: there is no body that can be driven.
        """
        super().__init__(scene)
        message = "a plunger needs a body that moves: press on it, and drag it back as far as it can be pulled"
        self._body = _body_at(scene, click, tolerance, message)
        self.name, self.begin, self.end = name, start, start

    def move(self, point: Point) -> None:
        """Pull as far as a point."""
        self.end = point

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
            "body": self.scene.bodies.names[self._body],
            "key": "space",
            "direction": direction,
            "travel": travel,
            "speed": float(f"{PLUNGER_RATE * travel:.2g}"),
        }
        return [*naming(self.scene, self._body), AddElement("drive", values)]

    def dimensions(self) -> str:
        """Return the length of the pull."""
        return f"{self.travel():.4g} m"


def _body_at(scene: Scene, point: Point, tolerance: float, message: str) -> int:
    """Return the topmost body at a point that can be driven: a moving one that is an element of its own.

    Raises:
        PlacementError: there is none.
    """
    driven = {drive.body for drive in scene.drives}
    for body in bodies_at(scene, point, tolerance):
        is_single = isinstance(element_at(scene, element_of_body(scene, body)), BodySpec)
        if is_single and not scene.bodies.immovable[body]:
            if scene.bodies.names[body] in driven:
                raise PlacementError(f"{scene.bodies.names[body]} has a drive already; its properties show it")
            return body
    raise PlacementError(message)
