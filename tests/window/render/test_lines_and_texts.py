"""Lines, arrows, dashes and texts."""

import math

import numpy as np
import pygame
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sandbox.window.render.lines import clip_segment, draw_arrow, draw_dashes, draw_line
from sandbox.window.render.text import draw_text, font_file, text_size

AREA = pygame.Rect(10, 20, 200, 100)
WHITE = (255, 255, 255)
POINT = st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
ANY_POINT = st.tuples(*(st.floats(allow_nan=True, allow_infinity=True),) * 2)


def covered(surface: pygame.Surface) -> np.ndarray:
    return pygame.surfarray.array3d(surface)[..., 0] / 255.0


@given(a=POINT, b=POINT, margin=st.floats(1.0, 50.0))
def test_clipped_segment_is_the_part_inside_the_area(a, b, margin):
    part = clip_segment(a, b, AREA, margin)
    fraction = np.linspace(0.0, 1.0, 2001)[:, None]
    points = np.asarray(a) * (1 - fraction) + np.asarray(b) * fraction
    low, high = np.asarray(AREA.topleft) - margin, np.asarray(AREA.bottomright) + margin
    inside = ((points > low + 1e-6) & (points < high - 1e-6)).all(1)
    if part is None:
        assert not inside.any()
        return
    start, end = np.asarray(part)
    assert (np.minimum(start, end) >= low - 1e-6).all()  # px; rounding of products of 1e5 px
    assert (np.maximum(start, end) <= high + 1e-6).all()  # the same
    along = np.asarray(b) - np.asarray(a)
    length = math.hypot(*along)
    assume(length > 1e-3)
    for point in (start, end):
        across = (point - np.asarray(a)) @ np.asarray((-along[1], along[0])) / length
        assert abs(across) < 1e-6  # the same
    if inside.any():
        reach = (points[inside] - start) @ along / length
        assert reach.min() >= -1e-6  # the same
        assert reach.max() <= math.dist(start, end) + 1e-6  # the same


@given(a=ANY_POINT, b=ANY_POINT, width=st.sampled_from([1.0, 2.0, 9.0]), antialias=st.booleans())
def test_lines_that_miss_the_picture_or_are_not_finite_draw_nothing(a, b, width, antialias):
    surface = pygame.Surface((30, 20))
    draw_line(surface, a, b, WHITE, width, antialias)
    draw_arrow(surface, a, b, WHITE, width, antialias, edge=(9, 9, 9))
    draw_dashes(surface, [(a, b)], WHITE, 4.0, antialias)
    reach = 10.0 * width  # px, more than the head of an arrow
    if not np.isfinite((*a, *b)).all() or clip_segment(a, b, surface.get_rect(), reach) is None:
        assert not covered(surface).any()


@given(angle=st.floats(0.0, 2.0 * math.pi), length=st.floats(20.0, 1e9), antialias=st.booleans())
def test_lines_through_the_picture_are_drawn(angle, length, antialias):
    middle, step = np.asarray((15.5, 10.5)), np.asarray((math.cos(angle), math.sin(angle))) * 0.5 * length
    for draw in (draw_line, draw_arrow):
        surface = pygame.Surface((30, 20))
        draw(surface, tuple(middle - step), tuple(middle + step), WHITE, 2.0, antialias)
        assert covered(surface)[13:18, 8:13].any()  # px, around the middle of the line


@pytest.mark.parametrize("width", [1.0, 2.0, 4.0, 7.0])
@pytest.mark.parametrize("antialias", [True, False])
def test_line_has_the_requested_width(width, antialias):
    surface = pygame.Surface((60, 40))
    draw_line(surface, (5.0, 20.5), (55.0, 20.5), WHITE, width, antialias)
    assert covered(surface)[30].sum() == pytest.approx(width, abs=1.0)  # whole pixels at the two edges
    assert not covered(surface)[:3].any()
    assert not covered(surface)[58:].any()


def test_arrow_ends_at_its_tip_and_is_widest_at_its_head():
    surface = pygame.Surface((100, 60))
    draw_arrow(surface, (10.0, 30.5), (80.0, 30.5), WHITE, 2.0)
    across = covered(surface).sum(1)
    assert np.flatnonzero(across).max() == pytest.approx(80, abs=1)  # whole pixels
    assert 67 <= np.argmax(across) <= 73
    assert across.max() > 3 * across[30]


def test_dashes_keep_their_phase_when_the_start_is_clipped():
    rows = []
    for start in (-1003.25, -3.25):  # differ by a whole number of dashes and gaps of 5 px each
        surface = pygame.Surface((100, 20))
        draw_dashes(surface, [((start, 10.5), (300.0, 10.5))], WHITE, 5.0, antialias=False)
        rows.append(covered(surface)[:, 10])
    assert (rows[0] == rows[1]).all()
    assert 0.4 < rows[0].mean() < 0.7  # dashes and gaps are equal; dashes end on whole pixels


def ink_rect(surface: pygame.Surface) -> pygame.Rect:
    first, *others = pygame.mask.from_threshold(surface, WHITE, (200, 200, 200)).get_bounding_rects()
    return first.unionall(others)


@pytest.mark.parametrize("anchor", ["topleft", "midright", "center", "bottomright", "midbottom"])
def test_text_is_placed_by_its_anchor(anchor):
    surface = pygame.Surface((300, 200))
    rect = draw_text(surface, "Hällo μ", (150.0, 100.0), 20, WHITE, anchor)
    assert getattr(rect, anchor) == (150, 100)
    assert rect.contains(ink_rect(surface))


def test_text_size_equals_the_drawn_rectangle():
    surface = pygame.Surface((300, 200))
    for bold in (False, True):
        for mono in (False, True):
            rect = draw_text(surface, "0.123 m/s", (0, 0), 17, WHITE, bold=bold, mono=mono)
            assert rect.size == text_size("0.123 m/s", 17, bold, mono)


def test_digits_are_equally_wide_in_the_mono_font():
    assert text_size("1111", 16, mono=True) == text_size("8888", 16, mono=True)


@pytest.mark.parametrize("text", ["", "\0", "a\nb", "\ud800", "\u200b", "\U000e0100", "x" * 100_000, "🎱"])
def test_any_text_can_be_drawn(text):
    surface = pygame.Surface((50, 50))
    assert draw_text(surface, text, (10, 10), 12, WHITE).topleft == (10, 10)


@pytest.mark.parametrize("position", [(math.nan, 0.0), (0.0, math.inf), (1e30, 0.0), (0.0, -1e300)])
def test_text_at_an_invalid_position_is_omitted(position):
    surface = pygame.Surface((50, 50))
    assert draw_text(surface, "words", position, 12, WHITE).size == (0, 0)
    assert not pygame.surfarray.array3d(surface).any()


@pytest.mark.parametrize("size", [0.0, -5.0, math.nan, math.inf, 1e9])
def test_any_text_size_is_clamped(size):
    assert 0 < text_size("word", size)[1] < 500


def test_fonts_are_reloaded_after_pygame_quit():
    before = text_size("word", 16)
    pygame.quit()
    assert text_size("word", 16) == before


def test_font_is_an_installed_file():
    assert font_file(bold=True, mono=True).name == "DejaVuSansMono-Bold.ttf"
