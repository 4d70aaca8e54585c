"""Claims: the keys that a scene takes for itself, and what they do.

Control keys: the keys of a game's controls, from the names that rules give them to what the keyboard sends.
"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import pygame

from sandbox.action import Action, Drive, Throttle
from sandbox.games.billiards.view import controls as cue_keys
from sandbox.games.billiards.view.controls import CueControls, KeyHandler
from sandbox.games.contract import Control
from sandbox.scene.compile.drives import names_of
from sandbox.scene.description.scene import default_name
from sandbox.scene.scene import Scene
from sandbox.window.game_host import GameHost
from sandbox.window.input.body_tools import BodyTools
from sandbox.window.input.keymap import GLOBAL
from sandbox.window.playback.live import LiveView

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


def control_handlers(host: GameHost) -> tuple[dict[int, KeyHandler], dict[int, KeyHandler]]:
    """Return what keys do, and what is done when they are let go."""
    pressed: dict[int, KeyHandler] = {}
    released: dict[int, KeyHandler] = {}
    for control in host.controls:
        for code in (code for key in control.keys for code in codes_of(key)):
            pressed[code] = partial(_hold, host=host, code=code, control=control.name, value=1.0)
            released[code] = partial(_hold, host=host, code=code, control=control.name, value=0.0)
    return pressed, released


def _hold(live: LiveView, host: GameHost, code: int, control: str, value: float) -> None:
    if live is host.live:  # a key may be let go in another game than it was pressed in
        host.hold(code, control, value)


def control_help(controls: tuple[Control, ...]) -> tuple[tuple[str, str], ...]:
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


ARROWS = {
    pygame.K_LEFT: (-1.0, 0.0),
    pygame.K_RIGHT: (1.0, 0.0),
    pygame.K_UP: (0.0, 1.0),
    pygame.K_DOWN: (0.0, -1.0),
}

KEYS = {
    "left": pygame.K_LEFT,
    "right": pygame.K_RIGHT,
    "up": pygame.K_UP,
    "down": pygame.K_DOWN,
    "space": pygame.K_SPACE,
    "left shift": pygame.K_LSHIFT,
    "right shift": pygame.K_RSHIFT,
    "z": pygame.K_z,
    "slash": pygame.K_SLASH,
    "return": pygame.K_RETURN,
}
"""The keys that thrusts and drives may have, as scenes call them."""


class KeyBindings(NamedTuple):
    """What a scene's `[play]` asks for."""

    deeds: dict[int, KeyHandler]
    """by key"""
    told: tuple[tuple[str, str], ...]
    """keys and what they do, as help names them"""
    releases: dict[int, KeyHandler]
    """by key, what is done when it is let go"""

    def deed(self, key: int, again: bool) -> KeyHandler | None:
        """Return what a key does; held, and so pressed again and again, only arrows that move something go on."""
        return None if again and (key not in ARROWS or key in self.releases) else self.deeds.get(key)


def key_bindings(
    scene: Scene, hands: BodyTools, gestures: CueControls | None = None, host: GameHost | None = None
) -> KeyBindings:
    """Return the keys that a scene claims, those of a table or of a game's controls among them."""
    deeds: dict[int, KeyHandler] = {}
    told: list[tuple[str, str]] = []
    body, step, generator = scene.play.arrows, scene.play.arrow_step, scene.play.relaunch
    if body is not None:
        for key, (x, y) in ARROWS.items():
            deeds[key] = partial(_shift, hands=hands, body=body, by=(x * step, y * step))
        told.append(("Arrows", f"move {body} by {step:g} m"))
    if generator is not None:
        deeds[pygame.K_SPACE] = partial(_relaunch, generator=generator)
        told.append(("Space", f"relaunch {generator}"))
    releases: dict[int, KeyHandler] = {}
    played, played_out = ({}, {}) if host is None else control_handlers(host)
    for called, verb, pressed, released in held(scene):
        key = KEYS[called]
        if key in played:  # it is the rules' to press
            continue
        deeds[key] = partial(_act, action=pressed, also=deeds.get(key))
        releases[key] = partial(_act, action=released, also=releases.get(key))
        told.append((called.capitalize(), verb))
    if host is not None:
        deeds |= played
        releases |= played_out
        told += control_help(host.controls)
    if gestures is not None:
        cue, let_go = cue_keys.cue_key_handlers(gestures)
        deeds |= cue
        releases |= let_go
        told += cue_keys.CUE_KEY_HELP
    return KeyBindings(deeds, tuple(told), releases)


def held(scene: Scene) -> Iterator[tuple[str, str, Action, Action]]:
    """Yield the keys that a scene's thrusts and drives have, what each does, and the actions of both its ends."""
    for k, thrust in enumerate(scene.thrusts):
        if thrust.key is not None:
            name = thrust.name or default_name("thrust", k)
            opened, closed = (Throttle(time=0.0, thrust=name, level=level) for level in (1.0, 0.0))
            yield thrust.key, f"fire {name}", opened, closed
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.key is not None:
            on, off = (Drive(time=0.0, drive=name, level=level) for level in (1.0, 0.0))
            yield drive.key, f"drive {name}", on, off


def _act(live: LiveView, action: Action, also: KeyHandler | None) -> None:
    """Do what a key asks for, after another thing that has the same key."""
    if also is not None:
        also(live)
    live.act(action)


def _shift(live: LiveView, hands: BodyTools, body: str, by: tuple[float, float]) -> None:
    hands.shift(live, body, by)


def _relaunch(live: LiveView, generator: str) -> None:
    live.relaunch(generator)
