"""Handles of the selection: corners of its box, rotation, corners of an outline, and the tip of a velocity."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Point
from sandbox.scene.description.bodies import Polygon
from sandbox.scene.description.fixed import Sensor
from sandbox.scene.editing.elements import ElementKey, bodies_of, element_at, exists
from sandbox.window.editor.gestures import (
    Gesture,
    RotateGesture,
    ScaleGesture,
    VelocityGesture,
    VertexGesture,
)
from sandbox.window.editor.picking import bounds_of_elements
from sandbox.window.editor.snapping import ViewScale

HandleKind = Literal["scale", "rotate", "vertex", "velocity"]
ROTATE_DISTANCE = 26.0
"""px at UI scale 1 of the handle for rotation above the selection"""
HANDLE_REACH = 9.0
"""px at UI scale 1 within which a handle is picked"""
VELOCITY_TIME = 0.25
"""s: the arrow of a velocity is as long as the way in this time"""
VELOCITY_DISTANCE = 22.0
"""px at UI scale 1 from the selection to the handle of a velocity of 0"""
MAX_VERTICES = 200
"""Corners of an element that have handles"""
FRAME_MARGIN = 7.0
"""px at UI scale 1 between the box of the selection and the frame with its handles"""
WITHOUT_BOX = ("joint", "thrust", "tyre", "attraction", "drive")
"""Elements that are neither scaled nor rotated by themselves"""


@dataclass(frozen=True)
class EditHandle:
    """Handle of the selection."""

    kind: HandleKind
    index: int
    """of the corner"""
    point: Point
    """m"""


def handles_of(scene: Scene, selection: Sequence[ElementKey], view: ViewScale) -> list[EditHandle]:
    """Return the handles of selected elements."""
    found = _vertex_handles(scene, selection)
    box = bounds_of_elements(scene, selection)
    if box is None or all(key.table in WITHOUT_BOX for key in selection):
        return found
    margin = view.metres(FRAME_MARGIN)
    box = (box[0][0] - margin, box[0][1] - margin), (box[1][0] + margin, box[1][1] + margin)
    (left, _), (right, top) = box
    found += [EditHandle("scale", k, corner) for k, corner in enumerate(_corners(box))]
    found += _velocity_handle(scene, selection, right, view)
    return [*found, EditHandle("rotate", 0, (0.5 * (left + right), top + view.metres(ROTATE_DISTANCE)))]


def handle_at(handles: Sequence[EditHandle], point: Point, view: ViewScale) -> EditHandle | None:
    """Return the handle that is nearest to a point, m, within reach."""
    nearest = min(handles, key=lambda handle: math.dist(handle.point, point), default=None)
    is_near = nearest is not None and math.dist(nearest.point, point) <= view.metres(HANDLE_REACH)
    return nearest if is_near else None


def gesture_of_handle(scene: Scene, selection: Sequence[ElementKey], handle: EditHandle) -> Gesture:
    """Return the gesture that a press of a handle begins."""
    if handle.kind == "velocity":
        return VelocityGesture(scene, selection[0], handle.index, VELOCITY_TIME)
    if handle.kind == "vertex":
        element = element_at(scene, selection[0])
        offset = element.position if isinstance(element, Polygon) else (0.0, 0.0)
        return VertexGesture(scene, selection[0], handle.index, offset)
    box = bounds_of_elements(scene, selection)
    assert box is not None
    (left, bottom), (right, top) = box
    if handle.kind == "rotate":
        return RotateGesture(scene, selection, (0.5 * (left + right), 0.5 * (bottom + top)), handle.point)
    corners = _corners(box)
    return ScaleGesture(scene, selection, corners[(handle.index + 2) % 4], corners[handle.index])


def _corners(box: tuple[Point, Point]) -> tuple[Point, Point, Point, Point]:
    """Return the corners of a box, m, counter-clockwise from the lower left one."""
    (left, bottom), (right, top) = box
    return (left, bottom), (right, bottom), (right, top), (left, top)


def _vertex_handles(scene: Scene, selection: Sequence[ElementKey]) -> list[EditHandle]:
    if len(selection) != 1 or not exists(scene, selection[0]):
        return []
    element = element_at(scene, selection[0])
    points = getattr(element, "points", None)
    if not points or len(points) > MAX_VERTICES or (isinstance(element, Sensor) and element.body is not None):
        return []
    dx, dy = element.position if isinstance(element, Polygon) else (0.0, 0.0)
    if isinstance(element, Polygon) and element.angle:
        return []
    return [EditHandle("vertex", k, (x + dx, y + dy)) for k, (x, y) in enumerate(points)]


def _velocity_handle(scene: Scene, selection: Sequence[ElementKey], right: float, view: ViewScale) -> list[EditHandle]:
    """Return the handle at the tip of the velocity of a single body; at its right side if it is at rest."""
    element = element_at(scene, selection[0]) if len(selection) == 1 and exists(scene, selection[0]) else None
    if not isinstance(element, BodySpec) or element.fixed or element.path is not None:
        return []
    (body,) = bodies_of(scene, selection[0])
    (x, y), (vx, vy) = scene.bodies.position[body].tolist(), element.velocity
    tip = x + VELOCITY_TIME * vx, y + VELOCITY_TIME * vy
    if not (vx or vy):
        tip = right + view.metres(VELOCITY_DISTANCE), y
    return [EditHandle("velocity", body, tip)]
