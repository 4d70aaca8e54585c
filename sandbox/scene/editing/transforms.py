"""Transformations of elements: translation, rotation, scaling and mirroring, as new values of their keys.

A similarity x → R(θ)·F·(s·(x − c)) + c + d, with the mirror F, is applied to the places of an element (positions and
corners in the world), to its angle, and to its lengths. Joints that name a point in the world move with their bodies.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodyPath, BodySpec, Part, Point
from sandbox.scene.description.bodies import Attached, Compound, Polygon
from sandbox.scene.description.fixed import Plane, Sensor
from sandbox.scene.description.generators import Stack
from sandbox.scene.description.joints import Anchored, Groove, OnAxis, Pivot, Pulley, Weld
from sandbox.scene.editing.elements import ElementKey, body_names, element_at, table_values


@dataclass(frozen=True)
class Similarity:
    """Similarity of the plane: mirror, scale and rotate about a centre, then translate."""

    centre: Point = (0.0, 0.0)
    """m"""
    angle: float = 0.0
    """rad, counter-clockwise"""
    scale: float = 1.0
    """factor of all lengths, greater than 0"""
    shift: Point = (0.0, 0.0)
    """m"""
    mirrored: bool = False
    """reverse x before the rotation"""

    @property
    def is_identity(self) -> bool:
        """Whether nothing changes."""
        return replace(self, centre=(0.0, 0.0)) == Similarity()

    def point(self, point: Point) -> Point:
        """Return the image of a point, m."""
        x, y = self.vector((point[0] - self.centre[0], point[1] - self.centre[1]))
        return x + self.centre[0] + self.shift[0], y + self.centre[1] + self.shift[1]

    def vector(self, vector: Point) -> Point:
        """Return the image of a difference of two points, m."""
        x, y = self.direction(vector)
        return self.scale * x, self.scale * y

    def direction(self, vector: Point) -> Point:
        """Return a vector mirrored and rotated; its length is kept."""
        x, y = (-vector[0] if self.mirrored else vector[0]), vector[1]
        if self.angle == 0.0:  # keeps the digits of the file
            return x, y
        cos, sin = math.cos(self.angle), math.sin(self.angle)
        return cos * x - sin * y, sin * x + cos * y

    def angle_of(self, angle: float) -> float:
        """Return the image of the angle of a body, rad."""
        return (-angle if self.mirrored else angle) + self.angle


AlignmentSide = Literal["left", "right", "top", "bottom", "middle", "centre"]
"""Sides of boxes; `middle` is half of the height, `centre` half of the width."""
LENGTHS = (
    "radius", "length", "size", "spacing", "jitter", "gap", "thickness", "height", "softening", "rest_length"
)  # fmt: skip
"""Keys that scale with the size of an element"""
PLACES = ("position", "point", "origin", "lower", "upper", "base", "start", "end", "corner", "at", "pivot")
"""Keys that are a point in the world"""
CANNOT_ROTATE = ("grid", "scatter", "emitter", "cloth", "ragdoll")
"""Generators whose bodies are laid out along the axes: rotated or mirrored, only their place changes."""


def transform_element(element: Part, by: Similarity, *, is_whole: bool = True) -> dict[str, Any]:
    """Return the keys of an element that a similarity changes, with their new values.

    Args:
        element: of a scene.
        by: the similarity.
        is_whole: transform also its shape and angle; otherwise only its place.
    """
    if isinstance(element, Sensor) and element.body is not None:  # its shape is in the frame of the body
        by = Similarity(mirrored=by.mirrored, scale=by.scale)
    if by.is_identity:
        return {}
    values: dict[str, Any] = {}
    for key in PLACES:
        value = getattr(element, key, None)
        if isinstance(value, tuple) and len(value) == 2 and not isinstance(value[0], tuple):
            values[key] = by.point(value)
    points = getattr(element, "points", None)
    if points is not None and not isinstance(element, Polygon):
        values["points"] = tuple(by.point(each) for each in points)
    if isinstance(element, Plane):
        values["normal"] = by.direction(element.normal)
    if is_whole:
        values |= _shape(element, by)
    return {key: value for key, value in values.items() if getattr(element, key, None) != value}


def _shape(element: Part, by: Similarity) -> dict[str, Any]:
    """Return the keys of angle, lengths and outline."""
    values: dict[str, Any] = {}
    if isinstance(element, BodySpec | Stack) and (by.angle or by.mirrored):
        values["angle"] = _wrapped(by.angle_of(element.angle))
    if isinstance(element, Polygon):
        mirror = Similarity(mirrored=by.mirrored, scale=by.scale)
        values["points"] = tuple(mirror.vector(each) for each in element.points)
    if isinstance(element, Compound):
        values |= _parts(element, Similarity(mirrored=by.mirrored, scale=by.scale))
        if element.centre_of_mass is not None:
            values["centre_of_mass"] = Similarity(mirrored=by.mirrored, scale=by.scale).vector(element.centre_of_mass)
    if isinstance(element, BodySpec) and element.path is not None:
        values["path"] = _path(element.path, by)
    if isinstance(element, BodySpec) and element.moment is not None:  # the mass scales only with a density
        values["moment"] = element.moment * by.scale ** (2 if element.density is None else 4)
    if by.scale != 1.0:
        for key in LENGTHS:
            value = getattr(element, key, None)
            if isinstance(value, tuple):
                values[key] = tuple(by.scale * each for each in value)
            elif isinstance(value, int | float) and not isinstance(value, bool):
                values[key] = by.scale * value
    return values


def _path(path: BodyPath, by: Similarity) -> BodyPath:
    """Return the path of a body that is transformed."""
    in_frame, sign = Similarity(mirrored=by.mirrored, scale=by.scale), -1.0 if by.mirrored else 1.0
    return path.model_copy(
        update={
            "points": tuple(by.vector(each) for each in path.points),
            "angles": tuple(sign * each + 0.0 for each in path.angles),
            "pivot": in_frame.vector(path.pivot),
            "speed": None if path.speed is None else by.scale * path.speed,
        }
    )


def _parts(body: Compound, by: Similarity) -> dict[str, Any]:
    """Return the parts of a compound body, scaled and mirrored in its frame."""
    if by.is_identity:
        return {}
    found: dict[str, Any] = {}
    for name in ("balls", "boxes", "capsules", "polygons"):
        parts = getattr(body, name)
        if parts:
            alias = str(type(body).model_fields[name].alias)
            found[alias] = [table_values(each) | _part(each, by) for each in parts]
    return found


def _part(part: Attached, by: Similarity) -> dict[str, Any]:
    values: dict[str, Any] = {"position": list(by.vector(part.position))}
    if by.mirrored:
        values["angle"] = -part.angle
    for key in ("points", "ends"):
        points = getattr(part, key, None)
        if points is not None:
            values[key] = [list(by.vector(each)) for each in points]
    for key in ("radius", "length", "size"):
        value = getattr(part, key, None)
        if value:  # not the rounding of an outline that has none
            values[key] = [by.scale * each for each in value] if isinstance(value, tuple) else by.scale * value
    return values


def transform_elements(
    scene: Scene, keys: Collection[ElementKey], by: Similarity
) -> Mapping[ElementKey, dict[str, Any]]:
    """Return the new values of selected elements, and of the joints and sensors that have only their bodies.

    A joint names bodies; its point in the world moves with them if all of its bodies are among them.
    """
    moved = {name for key in keys for name in body_names(scene, key)}
    found: dict[ElementKey, dict[str, Any]] = {}
    for key in keys:
        element = element_at(scene, key)
        if key.table in ("joint", "drive"):
            continue
        found[key] = transform_element(element, by, is_whole=key.table not in CANNOT_ROTATE or by.scale != 1.0)
    for index, drive in enumerate(scene.drives):
        if drive.body in moved:
            found[ElementKey("drive", index)] = transform_element(drive, by, is_whole=False)
    for index, sensor in enumerate(scene.sensors):
        if sensor.body in moved:
            found[ElementKey("sensor", index)] = transform_element(sensor, by)
    for index, joint in enumerate(scene.joints):
        key = ElementKey("joint", index)
        found[key] = _joint_values(joint, moved, is_selected=key in keys, by=by)
    return {key: values for key, values in found.items() if values}


def _joint_values(joint: Part, moved: Collection[str], *, is_selected: bool, by: Similarity) -> dict[str, Any]:
    """Return the new values of a joint whose bodies are moved, all or some of them."""
    between = getattr(joint, "between", ())
    are_all_moved = bool(between) and all(name in moved for name in between)
    if isinstance(joint, Pivot) and joint.at is not None:
        return {"at": by.point(joint.at)} if are_all_moved or (is_selected and not moved) else {}
    is_to_world = len(between) == 1
    if isinstance(joint, Weld | OnAxis):
        moves = are_all_moved or (is_selected and not moved)
        values: dict[str, Any] = {"at": by.point(joint.at)} if moves and joint.at is not None else {}
        if isinstance(joint, OnAxis) and is_to_world and moves and (by.angle or by.mirrored):
            values["axis"] = by.direction(joint.axis)
        return values
    if isinstance(joint, Pulley):
        return {"wheels": tuple(by.point(each) for each in joint.wheels)} if is_selected else {}
    if not (is_to_world and is_selected):
        return {}
    if isinstance(joint, Groove):
        return {"groove": tuple(by.point(each) for each in joint.groove)}
    if isinstance(joint, Anchored) or (isinstance(joint, Pivot) and joint.anchors is not None):
        anchors = joint.anchors
        assert anchors is not None
        return {"anchors": (anchors[0], by.point(anchors[1]))}
    return {}


def mirror_transform(box: tuple[Point, Point], *, is_vertical: bool) -> Similarity:
    """Return the transformation that mirrors a box, given by its corners in m, left and right, or up and down."""
    centre = 0.5 * (box[0][0] + box[1][0]), 0.5 * (box[0][1] + box[1][1])
    return Similarity(centre, angle=math.pi if is_vertical else 0.0, mirrored=True)


def alignment_shift(own: tuple[Point, Point], box: tuple[Point, Point], side: AlignmentSide) -> Point:
    """Return the way that aligns a side of an element's box, given by two corners, with that of another box, m."""
    match side:
        case "left":
            return box[0][0] - own[0][0], 0.0
        case "right":
            return box[1][0] - own[1][0], 0.0
        case "bottom":
            return 0.0, box[0][1] - own[0][1]
        case "top":
            return 0.0, box[1][1] - own[1][1]
        case "middle":
            return 0.0, 0.5 * (box[0][1] + box[1][1] - own[0][1] - own[1][1])
        case "centre":
            return 0.5 * (box[0][0] + box[1][0] - own[0][0] - own[1][0]), 0.0


def _wrapped(angle: float) -> float:
    """Return an angle within ±π if it is beyond ±2π, rad."""
    return math.remainder(angle, math.tau) if abs(angle) > math.tau else angle


def round_value(value: float) -> float:
    """Return a length or angle with 9 significant digits, so that 0.30000000000000004 is written as 0.3."""
    return float(f"{value:.9g}") + 0.0


def plain_value(value: Any) -> Any:
    """Return a value of a key as TOML holds it: lists of rounded numbers in place of tuples, tables of parts."""
    if isinstance(value, Part):
        return {key: plain_value(each) for key, each in table_values(value).items()}
    if isinstance(value, tuple | list):
        return [plain_value(each) for each in value]
    return round_value(value) if isinstance(value, float) else value
