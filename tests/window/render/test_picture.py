import numpy as np
import pygame
import pytest

from sandbox.window.camera import Camera
from sandbox.window.render.palette import ACCENTS, BACKGROUND, CLEAR, FAINT, SOLID, TOUCHING
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import CAMERA, SIZE, at, ball, changed, drawn, frame, scene, sight

FLOOR = [{"point": [0.0, -2.0], "normal": [0.0, 1.0]}]


class SeesAll(Camera):
    """A camera that culls nothing."""

    def in_sight(self, position, radius):
        return np.isfinite(position).all(axis=1)


@pytest.mark.parametrize("antialias", [True, False])
def test_a_ball_has_its_colour_in_its_middle(antialias):
    picture = drawn(sight(scene(balls=[ball(-3, 0), ball(2, 1, 0.5)])), antialias=antialias)
    assert at(picture, -3.0, 0.0) == ACCENTS[0]
    assert at(picture, 2.0, 1.0) == ACCENTS[1]


def test_up_is_up():
    empty, picture = drawn(sight(scene(world={}))), drawn(sight(scene(balls=[ball(0, 2, 0.5)])))
    _, row = np.nonzero(changed(empty, picture))
    assert (row + 0.5).mean() == pytest.approx(60 - 2 * 20, abs=0.1)  # the rim's pixels, in quarters


def test_what_is_outside_changes_no_pixel():
    inside = drawn(sight(scene(balls=[ball(0, 0)])))
    outside = [ball(0, 0), ball(6.01, 0), ball(-7, 0), ball(0, 4.01), ball(0, -5), ball(1e15, 1e15, 1e9)]
    assert not changed(inside, drawn(sight(scene(balls=outside)), antialias=True)).any()


@pytest.mark.parametrize("antialias", [True, False])
def test_culling_changes_no_pixel(antialias):
    rng = np.random.default_rng(4)
    balls = [ball(*rng.uniform(-9, 9, 2).tolist(), float(rng.uniform(0.01, 1.5)), collides="none") for _ in range(150)]
    what = sight(scene(balls=balls, plane=FLOOR), "velocities", "centres", "bounds")
    unculled = SeesAll(CAMERA.centre, CAMERA.scale, CAMERA.size)
    assert not changed(drawn(what, antialias=antialias), drawn(what, unculled, antialias=antialias)).any()


def test_a_picture_is_the_same_whatever_was_drawn_before():
    what = sight(scene(balls=[ball(0, 0), ball(1, 1, 0.02)], plane=FLOOR), "centres")
    picture = Renderer()
    for k in range(1, 30):
        camera = Camera((0.1 * k, 0.0), 20.0 + k, SIZE)
        assert not changed(drawn(what, camera, picture=picture), drawn(what, camera)).any()
    assert not changed(drawn(what, picture=picture), drawn(what)).any()


def test_a_new_scene_or_size_is_noticed():
    picture = Renderer()
    drawn(sight(scene(plane=FLOOR)), picture=picture)
    assert at(drawn(sight(scene(world={})), picture=picture), 0.0, -2.5) != SOLID
    larger = Camera(CAMERA.centre, CAMERA.scale, (300, 200))
    what = sight(scene(plane=FLOOR))
    assert not changed(drawn(what, larger, picture=picture), drawn(what, larger)).any()


def test_without_shapes_bodies_are_hidden_and_fixed_things_are_not():
    what = scene(balls=[ball(0, 0), ball(2, 0, 0.01)], plane=FLOOR)
    hidden = drawn(sight(what, shapes=False))
    assert not changed(hidden, drawn(sight(scene(plane=FLOOR)))).any()
    assert changed(hidden, drawn(sight(what))).any()
    assert at(hidden, 0.0, -2.9) == SOLID


def test_those_not_present_are_not_drawn():
    what = scene(balls=[ball(0, 0), ball(2, 0)])
    gone = sight(what, frame=frame(what, present=np.asarray([True, False])))
    assert not changed(drawn(gone), drawn(sight(scene(balls=[ball(0, 0)])))).any()


def test_small_bodies_are_points_where_they_are():
    what = scene(balls=[ball(1.02, 1.02, 0.02), ball(-2.02, -1.02, 0.02)])
    differ = changed(drawn(sight(what)), drawn(sight(scene(world={}))))
    assert sorted(zip(*map(np.ndarray.tolist, np.nonzero(differ)), strict=True)) == [(59, 80), (120, 39)]


def test_contact_is_shown_by_colour_and_by_word():
    what = scene(balls=[ball(-2, 0, 1.5), ball(2, 0, 1.5)])
    picture = drawn(sight(what, overlapping=np.asarray([True, False])))
    assert at(picture, -2.0, -0.5) == TOUCHING
    assert at(picture, 2.0, -0.5) == CLEAR
    words = [(picture[a:b, 38:58].reshape(-1, 3) > 200).all(1).sum() for a, b in ((35, 85), (115, 165))]
    assert min(words) > 20, "words"
    assert words[0] != words[1], "different ones"


def test_only_what_can_turn_has_a_spoke():
    smooth, rough = (scene(balls=[ball(0, 0)], plane=[FLOOR[0] | {"friction": mu}]) for mu in (0.0, 0.5))
    differ = changed(drawn(sight(smooth)), drawn(sight(rough)))
    column, _ = np.nonzero(differ)
    assert len(column)
    assert column.min() > 100, "at angle 0 it lies to the right"
    assert changed(drawn(sight(scene(balls=[ball(0, 0)]))), drawn(sight(scene(balls=[ball(0, 0, angle=1.0)])))).any()


def test_the_scale_bar_lies_over_the_bodies():
    everywhere, nowhere = (drawn(sight(scene(balls=[ball(x, 0, 50.0)]))) for x in (0, 1000))
    bar = (nowhere[18:118, 120 - 18 - 1] == FAINT).all(1)
    assert bar.all()
    assert (everywhere[18:118, 120 - 18 - 1] == FAINT).all()


def test_units_scale_the_marks():
    what = sight(scene(balls=[ball(0, 0)], plane=FLOOR))
    assert changed(drawn(what), drawn(what, unit=2.0)).any()


def test_a_spawned_body_is_drawn():
    what = scene(balls=[ball(0, 0)])
    bodies = what.bodies.joined_by(scene(balls=[ball(3, 0)]).balls[0], "more")
    grown = frame(
        what,
        position=bodies.position,
        velocity=bodies.velocity,
        angle=bodies.angle,
        angular_velocity=bodies.angular_velocity,
        present=np.ones(2, np.bool_),
    )
    picture = Renderer()
    drawn(sight(what), picture=picture)
    assert at(drawn(sight(what, bodies=bodies, frame=grown), picture=picture), 3.0, 0.0) == ACCENTS[1]


@pytest.mark.parametrize("depth", [8, 16, 24, 32])
def test_any_format_of_surface_will_do(depth):
    surface = pygame.Surface(SIZE, 0, depth)
    Renderer().draw(surface, CAMERA, sight(scene(balls=[ball(0, 0), ball(2, 0, 0.01)], plane=FLOOR), "names", "bounds"))
    assert surface.get_at((100, 60))[:3] != BACKGROUND


def test_caches_do_not_grow_with_the_cameras():
    picture, what = Renderer(), sight(scene(balls=[ball(0, 0)], plane=FLOOR))
    for k in range(50):
        drawn(what, Camera((0.01 * k, 0.0), 20.0, SIZE), picture=picture)
    sprites = [sprite for known in picture._discs._sprites.values() for sprite in known.values()]
    assert len(sprites) <= 16  # a quarter of a pixel, across and down
