"""Key bindings of a scene: arrow keys and Space of `[play]`, keys of thrusters, drives and tyres, controls of a game.

They are computed once per session. A key bound by the scene loses its window command.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.action import Action, Drive, Steer, Throttle
from sandbox.games.contract import Control
from sandbox.scene.compile.drives import names_of
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.scene import default_name
from sandbox.window.game_controls import GameControls
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
"""Names of keys without a character; any other key is named by its character."""

PAD_DIRECTIONS = ("left", "right", "up", "down")
"""names of the D-pad directions of a gamepad"""

KeyHandler = Callable[[], object]
"""Callback for the press or release of a key; it may raise `ActionError`, and its result is ignored."""


class KeyNameError(ValueError):
    """A control names an unknown key, or one that is reserved for the window."""


def codes_of(name: str) -> tuple[int, ...]:
    """Return the pygame codes of a key by its name.

    Raises:
        KeyNameError: the name is unknown, or the key is reserved for the window.
    """
    codes = NAMED.get(name) or ((ord(name),) if len(name) == 1 and name.isprintable() and name == name.lower() else ())
    if not codes or GLOBAL & set(codes):
        raise KeyNameError(f"key {name!r} cannot be assigned; use {', '.join(NAMED)}, or a letter, digit or sign")
    return codes


def control_handlers(host: GameHost) -> tuple[dict[int, KeyHandler], dict[int, KeyHandler]]:
    """Return the handlers of presses and of releases of a game's keys, by key code."""
    pressed: dict[int, KeyHandler] = {}
    released: dict[int, KeyHandler] = {}
    for control in host.controls:
        for code in (code for key in control.keys for code in codes_of(key)):
            pressed[code] = partial(host.hold, code, control.name, 1.0)
            released[code] = partial(host.hold, code, control.name, 0.0)
    return pressed, released


def control_help(controls: tuple[Control, ...]) -> tuple[tuple[str, str], ...]:
    """Return (keys, action) rows of a game's controls for the help page; controls without a key are left out."""
    return tuple(
        (" or ".join(" ".join(word.capitalize() for word in key.split()) for key in control.keys), control.about)
        for control in controls
        if control.keys
    )


def gamepad_help(controls: tuple[Control, ...]) -> tuple[tuple[str, str], ...]:
    """Return (buttons, action) rows of a game's controls on a gamepad; empty if the game does not use gamepads."""
    rows = tuple((_buttons(control.pad), control.about) for control in controls if control.pad)
    return (*rows, ("start", "pause / resume")) if rows else ()


def _buttons(pad: str) -> str:
    sticks = {"x": ("left", "right"), "y": ("up", "down")}
    words = []
    for word in pad.split():
        if word[0] in "+-":
            which = "right stick" if word[1:-1] == "right" else "stick"
            words.append(f"{which} {sticks[word[-1]][word[0] == '+']}")
        else:
            words.append(f"D-pad {word}" if word in PAD_DIRECTIONS else word.upper() if len(word) <= 2 else word)
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
"""Keys of thrusters and drives by their names in scene files."""


class KeyBindings(NamedTuple):
    """Handlers of the keys that a scene or its game binds."""

    pressed: dict[int, KeyHandler]
    """by key code"""
    help_rows: tuple[tuple[str, str], ...]
    """(keys, action) for the help page"""
    released: dict[int, KeyHandler]
    """by key code"""
    repeated: frozenset[int] = frozenset()
    """codes of the keys whose handlers also run on key repeat: arrow keys that move a body by steps"""
    gamepad_rows: tuple[tuple[str, str], ...] = ()
    """(buttons, action) for the help page, shown while a gamepad is connected"""


NO_BINDINGS = KeyBindings({}, (), {})


def key_bindings(
    live: LiveView, tools: BodyTools, host: GameHost | None = None, controls: GameControls | None = None
) -> KeyBindings:
    """Return the key bindings of a session: those of its scene, and of the rules or the controls of its game."""
    scene = live.scene
    pressed: dict[int, KeyHandler] = {}
    released: dict[int, KeyHandler] = {}
    rows: list[tuple[str, str]] = []
    body, step, generator = scene.play.arrows, scene.play.arrow_step, scene.play.relaunch
    if body is not None:
        for key, (x, y) in ARROWS.items():
            pressed[key] = partial(tools.shift, live, body, (x * step, y * step))
        rows.append(("Arrows", f"move {body} by {step:g} m"))
    if generator is not None:
        pressed[pygame.K_SPACE] = partial(live.relaunch, generator)
        rows.append(("Space", f"relaunch {generator}"))
    control_pressed, control_released = ({}, {}) if host is None or controls is not None else control_handlers(host)
    for name, verb, on_press, on_release in thrust_and_drive_keys(scene):
        key = KEYS[name]
        if key in control_pressed:  # handled by the rules of the game
            continue
        pressed[key] = partial(_apply, live, on_press, pressed.get(key))
        released[key] = partial(_apply, live, on_release, released.get(key))
        rows.append((name.capitalize(), verb))
    bodies = sorted({tyre.body for tyre in scene.tyres if tyre.keys})
    if bodies and host is None:
        own_pressed, own_released = tyre_keys(live, pressed, released)
        pressed |= own_pressed
        released |= own_released
        rows += [("Arrows", f"drive and steer {', '.join(bodies)}"), ("Space", f"brake {', '.join(bodies)}")]
    if controls is not None:
        own = controls.bindings()
        pressed |= own.pressed
        released |= own.released
        rows += own.help_rows
    elif host is not None:
        pressed |= control_pressed
        released |= control_released
        rows += control_help(host.controls)
    pad_rows = () if host is None else gamepad_help(host.controls)
    return KeyBindings(pressed, tuple(rows), released, frozenset(ARROWS) - released.keys(), pad_rows)


def thrust_and_drive_keys(scene: Scene) -> Iterator[tuple[str, str, Action, Action]]:
    """Yield (key name, help text, action of a press, action of a release) for thrusters and drives."""
    for k, thrust in enumerate(scene.thrusts):
        if thrust.key is not None:
            name = thrust.name or default_name("thrust", k)
            opened, closed = (Throttle(time=0.0, thrust=name, level=level) for level in (1.0, 0.0))
            yield thrust.key, f"fire {name}", opened, closed
    for drive, name in zip(scene.drives, names_of(scene), strict=True):
        if drive.key is not None:
            on, off = (Drive(time=0.0, drive=name, level=level) for level in (1.0, 0.0))
            yield drive.key, f"drive {name}", on, off


TYRE_KEYS = {
    "up": (1.0, 0.0, 0.0),
    "down": (-1.0, 0.0, 0.0),
    "left": (0.0, 0.0, 1.0),
    "right": (0.0, 0.0, -1.0),
    "space": (0.0, 1.0, 0.0),
}
"""Keys of tyres: what each adds to the throttle, brake and steering while it is held"""


def tyre_keys(
    live: LiveView, pressed: Mapping[int, KeyHandler], released: Mapping[int, KeyHandler]
) -> tuple[dict[int, KeyHandler], dict[int, KeyHandler]]:
    """Return the handlers of presses and of releases of the keys that control tyres.

    Args:
        live: the view.
        pressed: other handlers of keys, which run first.
        released: likewise.
    """
    names = [tyre.name or default_name("tyre", k) for k, tyre in enumerate(live.scene.tyres) if tyre.keys]
    held: set[str] = set()

    def change(key: str, is_held: bool, first: KeyHandler | None) -> None:
        if first is not None:
            first()
        (held.add if is_held else held.discard)(key)
        throttle, brake, steer = np.sum([(0.0, 0.0, 0.0), *(TYRE_KEYS[each] for each in held)], axis=0).tolist()
        for name in names:
            live.apply(Steer(time=0.0, tyre=name, throttle=throttle, brake=brake, steer=steer))

    on_press = {KEYS[key]: partial(change, key, True, pressed.get(KEYS[key])) for key in TYRE_KEYS}
    on_release = {KEYS[key]: partial(change, key, False, released.get(KEYS[key])) for key in TYRE_KEYS}
    return dict(on_press), dict(on_release)


def _apply(live: LiveView, action: Action, first: KeyHandler | None) -> None:
    """Apply an action, after `first`, the action of another thruster or drive with the same key."""
    if first is not None:
        first()
    live.apply(action)
