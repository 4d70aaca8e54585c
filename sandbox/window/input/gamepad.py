"""Gamepads: button and axis layouts by device name, and the routing of their input to the controls of a game.

The layouts are those of "Common Controller Axis Mappings" in the documentation of pygame.joystick, for pygame 2.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import pygame

from sandbox.action import ActionError
from sandbox.games.contract import Control
from sandbox.window.game_host import GameHost

DEAD_ZONE = 0.2
"""Fraction of a stick's deflection that counts as zero, as few sticks rest exactly at the centre."""
ANALOGUE_LEVELS = 16
"""Analogue values are quantised to 1/16, as a stick sends hundreds of events per second and each change is an action.
"""
BUTTON_THRESHOLD = 0.5
"""deflection of a stick or trigger above which it counts as a pressed button"""


class GamepadLayout(NamedTuple):
    """Names of buttons and axes by index, as in `Control.pad`."""

    buttons: dict[int, str]
    triggers: dict[int, str]
    """axes that rest at −1"""
    sticks: dict[int, str]
    """axes that rest at 0; `leftx` is negative to the left, `lefty` negative upwards"""
    start: int


XBOX = GamepadLayout(
    {0: "a", 1: "b", 2: "x", 3: "y", 4: "lb", 5: "rb"},
    {2: "lt", 5: "rt"},
    {0: "leftx", 1: "lefty", 3: "rightx", 4: "righty"},
    7,
)
"""Also the default layout; its D-pad is a hat."""
PLAYSTATION = GamepadLayout(
    {0: "a", 1: "b", 2: "x", 3: "y", 9: "lb", 10: "rb", 11: "up", 12: "down", 13: "left", 14: "right"},
    {4: "lt", 5: "rt"},
    {0: "leftx", 1: "lefty", 2: "rightx", 3: "righty"},
    6,
)
LAYOUTS = {"ps4": PLAYSTATION, "ps5": PLAYSTATION, "dualshock": PLAYSTATION, "dualsense": PLAYSTATION}
LAYOUTS |= {"sony": PLAYSTATION, "playstation": PLAYSTATION, "nintendo switch pro": PLAYSTATION}
"""Layouts by a substring of the device name. The Switch controller differs only in its button labels."""


class GamepadDevice(Protocol):
    """Subset of `pygame.joystick.Joystick` that is used."""

    def get_name(self) -> str:
        """Return the name of the model."""

    def get_instance_id(self) -> int:
        """Return the id of the device in events."""


def layout_of(name: str) -> GamepadLayout:
    """Return the layout of a gamepad by its device name."""
    return next((layout for part, layout in LAYOUTS.items() if part in name.lower()), XBOX)


class Gamepads:
    """All connected gamepads."""

    def __init__(
        self, notify: Callable[[str], object], open_device: Callable[[int], GamepadDevice] = pygame.joystick.Joystick
    ) -> None:
        """Create the registry; `start` looks for devices.

        Args:
            notify: shows a message when a gamepad is connected or disconnected.
            open_device: opens a device by its index.
        """
        self._notify, self._open_device = notify, open_device
        self._devices: dict[int, tuple[GamepadDevice, GamepadLayout]] = {}

    @property
    def is_connected(self) -> bool:
        """Whether any gamepad is connected."""
        return bool(self._devices)

    def start(self) -> None:
        """Start to receive events, including those of connected devices; without joystick support, show a message."""
        try:
            pygame.joystick.init()
        except (pygame.error, NotImplementedError) as error:
            self._notify(f"no gamepads: {error}")

    def handle_event(
        self, event: pygame.event.Event, host: GameHost | None, pause: Callable[[], object]
    ) -> list[ActionError]:
        """Process an event; return the errors of refused actions.

        Args:
            event: any event.
            host: host of the running game.
            pause: called for the Start button.
        """
        if event.type == pygame.JOYDEVICEADDED:
            self._connect(event.device_index)
        elif event.type == pygame.JOYDEVICEREMOVED:
            return self._disconnect(event.instance_id, host)
        known = self._devices.get(getattr(event, "instance_id", -1))
        if known is None:
            return []
        device, layout = known[0].get_instance_id(), known[1]
        if event.type == pygame.JOYBUTTONDOWN and event.button == layout.start:
            pause()
        return [] if host is None else _hold_controls(host, device, _words(event, layout))

    def _connect(self, index: int) -> None:
        try:
            device = self._open_device(index)
            number, name = device.get_instance_id(), device.get_name()
        except pygame.error:  # already disconnected
            return
        if number not in self._devices:
            self._devices[number] = device, layout_of(name)
            self._notify(f"gamepad connected: {name}")

    def _disconnect(self, number: int, host: GameHost | None) -> list[ActionError]:
        gone = self._devices.pop(number, None)
        if gone is None:
            return []
        self._notify(f"gamepad disconnected: {gone[0].get_name()}")
        if host is None:
            return []
        words = {word for control in host.controls for word in (control.pad or "").split()}
        return _hold_controls(host, number, dict.fromkeys(words, 0.0))


def _words(event: pygame.event.Event, layout: GamepadLayout) -> dict[str, float]:
    """Return the values, 0 to 1, of the buttons and axes that an event changes, by name."""
    if event.type in (pygame.JOYBUTTONDOWN, pygame.JOYBUTTONUP):
        word = layout.buttons.get(event.button)
        return {} if word is None else {word: float(event.type == pygame.JOYBUTTONDOWN)}
    if event.type == pygame.JOYAXISMOTION:
        if event.axis in layout.triggers:
            return {layout.triggers[event.axis]: _quantise(0.5 * (event.value + 1.0))}
        stick = layout.sticks.get(event.axis)
        deflection = 0.0 if stick is None else (abs(event.value) - DEAD_ZONE) / (1.0 - DEAD_ZONE)
        return (
            {}
            if stick is None
            else {
                f"{sign}{stick}": _quantise(deflection if (event.value > 0.0) == (sign == "+") else 0.0)
                for sign in "+-"
            }
        )
    if event.type == pygame.JOYHATMOTION:
        x, y = event.value
        return {"left": float(x < 0), "right": float(x > 0), "down": float(y < 0), "up": float(y > 0)}
    return {}


def _quantise(value: float) -> float:
    return round(min(max(value, 0.0), 1.0) * ANALOGUE_LEVELS) / ANALOGUE_LEVELS


def _hold_controls(host: GameHost, device: int, words: dict[str, float]) -> list[ActionError]:
    """Apply values to the controls of a game; return the errors of refused actions."""
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
    return value if control.analogue else float(value > BUTTON_THRESHOLD)
