"""Touches: where contacts are now. A contact's row tells where it began, and its bodies have moved on since."""

import math
from itertools import pairwise

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.play.drawing.view import View
from sandbox.play.hulls import Hull, hulls_of, meeting
from sandbox.scene.description.fixed import Plane, Post, Wall

MOST_CURVED = 400
"""Contacts with walls and posts whose normals are worked out anew."""
SLACK = 0.02
"""Radii by which places that touch may be farther apart than the nearest."""
LONGEST = 256
"""Points of a wall for which that is done."""


def touches(view: View) -> tuple[FloatArray, FloatArray]:
    """Return place (C, 2) m and normal (C, 2) of all contacts, from where their bodies are in the frame.

    Where a contact's bodies are unknown, or nowhere, its row is taken at its word.
    """
    contacts, position, bodies = view.sight.contacts, view.sight.frame.position, view.sight.bodies
    count = min(len(position), len(bodies))
    first, second = contacts.pair[:, 0], contacts.pair[:, 1]
    known = (first >= 0) & (first < count)
    a = np.where(known, first, 0)
    if not count:
        return contacts.point, contacts.normal
    normal = contacts.normal.copy()
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        balls = known & (second >= 0) & (second < count)
        way = position[second[balls]] - position[a[balls]]
        normal[balls] = way / np.hypot(way[:, 0], way[:, 1])[:, None]
        _round(view, normal, np.flatnonzero(known & (second < 0))[:MOST_CURVED])
        normal = np.where(np.isfinite(normal).all(axis=1, keepdims=True), normal, contacts.normal)
        place = position[a] + normal * bodies.radius[a][:, None]
        lone = np.append(bodies.round, True)
        b = np.where((second >= 0) & (second < count), second, len(bodies))
        rows = np.flatnonzero(known & ~(lone[a] & lone[b]))
        place[rows], normal[rows] = contacts.point[rows], contacts.normal[rows]
        _solid(view, place, normal, rows[:MOST_CURVED])
    sound = known[:, None] & np.isfinite(place).all(axis=1, keepdims=True)
    return np.where(sound, place, contacts.point), normal


def _round(view: View, normal: FloatArray, rows: "np.ndarray[tuple[int], np.dtype[np.intp]]") -> None:
    """Turn the normals of contacts with walls and posts, which change as a ball rolls around them."""
    fixed, position = view.sight.scene.fixed, view.sight.frame.position
    for row, (number, thing) in zip(rows.tolist(), view.sight.contacts.pair[rows].tolist(), strict=True):
        if -1 - thing >= len(fixed):
            continue
        solid, centre = fixed[-1 - thing], position[number]
        if isinstance(solid, Post):
            way = np.asarray(solid.position) - centre
        elif isinstance(solid, Wall) and len(solid.points) <= LONGEST:
            way = _nearest(solid, centre) - centre
        else:
            continue
        normal[row] = way / np.hypot(*way)


def _solid(
    view: View, place: FloatArray, normal: FloatArray, rows: "np.ndarray[tuple[int], np.dtype[np.intp]]"
) -> None:
    """Find anew where bodies touch of which one is no lone disc: in the middle of where they are nearest."""
    bodies, frame, fixed = view.sight.bodies, view.sight.frame, view.sight.scene.fixed
    for row, (number, other) in zip(rows.tolist(), view.sight.contacts.pair[rows].tolist(), strict=True):
        if not np.isfinite(frame.position[number]).all() or not math.isfinite(float(frame.angle[number])):
            continue
        own = hulls_of(bodies, frame, number)
        if other >= 0:
            others = hulls_of(bodies, frame, other) if np.isfinite(frame.position[other]).all() else []
        else:
            others = _hulls_of_fixed(fixed[-1 - other], frame.position[number]) if -1 - other < len(fixed) else []
        tolerance = SLACK * float(bodies.radius[number])
        found = [meeting(one, two, tolerance) for one in own for two in others]
        if found:
            place[row] = min(found, key=lambda each: each[0])[1]
        for disc, way in ((number, 1.0), (other, -1.0)):
            if disc >= 0 and bodies.round[disc]:  # the normal goes through its centre
                out = (place[row] - frame.position[disc]) * way
                normal[row] = out / np.hypot(*out)


def _hulls_of_fixed(thing: Plane | Wall | Post, near: FloatArray) -> list[Hull]:
    """Return a fixed thing as hulls; of a plane, what lies about a place."""
    if isinstance(thing, Post):
        return [Hull(np.asarray([thing.position]), thing.radius)]
    if isinstance(thing, Wall):
        ends = (*thing.points, thing.points[0]) if thing.closed else thing.points
        return [Hull(np.asarray(pair), thing.thickness / 2.0) for pair in pairwise(ends[:LONGEST])]
    normal = np.asarray(thing.normal) / math.hypot(*thing.normal)
    foot = near - ((near - thing.point) @ normal) * normal
    along = np.asarray((-normal[1], normal[0])) * 1e3 * max(1.0, float(np.abs(near - foot).max()))
    return [Hull(np.asarray((foot - along, foot + along)), 0.0)]


def _nearest(wall: Wall, centre: FloatArray) -> FloatArray:
    """Return the point of a wall's middle line that is nearest to a place, m."""
    ends = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
    start, along = ends[:-1], np.diff(ends, axis=0)
    share = np.clip(((centre - start) * along).sum(1) / (along**2).sum(1), 0.0, 1.0)
    nearest = start + share[:, None] * along
    return np.asarray(nearest[np.argmin(np.hypot(*(nearest - centre).T))])
