"""Land: the ground of a game under its sky, darker the deeper, with a lit edge; it changes with craters and camera."""

import numpy as np
import pygame

from sandbox.games.artillery.preset import GROUND
from sandbox.games.artillery.terrain import Artillery
from sandbox.play.camera import Camera
from sandbox.play.drawing.artillery.sky import sky
from sandbox.play.drawing.fixtures import draw_fixtures
from sandbox.play.drawing.palette import FAINT, Colour, hex_colour, mixed
from sandbox.play.drawing.strokes import dashes, stroke
from sandbox.scene.description.fixed import Wall
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.scene import Scene

SOIL: Colour = (122, 92, 62)
GRASS: Colour = (150, 190, 96)
DEEP: Colour = (24, 21, 27)
DARKENS = 16.0
"""m below the surface, at which ground is half as dark as at all"""
BAND = 3.2
"""m, between layers that are a little lighter"""


def soil_of(scene: Scene) -> Colour:
    """Return the colour of ground near its surface."""
    wall = next((wall for wall in scene.walls if wall.name == GROUND), None)
    return SOIL if wall is None or wall.colour is None else hex_colour(wall.colour)


def draw_land(surface: pygame.Surface, camera: Camera, scene: Scene, unit: float = 1.0, antialias: bool = True) -> None:
    """Draw sky, ground, and what else is fixed, as far as it is in sight."""
    surface.blit(sky(surface.get_size()), (0, 0))
    others = tuple(wall for wall in scene.walls if wall.name != GROUND)
    for wall in scene.walls:
        if wall.name == GROUND:
            _ground(surface, camera, wall, soil_of(scene), unit, antialias)
            _sides(surface, camera, scene, wall, unit, antialias)
    draw_fixtures(surface, camera, scene.model_copy(update={"walls": others}), unit, antialias)


def _ground(surface: pygame.Surface, camera: Camera, wall: Wall, soil: Colour, unit: float, antialias: bool) -> None:
    """Fill what lies below a wall, a column of pixels at a time, each cut from one strip."""
    places = camera.to_screen(np.asarray(wall.points))
    width, height = surface.get_size()
    left, right = max(int(np.ceil(places[0, 0])), 0), min(int(np.ceil(places[-1, 0])), width)
    if left >= right:
        return
    tops = np.interp(np.arange(left, right) + 0.5, places[:, 0], places[:, 1])
    strip = strip_of(soil, camera.scale, height, surface)
    first = np.clip(np.floor(tops), -height, height).astype(np.int64).tolist()
    surface.blits([(strip, (x, top)) for x, top in zip(range(left, right), first, strict=True)], doreturn=False)
    edge = mixed(GRASS, soil, 0.35)
    near = np.flatnonzero((places[:, 0] >= -50.0) & (places[:, 0] <= width + 50.0))
    if len(near) > 1:
        shown = places[max(int(near[0]) - 1, 0) : int(near[-1]) + 2]
        shown = np.column_stack((np.clip(shown[:, 0], -1e4, 1e4), np.clip(shown[:, 1], -1e4, 1e4)))
        corners = shown.tolist()
        for shift, colour in ((1.5 * unit, mixed(edge, soil, 0.5)), (0.0, edge)):
            moved = [(x, y + shift) for x, y in corners]
            if antialias:
                pygame.draw.aalines(surface, colour, False, moved)
            pygame.draw.lines(surface, colour, False, moved, max(round(1.6 * unit), 1))
        if antialias:
            pygame.draw.aalines(surface, mixed(edge, (255, 255, 240), 0.35), False, [(x, y - 1.0) for x, y in corners])


def strip_of(soil: Colour, scale: float, height: int, like: pygame.Surface) -> pygame.Surface:
    """Return one column of ground from its surface down, two pictures high, at a scale, px/m."""
    strip = pygame.Surface((1, max(2 * height, 1)), 0, like)
    for y in range(strip.get_height()):
        depth = y / scale
        tint = mixed(DEEP, soil, 0.5 ** (depth / DARKENS))
        layer = 0.10 if int(depth / BAND) % 2 else 0.0
        strip.set_at((0, y), mixed(mixed(tint, (0, 0, 0), layer), GRASS, 0.35 * 0.5 ** (depth / 0.7)))
    return strip


def _sides(surface: pygame.Surface, camera: Camera, scene: Scene, wall: Wall, unit: float, antialias: bool) -> None:
    """Draw what stands at the sides: walls of rubber, or where one side is the other."""
    artillery = table_of(scene, Artillery)
    if artillery is None or artillery.edges == "open":
        return
    rubber = artillery.edges == "rubber"
    for x in (wall.points[0][0], wall.points[-1][0]):
        px, foot = float(camera.to_screen(np.array((x, 0.0)))[0]), surface.get_height() + 1.0  # as far as dirt is seen
        if rubber:
            stroke(surface, (px, foot), (px, -1.0), (58, 62, 92), 5.0 * unit, antialias)
            stroke(surface, (px, foot), (px, -1.0), FAINT, 1.5 * unit, antialias)
        else:
            dashes(surface, [((px, foot), (px, -1.0))], FAINT, 9.0 * unit, antialias)
