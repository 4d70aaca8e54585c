"""Lit lamps: bright, with a glow that fades, over a ground that is not drawn again."""

from typing import Any

import numpy as np
import pytest

from sandbox.games.pinball import view
from sandbox.scene.compile.scene import Scene
from sandbox.window.camera import Camera
from sandbox.window.capture.image_files import offscreen
from sandbox.window.render.lamps import GLOW, MAX_LAMP_RADIUS, RADIUS
from sandbox.window.render.renderer import Renderer
from tests.window.render.drawn import SIZE, ball, scene, sight

SCALE = 1000.0
CLOSE = Camera((0.0, 0.0), SCALE, SIZE)
"""a lamp has a radius of 6.5 px"""
BED = {"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "colour": "#102030"}


def lamps(ground: str = "playfield", **part: Any) -> Scene:
    play = {
        "ground": ground,
        "marking": [BED],
        "part": [{"name": "post-1", "role": "standup", "light": [0, 0], **part}],
    }
    return scene(balls=[ball(90, 90)], play=play, post=[{"position": [5, 5], "radius": 0.1}])


def seen(which: Scene, *lit: str, camera: Camera = CLOSE, by: Renderer | None = None) -> np.ndarray[Any, Any]:
    """Return the colours along the row through the middle, to the right of it."""
    surface = offscreen(SIZE)
    (by or Renderer()).draw(surface, camera, sight(which, lit=frozenset(lit)))
    return np.asarray([surface.get_at((x, SIZE[1] // 2))[:3] for x in range(SIZE[0] // 2, SIZE[0])], dtype=int)


@pytest.mark.parametrize("ground", ["playfield", "grid"])
def test_lit_lamp_is_bright_and_its_glow_fades_to_nothing(ground: str) -> None:
    dark, lit = seen(lamps(ground)), seen(lamps(ground), "post-1")
    assert lit[0].min() > 200  # nearly white
    assert dark[0].max() < 130
    more = (lit - dark).sum(axis=1)
    edge, end = round(RADIUS * SCALE) + 3, round(GLOW * RADIUS * SCALE) + 2
    assert more[edge] > 100
    assert (np.diff(more[edge:end]) <= 0).all()
    assert (more[end:] == 0).all()


def test_lamp_has_the_colour_of_its_part() -> None:
    red, green, blue = seen(lamps(colour="#20ff40"), "post-1")[round(RADIUS * SCALE) + 3]
    assert green > max(red, blue) + 60


def test_only_lamps_of_those_names_are_lit() -> None:
    assert (seen(lamps(), "post-2") == seen(lamps())).all()
    assert (seen(lamps(light=[0.5, 0.5]), "post-1") == seen(lamps(light=[0.5, 0.5]))).all()  # out of sight


def test_ground_is_kept_while_lamps_change(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = []
    once = view.draw_playfield
    monkeypatch.setattr(view, "draw_playfield", lambda *args: (drawn.append(1), once(*args)))
    which, by = lamps(), Renderer()
    dark = seen(which, by=by)
    lit = seen(which, "post-1", by=by)
    assert (seen(which, by=by) == dark).all()  # and goes out without a trace
    assert (lit != dark).any()
    assert len(drawn) == 1


@pytest.mark.parametrize("scale", [1e-12, 1.0, MAX_LAMP_RADIUS / RADIUS, 1e6, 1e12])
def test_lit_lamps_are_drawn_at_any_scale(scale: float) -> None:
    camera = Camera((0.0, 0.0), scale, SIZE)
    assert seen(lamps(), "post-1", camera=camera).shape == (SIZE[0] // 2, 3)
