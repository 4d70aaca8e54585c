"""Help overlay: it lists every key, keys of the scene first, and fits into any window."""

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.window.input.keymap import Command
from sandbox.window.ui.help import SCENE_GROUP, HelpOverlay, help_groups
from tests.window.pressing import key, press, wheel

SCENE_KEYS = (("S (hold)", "stroke"), ("Space", "shoot"), ("G", "ball in hand"))


def test_help_lists_every_command() -> None:
    listed = {line for group in help_groups() for line in group.lines}
    assert {(command.label, command.about) for command in Command} <= listed


def test_help_lists_the_actions_of_the_mouse() -> None:
    mouse = dict(help_groups()[-1].lines)
    assert mouse["Wheel"] == "zoom at the cursor"
    assert mouse["Right-drag"] == "pan"
    assert mouse["Left-drag"] == "pull a body"
    assert mouse["Left-drag, paused"] == "move a body"


def test_scene_keys_come_first_and_replace_keys_of_the_window() -> None:
    found = help_groups(SCENE_KEYS)
    assert found[0].title == SCENE_GROUP
    assert found[0].lines == SCENE_KEYS
    window_keys = {about: label for group in found[1:] for label, about in group.lines}
    assert window_keys["pause / resume"] == "P"
    assert window_keys["(ghost: another engine's run)"] == "G"
    assert "ghost: another engine's run" not in window_keys
    lines = {line for group in help_groups((("P", "x"), ("Esc", "y")))[1:] for line in group.lines}
    assert {("P or Space", "pause / resume"), ("Esc", "quit")} <= lines  # a claim on a global key is ignored


def test_gamepad_rows_are_listed_if_given() -> None:
    rows = (("A", "fire"),)
    assert [group.lines for group in help_groups(SCENE_KEYS, rows) if group.title == "Gamepad"] == [rows]
    assert all(group.title != "Gamepad" for group in help_groups(SCENE_KEYS))


def test_mouse_actions_of_a_game_replace_those_of_the_window() -> None:
    mouse = dict(help_groups((("Left-drag", "draw the cue back"), ("Click", "call a ball")))[-1].lines)
    assert list(mouse) == ["Wheel", "Right-drag"]


def test_any_key_or_click_closes_help_and_is_consumed() -> None:
    for event in (key(pygame.K_p), key(pygame.K_F1), key(pygame.K_ESCAPE), press(5, 5)):
        overlay = HelpOverlay()
        assert not overlay.handle_event(event)
        overlay.open = True
        assert overlay.handle_event(event)
        assert not overlay.open


@pytest.mark.parametrize(("size", "fits"), [((300, 200), False), ((1280, 800), True)])
def test_wheel_scrolls_help_only_if_it_does_not_fit(size: tuple[int, int], fits: bool) -> None:
    overlay = HelpOverlay()
    overlay.open = True
    first, later = pygame.Surface(size), pygame.Surface(size)
    overlay.draw(first, 1.0, SCENE_KEYS)
    assert overlay.handle_event(wheel(-2))
    assert overlay.handle_event(press(5, 5, button=5))  # the same notch as a legacy button event
    assert overlay.open
    overlay.draw(later, 1.0, SCENE_KEYS)
    assert (pygame.image.tobytes(first, "RGB") == pygame.image.tobytes(later, "RGB")) == fits


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(("size", "ui_scale"), [((640, 480), 1.0), ((1280, 800), 1.0), ((3840, 2160), 2.0)])
def test_help_fits_into_common_window_sizes(size: tuple[int, int], ui_scale: float) -> None:
    surface = pygame.Surface(size)
    surface.fill((1, 2, 3))
    HelpOverlay().draw(surface, ui_scale)
    edge = pygame.surfarray.array3d(surface)[:, [0, 1, -2, -1]]
    assert len({tuple(colour) for colour in edge.reshape(-1, 3).tolist()}) == 1  # no text at the upper or lower edge


@given(
    st.integers(1, 700), st.integers(1, 500), st.floats(0.25, 4), st.lists(st.tuples(st.text(), st.text()), max_size=30)
)
def test_help_is_drawn_on_any_size(width: int, height: int, ui_scale: float, scene_keys: list[tuple[str, str]]) -> None:
    surface = pygame.Surface((width, height))
    HelpOverlay().draw(surface, ui_scale, scene_keys)
    assert surface.get_at((0, 0)) != (0, 0, 0)
