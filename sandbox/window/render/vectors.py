"""Contact points and normals, and arrows for velocities and forces."""

import math
from itertools import pairwise

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.geometry.vectors import offset_from_segment
from sandbox.window.hit_test import Hull, hull_gap, hulls_of
from sandbox.window.render.circles import CircleRenderer, CircleStyle
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import draw_arrow, draw_line
from sandbox.window.render.palette import BACKGROUND, INK, ORANGE, SKY, YELLOW, RgbColour, mix_colours
from sandbox.window.render.text import draw_text

MAX_RECOMPUTED = 400
"""Number of contacts with walls and posts whose normals are recomputed."""
FEATURE_TOLERANCE = 0.02
"""Tolerance of a touching feature beyond the closest distance, in radii."""
MAX_WALL_POINTS = 256
"""Number of wall points up to which normals are recomputed."""


def contact_points(view: DrawContext) -> tuple[FloatArray, FloatArray]:
    """Return position (C, 2) m and normal (C, 2) of all contacts, recomputed from the poses in the frame.

    Where the bodies of a contact are unknown or not finite, the recorded values are returned.
    """
    contacts, position, bodies = view.snapshot.contacts, view.snapshot.frame.position, view.snapshot.bodies
    count = min(len(position), len(bodies))
    first, second = contacts.pair[:, 0], contacts.pair[:, 1]
    known = (first >= 0) & (first < count)
    a = np.where(known, first, 0)
    if not count:
        return contacts.point, contacts.normal
    normal = contacts.normal.copy()
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        balls = known & (second >= 0) & (second < count)
        offset = position[second[balls]] - position[a[balls]]
        normal[balls] = offset / np.hypot(offset[:, 0], offset[:, 1])[:, None]
        _recompute_curved(view, normal, np.flatnonzero(known & (second < 0))[:MAX_RECOMPUTED])
        normal = np.where(np.isfinite(normal).all(axis=1, keepdims=True), normal, contacts.normal)
        point = position[a] + normal * bodies.radius[a][:, None]
        is_disc = np.append(bodies.round, True)
        b = np.where((second >= 0) & (second < count), second, len(bodies))
        rows = np.flatnonzero(known & ~(is_disc[a] & is_disc[b]))
        point[rows], normal[rows] = contacts.point[rows], contacts.normal[rows]
        _recompute_solid(view, point, normal, rows[:MAX_RECOMPUTED])
    is_valid = known[:, None] & np.isfinite(point).all(axis=1, keepdims=True)
    return np.where(is_valid, point, contacts.point), normal


def _recompute_curved(view: DrawContext, normal: FloatArray, rows: "np.ndarray[tuple[int], np.dtype[np.intp]]") -> None:
    """Recompute the normals of contacts with walls and posts, which change as a ball rolls around them."""
    fixed, position = view.snapshot.scene.fixed, view.snapshot.frame.position
    for row, (number, other) in zip(rows.tolist(), view.snapshot.contacts.pair[rows].tolist(), strict=True):
        if -1 - other >= len(fixed):
            continue
        element, centre = fixed[-1 - other], position[number]
        if isinstance(element, Post):
            offset = np.asarray(element.position) - centre
        elif isinstance(element, Wall) and len(element.points) <= MAX_WALL_POINTS:
            offset = _offset_of_wall(element, centre)
        else:
            continue
        normal[row] = offset / np.hypot(*offset)


def _recompute_solid(
    view: DrawContext, point: FloatArray, normal: FloatArray, rows: "np.ndarray[tuple[int], np.dtype[np.intp]]"
) -> None:
    """Recompute contacts that involve a non-circular body: the midpoint between the closest features."""
    bodies, frame, fixed = view.snapshot.bodies, view.snapshot.frame, view.snapshot.scene.fixed
    for row, (number, other) in zip(rows.tolist(), view.snapshot.contacts.pair[rows].tolist(), strict=True):
        if not np.isfinite(frame.position[number]).all() or not math.isfinite(float(frame.angle[number])):
            continue
        own = hulls_of(bodies, frame, number)
        if other >= 0:
            others = hulls_of(bodies, frame, other) if np.isfinite(frame.position[other]).all() else []
        else:
            others = _hulls_of_fixed(fixed[-1 - other], frame.position[number]) if -1 - other < len(fixed) else []
        tolerance = FEATURE_TOLERANCE * float(bodies.radius[number])
        found = [hull_gap(hull_a, hull_b, tolerance) for hull_a in own for hull_b in others]
        if found:
            point[row] = min(found, key=lambda each: each[0])[1]
        for disc, sign in ((number, 1.0), (other, -1.0)):
            if disc >= 0 and bodies.round[disc]:  # the normal passes through the centre of the disc
                out = (point[row] - frame.position[disc]) * sign
                normal[row] = out / np.hypot(*out)


def _hulls_of_fixed(element: Plane | Wall | Post, point: FloatArray) -> list[Hull]:
    """Return static geometry as hulls; of a plane, the part near a point."""
    if isinstance(element, Post):
        return [Hull(np.asarray([element.position]), element.radius)]
    if isinstance(element, Wall):
        ends = (*element.points, element.points[0]) if element.closed else element.points
        return [Hull(np.asarray(pair), element.thickness / 2.0) for pair in pairwise(ends[:MAX_WALL_POINTS])]
    normal = np.asarray(element.normal) / math.hypot(*element.normal)
    foot = point - ((point - element.point) @ normal) * normal
    along = np.asarray((-normal[1], normal[0])) * 1e3 * max(1.0, float(np.abs(point - foot).max()))
    return [Hull(np.asarray((foot - along, foot + along)), 0.0)]


def _offset_of_wall(wall: Wall, centre: FloatArray) -> FloatArray:
    """Return the shortest vector from a point to a wall's centre line, m."""
    ends = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
    offset = -offset_from_segment(centre, ends[:-1], np.diff(ends, axis=0))
    return np.asarray(offset[np.argmin(np.hypot(*offset.T))])


MAX_ARROWS = 1000
"""Largest number of arrows of one kind: velocities and contacts are sampled evenly, forces by strength."""
ARROW_CROWD = 300
"""Number above which contact marks are smaller and arrows have no dark outline."""
VELOCITY_TIME = 0.1
"""s: the arrow of a velocity v has length v · SPAN"""
NORMAL_LENGTH = 16.0
"""px, length of a contact normal"""
WEIGHT_LENGTH = 26.0
"""px, length of a force of one weight m·g"""
LONGEST_ARROW = 80.0
"""px, length of the largest force if weights would make it longer"""
_COOL = mix_colours(BACKGROUND, SKY, 0.8)
HEAT: tuple[RgbColour, ...] = tuple(
    mix_colours(_COOL, YELLOW, k / 16) if k < 16 else mix_colours(YELLOW, (255, 255, 255), k / 16 - 1.0)
    for k in range(33)
)
"""Colours of forces by line length, from blue through yellow to white."""
MAX_LABELS = 12
"""Number of forces up to which each is labelled in newtons."""


def draw_velocities(view: DrawContext) -> None:
    """Draw v · 0.1 s as arrows, shortened to a third of the smaller side of the surface."""
    some = view.first(MAX_ARROWS)
    longest = max(min(view.camera.size) / 3.0, 1.0)
    with np.errstate(invalid="ignore", over="ignore"):
        arrow = view.camera.vectors_to_screen(view.snapshot.frame.velocity[some.shown] * VELOCITY_TIME)
        length = np.hypot(arrow[:, 0], arrow[:, 1])
        arrow = arrow * np.minimum(1.0, longest / np.maximum(length, 1e-300))[:, None]
    for k in np.flatnonzero((length > 2.0 * view.ui_scale) & np.isfinite(length)).tolist():
        (x, y), (dx, dy) = some.centre[k].tolist(), arrow[k].tolist()
        edge = BACKGROUND if len(some.shown) <= ARROW_CROWD and length[k] > 16.0 * view.ui_scale else None
        draw_arrow(view.surface, (x, y), (x + dx, y + dy), ORANGE, 2.0 * view.ui_scale, view.antialias, edge)


def _visible_contacts(view: DrawContext, max_count: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return the visible contacts without zone entries: indices (K,), positions (K, 2) px, normals (K, 2), y down."""
    point, normal = contact_points(view)
    with np.errstate(invalid="ignore", over="ignore"):
        pixels = view.camera.to_screen(point)
    visible = view.inside(pixels, 20.0 * view.ui_scale)
    scene = view.snapshot.scene
    solid_count = len(scene.fixed) + len(scene.pockets)  # zones follow in the numbering of static things
    visible = visible[view.snapshot.contacts.pair[visible, 1] >= -solid_count]
    if len(visible) > max_count:
        visible = visible[np.linspace(0, len(visible) - 1, max_count).astype(np.intp)]
    with np.errstate(over="ignore"):  # a recorded normal may have any length
        return visible, pixels[visible], view.camera.vectors_to_screen(normal[visible]) / view.camera.scale


def draw_contacts(view: DrawContext, discs: CircleRenderer) -> None:
    """Draw contact points, and the normals from the first body to the second."""
    visible, point, normal = _visible_contacts(view, MAX_ARROWS)
    if not len(visible):
        return
    crowded = len(visible) > ARROW_CROWD
    reach = (0.5 if crowded else 1.0) * NORMAL_LENGTH * view.ui_scale
    for (x, y), (nx, ny) in zip(point.tolist(), normal.tolist(), strict=True):
        draw_line(view.surface, (x, y), (x + nx * reach, y + ny * reach), INK, 1.0 * view.ui_scale, view.antialias)
    tint = np.broadcast_to(np.asarray(ORANGE, np.uint8), (len(visible), 3))
    size = np.full(len(visible), (1.8 if crowded else 3.0) * view.ui_scale)
    discs.draw(view.surface, point, size, tint, CircleStyle(0.0, antialias=view.antialias))


def draw_impulses(view: DrawContext) -> None:
    """Draw mean forces, |impulse| / seconds, as lines along the normal, centred at the contact.

    A force equal to the weight of the lighter body has a fixed length. If that would make the largest visible force too
    long, or if there is no gravity, the scale is set by the largest force instead.
    """
    visible, point, normal = _visible_contacts(view, 4 * MAX_ARROWS)
    if not len(visible) or not view.snapshot.seconds > 0.0:
        return
    contacts, gravity = view.snapshot.contacts, math.hypot(*view.snapshot.scene.world.gravity)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        force = np.hypot(*contacts.impulse[visible].T) / view.snapshot.seconds
        force[~np.isfinite(force)] = 0.0
        fraction = force / max(float(force.max()), 1e-300)
        weights = (
            force / (_lighter(view, contacts.pair[visible]) * gravity) if gravity > 0.0 else np.full_like(force, np.inf)
        )
        length = np.minimum(WEIGHT_LENGTH * float(np.max(weights)), LONGEST_ARROW) * fraction * view.ui_scale
    drawn = np.flatnonzero(length > 1.0)
    drawn = drawn[np.argsort(force[drawn], kind="stable")][-MAX_ARROWS:]  # the strongest last, on top
    for k in drawn.tolist():
        (x, y), (nx, ny), half = point[k].tolist(), normal[k].tolist(), float(length[k]) / 2.0
        ends = (x - nx * half, y - ny * half), (x + nx * half, y + ny * half)
        strength = min(2.0 * half / (LONGEST_ARROW * view.ui_scale), 1.0)
        width = (1.0 + 2.6 * strength) * view.ui_scale
        draw_line(view.surface, *ends, HEAT[int(32.0 * strength)], width, view.antialias)
        if len(drawn) <= MAX_LABELS:
            text, (right, down) = f"{float(force[k]):.3g} N", (10.0 * view.ui_scale, 12.0 * view.ui_scale)
            draw_text(
                view.surface, text, (x + right + 1, y + down + 1), 12 * view.ui_scale, BACKGROUND, "midleft", mono=True
            )
            draw_text(view.surface, text, (x + right, y + down), 12 * view.ui_scale, INK, "midleft", mono=True)


def _lighter(view: DrawContext, pair: IntArray) -> FloatArray:
    """Return the mass of the lighter movable body of each pair, (K,) kg; 1 if neither can move."""
    bodies = view.snapshot.bodies
    mass = np.append(np.where(bodies.fixed, np.inf, bodies.mass), np.inf)  # the last entry stands for static geometry
    sides = np.where((pair >= 0) & (pair < len(bodies)), pair, len(bodies))
    lighter = np.min(mass[sides], axis=1, initial=np.inf)
    return np.asarray(np.where(np.isfinite(lighter), lighter, 1.0))
