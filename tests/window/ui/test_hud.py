"""Head-up display: what is told and when, and that no status and no size breaks it or piles words up."""

from dataclasses import replace

import numpy as np
import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox.window.ui.hud as hud
from sandbox.window.playback.snapshot import HudStatus
from sandbox.window.render.palette import VERMILION, WARNING
from sandbox.window.ui.hud import draw_hud, hud_rows

QUIET = HudStatus("Bounce", "pymunk", "dt 10 ms · 1 × 10", 1234, 12.34)
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


def test_title_engine_settings_step_and_time_are_always_told() -> None:
    assert texts(QUIET) == ["Bounce", "pymunk  ·  dt 10 ms · 1 × 10", "step 1,234   12.34 s"]


def test_pause_is_told_in_red_with_its_keys() -> None:
    (row,) = [row for row in hud_rows(replace(QUIET, paused=True)) if "PAUSED" in row.text]
    assert row.text == "PAUSED  (P or Space)"
    assert row.colour == WARNING


@pytest.mark.parametrize("unit", [0.7, 1.0, 2.0])
def test_pause_of_a_window_without_focus_fits_beside_a_score_panel(unit: float) -> None:
    free = pygame.Rect(0, 0, round(1920 * unit), round(1080 * unit))
    panel = pygame.Rect(hud.hud_width("exact  ·  dt 10 ms", unit), 0, 600, 60)
    for status in (
        replace(QUIET, engine="exact", settings="dt 10 ms", **{how: True}) for how in ("paused", "unfocused")
    ):
        (line,) = [text for row, text in hud.layout_rows(status, free, unit, [panel]).lines if row.mark == "bars"]
        assert line in texts(status)


@pytest.mark.parametrize("stopped", [True, False])
def test_end_is_told_with_its_reason_in_place_of_the_pause(stopped: bool) -> None:
    status = replace(QUIET, paused=stopped, ended="at 3 s: it broke", real_speed=0.0)
    (row,) = hud_rows(status)[3:]
    assert (row.text, row.colour) == ("ENDED: at 3 s: it broke (R: restart)", WARNING)
    (pause,) = [row for row in hud_rows(replace(QUIET, paused=True)) if "PAUSED" in row.text]
    assert row.mark != pause.mark


def test_pause_names_only_p_where_the_scene_claims_space() -> None:
    assert "PAUSED  (P)" in texts(replace(QUIET, paused=True, claimed=(("Space", "shoot"),)))


@pytest.mark.parametrize(
    ("asked", "real", "told"),
    [
        (1.0, 1.0, None),
        (1.0, 0.91, None),
        (1.0, 0.89, "speed 100 %, running at 89 %"),
        (0.63, 0.63, "speed 63 %"),
        (0.5, 0.4, "speed 50 %, running at 40 %"),
        (2.0, 2.3, "speed 200 %, running at 230 %"),
    ],
)
def test_real_speed_is_told_when_more_than_a_tenth_apart(asked: float, real: float, told: str | None) -> None:
    found = [text for text in texts(replace(QUIET, speed=asked, real_speed=real)) if "speed" in text]
    assert found == ([] if told is None else [told])


def test_real_speed_is_not_told_while_paused() -> None:
    assert not [text for text in texts(replace(QUIET, paused=True, real_speed=0.0)) if "speed" in text]


def test_trust_differs_in_word_and_shape() -> None:
    (held,) = [row for row in hud_rows(replace(QUIET, trust="trusted")) if row.mark]
    (lost,) = [row for row in hud_rows(replace(QUIET, trust="lost", horizon=3.2)) if row.mark]
    assert (held.text, lost.text) == ("predictable", "no longer predictable (since 3.20 s)")
    assert held.mark != lost.mark
    assert not [row for row in hud_rows(replace(QUIET, trust="unknown")) if row.mark]


def test_ghost_tells_its_engine_and_how_far_it_is() -> None:
    assert "ghost exact: 1.23 mm away" in texts(replace(QUIET, ghost="exact", distance=0.00123))
    assert "ghost exact" in texts(replace(QUIET, ghost="exact"))


@pytest.mark.parametrize(
    ("missed", "text"), [(0, "no missed contacts"), (1, "1 missed contact"), (7, "7 missed contacts")]
)
def test_missed_contacts_are_counted_and_warned_of(missed: int, text: str) -> None:
    (row,) = [row for row in hud_rows(replace(QUIET, missed=missed)) if "missed" in row.text]
    assert row.text == text
    assert (row.colour == VERMILION) == (missed > 0)


def test_replay_recording_and_waiting_are_told() -> None:
    found = texts(replace(QUIET, replay=True, recording="gif 1.0 s", busy="replaying 40 %"))
    assert found[0].endswith("replay")
    assert {"recording gif 1.0 s", "replaying 40 %"} <= set(found)


def drawn(
    status: HudStatus, size: tuple[int, int], unit: float, right: int = 0
) -> tuple[list[pygame.Rect], pygame.Surface]:
    """Return the plates that were laid, and the picture."""
    laid: list[pygame.Rect] = []
    original = hud.draw_box

    def noted(surface: pygame.Surface, rect: pygame.Rect, *others: object, **named: object) -> None:
        laid.append(rect.copy())
        original(surface, rect, *others, **named)  # type: ignore[arg-type]  # passed on as they came

    surface = pygame.Surface(size)
    hud.draw_box = noted
    try:
        draw_hud(surface, status, unit, right=right)
    finally:
        hud.draw_box = original
    return laid, surface


SIZES = [(200, 150), (320, 240), (640, 480), (1280, 800), (3840, 2160)]


@pytest.mark.parametrize("size", SIZES)
def test_plates_stay_in_the_picture_and_apart(size: tuple[int, int]) -> None:
    unit = 2.0 if size[0] > 2000 else 1.0
    for status in (QUIET, FULL, replace(FULL, faults=("a.toml:3: ball: wrong",) * 30)):
        laid, surface = drawn(status, size, unit)
        assert laid
        assert all(surface.get_rect().contains(rect) for rect in laid)
        assert all(rect.collidelist(laid[k + 1 :]) < 0 for k, rect in enumerate(laid))


def test_nothing_is_written_below_the_panel() -> None:
    _, surface = drawn(FULL, (640, 480), 1.0, right=264)
    assert not pygame.surfarray.array3d(surface)[640 - 264 :].any()


def test_newest_message_is_kept_in_a_tiny_window() -> None:
    without, _ = drawn(replace(FULL, messages=()), (200, 150), 1.0)
    laid, _ = drawn(FULL, (200, 150), 1.0)
    assert any(rect.bottom > max(each.bottom for each in without) - 5 and rect.top > 90 for rect in laid)


def test_place_of_the_faults_is_told_where_there_are_any() -> None:
    surface = pygame.Surface((640, 480))
    assert draw_hud(surface, QUIET, 1.0).size == (0, 0)
    assert draw_hud(surface, replace(QUIET, faults=("a.toml:3: ball: wrong",)), 1.0).collidepoint(320, 260)


def test_faults_change_the_middle_of_the_picture() -> None:
    _, plain = drawn(QUIET, (640, 480), 1.0)
    _, faulty = drawn(replace(QUIET, faults=("a.toml:3: ball: wrong",)), (640, 480), 1.0)
    middle = np.s_[300:340, 240:300]
    assert not pygame.surfarray.array3d(plain)[middle].any()
    assert pygame.surfarray.array3d(faulty)[middle].any()


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
@settings(max_examples=150, deadline=None)
def test_any_status_is_drawn_on_any_size(status: HudStatus, width: int, height: int, unit: float, right: int) -> None:
    laid, surface = drawn(status, (width, height), unit, right)
    assert all(surface.get_rect().contains(rect) for rect in laid if rect.size > (0, 0))
