"""Keymap: the commands of the window with their keys, and the state of the keyboard.

A command's key is matched by its key code or its character, so that `[` also works on layouts that need AltGr for it,
and by its scan code on layouts without Latin letters. The keys that a scene or its game binds come first (`bound_key`).
"""

from collections.abc import Set as AbstractSet
from enum import StrEnum

import pygame

from sandbox.window.playback.snapshot import OVERLAYS

_TIME, _VIEW, _SCENE, _BODIES, _SHOW, _WINDOW = "Time", "View", "Scene", "Bodies", "Show", "Save and share"
_CTRL, _SHIFT = pygame.KMOD_CTRL, pygame.KMOD_SHIFT


class Command(StrEnum):
    """Commands of the window, in the order of the help page. One that toggles an overlay has its name in `OVERLAYS`.

    The columns are: name, key codes, modifiers, description, keys as shown on the help page, group of the help page,
    characters, and whether the command repeats.
    """

    keys: tuple[int, ...]
    """key codes, `pygame.K_…`"""
    modifiers: int
    """`pygame.KMOD_CTRL`, `KMOD_SHIFT`, or 0 for neither Ctrl nor Alt; Shift is ignored unless a command requires it"""
    about: str
    label: str
    """keys as shown on the help page"""
    group: str
    characters: str
    """characters that trigger the command on any key"""
    repeats: bool
    """whether the command repeats while the key is held"""

    def __new__(
        cls,
        name: str,
        keys: tuple[int, ...],
        modifiers: int,
        about: str,
        label: str,
        group: str,
        characters: str = "",
        repeats: bool = False,
    ) -> "Command":
        """Create a member from its row."""
        command = str.__new__(cls, name)
        command._value_ = name
        command.keys, command.modifiers, command.about, command.label = keys, modifiers, about, label
        command.group, command.characters, command.repeats = group, characters, repeats
        return command

    PAUSE = "pause", (pygame.K_p, pygame.K_SPACE), 0, "pause / resume", "P or Space", _TIME
    STEP = "step", (pygame.K_o, pygame.K_PERIOD), 0, "step forward", "O or .", _TIME, ".", True
    BACK = "back", (pygame.K_COMMA,), 0, "step back", ",", _TIME, ",", True
    RESTART = "restart", (pygame.K_r, pygame.K_BACKSPACE), 0, "restart", "R or Backspace", _TIME
    SLOWER = "slower", (pygame.K_MINUS, pygame.K_KP_MINUS), 0, "slower: 80 %, 63 %, 50 % …", "-", _TIME, "-", True
    FASTER = "faster", (pygame.K_EQUALS, pygame.K_PLUS, pygame.K_KP_PLUS), 0, "faster", "=", _TIME, "=+", True
    PREVIOUS = "previous", (pygame.K_LEFTBRACKET,), 0, "previous scene", "[", _SCENE, "["
    NEXT = "next", (pygame.K_RIGHTBRACKET,), 0, "next scene", "]", _SCENE, "]"
    PICKER = "picker", (pygame.K_o,), _CTRL, "open a scene", "Ctrl+O", _SCENE
    RELOAD = "reload", (pygame.K_l,), _CTRL, "reload the file", "Ctrl+L", _SCENE
    EDIT = "edit", (pygame.K_e,), _CTRL, "edit the scene", "Ctrl+E", _SCENE
    ENGINE = "engine", (pygame.K_e,), 0, "next engine", "E", _SCENE
    GHOST = "ghost", (pygame.K_g,), 0, "ghost: another engine's run", "G", _SCENE
    TRUST = "trust", (pygame.K_t,), 0, "predictability horizon", "T", _SCENE
    HOME = "home", (pygame.K_HOME,), 0, "fit the scene; again: fit the bodies", "Home", _VIEW
    FOLLOW = "follow", (pygame.K_f,), 0, "follow the selected body, or all", "F", _VIEW
    FULL_SCREEN = "full screen", (pygame.K_F11,), 0, "full screen", "F11", _VIEW
    PANEL = "panel", (pygame.K_TAB,), 0, "show or hide the panel", "Tab", _VIEW
    ADD_BALL = "add ball", (pygame.K_b,), 0, "add a ball at the cursor", "B", _BODIES
    ADD_BOX = "add box", (pygame.K_b,), _SHIFT, "add a box at the cursor", "Shift+B", _BODIES
    NUDGE = "nudge", (pygame.K_n,), 0, "nudge the selected body", "N", _BODIES
    DELETE = "delete", (pygame.K_DELETE,), 0, "remove the selected body", "Delete", _BODIES
    UNDO = "undo", (pygame.K_z,), _CTRL, "restore the replaced session", "Ctrl+Z", _BODIES
    SHAPES = "shapes", (pygame.K_1,), 0, "shapes", "1", _SHOW, "1"
    VELOCITIES = "velocities", (pygame.K_2,), 0, "velocities", "2", _SHOW, "2"
    CONTACTS = "contacts", (pygame.K_3,), 0, "contacts and normals", "3", _SHOW, "3"
    IMPULSES = "impulses", (pygame.K_4,), 0, "impulses", "4", _SHOW, "4"
    BOUNDS = "bounds", (pygame.K_5,), 0, "bounds", "5", _SHOW, "5"
    JOINTS = "joints", (pygame.K_6,), 0, "joints", "6", _SHOW, "6"
    CENTRES = "centres", (pygame.K_7,), 0, "centres of mass", "7", _SHOW, "7"
    NAMES = "names", (pygame.K_8,), 0, "names", "8", _SHOW, "8"
    TRAILS = "trails", (pygame.K_9,), 0, "trails", "9", _SHOW, "9"
    ENERGY = "energy", (pygame.K_0,), 0, "energy graph", "0", _SHOW, "0"
    SCREENSHOT = "screenshot", (pygame.K_p,), _CTRL, "screenshot", "Ctrl+P", _WINDOW
    RECORD = "record", (pygame.K_r,), _CTRL, "start or stop recording", "Ctrl+R", _WINDOW
    SAVE = "save", (pygame.K_s,), _CTRL, "save the session", "Ctrl+S", _WINDOW
    SOUND = "sound", (pygame.K_m,), 0, "sound", "M", _WINDOW
    HELP = "help", (pygame.K_F1, pygame.K_h), 0, "this help", "F1 or H", _WINDOW
    QUIT = "quit", (pygame.K_ESCAPE,), 0, "quit", "Esc", _WINDOW

    @property
    def overlay(self) -> str | None:
        """The overlay that the command toggles, one of `OVERLAYS`."""
        return str(self) if self in OVERLAYS else None


GLOBAL = frozenset({pygame.K_p, pygame.K_o, pygame.K_F1, pygame.K_ESCAPE})
"""Keys that a scene cannot bind."""

_BY_KEY = {(key, command.modifiers): command for command in Command for key in command.keys}
_BY_CHARACTER = {character: command for command in Command for character in command.characters}

_NAMED = 1 << 30
"""bit that SDL sets in key codes without a character, such as F1"""
_US_KEYS = {
    **{pygame.KSCAN_A + k: pygame.K_a + k for k in range(26)},
    **{pygame.KSCAN_1 + k: pygame.K_1 + k for k in range(9)},
    pygame.KSCAN_0: pygame.K_0,
    pygame.KSCAN_GRAVE: pygame.K_BACKQUOTE,
    pygame.KSCAN_MINUS: pygame.K_MINUS,
    pygame.KSCAN_EQUALS: pygame.K_EQUALS,
    pygame.KSCAN_LEFTBRACKET: pygame.K_LEFTBRACKET,
    pygame.KSCAN_RIGHTBRACKET: pygame.K_RIGHTBRACKET,
    pygame.KSCAN_BACKSLASH: pygame.K_BACKSLASH,
    pygame.KSCAN_SEMICOLON: pygame.K_SEMICOLON,
    pygame.KSCAN_APOSTROPHE: pygame.K_QUOTE,
    pygame.KSCAN_COMMA: pygame.K_COMMA,
    pygame.KSCAN_PERIOD: pygame.K_PERIOD,
    pygame.KSCAN_SLASH: pygame.K_SLASH,
}
"""Key codes of the US layout by scan code, of the keys that type a character."""


def command_for(event: pygame.event.Event, claimed: AbstractSet[int] = frozenset()) -> Command | None:
    """Return the command of a pressed key, or None.

    Args:
        event: any event; only KEYDOWN triggers a command.
        claimed: codes of the keys that the scene binds. Scenes never bind keys with Ctrl.
    """
    if event.type != pygame.KEYDOWN:
        return None
    key = latin_key(event)
    modifiers = int(getattr(event, "mod", 0))
    control, alt = modifiers & pygame.KMOD_CTRL, modifiers & (pygame.KMOD_ALT | pygame.KMOD_MODE)
    character = str(getattr(event, "unicode", ""))
    if modifiers & pygame.KMOD_META:
        return None
    if control and not alt:
        return _BY_KEY.get((key, _CTRL))
    if bound_key(event, claimed - GLOBAL) is not None:
        return None
    plain = not (control or alt)
    if character in _BY_CHARACTER and (plain or ord(character) != key):
        return _BY_CHARACTER[character]  # first, as `[` may be AltGr+8, and AltGr may be reported as Ctrl+Alt
    shifted = _BY_KEY.get((key, _SHIFT)) if modifiers & _SHIFT else None
    return (shifted or _BY_KEY.get((key, 0))) if plain else None


def latin_key(event: pygame.event.Event) -> int:
    """Return the key code; on a layout without Latin letters, the US key code of the scan code."""
    key = int(event.key)
    foreign = key > 0x24F and not key & _NAMED  # beyond the Latin blocks of Unicode
    return _us_key(event, key) if foreign else key


def bound_key(event: pygame.event.Event, bound: AbstractSet[int]) -> int | None:
    """Return which key that a scene or game binds is pressed, by the character on the key, else by its place.

    The place counts on keys without a Latin letter or a digit, as other layouts have signs elsewhere or only with
    Shift: at the place of `/`, Russian keyboards have `.`, and German ones `-`. A letter has a key of its own on all
    layouts with Latin letters, so that a sign with a command keeps it at the place of a letter.

    Args:
        event: a key press.
        bound: key codes.
    """
    key = int(event.key)
    if key in bound:
        return key
    character = "" if key & _NAMED else chr(key)
    if not character or (character.isascii() and character.isalnum()):
        return None
    place = _us_key(event, key)
    has_command = character in _BY_CHARACTER and chr(place).isalpha()
    return place if place in bound and not has_command else None


def _us_key(event: pygame.event.Event, key: int) -> int:
    """Return the key code that the US layout has at the scan code of an event; `key` if it has none."""
    return _US_KEYS.get(int(getattr(event, "scancode", 0)), key)


def pressed_key(event: pygame.event.Event) -> tuple[bool, int]:
    """Return what press and release of a key have in common: the scan code, as the layout may change in between.

    Events without a scan code, such as those of a virtual keyboard, have their key code.
    """
    scancode = int(getattr(event, "scancode", 0))
    return (True, scancode) if scancode else (False, int(event.key))


class Keyboard:
    """Set of pressed keys, which suppresses key repeat for commands that do not repeat."""

    def __init__(self) -> None:
        self._held: set[tuple[bool, int]] = set()
        self.is_repeat = False
        """whether the last KEYDOWN was a key repeat"""

    def command(self, event: pygame.event.Event, claimed: AbstractSet[int] = frozenset()) -> Command | None:
        """Return the command of an event, or None. Every event must be passed, so that releases are tracked."""
        if event.type == pygame.KEYUP:
            self._held.discard(pressed_key(event))
        elif event.type == pygame.WINDOWFOCUSLOST:  # another window receives the key releases
            self._held.clear()
        if event.type != pygame.KEYDOWN:
            return None
        self.is_repeat = pressed_key(event) in self._held
        self._held.add(pressed_key(event))
        command = command_for(event, claimed)
        return None if command is None or (self.is_repeat and not command.repeats) else command
