"""Picking of elements in the editor: which element is at a point or within a rectangle, and where joints end."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySpec, Part, Point
from sandbox.scene.description.fixed import Plane, Post, Sensor, Wall, Zone
from sandbox.scene.description.forces import Attraction, Thrust, Tyre
from sandbox.scene.description.joints import Anchored, Groove, Joined, OnAxis, Pivot, Pulley, Weld
from sandbox.scene.description.surface import Pocket
from sandbox.scene.editing.elements import (
    ElementKey,
    bodies_of,
    element_at,
    element_of_body,
    elements_of_table,
    exists,
)
from sandbox.scene.geometry.shapes import placed_sensor
from sandbox.trajectory import Frame
from sandbox.window.hit_test import hulls_of, segment_distance, signed_distance


def start_frame(scene: Scene) -> Frame:
    """Return the state of the bodies at the start."""
    bodies = scene.bodies
    present = np.ones(len(bodies), np.bool_)
    return Frame(0.0, bodies.position, bodies.velocity, bodies.angle, bodies.angular_velocity, present)


def bodies_at(scene: Scene, point: Point, tolerance: float = 0.0) -> list[int]:
    """Return the indices of the bodies at a point, the topmost first, and then those that are near.

    Args:
        scene: the scene.
        point: m.
        tolerance: m, distance beside a body within which it counts.
    """
    bodies, frame = scene.bodies, start_frame(scene)
    distance = np.hypot(*(bodies.position - np.asarray(point)).T)
    near = np.flatnonzero(distance <= bodies.radius + tolerance)
    found = [(signed_distance(hulls_of(bodies, frame, k), *point), k) for k in near.tolist()]
    inside = [k for gap, k in found if gap <= 0.0]
    return [*inside[::-1], *(k for gap, k in sorted(found) if 0.0 < gap <= tolerance)]


def pick_element(scene: Scene, point: Point, tolerance: float) -> ElementKey | None:
    """Return the topmost element at a point, the first of `elements_at`."""
    return next(iter(elements_at(scene, point, tolerance)), None)


def elements_at(scene: Scene, point: Point, tolerance: float) -> list[ElementKey]:
    """Return the elements at a point: pivots, bodies, joints and forces, static elements, zones and planes.

    Args:
        scene: the scene.
        point: m.
        tolerance: m, distance within which lines and points are picked.
    """
    pivots: list[ElementKey] = []
    lines: list[ElementKey] = []
    for key, element in _attached_elements(scene):
        for line in attachment_lines(scene, element):
            if segment_distance(line)(*map(np.asarray, point)) <= 0.7 * tolerance:
                (pivots if line[0] == line[1] else lines).append(key)
                break
    bodies = [element_of_body(scene, body) for body in bodies_at(scene, point, tolerance)]
    others = [
        ElementKey(table, index)
        for table in ("post", "pocket", "wall", "zone", "sensor", "plane")
        for index, element in reversed(list(enumerate(elements_of_table(scene, table))))
        if _distance(_in_world(scene, element), point) <= tolerance
    ]
    return list(dict.fromkeys([*pivots, *bodies, *lines, *others]))


def elements_within(scene: Scene, corner: Point, opposite: Point) -> list[ElementKey]:
    """Return the elements that are wholly within a rectangle, m; a plane never is."""
    low = min(corner[0], opposite[0]), min(corner[1], opposite[1])
    high = max(corner[0], opposite[0]), max(corner[1], opposite[1])
    found = []
    for table in (*scene.kinds, "post", "pocket", "wall", "zone", "sensor"):
        for index in range(len(elements_of_table(scene, table))):
            box = bounds_of(scene, ElementKey(table, index))
            if box is not None and all(low[k] <= box[0][k] and box[1][k] <= high[k] for k in (0, 1)):
                found.append(ElementKey(table, index))
    for key, element in _attached_elements(scene):
        ends = [end for line in attachment_lines(scene, element) for end in line]
        if ends and all(low[k] <= end[k] <= high[k] for end in ends for k in (0, 1)):
            found.append(key)
    return found


def bounds_of(scene: Scene, key: ElementKey) -> tuple[Point, Point] | None:
    """Return the lower left and upper right corner of an element, m; None if it has no bounded shape."""
    element = element_at(scene, key)
    points = _outline(scene, key, element)
    if points is None or not len(points):
        return None
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return (low[0], low[1]), (high[0], high[1])


def bounds_of_elements(scene: Scene, keys: Iterable[ElementKey]) -> tuple[Point, Point] | None:
    """Return the corners of the box around elements, as `bounds_of` does; those that do not exist are left out."""
    boxes = [bounds_of(scene, key) for key in keys if exists(scene, key)]
    found = [box for box in boxes if box is not None]
    if not found:
        return None
    return (
        (min(low[0] for low, _ in found), min(low[1] for low, _ in found)),
        (max(high[0] for _, high in found), max(high[1] for _, high in found)),
    )


def _outline(scene: Scene, key: ElementKey, element: Part) -> FloatArray | None:
    """Return points whose bounding box is that of an element, (K, 2) m."""
    bodies = bodies_of(scene, key)
    if len(bodies):
        frame, rows = start_frame(scene), []
        for k in bodies:
            for hull in hulls_of(scene.bodies, frame, k):
                rows += [hull.corners - hull.radius, hull.corners + hull.radius]
        return np.concatenate(rows)
    element = _in_world(scene, element)
    match element:
        case Post() | Pocket():
            return _disc(element.position, element.radius)
        case Wall():
            return np.concatenate([_disc(point, 0.5 * element.thickness) for point in element.points])
        case Zone() | Sensor():
            if element.points is not None:
                margin = 0.5 * (element.thickness or 0.0)
                return np.concatenate([_disc(point, margin) for point in element.points])
            return None if element.position is None else _disc(element.position, element.radius or 0.0)
        case Plane():
            return None
        case _:
            ends = [end for line in attachment_lines(scene, element) for end in line]
            return np.asarray(ends, np.float64) if ends else None


def _in_world(scene: Scene, element: Part) -> Part:
    """Return a sensor of a body as one in the world, where it is at the start; other elements as they are."""
    if not isinstance(element, Sensor) or element.body is None:
        return element
    pose = body_pose(scene, element.body)
    return element if pose is None else placed_sensor(element, *pose)


def _disc(centre: Point, radius: float) -> FloatArray:
    return np.asarray(np.asarray(centre) + np.asarray(((-radius, -radius), (radius, radius))))


def _distance(element: Part, point: Point) -> float:
    """Return the distance of a point from a static element, m; negative inside."""
    x, y = np.asarray(point[0]), np.asarray(point[1])
    match element:
        case Post() | Pocket():
            return math.dist(element.position, point) - element.radius
        case Plane():
            length = math.hypot(*element.normal)
            height = sum((p - q) * n for p, q, n in zip(point, element.point, element.normal, strict=True)) / length
            return abs(height)  # only the surface is picked, as the solid fills half of the view
        case Wall():
            return _polyline_distance(element.points, element.closed, x, y) - 0.5 * element.thickness
        case Zone(points=None) | Sensor(points=None):
            return math.dist(element.position or (0.0, 0.0), point) - (element.radius or 0.0)
        case Zone() | Sensor():
            assert element.points is not None
            if element.thickness is not None:
                return _polyline_distance(element.points, False, x, y) - 0.5 * element.thickness
            return -1.0 if _is_inside(element.points, point) else _polyline_distance(element.points, True, x, y)
        case _:
            return math.inf


def _polyline_distance(points: tuple[Point, ...], closed: bool, x: FloatArray, y: FloatArray) -> float:
    ends = (*points[1:], points[0]) if closed else points[1:]
    return min(float(segment_distance(line)(x, y)) for line in zip(points, ends, strict=False))


def _is_inside(corners: tuple[Point, ...], point: Point) -> bool:
    """Return whether a point is inside a polygon, by the number of crossings."""
    inside, (x, y) = False, point
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            inside = not inside
    return inside


def body_pose(scene: Scene, name: str) -> tuple[Point, float] | None:
    """Return the origin of the frame of a body, m, and its angle, rad; None if there is no such body."""
    index = scene.bodies.number_of.get(name)
    if index is None:
        return None
    element = element_at(scene, element_of_body(scene, index))
    if isinstance(element, BodySpec):  # the frame of a polygon is not at its centre of mass
        return element.position, element.angle
    x, y = scene.bodies.position[index].tolist()
    return (x, y), float(scene.bodies.angle[index])


def to_world(scene: Scene, name: str, point: Point) -> Point | None:
    """Return the place of a point in the frame of a body, m; None if there is no such body."""
    pose = body_pose(scene, name)
    if pose is None:
        return None
    (x, y), angle = pose
    cos, sin = math.cos(angle), math.sin(angle)
    return x + cos * point[0] - sin * point[1], y + sin * point[0] + cos * point[1]


def to_body(scene: Scene, name: str, point: Point) -> Point:
    """Return a point of the world in the frame of a body, m.

    Raises:
        KeyError: there is no such body.
    """
    pose = body_pose(scene, name)
    if pose is None:
        raise KeyError(name)
    (x, y), angle = pose
    cos, sin, dx, dy = math.cos(angle), math.sin(angle), point[0] - x, point[1] - y
    return cos * dx + sin * dy, cos * dy - sin * dx


def _attached_elements(scene: Scene) -> Iterator[tuple[ElementKey, Part]]:
    """Yield joints, thrusts, tyres and attractions, the last first."""
    for table in ("joint", "thrust", "tyre", "attraction"):
        for index, element in reversed(list(enumerate(elements_of_table(scene, table)))):
            yield ElementKey(table, index), element


def attachment_lines(scene: Scene, element: Part) -> list[tuple[Point, Point]]:
    """Return the lines that show a joint, thrust, tyre or attraction, m; a point is a line without length."""
    match element:
        case Pulley():
            ends = [to_world(scene, n, a) for n, a in zip(element.between, element.anchors, strict=True)]
            return [(wheel, end) for wheel, end in zip(element.wheels, ends, strict=True) if end is not None]
        case Anchored():
            return _line(*_ends(scene, element.between, element.anchors))
        case Pivot(at=None, anchors=None):
            return _line(*_ends(scene, element.between, ((0.0, 0.0), (0.0, 0.0)), is_to_world=False))
        case Pivot():
            at = element.at
            if at is None and element.anchors is not None:
                at = to_world(scene, element.between[0], element.anchors[0])
            return [] if at is None else [(at, at)]
        case Groove():
            return _groove_line(scene, element)
        case OnAxis() | Weld():
            at = element.at or to_world(scene, element.between[-1], (0.0, 0.0))
            return [] if at is None else [_axis_line(scene, element, at) if isinstance(element, OnAxis) else (at, at)]
        case Joined():
            return _line(*_ends(scene, element.between, ((0.0, 0.0), (0.0, 0.0)), is_to_world=False))
        case Thrust() | Tyre():
            end = to_world(scene, element.body, element.point)
            return [] if end is None else [(end, end)]
        case Attraction() if not isinstance(element.toward, str):
            return [(element.toward, element.toward)]
        case _:
            return []


def _ends(
    scene: Scene, between: tuple[str, ...], anchors: tuple[Point, Point], is_to_world: bool = True
) -> tuple[Point | None, Point | None]:
    first = to_world(scene, between[0], anchors[0])
    if len(between) == 2:
        return first, to_world(scene, between[1], anchors[1])
    return first, anchors[1] if is_to_world else first


def _line(one: Point | None, other: Point | None) -> list[tuple[Point, Point]]:
    return [] if one is None or other is None else [(one, other)]


def _axis_line(scene: Scene, joint: OnAxis, at: Point) -> tuple[Point, Point]:
    """Return the travel of the point of a joint that is at a position at the start, m."""
    bodies = scene.bodies
    first = bodies.number_of.get(joint.between[0]) if len(joint.between) == 2 else None
    turned = 0.0 if first is None else float(bodies.angle[first])
    (x, y), length = joint.axis, math.hypot(*joint.axis) or 1.0
    ux, uy = (
        (math.cos(turned) * x - math.sin(turned) * y) / length,
        (math.sin(turned) * x + math.cos(turned) * y) / length,
    )
    least, most = joint.travel
    return (at[0] + least * ux, at[1] + least * uy), (at[0] + most * ux, at[1] + most * uy)


def _groove_line(scene: Scene, groove: Groove) -> list[tuple[Point, Point]]:
    if len(groove.between) == 1:
        return [groove.groove]
    ends = [to_world(scene, groove.between[0], end) for end in groove.groove]
    return _line(ends[0], ends[1])
