import math

import pygame
import pytest

from sandbox.window.render.text import draw_text, font_file, text_size

WHITE = (255, 255, 255)


def ink_rect(surface: pygame.Surface) -> pygame.Rect:
    return (
        pygame.mask.from_threshold(surface, WHITE, (200, 200, 200))
        .get_bounding_rects()[0]
        .unionall(pygame.mask.from_threshold(surface, WHITE, (200, 200, 200)).get_bounding_rects())
    )


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
