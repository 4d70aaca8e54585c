"""Standing: upright boxes at rest on a level plane and on each other, which stay where they are.

What guarantees it is a set of forces that balances every box without any friction and pulls nowhere: then no motion
that keeps bodies from overlapping could lower them, so none can begin, whatever friction does besides. Loads are
handed down from the top: a box presses on what is below so that its own weight and what bears on it balance.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.closed_form.bouncing import PLANE
from sandbox.measure.closed_form.form import Motion
from sandbox.measure.closed_form.given import TOUCH, Given, across, normal_of, parallel
from sandbox.trajectory import ContactEvent

MOST_BOXES = 1000
"""Every two of them are looked at."""
EDGE = 1e-9
"""A load this close, as a share of its bearing, to the edge of it is no certain stand."""


class Boxes(NamedTuple):
    """N upright boxes as seen along the plane and up from it."""

    left: FloatArray
    right: FloatArray
    low: FloatArray
    high: FloatArray
    """(N,) m each"""

    def middle(self, number: int) -> float:
        """Return where a box is along the plane, m."""
        return 0.5 * float(self.left[number] + self.right[number])


class Bearing(NamedTuple):
    """What carries a box: another or, as −1, the plane; and from where to where along it."""

    number: int
    left: float
    right: float
    """m"""


class Load(NamedTuple):
    """What a box hands on to one of its bearings."""

    size: float
    """N"""
    place: float
    """m along the plane"""
    known: bool
    """It could not be otherwise: one bearing carries all."""


@dataclass(frozen=True, eq=False)
class Standing:
    """All boxes of a scene."""

    given: Given
    rows: tuple[ContactEvent, ...]
    """with forces for impulses, N; nan where statics leave them open"""
    name: str = "boxes that stand"

    def at(self, time: FloatArray) -> Motion:
        """Return the motion of all N bodies at T times: none."""
        bodies, size = self.given.bodies, len(time)
        position = np.repeat(bodies.position[None], size, axis=0)
        angle = np.repeat(bodies.angle[None], size, axis=0)
        return Motion(position, np.zeros_like(position), angle, np.zeros_like(angle))

    def contacts(self, until: float) -> list[ContactEvent]:
        """Return the contacts, which all last; the impulse is nan where it depends on how load is shared."""
        return [row._replace(impulse=(row.impulse[0] * until, row.impulse[1] * until)) for row in self.rows]


def standing(given: Given) -> Standing | None:
    """Return the rest of upright boxes at rest that each lie on what carries them with room to spare.

    The one fixed thing is a plane square to gravity. There is no drag, nothing is fixed, held, drawn or driven, and no
    two boxes overlap.
    """
    scene, bodies, plane = given.scene, given.bodies, given.only_plane()
    if plane is None or bodies.velocity.any() or bodies.angular_velocity.any() or len(bodies) > MOST_BOXES:
        return None
    if bodies.fixed.any() or bodies.round.any() or bodies.group.any() or np.isfinite(bodies.lifetime).any():
        return None
    if any(element.collides != "all" for element in bodies.elements) or scene.world.bounds is not None:
        return None
    if len(given.links) or scene.attractions or scene.thrusts or scene.drives or not given.airless:
        return None
    normal = normal_of(plane)
    if not parallel(given.gravity, normal) or float(given.gravity @ normal) >= 0.0:
        return None
    boxes = _upright(given, np.asarray(plane.point), normal)
    if boxes is None:
        return None
    across_by, above_by = _overlaps(boxes)
    each = np.eye(len(bodies), dtype=np.bool_)
    if ((across_by > TOUCH) & (above_by > TOUCH) & ~each).any() or (boxes.low < -TOUCH).any():
        return None
    # Row, column: the first bears on the second.
    on = (across_by > TOUCH) & (np.abs(boxes.low[:, None] - boxes.high) <= TOUCH)
    loads = _handed_down(boxes, on, bodies.mass * math.hypot(*given.gravity))
    if loads is None:
        return None
    beside = (np.abs(across_by) <= TOUCH) & (above_by > TOUCH) & ~each
    return Standing(given, tuple(_rows(given, boxes, on, beside, loads, normal)))


def _upright(given: Given, point: FloatArray, normal: FloatArray) -> Boxes | None:
    """Return the boxes, or None where a body is none or is tilted."""
    bodies = given.bodies
    shapes = bodies.shapes
    if len(shapes.body) != len(bodies) or shapes.radius.any() or (np.diff(shapes.first) != 4).any():
        return None
    x, y = np.moveaxis(shapes.corner.reshape(-1, 4, 2), 2, 0)
    cos, sin = np.cos(bodies.angle)[:, None], np.sin(bodies.angle)[:, None]
    corner = bodies.position[:, None] + np.stack((cos * x - sin * y, sin * x + cos * y), axis=2) - point
    sides = []
    for axis in (across(normal), normal):
        place = np.sort(corner @ axis, axis=1)
        if (np.diff(place, axis=1)[:, [0, 2]] > TOUCH).any():
            return None
        sides += [place[:, 0], place[:, 3]]
    return Boxes(*sides)


def _overlaps(boxes: Boxes) -> tuple[FloatArray, FloatArray]:
    """Return by how much every two overlap along the plane and upwards, (N, N) m each, negative where they do not."""
    across_by = np.minimum(boxes.right[:, None], boxes.right) - np.maximum(boxes.left[:, None], boxes.left)
    above_by = np.minimum(boxes.high[:, None], boxes.high) - np.maximum(boxes.low[:, None], boxes.low)
    return across_by, above_by


def _handed_down(boxes: Boxes, on: BoolArray, weight: FloatArray) -> dict[tuple[int, int], Load] | None:
    """Return what each box hands on to each of its bearings, from the top down; None where one has no balance."""
    loads: dict[tuple[int, int], Load] = {}
    size, moment = weight.copy(), weight * (0.5 * (boxes.left + boxes.right))
    known = np.ones(len(weight), np.bool_)
    for number in np.argsort(-boxes.low, kind="stable").tolist():
        if boxes.low[number] <= TOUCH:
            bearings = [Bearing(PLANE, float(boxes.left[number]), float(boxes.right[number]))]
        else:
            bearings = [_bearing(boxes, number, below) for below in np.flatnonzero(on[number]).tolist()]
        handed = _shared(bearings, float(size[number]), float(moment[number] / size[number]), bool(known[number]))
        if handed is None:
            return None
        for below, load in handed.items():
            loads[number, below] = load
            if below != PLANE:
                size[below] += load.size
                moment[below] += load.size * load.place
        unsure = [bearing.number for bearing in bearings if bearing.number != PLANE]
        if len(bearings) > 1 or not known[number]:
            known[unsure] = False
    return loads


def _bearing(boxes: Boxes, number: int, below: int) -> Bearing:
    left, right = max(boxes.left[number], boxes.left[below]), min(boxes.right[number], boxes.right[below])
    return Bearing(below, float(left), float(right))


def _shared(bearings: list[Bearing], size: float, place: float, known: bool) -> dict[int, Load] | None:
    """Share a load between the two bearings to its left and right, by the lever; on one alone, put it where it is."""
    left = [b for b in bearings if 0.5 * (b.left + b.right) <= place]
    right = [b for b in bearings if 0.5 * (b.left + b.right) > place]
    if left and right:
        one = max(left, key=lambda b: b.left + b.right)
        other = min(right, key=lambda b: b.left + b.right)
        x, y = 0.5 * (one.left + one.right), 0.5 * (other.left + other.right)
        share = size * (place - x) / (y - x)
        return {one.number: Load(size - share, x, False), other.number: Load(share, y, False)}
    spare = min((EDGE * (b.right - b.left) for b in bearings), default=0.0)
    under = next((b for b in bearings if b.left + spare < place < b.right - spare), None)
    return None if under is None else {under.number: Load(size, place, known and len(bearings) == 1)}


def _rows(
    given: Given,
    boxes: Boxes,
    on: BoolArray,
    beside: BoolArray,
    loads: dict[tuple[int, int], Load],
    normal: FloatArray,
) -> list[ContactEvent]:
    """Return every two that touch as a contact, with the force between them for an impulse."""
    along, origin = across(normal), np.asarray(given.scene.planes[0].point)

    def row(pair: tuple[int, int], x: float, y: float, way: FloatArray, force: float) -> ContactEvent:
        place, push = origin + x * along + y * normal, force * way
        return ContactEvent(
            0.0,
            pair,
            (float(place[0]), float(place[1])),
            (float(way[0]), float(way[1])),
            (float(push[0]), float(push[1])),
        )

    def force_of(above: int, below: int) -> float:
        load = loads.get((above, below))
        return load.size if load is not None and load.known else math.nan

    rows = [
        row((number, PLANE), boxes.middle(number), 0.0, -normal, force_of(number, PLANE))
        for number in np.flatnonzero(boxes.low <= TOUCH).tolist()
    ]
    for above, below in np.argwhere(on).tolist():
        bearing = _bearing(boxes, above, below)
        way = -normal if above < below else normal
        pair, x = (min(above, below), max(above, below)), 0.5 * (bearing.left + bearing.right)
        rows.append(row(pair, x, float(boxes.low[above]), way, force_of(above, below)))
    for one, other in np.argwhere(np.triu(beside)).tolist():
        way = along if boxes.middle(one) < boxes.middle(other) else -along
        x = float(boxes.right[one] if boxes.middle(one) < boxes.middle(other) else boxes.left[one])
        y = 0.5 * float(max(boxes.low[one], boxes.low[other]) + min(boxes.high[one], boxes.high[other]))
        rows.append(row((one, other), x, y, way, math.nan))
    return rows
