"""Overlays that annotate single bodies: bounding boxes, centres, names, selection, mouse spring, missed contacts."""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pygame

from sandbox.window.render.body_geometry import ScreenPose
from sandbox.window.render.circles import CircleRenderer, CircleStyle
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, draw_line
from sandbox.window.render.palette import BACKGROUND, FAINT, INK, WARNING, YELLOW
from sandbox.window.render.polygons import PolygonRenderer
from sandbox.window.render.sdf import ShapeStyle, disc_distance, draw_sdf
from sandbox.window.render.text import draw_text, text_size

MAX_NAMES, MAX_BOXES, MAX_CENTRES, MAX_FLASHES = 60, 1000, 4000, 24
FLASH_DURATION = 1.5
"""s, time for which a missed contact is shown"""


def draw_boxes(view: DrawContext, polygons: PolygonRenderer) -> None:
    """Draw the bounding box of each body."""
    some = view.first(MAX_BOXES)
    is_disc = some.snapshot.bodies.round[some.shown]
    if not is_disc.all():
        for left, top, right, bottom in polygons.boxes(some)[~is_disc].tolist():
            if max(abs(left), abs(top), abs(right), abs(bottom)) < SDL_COORDINATE_LIMIT:
                box = pygame.Rect(math.floor(left), math.floor(top), math.ceil(right - left), math.ceil(bottom - top))
                pygame.draw.rect(view.surface, FAINT, box, max(1, round(view.ui_scale)))
    for (x, y), radius in zip(some.centre[is_disc].tolist(), some.radius[is_disc].tolist(), strict=True):
        if 2.0 * radius < SDL_COORDINATE_LIMIT:
            side = math.ceil(2.0 * radius)
            box = pygame.Rect(math.floor(x - radius), math.floor(y - radius), side, side)
            pygame.draw.rect(view.surface, FAINT, box, max(1, round(view.ui_scale)))


def draw_centres(view: DrawContext) -> None:
    """Draw each centre of mass as a quartered circle; on small bodies as a dot."""
    some = view.first(MAX_CENTRES)
    size = 5.0 * view.ui_scale
    mark = _quartered(size)
    half = mark.get_width() / 2.0
    quartered, dots = [], []
    for (x, y), radius in zip(some.centre.tolist(), some.radius.tolist(), strict=True):
        if abs(x) > SDL_COORDINATE_LIMIT or abs(y) > SDL_COORDINATE_LIMIT:
            continue
        if radius >= 1.6 * size:
            quartered.append((mark, (round(x - half), round(y - half))))
        else:
            dots.append((math.floor(x - 0.5), math.floor(y - 0.5)))
    view.surface.blits(quartered, False)
    for x, y in dots:
        view.surface.fill(INK, (x, y, 2, 2))


@lru_cache(maxsize=8)
def _quartered(size: float) -> pygame.Surface:
    """Return the sprite that marks a centre of mass."""
    side = 2 * math.ceil(size) + 2
    mark = pygame.Surface((side, side), pygame.SRCALPHA)
    middle = side / 2.0
    paint_on = disc_distance(middle, middle, size)
    draw_sdf(mark, paint_on, ShapeStyle(BACKGROUND, INK, 1.0))
    for column in (0, 1):
        quarter = pygame.Rect(column * side // 2, column * side // 2, side // 2, side // 2)
        draw_sdf(mark, paint_on, ShapeStyle(INK, INK, 0.0), quarter)
    return mark


def draw_names(view: DrawContext, polygons: PolygonRenderer) -> None:
    """Draw the names of bodies above them; names that would overlap an earlier one are skipped."""
    taken: list[pygame.Rect] = []
    size = 12 * view.ui_scale
    some = view.first(4 * MAX_NAMES)
    area = view.surface.get_rect()
    bodies = some.snapshot.bodies
    is_disc = bodies.round[some.shown]
    tops = some.centre[:, 1] - some.radius if is_disc.all() else polygons.boxes(some)[:, 1]
    radii = bodies.core[some.shown] * some.camera.scale
    rows = zip(some.shown.tolist(), some.centre.tolist(), tops.tolist(), radii.tolist(), strict=True)
    for number, (x, y), top, radius in rows:
        name = view.snapshot.bodies.names[number]
        name = name if len(name) <= 24 else name[:23] + "…"
        width, height = text_size(name, size)
        bottom = top - 3.0 * view.ui_scale
        if not (abs(x) < SDL_COORDINATE_LIMIT and abs(bottom) < SDL_COORDINATE_LIMIT):
            continue
        rect = pygame.Rect(round(x - width / 2), round(bottom - height), width, height)
        if rect.top < 0 or radius > 3 * height:
            rect.center = round(x), round(y + 0.45 * min(radius, 1e4))
        if area.contains(rect) and rect.collidelist(taken) < 0 and len(taken) < MAX_NAMES:
            taken.append(rect.inflate(6, 2))
            draw_text(view.surface, name, (rect.centerx + 1, rect.centery + 1), size, BACKGROUND, "center")
            draw_text(view.surface, name, rect.center, size, INK, "center")


def draw_verdicts(view: DrawContext) -> None:
    """Write on each body whether it overlaps another, so that the state is not shown by colour alone."""
    overlapping = view.snapshot.overlapping
    assert overlapping is not None
    some = view.first(MAX_NAMES)
    radii = some.snapshot.bodies.core[some.shown] * some.camera.scale
    for number, (x, y), radius in zip(some.shown.tolist(), some.centre.tolist(), radii.tolist(), strict=True):
        touching = number < len(overlapping) and bool(overlapping[number])
        word, size = (
            "overlap" if touching else "clear",
            min(max(0.28 * radius, 11.0 * view.ui_scale), 26.0 * view.ui_scale),
        )
        text_y = y - 0.4 * radius  # above the centre mark and the name
        if text_size(word, size, bold=True)[0] > 1.6 * radius:
            text_y = y
            word, size = "!", min(max(1.2 * radius, 9.0 * view.ui_scale), 20.0 * view.ui_scale)
            if not touching:
                continue
        draw_text(view.surface, word, (x, text_y), size, INK, "center", bold=True)


def draw_flashes(view: DrawContext) -> None:
    """Draw a ring that expands and fades at each recently missed contact."""
    for flash in view.snapshot.flashes[-MAX_FLASHES:]:
        fraction = flash.age / FLASH_DURATION
        with np.errstate(invalid="ignore", over="ignore"):
            x, y = view.camera.to_screen(np.asarray(flash.position)).tolist()
        if not (0.0 <= fraction < 1.0 and abs(x) < SDL_COORDINATE_LIMIT and abs(y) < SDL_COORDINATE_LIMIT):
            continue
        radius = (8.0 + 40.0 * math.sqrt(fraction)) * view.ui_scale
        style = ShapeStyle(None, WARNING, 3.0 * view.ui_scale, opacity=1.0 - fraction, antialias=view.antialias)
        side = 2 * math.ceil(radius + 1.0)
        rect = pygame.Rect(round(x) - side // 2, round(y) - side // 2, side, side)
        draw_sdf(view.surface, disc_distance(x, y, radius), style, rect)


def draw_picked(view: DrawContext, discs: CircleRenderer, polygons: PolygonRenderer) -> None:
    """Draw a highlight around the selected body."""
    number, frame = view.snapshot.picked, view.snapshot.frame
    if number is None or not 0 <= number < min(len(frame.position), len(view.snapshot.bodies)):
        return
    radius = float(view.snapshot.bodies.radius[number])
    with np.errstate(invalid="ignore", over="ignore"):
        position = frame.position[number : number + 1]
        if not frame.present[number] or not view.camera.in_sight(position, radius)[0]:
            return
    (x, y), size = (
        view.camera.to_screen(position)[0].tolist(),
        max(radius * view.camera.scale, 2.0) + 4.0 * view.ui_scale,
    )
    angle = float(frame.angle[number])
    if not view.snapshot.bodies.round[number] and size > 8.0 * view.ui_scale and math.isfinite(angle):
        pose = ScreenPose(x, y, angle, view.camera.scale)
        polygons.ring(
            view.surface, view.snapshot.bodies, number, pose, 4.0 * view.ui_scale, YELLOW, 2.0 * view.ui_scale
        )
        return
    discs.ring(view.surface, (x, y), size, YELLOW, CircleStyle(2.0 * view.ui_scale, antialias=view.antialias))


def draw_pull(view: DrawContext, discs: CircleRenderer) -> None:
    """Draw the mouse spring between its anchor on the body and the pointer."""
    if view.snapshot.pull is None:
        return
    with np.errstate(invalid="ignore", over="ignore"):
        (ax, ay), (bx, by) = view.camera.to_screen(np.asarray(view.snapshot.pull)).tolist()
        length = math.hypot(bx - ax, by - ay)
    if not length < SDL_COORDINATE_LIMIT or not (abs(ax) < SDL_COORDINATE_LIMIT and abs(ay) < SDL_COORDINATE_LIMIT):
        return
    ui_scale = view.ui_scale
    if length > 30.0 * ui_scale:
        ux, uy = (bx - ax) / length, (by - ay) / length
        half_windings = 12
        width = min(8.0 * ui_scale, 1200.0 * ui_scale * ui_scale / length)
        straight_fraction = 0.12
        points = [(ax, ay)]
        for k in range(half_windings + 1):
            along = length * (straight_fraction + (1.0 - 2.0 * straight_fraction) * k / half_windings)
            side = 0.0 if k in (0, half_windings) else width * (1 if k % 2 else -1)
            points.append((ax + ux * along - uy * side, ay + uy * along + ux * side))
        points.append((bx, by))
    else:
        points = [(ax, ay), (bx, by)]
    for a, b in pairwise(points):
        draw_line(view.surface, a, b, INK, 1.5 * ui_scale, view.antialias)
    for (x, y), size in (((ax, ay), 3.0), ((bx, by), 6.0)):
        tint = np.asarray([YELLOW], np.uint8)
        discs.draw(
            view.surface,
            np.asarray([(x, y)]),
            np.asarray([size * ui_scale]),
            tint,
            CircleStyle(0.0, antialias=view.antialias),
        )
