"""The picture as a whole, and the colours of bodies."""

import numpy as np
import pygame
import pytest

from sandbox.scene.description.discs import Ball
from sandbox.window.camera import Camera
from sandbox.window.render.palette import (
    ACCENTS,
    BACKGROUND,
    CLEAR,
    FAINT,
    NEUTRAL,
    SOLID,
    TOUCHING,
    colour_of,
    hex_colour,
    mix_colours,
)
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import CAMERA, SIZE, ball, changed_pixels, colour_at, frame, render, scene, snapshot

FLOOR = [{"point": [0.0, -2.0], "normal": [0.0, 1.0]}]
SPARKS = {"position": [0.0, 0.0], "velocity_min": [-1.0, 0.0], "velocity_max": [1.0, 1.0]}
FADING = {"count": 1, "radius": 0.02, "lifetime": 2.0, "colours": ["#ff0000", "#0000ff"]}


class UnculledCamera(Camera):
    """Camera without culling."""

    def in_sight(self, position, radius):
        return np.isfinite(position).all(axis=1)


@pytest.mark.parametrize("antialias", [True, False])
def test_ball_has_its_colour_at_its_centre(antialias):
    picture = render(snapshot(scene(balls=[ball(-3, 0), ball(2, 1, 0.5)])), antialias=antialias)
    assert colour_at(picture, -3.0, 0.0) == ACCENTS[0]
    assert colour_at(picture, 2.0, 1.0) == ACCENTS[1]


def test_bodies_outside_the_picture_change_no_pixel():
    inside = render(snapshot(scene(balls=[ball(0, 0)])))
    outside = [ball(0, 0), ball(6.01, 0), ball(-7, 0), ball(0, 4.01), ball(0, -5), ball(1e15, 1e15, 1e9)]
    boxes = [{"position": [x, y], "size": [1, 1]} for x, y in ((7, 0), (-6, 3), (0, 4), (1e12, -1e12), (0, -9))]
    assert not changed_pixels(inside, render(snapshot(scene(balls=outside, box=boxes)))).any()


@pytest.mark.parametrize("antialias", [True, False])
def test_culling_changes_no_pixel(antialias):
    rng = np.random.default_rng(4)
    balls = [ball(*rng.uniform(-9, 9, 2).tolist(), float(rng.uniform(0.01, 1.5)), collides="none") for _ in range(150)]
    shown = snapshot(scene(balls=balls, plane=FLOOR), "velocities", "centres", "bounds")
    unculled = UnculledCamera(CAMERA.centre, CAMERA.scale, CAMERA.size)
    assert not changed_pixels(render(shown, antialias=antialias), render(shown, unculled, antialias=antialias)).any()


def test_reused_renderer_draws_as_a_new_one():
    """Cameras, scenes, sizes, bodies and ages of particles change; each picture is also drawn by a new renderer."""
    shown = snapshot(scene(balls=[ball(0, 0), ball(1, 1, 0.02)], plane=FLOOR), "centres")
    grown, spark = scene(balls=[ball(0, 0), ball(3, 0)]), scene(emitter=[SPARKS | FADING])
    pictures = [(shown, Camera((0.1 * k, 0.0), 20.0 + k, SIZE)) for k in range(1, 30)]
    pictures += [(shown, CAMERA), (snapshot(scene(world={})), CAMERA), (shown, Camera((0.0, 0.0), 20.0, (300, 200)))]
    model = scene(balls=[ball(0, 0)])
    spawned = snapshot(model, bodies=grown.bodies, frame=frame(grown))
    pictures += [(snapshot(model), CAMERA), (spawned, CAMERA)]
    pictures += [(snapshot(spark, frame=frame(spark, time=t)), CAMERA) for t in (0.0, 1.9, 0.0)]
    renderer = Renderer()
    for each, camera in pictures:
        assert not changed_pixels(render(each, camera, renderer=renderer), render(each, camera)).any()
    assert colour_at(render(spawned, renderer=renderer), 3.0, 0.0) == ACCENTS[1]


def test_without_shapes_bodies_are_hidden_and_static_bodies_are_not():
    model = scene(balls=[ball(0, 0), ball(2, 0, 0.01)], plane=FLOOR)
    hidden = render(snapshot(model, shapes=False))
    assert not changed_pixels(hidden, render(snapshot(scene(plane=FLOOR)))).any()
    assert changed_pixels(hidden, render(snapshot(model))).any()
    assert colour_at(hidden, 0.0, -2.9) == SOLID


def test_absent_bodies_are_not_drawn():
    model = scene(balls=[ball(0, 0), ball(2, 0)])
    absent = snapshot(model, frame=frame(model, present=np.asarray([True, False])))
    assert not changed_pixels(render(absent), render(snapshot(scene(balls=[ball(0, 0)])))).any()


def test_small_bodies_are_drawn_as_points_at_their_positions():
    model = scene(balls=[ball(1.02, 1.02, 0.02), ball(-2.02, -1.02, 0.02)])
    differ = changed_pixels(render(snapshot(model)), render(snapshot(scene(world={}))))
    assert sorted(zip(*map(np.ndarray.tolist, np.nonzero(differ)), strict=True)) == [(59, 80), (120, 39)]


def test_overlap_is_shown_by_colour_and_text():
    model = scene(balls=[ball(-2, 0, 1.5), ball(2, 0, 1.5)])
    picture = render(snapshot(model, overlapping=np.asarray([True, False])))
    assert colour_at(picture, -2.0, -0.5) == TOUCHING
    assert colour_at(picture, 2.0, -0.5) == CLEAR
    words = [(picture[a:b, 38:58].reshape(-1, 3) > 200).all(1).sum() for a, b in ((35, 85), (115, 165))]
    assert min(words) > 20, "text"
    assert words[0] != words[1], "different texts"


def test_only_balls_that_can_rotate_have_a_spoke():
    smooth, rough = (scene(balls=[ball(0, 0)], plane=[FLOOR[0] | {"friction": mu}]) for mu in (0.0, 0.5))
    differ = changed_pixels(render(snapshot(smooth)), render(snapshot(rough)))
    column, _ = np.nonzero(differ)
    assert len(column)
    assert column.min() > 100, "at angle 0 it points to the right"
    assert changed_pixels(
        render(snapshot(scene(balls=[ball(0, 0)]))), render(snapshot(scene(balls=[ball(0, 0, angle=1.0)])))
    ).any()


def test_scale_bar_is_drawn_over_the_bodies():
    everywhere, nowhere = (render(snapshot(scene(balls=[ball(x, 0, 50.0)]))) for x in (0, 1000))
    bar = (nowhere[18:118, 120 - 18 - 1] == FAINT).all(1)
    assert bar.all()
    assert (everywhere[18:118, 120 - 18 - 1] == FAINT).all()


def test_unit_scales_the_marks():
    shown = snapshot(scene(balls=[ball(0, 0)], plane=FLOOR))
    assert changed_pixels(render(shown), render(shown, ui_scale=2.0)).any()


@pytest.mark.parametrize("depth", [8, 16, 24, 32])
def test_any_surface_format_is_supported(depth):
    surface = pygame.Surface(SIZE, 0, depth)
    Renderer().draw(
        surface, CAMERA, snapshot(scene(balls=[ball(0, 0), ball(2, 0, 0.01)], plane=FLOOR), "names", "bounds")
    )
    assert surface.get_at((100, 60))[:3] != BACKGROUND


def test_sprite_cache_does_not_grow_with_the_camera_position():
    renderer, shown = Renderer(), snapshot(scene(balls=[ball(0, 0)], plane=FLOOR))
    for k in range(50):
        render(shown, Camera((0.01 * k, 0.0), 20.0, SIZE), renderer=renderer)
    sprites = [sprite for known in renderer._discs._sprites.values() for sprite in known.values()]
    assert len(sprites) <= 16  # offsets of a quarter of a pixel in x and y


def test_balls_have_distinct_colours_and_fixed_ones_are_neutral_unless_they_state_one():
    keys = [*[{}] * 7, {"colour": "#102030"}, {"fixed": True}, {"fixed": True, "colour": "#ff0000"}]
    colours = colour_of(scene(balls=[ball(3 * k, 0, **more) for k, more in enumerate(keys)]).bodies).tolist()
    assert [tuple(colour) for colour in colours[:7]] == list(ACCENTS)
    assert len(set(ACCENTS)) == 7
    assert colours[7:] == [[16, 32, 48], list(NEUTRAL), [255, 0, 0]]


def test_large_generators_share_shades_and_small_ones_use_the_cycle():
    few = colour_of(scene(emitter=[{**SPARKS, "count": 3}]).bodies)
    many = colour_of(scene(emitter=[{**SPARKS, "count": 1000}]).bodies)
    assert [tuple(colour) for colour in few.tolist()] == list(ACCENTS[:3])
    assert 3 <= len(np.unique(many, axis=0)) <= 8  # few enough to share sprites, and more than one shade


def test_spawned_bodies_do_not_change_the_colours_of_others():
    bodies = scene(balls=[ball(0, 0), ball(3, 0)], emitter=[{**SPARKS, "count": 20}]).bodies
    grown = bodies
    for k in range(20):
        grown = grown.joined_by(Ball(position=(float(k), 5.0), radius=0.1), f"more-{k}")
    assert (colour_of(grown)[: len(bodies)] == colour_of(bodies)).all()


@pytest.mark.parametrize(("text", "colour"), [("#000000", (0, 0, 0)), ("#fF8001", (255, 128, 1))])
def test_hex_colour(text, colour):
    assert hex_colour(text) == colour


def test_mix_colours_reaches_both_ends():
    assert mix_colours((0, 10, 20), (100, 110, 120), 0.0) == (0, 10, 20)
    assert mix_colours((0, 10, 20), (100, 110, 120), 1.0) == (100, 110, 120)
