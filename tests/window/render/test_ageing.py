"""Fading particles: colours by age, drawn as points and as discs."""

from dataclasses import replace

import numpy as np
import pytest

from sandbox.scene.compile.bodies import Bodies
from sandbox.window.render import particles as module
from sandbox.window.render.particles import SHADES, LifetimeColours, fade_colours
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import colour_at, frame, render, scene, snapshot

FADING = {
    "velocity_min": [0.0, 0.0],
    "velocity_max": [0.0, 0.0],
    "lifetime": 2.0,
    "colours": ["#ff0000", "#00ff00", "#0000ff"],
}


def particle(x: float, radius: float, **more: object) -> dict:
    return {**FADING, "position": [x, 0.0], "count": 1, "radius": radius, **more}


def drawn_colour(model, time: float, x: float = 0.0, bodies: Bodies | None = None) -> tuple[int, ...]:
    shown = snapshot(model, frame=frame(model, time=time), bodies=model.bodies if bodies is None else bodies)
    return tuple(map(int, colour_at(render(shown), x, 0.0)))


def test_fade_colours_are_evenly_spaced_and_reach_both_ends():
    shades = fade_colours(("#ff0000", "#00ff00", "#0000ff")).astype(int)
    assert len(shades) == SHADES
    assert shades[0].tolist() == [255, 0, 0]
    assert shades[-1].tolist() == [0, 0, 255]
    assert (np.abs(shades.sum(axis=1) - 255) <= 1).all()  # each channel is rounded to a whole number
    assert np.abs(np.diff(shades, axis=0)).max() <= 9  # 510/63 a step, rounded


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_particle_has_the_colour_of_its_age(radius):
    model = scene(emitter=[particle(0.0, radius)])
    assert drawn_colour(model, 0.0) == (255, 0, 0)
    red, green, blue = drawn_colour(model, 1.0)
    assert max(red, blue) <= 9 and green >= 245  # half-way is between two of 64 shades
    assert drawn_colour(model, 1.999) == (0, 0, 255)
    assert drawn_colour(model, 5.0) == (0, 0, 255)  # a particle that is not retired keeps its last colour


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_age_is_counted_from_the_birth_time(radius):
    model = scene(emitter=[particle(0.0, radius)])
    later = replace(model.bodies, born=np.asarray([7.0]))
    assert drawn_colour(model, 7.0, bodies=later) == (255, 0, 0)
    assert drawn_colour(model, 8.999, bodies=later) == (0, 0, 255)


@pytest.mark.parametrize("radius", [0.02, 1.0])
def test_particles_without_fading_keep_their_colours(radius):
    not_fading = {**FADING, "radius": radius, "count": 1, "colours": None, "lifetime": None}
    model = scene(
        emitter=[
            particle(-3.0, radius),
            {k: v for k, v in not_fading.items() if v is not None} | {"position": [0.0, 0.0], "colour": "#405060"},
            particle(3.0, radius, colours=["#000000", "#ffffff"]),
        ]
    )
    colours = LifetimeColours(model.bodies)
    assert len(colours) == 2
    assert np.asarray(colours.indices).tolist() == [0, 2]
    for time, first, last in ((0.0, (255, 0, 0), (0, 0, 0)), (1.999, (0, 0, 255), (255, 255, 255))):
        assert drawn_colour(model, time, -3.0) == first
        assert drawn_colour(model, time, 0.0) == (0x40, 0x50, 0x60)
        assert drawn_colour(model, time, 3.0) == last


def test_contact_colours_override_age_colours():
    model = scene(emitter=[particle(0.0, 1.0)])
    shown = render(snapshot(model, overlapping=np.asarray([False])))
    assert colour_at(shown, 0.0, 0.0) != (255, 0, 0)


def test_reused_renderer_draws_the_current_age():
    model, renderer = scene(emitter=[particle(0.0, 0.02)]), Renderer()
    for time in (0.0, 1.999, 0.0):
        shown = snapshot(model, frame=frame(model, time=time))
        assert (render(shown, renderer=renderer) == render(shown)).all()


def test_compiled_and_numpy_fading_agree(monkeypatch):
    crowd = {"velocity_max": [1.0, 1.0], "count": 30_000, "lifetime_jitter": 1.5, "position": [0.0, 0.0]}
    model = scene(emitter=[{**FADING, **crowd}, {**FADING, **crowd, "colours": ["#000000", "#ffffff"]}])
    bodies = replace(model.bodies, born=np.linspace(-0.5, 0.5, len(model.bodies)))
    colours = LifetimeColours(bodies)
    shades = np.arange(len(colours.shades), dtype=np.uint32)
    for time in (0.0, 0.7, 3.0):
        results = []
        for threshold in (1, 10**9):
            monkeypatch.setattr(module, "MANY_PARTICLES", threshold)
            tones = np.zeros(len(bodies), np.uint32)
            colours.fade(tones, shades, time)
            results.append(tones)
        assert np.array_equal(*results)
    assert len(np.unique(results[0])) > 2
