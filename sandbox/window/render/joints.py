"""Joints and drives: rods, strings and springs below the bodies, and the symbols of the joints overlay above them.

The colour of a spring shows its strain: blue is compressed, grey at rest, orange stretched. If there are many springs,
as in a cloth, they are drawn as plain lines.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.drives import Mount, mounts
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind, last_click
from sandbox.scene.description.forces import PlungerDrive
from sandbox.window.render.body_geometry import clipped_box
from sandbox.window.render.circles import CircleRenderer, CircleStyle
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, Pixel, draw_arrow, draw_dashes, draw_line, draw_thin_lines
from sandbox.window.render.palette import (
    BACKGROUND,
    GREEN,
    INK,
    ORANGE,
    SKY,
    SURFACE,
    YELLOW,
    ColourArray,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.particles import packed_pixels
from sandbox.window.render.sdf import ShapeStyle, SignedDistance, arc_distance, capsule_distance, draw_sdf

MAX_ZIGZAG_SPRINGS = 500
"""Number of springs up to which each is drawn as a zigzag."""
SOLID_RODS = 500
"""Number of rods up to which each is drawn wider than one pixel."""
ANCHOR_RADIUS = 3.2
"""px, radius of the mark at an anchor on the world"""
MAX_HATCHED = 40
"""Number of anchors on the world up to which each is drawn as a fixed support"""
HALF_WINDINGS = 18
"""Half windings of a spring."""
MIN_COIL_LENGTH = 20.0
"""px, length below which a spring is drawn as a line"""
HALF_COLOUR_STRAIN = 0.1
"""Strain at which a spring shows half of its full colour."""
_REST = mix_colours(BACKGROUND, SURFACE, 0.75)
ROD = mix_colours(BACKGROUND, SURFACE, 0.9)
STRING = mix_colours(BACKGROUND, SURFACE, 0.7)
SHADES = np.asarray(
    [
        mix_colours(_REST, SKY, (32 - k) / 32) if k < 32 else mix_colours(_REST, ORANGE, (k - 32) / 32)
        for k in range(65)
    ],
    np.uint8,
)
"""Colours of springs, from compressed to stretched."""


@dataclass(frozen=True, eq=False)
class JointSegments:
    """The J visible joints and their anchors."""

    joints: JointArrays
    ends: FloatArray
    """(J, 4) px: anchor on the first body or on the world, then anchor on the second body"""

    def of(self, *kinds: JointKind) -> "JointSegments":
        """Return the joints of the given kinds."""
        return self.some(np.isin(self.joints.kind, kinds))

    def some(self, which: BoolArray) -> "JointSegments":
        """Return a selection of the joints, by a mask."""
        return JointSegments(self.joints.some(which), self.ends[which])

    @property
    def length(self) -> FloatArray:
        """(J,) px."""
        return np.asarray(np.hypot(self.ends[:, 2] - self.ends[:, 0], self.ends[:, 3] - self.ends[:, 1]))


def joint_segments(view: DrawContext) -> JointSegments:
    """Return the visible joints: unbroken, with both bodies present, and near the surface."""
    joints, frame = view.snapshot.joints, view.snapshot.frame
    count = min(len(frame.position), len(view.snapshot.bodies))
    if not len(joints):
        return JointSegments(joints, np.empty((0, 4)))
    present = frame.present[:count]
    has_bodies = (joints.b < count) & (joints.a < count)
    if not has_bodies.all():
        joints = joints.some(has_bodies)
    is_visible = present[joints.b] & ((joints.a < 0) | present[joints.a])
    with np.errstate(invalid="ignore", over="ignore"):
        a, b = joints.ends(frame.position, frame.angle)
        ends = np.hstack((view.camera.to_screen(a), view.camera.to_screen(b)))
        width, height = view.camera.size
        margin = 100.0 * view.ui_scale
        low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
        over = joints.kind == JointKind.PULLEY
        for wheel in (joints.wheels[over, :2], joints.wheels[over, 2:]) if over.any() else ():
            low[over] = np.minimum(low[over], view.camera.to_screen(wheel))
            high[over] = np.maximum(high[over], view.camera.to_screen(wheel))
        is_visible &= (high > -margin).all(axis=1) & (low < (width + margin, height + margin)).all(axis=1)
        is_visible &= np.isfinite(ends).all(axis=1)
        is_visible &= ~over | (np.abs(ends) < SDL_COORDINATE_LIMIT).all(axis=1)
    return JointSegments(joints if is_visible.all() else joints.some(is_visible), ends[is_visible])


def draw_joints(view: DrawContext, joints: JointSegments, discs: CircleRenderer) -> None:
    """Draw rods, strings and springs, and their anchors on the world. Springs that only pull are lines."""
    fast = joints.of(JointKind.ROD, JointKind.SLIDE, JointKind.SPRING)
    anchors = fast.ends[fast.joints.a < 0, :2]
    tint = np.broadcast_to(np.asarray(SURFACE, np.uint8), (len(anchors), 3))
    size = np.full(len(anchors), (ANCHOR_RADIUS if len(anchors) <= SOLID_RODS else 0.5 * ANCHOR_RADIUS) * view.ui_scale)
    if len(anchors) <= MAX_HATCHED:
        for x, y in anchors.tolist():
            _draw_support(view, (x, y))
    discs.draw(view.surface, anchors, size, tint, CircleStyle(0.0, antialias=view.antialias))
    _draw_rods(view, joints.of(JointKind.ROD), ROD, 2.4)
    _draw_rods(view, joints.of(JointKind.SLIDE), STRING, 1.4)
    _draw_pulleys(view, joints.of(JointKind.PULLEY), discs)
    springs = joints.of(JointKind.SPRING)
    if not len(springs.joints):
        return
    shade = strain(springs, view.camera.scale)
    if len(springs.joints) > MAX_ZIGZAG_SPRINGS:
        draw_thin_lines(view.surface, springs.ends, packed_pixels(SHADES[shade], view.surface), view.antialias)
        return
    rest = springs.joints.figures[:, 0] * view.camera.scale
    for k, row in enumerate(springs.ends.tolist()):
        red, green, blue = SHADES[shade[k]].tolist()
        if springs.joints.pulls_only[k]:
            is_slack, ends = springs.length[k] <= rest[k], ((row[0], row[1]), (row[2], row[3]))
            width = (1.2 if is_slack else 2.4) * view.ui_scale
            draw_line(view.surface, *ends, STRING if is_slack else (red, green, blue), width, view.antialias)
            continue
        _draw_coil(view, (row[0], row[1]), (row[2], row[3]), float(rest[k]), (red, green, blue))


def _draw_support(view: DrawContext, anchor: Pixel) -> None:
    """Draw the symbol of a fixed support of statics around an anchor: a plate with hatching below it."""
    unit, (x, y) = view.ui_scale, anchor
    half, drop = 12.0 * unit, 7.0 * unit
    top = y + ANCHOR_RADIUS * unit
    draw_line(view.surface, (x - half, top), (x + half, top), SURFACE, 1.6 * unit, view.antialias)
    for k in range(4):
        foot = x - half + (k + 0.5) * 0.5 * half
        draw_line(view.surface, (foot, top + drop), (foot + 0.5 * drop, top), SURFACE, 1.2 * unit, view.antialias)


def _draw_pulleys(view: DrawContext, pulleys: JointSegments, discs: CircleRenderer) -> None:
    """Draw ropes over two wheels each, and the wheels."""
    if not len(pulleys.joints):
        return
    wheels = [view.camera.to_screen(pulleys.joints.wheels[:, side]) for side in (slice(0, 2), slice(2, 4))]
    for start, end in ((pulleys.ends[:, :2], wheels[0]), (wheels[0], wheels[1]), (wheels[1], pulleys.ends[:, 2:])):
        _draw_rods(view, JointSegments(pulleys.joints, np.hstack((start, end))), STRING, 1.4)
    points = np.vstack(wheels)
    points = points[view.inside(points, 10.0 * view.ui_scale)]
    for radius, colour in ((5.0, STRING), (3.4, SURFACE)):
        tint = np.broadcast_to(np.asarray(colour, np.uint8), (len(points), 3))
        style = CircleStyle(0.0, antialias=view.antialias)
        discs.draw(view.surface, points, np.full(len(points), radius * view.ui_scale), tint, style)


def strain(springs: JointSegments, scale: float) -> IntArray:
    """Return the index into `SHADES` for the strain of each spring, (J,)."""
    rest = springs.joints.figures[:, 0] * scale
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        stretch = np.where(rest > 0.0, springs.length / rest - 1.0, 1.0)
        fraction = stretch / (np.abs(stretch) + HALF_COLOUR_STRAIN)
    return np.rint(32.0 + 32.0 * np.nan_to_num(fraction, nan=1.0)).astype(np.int64)


def _draw_rods(view: DrawContext, rods: JointSegments, colour: tuple[int, int, int], width: float) -> None:
    if len(rods.joints) > SOLID_RODS:
        tones: ColourArray = np.broadcast_to(np.asarray(colour, np.uint8), (len(rods.joints), 3))
        draw_thin_lines(view.surface, rods.ends, packed_pixels(tones, view.surface), view.antialias)
        return
    for ax, ay, bx, by in rods.ends.tolist():
        draw_line(view.surface, (ax, ay), (bx, by), colour, width * view.ui_scale, view.antialias)


def _draw_coil(view: DrawContext, a: Pixel, b: Pixel, rest: float, colour: tuple[int, int, int]) -> None:
    """Draw a spring as a zigzag of constant wire length: stretching widens the pitch and narrows the coil."""
    length, ui_scale = float(np.hypot(b[0] - a[0], b[1] - a[1])), view.ui_scale
    reach = 4.0 * max(view.camera.size)
    is_far = max(map(abs, (*a, *b))) > reach
    if not MIN_COIL_LENGTH * ui_scale <= length or is_far:
        draw_line(view.surface, a, b, colour, 1.4 * ui_scale, view.antialias)
        return
    ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    straight_end = min(0.1 * length, 14.0 * ui_scale)
    pitch = (length - 2.0 * straight_end) / HALF_WINDINGS
    widest = min(max(0.09 * rest, 3.0 * ui_scale), 9.0 * ui_scale)
    wire = np.hypot(2.0 * widest, 0.8 * rest / HALF_WINDINGS)
    width = min(max(0.5 * float(np.sqrt(max(wire**2 - pitch**2, 0.0))), 0.35 * widest), 1.3 * widest)
    points = [a]
    for k in range(HALF_WINDINGS + 1):
        along, side = straight_end + pitch * k, 0.0 if k in (0, HALF_WINDINGS) else width if k % 2 else -width
        points.append((a[0] + ux * along - uy * side, a[1] + uy * along + ux * side))
    points.append(b)
    if view.antialias:
        for shift in (-0.75, -0.25) if ui_scale < 1.5 else (-1.0, -0.5, 0.0):
            pygame.draw.aalines(view.surface, colour, False, [(x + shift, y + shift) for x, y in points])
        return
    for p, q in pairwise(points):
        draw_line(view.surface, p, q, colour, 1.5 * ui_scale, antialias=False)


MAX_SYMBOLS = 600
"""Number of joints of a kind up to which each gets its symbol; above it, joints are plain lines from body to body."""
MAX_DIALS = 60
"""Largest number of dials, the symbols of rotary joints, which take longer to draw."""
SMALL_SYMBOL, LARGE_SYMBOL = 12.0, 34.0
"""px, smallest and largest radius of the arcs of rotary joints"""
_TINTS: dict[JointKind, RgbColour] = {
    JointKind.ROD: INK,
    JointKind.PIVOT: YELLOW,
    JointKind.SLIDE: SKY,
    JointKind.GROOVE: SKY,
    JointKind.ROTARY_LIMIT: GREEN,
    JointKind.MOTOR: ORANGE,
    JointKind.GEAR: INK,
    JointKind.SPRING: INK,
    JointKind.ROTARY_SPRING: SKY,
    JointKind.PULLEY: SKY,
    JointKind.RATCHET: GREEN,
    JointKind.LINEAR_MOTOR: ORANGE,
}


class AngleDial(NamedTuple):
    """Where and how the dial of a rotary joint is drawn."""

    centre: Pixel
    size: float
    """px, radius"""
    base: float
    """rad, angle of the first body"""
    relative_angle: float
    """rad, angle of the second body relative to the first"""
    figures: tuple[float, float, float]
    """parameters of the joint"""


def draw_joint_symbols(view: DrawContext, joints: JointSegments, discs: CircleRenderer) -> None:
    """Draw the symbols of all visible joints."""
    renderers: dict[JointKind, Callable[[DrawContext, JointSegments], None]] = {
        JointKind.ROD: _draw_rod_symbols,
        JointKind.GEAR: _draw_gears,
        JointKind.SLIDE: _draw_slides,
        JointKind.GROOVE: _draw_grooves,
        JointKind.ROTARY_LIMIT: _draw_limits,
        JointKind.ROTARY_SPRING: _draw_rotary_springs,
        JointKind.MOTOR: _draw_motors,
        JointKind.RATCHET: _draw_ratchets,
        JointKind.LINEAR_MOTOR: _draw_linear_motors,
    }
    is_compound = joints.joints.is_compound
    welds = joints.some(is_compound & (joints.joints.kind == JointKind.PIVOT))
    is_hidden = np.isin(joints.joints.kind, (JointKind.PIVOT, JointKind.GEAR))  # of welds and prismatic joints
    joints = joints.some(~(is_compound & is_hidden))
    for kind in (*renderers, JointKind.SPRING, JointKind.PULLEY, JointKind.PIVOT):
        some = joints.of(kind)
        if len(some.joints) > MAX_SYMBOLS:
            tint = np.broadcast_to(
                np.asarray(mix_colours(BACKGROUND, _TINTS[kind], 0.7), np.uint8), (len(some.joints), 3)
            )
            if kind is JointKind.SPRING:
                tint = SHADES[strain(some, view.camera.scale)]
            draw_thin_lines(view.surface, some.ends, packed_pixels(tint, view.surface), view.antialias)
        elif len(some.joints) and kind in renderers:
            renderers[kind](view, some)
        if (
            kind in (JointKind.ROD, JointKind.SLIDE, JointKind.SPRING, JointKind.PULLEY)
            and 0 < len(some.joints) <= MAX_SYMBOLS
        ):
            _draw_dots(view, np.vstack((some.ends[:, :2], some.ends[:, 2:])), 2.6, _TINTS[kind], discs)
        if kind in (JointKind.PIVOT, JointKind.GROOVE) and 0 < len(some.joints) <= MAX_SYMBOLS:
            _draw_rings(view, some.ends[:, 2:], _TINTS[kind], discs)
    if 0 < len(welds.joints) <= MAX_SYMBOLS:
        _draw_welds(view, welds, discs)


def _draw_dots(view: DrawContext, points: FloatArray, size: float, colour: RgbColour, discs: CircleRenderer) -> None:
    visible = view.inside(points, 10.0 * view.ui_scale)
    for dot_radius, tone in ((size + 1.2, BACKGROUND), (size, colour)):
        radius = np.full(len(visible), dot_radius * view.ui_scale)
        tint = np.broadcast_to(np.asarray(tone, np.uint8), (len(visible), 3))
        discs.draw(view.surface, points[visible], radius, tint, CircleStyle(0.0, antialias=view.antialias))


def _draw_rings(view: DrawContext, points: FloatArray, colour: RgbColour, discs: CircleRenderer) -> None:
    """Draw the symbol of a revolute joint: a ring on a dark disc."""
    _draw_dots(view, points, 5.0, BACKGROUND, discs)
    visible = view.inside(points, 10.0 * view.ui_scale)
    radius = np.full(len(visible), 5.0 * view.ui_scale)
    tint = np.broadcast_to(np.asarray(colour, np.uint8), (len(visible), 3))
    style = CircleStyle(1.8 * view.ui_scale, hollow=True, antialias=view.antialias)
    discs.draw(view.surface, points[visible], radius, tint, style)


def _draw_welds(view: DrawContext, welds: JointSegments, discs: CircleRenderer) -> None:
    """Draw a cross on a dark disc where a weld holds its bodies."""
    points = welds.ends[:, 2:]
    _draw_dots(view, points, 5.0, BACKGROUND, discs)
    half = 4.0 * view.ui_scale
    for x, y in points[view.inside(points, 10.0 * view.ui_scale)].tolist():
        for side in (-half, half):
            draw_line(
                view.surface, (x - half, y - side), (x + half, y + side), YELLOW, 2.4 * view.ui_scale, view.antialias
            )


def _draw_linear_motors(view: DrawContext, motors: JointSegments) -> None:
    """Draw an arrow along the axis from the point that a motor moves, in its direction."""
    joints, frame = motors.joints, view.snapshot.frame
    along = joints.figures[:, :2] - joints.anchor_a
    along *= np.where(joints.figures[:, 2] < 0.0, -1.0, 1.0)[:, None]
    turned = np.arctan2(along[:, 1], along[:, 0]) + np.where(joints.a < 0, 0.0, frame.angle[joints.a])
    reach = LARGE_SYMBOL * view.ui_scale
    for (_, _, x, y), angle in zip(motors.ends.tolist(), turned.tolist(), strict=True):
        tip = x + reach * math.cos(angle), y - reach * math.sin(angle)
        draw_arrow(view.surface, (x, y), tip, INK, 2.2 * view.ui_scale, view.antialias, BACKGROUND)


def _draw_rod_symbols(view: DrawContext, rods: JointSegments) -> None:
    for ax, ay, bx, by in rods.ends.tolist():
        draw_line(view.surface, (ax, ay), (bx, by), INK, 1.4 * view.ui_scale, view.antialias)


def _draw_gears(view: DrawContext, gears: JointSegments) -> None:
    rows = _from_bodies(view, gears)
    draw_dashes(view.surface, [((ax, ay), (bx, by)) for ax, ay, bx, by in rows.tolist()], INK, 2.0 * view.ui_scale)
    points = rows[:, 2:]
    for x, y in points[view.inside(points, 2.0 * LARGE_SYMBOL)][:MAX_DIALS].tolist():
        arc(view, (x, y), 0.7 * SMALL_SYMBOL * view.ui_scale, 0.0, math.tau, INK, 1.2)


def _draw_slides(view: DrawContext, slides: JointSegments) -> None:
    """Draw strings as dashed lines with a tick at each end, brighter if the string is taut."""
    scale, ui_scale = view.camera.scale, view.ui_scale
    rows = zip(slides.ends.tolist(), slides.joints.figures.tolist(), slides.length.tolist(), strict=True)
    for (ax, ay, bx, by), (min_length, max_length, _), length in rows:
        taut = length >= 0.998 * max_length * scale or length <= 1.002 * min_length * scale
        colour = INK if taut else SKY
        draw_dashes(view.surface, [((ax, ay), (bx, by))], colour, 6.0 * ui_scale, view.antialias)
        if length > 0.0:
            x, y = -(by - ay) / length * 6.0 * ui_scale, (bx - ax) / length * 6.0 * ui_scale
            for px, py in ((ax, ay), (bx, by)):
                draw_line(view.surface, (px - x, py - y), (px + x, py + y), colour, 1.6 * ui_scale, view.antialias)


def _draw_grooves(view: DrawContext, grooves: JointSegments) -> None:
    """Draw grooves: two parallel lines with round ends."""
    joints, frame = grooves.joints, view.snapshot.frame
    angle = np.where(joints.a < 0, 0.0, frame.angle[joints.a])
    position = np.where((joints.a < 0)[:, None], 0.0, frame.position[joints.a])
    (x, y, _), cos, sin = joints.figures.T, np.cos(angle), np.sin(angle)
    with np.errstate(invalid="ignore", over="ignore"):
        ends_b = view.camera.to_screen(position + np.column_stack((cos * x - sin * y, sin * x + cos * y)))
    half = 5.0 * view.ui_scale
    for (ax, ay, *_), (bx, by) in zip(grooves.ends.tolist(), ends_b.tolist(), strict=True):
        length = math.hypot(bx - ax, by - ay)
        if not 0.0 < length < SDL_COORDINATE_LIMIT or max(abs(ax), abs(ay)) > SDL_COORDINATE_LIMIT:
            continue
        ux, uy = (bx - ax) / length, (by - ay) / length
        for side in (-half, half):
            shift = -uy * side, ux * side
            start, end = (ax + shift[0], ay + shift[1]), (bx + shift[0], by + shift[1])
            draw_line(view.surface, start, end, SKY, 1.4 * view.ui_scale, view.antialias)
        direction = math.atan2(-uy, ux)
        arc(view, (ax, ay), half, direction + 0.5 * math.pi, math.pi, SKY, 1.4)
        arc(view, (bx, by), half, direction - 0.5 * math.pi, math.pi, SKY, 1.4)


def _draw_limits(view: DrawContext, limits: JointSegments) -> None:
    """Draw the permitted arc of the second body, and a needle at its angle."""
    for (x, y), size, base, relative_angle, (min_angle, max_angle, _) in _dials(view, limits):
        first, span = base + min_angle, min(max(max_angle - min_angle, 0.0), math.tau)
        arc(view, (x, y), size, first, span, INK, 2.0)
        for stop in (first, first + span):
            inner, outer = spot((x, y), 0.8 * size, stop), spot((x, y), 1.2 * size, stop)
            path(view, [inner, outer], INK, 2.0)
        tip, foot = spot((x, y), 1.1 * size, base + relative_angle), spot((x, y), 0.45 * size, base + relative_angle)
        path(view, [foot, tip], YELLOW, 2.0)


def _draw_rotary_springs(view: DrawContext, springs: JointSegments) -> None:
    """Draw a spiral that winds up with the spring."""
    for (x, y), size, base, relative_angle, (rest, _, _) in _dials(view, springs):
        twist = max(min(relative_angle - rest, 2.0 * math.tau), -2.0 * math.tau)
        wound = 1.5 * math.tau + twist
        colour = tuple(SHADES[round(32.0 + 32.0 * twist / (abs(twist) + 0.5))].tolist())
        count = 28
        points = [
            spot((x, y), size * (0.25 + 0.75 * k / count), base + relative_angle - wound * (1.0 - k / count))
            for k in range(count + 1)
        ]
        path(view, points, (colour[0], colour[1], colour[2]), 1.4)


def _draw_motors(view: DrawContext, motors: JointSegments) -> None:
    """Draw three quarters of a circle with an arrowhead in the driving direction."""
    for (x, y), size, base, _, (rate, _, _) in _dials(view, motors):
        sign = 1.0 if rate >= 0.0 else -1.0
        first, span = base - sign * 0.75 * math.pi, sign * 1.35 * math.pi
        arc(view, (x, y), 1.15 * size, first, span, INK, 2.2)
        last = first + span
        neck, tip = spot((x, y), 1.15 * size, last - sign * 0.15), spot((x, y), 1.15 * size, last + sign * 0.35)
        draw_arrow(view.surface, neck, tip, INK, 2.2 * view.ui_scale, view.antialias, BACKGROUND)


MAX_TEETH = 36
"""Largest number of teeth of a ratchet that are drawn; with more, only those next to the needle are"""


def _draw_ratchets(view: DrawContext, ratchets: JointSegments) -> None:
    """Draw the teeth of a ratchet, up which the needle of the second body slides and down which it does not."""
    for (x, y), size, base, relative_angle, (_, phase, ratchet) in _dials(view, ratchets):
        count = min(max(int(math.tau / abs(ratchet)), 1), MAX_TEETH)
        tooth = math.copysign(min(abs(ratchet), math.tau), ratchet)
        first = base + float(last_click(relative_angle, phase, ratchet)) - (count // 2) * tooth
        points = [spot((x, y), 0.85 * size, first)]
        for k in range(count):
            stop = first + (k + 1) * tooth
            points += [spot((x, y), (0.85 + 0.3 * f) * size, stop + (f - 1.0) * tooth) for f in (0.25, 0.5, 0.75, 1.0)]
            points.append(spot((x, y), 0.85 * size, stop))
        path(view, points, INK, 1.4)
        angle = base + relative_angle
        path(view, [spot((x, y), 0.35 * size, angle), spot((x, y), 1.1 * size, angle)], YELLOW, 2.0)


def _dials(view: DrawContext, joints: JointSegments) -> list[AngleDial]:
    """Return the dials of rotary joints: at a pivot of the same two bodies, else at the centre of the second body."""
    frame, bodies, joint_arrays = view.snapshot.frame, view.snapshot.bodies, joints.joints
    all_joints, pivots = view.snapshot.joints, {}
    for k in np.flatnonzero(all_joints.kind == JointKind.PIVOT).tolist():
        pivots[int(all_joints.a[k]), int(all_joints.b[k])] = k
    _, hinge = all_joints.ends(frame.position, frame.angle)
    found = []
    rows = zip(joint_arrays.a.tolist(), joint_arrays.b.tolist(), joint_arrays.figures.tolist(), strict=True)
    for a, b, figures in list(rows)[:MAX_DIALS]:
        pivot = pivots.get((a, b), pivots.get((b, a)))
        position = frame.position[b] if pivot is None else hinge[pivot]
        x, y = view.camera.to_screen(position).tolist()
        base = 0.0 if a < 0 else float(frame.angle[a])
        relative_angle = float(frame.angle[b]) - base
        if max(abs(x), abs(y)) < SDL_COORDINATE_LIMIT and math.isfinite(base) and math.isfinite(relative_angle):
            radius = float(bodies.core[b]) * view.camera.scale
            size = min(max(0.6 * radius, SMALL_SYMBOL * view.ui_scale), LARGE_SYMBOL * view.ui_scale)
            found.append(AngleDial((x, y), size, base, relative_angle, (figures[0], figures[1], figures[2])))
    return found


def _from_bodies(view: DrawContext, joints: JointSegments) -> FloatArray:
    """Return the centres of the jointed bodies, (J, 4) px; for the world, the anchor."""
    first = np.where((joints.joints.a < 0)[:, None], 0.0, view.snapshot.frame.position[joints.joints.a])
    ends = np.hstack(
        (view.camera.to_screen(first), view.camera.to_screen(view.snapshot.frame.position[joints.joints.b]))
    )
    ends[:, :2] = np.where((joints.joints.a < 0)[:, None], joints.ends[:, :2], ends[:, :2])
    return np.asarray(ends[np.isfinite(ends).all(axis=1)])


def spot(centre: Pixel, radius: float, angle: float) -> Pixel:
    """Return the point on a circle at an angle given in world orientation (y up), px."""
    return centre[0] + radius * math.cos(angle), centre[1] - radius * math.sin(angle)


def arc(
    view: DrawContext, centre: Pixel, radius: float, first: float, span: float, colour: RgbColour, width: float
) -> None:
    """Draw an arc, with angles in world orientation (y up) and a dark outline."""
    low, half = min(first, first + span), min(0.5 * abs(span), math.pi)
    distance = arc_distance(*centre, radius, low + half, half)
    (x, y) = centre
    _draw_contour(view, distance, (x - radius, y - radius, x + radius, y + radius), colour, width)


def path(view: DrawContext, points: list[Pixel], colour: RgbColour, width: float) -> None:
    """Draw a polyline with a dark outline."""
    segments = [capsule_distance(a, b, 0.0) for a, b in pairwise(points)]
    columns, rows = zip(*points, strict=True)
    box = min(columns), min(rows), max(columns), max(rows)
    _draw_contour(
        view, lambda x, y: np.asarray(np.minimum.reduce([segment(x, y) for segment in segments])), box, colour, width
    )


def _draw_contour(
    view: DrawContext, distance: SignedDistance, box: tuple[float, float, float, float], colour: RgbColour, width: float
) -> None:
    """Draw the zero contour of a signed distance within a box (left, top, right, bottom), px."""
    half, halo = 0.5 * width * view.ui_scale, 1.2 * view.ui_scale
    margin = half + halo + 1.0
    outer = box[0] - margin, box[1] - margin, box[2] + margin, box[3] + margin
    area = clipped_box(outer, view.surface.get_clip())
    if area.width:
        look = ShapeStyle(colour, BACKGROUND, halo, antialias=view.antialias)
        draw_sdf(view.surface, lambda x, y: np.asarray(distance(x, y) - half - halo), look, area)


HINGE_RADIUS = 4.0
"""px, radius of the mark of a hinge"""
MAX_HINGE_FRACTION = 0.45
"""Largest radius of a hinge mark, as a fraction of the largest disc inscribed in its body."""
MIN_ARC_RADIUS, MAX_ARC_RADIUS = 14.0, 90.0
"""px, smallest and largest radius of the arcs of drives"""
ARC_CLEARANCE = 1.0
"""Distance of the arc beyond the centre of the body, as a fraction of the largest inscribed disc."""


def draw_hinges(view: DrawContext, discs: CircleRenderer) -> None:
    """Draw the hinges of driven bodies that are visible."""
    bodies = view.snapshot.bodies
    for mount, number, pixel in _visible_mounts(view):
        if not isinstance(mount.drive, PlungerDrive):
            size = min(
                HINGE_RADIUS * view.ui_scale, MAX_HINGE_FRACTION * float(bodies.core[number]) * view.camera.scale
            )
            for fraction, colour in ((1.0, BACKGROUND), (0.55, mix_colours(BACKGROUND, INK, 0.85))):
                tint = np.asarray([colour], np.uint8)
                style = CircleStyle(0.0, antialias=view.antialias)
                discs.draw(view.surface, np.asarray([pixel]), np.asarray([fraction * size]), tint, style)


def draw_stops(view: DrawContext) -> None:
    """Draw the stops of drives, the range between them, and a needle at the position of the body."""
    frame = view.snapshot.frame
    for mount, number, pixel in _visible_mounts(view):
        level = 0.0 if frame.drives is None else float(frame.drives[mount.number, 0])
        colour = mix_colours(SKY, ORANGE, level)
        drive = mount.drive
        if isinstance(drive, PlungerDrive):
            _draw_travel(view, drive, pixel, frame.position[number].tolist(), mount.home, colour)
            continue
        (x, y), (rest, end) = mount.hinge, drive.stops
        rest_angle = math.atan2(-y, -x) if x or y else 0.0  # direction from the hinge to the centre of the body
        length = (math.hypot(x, y) + ARC_CLEARANCE * float(view.snapshot.bodies.core[number])) * view.camera.scale
        size = min(max(length, MIN_ARC_RADIUS * view.ui_scale), MAX_ARC_RADIUS * view.ui_scale)
        arc(view, pixel, size, rest_angle + rest, max(min(end - rest, math.tau), -math.tau), INK, 1.4)
        for stop in (rest, end):
            path(
                view,
                [spot(pixel, 0.92 * size, rest_angle + stop), spot(pixel, 1.08 * size, rest_angle + stop)],
                INK,
                1.4,
            )
        needle_angle = rest_angle + float(frame.angle[number])
        path(view, [spot(pixel, 0.25 * size, needle_angle), spot(pixel, 1.04 * size, needle_angle)], colour, 2.0)


def _draw_travel(
    view: DrawContext,
    drive: PlungerDrive,
    pixel: Pixel,
    position: list[float],
    rest: tuple[float, float],
    colour: RgbColour,
) -> None:
    """Draw the travel of a plunger as a line with end ticks, and a tick at its present position."""
    length = math.hypot(*drive.direction)
    ux, uy = drive.direction[0] / length, -drive.direction[1] / length  # y points down on the screen
    travel = drive.travel * view.camera.scale
    pulled = math.dist(position, rest) * view.camera.scale
    tick = 5.0 * view.ui_scale
    end_pixel = pixel[0] - travel * ux, pixel[1] - travel * uy
    path(view, [pixel, end_pixel], INK, 1.6)
    for (x, y), tone in ((pixel, INK), (end_pixel, INK), ((pixel[0] - pulled * ux, pixel[1] - pulled * uy), colour)):
        path(view, [(x - tick * uy, y + tick * ux), (x + tick * uy, y - tick * ux)], tone, 2.2)


def _visible_mounts(view: DrawContext) -> Iterator[tuple[Mount, int, Pixel]]:
    """Yield the mount, the index and the hinge or stop position (px) of each visible driven body."""
    names = view.snapshot.bodies.names
    numbers = {names[number]: number for number in view.shown.tolist()}
    for name, mount in mounts(view.snapshot.scene).items():
        if name in numbers:
            drive = mount.drive
            position = mount.home if isinstance(drive, PlungerDrive) else drive.pivot
            x, y = view.camera.to_screen(np.asarray(position)).tolist()
            yield mount, numbers[name], (x, y)
