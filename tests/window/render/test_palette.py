import numpy as np
import pytest

from sandbox.scene.description.discs import Ball
from sandbox.window.render.palette import ACCENTS, NEUTRAL, colour_of, colour_of_fixed, hex_colour, mix_colours
from tests.window.render.drawn import ball, scene

SPARKS = {"position": [0.0, 0.0], "velocity_min": [-1.0, 0.0], "velocity_max": [1.0, 1.0]}


def test_stated_colour_overrides_the_colour_cycle():
    bodies = scene(balls=[ball(0, 0, colour="#102030"), ball(3, 0)]).bodies
    assert colour_of(bodies).tolist() == [[16, 32, 48], list(ACCENTS[1])]


def test_seven_balls_have_distinct_colours():
    bodies = scene(balls=[ball(3 * k, 0) for k in range(7)]).bodies
    assert len({tuple(colour) for colour in colour_of(bodies).tolist()}) == 7


def test_fixed_balls_are_neutral():
    bodies = scene(balls=[ball(0, 0, fixed=True), ball(3, 0, fixed=True, colour="#ff0000")]).bodies
    assert colour_of(bodies).tolist() == [list(NEUTRAL), [255, 0, 0]]


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


def test_no_bodies_have_no_colours():
    assert colour_of(scene(world={"gravity": [0.0, -1.0]}).bodies).shape == (0, 3)


@pytest.mark.parametrize(("text", "colour"), [("#000000", (0, 0, 0)), ("#fF8001", (255, 128, 1))])
def test_hex_colour(text, colour):
    assert hex_colour(text) == colour


def test_mix_colours_reaches_both_ends():
    assert mix_colours((0, 10, 20), (100, 110, 120), 0.0) == (0, 10, 20)
    assert mix_colours((0, 10, 20), (100, 110, 120), 1.0) == (100, 110, 120)


def test_static_bodies_use_their_stated_colour():
    plane, other = scene(
        plane=[
            {"point": [0, 0], "normal": [0, 1], "colour": "#010203"},
            {"point": [0, 0], "normal": [1, 0]},
        ]
    ).planes
    assert colour_of_fixed(plane) == (1, 2, 3)
    assert colour_of_fixed(other, (9, 9, 9)) == (9, 9, 9)
