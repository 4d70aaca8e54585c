"""Lit lamps: brightness, fading glow, and a background that is not redrawn."""

from typing import Any

import numpy as np
import pytest

from sandbox.games.pinball import view
from sandbox.scene.compile.scene import Scene
from sandbox.window.camera import Camera
from sandbox.window.capture.image_files import offscreen
from sandbox.window.render.lamps import GLOW, MAX_LAMP_RADIUS, RADIUS
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import SIZE, ball, scene, snapshot

SCALE = 1000.0
CLOSE = Camera((0.0, 0.0), SCALE, SIZE)
"""At this scale a lamp has a radius of 6.5 px."""
BED = {"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "colour": "#102030"}


def lamps(ground: str = "playfield", **part: Any) -> Scene:
    play = {
        "ground": ground,
        "marking": [BED],
        "part": [{"name": "post-1", "role": "standup", "light": [0, 0], **part}],
    }
    return scene(balls=[ball(90, 90)], play=play, post=[{"position": [5, 5], "radius": 0.1}])


def row_colours(
    model: Scene, *lit: str, camera: Camera = CLOSE, renderer: Renderer | None = None
) -> np.ndarray[Any, Any]:
    """Return the colours of the central row from the centre to the right edge."""
    surface = offscreen(SIZE)
    (renderer or Renderer()).draw(surface, camera, snapshot(model, lit=frozenset(lit)))
    return np.asarray([surface.get_at((x, SIZE[1] // 2))[:3] for x in range(SIZE[0] // 2, SIZE[0])], dtype=int)


@pytest.mark.parametrize("ground", ["playfield", "grid"])
def test_lit_lamp_is_bright_and_its_glow_fades_to_zero(ground: str) -> None:
    dark, lit = row_colours(lamps(ground)), row_colours(lamps(ground), "post-1")
    assert lit[0].min() > 200  # nearly white
    assert dark[0].max() < 130
    more = (lit - dark).sum(axis=1)
    edge, end = round(RADIUS * SCALE) + 3, round(GLOW * RADIUS * SCALE) + 2
    assert more[edge] > 100
    assert (np.diff(more[edge:end]) <= 0).all()
    assert (more[end:] == 0).all()


def test_lamp_has_the_colour_of_its_part() -> None:
    red, green, blue = row_colours(lamps(colour="#20ff40"), "post-1")[round(RADIUS * SCALE) + 3]
    assert green > max(red, blue) + 60


def test_only_named_lamps_are_lit() -> None:
    assert (row_colours(lamps(), "post-2") == row_colours(lamps())).all()
    outside = lamps(light=[0.5, 0.5])  # outside of the picture
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


@pytest.mark.full
@pytest.mark.parametrize("scale", [1e-12, 1.0, MAX_LAMP_RADIUS / RADIUS, 1e6, 1e12])
def test_lit_lamps_are_drawn_at_any_scale(scale: float) -> None:
    camera = Camera((0.0, 0.0), scale, SIZE)
    assert row_colours(lamps(), "post-1", camera=camera).shape == (SIZE[0] // 2, 3)
