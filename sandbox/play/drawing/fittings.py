"""Fittings: the overlay of joints, each kind in its own way: where it holds, how far it lets go, what it drives."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.play.drawing.anatomy import clipped_box
from sandbox.play.drawing.discs import Discs, Style
from sandbox.play.drawing.joints import SHADES, Held, strain
from sandbox.play.drawing.outlines import outline_distance
from sandbox.play.drawing.palette import BACKGROUND, GREEN, INK, ORANGE, SKY, YELLOW, Colour, mixed
from sandbox.play.drawing.points import packed
from sandbox.play.drawing.shade import Look, paint
from sandbox.play.drawing.strokes import Pixel, arrow, dashes, stroke
from sandbox.play.drawing.threads import draw_threads
from sandbox.play.drawing.view import View
from sandbox.scene.compile.joint_arrays import LinkKind

MOST = 600
"""Joints of one kind that are drawn each in its way; of more, only lines from body to body."""
MOST_DIALS = 60
"""Of what turns, as their arcs take longer."""
SMALL, LARGE = 12.0, 34.0
"""px: radii of the arcs of what turns"""
_TINTS: dict[LinkKind, Colour] = {
    LinkKind.ROD: INK,
    LinkKind.PIVOT: YELLOW,
    LinkKind.SLIDE: SKY,
    LinkKind.GROOVE: SKY,
    LinkKind.ROTARY_LIMIT: GREEN,
    LinkKind.MOTOR: ORANGE,
    LinkKind.GEAR: INK,
    LinkKind.SPRING: INK,
    LinkKind.ROTARY_SPRING: SKY,
}


class Dial(NamedTuple):
    """Where and how a joint that turns is drawn."""

    place: Pixel
    size: float
    """px, its radius"""
    base: float
    """rad, the angle of the first body"""
    turned: float
    """rad, that of the second from there"""
    figures: tuple[float, float, float]
    """of the link"""


def draw_fittings(view: View, joints: Held, discs: Discs) -> None:
    """Draw all joints about the picture."""
    ways: dict[LinkKind, Callable[[View, Held], None]] = {
        LinkKind.ROD: _rods,
        LinkKind.GEAR: _gears,
        LinkKind.SLIDE: _slides,
        LinkKind.GROOVE: _grooves,
        LinkKind.ROTARY_LIMIT: _limits,
        LinkKind.ROTARY_SPRING: _turning_springs,
        LinkKind.MOTOR: _motors,
    }
    for kind in (*ways, LinkKind.SPRING, LinkKind.PIVOT):
        some = joints.of(kind)
        if len(some.links) > MOST:
            tint = np.broadcast_to(np.asarray(mixed(BACKGROUND, _TINTS[kind], 0.7), np.uint8), (len(some.links), 3))
            if kind is LinkKind.SPRING:
                tint = SHADES[strain(some, view.camera.scale)]
            draw_threads(view.surface, some.ends, packed(tint, view.surface), view.antialias)
        elif len(some.links) and kind in ways:
            ways[kind](view, some)
        if kind in (LinkKind.ROD, LinkKind.SLIDE, LinkKind.SPRING) and 0 < len(some.links) <= MOST:
            _dots(view, np.vstack((some.ends[:, :2], some.ends[:, 2:])), 2.6, _TINTS[kind], discs)
        if kind in (LinkKind.PIVOT, LinkKind.GROOVE) and 0 < len(some.links) <= MOST:
            _rings(view, some.ends[:, 2:], _TINTS[kind], discs)


def _dots(view: View, places: FloatArray, size: float, colour: Colour, discs: Discs) -> None:
    kept = view.inside(places, 10.0 * view.unit)
    for wide, tone in ((size + 1.2, BACKGROUND), (size, colour)):
        radius = np.full(len(kept), wide * view.unit)
        tint = np.broadcast_to(np.asarray(tone, np.uint8), (len(kept), 3))
        discs.draw(view.surface, places[kept], radius, tint, Style(0.0, antialias=view.antialias))


def _rings(view: View, places: FloatArray, colour: Colour, discs: Discs) -> None:
    """Draw what lets turn: a ring on a dark ground."""
    _dots(view, places, 5.0, BACKGROUND, discs)
    kept = view.inside(places, 10.0 * view.unit)
    radius = np.full(len(kept), 5.0 * view.unit)
    tint = np.broadcast_to(np.asarray(colour, np.uint8), (len(kept), 3))
    style = Style(1.8 * view.unit, hollow=True, antialias=view.antialias)
    discs.draw(view.surface, places[kept], radius, tint, style)


def _rods(view: View, rods: Held) -> None:
    for ax, ay, bx, by in rods.ends.tolist():
        stroke(view.surface, (ax, ay), (bx, by), INK, 1.4 * view.unit, view.antialias)


def _gears(view: View, gears: Held) -> None:
    rows = _from_bodies(view, gears)
    dashes(view.surface, [((ax, ay), (bx, by)) for ax, ay, bx, by in rows.tolist()], INK, 2.0 * view.unit)
    places = rows[:, 2:]
    for x, y in places[view.inside(places, 2.0 * LARGE)][:MOST_DIALS].tolist():
        arc(view, (x, y), 0.7 * SMALL * view.unit, 0.0, math.tau, INK, 1.2)


def _slides(view: View, slides: Held) -> None:
    """Draw strings dashed; a tick at each end lies across, both bright where the string is taut."""
    scale, unit = view.camera.scale, view.unit
    rows = zip(slides.ends.tolist(), slides.links.figures.tolist(), slides.length.tolist(), strict=True)
    for (ax, ay, bx, by), (least, most, _), length in rows:
        taut = length >= 0.998 * most * scale or length <= 1.002 * least * scale
        colour = INK if taut else SKY
        dashes(view.surface, [((ax, ay), (bx, by))], colour, 6.0 * unit, view.antialias)
        if length > 0.0:
            x, y = -(by - ay) / length * 6.0 * unit, (bx - ax) / length * 6.0 * unit
            for px, py in ((ax, ay), (bx, by)):
                stroke(view.surface, (px - x, py - y), (px + x, py + y), colour, 1.6 * unit, view.antialias)


def _grooves(view: View, grooves: Held) -> None:
    """Draw tracks: two lines and their round ends."""
    links, frame = grooves.links, view.sight.frame
    angle = np.where(links.a < 0, 0.0, frame.angle[links.a])
    place = np.where((links.a < 0)[:, None], 0.0, frame.position[links.a])
    (x, y, _), cos, sin = links.figures.T, np.cos(angle), np.sin(angle)
    with np.errstate(invalid="ignore", over="ignore"):
        far = view.camera.to_screen(place + np.column_stack((cos * x - sin * y, sin * x + cos * y)))
    half = 5.0 * view.unit
    for (ax, ay, *_), (bx, by) in zip(grooves.ends.tolist(), far.tolist(), strict=True):
        length = math.hypot(bx - ax, by - ay)
        if not 0.0 < length < 30_000.0 or max(abs(ax), abs(ay)) > 30_000.0:
            continue
        ux, uy = (bx - ax) / length, (by - ay) / length
        for side in (-half, half):
            shift = -uy * side, ux * side
            start, end = (ax + shift[0], ay + shift[1]), (bx + shift[0], by + shift[1])
            stroke(view.surface, start, end, SKY, 1.4 * view.unit, view.antialias)
        turned = math.atan2(-uy, ux)
        arc(view, (ax, ay), half, turned + 0.5 * math.pi, math.pi, SKY, 1.4)
        arc(view, (bx, by), half, turned - 0.5 * math.pi, math.pi, SKY, 1.4)


def _limits(view: View, limits: Held) -> None:
    """Draw the arc within which the second body may turn, and a hand that shows where it is."""
    for (x, y), size, base, turned, (least, most, _) in _dials(view, limits):
        first, span = base + least, min(max(most - least, 0.0), math.tau)
        arc(view, (x, y), size, first, span, INK, 2.0)
        for stop in (first, first + span):
            inner, outer = spot((x, y), 0.8 * size, stop), spot((x, y), 1.2 * size, stop)
            path(view, [inner, outer], INK, 2.0)
        tip, foot = spot((x, y), 1.1 * size, base + turned), spot((x, y), 0.45 * size, base + turned)
        path(view, [foot, tip], YELLOW, 2.0)


def _turning_springs(view: View, springs: Held) -> None:
    """Draw a spiral that winds up as the spring does."""
    for (x, y), size, base, turned, (rest, _, _) in _dials(view, springs):
        strained = max(min(turned - rest, 2.0 * math.tau), -2.0 * math.tau)
        wound = 1.5 * math.tau + strained
        colour = tuple(SHADES[round(32.0 + 32.0 * strained / (abs(strained) + 0.5))].tolist())
        count = 28
        spots = [
            spot((x, y), size * (0.25 + 0.75 * k / count), base + turned - wound * (1.0 - k / count))
            for k in range(count + 1)
        ]
        path(view, spots, (colour[0], colour[1], colour[2]), 1.4)


def _motors(view: View, motors: Held) -> None:
    """Draw three quarters of a circle, with an arrow the way it drives."""
    for (x, y), size, base, _, (rate, _, _) in _dials(view, motors):
        way = 1.0 if rate >= 0.0 else -1.0
        first, span = base - way * 0.75 * math.pi, way * 1.35 * math.pi
        arc(view, (x, y), 1.15 * size, first, span, INK, 2.2)
        last = first + span
        neck, tip = spot((x, y), 1.15 * size, last - way * 0.15), spot((x, y), 1.15 * size, last + way * 0.35)
        arrow(view.surface, neck, tip, INK, 2.2 * view.unit, view.antialias, BACKGROUND)


def _dials(view: View, joints: Held) -> list[Dial]:
    """Return where joints that turn are drawn: where a pivot holds the same two, else in the second body's middle."""
    frame, bodies, links = view.sight.frame, view.sight.bodies, joints.links
    every, pivots = view.sight.links, {}
    for k in np.flatnonzero(every.kind == LinkKind.PIVOT).tolist():
        pivots[int(every.a[k]), int(every.b[k])] = k
    _, hinge = every.ends(frame.position, frame.angle)
    found = []
    rows = zip(links.a.tolist(), links.b.tolist(), links.figures.tolist(), strict=True)
    for a, b, figures in list(rows)[:MOST_DIALS]:
        own = pivots.get((a, b), pivots.get((b, a)))
        place = frame.position[b] if own is None else hinge[own]
        x, y = view.camera.to_screen(place).tolist()
        base = 0.0 if a < 0 else float(frame.angle[a])
        turned = float(frame.angle[b]) - base
        if max(abs(x), abs(y)) < 30_000.0 and math.isfinite(base) and math.isfinite(turned):
            room = float(bodies.core[b]) * view.camera.scale
            size = min(max(0.6 * room, SMALL * view.unit), LARGE * view.unit)
            found.append(Dial((x, y), size, base, turned, (figures[0], figures[1], figures[2])))
    return found


def _from_bodies(view: View, joints: Held) -> FloatArray:
    """Return the centres of the bodies that joints hold, (J, 4) px; of the world, the place where it is held."""
    first = np.where((joints.links.a < 0)[:, None], 0.0, view.sight.frame.position[joints.links.a])
    ends = np.hstack((view.camera.to_screen(first), view.camera.to_screen(view.sight.frame.position[joints.links.b])))
    ends[:, :2] = np.where((joints.links.a < 0)[:, None], joints.ends[:, :2], ends[:, :2])
    return np.asarray(ends[np.isfinite(ends).all(axis=1)])


def spot(centre: Pixel, radius: float, angle: float) -> Pixel:
    """Return the place on a circle at an angle that counts as in the world, px."""
    return centre[0] + radius * math.cos(angle), centre[1] - radius * math.sin(angle)


def arc(view: View, centre: Pixel, radius: float, first: float, span: float, colour: Colour, width: float) -> None:
    """Draw part of a circle, counted as in the world, with a dark edge that sets it off."""
    low, half = min(first, first + span), min(0.5 * abs(span), math.pi)
    middle = low + half
    row = [1.0, *centre, radius, math.cos(middle), -math.sin(middle), math.cos(half)]
    tips = [[0.0, *tip, *tip, 0.0, 0.0] for tip in (spot(centre, radius, low), spot(centre, radius, low + 2 * half))]
    _traced(view, np.asarray([row, *tips]), colour, width)


def path(view: View, spots: list[Pixel], colour: Colour, width: float) -> None:
    """Draw a line through places, with a dark edge."""
    rows = [[0.0, *a, *b, 0.0, 0.0] for a, b in pairwise(spots)]
    _traced(view, np.asarray(rows), colour, width)


def _traced(view: View, edge: FloatArray, colour: Colour, width: float) -> None:
    """Draw a line along an outline in px."""
    half, halo = 0.5 * width * view.unit, 1.2 * view.unit
    distance = outline_distance(edge)
    reach = edge[:, 3].max() if edge[0, 0] == 1.0 else 0.0
    spots = np.vstack((edge[:, 1:3], edge[edge[:, 0] == 0.0, 3:5]))  # of straight lines both ends
    low, high = spots.min(axis=0) - reach, spots.max(axis=0) + reach
    margin = half + halo + 1.0
    box = float(low[0] - margin), float(low[1] - margin), float(high[0] + margin), float(high[1] + margin)
    within = clipped_box(box, view.surface.get_clip())
    if within.width:
        look = Look(colour, BACKGROUND, halo, antialias=view.antialias)
        paint(view.surface, lambda x, y: np.asarray(distance(x, y) - half - halo), look, within)
