"""Keys: all documented bindings, keys claimed by scenes, modifiers, keyboard layouts and key repeat."""

import pygame
import pytest

from sandbox.window.input.keymap import GLOBAL, Command, Keyboard, command_for
from sandbox.window.playback.snapshot import OVERLAYS
from tests.window.pressing import FOCUS_LOST, key, key_up

CTRL = pygame.KMOD_LCTRL


def typed(code: int) -> str:
    """Return the character that a key without modifiers types."""
    return chr(code) if code < 0x110000 else ""


def test_some_keys_have_the_commands_of_the_documentation() -> None:
    for letter, command in (
        ("p", "PAUSE"),
        (" ", "PAUSE"),
        ("e", "ENGINE"),
        ("t", "TRUST"),
        ("m", "SOUND"),
        ("9", "TRAILS"),
    ):
        assert command_for(key(ord(letter), unicode=letter)) == Command[command]
    assert command_for(key(pygame.K_z, CTRL)) == Command.UNDO
    assert command_for(key(pygame.K_F11)) == Command.FULL_SCREEN


def test_key_gives_its_command_by_code_and_by_character_with_exactly_its_modifiers() -> None:
    """Ctrl gives only the commands bound to it, at either Ctrl key; Alt and Meta leave a key to the system."""
    bound = {(code, command.modifiers): command for command in Command for code in command.keys}
    for code in {code for code, _ in bound}:
        for event in (key(code), key(code, unicode=typed(code))):
            assert command_for(event) == bound.get((code, 0))
        for mod in (pygame.KMOD_LCTRL, pygame.KMOD_RCTRL, pygame.KMOD_LCTRL | pygame.KMOD_CAPS):
            assert command_for(key(code, mod, unicode=typed(code))) == bound.get((code, pygame.KMOD_CTRL))
        for mod in (pygame.KMOD_LALT, pygame.KMOD_LMETA, pygame.KMOD_LMETA | pygame.KMOD_LSHIFT):
            assert command_for(key(code, mod, unicode=typed(code))) is None


@pytest.mark.parametrize("mod", [pygame.KMOD_LSHIFT, pygame.KMOD_CAPS, pygame.KMOD_NUM])
def test_shift_and_locks_change_no_letter(mod: int) -> None:
    assert command_for(key(pygame.K_p, mod, unicode="P")) == Command.PAUSE
    assert command_for(key(pygame.K_g, mod, unicode="G")) == Command.GHOST
    assert command_for(key(pygame.K_EQUALS, mod, unicode="+")) == Command.FASTER


@pytest.mark.parametrize("mod", [pygame.KMOD_LSHIFT, pygame.KMOD_RSHIFT, pygame.KMOD_LSHIFT | pygame.KMOD_NUM])
def test_shift_and_b_add_a_box(mod: int) -> None:
    assert command_for(key(pygame.K_b, mod, unicode="B")) == Command.ADD_BOX
    assert command_for(key(pygame.K_b, mod, unicode="B"), frozenset({pygame.K_b})) is None
    assert command_for(key(pygame.K_b, mod | pygame.KMOD_LALT, unicode="B")) is None


def test_claimed_keys_give_no_command_except_global_ones() -> None:
    every = frozenset(code for command in Command for code in command.keys)
    for character in (lambda _: "", typed):
        kept = {code for code in every if command_for(key(code, unicode=character(code)), every) is not None}
        assert kept == GLOBAL == {pygame.K_p, pygame.K_o, pygame.K_F1, pygame.K_ESCAPE}


def test_claimed_letter_keeps_its_ctrl_command() -> None:
    claimed = frozenset({pygame.K_s, pygame.K_r, pygame.K_l})
    assert command_for(key(pygame.K_s, CTRL), claimed) == Command.SAVE
    assert command_for(key(pygame.K_r, CTRL), claimed) == Command.RECORD
    assert command_for(key(pygame.K_l, CTRL), claimed) == Command.RELOAD


def test_bracket_typed_with_altgr_is_not_its_digit() -> None:
    for mod in (pygame.KMOD_MODE, pygame.KMOD_RALT, pygame.KMOD_LCTRL | pygame.KMOD_RALT):
        assert command_for(key(pygame.K_8, mod, unicode="[")) == Command.PREVIOUS
        assert command_for(key(pygame.K_9, mod, unicode="]")) == Command.NEXT


def test_digit_of_a_french_keyboard_is_found_by_its_character() -> None:
    assert command_for(key(pygame.K_AMPERSAND, pygame.KMOD_LSHIFT, unicode="1")) == Command.SHAPES


def test_equals_and_plus_of_a_german_keyboard_give_faster() -> None:
    assert command_for(key(pygame.K_0, pygame.KMOD_LSHIFT, unicode="=")) == Command.FASTER
    assert command_for(key(pygame.K_PLUS, unicode="+")) == Command.FASTER


def test_letter_of_a_russian_keyboard_is_found_by_its_scancode() -> None:
    assert command_for(key(ord("з"), unicode="з", scancode=pygame.KSCAN_P)) == Command.PAUSE
    assert command_for(key(ord("з"), CTRL, scancode=pygame.KSCAN_P)) == Command.SCREENSHOT
    assert command_for(key(ord("х"), unicode="х", scancode=pygame.KSCAN_LEFTBRACKET)) == Command.PREVIOUS


def test_other_events_and_keys_give_no_command() -> None:
    assert command_for(key_up(pygame.K_p)) is None
    assert command_for(pygame.event.Event(pygame.MOUSEMOTION, pos=(0, 0))) is None
    assert command_for(key(pygame.K_F7)) is None
    assert command_for(key(pygame.K_q, unicode="q")) is None


def test_every_command_has_a_key_and_every_key_one_command() -> None:
    assert all(command.keys for command in Command)
    bound = [(code, command.modifiers) for command in Command for code in command.keys]
    assert len(bound) == len(set(bound))


def test_overlay_commands_follow_the_order_of_overlays() -> None:
    found = tuple(command.overlay for command in Command if command.overlay is not None)
    assert found == OVERLAYS
    assert Command.PAUSE.overlay is None


def test_only_step_and_speed_keys_repeat() -> None:
    repeating = {Command.STEP, Command.BACK, Command.SLOWER, Command.FASTER}
    for command in Command:
        keyboard = Keyboard()
        event = key(command.keys[0], command.modifiers)
        assert keyboard.command(event) == command
        assert keyboard.command(event) == (command if command in repeating else None)
        assert keyboard.command(key_up(command.keys[0])) is None
        assert keyboard.command(event) == command


def test_repeat_of_a_claimed_key_is_detected() -> None:
    keyboard, claimed = Keyboard(), frozenset({pygame.K_SPACE})
    repeats = []
    for event in (key(pygame.K_SPACE), key(pygame.K_SPACE), key_up(pygame.K_SPACE), key(pygame.K_SPACE)):
        keyboard.command(event, claimed)
        repeats.append(keyboard.is_repeat)
    assert repeats == [False, True, True, False]


def test_key_is_not_a_repeat_after_the_focus_was_lost() -> None:
    keyboard = Keyboard()
    keyboard.command(key(pygame.K_p))
    keyboard.command(FOCUS_LOST)
    assert keyboard.command(key(pygame.K_p)) == Command.PAUSE
