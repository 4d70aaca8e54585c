"""Scenes and engines changed by keys, in a real window."""

from pathlib import Path

import pygame
import pytest

from sandbox.window.render.palette import BACKGROUND, INK, SKY, WARNING
from tests.driven.driving import Play
from tests.driven.looking import ARENA, ENGINE_ROW, PICTURE, at, count, differ, laid_out, on_screen, paused
from tests.driven.rooms import AT_REST, FALLING, MOVING, RESTING, written

pytestmark = pytest.mark.full  # a window or a film


def test_brackets_walk_the_scenes_beside_and_keep_the_pause(drive: Play, tmp_path: Path) -> None:
    for name, text in (("a", AT_REST), ("b", MOVING), ("c", RESTING)):
        written(tmp_path, text, f"{name}.toml")
    window = drive("play", "b.toml", "--paused")
    for key, title in (("bracketright", "Resting"), ("bracketright", "Rest"), ("bracketleft", "Resting")):
        window.key(key)
        window.wait_for(lambda title=title: window.title() == f"{title} - sandbox", title)
    window.wait_until(paused, "PAUSED")


def test_picker_opens_what_is_typed_for(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    window.key("ctrl+o")
    cards = window.wait_until(
        lambda shot: at(shot, (4, 300)) == BACKGROUND and at(shot, (896, 300)) == BACKGROUND, "it"
    )
    window.type("two balls")
    window.wait_until(lambda shot: differ(shot, cards, PICTURE), "fewer cards")
    window.key("Return")
    window.wait_for(lambda: window.title() == "Two balls - sandbox", "the scene")
    window.key("ctrl+o", "Escape")
    window.wait_until(lambda shot: at(shot, (896, 300)) != BACKGROUND, "the scene again")
    assert window.title() == "Two balls - sandbox"


def test_without_a_scene_the_picker_is_seen_first(drive: Play) -> None:
    window = drive("play")
    assert window.title() == "sandbox"
    window.key("Escape", "p", "e", "comma", "ctrl+s")  # there is nothing on, and nothing that this could do
    window.wait_for(lambda: window.said() == ["no session to save"], "that there is no session")
    window.key("ctrl+o")
    window.type("bounce")
    window.key("Return")
    window.wait_for(lambda: window.title() == "Bounce - sandbox", "the scene")


def test_e_goes_to_the_next_engine_from_the_same_state(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    window.key("o", "o")
    before = window.settled()
    window.key("e")
    after = window.wait_until(lambda shot: differ(shot, before, ENGINE_ROW), "another engine's name")
    assert not differ(after, before)
    window.key("o")
    window.key("e")
    window.wait_until(lambda shot: differ(shot, after, ENGINE_ROW) and differ(shot, before, ENGINE_ROW), "a third")
    window.key("o")
    session = window.session()
    assert session.engine == "pymunk"
    assert [(act.time, getattr(act, "engine", None)) for act in session.actions] == [
        (0.02, "exact"),
        (0.03, "reference"),
    ]


def test_ghost_is_seen_where_the_exact_engine_has_it(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, FALLING)
    camera = laid_out(path).camera
    window = drive("play", str(path), "--paused")
    window.key("g")
    window.key(*["o"] * 8)
    assert window.step_number() == 8
    # 5 − ½·10·0.8² = 1.8 m; explicit Euler is late by ½·10·0.1·0.8 = 0.4 m, less than a radius: both are seen.
    ghost, ball = on_screen(camera, (-1.0, 1.8)), on_screen(camera, (-1.0, 2.2))
    radius = 0.5 * camera.scale
    foot = pygame.Rect(0, 0, 9, 9)
    foot.center = round(ghost[0]), round(ghost[1] + radius)
    shot = window.wait_until(lambda shot: count(shot, INK, foot) > 5, "the foot of the ghost's ring")
    assert at(shot, (ball[0] + radius / 2.0, ball[1] - radius / 2.0)) == SKY
    inside = at(shot, (ghost[0] + 5.0, ghost[1] + 0.7 * radius))
    assert max(inside) < 60  # hollow: what lies behind it, dark
    window.key("g")
    window.wait_until(lambda shot: count(shot, INK, foot) == 0, "no ghost")


def test_ctrl_l_reloads_the_file_or_tells_its_faults(drive: Play, tmp_path: Path) -> None:
    path = written(tmp_path, MOVING)
    window = drive("play", str(path))
    path.write_text(MOVING.replace("radius = 0.4", "radius = -0.4"), encoding="utf-8")
    window.key("ctrl+l")
    faulty = window.wait_until(lambda shot: count(shot, WARNING) > 40, "the faults")
    window.wait_until(
        lambda shot: differ(shot, faulty, PICTURE) and count(shot, WARNING) > 40, "the old scene going on"
    )
    assert window.session().scene.balls[0].radius == 0.4
    path.write_text(MOVING.replace("radius = 0.4", "radius = 0.2").replace("Moving", "Mended"), encoding="utf-8")
    window.key("p", "ctrl+l")
    window.wait_for(lambda: window.title() == "Mended - sandbox", "the mended scene")
    shot = window.wait_until(
        lambda shot: paused(shot) and count(shot, WARNING, ARENA) == 0, "no faults, and the pause kept"
    )
    session = window.session()
    assert session.scene.balls[0].radius == 0.2
    assert session.duration == 0.0
    place = on_screen(laid_out(path).camera, (-1.0, 0.0))
    assert at(shot, place) == SKY
