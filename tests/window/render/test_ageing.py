"""Particles that fade: the colours of their ages, as points and as discs."""

from dataclasses import replace

import numpy as np
import pytest

from sandbox.scene.compile.bodies import Bodies
from sandbox.window.render import particles as ageing
from sandbox.window.render.particles import SHADES, LifetimeColours, fade_colours
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import at, drawn, frame, scene, sight

FADING = {
    "velocity_min": [0.0, 0.0],
    "velocity_max": [0.0, 0.0],
    "lifetime": 2.0,
    "colours": ["#ff0000", "#00ff00", "#0000ff"],
}


def one(x: float, radius: float, **more: object) -> dict:
    return {**FADING, "position": [x, 0.0], "count": 1, "radius": radius, **more}


def seen(which, time: float, x: float = 0.0, bodies: Bodies | None = None) -> tuple[int, ...]:
    what = sight(which, frame=frame(which, time=time), bodies=which.bodies if bodies is None else bodies)
    return tuple(map(int, at(drawn(what), x, 0.0)))


def test_colours_are_mixed_in_equal_parts_and_reach_both_ends():
    shades = fade_colours(("#ff0000", "#00ff00", "#0000ff")).astype(int)
    assert len(shades) == SHADES
    assert shades[0].tolist() == [255, 0, 0]
    assert shades[-1].tolist() == [0, 0, 255]
    assert (np.abs(shades.sum(axis=1) - 255) <= 1).all()  # each channel is rounded to a whole number
    assert np.abs(np.diff(shades, axis=0)).max() <= 9  # 510/63 a step, rounded


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_a_particle_has_the_colour_of_its_age(radius):
    which = scene(emitter=[one(0.0, radius)])
    assert seen(which, 0.0) == (255, 0, 0)
    red, green, blue = seen(which, 1.0)
    assert max(red, blue) <= 9 and green >= 245  # half-way lies between two of 64 shades
    assert seen(which, 1.999) == (0, 0, 255)
    assert seen(which, 5.0) == (0, 0, 255)  # where a run goes on without its being retired, it stays as it was last


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_age_counts_from_its_own_birth(radius):
    which = scene(emitter=[one(0.0, radius)])
    later = replace(which.bodies, born=np.asarray([7.0]))
    assert seen(which, 7.0, bodies=later) == (255, 0, 0)
    assert seen(which, 8.999, bodies=later) == (0, 0, 255)


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_those_who_do_not_fade_keep_their_colours(radius):
    still = {**FADING, "radius": radius, "count": 1, "colours": None, "lifetime": None}
    which = scene(
        emitter=[
            one(-3.0, radius),
            {k: v for k, v in still.items() if v is not None} | {"position": [0.0, 0.0], "colour": "#405060"},
            one(3.0, radius, colours=["#000000", "#ffffff"]),
        ]
    )
    made = LifetimeColours(which.bodies)
    assert len(made) == 2
    assert np.asarray(made.who).tolist() == [0, 2]
    for time, first, last in ((0.0, (255, 0, 0), (0, 0, 0)), (1.999, (0, 0, 255), (255, 255, 255))):
        assert seen(which, time, -3.0) == first
        assert seen(which, time, 0.0) == (0x40, 0x50, 0x60)
        assert seen(which, time, 3.0) == last


def test_contact_colours_outrank_ages():
    which = scene(emitter=[one(0.0, 1.0)])
    shown = drawn(sight(which, overlapping=np.asarray([False])))
    assert at(shown, 0.0, 0.0) != (255, 0, 0)


def test_one_picture_shows_every_age_in_turn():
    which, picture = scene(emitter=[one(0.0, 0.02)]), Renderer()
    for time in (0.0, 1.999, 0.0):
        what = sight(which, frame=frame(which, time=time))
        assert (drawn(what, picture=picture) == drawn(what)).all()


def test_crowds_fade_alike_compiled_and_not(monkeypatch):
    crowd = {"velocity_max": [1.0, 1.0], "count": 30_000, "lifetime_jitter": 1.5, "position": [0.0, 0.0]}
    which = scene(emitter=[{**FADING, **crowd}, {**FADING, **crowd, "colours": ["#000000", "#ffffff"]}])
    bodies = replace(which.bodies, born=np.linspace(-0.5, 0.5, len(which.bodies)))
    made = LifetimeColours(bodies)
    shades = np.arange(len(made.shades), dtype=np.uint32)
    for time in (0.0, 0.7, 3.0):
        seen = []
        for many in (1, 10**9):
            monkeypatch.setattr(ageing, "MANY_PARTICLES", many)
            tones = np.zeros(len(bodies), np.uint32)
            made.fade(tones, shades, time)
            seen.append(tones)
        assert np.array_equal(*seen)
    assert len(np.unique(seen[0])) > 2
