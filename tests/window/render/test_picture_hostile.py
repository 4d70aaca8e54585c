import numpy as np
import pygame
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

from sandbox.trajectory import Contacts
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import OVERLAYS, MissedContactMarker
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import ball, contact, frame, render, scene, snapshot

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

ANY = st.floats(allow_nan=True, allow_infinity=True)
FAR = st.floats(-1e16, 1e16)
MODEL = scene(
    balls=[ball(0, 0), ball(3, 0, 1e-9), ball(5, 0, 1e9, collides="none"), ball(-3, 0, 0.3, angle=1.0)],
    plane=[{"point": [0.0, -2.0], "normal": [0.3, 1.0]}],
    wall=[{"points": [[-1e16, 1e16], [1e16, -1e15], [0.0, 3.0]], "thickness": 0.2}],
    post=[{"position": [2.0, 2.0], "radius": 0.4}],
    world={"gravity": [0.0, -9.81], "bounds": [[-1e15, -9.0], [9.0, 1e16]]},
)
COUNT = len(MODEL.bodies)


def arrays(*shape):
    return st_numpy.arrays(np.float64, shape, elements=ANY)


@st.composite
def snapshots(draw):
    position = draw(arrays(COUNT, 2) | st_numpy.arrays(np.float64, (COUNT, 2), elements=FAR))
    state = frame(
        MODEL,
        position=position,
        velocity=draw(arrays(COUNT, 2)),
        angle=draw(arrays(COUNT)),
        present=draw(st_numpy.arrays(np.bool_, COUNT)),
    )
    pair = st.tuples(st.integers(0, COUNT + 1), st.integers(-5, COUNT + 1))
    contacts = Contacts(
        np.zeros(3),
        np.asarray(draw(st.tuples(pair, pair, pair))),
        draw(arrays(3, 2)),
        draw(arrays(3, 2)),
        draw(arrays(3, 2)),
    )
    ghost = frame(MODEL, position=draw(arrays(COUNT, 2)))
    return snapshot(
        MODEL,
        *OVERLAYS,
        frame=state,
        contacts=contacts,
        seconds=draw(st.sampled_from([0.0, 0.01, np.nan, np.inf])),
        ghost=draw(st.sampled_from([None, ghost])),
        trails=(draw(arrays(5, COUNT, 2)), draw(arrays(2, COUNT - 1, 2)), np.empty((0, COUNT, 2))),
        overlapping=draw(st.sampled_from([None, np.asarray([True, False])])),
        flashes=(MissedContactMarker((draw(ANY), draw(ANY)), draw(ANY)), MissedContactMarker((0.0, 0.0), 0.5)),
        picked=draw(st.sampled_from([None, -1, 0, 2, 99])),
        pull=draw(
            st.sampled_from([None, ((0.0, 0.0), (1e16, -1e16)), ((0.0, 0.0), (0.5, 0.5)), ((np.nan, 0.0), (0.0, 0.0))])
        ),
    )


@given(
    shown=snapshots(),
    centre=st.tuples(FAR, FAR),
    power=st.floats(-14.0, 12.0),
    size=st.sampled_from([(1, 1), (2, 1), (1, 50), (90, 70)]),
    antialias=st.booleans(),
    ui_scale=st.sampled_from([1.0, 2.0]),
)
def test_any_snapshot_is_drawn_by_any_camera(shown, centre, power, size, antialias, ui_scale):
    camera = Camera(centre, 10.0**power, size)
    assert render(shown, camera, antialias=antialias, ui_scale=ui_scale).shape == (*size, 3)


@given(shown=snapshots(), power=st.floats(-3.0, 4.0), antialias=st.booleans())
@example(
    shown=snapshot(MODEL, *OVERLAYS, contacts=contact((COUNT, -5), (0.0, 0.0), (1e308, 0.0))), power=4.0, antialias=True
)
@example(
    shown=snapshot(MODEL, ghost=frame(MODEL), frame=frame(MODEL, position=np.full((COUNT, 2), 1e307))),
    power=4.0,
    antialias=True,
)
def test_any_snapshot_is_drawn_near_the_origin(shown, power, antialias):
    assert render(shown, Camera((0.0, 0.0), 10.0**power, (90, 70)), antialias=antialias).any()


@pytest.mark.parametrize("size", [(1, 1), (3, 2), (200, 100)])
@pytest.mark.parametrize("power", [-14, 0, 12])
def test_an_empty_scene_is_drawn(size, power):
    camera = Camera((0.0, 0.0), 10.0**power, size)
    assert render(snapshot(scene(world={}), *OVERLAYS), camera).any()


def test_frame_with_fewer_bodies_is_drawn():
    few = scene(balls=[ball(0, 0)])
    assert render(snapshot(MODEL, *OVERLAYS, frame=frame(few))).any()


def test_surface_without_pixels_is_accepted():
    surface = pygame.Surface((0, 0))
    Renderer().draw(surface, Camera((0.0, 0.0), 1.0, (0, 0)), snapshot(MODEL, *OVERLAYS))
    assert surface.get_size() == (0, 0)
