"""Gamepads: what they are called by, which button or axis is which, and what they hold of a game's controls.

Layouts: the tables of "Common Controller Axis Mappings" in the documentation of pygame.joystick, for pygame 2.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import pygame

from sandbox.action import ActionError
from sandbox.games.contract import Control
from sandbox.window.game_host import GameHost

DEAD_ZONE = 0.2
"""Share of a stick's way that counts as none: few rest in their middle."""
RUNGS = 16
"""Values of an analogue control are whole shares of this: a stick sends hundreds of motions a second."""
HALF = 0.5
"""From where on a stick or trigger is a button."""


class GamepadLayout(NamedTuple):
    """Which number of what is which button, by the words of `Control.pad`."""

    buttons: dict[int, str]
    triggers: dict[int, str]
    """axes that rest at −1"""
    sticks: dict[int, str]
    """axes that rest at 0: `leftx` is − to the left, `lefty` − upwards"""
    start: int


XBOX = GamepadLayout(
    {0: "a", 1: "b", 2: "x", 3: "y", 4: "lb", 5: "rb"},
    {2: "lt", 5: "rt"},
    {0: "leftx", 1: "lefty", 3: "rightx", 4: "righty"},
    7,
)
"""Also of whatever is not known better; its cross is a hat."""
PLAYSTATION = GamepadLayout(
    {0: "a", 1: "b", 2: "x", 3: "y", 9: "lb", 10: "rb", 11: "up", 12: "down", 13: "left", 14: "right"},
    {4: "lt", 5: "rt"},
    {0: "leftx", 1: "lefty", 2: "rightx", 3: "righty"},
    6,
)
LAYOUTS = {"ps4": PLAYSTATION, "ps5": PLAYSTATION, "dualshock": PLAYSTATION, "dualsense": PLAYSTATION}
LAYOUTS |= {"sony": PLAYSTATION, "playstation": PLAYSTATION, "nintendo switch pro": PLAYSTATION}
"""By what the name of a gamepad has in it. That of the Switch differs only in what is written on its buttons."""


class GamepadDevice(Protocol):
    """What is needed of a `pygame.joystick.Joystick`."""

    def get_name(self) -> str:
        """What it is called."""

    def get_instance_id(self) -> int:
        """What its events call it."""


def layout_of(name: str) -> GamepadLayout:
    """Return the layout of a gamepad by its name."""
    return next((layout for part, layout in LAYOUTS.items() if part in name.lower()), XBOX)


class Gamepads:
    """All gamepads that are plugged in."""

    def __init__(
        self, tell: Callable[[str], object], plug: Callable[[int], GamepadDevice] = pygame.joystick.Joystick
    ) -> None:
        """Look for none yet.

        Args:
            tell: told of what comes and goes.
            plug: opens the n-th.
        """
        self._tell, self._plug = tell, plug
        self._devices: dict[int, tuple[GamepadDevice, GamepadLayout]] = {}

    def begin(self) -> None:
        """Begin to listen; those that are there already are told of as new. Without any support there are none."""
        try:
            pygame.joystick.init()
        except (pygame.error, NotImplementedError) as error:
            self._tell(f"no gamepads: {error}")

    def take(self, event: pygame.event.Event, host: GameHost | None, pause: Callable[[], object]) -> list[ActionError]:
        """Take an event in, and return what could not be done of it.

        Args:
            event: any.
            host: of the game that is on.
            pause: what Start does.
        """
        if event.type == pygame.JOYDEVICEADDED:
            self._come(event.device_index)
        elif event.type == pygame.JOYDEVICEREMOVED:
            return self._go(event.instance_id, host)
        known = self._devices.get(getattr(event, "instance_id", -1))
        if known is None:
            return []
        device, layout = known[0].get_instance_id(), known[1]
        if event.type == pygame.JOYBUTTONDOWN and event.button == layout.start:
            pause()
        return [] if host is None else _held(host, device, _words(event, layout))

    def _come(self, index: int) -> None:
        try:
            device = self._plug(index)
            number, name = device.get_instance_id(), device.get_name()
        except pygame.error:  # it is gone again
            return
        if number not in self._devices:
            self._devices[number] = device, layout_of(name)
            self._tell(f"gamepad connected: {name}")

    def _go(self, number: int, host: GameHost | None) -> list[ActionError]:
        gone = self._devices.pop(number, None)
        if gone is None:
            return []
        self._tell(f"gamepad disconnected: {gone[0].get_name()}")
        if host is None:
            return []
        words = {word for control in host.controls for word in (control.pad or "").split()}
        return _held(host, number, dict.fromkeys(words, 0.0))


def _words(event: pygame.event.Event, layout: GamepadLayout) -> dict[str, float]:
    """Return what an event says of which words, 0 to 1."""
    if event.type in (pygame.JOYBUTTONDOWN, pygame.JOYBUTTONUP):
        word = layout.buttons.get(event.button)
        return {} if word is None else {word: float(event.type == pygame.JOYBUTTONDOWN)}
    if event.type == pygame.JOYAXISMOTION:
        if event.axis in layout.triggers:
            return {layout.triggers[event.axis]: _shared(0.5 * (event.value + 1.0))}
        stick = layout.sticks.get(event.axis)
        way = 0.0 if stick is None else (abs(event.value) - DEAD_ZONE) / (1.0 - DEAD_ZONE)
        return (
            {}
            if stick is None
            else {f"{sign}{stick}": _shared(way if (event.value > 0.0) == (sign == "+") else 0.0) for sign in "+-"}
        )
    if event.type == pygame.JOYHATMOTION:
        x, y = event.value
        return {"left": float(x < 0), "right": float(x > 0), "down": float(y < 0), "up": float(y > 0)}
    return {}


def _shared(value: float) -> float:
    return round(min(max(value, 0.0), 1.0) * RUNGS) / RUNGS


def _held(host: GameHost, device: int, words: dict[str, float]) -> list[ActionError]:
    """Let a game know of what is held."""
    failed = []
    for control in host.controls:
        for word in (control.pad or "").split():
            if word in words:
                try:
                    host.hold((device, word), control.name, _level(control, words[word]))
                except ActionError as error:
                    failed.append(error)
    return failed


def _level(control: Control, value: float) -> float:
    return value if control.analogue else float(value > HALF)
