"""Drawing of a table: wood, cloth, cushions, pockets, spots and strings. The result depends only on scene and camera.

The outlines of cushions are computed from walls, jaws and facings, in metres. A cushion is a wall along an edge of the
playing area. At each end it may be rounded by a jaw, a post that touches its end, and continue along a facing, a wall
that touches the same jaw.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.description.fixed import Post, Wall
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import Pixel, draw_line, fill_polygon
from sandbox.window.render.palette import BACKGROUND, RgbColour, mix_colours
from sandbox.window.render.sdf import ShapeStyle, draw_sdf_disc
from sandbox.window.render.static_geometry import draw_static_bodies
from sandbox.window.view_bounds import RAIL_WIDTH, shorter_side

CUSHION_WIDTH = 0.036
"""width of a cushion from the nose to the wood, as a fraction of the table width"""
TOUCH_DISTANCE = 1e-6
"""m: objects whose distance is smaller touch"""
ARC_STEP = math.radians(6.0)
"""rad between consecutive points of a jaw"""


class CushionOutline(NamedTuple):
    """Outline of one cushion."""

    outline: tuple[Point, ...]
    """closed polygon, m"""
    nose: tuple[Point, ...]
    """part of the outline that balls can touch: nose, jaws and facings, m"""
    out: Vector
    """unit vector out of the playing area"""


def cushion_outlines(scene: Scene, area: ViewBox) -> tuple[CushionOutline, ...]:
    """Return the cushions among the walls of a scene."""
    depth = CUSHION_WIDTH * shorter_side(area)
    noses = {k: out for k, wall in enumerate(scene.walls) if (out := _outward(wall, area)) is not None}
    facings = [wall for k, wall in enumerate(scene.walls) if k not in noses and len(wall.points) == 2]
    return tuple(_cushion(scene.walls[k], out, scene, facings, depth) for k, out in noses.items())


def other_walls(scene: Scene, area: ViewBox) -> tuple[tuple[Wall, ...], tuple[Post, ...]]:
    """Return the walls and posts that are not part of a cushion."""
    noses = [(wall, out) for wall in scene.walls if (out := _outward(wall, area)) is not None]
    jaws = [jaw for wall, out in noses for end in wall.points if (jaw := _jaw(end, out, scene)) is not None]
    known = [wall for wall, _ in noses] + [
        wall for wall in scene.walls if len(wall.points) == 2 and any(_facing_ends(wall, jaw) for jaw in jaws)
    ]
    walls = tuple(wall for wall in scene.walls if not any(wall is each for each in known))
    return walls, tuple(post for post in scene.posts if not any(post is each for each in jaws))


def _jaw(end: Point, out: Vector, scene: Scene) -> Post | None:
    """Return the post that the end of a nose touches; None if there is none."""
    return next(
        (post for post in scene.posts if math.dist(post.position, _moved(end, out, post.radius)) < TOUCH_DISTANCE), None
    )


def _outward(wall: Wall, area: ViewBox) -> Vector | None:
    """Return the outward unit vector of a wall along an edge of the area; None for other walls."""
    if len(wall.points) != 2 or wall.closed:
        return None
    (left, bottom), (right, top) = area
    (ax, ay), (bx, by) = wall.points
    for edge, a, b, out in (
        (left, ax, bx, (-1.0, 0.0)),
        (right, ax, bx, (1.0, 0.0)),
        (bottom, ay, by, (0.0, -1.0)),
        (top, ay, by, (0.0, 1.0)),
    ):
        if abs(a - edge) < TOUCH_DISTANCE and abs(b - edge) < TOUCH_DISTANCE:
            return out
    return None


def _cushion(wall: Wall, out: Vector, scene: Scene, facings: list[Wall], depth: float) -> CushionOutline:
    a, b = wall.points
    length = max(math.dist(a, b), TOUCH_DISTANCE)
    along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    back = -along[0], -along[1]
    first, last = _end(a, back, out, scene, facings, depth), _end(b, along, out, scene, facings, depth)
    nose = (*reversed(first), *last)
    height = [(x - a[0]) * out[0] + (y - a[1]) * out[1] for x, y in (nose[0], nose[-1])]
    corners = [_moved(nose[-1], out, max(depth - height[1], 0.0)), _moved(nose[0], out, max(depth - height[0], 0.0))]
    if len(last) == 1:  # no jaw: mitre joint with the next cushion
        corners[0] = _moved(corners[0], along, depth)
    if len(first) == 1:
        corners[1] = _moved(corners[1], back, depth)
    return CushionOutline((*nose, *corners), nose, out)


def _end(end: Point, along: Vector, out: Vector, scene: Scene, facings: list[Wall], depth: float) -> tuple[Point, ...]:
    """Return the points from the end of a nose around its jaw and along its facing."""
    jaw = _jaw(end, out, scene)
    if jaw is None:
        return (end,)
    facing = next((ends for wall in facings if (ends := _facing_ends(wall, jaw)) is not None), None)
    if facing is not None:
        x, y = facing[0][0] - jaw.position[0], facing[0][1] - jaw.position[1]
        turn = math.atan2(x * along[0] + y * along[1], -(x * out[0] + y * out[1]))
    else:
        turn = math.acos(max(1.0 - depth / jaw.radius, 0.0))
    points = [end]
    count = max(math.ceil(turn / ARC_STEP), 1)
    for k in range(1, count + 1):
        cos, sin = math.cos(turn * k / count), math.sin(turn * k / count)
        here = _moved(_moved(jaw.position, out, -jaw.radius * cos), along, jaw.radius * sin)
        if any(math.dist(here, hole.position) < hole.radius for hole in scene.pockets):
            break
        points.append(here)
    return (*points, facing[1]) if facing is not None else tuple(points)


def _facing_ends(wall: Wall, jaw: Post) -> tuple[Point, Point] | None:
    """Return the ends of a wall that leaves a jaw tangentially, the end on the jaw first; None for other walls."""
    for first_end, far in (wall.points, wall.points[::-1]):
        x, y = first_end[0] - jaw.position[0], first_end[1] - jaw.position[1]
        leaves = abs(x * (far[0] - first_end[0]) + y * (far[1] - first_end[1])) < TOUCH_DISTANCE
        if leaves and abs(math.hypot(x, y) - jaw.radius) < TOUCH_DISTANCE:
            return first_end, far
    return None


def _moved(point: Point, direction: Vector, distance: float) -> Point:
    return point[0] + direction[0] * distance, point[1] + direction[1] * distance


WOOD: RgbColour = (66, 45, 36)
WOOD_LIGHT: RgbColour = (104, 74, 56)
WOOD_DARK: RgbColour = (44, 30, 25)
IRON: RgbColour = (26, 24, 26)
HOLE: RgbColour = (8, 8, 10)
PEARL: RgbColour = (206, 200, 184)
CHALK: RgbColour = (226, 236, 232)
CENTRE_BRIGHTNESS, CORNER_BRIGHTNESS = 1.12, 0.80
"""brightness of the cloth in the middle and at the corners, as a factor"""


class ClothColours(NamedTuple):
    """Colours of a cloth: bed, cushions, and the line along their noses."""

    bed: RgbColour
    rubber: RgbColour
    edge: RgbColour


POOL = ClothColours((22, 106, 104), (17, 84, 84), (58, 150, 146))
SNOOKER = ClothColours((24, 110, 70), (18, 86, 55), (66, 152, 108))
CAROM = ClothColours((30, 88, 142), (23, 68, 112), (80, 136, 186))
FELTS = {"snooker": SNOOKER, "three-cushion": CAROM, "straight-rail": CAROM}


def felt_of(scene: Scene) -> ClothColours:
    """Return the cloth colours of the scene's game."""
    return FELTS.get(scene.play.game or "free", POOL)


def draw_table(canvas: Canvas, scene: Scene, area: ViewBox) -> None:
    """Draw the visible part of a table.

    Args:
        canvas: target and transform from m to px.
        scene: table.
        area: playing area, m.
    """
    felt = felt_of(scene)
    pen = _TablePen(canvas)
    rubber, width = cushion_outlines(scene, area), shorter_side(area)
    _draw_rails(pen, area, width)
    for hole in scene.pockets:
        pen.disc(hole.position, hole.radius + 0.016 * width, IRON, rim=mix_colours(IRON, PEARL, 0.25), line=1.0)
    pen.box(area, felt.bed)
    for hole in scene.pockets:
        _draw_pocket_mouth(pen, hole.position, hole.radius, rubber, area, felt.bed)
    _draw_light(canvas, area)
    _draw_marks(pen, scene, area, felt)
    for cushion in rubber:
        _draw_shadow(pen, cushion, felt, 0.010 * width)
    for cushion in rubber:
        pen.polygon(cushion.outline, felt.rubber)
        pen.line(cushion.nose, felt.edge, 1.6 * canvas.ui_scale)
        outer = cushion.outline[len(cushion.nose) :]
        pen.line(outer, mix_colours(felt.rubber, HOLE, 0.55), 1.4 * canvas.ui_scale)
        for corner, end in zip(outer, (cushion.nose[-1], cushion.nose[0]), strict=True):
            pen.line((corner, end), mix_colours(felt.rubber, HOLE, 0.3), 1.0 * canvas.ui_scale)
    for hole in scene.pockets:
        pen.disc(hole.position, hole.radius, HOLE, rim=mix_colours(IRON, HOLE, 0.5), line=3.0)
    _draw_diamonds(pen, scene, area, width)
    walls, posts = other_walls(scene, area)
    if walls or posts or scene.planes:
        draw_static_bodies(canvas, scene.model_copy(update={"walls": walls, "posts": posts}))


class _TablePen:
    """Drawing functions that take coordinates in metres."""

    def __init__(self, canvas: Canvas) -> None:
        self.canvas = canvas

    def at(self, points: tuple[Point, ...]) -> list[Pixel]:
        return [(x, y) for x, y in self.canvas.camera.to_screen(np.asarray(points)).tolist()]

    def polygon(self, points: tuple[Point, ...], colour: RgbColour) -> None:
        fill_polygon(self.canvas.surface, self.at(points), colour, self.canvas.antialias)

    def box(self, box: ViewBox, colour: RgbColour, rounding: float = 0.0) -> None:
        """Fill a box, with its sides rounded to whole pixels so that they are sharp."""
        (left, top), (right, bottom) = _corners(self.canvas.camera, box)
        area = self.canvas.surface.get_rect().inflate(400, 400)
        left, right = (min(max(x, area.left), area.right) for x in (left, right))
        top, bottom = (min(max(y, area.top), area.bottom) for y in (top, bottom))
        rect = pygame.Rect(round(left), round(top), round(right) - round(left), round(bottom) - round(top))
        pygame.draw.rect(self.canvas.surface, colour, rect, border_radius=round(rounding * self.canvas.camera.scale))

    def line(self, points: tuple[Point, ...], colour: RgbColour, width: float) -> None:
        positions = self.at(points)
        for a, b in pairwise(positions):
            draw_line(self.canvas.surface, a, b, colour, width, self.canvas.antialias)

    def disc(
        self, at: Point, radius: float, colour: RgbColour, rim: RgbColour | None = None, line: float = 0.0
    ) -> None:
        style = ShapeStyle(colour, rim or colour, line * self.canvas.ui_scale, antialias=self.canvas.antialias)
        draw_sdf_disc(self.canvas.surface, self.at((at,))[0], radius * self.canvas.camera.scale, style)


def _corners(camera: Camera, box: ViewBox) -> tuple[Pixel, Pixel]:
    """Return the upper left and the lower right corner of a box on the screen, px."""
    (ax, ay), (bx, by) = camera.to_screen(np.asarray(box)).tolist()
    return (min(ax, bx), min(ay, by)), (max(ax, bx), max(ay, by))


def _draw_rails(pen: _TablePen, area: ViewBox, width: float) -> None:
    """Draw the rails as nested boxes: a dark outer edge, a light bevel, the wood, and a dark inner edge."""
    rim, depth = RAIL_WIDTH * width, CUSHION_WIDTH * width
    for out, colour in (
        (rim, WOOD_DARK),
        (rim - 0.004 * width, WOOD_LIGHT),
        (rim - 0.008 * width, WOOD),
        (depth + 0.006 * width, WOOD_DARK),
    ):
        (left, bottom), (right, top) = area
        rounding = max(out - depth, 0.0) + 0.02 * width if out > 0.05 * width else 0.0
        pen.box(((left - out, bottom - out), (right + out, top + out)), colour, rounding)


def _draw_pocket_mouth(
    pen: _TablePen, hole: Point, radius: float, rubber: tuple[CushionOutline, ...], area: ViewBox, colour: RgbColour
) -> None:
    """Draw the cloth in the mouth of a pocket, between the ends of its two cushions."""
    reach = 3.0 * radius + 0.1 * shorter_side(area)
    ends = [nose for each in rubber for nose in (each.nose, each.nose[::-1]) if math.dist(nose[0], hole) < reach]
    ends.sort(key=lambda nose: math.dist(nose[0], hole))
    if len(ends) >= 2:
        # The polygon joins the centre of the hole to the points of each lip, up to the straight part of the nose.
        a, b = (nose[: max(len(nose) // 2, 2)] for nose in ends[:2])
        pen.polygon((hole, *a, *reversed(b)), colour)


def _draw_light(canvas: Canvas, area: ViewBox) -> None:
    """Brighten the middle of the bed and darken its corners."""
    (left, top), (right, bottom) = _corners(canvas.camera, area)
    depth = CUSHION_WIDTH * shorter_side(area) * canvas.camera.scale
    window_rect = canvas.surface.get_rect()
    rect = pygame.Rect(0, 0, 0, 0)
    rect.left, rect.top = max(math.floor(left - depth), 0), max(math.floor(top - depth), 0)
    rect.width = min(math.ceil(right + depth), window_rect.right) - rect.left
    rect.height = min(math.ceil(bottom + depth), window_rect.bottom) - rect.top
    if rect.width < 2 or rect.height < 2 or not window_rect.contains(rect):
        return
    grain = min(96, rect.width), min(96, rect.height)
    x = (rect.left + (np.arange(grain[0]) + 0.5) * rect.width / grain[0] - (left + right) / 2) / (right - left)
    y = (rect.top + (np.arange(grain[1]) + 0.5) * rect.height / grain[1] - (top + bottom) / 2) / (bottom - top)
    far = np.clip((x[:, None] ** 2 + y[None, :] ** 2) / 0.5, 0.0, 1.0)
    bright = CENTRE_BRIGHTNESS + (CORNER_BRIGHTNESS - CENTRE_BRIGHTNESS) * far
    # SDL cannot multiply by more than 1; the excess is added.
    dimmed, added = np.clip(bright, 0.0, 1.0) * 255.0, np.clip(bright - 1.0, 0.0, 1.0) * 110.0
    for tone, flag in ((dimmed, pygame.BLEND_RGB_MULT), (added, pygame.BLEND_RGB_ADD)):
        layer = pygame.surfarray.make_surface(np.repeat(np.rint(tone)[:, :, None], 3, 2).astype(np.uint8))
        canvas.surface.blit(pygame.transform.smoothscale(layer, rect.size), rect, special_flags=flag)


def _draw_marks(pen: _TablePen, scene: Scene, area: ViewBox, felt: ClothColours) -> None:
    """Draw the head string or baulk line, the D, and the spots."""
    spots = {spot.name: spot.position for spot in scene.play.spots}
    faint, (left, bottom), (right, top) = mix_colours(felt.bed, CHALK, 0.32), *area
    tall, thin = top - bottom > right - left, 1.2 * pen.canvas.ui_scale
    if {"yellow", "green", "brown"} <= spots.keys():
        (x, y), (gx, gy) = spots["brown"], spots["green"]
        radius = math.dist((x, y), (gx, gy))
        pen.line(((left, y), (right, y)) if tall else ((x, bottom), (x, top)), faint, thin)
        side = math.copysign(1.0, (bottom + top) / 2 - y) if tall else math.copysign(1.0, (left + right) / 2 - x)
        turns = [math.pi * k / 48.0 for k in range(49)]
        arc = [(radius * math.cos(t), -side * radius * math.sin(t)) for t in turns]
        pen.line(tuple((x + u, y + v) if tall else (x + v, y + u) for u, v in arc), faint, thin)
    elif "head" in spots and scene.pockets:
        x, y = spots["head"]
        pen.line(((left, y), (right, y)) if tall else ((x, bottom), (x, top)), mix_colours(felt.bed, CHALK, 0.2), thin)
    size = 0.0042 * shorter_side(area)
    for place in spots.values():
        pen.disc(
            place, max(size, 1.2 * pen.canvas.ui_scale / pen.canvas.camera.scale), mix_colours(felt.bed, CHALK, 0.5)
        )


def _draw_shadow(pen: _TablePen, cushion: CushionOutline, felt: ClothColours, reach: float) -> None:
    """Draw the shadow of a nose on the cloth, up to `reach` m."""
    for fraction, dark in ((1.0, 0.10), (0.62, 0.20), (0.3, 0.32)):
        by = reach * fraction
        moved = tuple((x - cushion.out[0] * by, y - cushion.out[1] * by) for x, y in cushion.nose)
        pen.polygon((*moved, *cushion.nose[::-1]), mix_colours(felt.bed, HOLE, dark))


def _draw_diamonds(pen: _TablePen, scene: Scene, area: ViewBox, width: float) -> None:
    """Draw the diamonds on the rails; snooker tables have none."""
    if scene.play.game == "snooker" or not scene.play.spots or any(s.name == "brown" for s in scene.play.spots):
        return
    (left, bottom), (right, top) = area
    tall = top - bottom > right - left
    offset, size = (RAIL_WIDTH + CUSHION_WIDTH) / 2.0 * width, 0.0062 * width
    columns, rows = (4, 8) if tall else (8, 4)
    positions = [
        (left + (right - left) * k / columns, y) for k in range(1, columns) for y in (bottom - offset, top + offset)
    ]
    positions += [
        (x, bottom + (top - bottom) * k / rows) for k in range(1, rows) for x in (left - offset, right + offset)
    ]
    for place in positions:
        if all(math.dist(place, hole.position) > hole.radius + 0.03 * width for hole in scene.pockets):
            pen.disc(place, size, PEARL, rim=mix_colours(WOOD, BACKGROUND, 0.6), line=0.8)
