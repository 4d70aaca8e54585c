"""Overlays in drawing order: below the bodies trails, flames and joints; above them annotations and vectors."""

import math
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.geometry.vectors import rotate
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.annotations import (
    draw_boxes,
    draw_centres,
    draw_flashes,
    draw_names,
    draw_picked,
    draw_pull,
    draw_verdicts,
)
from sandbox.window.render.circles import CircleRenderer, draw_disc
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.joints import draw_hinges, draw_joint_symbols, draw_joints, draw_stops, joint_segments
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, draw_dashes, draw_line
from sandbox.window.render.moving_surfaces import draw_moving_surfaces
from sandbox.window.render.palette import (
    BACKGROUND,
    FAINT,
    INK,
    ORANGE,
    SKY,
    SURFACE,
    YELLOW,
    ColourArray,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.particles import ParticleRenderer, packed_pixels
from sandbox.window.render.polygons import PolygonRenderer
from sandbox.window.render.static_geometry import draw_passing_arrows
from sandbox.window.render.vectors import draw_contacts, draw_impulses, draw_velocities

FLAME_OUTLINE = ((0.0, -0.13), (0.12, -0.19), (0.3, -0.17), (0.6, -0.09), (1.0, 0.0))
"""One side of a flame outline: along and across, as fractions of its length."""
INNER_FLAME = 0.55
"""Size of the inner flame as a fraction of the outer."""
MIN_FLAME = 2.0
"""px, length of the shortest flame that is drawn"""


TYRE_LENGTH, TYRE_WIDTH = 0.4, 0.2
"""Size of a tyre, in bounding radii of its body"""


def draw_tyres(view: DrawContext) -> None:
    """Draw the tyres that have a rolling direction, turned by their steering."""
    snapshot, camera = view.snapshot, view.camera
    frame, bodies = snapshot.frame, snapshot.bodies
    for k, tyre in enumerate(snapshot.scene.tyres):
        number = bodies.number_of.get(tyre.body)
        if tyre.rolling_drag >= tyre.grip or number is None or not frame.present[number]:
            continue
        angle, (x, y) = float(frame.angle[number]), frame.position[number].tolist()
        if not math.isfinite(x + y + angle):
            continue
        cx, cy = geometry_of(bodies.elements[bodies.element[number]]).centre
        px, py = rotate(tyre.point[0] - cx, tyre.point[1] - cy, math.cos(angle), math.sin(angle))
        heading = angle + tyre.angle + tyre.steer * snapshot.steering.get(tyre.name or default_name("tyre", k), 0.0)
        cos, sin, radius = math.cos(heading), math.sin(heading), float(bodies.radius[number])
        a, b = 0.5 * TYRE_LENGTH * radius, 0.5 * TYRE_WIDTH * radius
        corners = [rotate(dx, dy, cos, sin) for dx, dy in ((a, b), (-a, b), (-a, -b), (a, -b))]
        pixels = camera.to_screen(np.add(corners, (x + px, y + py))).tolist()
        if max(abs(each) for pixel in pixels for each in pixel) < SDL_COORDINATE_LIMIT:
            pygame.draw.polygon(view.surface, BACKGROUND, pixels)
            for begin, end in zip(pixels, (*pixels[1:], pixels[0]), strict=True):
                draw_line(view.surface, begin, end, FAINT, view.ui_scale)


def draw_flames(view: DrawContext) -> None:
    """Draw all thruster flames; the bodies are drawn over their roots."""
    frame, camera = view.snapshot.frame, view.camera
    for number, point, direction in view.snapshot.flames:
        if number >= len(frame.position) or not frame.present[number]:
            continue
        angle, (x, y) = float(frame.angle[number]), frame.position[number].tolist()
        if not math.isfinite(x + y + angle):
            continue
        sine, cosine = math.sin(angle), math.cos(angle)
        root = x + point[0] * cosine - point[1] * sine, y + point[0] * sine + point[1] * cosine
        out = direction[0] * cosine - direction[1] * sine, direction[0] * sine + direction[1] * cosine
        begin, end = camera.to_screen(np.array((root, (root[0] + out[0], root[1] + out[1])))).tolist()
        along = end[0] - begin[0], end[1] - begin[1]
        if math.hypot(*along) >= MIN_FLAME and max(map(abs, (*begin, *end))) < SDL_COORDINATE_LIMIT:
            _draw_flame(view, begin, along, 1.0, ORANGE)
            _draw_flame(view, begin, along, INNER_FLAME, YELLOW)


def _draw_flame(
    view: DrawContext, begin: list[float], along: tuple[float, float], size: float, colour: RgbColour
) -> None:
    (x, y), (dx, dy) = begin, along
    sides = [*FLAME_OUTLINE, *((fraction, -across) for fraction, across in reversed(FLAME_OUTLINE[:-1]))]
    points = [(x + size * (a * dx - b * dy), y + size * (a * dy + b * dx)) for a, b in sides]
    pygame.draw.polygon(view.surface, colour, points)
    if view.antialias:
        pygame.draw.aalines(view.surface, colour, True, points)


MAX_TRAIL_LINES = 300
"""Number of bodies up to which trails are drawn as lines."""
MAX_TRAIL_POINTS = 96
"""Largest number of points of a trail that is drawn as a line."""
TRAIL_SHADES = 8
"""Steps in which a trail fades."""
MAX_DRAWN_POINTS = 200_000


def draw_trails(view: DrawContext, points: ParticleRenderer) -> None:
    """Draw the trails of the visible bodies, fading with age."""
    if not len(view.shown) or sum(len(piece) for piece in view.snapshot.trails) < 2:
        return
    crowd = len(view.shown) > MAX_TRAIL_LINES
    some = view.first(MAX_DRAWN_POINTS // 16)
    positions = _join_trails(
        view.snapshot.trails, some.shown, max(MAX_DRAWN_POINTS // len(some.shown), 1) if crowd else MAX_TRAIL_POINTS
    )
    shades = np.linspace(0.15, 0.85, TRAIL_SHADES)
    tints = [np.rint(np.asarray(BACKGROUND) * (1 - s) + some.colours * s).astype(np.uint8) for s in shades]
    bounds = np.linspace(0, len(positions), TRAIL_SHADES + 1).astype(int).tolist()
    for shade, (first, last) in enumerate(pairwise(bounds)):
        if crowd:
            tones = np.tile(packed_pixels(tints[shade], view.surface), last - first)
            points.draw(view.surface, view.camera, positions[first:last].reshape(-1, 2), tones)
        elif last > first:
            _draw_trail_lines(view, positions[first : last + 1], tints[shade])


def _join_trails(pieces: tuple[FloatArray, ...], shown: IntArray, max_points: int) -> FloatArray:
    """Return trail points of bodies, (T, K, 2) m, thinned to about `most`; nan for bodies that a piece lacks."""
    total = sum(len(piece) for piece in pieces)
    every = -(-total // max_points)
    rows = []
    skip = (total - 1) % every  # keeps the newest point
    for piece in pieces:
        thinned = piece[skip::every]
        skip = (skip - len(piece)) % every
        has_body = shown < piece.shape[1]
        row = np.full((len(thinned), len(shown), 2), np.nan)
        row[:, has_body] = thinned[:, shown[has_body]]
        rows.append(row)
    return np.concatenate(rows)


def _draw_trail_lines(view: DrawContext, positions: FloatArray, tints: ColourArray) -> None:
    """Draw one shade of all trails, with a gap where a body was absent or far outside the surface."""
    if len(positions) < 2:
        return
    width, height = view.camera.size
    with np.errstate(invalid="ignore", over="ignore"):
        pixels = view.camera.to_screen(positions) - 0.5
        x, y = pixels[..., 0], pixels[..., 1]
        is_near = (np.abs(x - width / 2) < 4 * width + 100) & (np.abs(y - height / 2) < 4 * height + 100)
    draw = pygame.draw.aalines if view.antialias and len(tints) <= MAX_TRAIL_LINES // 4 else pygame.draw.lines
    is_complete = np.asarray(is_near.all(axis=0), np.bool_)
    for k, (tint, trail) in enumerate(zip(tints.tolist(), pixels.transpose(1, 0, 2).tolist(), strict=True)):
        if is_complete[k]:
            draw(view.surface, tint, False, trail)
            continue
        is_drawn = is_near[:, k]
        changes = np.concatenate(([0], np.flatnonzero(np.diff(is_drawn)) + 1, [len(is_drawn)])).tolist()
        for first, last in pairwise(changes):
            if is_drawn[first] and last - first > 1:
                draw(view.surface, tint, False, trail[first:last])


BODY_OVERLAYS = frozenset({"velocities", "bounds", "centres", "names", "trails"})
"""Overlays that need the indices of the visible bodies."""
MIN_GHOST_DISTANCE = 3.0
"""px between a body and its ghost above which a line connects them"""
MAX_GHOSTS = 4000


class OverlayRenderer:
    """Draws the overlays of a frame, those below the bodies and those above."""

    def __init__(self, discs: CircleRenderer, points: ParticleRenderer, polygons: PolygonRenderer) -> None:
        self._discs = discs
        self._points = points
        self._polygons = polygons

    def need_bodies(self, snapshot: Snapshot) -> bool:
        """Return whether an overlay needs all visible bodies, including those drawn as points."""
        return not BODY_OVERLAYS.isdisjoint(snapshot.overlays) or snapshot.overlapping is not None

    def below(self, view: DrawContext) -> None:
        """Draw the overlays below the bodies."""
        if "trails" in view.snapshot.overlays:
            draw_trails(view, self._points)
        if "shapes" in view.snapshot.overlays and view.snapshot.flames:
            draw_flames(view)
        if "shapes" in view.snapshot.overlays and len(view.snapshot.joints):
            draw_joints(view, joint_segments(view), self._discs)

    def above(self, view: DrawContext) -> None:
        """Draw the overlays above the bodies."""
        overlays, drives = view.snapshot.overlays, view.snapshot.scene.drives
        if drives and "shapes" in overlays:
            draw_hinges(view, self._discs)
        if "shapes" in overlays:
            draw_moving_surfaces(view)
            draw_tyres(view)
            _draw_one_way_bodies(view)
        if view.snapshot.ghost is not None:
            self._draw_ghost(view)
        if "bounds" in overlays:
            draw_boxes(view, self._polygons)
        if "joints" in overlays and len(view.snapshot.joints):
            draw_joint_symbols(view, joint_segments(view), self._discs)
        if drives and "joints" in overlays:
            draw_stops(view)
        if "joints" in overlays:
            _draw_paths(view)
        if "centres" in overlays:
            draw_centres(view)
        if view.snapshot.overlapping is not None:
            draw_verdicts(view)
        if "velocities" in overlays:
            draw_velocities(view)
        if "impulses" in overlays:
            draw_impulses(view)
        if "contacts" in overlays:
            draw_contacts(view, self._discs)
        if view.snapshot.flashes:
            draw_flashes(view)
        if view.snapshot.picked is not None:
            draw_picked(view, self._discs, self._polygons)
        if view.snapshot.pull is not None:
            draw_pull(view, self._discs)
        if "names" in overlays:
            draw_names(view, self._polygons)

    def _draw_ghost(self, view: DrawContext) -> None:
        """Draw the bodies of the ghost engine hollow, each connected to its counterpart where they differ."""
        ghost, frame, camera = view.snapshot.ghost, view.snapshot.frame, view.camera
        assert ghost is not None
        count = min(len(ghost.position), len(frame.position), len(view.snapshot.bodies))
        position, radius = ghost.position[:count], view.snapshot.bodies.radius[:count]
        with np.errstate(invalid="ignore", over="ignore"):
            visible = camera.in_sight(position, radius) & ghost.present[:count]
        ghosts = np.flatnonzero(visible & ~view.snapshot.bodies.fixed[:count])  # static bodies never differ
        if len(ghosts) > MAX_GHOSTS:
            ghosts = ghosts[np.linspace(0, len(ghosts) - 1, MAX_GHOSTS).astype(np.intp)]
        if not len(ghosts):
            return
        with np.errstate(invalid="ignore", over="ignore"):  # the body itself may be at nan or inf
            centre, own = camera.to_screen(position[ghosts]), camera.to_screen(frame.position[ghosts])
        tint = np.broadcast_to(np.asarray(INK, np.uint8), (len(ghosts), 3))
        style = view.style(1.5)._replace(hollow=True)
        size, bodies = radius[ghosts] * camera.scale, view.snapshot.bodies
        is_disc = bodies.round[ghosts] | (size < 2.0 * view.ui_scale)
        self._discs.draw(
            view.surface, centre[is_disc], np.maximum(size[is_disc], 2.0 * view.ui_scale), tint[is_disc], style
        )
        indices, angle = ghosts[~is_disc], ghost.angle[ghosts[~is_disc]]
        self._polygons.draw(view.surface, bodies, indices, centre[~is_disc], angle, camera.scale, tint[~is_disc], style)
        with np.errstate(invalid="ignore", over="ignore"):
            gap = np.hypot(*(centre - own).T)
        for k in np.flatnonzero((gap > MIN_GHOST_DISTANCE * view.ui_scale) & frame.present[ghosts]).tolist():
            (ax, ay), (bx, by) = own[k].tolist(), centre[k].tolist()
            draw_line(
                view.surface, (ax, ay), (bx, by), mix_colours(FAINT, INK, 0.3), 1.0 * view.ui_scale, view.antialias
            )


def _draw_paths(view: DrawContext) -> None:
    """Draw the course of the centre of each body that has a path: a dotted line with a disc at each point."""
    surface, unit, colour = view.surface, view.ui_scale, mix_colours(SKY, BACKGROUND, 0.25)
    for motion in view.snapshot.bodies.paths.values():
        course = view.pixels(motion.course())
        draw_dashes(surface, pairwise(course), colour, 2.5 * unit, view.antialias)
        for pixel in view.pixels(motion.stops()):
            draw_disc(surface, pixel, 3.0 * unit, colour)


def _draw_one_way_bodies(view: DrawContext) -> None:
    """Draw small arrows on the side from which one-way bodies are solid, in the direction in which others pass them."""
    frame, bodies = view.snapshot.frame, view.snapshot.bodies
    shown = {*view.shown.tolist()} if bodies.one_way else set()
    for index, (x, y) in bodies.one_way.items():
        if index not in shown:
            continue
        begin, end = np.searchsorted(bodies.shapes.body, (index, index + 1)).tolist()
        corner = bodies.shapes.corner[bodies.shapes.first[begin] : bodies.shapes.first[end]]
        radius = np.repeat(bodies.shapes.radius[begin:end], bodies.shapes.corners[begin:end])
        top, along = float((corner @ (x, y) + radius).max()), corner @ (y, -x)
        angle, position = float(frame.angle[index]), frame.position[index].tolist()
        ends = []
        for side in (float((along - radius).min()), float((along + radius).max())):
            dx, dy = rotate(side * y + top * x, -side * x + top * y, math.cos(angle), math.sin(angle))
            ends.append((position[0] + dx, position[1] + dy))
        a, b = view.pixels(ends)
        draw_passing_arrows(view, a, b, 0.0, mix_colours(SURFACE, INK, 0.6))
