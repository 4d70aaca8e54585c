"""Control keys: the keys of a game's controls, from the names that rules give them to what the keyboard sends."""

from functools import partial

import pygame

from sandbox.games.rules import Control
from sandbox.play.cue_keys import Deed
from sandbox.play.hosting.host import Host
from sandbox.play.keys import GLOBAL
from sandbox.play.running.live import Live

NAMED: dict[str, tuple[int, ...]] = {
    "left": (pygame.K_LEFT,),
    "right": (pygame.K_RIGHT,),
    "up": (pygame.K_UP,),
    "down": (pygame.K_DOWN,),
    "space": (pygame.K_SPACE,),
    "enter": (pygame.K_RETURN, pygame.K_KP_ENTER),
    "backspace": (pygame.K_BACKSPACE,),
    "delete": (pygame.K_DELETE,),
    "left shift": (pygame.K_LSHIFT,),
    "right shift": (pygame.K_RSHIFT,),
    "left ctrl": (pygame.K_LCTRL,),
    "right ctrl": (pygame.K_RCTRL,),
}
"""Keys that write nothing; all others are called by what they write."""

DIRECTIONS = ("left", "right", "up", "down")
"""of a gamepad's cross"""


class KeyNameError(ValueError):
    """Rules call a key by a name that there is not, or claim one that no scene can."""


def codes_of(name: str) -> tuple[int, ...]:
    """Return the codes of a key by its name.

    Raises:
        KeyNameError: no key is called so, or it is none that can be claimed.
    """
    codes = NAMED.get(name) or ((ord(name),) if len(name) == 1 and name.isprintable() and name == name.lower() else ())
    if not codes or GLOBAL & set(codes):
        raise KeyNameError(f"key {name!r} cannot be assigned; use {', '.join(NAMED)}, or a letter, digit or sign")
    return codes


def deeds(host: Host) -> tuple[dict[int, Deed], dict[int, Deed]]:
    """Return what keys do, and what is done when they are let go."""
    pressed: dict[int, Deed] = {}
    released: dict[int, Deed] = {}
    for control in host.controls:
        for code in (code for key in control.keys for code in codes_of(key)):
            pressed[code] = partial(_hold, host=host, code=code, control=control.name, value=1.0)
            released[code] = partial(_hold, host=host, code=code, control=control.name, value=0.0)
    return pressed, released


def _hold(live: Live, host: Host, code: int, control: str, value: float) -> None:
    if live is host.live:  # a key may be let go in another game than it was pressed in
        host.hold(code, control, value)


def told(controls: tuple[Control, ...]) -> tuple[tuple[str, str], ...]:
    """Return the keys and what they do, as help lists them."""
    rows = []
    for control in controls:
        keys = " or ".join(" ".join(word.capitalize() for word in key.split()) for key in control.keys)
        pad = f"; gamepad: {_buttons(control.pad)}" if control.pad else ""
        rows.append((keys or "Gamepad", f"{control.about}{pad}"))
    if any(control.pad for control in controls):
        rows.append(("Gamepad Start", "pause / resume"))
    return tuple(rows)


def _buttons(pad: str) -> str:
    sticks = {"x": ("left", "right"), "y": ("up", "down")}
    words = []
    for word in pad.split():
        if word[0] in "+-":
            which = "right stick" if word[1:-1] == "right" else "stick"
            words.append(f"{which} {sticks[word[-1]][word[0] == '+']}")
        else:
            words.append(f"D-pad {word}" if word in DIRECTIONS else word.upper() if len(word) <= 2 else word)
    return ", ".join(words)
