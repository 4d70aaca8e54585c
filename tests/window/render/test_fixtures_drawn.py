import math
from itertools import pairwise

import numpy as np
import pygame
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.window.camera import Camera
from sandbox.window.render.grid import NARROWEST, draw_grid, draw_scale, step_of
from sandbox.window.render.palette import BACKGROUND, FAINT, GRID, GRID_STRONG, SOLID, SURFACE
from sandbox.window.render.static_geometry import draw_static_bodies
from tests.window.render.drawn import CAMERA, SIZE, at, changed, drawn, scene, sight


def fixtures(camera=CAMERA, *, antialias=True, **tables) -> np.ndarray:
    surface = pygame.Surface(camera.size)
    surface.fill(BACKGROUND)
    draw_static_bodies(surface, camera, scene(**tables), antialias=antialias)
    return pygame.surfarray.array3d(surface)


def plane(x, y, nx, ny, **more):
    return {"point": [x, y], "normal": [nx, ny], **more}


@pytest.mark.parametrize("antialias", [True, False])
@pytest.mark.parametrize("degrees", range(0, 360, 30))
def test_a_plane_is_solid_behind_its_normal(degrees, antialias):
    nx, ny = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    picture = fixtures(plane=[plane(0.5, 0.3, 7 * nx, 7 * ny)], antialias=antialias)
    column, row = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5, indexing="ij")
    x, y = (column - SIZE[0] / 2) / CAMERA.scale, (SIZE[1] / 2 - row) / CAMERA.scale
    height = ((x - 0.5) * nx + (y - 0.3) * ny) * CAMERA.scale  # px
    assert (picture[height > 1.0] == BACKGROUND).all()
    assert (picture[height < -14.0] == SOLID).all()  # behind the hatching
    assert (picture[(height < -0.5) & (height > -1.5)] == SURFACE).all()


@given(x=st.floats(-1e16, 1e16), y=st.floats(-1e16, 1e16), turn=st.floats(0, 7), power=st.floats(-14, 12))
def test_no_plane_is_too_far(x, y, turn, power):
    camera = Camera((0.0, 0.0), 10.0**power, (40, 30))
    nx, ny = math.cos(turn), math.sin(turn)
    picture = fixtures(camera, plane=[plane(x, y, nx, ny)])
    height = -(x * nx + y * ny) * camera.scale
    if abs(height) > 50.0:  # px: the picture lies on one side of it
        assert (picture == (BACKGROUND if height > 0 else SOLID)).all()


def test_a_plane_has_its_own_colour():
    own = fixtures(plane=[plane(0, 0, 0, 1, colour="#ff0000")])
    assert tuple(own[100, 61]) == (255, 0, 0)  # the edge is 2 px below the surface
    red, green, _ = (int(channel) for channel in own[100, 110])
    assert red > 2 * green


def test_a_wall_is_as_wide_as_it_is_thick():
    picture = fixtures(wall=[{"points": [[-2, 0], [2, 0]], "thickness": 1.0}])
    solid = changed(picture, np.full_like(picture, BACKGROUND)).sum(1)
    assert (solid[60:140] == 20).all()
    assert solid.sum() == pytest.approx(80 * 20 + math.pi * 10**2, rel=0.02)  # pixels at the rim count in full
    assert at(picture, 0.0, 0.0) == SOLID
    assert at(picture, 2.4, 0.0) != BACKGROUND, "ends are round"
    assert at(picture, 2.4, 0.4) == BACKGROUND, "ends are round"


@pytest.mark.parametrize(("unit", "width"), [(1.0, 2), (2.0, 4)])
def test_a_wall_without_thickness_is_a_line(unit, width):
    surface = pygame.Surface(SIZE)
    draw_static_bodies(surface, CAMERA, scene(wall=[{"points": [[0, -2], [0, 2]]}]), unit)
    covered = pygame.surfarray.array3d(surface)[:, 60].sum(1) / sum(SURFACE)
    assert covered.sum() == pytest.approx(width, abs=0.02)  # 8 bits a pixel


def test_a_closed_wall_returns_to_its_start():
    corners = [[-2, -2], [2, -2], [2, 2], [-2, 2]]
    assert at(fixtures(wall=[{"points": corners, "closed": True}]), -2.0, 0.0) == SURFACE
    assert at(fixtures(wall=[{"points": corners}]), -2.0, 0.0) == BACKGROUND


def test_no_outline_shows_inside_the_corner_of_a_thick_wall():
    picture = fixtures(wall=[{"points": [[-3, 0], [0, 0], [0, -3]], "thickness": 1.0}])
    for k in range(-7, 8):
        assert at(picture, 0.03 * k, 0.03 * k) == SOLID


def test_a_wall_of_many_points_is_drawn():
    turn = np.linspace(0, 2 * math.pi, 5000)
    points = np.stack((2 * np.cos(turn), 2 * np.sin(turn)), 1).tolist()
    picture = fixtures(wall=[{"points": points, "thickness": 0.3}])
    assert at(picture, 0.0, 2.0) != BACKGROUND
    assert at(picture, 0.0, 0.0) == BACKGROUND


@given(
    points=st.lists(st.tuples(st.floats(-1e16, 1e16), st.floats(-1e16, 1e16)), min_size=2, max_size=4, unique=True),
    thickness=st.floats(0, 1e9),
    power=st.floats(-14, 12),
)
def test_no_wall_or_post_is_too_far(points, thickness, power):
    camera = Camera(points[0], 10.0**power, (40, 30))
    surface = pygame.Surface(camera.size)
    assume(all(math.dist(a, b) >= 1e-9 for a, b in pairwise(points)))  # m; nearer ones are no wall
    wall = {"points": [list(p) for p in points], "thickness": thickness}
    post = {"position": list(points[1]), "radius": max(thickness, 1e-9)}
    for more in ({}, {"solid": False}, {"one_way": True}):
        there = {key: value for key, value in more.items() if key == "solid"}
        draw_static_bodies(surface, camera, scene(wall=[{**wall, **more}], post=[{**post, **there}]))
    assert surface.get_size() == camera.size


def test_what_is_not_solid_is_fainter_and_leaves_the_background_free():
    there = {"wall": [{"points": [[-2, 1], [2, 1]], "thickness": 0.5}], "post": [{"position": [1, -1], "radius": 0.6}]}
    gone = {kind: [{**each, "solid": False} for each in those] for kind, those in there.items()}
    solid, faint = fixtures(**there), fixtures(**gone)
    drawn_of = [changed(each, np.full_like(each, BACKGROUND)) for each in (solid, faint)]
    assert 0 < drawn_of[1].sum() < 0.3 * drawn_of[0].sum()
    assert at(faint, 1.0, -1.0) == BACKGROUND
    assert faint.max() < solid.max()


@pytest.mark.parametrize("way", [1, -1])
def test_arrows_tell_which_way_a_gate_lets_pass(way):
    gate = {"points": [[0, -2 * way], [0, 2 * way]], "thickness": 0.1}
    arrows = changed(fixtures(wall=[{**gate, "one_way": True}]), fixtures(wall=[gate]))
    column, _ = np.nonzero(arrows)
    assert len(column) > 10
    assert ((column - SIZE[0] / 2) * way <= 0).all()  # left of its direction


def test_a_post_that_kicks_has_a_ring():
    post = {"position": [0, 0], "radius": 1.0}
    ring = changed(fixtures(post=[{**post, "kick": {"speed": 1}}]), fixtures(post=[post]))
    column, row = np.nonzero(ring)
    away = np.hypot(column + 0.5 - SIZE[0] / 2, row + 0.5 - SIZE[1] / 2) / CAMERA.scale
    assert 0.55 < away.max() < 0.65


def test_a_post_is_a_filled_circle():
    picture = fixtures(post=[{"position": [1, 1], "radius": 0.5}])
    area = changed(picture, np.full_like(picture, BACKGROUND)).sum()
    assert area == pytest.approx(math.pi * 10**2, rel=0.15)  # pixels at the rim count in full
    assert at(picture, 1.0, 1.0) != BACKGROUND


def test_bounds_are_dashed_and_shown_when_asked_for():
    box = scene(world={"bounds": [[-4, -2], [4, 2]]})
    differ = changed(drawn(sight(box)), drawn(sight(box, "bounds")))
    column, row = np.nonzero(differ)
    assert (column.min(), column.max()) == pytest.approx((20, 180), abs=1)  # a line's width
    assert (row.min(), row.max()) == pytest.approx((20, 100), abs=1)  # the same
    along = differ[22:178, 20]
    assert 0.3 < along.mean() < 0.7, "as much gap as dash"


@given(power=st.floats(-14.0, 12.0), unit=st.sampled_from([1.0, 2.0]))
def test_steps_are_1_2_or_5_and_wide_enough(power, unit):
    step = step_of(Camera((0.0, 0.0), 10.0**power, SIZE), unit)
    assert f"{step:.0e}"[0] in "125"
    assert step == pytest.approx(float(f"{step:.0e}"))
    assert NARROWEST * unit * (1 - 1e-9) <= step * 10.0**power <= 2.5 * NARROWEST * unit * (1 + 1e-9)  # rounding


def test_grid_lines_lie_at_multiples_of_the_step():
    surface = pygame.Surface(SIZE)
    draw_grid(surface, CAMERA)
    step = step_of(CAMERA)
    picture = pygame.surfarray.array3d(surface)
    assert step == 5.0
    assert at(picture, 0.0, 1.3) == GRID_STRONG
    assert at(picture, step - 1e-9, 1.3) == (0, 0, 0)
    assert at(picture, -step, 1.3) == GRID


def test_the_bar_is_one_step_long():
    surface = pygame.Surface((400, 200))
    camera = Camera((0.0, 0.0), 70.0, (400, 200))
    draw_scale(surface, camera, foot=30.0)
    row = (pygame.surfarray.array3d(surface)[:, 200 - 30 - 18 - 1] == FAINT).all(1)
    assert row.sum() == round(step_of(camera) * 70.0)
