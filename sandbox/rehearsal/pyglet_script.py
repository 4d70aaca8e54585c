"""Events of pyglet for the events of pygame that a script of inputs makes."""

from collections.abc import Sequence
from typing import Any

import pygame

from sandbox.rehearsal.pygame_inputs import KEYS

_KEY_NAMES = {
    "KP_ENTER": "NUM_ENTER",
    "KP_PLUS": "NUM_ADD",
    "KP_MINUS": "NUM_SUBTRACT",
    "KP_MULTIPLY": "NUM_MULTIPLY",
    "KP_DIVIDE": "NUM_DIVIDE",
    "KP_PERIOD": "NUM_DECIMAL",
    "KP_EQUALS": "NUM_EQUAL",
    **{f"KP{digit}": f"NUM_{digit}" for digit in range(10)},
    "LSUPER": "LWINDOWS",
    "RSUPER": "RWINDOWS",
    "SCROLLOCK": "SCROLLLOCK",
}
"""Names in pyglet of keys that pygame names otherwise"""
_MODIFIERS = {
    "MOD_SHIFT": ("LSHIFT", "RSHIFT"),
    "MOD_CTRL": ("LCTRL", "RCTRL"),
    "MOD_ALT": ("LALT", "RALT"),
}
_MOTIONS = ("UP", "DOWN", "LEFT", "RIGHT", "HOME", "END", "PAGEUP", "PAGEDOWN", "BACKSPACE", "DELETE")
"""Keys that move the cursor of a text"""


class ScriptedWindow:
    """Events of pyglet for those of pygame.

    Positions of the mouse are those of the library: in pyglet y points up.

    Args:
        key: module `pyglet.window.key`.
    """

    def __init__(self, key: Any) -> None:
        self._key = key
        self._pressed: set[int] = set()
        self._buttons = 0
        self._symbols = {
            code: code if 0x20 <= code < 0x7F else getattr(key, _KEY_NAMES.get(name.upper(), name.upper()), None)
            for name, code in KEYS.items()
        }
        self._motions = {getattr(key, name): getattr(key, f"MOTION_{name}", getattr(key, name)) for name in _MOTIONS}

    def events(self, event: pygame.event.Event, windows: Sequence[Any]) -> list[tuple[Any, tuple[Any, ...]]]:
        """Return the events of windows for an event of pygame: the first window has keyboard and mouse."""
        windows = [window for window in windows if window.context is not None]
        if event.type == pygame.QUIT:
            return [(window, ("on_close",)) for window in windows]
        return [(windows[0], each) for each in self._events(event)] if windows else []

    def _events(self, event: pygame.event.Event) -> list[tuple[Any, ...]]:
        if event.type in (pygame.KEYDOWN, pygame.KEYUP):
            return self._of_key(event)
        if event.type == pygame.MOUSEMOTION:
            if self._buttons:
                return [("on_mouse_drag", *event.pos, *event.rel, self._buttons, self._modifiers)]
            return [("on_mouse_motion", *event.pos, *event.rel)]
        if event.type in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            button = 1 << (event.button - 1)
            is_pressed = event.type == pygame.MOUSEBUTTONDOWN
            self._buttons = self._buttons | button if is_pressed else self._buttons & ~button
            name = "on_mouse_press" if is_pressed else "on_mouse_release"
            return [(name, *event.pos, button, self._modifiers)]
        return []

    def _of_key(self, event: pygame.event.Event) -> list[tuple[Any, ...]]:
        symbol = self._symbols.get(event.key)
        if symbol is None:
            symbol = self._key.user_key(event.scancode)
        modifiers = self._modifiers
        if event.type == pygame.KEYUP:
            self._pressed.discard(symbol)
            return [("on_key_release", symbol, modifiers)]
        self._pressed.add(symbol)
        found: list[tuple[Any, ...]] = [("on_key_press", symbol, modifiers)]
        if symbol in self._motions:
            found.append(("on_text_motion", self._motions[symbol]))
        elif symbol == self._key.RETURN:
            found.append(("on_text", "\r"))
        elif 0x20 <= symbol < 0x7F and not modifiers & ~self._key.MOD_SHIFT:
            found.append(("on_text", chr(symbol).upper() if modifiers else chr(symbol)))
        return found

    @property
    def _modifiers(self) -> int:
        return sum(
            getattr(self._key, name)
            for name, keys in _MODIFIERS.items()
            if any(getattr(self._key, each) in self._pressed for each in keys)
        )
