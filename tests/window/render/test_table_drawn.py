"""Drawing of a billiards table: cloth, pockets, cue and balls; pocketed balls are hidden."""

import numpy as np
import pygame
import pytest

from sandbox.games.billiards.view.balls import IVORY, paint_texture, texture_of
from sandbox.games.billiards.view.prediction import CueAim
from sandbox.games.billiards.view.table import CAROM, HOLE, POOL, SNOOKER
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import Snapshot
from sandbox.window.render.renderer import Renderer
from sandbox.window.view_bounds import view_bounds

SIZE = (700, 400)
AT_REST = """
title = "t"
[billiards]
table = "pool-7ft"
[billiards.place]
cue = [0.5, 0.5]
8 = [0.7, 1.2]
"""


def frame_of(scene: Scene, position: np.ndarray | None = None, time: float = 0.0) -> Frame:
    bodies = scene.bodies
    positions = bodies.position if position is None else position
    none = np.zeros((len(bodies), 2))
    return Frame(
        time, positions.copy(), none, bodies.angle, np.zeros(len(bodies)), np.ones(len(bodies), np.bool_), none
    )


def render(scene: Scene, frame: Frame, aim: CueAim | None = None, turned: bool = True) -> tuple[np.ndarray, Camera]:
    camera = Camera.fitting(view_bounds(scene), SIZE, turned=turned)
    surface = pygame.Surface(SIZE)
    Renderer().draw(surface, camera, Snapshot(scene, scene.bodies, frame, game=aim))
    return pygame.surfarray.array3d(surface).astype(int), camera


def colour_at(picture: np.ndarray, camera: Camera, point: tuple[float, float]) -> np.ndarray:
    x, y = camera.to_screen(np.array(point)).tolist()
    return picture[round(x), round(y)]


@pytest.mark.parametrize("turned", [True, False])
def test_balls_are_drawn_at_their_positions_on_the_cloth(turned: bool) -> None:
    scene = loads(AT_REST)
    picture, camera = render(scene, frame_of(scene), turned=turned)
    white, black = colour_at(picture, camera, (0.505, 0.495)), colour_at(picture, camera, (0.72, 1.2))
    assert white.min() > 110
    assert black.max() < white.min()
    # Lighting changes the cloth by at most a fifth, and adds up to 14.
    assert np.abs(colour_at(picture, camera, (0.3, 1.7)) - POOL.bed).max() < 30
    hole = scene.pockets[0].position
    assert np.abs(colour_at(picture, camera, hole) - HOLE).max() < 4


@pytest.mark.parametrize(
    ("table", "game", "colours"),
    [("snooker-12ft", "snooker", SNOOKER), ("carom-10ft", "three-cushion", CAROM), ("pool-9ft", "9-ball", POOL)],
)
def test_cloth_has_the_colour_of_the_game(table: str, game: str, colours: object) -> None:
    scene = loads(f'title = "t"\n[billiards]\ntable = "{table}"\ngame = "{game}"\n')
    assert scene.play.area is not None
    x, y = scene.play.area[1]
    picture, camera = render(scene, frame_of(scene))
    assert np.abs(colour_at(picture, camera, (0.8 * x, 0.61 * y)) - colours[0]).max() < 30  # as above


def test_ball_in_a_pocket_is_not_drawn() -> None:
    scene = loads(AT_REST)
    position = scene.bodies.position.copy()
    position[0] = scene.pockets[2].position
    picture, camera = render(scene, frame_of(scene, position, time=3.0))
    assert colour_at(picture, camera, scene.pockets[2].position).max() < 20


def test_cue_is_drawn_behind_the_ball() -> None:
    scene = loads(AT_REST)
    cue = scene.bodies.names.index("cue")
    without, camera = render(scene, frame_of(scene))
    picture, _ = render(scene, frame_of(scene), CueAim(cue, (0.5, 0.5), 0.0, 0.0, 0.0))
    assert np.abs(colour_at(picture, camera, (0.3, 0.5)) - colour_at(without, camera, (0.3, 0.5))).max() > 60
    back, _ = render(scene, frame_of(scene), CueAim(cue, (0.5, 0.5), 0.0, 0.0, 0.2))
    beside = (0.5 - 0.0286 - 0.1, 0.5)  # uncovered when the cue is drawn back
    assert np.abs(colour_at(back, camera, beside) - colour_at(without, camera, beside)).max() < 40


def test_numbers_and_stripes_are_painted_on_the_ball() -> None:
    solid = texture_of("3", (208, 36, 36), struck=False)
    stripe = texture_of("11", (226, 138, 134), struck=False)
    face, side, pole = np.array([[0.0, 0.4, 0.9165]]), np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    assert paint_texture(solid, side, 20.0)[0] == pytest.approx(solid.colour, abs=1e-9)
    assert paint_texture(solid, pole, 20.0)[0] == pytest.approx(solid.colour, abs=1e-9)
    # The number is painted on a bright disc.
    assert paint_texture(solid, face, 20.0)[0].min() > paint_texture(solid, side, 20.0)[0].min() + 60
    assert paint_texture(stripe, pole, 20.0)[0] == pytest.approx(IVORY, abs=1e-9)
    assert paint_texture(stripe, side, 20.0)[0] == pytest.approx(stripe.colour, abs=1e-9)
