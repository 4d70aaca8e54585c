"""Scenes and engines changed by keys, in a real window."""

from pathlib import Path

import pygame
import pytest

from sandbox.window.render.palette import BACKGROUND, INK, SKY, WARNING
from tests.driven.driving import OpenWindow
from tests.driven.looking import (
    ARENA,
    ENGINE_ROW,
    PICTURE,
    are_different,
    colour_at,
    count_pixels,
    on_screen,
    shows_paused,
    window_layout,
)
from tests.driven.rooms import AT_REST, FALLING, MOVING, RESTING, write_scene

pytestmark = pytest.mark.full  # a window or a film


def test_bracket_keys_open_neighbouring_scenes_and_keep_the_pause(drive: OpenWindow, tmp_path: Path) -> None:
    for name, text in (("a", AT_REST), ("b", MOVING), ("c", RESTING)):
        write_scene(tmp_path, text, f"{name}.toml")
    window = drive("play", "b.toml", "--paused")
    for key, title in (("bracketright", "Resting"), ("bracketright", "Rest"), ("bracketleft", "Resting")):
        window.key(key)
        window.wait_for(lambda title=title: window.title() == f"{title} - sandbox", title)
    window.wait_until(shows_paused, "PAUSED")


def test_picker_opens_the_scene_that_is_typed(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    window.key("ctrl+o")
    cards = window.wait_until(
        lambda shot: colour_at(shot, (4, 300)) == BACKGROUND and colour_at(shot, (896, 300)) == BACKGROUND, "the picker"
    )
    window.type("two balls")
    window.wait_until(lambda shot: are_different(shot, cards, PICTURE), "fewer cards")
    window.key("Return")
    window.wait_for(lambda: window.title() == "Two balls - sandbox", "the scene")
    window.key("ctrl+o", "Escape")
    window.wait_until(lambda shot: colour_at(shot, (896, 300)) != BACKGROUND, "the scene again")
    assert window.title() == "Two balls - sandbox"


def test_window_without_a_scene_opens_the_picker(drive: OpenWindow) -> None:
    window = drive("play")
    assert window.title() == "sandbox"
    window.key("Escape", "p", "e", "comma", "ctrl+s")  # no scene is open: all of these do nothing
    window.wait_for(lambda: window.stdout_lines() == ["no session to save"], "the message")
    window.key("ctrl+o")
    window.type("bounce")
    window.key("Return")
    window.wait_for(lambda: window.title() == "Bounce - sandbox", "the scene")


def test_e_switches_to_the_next_engine_and_keeps_the_state(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    window.key("o", "o")
    before = window.settled_shot()
    window.key("e")
    after = window.wait_until(lambda shot: are_different(shot, before, ENGINE_ROW), "another engine's name")
    assert not are_different(after, before)
    window.key("o")
    window.key("e")
    window.wait_until(
        lambda shot: are_different(shot, after, ENGINE_ROW) and are_different(shot, before, ENGINE_ROW), "a third"
    )
    window.key("o")
    session = window.session()
    assert session.engine == "pymunk"
    assert [(act.time, getattr(act, "engine", None)) for act in session.actions] == [
        (0.02, "box2d"),
        (0.03, "exact"),
    ]


def test_ghost_is_drawn_at_the_position_of_the_exact_engine(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, FALLING)
    camera = window_layout(path).camera
    window = drive("play", str(path), "--paused")
    window.key("g")
    window.key(*["o"] * 8)
    assert window.step_number() == 8
    # 5 − ½·10·0.8² = 1.8 m; explicit Euler lags by ½·10·0.1·0.8 = 0.4 m, less than a radius: both are visible.
    ghost, ball = on_screen(camera, (-1.0, 1.8)), on_screen(camera, (-1.0, 2.2))
    radius = 0.5 * camera.scale
    bottom = pygame.Rect(0, 0, 9, 9)
    bottom.center = round(ghost[0]), round(ghost[1] + radius)
    shot = window.wait_until(lambda shot: count_pixels(shot, INK, bottom) > 5, "the bottom of the ghost's ring")
    assert colour_at(shot, (ball[0] + radius / 2.0, ball[1] - radius / 2.0)) == SKY
    inside = colour_at(shot, (ghost[0] + 5.0, ghost[1] + 0.7 * radius))
    assert max(inside) < 60  # hollow: the dark background shows through
    window.key("g")
    window.wait_until(lambda shot: count_pixels(shot, INK, bottom) == 0, "no ghost")


def test_ctrl_l_reloads_the_file_or_shows_its_faults(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, MOVING)
    window = drive("play", str(path))
    path.write_text(MOVING.replace("radius = 0.4", "radius = -0.4"), encoding="utf-8")
    window.key("ctrl+l")
    faulty = window.wait_until(lambda shot: count_pixels(shot, WARNING) > 40, "the faults")
    window.wait_until(
        lambda shot: are_different(shot, faulty, PICTURE) and count_pixels(shot, WARNING) > 40, "the old scene running"
    )
    assert window.session().scene.balls[0].radius == 0.4
    path.write_text(MOVING.replace("radius = 0.4", "radius = 0.2").replace("Moving", "Mended"), encoding="utf-8")
    window.key("p", "ctrl+l")
    window.wait_for(lambda: window.title() == "Mended - sandbox", "the mended scene")
    shot = window.wait_until(
        lambda shot: shows_paused(shot) and count_pixels(shot, WARNING, ARENA) == 0, "no faults, still paused"
    )
    session = window.session()
    assert session.scene.balls[0].radius == 0.2
    assert session.duration == 0.0
    point = on_screen(window_layout(path).camera, (-1.0, 0.0))
    assert colour_at(shot, point) == SKY
