"""View of artillery: sky, terrain, tanks with their guns, shells, explosions, and the wind.

From back to front: the sky, which does not move with the camera; the terrain, darker with depth and with a bright edge;
falling dirt and paths of shells; the tanks, and the setting of the gun whose turn it is; shells in flight, explosions,
and the last impact; the wind. Screen positions are in px, y downwards. Shapes too large for SDL are skipped.
"""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.games.artillery.scene import GROUND, Artillery, displaced
from sandbox.games.artillery.view_state import (
    EXPLOSION_DURATION,
    ArtilleryViewState,
    ExplosionView,
    FallingDirt,
    GunView,
)
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.game_tables import table_of
from sandbox.window.render.draw_context import Canvas, DrawContext, GameView
from sandbox.window.render.lines import SDL_COORDINATE_LIMIT, Pixel, draw_arrow, draw_dashes, draw_line, fill_polygon
from sandbox.window.render.palette import (
    BACKGROUND,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    SKY,
    WARNING,
    YELLOW,
    ColourArray,
    RgbColour,
    hex_colour,
    mix_colours,
)
from sandbox.window.render.static_geometry import draw_static_bodies
from sandbox.window.render.text import draw_text


def draw_dot(surface: pygame.Surface, at: Pixel, radius: float, colour: RgbColour, line: float = 0.0) -> None:
    """Draw a disc or, with a line width in px, a ring."""
    if abs(at[0]) < SDL_COORDINATE_LIMIT and abs(at[1]) < SDL_COORDINATE_LIMIT and radius < SDL_COORDINATE_LIMIT:
        width = max(round(line), 1) if line else 0
        pygame.draw.circle(surface, colour, (round(at[0]), round(at[1])), max(round(radius), 1), width)


def draw_glow(surface: pygame.Surface, at: Pixel, radius: float, colour: RgbColour, opacity: int) -> None:
    """Draw a translucent disc; `opacity` is 0 to 255."""
    if not (
        abs(at[0]) < SDL_COORDINATE_LIMIT and abs(at[1]) < SDL_COORDINATE_LIMIT and radius < 0.2 * SDL_COORDINATE_LIMIT
    ):
        return
    side = max(math.ceil(radius), 1)
    layer = pygame.Surface((2 * side + 1, 2 * side + 1), pygame.SRCALPHA)
    pygame.draw.circle(layer, (*colour, opacity), (side, side), side)
    surface.blit(layer, (round(at[0]) - side, round(at[1]) - side))


BARREL_LENGTH = 0.75
"""length from the turret to the muzzle, in widths of a tank"""
MIN_TANK_SIZE = 20.0
"""px, smallest drawn width of a tank; smaller tanks are enlarged"""
HULL = ((-0.50, -0.02), (-0.42, 0.18), (-0.20, 0.24), (0.20, 0.24), (0.42, 0.18), (0.50, -0.02))
"""Corners, in widths and heights of a tank from its centre."""
AIM_LENGTH = 26.0
"""m, length of the row of dots that shows the power, from the muzzle"""


def draw_tanks(view: DrawContext, gunnery: ArtilleryViewState, tints: dict[int, RgbColour]) -> None:
    """Draw all visible tanks; `tints` are their colours by body index."""
    frame = view.snapshot.frame
    for gun in gunnery.guns:
        if gun.number >= len(frame.position) or not frame.present[gun.number]:
            continue
        x, y = view.camera.to_screen(frame.position[gun.number]).tolist()
        width = max(gunnery.size[0] * view.camera.scale, MIN_TANK_SIZE * view.ui_scale)
        if not (abs(x) < SDL_COORDINATE_LIMIT and abs(y) < SDL_COORDINATE_LIMIT and width < SDL_COORDINATE_LIMIT):
            continue
        height = width * gunnery.size[1] / gunnery.size[0]
        lift = 0.5 * (height - gunnery.size[1] * view.camera.scale)  # enlarged tanks keep their bottom edge
        _Tank(view, (x, y - lift), (width, height), -float(frame.angle[gun.number]), tints[gun.number]).draw(gun)
        if gun.aiming:
            _draw_gun_setting(view, gunnery, gun, (x, y - lift), width)
        _draw_label(view, gun, (x, y - lift - 1.1 * width), tints[gun.number])


class _Tank:
    """Draws one tank, centred on a pixel."""

    def __init__(self, view: DrawContext, at: Pixel, size: Pixel, turn: float, tint: RgbColour) -> None:
        self._view, self._at, self._size, self._tint = view, at, size, tint
        self._cos, self._sin = math.cos(turn), math.sin(turn)

    def _pixel(self, x: float, y: float) -> Pixel:
        """Return the pixel of a point of the tank, in widths to the right of its centre and heights above it."""
        right, down = x * self._size[0], -y * self._size[1]
        return (
            self._at[0] + self._cos * right - self._sin * down,
            self._at[1] + self._sin * right + self._cos * down,
        )

    def draw(self, gun: GunView) -> None:
        """Draw barrel, turret, hull, track and wheels, from the back to the front."""
        view, tint, width = self._view, self._tint, self._size[0]
        dark, light = mix_colours(tint, BACKGROUND, 0.55), mix_colours(tint, INK, 0.35)
        turret = self._pixel(0.0, 0.28)
        direction = math.cos(gun.angle), -math.sin(gun.angle)
        muzzle = turret[0] + BARREL_LENGTH * width * direction[0], turret[1] + BARREL_LENGTH * width * direction[1]
        thickness = max(0.10 * width, 2.0)
        draw_line(
            view.surface,
            turret,
            muzzle,
            mix_colours(dark, BACKGROUND, 0.4),
            thickness + 2.0 * view.ui_scale,
            view.antialias,
        )
        draw_line(view.surface, turret, muzzle, mix_colours(tint, (90, 94, 104), 0.5), thickness, view.antialias)
        brake = (
            turret[0] + 0.86 * BARREL_LENGTH * width * direction[0],
            turret[1] + 0.86 * BARREL_LENGTH * width * direction[1],
        )
        draw_line(view.surface, brake, muzzle, light, thickness + 1.0, view.antialias)
        dome = [
            self._pixel(0.21 * math.cos(a), 0.22 + 0.40 * math.sin(a)) for a in np.linspace(0.0, math.pi, 14).tolist()
        ]
        fill_polygon(view.surface, dome, mix_colours(tint, INK, 0.12), view.antialias)
        fill_polygon(view.surface, [self._pixel(x, y) for x, y in HULL], tint, view.antialias)
        draw_line(
            view.surface, self._pixel(-0.40, 0.16), self._pixel(0.40, 0.16), light, 1.2 * view.ui_scale, view.antialias
        )
        track = [
            self._pixel(x + 0.16 * math.cos(a), -0.24 + 0.26 * math.sin(a))
            for x, begin in ((0.34, -0.5), (-0.34, 0.5))
            for a in np.linspace(begin * math.pi, (begin + 1.0) * math.pi, 8).tolist()
        ]
        fill_polygon(view.surface, track, (32, 32, 38), view.antialias)
        for x in (-0.32, -0.11, 0.11, 0.32):
            draw_dot(view.surface, self._pixel(x, -0.24), 0.075 * width, mix_colours(dark, INK, 0.25))


def _draw_gun_setting(view: DrawContext, gunnery: ArtilleryViewState, gun: GunView, at: Pixel, width: float) -> None:
    """Draw the setting of a gun: dots along its direction, and a power bar and text below the tank."""
    turret = at[0], at[1] - 0.28 * width * gunnery.size[1] / gunnery.size[0]
    direction = math.cos(gun.angle), -math.sin(gun.angle)
    reach = max(AIM_LENGTH * view.camera.scale, 90.0 * view.ui_scale)
    first, count = BARREL_LENGTH * width + 6.0 * view.ui_scale, 14
    for k in range(count):
        fraction = (k + 1) / count
        lit = fraction <= gun.power + 0.5 / count
        distance = first + fraction * reach
        colour = mix_colours(YELLOW, ORANGE, fraction) if lit else (150, 150, 164)
        size = (2.6 if lit else 1.4) * view.ui_scale
        draw_dot(view.surface, (turret[0] + distance * direction[0], turret[1] + distance * direction[1]), size, colour)
    bar_width, bar_height = 64.0 * view.ui_scale, 7.0 * view.ui_scale
    box = pygame.Rect(round(at[0] - 0.5 * bar_width), round(at[1] + 0.42 * width), round(bar_width), round(bar_height))
    pygame.draw.rect(view.surface, BACKGROUND, box.inflate(4, 4), border_radius=round(bar_height))
    full = pygame.Rect(box.left, box.top, round(box.width * gun.power), box.height)
    pygame.draw.rect(view.surface, mix_colours(YELLOW, ORANGE, gun.power), full, border_radius=round(0.5 * bar_height))
    label = f"{math.degrees(gun.angle):.1f}°   {100.0 * gun.power:.1f} %"
    draw_text(
        view.surface, label, (box.centerx, box.bottom + 4 * view.ui_scale), 12 * view.ui_scale, INK, "midtop", bold=True
    )


def _draw_label(view: DrawContext, gun: GunView, at: Pixel, tint: RgbColour) -> None:
    """Draw the name of a player, and a health bar below it."""
    bar_width, bar_height = 44.0 * view.ui_scale, 4.0 * view.ui_scale
    box = pygame.Rect(round(at[0] - 0.5 * bar_width), round(at[1] - bar_height), round(bar_width), round(bar_height))
    if gun.health is not None:
        pygame.draw.rect(view.surface, BACKGROUND, box.inflate(3, 3), border_radius=3)
        colour = mix_colours(WARNING, GREEN, gun.health)
        pygame.draw.rect(view.surface, colour, pygame.Rect(box.topleft, (round(box.width * gun.health), box.height)))
    size = 13.0 * view.ui_scale
    name = mix_colours(tint, INK, 0.45)
    draw_text(
        view.surface, gun.name, (at[0] + 1, box.top - 2 * view.ui_scale + 1), size, BACKGROUND, "midbottom", bold=True
    )
    draw_text(view.surface, gun.name, (at[0], box.top - 2 * view.ui_scale), size, name, "midbottom", bold=True)


SKY_TONES: tuple[tuple[float, RgbColour], ...] = (
    (0.0, (13, 17, 34)),
    (0.30, (34, 42, 80)),
    (0.48, (92, 80, 120)),
    (0.60, (182, 118, 116)),
    (0.70, (232, 168, 122)),
    (1.0, (240, 186, 140)),
)
"""Colours by the fraction of the height of the picture, from the top."""
RIDGES: tuple[tuple[float, float, RgbColour], ...] = (
    (0.56, 0.22, (84, 74, 112)),
    (0.72, 0.18, (58, 56, 92)),
)
"""Mean level and vertical extent, in heights of the picture from the top, and colour of each ridge; nearest last."""
MIST: RgbColour = (176, 128, 122)
STARS = 140


@lru_cache(maxsize=2)
def sky_image(size: tuple[int, int]) -> pygame.Surface:
    """Return the sky for a picture size, px."""
    width, height = max(size[0], 1), max(size[1], 1)
    strip = pygame.Surface((1, height))
    for y in range(height):
        strip.set_at((0, y), sky_tone(y / height))
    sky = pygame.transform.scale(strip, (width, height))
    random = np.random.Generator(np.random.PCG64(7))
    for x, y, bright in random.uniform(size=(STARS, 3)).tolist():
        down = 0.6 * y * y
        colour = mix_colours(sky_tone(down), (240, 240, 255), 0.25 + 0.55 * bright * (1.0 - y))
        sky.set_at((int(x * (width - 1)), int(down * height)), colour)
    for k, (level, reach, colour) in enumerate(RIDGES):
        line = displaced(96, 0.5, k + 3)
        line = (line - line.mean()) / max(float(np.abs(line - line.mean()).max()), 1e-9)
        tops = np.interp(np.linspace(0.0, 95.0, width), np.arange(96), (level - 0.5 * reach * line) * height)
        _draw_ridge(sky, tops, colour)
    return sky


def sky_tone(fraction: float) -> RgbColour:
    """Return the colour of the sky at a fraction of the height of the picture, from the top."""
    for (above, first), (below, second) in pairwise(SKY_TONES):
        if fraction <= below:
            return mix_colours(first, second, (fraction - above) / (below - above))
    return SKY_TONES[-1][1]


def _draw_ridge(surface: pygame.Surface, tops: FloatArray, colour: RgbColour) -> None:
    """Draw a ridge that fades into mist downwards, by pixel columns with tops in px."""
    height = surface.get_height()
    strip = pygame.Surface((1, height), 0, surface)
    for y in range(height):
        strip.set_at((0, y), mix_colours(colour, MIST, 0.75 * (1.0 - math.exp(-3.0 * y / height))))
    surface.blits([(strip, (x, top)) for x, top in enumerate(np.floor(tops).astype(int).tolist())], doreturn=False)
    if len(tops) > 1:
        pygame.draw.aalines(surface, mix_colours(colour, MIST, 0.3), False, list(enumerate(tops.tolist())))


SOIL: RgbColour = (122, 92, 62)
GRASS: RgbColour = (150, 190, 96)
DEEP: RgbColour = (24, 21, 27)
HALF_DEPTH = 16.0
"""m, depth at which the colour is halfway from `SOIL` to `DEEP`"""
BAND_THICKNESS = 3.2
"""m, thickness of the alternating layers"""


def soil_of(scene: Scene) -> RgbColour:
    """Return the colour of the terrain near its surface."""
    wall = next((wall for wall in scene.walls if wall.name == GROUND), None)
    return SOIL if wall is None or wall.colour is None else hex_colour(wall.colour)


def draw_land(canvas: Canvas, scene: Scene) -> None:
    """Draw sky, terrain, its ends, and other static bodies."""
    canvas.surface.blit(sky_image(canvas.surface.get_size()), (0, 0))
    others = tuple(wall for wall in scene.walls if wall.name != GROUND)
    for wall in scene.walls:
        if wall.name == GROUND:
            _draw_ground(canvas, wall, soil_of(scene))
            _draw_sides(canvas, scene, wall)
    draw_static_bodies(canvas, scene.model_copy(update={"walls": others}))


def _draw_ground(canvas: Canvas, wall: Wall, soil: RgbColour) -> None:
    """Fill the area below a wall by pixel columns, each copied from one strip, and draw its edge."""
    pixels = canvas.camera.to_screen(np.asarray(wall.points))
    width, height = canvas.surface.get_size()
    left, right = max(int(np.ceil(pixels[0, 0])), 0), min(int(np.ceil(pixels[-1, 0])), width)
    if left >= right:
        return
    tops = np.interp(np.arange(left, right) + 0.5, pixels[:, 0], pixels[:, 1])
    strip = terrain_strip(soil, canvas.camera.scale, height, canvas.surface)
    first = np.clip(np.floor(tops), -height, height).astype(np.int64).tolist()
    canvas.surface.blits([(strip, (x, top)) for x, top in zip(range(left, right), first, strict=True)], doreturn=False)
    edge = mix_colours(GRASS, soil, 0.35)
    visible = np.flatnonzero((pixels[:, 0] >= -50.0) & (pixels[:, 0] <= width + 50.0))
    if len(visible) > 1:
        shown = pixels[max(int(visible[0]) - 1, 0) : int(visible[-1]) + 2]
        shown = np.column_stack((np.clip(shown[:, 0], -1e4, 1e4), np.clip(shown[:, 1], -1e4, 1e4)))
        corners = shown.tolist()
        for shift, colour in ((1.5 * canvas.ui_scale, mix_colours(edge, soil, 0.5)), (0.0, edge)):
            moved = [(x, y + shift) for x, y in corners]
            if canvas.antialias:
                pygame.draw.aalines(canvas.surface, colour, False, moved)
            pygame.draw.lines(canvas.surface, colour, False, moved, max(round(1.6 * canvas.ui_scale), 1))
        if canvas.antialias:
            pygame.draw.aalines(
                canvas.surface, mix_colours(edge, (255, 255, 240), 0.35), False, [(x, y - 1.0) for x, y in corners]
            )


def terrain_strip(soil: RgbColour, scale: float, height: int, like: pygame.Surface) -> pygame.Surface:
    """Return a pixel column of the terrain, from its surface down, two pictures high; `scale` is in px/m."""
    strip = pygame.Surface((1, max(2 * height, 1)), 0, like)
    for y in range(strip.get_height()):
        depth = y / scale
        tint = mix_colours(DEEP, soil, 0.5 ** (depth / HALF_DEPTH))
        layer = 0.10 if int(depth / BAND_THICKNESS) % 2 else 0.0
        strip.set_at((0, y), mix_colours(mix_colours(tint, (0, 0, 0), layer), GRASS, 0.35 * 0.5 ** (depth / 0.7)))
    return strip


def _draw_sides(canvas: Canvas, scene: Scene, wall: Wall) -> None:
    """Draw the ends of the terrain: solid lines if shells rebound, dashed ones if they reappear at the other end."""
    artillery = table_of(scene, Artillery)
    if artillery is None or artillery.edges == "open":
        return
    rubber = artillery.edges == "rubber"
    for x in (wall.points[0][0], wall.points[-1][0]):
        px = float(canvas.camera.to_screen(np.array((x, 0.0)))[0])
        foot = canvas.surface.get_height() + 1.0  # terrain reaches it
        if rubber:
            draw_line(canvas.surface, (px, foot), (px, -1.0), (58, 62, 92), 5.0 * canvas.ui_scale, canvas.antialias)
            draw_line(canvas.surface, (px, foot), (px, -1.0), FAINT, 1.5 * canvas.ui_scale, canvas.antialias)
        else:
            draw_dashes(canvas.surface, [((px, foot), (px, -1.0))], FAINT, 9.0 * canvas.ui_scale, canvas.antialias)


SMOKE: RgbColour = (214, 206, 200)
FLAME: tuple[RgbColour, ...] = ((255, 250, 222), (255, 204, 92), (238, 116, 48), (96, 62, 58))
"""Colours of an explosion, from its start to its end."""
OFF_SCREEN_MARGIN = 1e4
"""px, bound to which positions are clipped; far beyond every picture"""
MAX_TRAIL_POINTS = 400
"""number of points to which the path of a shell is thinned"""


def draw_below(view: DrawContext, gunnery: ArtilleryViewState) -> None:
    """Draw the layer behind the tanks: falling dirt, paths of shells, and the tracer."""
    for clod in gunnery.clods:
        _draw_falling_dirt(view, clod)
    for path in gunnery.paths:
        _draw_path(view, path, bool(gunnery.flying))
    if gunnery.tracer is not None:
        for x, y in view.camera.to_screen(gunnery.tracer[::4]).tolist():
            draw_dot(view.surface, (x, y), 1.3 * view.ui_scale, mix_colours(SKY, INK, 0.4))


def draw_above(view: DrawContext, gunnery: ArtilleryViewState) -> None:
    """Draw the layer in front of the tanks: shells, explosions, and the last impact."""
    frame = view.snapshot.frame
    for number in gunnery.flying:
        if number < len(frame.position) and frame.present[number]:
            x, y = view.camera.to_screen(frame.position[number]).tolist()
            draw_glow(view.surface, (x, y), 7.0 * view.ui_scale, (255, 190, 90), 90)
            draw_dot(view.surface, (x, y), max(2.6 * view.ui_scale, 2.0), (255, 246, 214))
    for burst in gunnery.bursts:
        _draw_explosion(view, burst)
    if gunnery.landed is not None and not gunnery.flying:
        _draw_impact(view, gunnery.landed)


def _draw_path(view: DrawContext, path: FloatArray, flying: bool) -> None:
    """Draw the path of a shell: fading with age during the flight, thin and dashed afterwards."""
    points = path[:: max(len(path) // MAX_TRAIL_POINTS, 1)]
    pixels = view.camera.to_screen(np.vstack((points, path[-1:]))).tolist()
    for k in range(len(pixels) - 1):
        age = 1.0 - k / len(pixels)
        fraction = max(0.75 - age, 0.16) if flying else 0.22
        if not flying and k % 3 == 2:
            continue  # dashed after the flight
        colour = mix_colours((70, 72, 104), SMOKE, fraction)
        (ax, ay), (bx, by) = pixels[k], pixels[k + 1]
        draw_line(view.surface, (ax, ay), (bx, by), colour, (1.0 + 1.4 * fraction) * view.ui_scale, view.antialias)


def _draw_falling_dirt(view: DrawContext, clod: FallingDirt) -> None:
    """Draw a column of falling dirt, and the sky where it will come to rest."""
    surface = view.surface
    ends = np.array([(clod.left, clod.top), (clod.right, clod.bottom), (clod.right, clod.floor)])
    pixels = np.clip(view.camera.to_screen(ends), -OFF_SCREEN_MARGIN, OFF_SCREEN_MARGIN)
    (left, top), (right, bottom), (_, floor) = pixels.tolist()
    rest_top = floor - (bottom - top)
    air = pygame.Rect(math.floor(left), math.floor(rest_top) - 4, math.ceil(right) - math.floor(left) + 1, 1)
    air.height = max(math.ceil(floor) - air.top, 1)
    air = air.clip(surface.get_rect())
    if air.width and air.height:
        surface.blit(sky_image(surface.get_size()), air.topleft, air)
    dirt = pygame.Rect(math.floor(left), math.floor(top), air.width, max(math.ceil(bottom) - math.floor(top), 1))
    dirt = dirt.clip(surface.get_rect())
    if dirt.width and dirt.height:
        soil = soil_of(view.snapshot.scene)
        surface.fill(mix_colours(soil, (0, 0, 0), 0.12), dirt)
        surface.fill(mix_colours(GRASS, soil, 0.4), pygame.Rect(dirt.left, dirt.top, dirt.width, min(2, dirt.height)))


def _draw_explosion(view: DrawContext, burst: ExplosionView) -> None:
    """Draw an explosion: a disc that grows, changes colour, and fades."""
    fraction = min(burst.age / EXPLOSION_DURATION, 1.0)
    x, y = view.camera.to_screen(np.asarray(burst.position)).tolist()
    radius = burst.radius * view.camera.scale * (0.35 + 0.75 * fraction**0.4)
    tones = ((150, 118, 84), (120, 94, 70), (96, 78, 62), (80, 70, 62)) if burst.dirt else FLAME
    tone_position = fraction * (len(tones) - 1)
    k = min(int(tone_position), len(tones) - 2)
    colour = mix_colours(tones[k], tones[k + 1], tone_position - k)
    for part, opacity in ((1.0, 0.45), (0.72, 0.6), (0.4, 0.8)):
        alpha = round(255 * opacity * (1.0 - fraction))
        draw_glow(view.surface, (x, y), radius * part, mix_colours(colour, tones[0], 1.0 - part), alpha)


def _draw_impact(view: DrawContext, landed: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Mark the impact of the last shot by a cross, and that of its exact trajectory by a ring."""
    (x, y), (ex, ey) = view.camera.to_screen(np.asarray(landed)).tolist()
    if all(abs(each) < 1e4 for each in (x, y, ex, ey)):
        size = 4.0 * view.ui_scale
        for sign in (-1.0, 1.0):
            draw_line(view.surface, (x - size, y - sign * size), (x + size, y + sign * size), INK, 1.6 * view.ui_scale)
        draw_dot(view.surface, (ex, ey), 7.0 * view.ui_scale, YELLOW, 1.4 * view.ui_scale)


def _draw_text_background(view: DrawContext, middle: tuple[float, float], size: tuple[float, float]) -> None:
    """Darken the background of a text."""
    box = pygame.Rect(0, 0, round(size[0]), round(size[1]))
    shade = pygame.Surface(box.size, pygame.SRCALPHA)
    pygame.draw.rect(shade, (*BACKGROUND, 120), box, border_radius=round(6.0 * view.ui_scale))
    box.center = round(middle[0]), round(middle[1])
    view.surface.blit(shade, box)


def _draw_wind(view: DrawContext, wind: float) -> None:
    """Draw direction and speed of the wind, at the left below the text of the run."""
    size = 13.0 * view.ui_scale
    middle, top = 96.0 * view.ui_scale, max(view.snapshot.below, 24.0 * view.ui_scale) + 20.0 * view.ui_scale
    half = min(max(7.0 * abs(wind), 8.0), 84.0) * view.ui_scale
    label = f"wind {abs(wind):.1f} m/s" if wind else "no wind"
    _draw_text_background(view, (middle, top + 7.0 * view.ui_scale), (172.0 * view.ui_scale, 44.0 * view.ui_scale))
    draw_text(view.surface, label, (middle + 1, top + 9 * view.ui_scale + 1), size, BACKGROUND, "midtop", bold=True)
    draw_text(view.surface, label, (middle, top + 9 * view.ui_scale), size, INK, "midtop", bold=True)
    if wind:
        ends = (middle - half, top), (middle + half, top)
        begin, end = ends if wind > 0 else ends[::-1]
        draw_arrow(
            view.surface, begin, end, mix_colours(SKY, INK, 0.35), 4.0 * view.ui_scale, view.antialias, edge=BACKGROUND
        )


class ArtilleryView(GameView):
    """Draws sky and terrain, tanks with their guns, shells, explosions, and the wind."""

    def background(self, ctx: DrawContext) -> bool:
        """Draw sky, terrain and static bodies."""
        draw_land(ctx, ctx.snapshot.scene)
        return True

    def below(self, ctx: DrawContext) -> None:
        """Draw falling dirt, paths of shells and the tracer."""
        if isinstance(ctx.snapshot.game, ArtilleryViewState):
            draw_below(ctx, ctx.snapshot.game)

    def bodies(self, ctx: DrawContext) -> IntArray:
        """Draw the tanks."""
        state = ctx.snapshot.game
        if not isinstance(state, ArtilleryViewState):
            return np.empty(0, np.int64)
        tanks = [gun.number for gun in state.guns]
        draw_tanks(ctx, state, {number: _rgb(ctx.body_colours[number]) for number in tanks})
        return np.asarray(tanks, np.int64)

    def above(self, ctx: DrawContext) -> None:
        """Draw shells, explosions, and the last impact."""
        if isinstance(ctx.snapshot.game, ArtilleryViewState):
            draw_above(ctx, ctx.snapshot.game)

    def hud(self, ctx: DrawContext) -> None:
        """Draw the wind."""
        if isinstance(ctx.snapshot.game, ArtilleryViewState) and ctx.snapshot.game.wind is not None:
            _draw_wind(ctx, ctx.snapshot.game.wind)


def _rgb(colour: ColourArray) -> RgbColour:
    red, green, blue = colour.tolist()
    return red, green, blue
