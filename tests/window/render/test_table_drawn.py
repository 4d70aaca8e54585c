"""Drawing of a billiards table: cloth, cushions, pockets, cue and balls, which roll; pocketed balls are hidden."""

import math

import numpy as np
import pytest

from sandbox.games.billiards.tables import TABLES
from sandbox.games.billiards.view.balls import IVORY, BallOrientations, paint_texture, texture_of
from sandbox.games.billiards.view.prediction import CueAim
from sandbox.games.billiards.view.table import CAROM, CUSHION_WIDTH, HOLE, POOL, SNOOKER, cushion_outlines, other_walls
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera
from sandbox.window.view_bounds import area_bounds, shorter_side, view_bounds
from tests.window.render import drawn

SIZE = (700, 400)
AT_REST = """
title = "t"
[billiards]
table = "pool-7ft"
[billiards.place]
cue = [0.5, 0.5]
8 = [0.7, 1.2]
"""


def render(scene: Scene, aim: CueAim | None = None, turned: bool = True, **state: object) -> tuple[np.ndarray, Camera]:
    camera = Camera.fitting(view_bounds(scene), SIZE, turned=turned)
    frame = drawn.frame(scene, roll=np.zeros((len(scene.bodies), 2)), **state)
    return drawn.render(drawn.snapshot(scene, frame=frame, game=aim), camera).astype(int), camera


def colour_at(picture: np.ndarray, camera: Camera, point: tuple[float, float]) -> np.ndarray:
    x, y = camera.to_screen(np.array(point)).tolist()
    return picture[round(x), round(y)]


@pytest.mark.parametrize("turned", [True, False])
def test_balls_are_drawn_at_their_positions_on_the_cloth(turned: bool) -> None:
    scene = loads(AT_REST)
    picture, camera = render(scene, turned=turned)
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
    picture, camera = render(scene)
    assert np.abs(colour_at(picture, camera, (0.8 * x, 0.61 * y)) - colours[0]).max() < 30  # as above


def test_ball_in_a_pocket_is_not_drawn() -> None:
    scene = loads(AT_REST)
    position = scene.bodies.position.copy()
    position[0] = scene.pockets[2].position
    picture, camera = render(scene, position=position, time=3.0)
    assert colour_at(picture, camera, scene.pockets[2].position).max() < 20


def test_cue_is_drawn_behind_the_ball() -> None:
    scene = loads(AT_REST)
    cue = scene.bodies.names.index("cue")
    without, camera = render(scene)
    picture, _ = render(scene, CueAim(cue, (0.5, 0.5), 0.0, 0.0, 0.0))
    assert np.abs(colour_at(picture, camera, (0.3, 0.5)) - colour_at(without, camera, (0.3, 0.5))).max() > 60
    back, _ = render(scene, CueAim(cue, (0.5, 0.5), 0.0, 0.0, 0.2))
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


def table_of(name: str, more: str = "") -> Scene:
    ball = "white" if name.startswith("carom") else "cue"
    return loads(f'title = "t"\n[billiards]\ntable = "{name}"\n[billiards.place]\n{ball} = [0.5, 0.5]\n{more}')


@pytest.mark.parametrize("name", TABLES)
def test_every_cushion_is_found_between_playing_area_and_rail(name: str) -> None:
    scene = table_of(name)
    area = scene.play.area
    assert area is not None
    found = cushion_outlines(scene, area)
    assert len(found) == (4 if name.startswith("carom") else 6)
    (left, bottom), (right, top) = area
    depth = CUSHION_WIDTH * shorter_side(area)
    for each in found:
        for x, y in each.outline:
            # A facing may end behind the edge of the rail, at its pocket.
            out = max(left - x, x - right, bottom - y, y - top)
            assert -1e-9 < out < max(depth, 0.1)
    assert area_bounds(area)[0][0] < left - depth
    assert other_walls(scene, area) == ((), ())


def test_cushion_noses_are_tangent_to_the_jaws() -> None:
    scene = table_of("pool-9ft")
    assert scene.play.area is not None
    jaws = [(post.position, post.radius) for post in scene.posts]
    for each in cushion_outlines(scene, scene.play.area):
        on_jaws = [
            point
            for point in each.nose
            if any(abs(math.dist(point, centre) - radius) < 1e-9 for centre, radius in jaws)  # rounding
        ]
        assert len(on_jaws) >= 8
        assert len(each.nose) - len(on_jaws) == 2  # the far ends of the facings


def test_cushions_without_jaws_share_their_corners_and_other_walls_are_not_cushions() -> None:
    scene = table_of("carom-10ft", "[[wall]]\npoints = [[0.2, 0.2], [0.2, 0.6]]\nheight = 0.037\n")
    assert scene.play.area is not None
    found = cushion_outlines(scene, scene.play.area)
    assert len(found) == 4
    assert len({(round(x, 9), round(y, 9)) for each in found for x, y in each.outline[2:]}) == 4
    assert other_walls(scene, scene.play.area) == ((scene.walls[0],), ())


RADIUS = 0.03
"""Radius of a ball, m."""


def rolling_frame(time: float, spin: tuple[float, float, float]) -> Frame:
    zero = np.zeros((1, 2))
    return Frame(time, zero, zero.copy(), np.zeros(1), np.array([spin[2]]), np.ones(1, np.bool_), np.array([spin[:2]]))


def rotation_of(spin: tuple[float, float, float], seconds: float, frames: int) -> np.ndarray:
    """Return the rotation of a ball during some seconds, (3, 3)."""
    rolling = BallOrientations()
    rolling.advance(rolling_frame(0.0, spin))
    before = rolling.turned[0].copy()
    for k in range(1, frames + 1):
        rolling.advance(rolling_frame(seconds * k / frames, spin))
    return rolling.turned[0] @ before.T


def test_rolling_one_circumference_rotates_a_ball_once() -> None:
    speed = 0.5
    seconds = 2.0 * math.pi * RADIUS / speed
    spin = (0.0, speed / RADIUS, 0.0)  # natural roll along +x
    # 60 rotations of 1e-16 each
    assert rotation_of(spin, seconds, 60) == pytest.approx(np.eye(3), abs=1e-12)


def test_top_of_a_rolling_ball_moves_forwards() -> None:
    top = rotation_of((0.0, 10.0, 0.0), 0.01, 1) @ np.array([0.0, 0.0, 1.0])
    assert top[0] == pytest.approx(math.sin(0.1), abs=1e-12)  # rounding


def test_side_spin_rotates_about_the_vertical() -> None:
    east = rotation_of((0.0, 0.0, 2.0), 0.5, 3) @ np.array([1.0, 0.0, 0.0])
    assert east == pytest.approx([math.cos(1.0), math.sin(1.0), 0.0], abs=1e-12)  # rounding


@pytest.mark.fail_slow(60)  # takes over half a second
def test_orientation_stays_orthogonal_over_long_rolling() -> None:
    rotation = rotation_of((300.0, -170.0, 40.0), 20.0, 2000)
    assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12)  # orthonormalised at every rolling_frame
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)


def test_time_that_stops_or_runs_backwards_keeps_the_orientation() -> None:
    rolling = BallOrientations()
    rolling.advance(rolling_frame(1.0, (1.0, 2.0, 3.0)))
    before, version = rolling.turned.copy(), rolling.version.copy()
    rolling.advance(rolling_frame(1.0, (1.0, 2.0, 3.0)))
    rolling.advance(rolling_frame(0.2, (1.0, 2.0, 3.0)))
    assert (rolling.turned == before).all()
    assert (rolling.version == version).all()
