"""Head-up display: rows of a status, and layout without overlaps for any status and size."""

from dataclasses import replace
from typing import Any

import numpy as np
import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox.window.ui.hud as hud
from sandbox.window.playback.snapshot import HudStatus
from sandbox.window.render.palette import VERMILION, WARNING
from sandbox.window.ui.hud import draw_hud, hud_rows

MINIMAL = HudStatus("Bounce", "pymunk", "dt 10 ms · 1 × 10", 1234, 12.34)
FULL = HudStatus(
    "Break",
    "pymunk",
    "dt 10 ms · 4 × 10",
    1234,
    12.34,
    paused=True,
    speed=0.63,
    frames_per_second=60.0,
    trust="lost",
    horizon=3.2,
    ghost="exact",
    distance=0.00123,
    missed=2,
    recording="gif 3.2 s",
    busy="replaying 40 %",
    picked=("cue", "x 1.230 m", "v 3.10 m/s"),
    messages=(("info", "wrote a.png"), ("warning", "exact cannot do this; pymunk goes on"), ("error", "diverged")),
)


def texts(status: HudStatus) -> list[str]:
    return [row.text for row in hud_rows(status)]


@pytest.mark.parametrize(
    ("changes", "rows"),
    [
        ({}, []),
        ({"paused": True}, ["PAUSED  (P or Space)"]),
        ({"paused": True, "claimed": (("Space", "shoot"),)}, ["PAUSED  (P)"]),
        ({"paused": True, "real_speed": 0.0}, ["PAUSED  (P or Space)"]),
        ({"real_speed": 0.91}, []),
        ({"real_speed": 0.89}, ["speed 100 %, running at 89 %"]),  # the real speed differs by more than a tenth
        ({"speed": 0.63, "real_speed": 0.63}, ["speed 63 %"]),
        ({"speed": 0.5, "real_speed": 0.4}, ["speed 50 %, running at 40 %"]),
        ({"speed": 2.0, "real_speed": 2.3}, ["speed 200 %, running at 230 %"]),
        ({"ghost": "exact", "distance": 0.00123}, ["ghost exact: 1.23 mm away"]),
        ({"ghost": "exact"}, ["ghost exact"]),
        ({"missed": 0}, ["no missed contacts"]),
        ({"missed": 1}, ["1 missed contact"]),
        ({"missed": 7}, ["7 missed contacts"]),
        ({"recording": "gif 1.0 s"}, ["recording gif 1.0 s"]),
        ({"busy": "replaying 40 %"}, ["replaying 40 %"]),
    ],
)
def test_rows_follow_title_engine_and_time(changes: dict[str, Any], rows: list[str]) -> None:
    found = texts(replace(MINIMAL, **changes))
    assert found[:3] == ["Bounce", "pymunk  ·  dt 10 ms · 1 × 10", "step 1,234   12.34 s"]
    assert found[3:] == rows


def test_pause_and_missed_contacts_are_coloured_and_a_replay_is_in_the_title() -> None:
    for changes, colour in (({"paused": True}, WARNING), ({"missed": 1}, VERMILION)):
        assert hud_rows(replace(MINIMAL, **changes))[3].colour == colour
    assert hud_rows(replace(MINIMAL, missed=0))[3].colour != VERMILION
    assert texts(replace(MINIMAL, replay=True))[0].endswith("replay")


@pytest.mark.parametrize("ui_scale", [0.7, 1.0, 2.0])
def test_pause_of_a_window_without_focus_fits_beside_a_score_panel(ui_scale: float) -> None:
    free = pygame.Rect(0, 0, round(1920 * ui_scale), round(1080 * ui_scale))
    panel = pygame.Rect(hud.hud_width("exact  ·  dt 10 ms", ui_scale), 0, 600, 60)
    for status in (
        replace(MINIMAL, engine="exact", settings="dt 10 ms", **{how: True}) for how in ("paused", "unfocused")
    ):
        (line,) = [text for row, text in hud.layout_rows(status, free, ui_scale, [panel]).lines if row.mark == "bars"]
        assert line in texts(status)


@pytest.mark.parametrize("stopped", [True, False])
def test_end_is_shown_with_its_reason_instead_of_the_pause(stopped: bool) -> None:
    status = replace(MINIMAL, paused=stopped, ended="at 3 s: it broke", real_speed=0.0)
    (row,) = hud_rows(status)[3:]
    assert (row.text, row.colour) == ("ENDED: at 3 s: it broke (R: restart)", WARNING)
    (pause,) = [row for row in hud_rows(replace(MINIMAL, paused=True)) if "PAUSED" in row.text]
    assert row.mark != pause.mark


def test_trust_states_differ_in_text_and_mark() -> None:
    (trusted,) = [row for row in hud_rows(replace(MINIMAL, trust="trusted")) if row.mark]
    (lost,) = [row for row in hud_rows(replace(MINIMAL, trust="lost", horizon=3.2)) if row.mark]
    assert (trusted.text, lost.text) == ("predictable", "no longer predictable (since 3.20 s)")
    assert trusted.mark != lost.mark
    assert not [row for row in hud_rows(replace(MINIMAL, trust="unknown")) if row.mark]


def draw_and_record(
    status: HudStatus, size: tuple[int, int], ui_scale: float, right: int = 0
) -> tuple[list[pygame.Rect], pygame.Surface]:
    """Draw a status; return the rectangles of its plates, and the picture."""
    plates: list[pygame.Rect] = []
    original = hud.draw_box

    def record(surface: pygame.Surface, rect: pygame.Rect, *others: object, **named: object) -> None:
        plates.append(rect.copy())
        original(surface, rect, *others, **named)  # type: ignore[arg-type]  # forwarded unchanged

    surface = pygame.Surface(size)
    hud.draw_box = record
    try:
        draw_hud(surface, status, pygame.Rect(0, 0, surface.get_width() - right, surface.get_height()), ui_scale)
    finally:
        hud.draw_box = original
    return plates, surface


@pytest.mark.parametrize("size", [(200, 150), (640, 480), (3840, 2160)])
def test_plates_stay_in_the_picture_and_do_not_overlap(size: tuple[int, int]) -> None:
    ui_scale = 2.0 if size[0] > 2000 else 1.0
    for status in (MINIMAL, FULL, replace(FULL, faults=("a.toml:3: ball: wrong",) * 30)):
        plates, surface = draw_and_record(status, size, ui_scale)
        assert plates
        assert all(surface.get_rect().contains(rect) for rect in plates)
        assert all(rect.collidelist(plates[k + 1 :]) < 0 for k, rect in enumerate(plates))


def test_no_text_is_drawn_behind_the_panel() -> None:
    _, surface = draw_and_record(FULL, (640, 480), 1.0, right=264)
    assert not pygame.surfarray.array3d(surface)[640 - 264 :].any()


def test_newest_message_is_kept_in_a_tiny_window() -> None:
    without, _ = draw_and_record(replace(FULL, messages=()), (200, 150), 1.0)
    plates, _ = draw_and_record(FULL, (200, 150), 1.0)
    assert any(rect.bottom > max(each.bottom for each in without) - 5 and rect.top > 90 for rect in plates)


def test_faults_are_drawn_at_the_centre_in_the_returned_rectangle() -> None:
    surface, middle = pygame.Surface((640, 480)), np.s_[300:340, 240:300]
    assert "faults" not in draw_hud(surface, MINIMAL, surface.get_rect(), 1.0)
    assert not pygame.surfarray.array3d(surface)[middle].any()
    faulty = replace(MINIMAL, faults=("a.toml:3: ball: wrong",))
    assert draw_hud(surface, faulty, surface.get_rect(), 1.0)["faults"].collidepoint(320, 260)
    assert pygame.surfarray.array3d(surface)[middle].any()


words = st.text(max_size=40) | st.sampled_from(["", " ", "x" * 500, "ball\n\x00\ud800", "a b c " * 60])
numbers = st.floats()
statuses = st.builds(
    HudStatus,
    title=words,
    engine=words,
    settings=words,
    step=st.integers(0, 10**12),
    time=numbers,
    paused=st.booleans(),
    ended=st.none() | words,
    replay=st.booleans(),
    speed=numbers,
    real_speed=numbers,
    frames_per_second=numbers,
    trust=st.sampled_from(["unknown", "trusted", "lost"]),
    horizon=st.none() | numbers,
    ghost=st.none() | words,
    distance=st.none() | numbers,
    missed=st.none() | st.integers(0, 10**9),
    recording=st.none() | words,
    busy=st.none() | words,
    picked=st.lists(words, max_size=12).map(tuple),
    messages=st.lists(st.tuples(st.sampled_from(["info", "warning", "error", "?"]), words), max_size=6).map(tuple),
    faults=st.just(()) | st.lists(words, max_size=20).map(tuple),
    claimed=st.lists(st.tuples(words, words), max_size=3).map(tuple),
)


@given(statuses, st.integers(1, 500), st.integers(1, 400), st.floats(0.25, 4), st.integers(0, 300))
def test_any_status_is_drawn_on_any_size(
    status: HudStatus, width: int, height: int, ui_scale: float, right: int
) -> None:
    plates, surface = draw_and_record(status, (width, height), ui_scale, right)
    assert all(surface.get_rect().contains(rect) for rect in plates if rect.size > (0, 0))
