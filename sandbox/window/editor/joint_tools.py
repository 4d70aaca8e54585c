"""Joints between bodies, made by one or two clicks on bodies or on the world."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.editing.elements import all_names, naming_changes, unique_name
from sandbox.scene.editing.transforms import round_value
from sandbox.scene.files.toml_changes import AddElement, Change
from sandbox.window.editor.gestures import Gesture
from sandbox.window.editor.picking import bodies_at, start_frame, to_body
from sandbox.window.editor.snapping import Pointer
from sandbox.window.hit_test import hulls_of, signed_distance
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import draw_line
from sandbox.window.render.palette import SKY

JOINT_KINDS = ("rod", "pivot", "rope", "spring", "motor", "slide", "groove", "gear")
"""Joints that have a tool; a rope is a `slide` whose lower limit is 0"""
ONE_CLICK = ("pivot", "motor")
"""Joints of the bodies that lie on each other at one point"""
SPRING_FREQUENCY, SPRING_DAMPING_RATIO = 2.0, 0.1
"""Hz and fraction of critical damping of a new spring with its lighter body"""
SLIDE_FRACTION = 0.5
"""Lower limit of a new slide, as a fraction of its length"""
MESHING_REACH = 1.1
"""Gears whose distance is at most this multiple of the sum of their radii mesh; others are joined by a belt"""
MIN_OVERLAP = 0.02
"""A body that overlaps a wheel by more than this fraction of its radius carries it; a wheel rests on others"""
MOTOR_RATE = 2.0 * math.pi
"""rad/s of a new motor: a revolution per second"""
MOTOR_TORQUE_FACTOR = 20.0
"""Largest torque of a new motor, in units of m g r, or m r² · 1/s² without gravity"""


class PlacementError(ValueError):
    """An element cannot be made there; `str()` has the reason."""


@dataclass(frozen=True)
class JointEnd:
    """End of a new joint."""

    click: Point
    """m, where a body is looked for"""
    anchor: Point
    """m, the same point, snapped"""
    is_snapped: bool = False
    """whether the anchor is a centre or a corner"""
    is_free: bool = False
    """whether the user wants it exactly where the click is"""


def joint_changes(
    scene: Scene, kind: str, first: JointEnd, second: JointEnd, tolerance: float, name: str
) -> list[Change]:
    """Return the changes that add a joint, and names to the bodies that it needs.

    Args:
        scene: the scene.
        kind: one of `JOINT_KINDS`.
        first: end of the first click.
        second: end of the second click; not used by pivots and motors.
        tolerance: m, distance beside a body at which a click still hits it.
        name: of the joint.

    Raises:
        PlacementError: there is no body that can be joined.
    """
    if kind in ONE_CLICK:
        return _at_one_point(scene, kind, first, tolerance, name)
    if kind == "groove":
        return _groove(scene, first, second, tolerance, name)
    one, other = (next(iter(bodies_at(scene, end.click, tolerance)), None) for end in (first, second))
    if one is None and other is None:
        raise PlacementError("a joint needs a body: click a body, and then another one or the world")
    if one is None:
        one, other, first, second = other, None, second, first
    assert one is not None
    if one == other:
        raise PlacementError("both ends are on the same body; click another body or the world")
    if other is None and scene.bodies.immovable[one]:
        raise PlacementError("a fixed or kinematic body needs no joint to the world; click a body that forces move")
    if kind == "gear":
        return _gear(scene, one, other, name)
    names, changes = _names(scene, [one] if other is None else [one, other])
    anchors = [to_body(scene, scene.bodies.names[one], first.anchor)]
    anchors.append(second.anchor if other is None else to_body(scene, scene.bodies.names[other], second.anchor))
    values: dict[str, Any] = {"name": name, "kind": "slide" if kind == "rope" else kind, "between": names}
    values["anchors"] = [[round_value(x) for x in anchor] for anchor in anchors]
    distance = round_value(math.dist(first.anchor, second.anchor))
    if kind == "slide":
        values["least"] = round_value(SLIDE_FRACTION * distance)
    if kind in ("slide", "rope"):
        values["most"] = distance
    if kind == "spring":
        stiffness, damping = _spring(scene, [one] if other is None else [one, other])
        values |= {"stiffness": stiffness, "damping": damping}
    return [*changes, AddElement("joint", values)]


def _gear(scene: Scene, one: int, other: int | None, name: str) -> list[Change]:
    """Return the changes that join the rotation of two bodies: gears that mesh if they are near, or else a belt."""
    if other is None:
        raise PlacementError("a gear needs two bodies: click one, and then the other")
    names, changes = _names(scene, [one, other])
    radii = float(scene.bodies.radius[one]), float(scene.bodies.radius[other])
    distance = math.dist(scene.bodies.position[one], scene.bodies.position[other])
    ratio = radii[1] / radii[0] if min(radii) > 0.0 else 1.0
    if distance <= MESHING_REACH * sum(radii):
        ratio = -ratio
    values = {"name": name, "kind": "gear", "between": names, "ratio": round_value(ratio)}
    return [*changes, AddElement("joint", values)]


def _groove(scene: Scene, first: JointEnd, second: JointEnd, tolerance: float, name: str) -> list[Change]:
    """Return the changes that let a body slide along a line, which belongs to the body below it or to the world."""
    found = bodies_at(scene, first.click, tolerance)[:2]
    if not found:
        raise PlacementError("a groove needs a body that slides: click it, and then the other end of its groove")
    slider, carrier = found[0], found[1] if len(found) == 2 else None
    if scene.bodies.fixed[slider]:
        raise PlacementError("a fixed body cannot slide; click a body that moves")
    if math.dist(first.anchor, second.anchor) == 0.0:
        raise PlacementError("a groove needs a length: click its other end")
    bodies = [slider] if carrier is None else [carrier, slider]
    names, changes = _names(scene, bodies)
    ends = [end if carrier is None else to_body(scene, names[0], end) for end in (first.anchor, second.anchor)]
    values: dict[str, Any] = {"name": name, "kind": "groove", "between": names}
    values["groove"] = [[round_value(x) for x in end] for end in ends]
    values["anchor"] = [round_value(x) for x in to_body(scene, scene.bodies.names[slider], first.anchor)]
    return [*changes, AddElement("joint", values)]


def _at_one_point(scene: Scene, kind: str, end: JointEnd, tolerance: float, name: str) -> list[Change]:
    """Return the changes that add a pivot or motor, as `bodies_of_pivot` and `centre_of_wheel` have it."""
    found = bodies_of_pivot(scene, end, tolerance)
    if not found:
        raise PlacementError(f"a {kind} needs a body: click a body, or two that lie on each other")
    if all(scene.bodies.immovable[k] for k in found):
        raise PlacementError("a fixed or kinematic body needs no joint to the world; click a body that forces move")
    names, changes = _names(scene, found)
    point = [round_value(x) for x in centre_of_wheel(scene, end, found)]
    pivot: dict[str, Any] = {"name": name, "kind": "pivot", "between": names, "at": point}
    if kind == "pivot":
        return [*changes, AddElement("joint", pivot)]
    body = found[-1]
    index = scene.bodies.number_of[scene.bodies.names[body]]
    gravity = math.hypot(*scene.world.gravity) or 1.0
    torque = MOTOR_TORQUE_FACTOR * float(scene.bodies.mass[index]) * gravity * float(scene.bodies.radius[index])
    motor = {
        "name": unique_name(f"{name} motor", all_names(scene)),
        "kind": "motor",
        "between": names,
        "rate": round_value(-MOTOR_RATE if len(names) == 2 else MOTOR_RATE),
        "max_torque": float(f"{torque:.2g}"),
    }
    return [*changes, AddElement("joint", pivot), AddElement("joint", motor)]


def bodies_of_pivot(scene: Scene, end: JointEnd, tolerance: float) -> list[int]:
    """Return the indices of the bodies that a click joins: none, one to be joined to the world, or two, a wheel last.

    They are the two topmost bodies at the point. If only a wheel is there, the other one is the topmost body that
    overlaps it: the middle of a wheel is often below the body that it carries.
    """
    bodies = scene.bodies
    found = bodies_at(scene, end.click, tolerance)[:2]
    if len(found) == 1 and bodies.round[found[0]] and not end.is_free:
        found += _overlapping(scene, found[0])[:1]
    return sorted(found, key=lambda k: (bool(bodies.round[k]), -float(bodies.radius[k])))


def _overlapping(scene: Scene, wheel: int) -> list[int]:
    """Return the indices of the bodies that overlap a disc, the topmost first."""
    bodies, frame = scene.bodies, start_frame(scene)
    (x, y), radius = bodies.position[wheel].tolist(), float(bodies.radius[wheel])
    near = np.flatnonzero(np.hypot(*(bodies.position - (x, y)).T) < bodies.radius + radius)
    deepest = (1.0 - MIN_OVERLAP) * radius
    found = [k for k in near.tolist() if k != wheel and signed_distance(hulls_of(bodies, frame, k), x, y) < deepest]
    return found[::-1]


def centre_of_wheel(scene: Scene, end: JointEnd, found: list[int]) -> Point:
    """Return the point of a pivot, m: the centre of the wheel, else the point that was clicked."""
    if not found or end.is_snapped or end.is_free or not scene.bodies.round[found[-1]]:
        return end.anchor
    x, y = scene.bodies.position[found[-1]].tolist()
    return x, y


def _names(scene: Scene, bodies: list[int]) -> tuple[list[str], list[Change]]:
    """Return the names of bodies, and the changes that write those that the file does not have yet."""
    names, changes = [], list[Change]()
    for body in bodies:
        names.append(scene.bodies.names[body])
        changes += [change for change in naming_changes(scene, body) if change not in changes]
    return names, changes


def _spring(scene: Scene, bodies: list[int]) -> tuple[float, float]:
    """Return stiffness, N/m, and damping, N·s/m, of a spring that suits its lightest moving body."""
    masses = [float(scene.bodies.mass[k]) for k in bodies if not scene.bodies.fixed[k]]
    mass, omega = min(masses, default=1.0), 2.0 * math.pi * SPRING_FREQUENCY
    return float(f"{mass * omega**2:.2g}"), float(f"{2.0 * SPRING_DAMPING_RATIO * mass * omega:.2g}")


class JointGesture(Gesture):
    """Makes a joint: one click for pivots and motors, two for the others, or a drag from one end to the other."""

    is_multi_click = True

    def __init__(self, scene: Scene, kind: str, pointer: Pointer) -> None:
        super().__init__(scene)
        self.kind, self.name, self._tolerance = kind, unique_name(kind, all_names(scene)), pointer.pick_reach
        self._first = self._second = self._joint_end(pointer)
        self.begin = self.end = self._first.anchor
        self.label, self.is_one_click = f"add a {kind}", kind in ONE_CLICK

    def _joint_end(self, pointer: Pointer) -> JointEnd:
        anchor = self.snap(pointer)
        is_snapped = self.snapped is not None and self.snapped.to != "grid"
        return JointEnd(pointer.point, anchor, is_snapped, pointer.is_free)

    def drag(self, pointer: Pointer) -> None:
        """Draw the joint as far as the pointer."""
        self._second = self._joint_end(pointer)
        self.end, self.is_multi_click = self._second.anchor, not pointer.is_dragging

    def changes(self) -> list[Change]:
        """Return the changes that add the joint.

        Raises:
            PlacementError: there is no body that can be joined.
        """
        return joint_changes(self.scene, self.kind, self._first, self._second, self._tolerance, self.name)

    @property
    def note(self) -> str:
        """Message that the joint joins a body to the world, where two bodies may be meant."""
        if self.kind not in ONE_CLICK:
            return ""
        found = bodies_of_pivot(self.scene, self._first, self._tolerance)
        if len(found) != 1:
            return ""
        body = self.scene.bodies.names[found[0]]
        return f"the {self.kind} joins {body} to the world; to join two bodies, click where they lie on each other"

    def dimensions(self) -> str:
        """Return the length."""
        return "" if self.kind in ONE_CLICK else f"{math.dist(self.begin, self.end):.4g} m"

    def draw(self, canvas: Canvas) -> None:
        """Draw a line between the ends."""
        a, b = canvas.pixels((self.begin, self.end))
        draw_line(canvas.surface, a, b, SKY, 2.0 * canvas.ui_scale)
        for end in (a, b):
            draw_disc(canvas.surface, end, 4 * canvas.ui_scale, SKY)
