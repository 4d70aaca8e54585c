"""Weaving: where the nodes of ropes and cloth start, and the joints between them."""

import math
import sys

import numpy as np

from sandbox.scene.elements import pitch
from sandbox.scene.layout import Layout, alike
from sandbox.scene.links import WORLD, LinkKind, Links
from sandbox.scene.near import FloatArray
from sandbox.scene.part import Point
from sandbox.scene.weaves import ENDS, Cloth, End, Rope

STARTS_AT, ENDS_AT = -2, -3
"""Stand in a rope's links for the bodies that its start and its end are tied to."""


def node_count(rope: Rope) -> int:
    """Return how many bodies a rope has: planks, or nodes, where a tied end is the other body's."""
    if rope.kind == "planks":
        return rope.links
    return rope.links + 1 - sum(rope.tied(end) is not None for end in ENDS)


def rope_layout(rope: Rope, gravity: Point) -> Layout:
    """Lay out the nodes or planks of a rope, from its start to its end."""
    place = course(rope, gravity)
    if rope.kind == "planks":
        step = np.diff(place, axis=0)
        return alike(0.5 * (place[:-1] + place[1:]), rope.velocity, np.arctan2(step[:, 1], step[:, 0]), 0.0)
    fixed = np.zeros(len(place), np.bool_)
    fixed[[0, -1]] = [rope.holds(end) for end in ENDS]
    own = np.ones(len(place), np.bool_)
    own[[0, -1]] = [rope.tied(end) is None for end in ENDS]
    return alike(place[own], rope.velocity, rope.angle, rope.angular_velocity, fixed[own])


def course(rope: Rope, gravity: Point) -> FloatArray:
    """Return the ends of a rope's links, (links + 1, 2) m: in line, or where it is longer, on an arc."""
    start, end = np.asarray(rope.start), np.asarray(rope.end)
    way = end - start
    distance, length = float(math.hypot(*way)), pitch(rope)
    share = np.arange(rope.links + 1)[:, None] / rope.links
    half = half_turn(rope.links, distance / length)
    if half == 0.0:
        return start * (1.0 - share) + end * share
    down = np.asarray(gravity) if any(gravity) else np.asarray((0.0, -1.0))
    apart = distance >= sys.float_info.min  # what is less has too few digits to give a direction
    along = way / distance if apart else np.asarray((-down[1], down[0])) / math.hypot(*down)
    across = np.asarray((along[1], -along[0]))  # to the right of the way, where the arc turns left
    if across @ down < 0.0:
        across = -across
    # Each chord of the arc turns by twice the half turn; the first leaves the way by all that the rest turn back.
    tilt = half * (rope.links - 1 - 2 * np.arange(rope.links))
    step = length * (np.outer(np.cos(tilt), along) + np.outer(np.sin(tilt), across))
    return start + np.vstack((np.zeros(2), np.cumsum(step, axis=0)))


def half_turn(links: int, ratio: float) -> float:
    """Return half the angle between neighbours among equal chords of an arc; 0 for a straight line.

    Args:
        links: how many chords, n.
        ratio: how many chords long the way from the first end to the last is: sin(n·a) / sin(a), solved for a.
    """
    if ratio >= links:
        return 0.0
    low, high = 0.0, math.pi / links
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return middle
        if math.sin(links * middle) > ratio * math.sin(middle):
            low = middle
        else:
            high = middle


def rope_links(rope: Rope) -> Links:
    """Return a rope's joints by the numbers of its own bodies; `STARTS_AT` and `ENDS_AT` stand for other bodies."""
    length, count = pitch(rope), node_count(rope)
    if rope.kind != "planks":
        first, last = (rope.tied(end) is not None for end in ENDS)
        node = np.concatenate(([STARTS_AT] * first, np.arange(count), [ENDS_AT] * last)).astype(np.int64)
        if rope.kind == "rods":
            return Links.alike(LinkKind.ROD, node[:-1], node[1:], figures=(length, 0.0, 0.0))
        assert rope.stiffness is not None
        figures = length, rope.stiffness, rope.damping
        return Links.alike(LinkKind.SPRING, node[:-1], node[1:], figures=figures)
    half, plank = 0.5 * length, np.arange(count)
    links = Links.alike(LinkKind.PIVOT, plank[:-1], plank[1:], (half, 0.0), (-half, 0.0))
    ends: tuple[tuple[End, int, Point, int, float], ...] = (
        ("start", 0, rope.start, STARTS_AT, -half),
        ("end", count - 1, rope.end, ENDS_AT, half),
    )
    for end, body, place, stand_in, anchor in ends:
        if rope.tied(end) is not None:
            held = Links.alike(LinkKind.PIVOT, [stand_in], [body], (0.0, 0.0), (anchor, 0.0))
        elif rope.holds(end):
            held = Links.alike(LinkKind.PIVOT, [WORLD], [body], place, (anchor, 0.0))
        else:
            continue
        links = links.joined(held)
    return links


def cloth_layout(cloth: Cloth) -> Layout:
    """Lay out the nodes of a cloth, row by row from the top, each from the left."""
    row, column = np.divmod(np.arange(cloth.columns * cloth.rows), cloth.columns)
    position = np.asarray(cloth.corner) + np.column_stack((column, -row)) * np.asarray(cloth.spacing)
    fixed = np.zeros(len(position), np.bool_)
    fixed[[column + row * cloth.columns for column, row in cloth.pinned]] = True
    return alike(position, cloth.velocity, cloth.angle, cloth.angular_velocity, fixed)


def cloth_links(cloth: Cloth) -> Links:
    """Return a cloth's joints by the numbers of its nodes: along rows, columns, diagonals, then past a neighbour."""
    across, down = cloth.spacing
    if cloth.kind == "rods":
        links = _mesh(cloth, 1, 0, across).joined(_mesh(cloth, 0, 1, down))
    else:
        links = _mesh(cloth, 1, 0, across, cloth.stiffness).joined(_mesh(cloth, 0, 1, down, cloth.stiffness))
    if cloth.shear is not None:
        for way in (1, -1):
            links = links.joined(_mesh(cloth, way, 1, math.hypot(across, down), cloth.shear))
    if cloth.bend is not None:
        links = links.joined(_mesh(cloth, 2, 0, 2.0 * across, cloth.bend))
        links = links.joined(_mesh(cloth, 0, 2, 2.0 * down, cloth.bend))
    return links


def _mesh(cloth: Cloth, right: int, down: int, length: float, stiffness: float | None = None) -> Links:
    """Join every node to the one so many columns to the right and rows down: by springs, or rods without stiffness."""
    number = np.arange(cloth.columns * cloth.rows).reshape(cloth.rows, cloth.columns)
    height, width = max(cloth.rows - down, 0), max(cloth.columns - abs(right), 0)
    left, other = max(-right, 0), max(right, 0)
    a = number[:height, left : left + width].ravel()
    b = number[down : down + height, other : other + width].ravel()
    if stiffness is None:
        return Links.alike(LinkKind.ROD, a, b, figures=(length, 0.0, 0.0))
    return Links.alike(LinkKind.SPRING, a, b, figures=(length, stiffness, cloth.damping))
