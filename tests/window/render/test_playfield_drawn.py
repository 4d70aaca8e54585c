"""Drawing of playfields: markings, shadows, caps, lamps and their glow; clipping of polygons."""

from typing import Any

import numpy as np
import pygame
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.games.pinball import view
from sandbox.scene.compile.scene import Scene
from sandbox.window.camera import Camera
from sandbox.window.render.lamps import GLOW_RADIUS, LAMP_RADIUS, MAX_LAMP_RADIUS
from sandbox.window.render.lines import clip_polygon
from sandbox.window.render.palette import BACKGROUND
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import SIZE, ball, colour_at, render, scene, snapshot

BED: dict[str, Any] = {"points": [[-4, -2], [4, -2], [4, 2], [-4, 2]], "colour": "#102030"}
SPOT: dict[str, Any] = {"position": [2, 0], "radius": 1, "colour": "#405060"}
FAR = [ball(90, 90)]


def render_playfield(*markings: dict[str, Any], **tables: Any) -> np.ndarray[Any, Any]:
    play = {"ground": "playfield", "marking": list(markings), **tables.pop("play", {})}
    return render(snapshot(scene(balls=tables.pop("balls", FAR), play=play, **tables)))


def test_markings_are_drawn_in_order_without_a_grid_and_below_bodies_and_posts() -> None:
    post = {"position": [-2, 0], "radius": 0.5, "colour": "#ff0000"}
    picture = render_playfield(BED, SPOT, balls=[ball(0, 0, 1.0, colour="#123456")], post=[post])
    assert colour_at(picture, 0.0, 1.5) == (16, 32, 48)
    assert colour_at(picture, 2.0, 0.0) == (64, 80, 96)
    assert colour_at(picture, 4.5, 0.0) == BACKGROUND  # no grid
    assert colour_at(picture, 0.0, 0.0) == (18, 52, 86)
    assert colour_at(picture, -2.0, 0.0)[0] > 100


def test_solid_walls_cast_one_shadow_and_others_none() -> None:
    close = Camera((0.0, 0.0), 10_000.0, SIZE)  # a shadow is some millimetres long
    bed = {**BED, "points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "colour": "#808080"}
    dark = {}
    for name, walls in (
        ("none", []),
        ("one", [{"points": [[-1, 0], [1, 0]], "thickness": 0.002}]),
        ("two", [{"points": [[-1, 0], [1, 0]], "thickness": 0.002}] * 2),
        ("passed", [{"points": [[-1, 0], [1, 0]], "thickness": 0.002, "solid": False}]),
    ):
        model = snapshot(scene(balls=FAR, play={"ground": "playfield", "marking": [bed]}, wall=walls))
        dark[name] = tuple(render(model, close)[100, 60 + 50])  # 5 mm below the wall
    assert dark["none"] == dark["passed"] == (128, 128, 128)
    assert dark["one"] == dark["two"] < (110, 110, 110)


def test_posts_with_a_kick_have_a_cap() -> None:
    kick = {"position": [0, 0], "radius": 1.0, "colour": "#ff0000", "kick": {"speed": 1.0}}
    plain = {key: value for key, value in kick.items() if key != "kick"}
    assert colour_at(render_playfield(BED, post=[kick]), 0.0, 0.0) == (255, 0, 0)
    assert colour_at(render_playfield(BED, post=[plain]), 0.0, 0.0) != (255, 0, 0)


@pytest.mark.parametrize("scale", [1e-9, 1e3, 1e9])
def test_playfield_is_drawn_at_any_scale(scale: float) -> None:
    wall, post = {"points": [[-1, 0], [1, 0]], "thickness": 0.5}, {"position": [0, 1], "radius": 0.3}
    model = snapshot(scene(balls=FAR, play={"ground": "playfield", "marking": [BED, SPOT]}, wall=[wall], post=[post]))
    middle = tuple(render(model, Camera((-3.0, -1.5), scale, SIZE))[SIZE[0] // 2, SIZE[1] // 2])
    assert (middle == (16, 32, 48)) == (scale > 1.0)


@given(st.lists(st.tuples(st.floats(-500, 500), st.floats(-500, 500)), min_size=3, max_size=8))
def test_clipped_polygon_has_the_area_of_the_intersection(corners: list[tuple[float, float]]) -> None:
    area = pygame.Rect(0, 0, *SIZE)
    whole = shapely.Polygon(corners)
    assume(whole.is_valid and whole.area >= 1.0)
    within = whole.intersection(shapely.box(-2.0, -2.0, SIZE[0] + 2.0, SIZE[1] + 2.0))  # with a margin of 2 px
    kept = clip_polygon(corners, area)
    assert (shapely.Polygon(kept).area if kept else 0.0) == pytest.approx(within.area, abs=1e-6)
    assert all(-2.001 <= x <= SIZE[0] + 2.001 and -2.001 <= y <= SIZE[1] + 2.001 for x, y in kept)


SCALE = 1000.0
CLOSE = Camera((0.0, 0.0), SCALE, SIZE)
"""At this scale a lamp has a radius of 6.5 px."""
SQUARE = {"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "colour": "#102030"}


def lamps(ground: str = "playfield", **part: Any) -> Scene:
    play = {
        "ground": ground,
        "marking": [SQUARE],
        "part": [{"name": "post-1", "role": "standup", "light": [0, 0], **part}],
    }
    return scene(balls=[ball(90, 90)], play=play, post=[{"position": [5, 5], "radius": 0.1}])


def row_colours(
    model: Scene, *lit: str, camera: Camera = CLOSE, renderer: Renderer | None = None
) -> np.ndarray[Any, Any]:
    """Return the colours of the central row from the centre to the right edge."""
    picture = render(snapshot(model, lit=frozenset(lit)), camera, renderer=renderer)
    return picture[SIZE[0] // 2 :, SIZE[1] // 2].astype(int)


@pytest.mark.parametrize("ground", ["playfield", "grid"])
def test_lit_lamp_is_bright_and_its_glow_fades_to_zero(ground: str) -> None:
    dark, lit = row_colours(lamps(ground)), row_colours(lamps(ground), "post-1")
    assert lit[0].min() > 200  # nearly white
    assert dark[0][0] > 16 + 30  # brighter than the marking
    assert dark[0].max() < 130
    more = (lit - dark).sum(axis=1)
    edge, end = round(LAMP_RADIUS * SCALE) + 3, round(GLOW_RADIUS * LAMP_RADIUS * SCALE) + 2
    assert more[edge] > 100
    assert (np.diff(more[edge:end]) <= 0).all()
    assert (more[end:] == 0).all()


def test_lamp_has_the_colour_of_its_part() -> None:
    red, green, blue = row_colours(lamps(colour="#20ff40"), "post-1")[round(LAMP_RADIUS * SCALE) + 3]
    assert green > max(red, blue) + 60


def test_only_named_lamps_are_lit() -> None:
    assert (row_colours(lamps(), "post-2") == row_colours(lamps())).all()
    outside = lamps(light=[0.5, 0.5])  # outside of the picture
    assert row_colours(outside)[0].tolist() == [16, 32, 48]
    assert (row_colours(outside, "post-1") == row_colours(outside)).all()


def test_background_is_cached_while_lamps_change(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    original = view.draw_playfield
    monkeypatch.setattr(view, "draw_playfield", lambda *args: (calls.append(1), original(*args)))
    model, renderer = lamps(), Renderer()
    dark = row_colours(model, renderer=renderer)
    lit = row_colours(model, "post-1", renderer=renderer)
    assert (row_colours(model, renderer=renderer) == dark).all()  # a lamp that is switched off leaves no trace
    assert (lit != dark).any()
    assert len(calls) == 1


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("scale", [1e-12, 1.0, MAX_LAMP_RADIUS / LAMP_RADIUS, 1e6, 1e12])
def test_lit_lamps_are_drawn_at_any_scale(scale: float) -> None:
    camera = Camera((0.0, 0.0), scale, SIZE)
    assert row_colours(lamps(), "post-1", camera=camera).shape == (SIZE[0] // 2, 3)
