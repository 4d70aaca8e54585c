import math
from itertools import pairwise

import numpy as np
import pygame
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.window.camera import Camera
from sandbox.window.render.draw_context import Canvas
from sandbox.window.render.grid import MIN_LINE_SPACING, draw_grid, draw_scale, step_of
from sandbox.window.render.palette import BACKGROUND, FAINT, GRID, GRID_STRONG, SOLID, SURFACE
from sandbox.window.render.static_geometry import draw_static_bodies
from tests.window.render.drawn import CAMERA, SIZE, changed_pixels, colour_at, render, scene, snapshot


def render_static(camera=CAMERA, *, antialias=True, **tables) -> np.ndarray:
    surface = pygame.Surface(camera.size)
    surface.fill(BACKGROUND)
    draw_static_bodies(Canvas(surface, camera, antialias=antialias), scene(**tables))
    return pygame.surfarray.array3d(surface)


def plane(x, y, nx, ny, **more):
    return {"point": [x, y], "normal": [nx, ny], **more}


@pytest.mark.parametrize("antialias", [True, False])
@pytest.mark.parametrize("degrees", range(0, 360, 30))
def test_a_plane_is_solid_behind_its_normal(degrees, antialias):
    nx, ny = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    picture = render_static(plane=[plane(0.5, 0.3, 7 * nx, 7 * ny)], antialias=antialias)
    column, row = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5, indexing="ij")
    x, y = (column - SIZE[0] / 2) / CAMERA.scale, (SIZE[1] / 2 - row) / CAMERA.scale
    height = ((x - 0.5) * nx + (y - 0.3) * ny) * CAMERA.scale  # px
    assert (picture[height > 1.0] == BACKGROUND).all()
    assert (picture[height < -14.0] == SOLID).all()  # behind the hatching
    assert (picture[(height < -0.5) & (height > -1.5)] == SURFACE).all()


@given(x=st.floats(-1e16, 1e16), y=st.floats(-1e16, 1e16), turn=st.floats(0, 7), power=st.floats(-14, 12))
def test_plane_at_any_distance_is_drawn_correctly(x, y, turn, power):
    camera = Camera((0.0, 0.0), 10.0**power, (40, 30))
    nx, ny = math.cos(turn), math.sin(turn)
    picture = render_static(camera, plane=[plane(x, y, nx, ny)])
    height = -(x * nx + y * ny) * camera.scale
    if abs(height) > 50.0:  # px: the picture is on one side of the plane
        assert (picture == (BACKGROUND if height > 0 else SOLID)).all()


def test_plane_is_drawn_in_its_own_colour():
    own = render_static(plane=[plane(0, 0, 0, 1, colour="#ff0000")])
    assert tuple(own[100, 61]) == (255, 0, 0)  # the edge is 2 px below the surface
    red, green, _ = (int(channel) for channel in own[100, 110])
    assert red > 2 * green


def test_width_of_a_wall_is_its_thickness():
    picture = render_static(wall=[{"points": [[-2, 0], [2, 0]], "thickness": 1.0}])
    solid = changed_pixels(picture, np.full_like(picture, BACKGROUND)).sum(1)
    assert (solid[60:140] == 20).all()
    assert solid.sum() == pytest.approx(80 * 20 + math.pi * 10**2, rel=0.02)  # pixels at the rim count in full
    assert colour_at(picture, 0.0, 0.0) == SOLID
    assert colour_at(picture, 2.4, 0.0) != BACKGROUND, "ends are round"
    assert colour_at(picture, 2.4, 0.4) == BACKGROUND, "ends are round"


@pytest.mark.parametrize(("ui_scale", "width"), [(1.0, 2), (2.0, 4)])
def test_a_wall_without_thickness_is_a_line(ui_scale, width):
    surface = pygame.Surface(SIZE)
    draw_static_bodies(Canvas(surface, CAMERA, ui_scale), scene(wall=[{"points": [[0, -2], [0, 2]]}]))
    covered = pygame.surfarray.array3d(surface)[:, 60].sum(1) / sum(SURFACE)
    assert covered.sum() == pytest.approx(width, abs=0.02)  # 8 bits a pixel


def test_closed_wall_is_drawn_back_to_its_start():
    corners = [[-2, -2], [2, -2], [2, 2], [-2, 2]]
    assert colour_at(render_static(wall=[{"points": corners, "closed": True}]), -2.0, 0.0) == SURFACE
    assert colour_at(render_static(wall=[{"points": corners}]), -2.0, 0.0) == BACKGROUND


def test_thick_wall_has_no_outline_inside_its_corner():
    picture = render_static(wall=[{"points": [[-3, 0], [0, 0], [0, -3]], "thickness": 1.0}])
    for k in range(-7, 8):
        assert colour_at(picture, 0.03 * k, 0.03 * k) == SOLID


def test_a_wall_of_many_points_is_drawn():
    turn = np.linspace(0, 2 * math.pi, 5000)
    points = np.stack((2 * np.cos(turn), 2 * np.sin(turn)), 1).tolist()
    picture = render_static(wall=[{"points": points, "thickness": 0.3}])
    assert colour_at(picture, 0.0, 2.0) != BACKGROUND
    assert colour_at(picture, 0.0, 0.0) == BACKGROUND


@given(
    points=st.lists(st.tuples(st.floats(-1e16, 1e16), st.floats(-1e16, 1e16)), min_size=2, max_size=4, unique=True),
    thickness=st.floats(0, 1e9),
    power=st.floats(-14, 12),
)
def test_walls_and_posts_at_any_distance_are_drawn(points, thickness, power):
    camera = Camera(points[0], 10.0**power, (40, 30))
    surface = pygame.Surface(camera.size)
    assume(all(math.dist(a, b) >= 1e-9 for a, b in pairwise(points)))  # m: the shortest valid segment of a wall
    wall = {"points": [list(p) for p in points], "thickness": thickness}
    post = {"position": list(points[1]), "radius": max(thickness, 1e-9)}
    for more in ({}, {"solid": False}, {"one_way": True}):
        post_keys = {key: value for key, value in more.items() if key == "solid"}
        draw_static_bodies(Canvas(surface, camera), scene(wall=[{**wall, **more}], post=[{**post, **post_keys}]))
    if thickness * camera.scale > 10.0:  # px: the first point of the wall is in the middle of the picture
        surface.fill(BACKGROUND)
        draw_static_bodies(Canvas(surface, camera), scene(wall=[wall]))
        assert surface.get_at((20, 15))[:3] == SOLID


def test_walls_and_posts_that_are_not_solid_are_faint_outlines():
    solid_items = {
        "wall": [{"points": [[-2, 1], [2, 1]], "thickness": 0.5}],
        "post": [{"position": [1, -1], "radius": 0.6}],
    }
    faint_items = {kind: [{**each, "solid": False} for each in items] for kind, items in solid_items.items()}
    solid, faint = render_static(**solid_items), render_static(**faint_items)
    pixels = [changed_pixels(each, np.full_like(each, BACKGROUND)) for each in (solid, faint)]
    assert 0 < pixels[1].sum() < 0.3 * pixels[0].sum()
    assert colour_at(faint, 1.0, -1.0) == BACKGROUND
    assert faint.max() < solid.max()


@pytest.mark.parametrize("direction", [1, -1])
def test_arrows_show_the_passing_direction_of_a_one_way_wall(direction):
    gate = {"points": [[0, -2 * direction], [0, 2 * direction]], "thickness": 0.1}
    arrows = changed_pixels(render_static(wall=[{**gate, "one_way": True}]), render_static(wall=[gate]))
    column, _ = np.nonzero(arrows)
    assert len(column) > 10
    assert ((column - SIZE[0] / 2) * direction <= 0).all()  # on the left side of its direction


def test_a_post_is_a_filled_circle_with_a_ring_if_it_has_a_kick():
    post = {"position": [1, 1], "radius": 1.0}
    plain, kicking = render_static(post=[post]), render_static(post=[{**post, "kick": {"speed": 1}}])
    area = changed_pixels(plain, np.full_like(plain, BACKGROUND)).sum()
    assert area == pytest.approx(math.pi * 20**2, rel=0.08)  # pixels at the rim count in full
    assert colour_at(plain, 1.0, 1.0) != BACKGROUND
    column, row = np.nonzero(changed_pixels(kicking, plain))
    distance = np.hypot(column + 0.5 - 120, row + 0.5 - 40) / CAMERA.scale
    assert 0.55 < distance.max() < 0.65


def test_bounds_overlay_draws_a_dashed_rectangle():
    box = scene(world={"bounds": [[-4, -2], [4, 2]]})
    differ = changed_pixels(render(snapshot(box)), render(snapshot(box, "bounds")))
    column, row = np.nonzero(differ)
    assert (column.min(), column.max()) == pytest.approx((20, 180), abs=1)  # a line's width
    assert (row.min(), row.max()) == pytest.approx((20, 100), abs=1)  # the same
    along = differ[22:178, 20]
    assert 0.3 < along.mean() < 0.7, "as much gap as dash"


@given(power=st.floats(-14.0, 12.0), ui_scale=st.sampled_from([1.0, 2.0]))
def test_grid_step_is_1_2_or_5_times_a_power_of_ten_and_wide_enough(power, ui_scale):
    step = step_of(Camera((0.0, 0.0), 10.0**power, SIZE), ui_scale)
    assert f"{step:.0e}"[0] in "125"
    assert step == pytest.approx(float(f"{step:.0e}"))
    assert (
        MIN_LINE_SPACING * ui_scale * (1 - 1e-9) <= step * 10.0**power <= 2.5 * MIN_LINE_SPACING * ui_scale * (1 + 1e-9)
    )  # rounding


def test_grid_lines_lie_at_multiples_of_the_step():
    surface = pygame.Surface(SIZE)
    draw_grid(Canvas(surface, CAMERA))
    step = step_of(CAMERA)
    picture = pygame.surfarray.array3d(surface)
    assert step == 5.0
    assert colour_at(picture, 0.0, 1.3) == GRID_STRONG
    assert colour_at(picture, step - 1e-9, 1.3) == (0, 0, 0)
    assert colour_at(picture, -step, 1.3) == GRID


def test_scale_bar_is_one_grid_step_long():
    surface = pygame.Surface((400, 200))
    camera = Camera((0.0, 0.0), 70.0, (400, 200))
    draw_scale(Canvas(surface, camera), foot=30.0)
    row = (pygame.surfarray.array3d(surface)[:, 200 - 30 - 18 - 1] == FAINT).all(1)
    assert row.sum() == round(step_of(camera) * 70.0)
