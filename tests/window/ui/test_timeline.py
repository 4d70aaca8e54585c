"""Timeline: pressing and dragging return times, exactly at the ends; drawing of any times."""

import math

import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.window.render.palette import ORANGE
from sandbox.window.ui.timeline import Timeline
from tests.window.pressing import FOCUS_LOST, move, press, release

AREA = pygame.Rect(10, 100, 600, 34)


def drawn_timeline(start: float = 0.0, now: float = 5.0, end: float = 10.0) -> Timeline:
    timeline = Timeline()
    timeline.draw(pygame.Surface((620, 150)), AREA, start, now, end)
    return timeline


def test_ends_are_exact_and_a_drag_continues_outside() -> None:
    timeline = drawn_timeline(start=0.1, end=9.7)
    # A pixel of the line is 0.02 s or less.
    assert timeline.handle_event(press(*AREA.center), AREA) == pytest.approx(4.9, abs=0.02)
    assert timeline.held
    assert timeline.handle_event(move(-500, 900, held=True), AREA) == 0.1
    assert timeline.handle_event(move(5000, -900, held=True), AREA) == 9.7
    assert timeline.handle_event(release(5000, -900), AREA) == 9.7
    assert not timeline.held


def test_press_and_release_return_the_same_time_and_lost_focus_ends_a_drag() -> None:
    timeline = drawn_timeline()
    time = timeline.handle_event(press(300, 110), AREA)
    assert time == timeline.handle_event(release(300, 110), AREA)
    assert timeline.handle_event(move(400, 110), AREA) is None
    timeline.handle_event(press(300, 110), AREA)
    timeline.handle_event(FOCUS_LOST, AREA)
    assert not timeline.held


def test_press_outside_and_other_buttons_return_none() -> None:
    timeline = drawn_timeline()
    for event in (press(300, 50), press(300, 110, button=3), move(300, 110), release(300, 110)):
        assert timeline.handle_event(event, AREA) is None
    assert not timeline.held


def test_keyframes_are_marked_at_their_times() -> None:
    surface = pygame.Surface((620, 150))
    Timeline().draw(surface, AREA, 0.0, 0.0, 10.0, [5.0, 99.0])
    marked = {x for x in range(620) for y in range(150) if surface.get_at((x, y))[:3] == ORANGE}
    assert marked == {AREA.centerx}


def test_hover_shows_the_time_above_the_bar() -> None:
    timeline = drawn_timeline()
    timeline.handle_event(move(*AREA.center), AREA)
    surface = pygame.Surface((620, 150))
    timeline.draw(surface, AREA, 0.0, 5.0, 10.0)
    assert pygame.surfarray.array3d(surface)[:, : AREA.top].any()


@given(
    st.floats(), st.floats(), st.floats(), st.lists(st.floats(), max_size=5), st.integers(1, 300), st.integers(1, 80)
)
@settings(deadline=None)
def test_any_times_are_drawn_and_returned_times_are_within_the_range(
    start: float, now: float, end: float, keyframes: list[float], width: int, height: int
) -> None:
    area = pygame.Rect(0, 0, width, height)
    timeline = Timeline()
    timeline.draw(pygame.Surface((300, 90)), area, start, now, end, keyframes, 1.5)
    time = timeline.handle_event(press(width // 2, height // 2), area)
    assert time is not None
    low = start if math.isfinite(start) else 0.0
    high = max(end if math.isfinite(end) else 0.0, low)
    assert low <= time <= high
