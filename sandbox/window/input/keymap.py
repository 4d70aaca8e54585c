"""Keymap: all key bindings of the window, and the state of the keyboard.

A command's key is matched by its key code or its character, so that `[` also works on layouts that need AltGr for it,
and by its scan code on layouts without Latin letters. The keys that a scene or its game binds come first (`bound_key`).
"""

from collections.abc import Set as AbstractSet
from enum import StrEnum
from typing import NamedTuple

import pygame

from sandbox.window.playback.snapshot import OVERLAYS


class Command(StrEnum):
    """Commands of the window. A command that toggles an overlay has its name in `OVERLAYS`."""

    PAUSE = "pause"
    STEP = "step"
    BACK = "back"
    RESTART = "restart"
    PREVIOUS = "previous"
    NEXT = "next"
    PICKER = "picker"
    SLOWER = "slower"
    FASTER = "faster"
    ENGINE = "engine"
    GHOST = "ghost"
    HOME = "home"
    PANEL = "panel"
    HELP = "help"
    SCREENSHOT = "screenshot"
    RECORD = "record"
    RELOAD = "reload"
    SAVE = "save"
    QUIT = "quit"
    UNDO = "undo"
    FOLLOW = "follow"
    FULL_SCREEN = "full screen"
    TRUST = "trust"
    SOUND = "sound"
    DELETE = "delete"
    ADD_BALL = "add ball"
    ADD_BOX = "add box"
    NUDGE = "nudge"
    EDIT = "edit"
    SHAPES = "shapes"
    VELOCITIES = "velocities"
    CONTACTS = "contacts"
    IMPULSES = "impulses"
    BOUNDS = "bounds"
    JOINTS = "joints"
    CENTRES = "centres"
    NAMES = "names"
    TRAILS = "trails"
    ENERGY = "energy"

    @property
    def overlay(self) -> str | None:
        """The overlay that the command toggles, one of `OVERLAYS`."""
        return self.value if self.value in OVERLAYS else None


class Binding(NamedTuple):
    """Keys of a command."""

    keys: tuple[int, ...]
    """key codes, `pygame.K_…`"""
    modifiers: int
    """`pygame.KMOD_CTRL`, `KMOD_SHIFT`, or 0 for neither Ctrl nor Alt; Shift is ignored unless a binding requires it"""
    command: Command
    about: str
    label: str
    """keys as shown on the help page"""
    group: str
    characters: str = ""
    """characters that trigger the command on any key"""
    repeats: bool = False
    """whether the command repeats while the key is held"""


_TIME, _VIEW, _SCENE, _BODIES, _SHOW, _WINDOW = "Time", "View", "Scene", "Bodies", "Show", "Save and share"
_CTRL, _SHIFT = pygame.KMOD_CTRL, pygame.KMOD_SHIFT
_ABOUT_OVERLAYS = (
    "shapes",
    "velocities",
    "contacts and normals",
    "impulses",
    "bounds",
    "joints",
    "centres of mass",
    "names",
    "trails",
    "energy graph",
)

BINDINGS: tuple[Binding, ...] = (
    Binding((pygame.K_p, pygame.K_SPACE), 0, Command.PAUSE, "pause / resume", "P or Space", _TIME),
    Binding((pygame.K_o, pygame.K_PERIOD), 0, Command.STEP, "step forward", "O or .", _TIME, ".", True),
    Binding((pygame.K_COMMA,), 0, Command.BACK, "step back", ",", _TIME, ",", True),
    Binding((pygame.K_r, pygame.K_BACKSPACE), 0, Command.RESTART, "restart", "R or Backspace", _TIME),
    Binding(
        (pygame.K_MINUS, pygame.K_KP_MINUS), 0, Command.SLOWER, "slower: 80 %, 63 %, 50 % …", "-", _TIME, "-", True
    ),
    Binding((pygame.K_EQUALS, pygame.K_PLUS, pygame.K_KP_PLUS), 0, Command.FASTER, "faster", "=", _TIME, "=+", True),
    Binding((pygame.K_LEFTBRACKET,), 0, Command.PREVIOUS, "previous scene", "[", _SCENE, "["),
    Binding((pygame.K_RIGHTBRACKET,), 0, Command.NEXT, "next scene", "]", _SCENE, "]"),
    Binding((pygame.K_o,), _CTRL, Command.PICKER, "open a scene", "Ctrl+O", _SCENE),
    Binding((pygame.K_l,), _CTRL, Command.RELOAD, "reload the file", "Ctrl+L", _SCENE),
    Binding((pygame.K_e,), _CTRL, Command.EDIT, "edit the scene", "Ctrl+E", _SCENE),
    Binding((pygame.K_e,), 0, Command.ENGINE, "next engine", "E", _SCENE),
    Binding((pygame.K_g,), 0, Command.GHOST, "ghost: another engine's run", "G", _SCENE),
    Binding((pygame.K_t,), 0, Command.TRUST, "predictability horizon", "T", _SCENE),
    Binding((pygame.K_HOME,), 0, Command.HOME, "fit the scene; again: fit the bodies", "Home", _VIEW),
    Binding((pygame.K_f,), 0, Command.FOLLOW, "follow the selected body, or all", "F", _VIEW),
    Binding((pygame.K_F11,), 0, Command.FULL_SCREEN, "full screen", "F11", _VIEW),
    Binding((pygame.K_TAB,), 0, Command.PANEL, "show or hide the panel", "Tab", _VIEW),
    Binding((pygame.K_b,), 0, Command.ADD_BALL, "add a ball at the cursor", "B", _BODIES),
    Binding((pygame.K_b,), _SHIFT, Command.ADD_BOX, "add a box at the cursor", "Shift+B", _BODIES),
    Binding((pygame.K_n,), 0, Command.NUDGE, "nudge the selected body", "N", _BODIES),
    Binding((pygame.K_DELETE,), 0, Command.DELETE, "remove the selected body", "Delete", _BODIES),
    Binding((pygame.K_z,), _CTRL, Command.UNDO, "restore the replaced session", "Ctrl+Z", _BODIES),
    *(
        Binding((pygame.K_0 + int(digit),), 0, Command(name), about, digit, _SHOW, digit)
        for digit, name, about in zip("1234567890", OVERLAYS, _ABOUT_OVERLAYS, strict=True)
    ),
    Binding((pygame.K_p,), _CTRL, Command.SCREENSHOT, "screenshot", "Ctrl+P", _WINDOW),
    Binding((pygame.K_r,), _CTRL, Command.RECORD, "start or stop recording", "Ctrl+R", _WINDOW),
    Binding((pygame.K_s,), _CTRL, Command.SAVE, "save the session", "Ctrl+S", _WINDOW),
    Binding((pygame.K_m,), 0, Command.SOUND, "sound", "M", _WINDOW),
    Binding((pygame.K_F1, pygame.K_h), 0, Command.HELP, "this help", "F1 or H", _WINDOW),
    Binding((pygame.K_ESCAPE,), 0, Command.QUIT, "quit", "Esc", _WINDOW),
)
"""All bindings, in the order of the help page."""

GLOBAL = frozenset({pygame.K_p, pygame.K_o, pygame.K_F1, pygame.K_ESCAPE})
"""Keys that a scene cannot bind."""

REPEATING = frozenset(binding.command for binding in BINDINGS if binding.repeats)

_BY_KEY = {(key, binding.modifiers): binding.command for binding in BINDINGS for key in binding.keys}
_BY_CHARACTER = {character: binding.command for binding in BINDINGS for character in binding.characters}

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
        return None if self.is_repeat and command not in REPEATING else command
