"""View of billiards: table, rolling balls, and the aim of the next stroke: predicted paths, ghost ball and cue."""

import math
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.games.billiards.view.balls import BallRenderer
from sandbox.games.billiards.view.prediction import CueAim
from sandbox.games.billiards.view.table import draw_table, felt_of
from sandbox.window.render.draw_context import DrawContext, GameView
from sandbox.window.render.lines import Pixel, draw_line
from sandbox.window.render.palette import (
    BACKGROUND,
    INK,
    ORANGE,
    SKY,
    WARNING,
    YELLOW,
    ColourArray,
    RgbColour,
    mix_colours,
)
from sandbox.window.render.sdf import ShapeStyle, draw_sdf, draw_sdf_disc

FADE_LENGTH = 3.0
"""m along a path over which its brightness halves"""
MIN_BRIGHTNESS = 0.16
"""least brightness of a path, as a fraction"""
CUE_LENGTH = 1.47
"""m: length of a cue for balls of radius `REFERENCE_RADIUS`; it scales with the ball"""
REFERENCE_RADIUS = 0.028575
"""m: ball radius for which the dimensions of the cue are given"""
CUE_PARTS: tuple[tuple[float, float, float, RgbColour], ...] = (
    (0.000, 0.008, 0.0064, (64, 128, 190)),
    (0.008, 0.030, 0.0066, (238, 234, 222)),
    (0.030, 0.740, 0.0068, (214, 176, 120)),
    (0.740, 0.775, 0.0108, (30, 26, 26)),
    (0.775, 1.130, 0.0112, (92, 52, 34)),
    (1.130, 1.420, 0.0136, (34, 32, 38)),
    (1.420, 1.470, 0.0146, (22, 20, 22)),
)
"""Parts of the cue from tip to butt: start, end, half width at the start, m, and colour. Widths change linearly."""
BUTT_HALF_WIDTH = 0.0148
"""m: half width at the butt"""


class BilliardsView(GameView):
    """Draws billiard tables, and balls on any surface on which they roll."""

    def __init__(self) -> None:
        self._balls = BallRenderer()

    def background(self, ctx: DrawContext) -> bool:
        """Draw the table; return False for a surface without one, which is drawn as the ground of other scenes."""
        scene = ctx.snapshot.scene
        if scene.play.area is None:
            return False
        draw_table(ctx, scene, scene.play.area)
        return True

    def below(self, ctx: DrawContext) -> None:
        """Draw the predicted paths."""
        if isinstance(ctx.snapshot.game, CueAim):
            _draw_paths(ctx, ctx.snapshot.game, ctx.body_colours)

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw the balls, unless they are drawn as points; return the indices of the drawn bodies."""
        if ctx.snapshot.scene.surface is None or ctx.has_points:
            return np.empty(0, np.int64)
        self._balls.draw(ctx)
        return ctx.shown

    def above(self, ctx: DrawContext) -> None:
        """Draw the cue and the markers above the balls."""
        if isinstance(ctx.snapshot.game, CueAim):
            _draw_aim(ctx, ctx.snapshot.game)


def _draw_paths(view: DrawContext, aim: CueAim, colours: ColourArray) -> None:
    """Draw the predicted paths of the cue ball and of the first ball that it hits; drawn below the balls."""
    found = aim.prediction
    if found is None:
        return
    if found.object_path is not None and found.hit is not None:
        red, green, blue = colours[found.hit].tolist()
        _draw_path(view, found.object_path, mix_colours((red, green, blue), INK, 0.45), 2.0)
        _draw_end(view, found.object_path, aim, found.hit in found.pocketed, mix_colours((red, green, blue), INK, 0.45))
    _draw_path(view, found.cue_path, INK, 1.6)
    _draw_end(view, found.cue_path, aim, aim.ball in found.pocketed, INK)


def _faded(view: DrawContext, colour: RgbColour, opacity: float) -> RgbColour:
    """Return a colour blended with the cloth or the background."""
    scene = view.snapshot.scene
    return mix_colours(BACKGROUND if scene.play.area is None else felt_of(scene).bed, colour, opacity)


def _draw_path(view: DrawContext, points: FloatArray, colour: RgbColour, width: float) -> None:
    """Draw a path that fades along its length."""
    pixels = view.camera.to_screen(points).tolist()
    steps = np.hypot(*np.diff(points, axis=0).T)
    bright = np.maximum(0.5 ** (np.cumsum(steps) / FADE_LENGTH), MIN_BRIGHTNESS).tolist()
    for (a, b), opacity in zip(pairwise(pixels), bright, strict=True):
        draw_line(view.surface, a, b, _faded(view, colour, opacity), width * view.ui_scale, view.antialias)


def _draw_end(view: DrawContext, points: FloatArray, aim: CueAim, pocketed: bool, colour: RgbColour) -> None:
    """Draw the end of a path: a ring where the ball comes to rest, a smaller, bolder one if it is pocketed."""
    radius = float(view.snapshot.bodies.radius[aim.ball])
    tint = colour if pocketed else _faded(view, colour, 0.45)
    _draw_ring(view, points[-1], (0.55 if pocketed else 1.0) * radius, tint, 2.2 if pocketed else 1.2)


def _draw_ring(
    view: DrawContext, at: FloatArray, radius: float, colour: RgbColour, line: float, opacity: float = 1.0
) -> None:
    style = ShapeStyle(None, colour, line * view.ui_scale, opacity, antialias=view.antialias)
    draw_sdf_disc(view.surface, view.camera.to_screen(at).tolist(), radius * view.camera.scale, style)


def _draw_aim(view: DrawContext, aim: CueAim) -> None:
    """Draw the layer above the balls: called pocket and ball, ghost ball, ball in hand, and cue."""
    radius = float(view.snapshot.bodies.radius[aim.ball])
    if aim.called is not None:
        _draw_ring(view, np.asarray(aim.called[0]), aim.called[1] + 0.25 * radius, YELLOW, 2.5)
    if aim.nominated is not None:
        _draw_ring(view, view.snapshot.frame.position[aim.nominated], 1.35 * radius, YELLOW, 2.0)
    if aim.carried:
        _draw_ring(view, np.asarray(aim.place), 1.5 * radius, WARNING if aim.refused else SKY, 2.0)
        return
    if aim.prediction is not None and aim.prediction.ghost is not None:
        _draw_ring(view, np.asarray(aim.prediction.ghost), radius, INK, 1.5, opacity=0.9)
    elif aim.prediction is None:
        _draw_line_of_aim(view, aim)
    _draw_cue(view, aim, radius)


def _draw_line_of_aim(view: DrawContext, aim: CueAim) -> None:
    """Draw a straight line along the cue, for shots without a prediction."""
    x, y = aim.place
    ends = np.asarray([(x, y), (x + 10.0 * math.cos(aim.angle), y + 10.0 * math.sin(aim.angle))])
    a, b = view.camera.to_screen(ends).tolist()
    draw_line(view.surface, a, b, ORANGE, 1.2 * view.ui_scale, view.antialias)


def _draw_cue(view: DrawContext, aim: CueAim, radius: float) -> None:
    """Draw the cue behind the ball, and its shadow."""
    size = radius / REFERENCE_RADIUS
    x, y = aim.place
    cos, sin = math.cos(aim.angle), math.sin(aim.angle)
    # `side` is positive to the right as seen along the cue.
    start = x + sin * aim.side * radius, y - cos * aim.side * radius
    tip_distance = math.sqrt(max(1.0 - aim.side**2, 0.0)) * radius + 0.006 * size + aim.back

    def at(along: float, across: float) -> tuple[float, float]:
        back = tip_distance + along * size
        return start[0] - cos * back - sin * across * size, start[1] - sin * back + cos * across * size

    def corners(first: float, last: float, half_start: float, half_end: float, shift: Pixel) -> list[Pixel]:
        world = np.asarray([at(first, half_start), at(last, half_end), at(last, -half_end), at(first, -half_start)])
        return [(px + shift[0], py + shift[1]) for px, py in view.camera.to_screen(world).tolist()]

    shadow_offset = 0.012 * size * view.camera.scale
    shade = corners(0.0, CUE_LENGTH, CUE_PARTS[0][2], BUTT_HALF_WIDTH, (0.8 * shadow_offset, shadow_offset))
    _dim(view, shade)
    ends = [*(part[2] for part in CUE_PARTS[1:]), BUTT_HALF_WIDTH]
    scale = view.camera.scale * size
    for (first, last, half_start, colour), half_end in zip(CUE_PARTS, ends, strict=True):
        a, b = view.camera.to_screen(np.asarray([at(first, 0.0), at(last, 0.0)])).tolist()
        thin, thick = (max(half * scale, 0.8 * view.ui_scale) for half in (half_start, half_end))
        _taper(view, a, b, (thin, thick), colour)
        if thin > 2.0:
            _taper(view, a, b, (0.3 * thin, 0.3 * thick), mix_colours(colour, INK, 0.12))


def _taper(view: DrawContext, a: Pixel, b: Pixel, halves: tuple[float, float], colour: RgbColour) -> None:
    """Draw a tapered segment with flat ends; `halves` are the half widths at `a` and `b`, px."""
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    if length < 1e-3:
        return
    along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    slope = (halves[1] - halves[0]) / length

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        x, y = px - a[0], py - a[1]
        t = x * along[0] + y * along[1]
        across = np.abs(y * along[0] - x * along[1]) - halves[0] - slope * t
        return np.asarray(np.maximum(across, np.maximum(-t, t - length) - 0.5))  # overlaps the next by half a pixel

    reach = math.ceil(max(halves)) + 2
    left, top = math.floor(min(a[0], b[0])) - reach, math.floor(min(a[1], b[1])) - reach
    width, height = abs(b[0] - a[0]) + 2 * reach + 1, abs(b[1] - a[1]) + 2 * reach + 1
    within = pygame.Rect(left, top, math.ceil(width), math.ceil(height))
    draw_sdf(view.surface, distance, ShapeStyle(colour, colour, 0.0, antialias=view.antialias), within)


def _dim(view: DrawContext, corners: list[Pixel]) -> None:
    """Darken a polygon."""
    xs, ys = [x for x, _ in corners], [y for _, y in corners]
    window_rect = view.surface.get_rect()
    rect = pygame.Rect(math.floor(min(xs)), math.floor(min(ys)), 1, 1)
    rect.width, rect.height = math.ceil(max(xs)) - rect.left + 1, math.ceil(max(ys)) - rect.top + 1
    rect = rect.clip(window_rect)
    if not rect.width or not rect.height:
        return
    layer = pygame.Surface(rect.size, pygame.SRCALPHA)
    pygame.draw.polygon(layer, (*BACKGROUND, 90), [(x - rect.left, y - rect.top) for x, y in corners])
    view.surface.blit(layer, rect)
