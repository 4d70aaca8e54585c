"""Keys that a scene or its game binds, on keyboard layouts with other letters, or with signs in other places."""

import pygame
import pytest

from sandbox.window.input.keymap import GLOBAL, Command, bound_key, command_for
from tests.window.pressing import key

US = "`1234567890-=qwertyuiop[]\\asdfghjkl;'zxcvbnm,./"
SCANCODES = (
    *(pygame.KSCAN_GRAVE, *range(pygame.KSCAN_1, pygame.KSCAN_0 + 1), pygame.KSCAN_MINUS, pygame.KSCAN_EQUALS),
    *(pygame.KSCAN_A + ord(letter) - ord("a") for letter in "qwertyuiop"),
    *(pygame.KSCAN_LEFTBRACKET, pygame.KSCAN_RIGHTBRACKET, pygame.KSCAN_BACKSLASH),
    *(pygame.KSCAN_A + ord(letter) - ord("a") for letter in "asdfghjkl"),
    *(pygame.KSCAN_SEMICOLON, pygame.KSCAN_APOSTROPHE),
    *(pygame.KSCAN_A + ord(letter) - ord("a") for letter in "zxcvbnm"),
    *(pygame.KSCAN_COMMA, pygame.KSCAN_PERIOD, pygame.KSCAN_SLASH),
)
"""Scan codes of the keys of `US`, in that order"""
LATIN = {
    "us": US,
    "german": "^1234567890ß´qwertzuiopü+#asdfghjklöäyxcvbnm,.-",
    "french": "²&é\"'(-è_çà)=azertyuiop^$*qsdfghjklmùwxcvbn,;:!",
    "dvorak": "`1234567890[]',.pyfgcrl/=\\aoeuidhtns-;qjkxbmwvz",
}
FOREIGN = {
    "russian": "ё1234567890-=йцукенгшщзхъ\\фывапролджэячсмитьбю.",
    "greek": "`1234567890-=;ςερτυθιοπ[]\\ασδφγηξκλ΄'ζχψωβνμ,./",
    "hebrew": ";1234567890-=/'קראטוןםפ][\\שדגכעיחלךף,זסבהנמצתץ.",
    "thai": "_ๅ/-ภถุึคตจขชๆไำพะัีรนยบลฃฟหกดเ้่าสวงผปแอิืทมใฝ",
}
LAYOUTS = {**LATIN, **FOREIGN}
LETTERS = "".join(letter for letter in US if letter.isalpha() and ord(letter) not in GLOBAL)
GAME_KEYS = {"pinball": "z/", "billiards": "sexgzcd", "artillery": "w", "curling": "ts", "all letters": LETTERS}


def board(layout: str) -> list[tuple[str, pygame.event.Event]]:
    """Return the character that the US layout has on each key, and the event of a press of that key."""
    characters = LAYOUTS[layout]
    assert len(characters) == len(US) == len(SCANCODES)
    return [
        (letter, key(ord(character), unicode=character, scancode=code))
        for letter, character, code in zip(US, characters, SCANCODES, strict=True)
    ]


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("keys", GAME_KEYS.values(), ids=GAME_KEYS)
def test_each_bound_key_can_be_pressed_and_has_no_command(layout: str, keys: str) -> None:
    bound = frozenset(map(ord, keys))
    found = {letter: (event, bound_key(event, bound)) for letter, event in board(layout)}
    assert {code for _, code in found.values() if code is not None} == bound
    for letter, (event, code) in found.items():
        assert (code is None) or command_for(event, bound) is None
        if chr(event.key) in keys:  # the character on the key comes first
            assert code == event.key
        elif letter in keys and layout in FOREIGN and letter.isalpha():
            assert code == ord(letter)
        elif code is not None:
            assert letter in keys and code == ord(letter)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_keys_that_no_game_binds_keep_their_commands(layout: str) -> None:
    bound = frozenset({ord("z"), ord("/")})
    for letter, event in board(layout):
        if letter not in "z/" and chr(event.key) not in "z/":
            assert bound_key(event, bound) is None
            assert command_for(event, bound) == command_for(event)


@pytest.mark.parametrize("layout", LATIN)
def test_letter_with_a_command_keeps_it_at_the_place_of_a_bound_key(layout: str) -> None:
    for letter, event in board(layout):
        character = chr(event.key)
        if character.isascii() and character.isalpha() and character != letter:
            assert bound_key(event, frozenset({ord(letter)})) is None
    assert layout != "dvorak" or bound_key(key(ord("."), unicode=".", scancode=pygame.KSCAN_E), {ord("e")}) is None


def test_slash_of_a_russian_keyboard_steps_only_if_no_game_binds_it() -> None:
    event = key(ord("."), unicode=".", scancode=pygame.KSCAN_SLASH)
    assert command_for(event) is command_for(event, frozenset({ord("z")})) is Command.STEP
    assert command_for(event, frozenset({ord("/")})) is None
    assert bound_key(event, {ord("/")}) == ord("/")


@pytest.mark.parametrize("layout", FOREIGN)
def test_letters_and_digits_have_their_commands_by_place(layout: str) -> None:
    for letter, event in board(layout):
        if letter.isalnum() and not chr(event.key).isascii():
            assert command_for(event) == command_for(key(ord(letter), unicode=letter))
