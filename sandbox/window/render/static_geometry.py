"""Static geometry: planes, walls, posts, bounds, markings, zones, raised layers and centres of attraction."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Post, Sensor, Wall, Zone, mask_of
from sandbox.scene.description.play import Marking
from sandbox.scene.geometry.polygon import anticlockwise
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.lines import (
    SDL_COORDINATE_LIMIT,
    Pixel,
    clip_polygon,
    clip_segment,
    draw_dashes,
    draw_line,
    fill_polygon,
)
from sandbox.window.render.palette import (
    BACKGROUND,
    BLUE,
    FAINT,
    GREEN,
    NEUTRAL,
    ORANGE,
    SKY,
    SOLID,
    SURFACE,
    YELLOW,
    RgbColour,
    colour_of_fixed,
    hex_colour,
    mix_colours,
)
from sandbox.window.render.sdf import (
    ShapeStyle,
    SignedDistance,
    capsule_distance,
    disc_distance,
    draw_sdf,
    draw_sdf_disc,
    line_distance,
)

HATCH_SPACING, MAX_HATCHES = 9.0, 600
"""px between hatch lines of a plane, and their largest number"""
ARROW_SPACING = 60.0
"""px between the arrows of a one-way wall"""
MIN_RING_RADIUS = 5.0
"""Radius above which a post with a kick shows its ring, px at a UI scale of 1."""
ABSENT_FRACTION = 0.4
"""Fraction of its colour that non-solid geometry keeps."""
MAX_ROUND_WALLS = 300
"""Number of visible segments of a wall up to which they have round ends and a rim; above it, they are plain lines."""


def draw_static_bodies(canvas: Canvas, scene: Scene) -> None:
    """Draw the visible planes, walls and posts of a scene."""
    for plane in scene.planes:
        _draw_plane(canvas, plane)
    for wall in scene.walls:
        _draw_wall(canvas, wall)
    for post in scene.posts:
        _draw_post(canvas, post)


def draw_bounds(canvas: Canvas, bounds: ViewBox | None) -> None:
    """Draw the box outside which bodies are retired, dashed."""
    if bounds is not None:
        draw_dashes(canvas.surface, outline(canvas.camera, bounds), FAINT, 8.0 * canvas.ui_scale, canvas.antialias)


def outline(camera: Camera, box: ViewBox) -> list[tuple[Pixel, Pixel]]:
    """Return the sides of a box, px."""
    (left, bottom), (right, top) = box
    world = np.asarray([(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)])
    return list(pairwise((x, y) for x, y in camera.to_screen(world).tolist()))


def _draw_plane(canvas: Canvas, plane: Plane) -> None:
    camera, ui_scale = canvas.camera, canvas.ui_scale
    length = math.hypot(*plane.normal)
    nx, ny = plane.normal[0] / length, plane.normal[1] / length
    middle = camera.size[0] / 2.0, camera.size[1] / 2.0
    # The height of the view centre above the plane is computed in metres: the point of the plane may be so far away
    # that its pixel position has no precision left.
    height = ((camera.centre[0] - plane.point[0]) * nx + (camera.centre[1] - plane.point[1]) * ny) * camera.scale
    down = nx, -ny
    offset = height - middle[0] * down[0] - middle[1] * down[1]
    edge = colour_of_fixed(plane, SURFACE)
    filling = SOLID if plane.colour is None else mix_colours(BACKGROUND, edge, 0.25)
    draw_sdf(
        canvas.surface,
        line_distance(offset, down),
        ShapeStyle(filling, edge, 2.0 * ui_scale, antialias=canvas.antialias),
    )

    nearest = middle[0] - height * down[0], middle[1] - height * down[1]
    along = -down[1], down[0]
    reach = camera.size[0] + camera.size[1]
    if abs(height) < reach:
        phase = math.fmod(
            ((plane.point[0] - camera.centre[0]) * along[0] - (plane.point[1] - camera.centre[1]) * along[1])
            * camera.scale,
            HATCH_SPACING * ui_scale,
        )
        _draw_hatch(canvas, nearest, along, down, phase, reach, mix_colours(filling, edge, 0.3))


def _draw_hatch(
    canvas: Canvas,
    nearest: Pixel,
    along: Pixel,
    out: Pixel,
    phase: float,
    reach: float,
    colour: RgbColour,
) -> None:
    """Draw short slanted lines behind the edge of a plane; they are fixed to the point of the plane."""
    ui_scale = canvas.ui_scale
    ends = (
        (nearest[0] - along[0] * reach, nearest[1] - along[1] * reach),
        (nearest[0] + along[0] * reach, nearest[1] + along[1] * reach),
    )
    clipped = clip_segment(*ends, canvas.surface.get_clip(), 20.0 * ui_scale)
    if clipped is None:
        return
    step = HATCH_SPACING * ui_scale
    low, high = sorted((p[0] - nearest[0]) * along[0] + (p[1] - nearest[1]) * along[1] for p in clipped)
    first = math.ceil((low - phase) / step)
    for k in range(first, min(math.floor((high - phase) / step) + 1, first + MAX_HATCHES)):
        s = phase + k * step
        x, y = (
            nearest[0] + along[0] * s - out[0] * 3.0 * ui_scale,
            nearest[1] + along[1] * s - out[1] * 3.0 * ui_scale,
        )
        stroke = (along[0] - out[0]) * 6.0 * ui_scale, (along[1] - out[1]) * 6.0 * ui_scale
        draw_line(canvas.surface, (x, y), (x + stroke[0], y + stroke[1]), colour, 1.0, canvas.antialias)


def _draw_wall(canvas: Canvas, wall: Wall) -> None:
    surface, ui_scale, antialias = canvas.surface, canvas.ui_scale, canvas.antialias
    points = np.asarray((*wall.points, wall.points[0]) if wall.closed else wall.points)
    half = wall.thickness / 2.0 * canvas.camera.scale
    is_thin = half <= 1.0 * ui_scale
    half = max(half, 1.0 * ui_scale)
    edge = colour_of_fixed(wall, SURFACE)
    filling = edge if is_thin else SOLID if wall.colour is None else mix_colours(BACKGROUND, edge, 0.4)
    area = surface.get_clip()
    pixels = canvas.camera.to_screen(points).tolist()
    segments = [
        segment for a, b in pairwise(pixels) if (segment := clip_segment((a[0], a[1]), (b[0], b[1]), area, half + 4.0))
    ]
    if not wall.solid:
        ends = (((a[0], a[1]), (b[0], b[1])) for a, b in pairwise(pixels))
        draw_dashes(
            surface,
            ends,
            mix_colours(BACKGROUND, edge, ABSENT_FRACTION),
            5.0 * ui_scale,
            antialias,
        )
        return
    if wall.one_way:
        for a, b in pairwise(pixels):
            draw_passing_arrows(canvas, (a[0], a[1]), (b[0], b[1]), half, edge)
    has_plain_lines = len(segments) > MAX_ROUND_WALLS
    rim = 0.0 if is_thin else min(1.5 * ui_scale, half)
    # All outlines first, then all fills, so that no outline shows inside a corner.
    for inset, colour in ((0.0, edge), (rim, filling)) if rim else ((0.0, edge),):
        for a, b in segments:
            if has_plain_lines and half < 4000.0:
                draw_line(surface, a, b, colour, 2.0 * (half - inset), antialias)
            else:
                style = ShapeStyle(colour, colour, 0.0, antialias=antialias)
                draw_sdf(surface, capsule_distance(a, b, half - inset), style, _surrounding_rect(a, b, half, area))


def draw_passing_arrows(canvas: Canvas, a: Pixel, b: Pixel, half: float, colour: RgbColour) -> None:
    """Draw small arrows on the left side of a wall, in its passing direction, at fixed points of the wall."""
    ui_scale = canvas.ui_scale
    clipped, length = clip_segment(a, b, canvas.surface.get_clip(), half + 12.0 * ui_scale), math.dist(a, b)
    if clipped is None or length < 2.0:
        return
    ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    out = uy, -ux  # left of the direction a → b, with y down
    step = length / max(1, round(length / (ARROW_SPACING * ui_scale)))
    first = math.floor(math.dist(a, clipped[0]) / step)
    for k in range(first, min(math.ceil(math.dist(a, clipped[1]) / step), first + MAX_HATCHES)):
        s = (k + 0.5) * step
        x, y = a[0] + s * ux + half * out[0], a[1] + s * uy + half * out[1]
        tip = x + 10.0 * ui_scale * out[0], y + 10.0 * ui_scale * out[1]
        draw_line(canvas.surface, (x, y), tip, colour, 1.5 * ui_scale, canvas.antialias)
        for side in (-4.0 * ui_scale, 4.0 * ui_scale):
            barb = (
                tip[0] - 4.0 * ui_scale * out[0] + side * ux,
                tip[1] - 4.0 * ui_scale * out[1] + side * uy,
            )
            draw_line(canvas.surface, tip, barb, colour, 1.5 * ui_scale, canvas.antialias)


def _surrounding_rect(a: Pixel, b: Pixel, reach: float, area: pygame.Rect) -> pygame.Rect:
    """Return the part of an area within `reach` of the bounding box of two points."""
    left, top = max(min(a[0], b[0]) - reach - 2.0, area.left), max(min(a[1], b[1]) - reach - 2.0, area.top)
    right, bottom = min(max(a[0], b[0]) + reach + 2.0, area.right), min(max(a[1], b[1]) + reach + 2.0, area.bottom)
    if right <= left or bottom <= top:
        return pygame.Rect(0, 0, 0, 0)
    return pygame.Rect(int(left), int(top), math.ceil(right) - int(left), math.ceil(bottom) - int(top))


def _draw_post(canvas: Canvas, post: Post) -> None:
    ui_scale, antialias = canvas.ui_scale, canvas.antialias
    position = np.asarray([post.position])
    radius = max(post.radius * canvas.camera.scale, 1.0 * ui_scale)
    if not canvas.camera.in_sight(position, radius / canvas.camera.scale)[0]:
        return
    x, y = canvas.camera.to_screen(position)[0].tolist()
    edge = colour_of_fixed(post, NEUTRAL)
    if not post.solid:
        faint = mix_colours(BACKGROUND, edge, ABSENT_FRACTION)
        draw_sdf_disc(canvas.surface, (x, y), radius, ShapeStyle(BACKGROUND, faint, ui_scale, antialias=antialias))
        return
    style = ShapeStyle(mix_colours(BACKGROUND, edge, 0.55), edge, min(1.5 * ui_scale, radius), antialias=antialias)
    draw_sdf_disc(canvas.surface, (x, y), radius, style)
    if post.kick is not None and radius > MIN_RING_RADIUS * ui_scale:  # ring of a bumper
        ring = ShapeStyle(mix_colours(BACKGROUND, edge, 0.3), edge, 1.5 * ui_scale, antialias=antialias)
        draw_sdf_disc(canvas.surface, (x, y), 0.6 * radius, ring)


UPPER_LAYER_OPACITY = 165
"""of 255, opacity of layers above the ground"""
LAYER_MARGIN = 4
"""px, margin around a cached layer"""


Sprite = tuple[pygame.Surface, tuple[int, int]]
"""Surface and the position of its upper left corner."""


class _DrawnLayer(NamedTuple):
    """Cached surface of a layer."""

    key: tuple[object, ...]
    picture: Sprite | None


def lowest_layer(mask: int) -> int:
    """Return the index of the lowest set bit of a layer mask."""
    return (mask & -mask).bit_length() - 1


def on_layer(scene: Scene, layer: int) -> Scene:
    """Return a scene with only the walls and posts whose lowest layer is `layer`; planes belong to layer 0."""

    def is_on_layer(layers: tuple[str, ...]) -> bool:
        return lowest_layer(mask_of(layers, scene.layers)) == layer

    walls = tuple(wall for wall in scene.walls if is_on_layer(wall.layers))
    posts = tuple(post for post in scene.posts if is_on_layer(post.layers))
    return scene.model_copy(update={"walls": walls, "posts": posts, "planes": () if layer else scene.planes})


def layers_among(frame: Frame, numbers: IntArray) -> IntArray:
    """Return the layer of each of the given bodies, (K,)."""
    return np.zeros(len(numbers), np.int64) if frame.layer is None else frame.layer[numbers]


class LayerRenderer:
    """Draws layers above the ground; each is cached until its geometry or the camera changes."""

    def __init__(self) -> None:
        self._scene: Scene | None = None
        self._layers: tuple[Scene, ...] = ()
        self._drawn: dict[int, _DrawnLayer] = {}

    def draw(self, canvas: Canvas, scene: Scene, layer: int) -> None:
        """Draw the walls and posts of a layer, translucent, over a surface."""
        if self._scene is not scene:  # a new scene may keep its raised layers
            self._scene = scene
            self._layers = tuple(on_layer(scene, k) for k in range(len(scene.layers)))
        layer_scene = self._layers[layer]
        key = layer_scene.walls, layer_scene.posts, canvas.camera, canvas.ui_scale, canvas.antialias
        cached = self._drawn.get(layer)
        if cached is None or cached.key != key:
            self._drawn[layer] = cached = _DrawnLayer(key, _layer_sprite(canvas, layer_scene))
        if cached.picture is not None:
            canvas.surface.blit(*cached.picture)


def _layer_sprite(canvas: Canvas, scene: Scene) -> Sprite | None:
    """Return a translucent sprite of a layer; overlapping parts do not add up in opacity. None if not visible."""
    surface = canvas.surface
    discs = [(point, wall.thickness / 2.0) for wall in scene.walls for point in wall.points]
    discs += [(post.position, post.radius) for post in scene.posts]
    if not discs:
        return None
    pixels = np.asarray(canvas.camera.to_screen(np.asarray([position for position, _ in discs])))
    reach = np.asarray([[size * canvas.camera.scale] for _, size in discs]) + LAYER_MARGIN * canvas.ui_scale
    low, high = (
        (pixels - reach).min(axis=0).clip(-SDL_COORDINATE_LIMIT, SDL_COORDINATE_LIMIT),
        (pixels + reach).max(axis=0).clip(-SDL_COORDINATE_LIMIT, SDL_COORDINATE_LIMIT),
    )
    box = pygame.Rect(*low.astype(int).tolist(), *(high - low + 2.0).astype(int).tolist()).clip(surface.get_rect())
    if not box.width or not box.height:
        return None
    # Drawn on black and on white: the difference gives the coverage.
    dark, light = (pygame.Surface(surface.get_size(), 0, 32) for _ in range(2))
    for ground, colour in ((dark, (0, 0, 0)), (light, (255, 255, 255))):
        ground.fill(colour)
        ground.set_clip(box)
        draw_static_bodies(replace(canvas, surface=ground), scene)
    black, white = (pygame.surfarray.array3d(each.subsurface(box)).astype(np.int32) for each in (dark, light))
    cover = (255 - (white - black).mean(axis=2)).clip(0, 255)
    picture = pygame.Surface(box.size, pygame.SRCALPHA, 32)
    colours = black * (255.0 / np.maximum(cover, 1.0))[:, :, None]
    pygame.surfarray.pixels3d(picture)[:] = colours.clip(0, 255).astype(np.uint8)
    pygame.surfarray.pixels_alpha(picture)[:] = (cover * (UPPER_LAYER_OPACITY / 255.0)).astype(np.uint8)
    return picture, box.topleft


def draw_markings(canvas: Canvas, scene: Scene) -> None:
    """Draw the visible markings of a scene."""
    for marking in scene.play.markings:
        colour = hex_colour(marking.colour)
        if marking.position is not None and marking.radius is not None:
            _draw_circle(canvas, marking, (marking.position, marking.radius), colour)
        elif marking.filled:
            corners = canvas.camera.to_screen(np.asarray(marking.points)).tolist()
            kept = clip_polygon([(x, y) for x, y in corners], canvas.surface.get_clip())
            if kept:
                fill_polygon(canvas.surface, kept, colour, canvas.antialias)
        else:
            pixels: list[Pixel] = [(x, y) for x, y in canvas.camera.to_screen(np.asarray(marking.points)).tolist()]
            width = min(max(marking.width * canvas.camera.scale, canvas.ui_scale), SDL_COORDINATE_LIMIT)
            for a, b in pairwise(pixels):
                draw_line(canvas.surface, a, b, colour, width, canvas.antialias)


def _draw_circle(
    canvas: Canvas,
    marking: Marking,
    circle: tuple[Point, float],
    colour: RgbColour,
) -> None:
    position = np.asarray([circle[0]])
    line_width = 0.0 if marking.filled else max(marking.width * canvas.camera.scale, canvas.ui_scale)
    radius = max(circle[1] * canvas.camera.scale, canvas.ui_scale) + 0.5 * line_width
    if not canvas.camera.in_sight(position, np.asarray([radius / canvas.camera.scale]))[0]:
        return
    x, y = canvas.camera.to_screen(position)[0].tolist()
    look = ShapeStyle(colour if marking.filled else None, colour, line_width, antialias=canvas.antialias)
    draw_sdf_disc(canvas.surface, (x, y), radius, look)


ZONE_FILL_OPACITY, ZONE_LINE_OPACITY = 0.13, 0.55
"""opacity of the area and of the outline"""
LIQUID_FILL_OPACITY = 0.3
"""opacity of the area of a liquid"""
SURFACE_WIDTH = 3.0
"""px, width of the surface of a liquid"""
STEEPEST_SURFACE = 0.5
"""cosine of the angle between the normal of a side of a liquid and the direction up, from which it is a surface"""
ZONE_LINE_WIDTH = 1.5
"""px, width of the outline"""


def draw_zones(canvas: Canvas, scene: Scene) -> None:
    """Draw the visible zones of a scene."""
    for zone in scene.zones:
        fill = ZONE_FILL_OPACITY if zone.liquid is None else LIQUID_FILL_OPACITY
        draw_area(canvas, zone, colour_of_zone(zone), fill, ZONE_LINE_OPACITY)
        if zone.liquid is not None and zone.points is not None:
            _draw_surface(canvas, zone.points, zone.gravity or scene.world.gravity, colour_of_zone(zone))


def _draw_surface(canvas: Canvas, points: tuple[Point, ...], gravity: Point, colour: RgbColour) -> None:
    """Draw a line along the sides of a liquid that face up."""
    pull, corners = math.hypot(*gravity), anticlockwise(points)
    for (ax, ay), (bx, by) in pairwise((*corners, corners[0])):
        rise = (ax - bx) * gravity[1] - (ay - by) * gravity[0]  # along the outward normal, (by − ay, ax − bx)
        if pull and -rise >= STEEPEST_SURFACE * pull * math.hypot(bx - ax, by - ay):
            (x0, y0), (x1, y1) = canvas.camera.to_screen(np.array([[ax, ay], [bx, by]])).tolist()
            draw_line(canvas.surface, (x0, y0), (x1, y1), colour, SURFACE_WIDTH * canvas.ui_scale, canvas.antialias)


def draw_area(canvas: Canvas, area: Zone | Sensor, colour: RgbColour, fill: float, line: float) -> None:
    """Draw a zone or a sensor in the world, with the opacities of its area and of its outline."""
    distance, within = _distance(area, canvas.camera)
    box = within.inflate(4, 4).clip(canvas.surface.get_clip())
    draw_sdf(canvas.surface, distance, ShapeStyle(colour, colour, 0.0, fill, canvas.antialias), box)
    width = ZONE_LINE_WIDTH * canvas.ui_scale
    draw_sdf(canvas.surface, distance, ShapeStyle(None, colour, width, line, canvas.antialias), box)


def colour_of_zone(zone: Zone) -> RgbColour:
    """Return the colour of a zone: its own, or one by its effect."""
    if zone.colour is not None:
        return hex_colour(zone.colour)
    if zone.holds:
        return ORANGE
    if zone.to_layer is not None:
        return GREEN
    if zone.liquid is not None:
        return BLUE
    return FAINT if zone.gravity is None else SKY


def _distance(zone: Zone | Sensor, camera: Camera) -> tuple[SignedDistance, pygame.Rect]:
    """Return the signed distance from a zone or sensor, px, and its bounding box."""
    if zone.points is None:
        assert zone.position is not None and zone.radius is not None
        corners, reach = _pixels((zone.position,), camera), zone.radius * camera.scale
        x, y = corners[0].tolist()
        return disc_distance(x, y, reach), _box(corners, reach)
    corners = _pixels(zone.points, camera)
    if zone.thickness is None:
        return _outline(corners), _box(corners, 0.0)
    half = 0.5 * zone.thickness * camera.scale
    ends = [(x, y) for x, y in corners.tolist()]
    segments = [capsule_distance(a, b, half) for a, b in pairwise(ends)]

    def nearest(px: FloatArray, py: FloatArray) -> FloatArray:
        return np.asarray(np.minimum.reduce([segment(px, py) for segment in segments]))

    return nearest, _box(corners, half)


def _outline(corners: FloatArray) -> SignedDistance:
    """Return the signed distance from a simple polygon (K, 2), px; inside by the even-odd rule."""
    sides = list(zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True))

    def distance(px: FloatArray, py: FloatArray) -> FloatArray:
        px, py = np.broadcast_arrays(px, py)
        distance_to_side, inside = np.full(px.shape, np.inf), np.zeros(px.shape, np.bool_)
        for (ax, ay), (bx, by) in sides:
            distance_to_side = np.minimum(distance_to_side, capsule_distance((ax, ay), (bx, by), 0.0)(px, py))
            if ay != by:
                inside ^= ((ay > py) != (by > py)) & (px < ax + (bx - ax) * (py - ay) / (by - ay))
        return np.where(inside, -distance_to_side, distance_to_side)

    return distance


def _pixels(points: tuple[Point, ...], camera: Camera) -> FloatArray:
    return np.asarray(camera.to_screen(np.asarray(points, dtype=np.float64)), dtype=np.float64)


def _box(corners: FloatArray, reach: float) -> pygame.Rect:
    """Return the bounding box of points (K, 2) enlarged by `reach`, px, clamped to SDL's coordinate range."""
    low, high = (
        (corners.min(axis=0) - reach).clip(-SDL_COORDINATE_LIMIT, SDL_COORDINATE_LIMIT),
        (corners.max(axis=0) + reach).clip(-SDL_COORDINATE_LIMIT, SDL_COORDINATE_LIMIT),
    )
    return pygame.Rect(*np.floor(low).astype(int).tolist(), *np.ceil(high - low + 1.0).astype(int).tolist())


SUN_RADIUS, RAY_LENGTH = 6.0, 5.0
"""px at a UI scale of 1, of the disc, and length of a ray"""
RAY_GAP = 2.5
"""px between the disc and its rays"""
RAY_COUNT = 8
SUN_COLOUR = mix_colours(BACKGROUND, YELLOW, 0.8)


def draw_attractions(canvas: Canvas, scene: Scene) -> None:
    """Draw the centre of each attraction towards a point: a sun with rays, or a hollow one if it repels.

    An attraction towards a body has no symbol, as the body itself is visible.
    """
    for attraction in scene.attractions:
        if isinstance(attraction.toward, str) or not attraction.strength:
            continue
        x, y = canvas.camera.to_screen(np.asarray(attraction.toward)).tolist()
        if max(abs(x), abs(y)) < SDL_COORDINATE_LIMIT:
            _draw_sun(canvas, (x, y), repels=attraction.strength < 0.0)


def _draw_sun(canvas: Canvas, centre: tuple[float, float], *, repels: bool) -> None:
    unit, (x, y) = canvas.ui_scale, centre
    for k in range(RAY_COUNT):
        across, up = math.cos(math.tau * k / RAY_COUNT), math.sin(math.tau * k / RAY_COUNT)
        inner, outer = (SUN_RADIUS + RAY_GAP) * unit, (SUN_RADIUS + RAY_GAP + RAY_LENGTH) * unit
        ends = (x + inner * across, y + inner * up), (x + outer * across, y + outer * up)
        draw_line(canvas.surface, *ends, SUN_COLOUR, 1.6 * unit, canvas.antialias)
    draw_disc(canvas.surface, centre, SUN_RADIUS * unit, SUN_COLOUR, hole=(SUN_RADIUS - 2.0) * unit if repels else 0.0)
