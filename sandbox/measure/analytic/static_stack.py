"""Static stack: upright boxes that stay at rest on a level plane and on each other.

The guarantee is a set of forces that balances every box without friction and without tension: then no motion without
overlap can lower the bodies, so that none begins, whatever friction adds. Loads are distributed from the top: the
forces of a box on its supports balance its weight and its own load.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.analytic.bouncing import PLANE
from sandbox.measure.analytic.model import TOUCH_TOLERANCE, BodyMotion, SceneFacts, normal_of, parallel, perpendicular
from sandbox.measure.metrics.clearance import rotate_points
from sandbox.trajectory import ContactEvent

MAX_BOXES = 1000
"""All pairs of boxes are examined."""
EDGE_FRACTION = 1e-9
"""Relative margin: a load this close to the edge of its support is not certain to be stable."""


class Boxes(NamedTuple):
    """N upright boxes in coordinates along the plane and above it."""

    left: FloatArray
    right: FloatArray
    low: FloatArray
    high: FloatArray
    """(N,) m each"""

    def middle(self, number: int) -> float:
        """Return the middle of a box along the plane, m."""
        return 0.5 * float(self.left[number] + self.right[number])


class Bearing(NamedTuple):
    """Support of a box: another box or, as −1, the plane; and its extent along the plane."""

    number: int
    left: float
    right: float
    """m"""


class Load(NamedTuple):
    """Force of a box on one of its supports."""

    size: float
    """N"""
    position: float
    """m along the plane"""
    known: bool
    """whether it is unique: one support carries all"""


@dataclass(frozen=True, eq=False)
class StaticStack:
    """All boxes of a scene."""

    facts: SceneFacts
    rows: tuple[ContactEvent, ...]
    """contacts with forces in place of impulses, N; nan if statics does not determine them"""
    name: str = "boxes that stand"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion of all N bodies at T times: none."""
        bodies, size = self.facts.bodies, len(time)
        position = np.repeat(bodies.position[None], size, axis=0)
        angle = np.repeat(bodies.angle[None], size, axis=0)
        return BodyMotion(position, np.zeros_like(position), angle, np.zeros_like(angle))

    def contacts(self, until: float) -> list[ContactEvent]:
        """Return the contacts, which all last; the impulse is nan if statics does not determine it."""
        return [row._replace(impulse=(row.impulse[0] * until, row.impulse[1] * until)) for row in self.rows]


def static_stack(facts: SceneFacts) -> StaticStack | None:
    """Return the rest of upright boxes whose centres each lie well inside their supports; None if it does not apply.

    The only static object is a plane perpendicular to gravity. There are no drag, static bodies, joints, attraction,
    thrusts, tyres or drives, and no two boxes overlap.
    """
    scene, bodies, plane = facts.scene, facts.bodies, facts.only_plane()
    if plane is None or bodies.velocity.any() or bodies.angular_velocity.any() or len(bodies) > MAX_BOXES:
        return None
    if bodies.fixed.any() or bodies.round.any() or bodies.group.any() or np.isfinite(bodies.lifetime).any():
        return None
    if any(element.collides != "all" for element in bodies.elements) or scene.world.bounds is not None:
        return None
    if facts.matrix.moving_surfaces:
        return None
    if len(facts.joints) or scene.attractions or scene.thrusts or scene.tyres or scene.drives or not facts.has_no_air:
        return None
    normal = normal_of(plane)
    if not parallel(facts.gravity, normal) or float(facts.gravity @ normal) >= 0.0:
        return None
    boxes = _upright(facts, np.asarray(plane.point), normal)
    if boxes is None:
        return None
    across_by, above_by = _overlaps(boxes)
    each = np.eye(len(bodies), dtype=np.bool_)
    if ((across_by > TOUCH_TOLERANCE) & (above_by > TOUCH_TOLERANCE) & ~each).any() or (
        boxes.low < -TOUCH_TOLERANCE
    ).any():
        return None
    # Row, column: the first rests on the second.
    on = (across_by > TOUCH_TOLERANCE) & (np.abs(boxes.low[:, None] - boxes.high) <= TOUCH_TOLERANCE)
    loads = _distribute_loads(boxes, on, bodies.mass * math.hypot(*facts.gravity))
    if loads is None:
        return None
    beside = (np.abs(across_by) <= TOUCH_TOLERANCE) & (above_by > TOUCH_TOLERANCE) & ~each
    return StaticStack(facts, tuple(_rows(facts, boxes, on, beside, loads, normal)))


def _upright(facts: SceneFacts, point: FloatArray, normal: FloatArray) -> Boxes | None:
    """Return the boxes; None if a body is no box or is tilted."""
    bodies = facts.bodies
    shapes = bodies.shapes
    if len(shapes.body) != len(bodies) or shapes.radius.any() or (np.diff(shapes.first) != 4).any():
        return None
    corner = bodies.position[:, None] + rotate_points(shapes.corner.reshape(-1, 4, 2), bodies.angle[:, None]) - point
    sides = []
    for axis in (perpendicular(normal), normal):
        extent = np.sort(corner @ axis, axis=1)
        if (np.diff(extent, axis=1)[:, [0, 2]] > TOUCH_TOLERANCE).any():
            return None
        sides += [extent[:, 0], extent[:, 3]]
    return Boxes(*sides)


def _overlaps(boxes: Boxes) -> tuple[FloatArray, FloatArray]:
    """Return the overlap of every two boxes along the plane and above it, (N, N) m each; negative if they are apart."""
    across_by = np.minimum(boxes.right[:, None], boxes.right) - np.maximum(boxes.left[:, None], boxes.left)
    above_by = np.minimum(boxes.high[:, None], boxes.high) - np.maximum(boxes.low[:, None], boxes.low)
    return across_by, above_by


def _distribute_loads(boxes: Boxes, on: BoolArray, weight: FloatArray) -> dict[tuple[int, int], Load] | None:
    """Return the load of each box on each of its supports, from the top down; None if a box has no balance."""
    loads: dict[tuple[int, int], Load] = {}
    size, moment = weight.copy(), weight * (0.5 * (boxes.left + boxes.right))
    known = np.ones(len(weight), np.bool_)
    for number in np.argsort(-boxes.low, kind="stable").tolist():
        if boxes.low[number] <= TOUCH_TOLERANCE:
            bearings = [Bearing(PLANE, float(boxes.left[number]), float(boxes.right[number]))]
        else:
            bearings = [_bearing(boxes, number, below) for below in np.flatnonzero(on[number]).tolist()]
        divided = _divide_load(bearings, float(size[number]), float(moment[number] / size[number]), bool(known[number]))
        if divided is None:
            return None
        for below, load in divided.items():
            loads[number, below] = load
            if below != PLANE:
                size[below] += load.size
                moment[below] += load.size * load.position
        supports = [bearing.number for bearing in bearings if bearing.number != PLANE]
        if len(bearings) > 1 or not known[number]:
            known[supports] = False
    return loads


def _bearing(boxes: Boxes, number: int, below: int) -> Bearing:
    left, right = max(boxes.left[number], boxes.left[below]), min(boxes.right[number], boxes.right[below])
    return Bearing(below, float(left), float(right))


def _divide_load(bearings: list[Bearing], size: float, position: float, known: bool) -> dict[int, Load] | None:
    """Divide a load between the nearest supports on both sides by the lever rule; a single support takes all of it."""
    left = [b for b in bearings if 0.5 * (b.left + b.right) <= position]
    right = [b for b in bearings if 0.5 * (b.left + b.right) > position]
    if left and right:
        one = max(left, key=lambda b: b.left + b.right)
        other = min(right, key=lambda b: b.left + b.right)
        x, y = 0.5 * (one.left + one.right), 0.5 * (other.left + other.right)
        fraction = size * (position - x) / (y - x)
        return {one.number: Load(size - fraction, x, False), other.number: Load(fraction, y, False)}
    spare = min((EDGE_FRACTION * (b.right - b.left) for b in bearings), default=0.0)
    under = next((b for b in bearings if b.left + spare < position < b.right - spare), None)
    return None if under is None else {under.number: Load(size, position, known and len(bearings) == 1)}


def _rows(
    facts: SceneFacts,
    boxes: Boxes,
    on: BoolArray,
    beside: BoolArray,
    loads: dict[tuple[int, int], Load],
    normal: FloatArray,
) -> list[ContactEvent]:
    """Return every two boxes in contact as a contact row, with the force in place of the impulse."""
    along, origin = perpendicular(normal), np.asarray(facts.scene.planes[0].point)

    def row(pair: tuple[int, int], x: float, y: float, direction: FloatArray, force: float) -> ContactEvent:
        position, push = origin + x * along + y * normal, force * direction
        return ContactEvent(
            0.0,
            pair,
            (float(position[0]), float(position[1])),
            (float(direction[0]), float(direction[1])),
            (float(push[0]), float(push[1])),
        )

    def force_of(above: int, below: int) -> float:
        load = loads.get((above, below))
        return load.size if load is not None and load.known else math.nan

    rows = [
        row((number, PLANE), boxes.middle(number), 0.0, -normal, force_of(number, PLANE))
        for number in np.flatnonzero(boxes.low <= TOUCH_TOLERANCE).tolist()
    ]
    for above, below in np.argwhere(on).tolist():
        bearing = _bearing(boxes, above, below)
        direction = -normal if above < below else normal
        pair, x = (min(above, below), max(above, below)), 0.5 * (bearing.left + bearing.right)
        rows.append(row(pair, x, float(boxes.low[above]), direction, force_of(above, below)))
    for one, other in np.argwhere(np.triu(beside)).tolist():
        direction = along if boxes.middle(one) < boxes.middle(other) else -along
        x = float(boxes.right[one] if boxes.middle(one) < boxes.middle(other) else boxes.left[one])
        y = 0.5 * float(max(boxes.low[one], boxes.low[other]) + min(boxes.high[one], boxes.high[other]))
        rows.append(row((one, other), x, y, direction, math.nan))
    return rows
