"""Inputs of programs that use pygame: its events, keys, mouse and clocks, read from a tape.

`pygame.event` gets a queue of its own, in front of that of SDL: events of the device and those that the program posts
are in it in order, and the functions of `pygame.event` take from it as from the queue of SDL.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Protocol
from unittest.mock import patch

import pygame

from sandbox.game_inputs import InputValue
from sandbox.rehearsal.tape import Events, InputTape

KEYS = {name.removeprefix("K_").lower(): value for name, value in vars(pygame).items() if name.startswith("K_")}
"""Keys of pygame by their names"""
SCAN_CODES = 512
"""Scan codes of SDL"""
SCAN_CODE_BIT = 1 << 30
"""Set in the numbers of keys that have no character: the rest is the scan code"""
MILLISECONDS = 1e3
FPS_TICKS = 10
"""Ticks after which pygame computes the frames per second"""
LOST = "an attribute of an event"
"""Note: an attribute of an event is no value that a recording can have"""


class PygameDevice(Protocol):
    """Keyboard, mouse, clock and window of a program, or a substitute for them."""

    def events(self) -> list[pygame.event.Event]:
        """Take all events from the queue."""

    def keys(self) -> list[int]:
        """Return the pressed keys, by the constants of pygame."""

    def modifiers(self) -> int:
        """Return the pressed modifier keys, as `pygame.key.get_mods`."""

    def mouse_position(self) -> tuple[int, int]:
        """Return the position of the mouse, px."""

    def mouse_movement(self) -> tuple[int, int]:
        """Return the movement of the mouse since the last call, px."""

    def mouse_buttons(self) -> tuple[bool, ...]:
        """Return which of five buttons are pressed."""

    def is_focused(self) -> bool:
        """Return whether the window has the keyboard."""

    def ticks(self) -> int:
        """Return the time since `pygame.init`, ms."""

    def wait(self, milliseconds: int) -> int:
        """Wait, and return the time waited, ms."""

    def tick(self, clock: pygame.time.Clock, fps: float) -> int:
        """Wait for the next frame, and return the time since the last call, ms."""

    def set_timer(self, event: Any, milliseconds: int, loops: int) -> None:
        """Post an event again and again, as `pygame.time.set_timer`."""


class LiveDevice:
    """Keyboard, mouse, clock and window of pygame, with its own functions."""

    def __init__(self) -> None:
        self._get, self._pressed, self._mods = pygame.event.get, pygame.key.get_pressed, pygame.key.get_mods
        self._position, self._buttons = pygame.mouse.get_pos, pygame.mouse.get_pressed
        self._movement, self._focused = pygame.mouse.get_rel, pygame.key.get_focused
        self._ticks, self._wait, self._set_timer = pygame.time.get_ticks, pygame.time.wait, pygame.time.set_timer

    def events(self) -> list[pygame.event.Event]:
        """Take all events from the queue of SDL."""
        return self._get()

    def keys(self) -> list[int]:
        """Return the pressed keys, by the constants of pygame."""
        pressed = self._pressed()
        return [key for key in _DISTINCT_KEYS if pressed[key]] if any(pressed) else []

    def modifiers(self) -> int:
        """Return the pressed modifier keys."""
        return self._mods()

    def mouse_position(self) -> tuple[int, int]:
        """Return the position of the mouse, px."""
        return self._position()

    def mouse_movement(self) -> tuple[int, int]:
        """Return the movement of the mouse since the last call, px."""
        return self._movement()

    def mouse_buttons(self) -> tuple[bool, ...]:
        """Return which of five buttons are pressed."""
        return self._buttons(5)

    def is_focused(self) -> bool:
        """Return whether the window has the keyboard."""
        return self._focused()

    def ticks(self) -> int:
        """Return the time since `pygame.init`, ms."""
        return self._ticks()

    def wait(self, milliseconds: int) -> int:
        """Wait, and return the time waited, ms."""
        return self._wait(milliseconds)

    def tick(self, clock: pygame.time.Clock, fps: float) -> int:
        """Wait for the next frame, and return the time since the last call, ms."""
        return clock.tick(fps)

    def set_timer(self, event: Any, milliseconds: int, loops: int) -> None:
        """Post an event again and again."""
        self._set_timer(event, milliseconds, loops)


class PygameEventQueue:
    """Queue of events between a device and a program.

    Args:
        tape: of the inputs.
        device: the source of events that are recorded.
        note: called with a remark for an attribute of an event that a recording cannot have.
    """

    def __init__(self, tape: InputTape, device: PygameDevice, note: Callable[[str], None]) -> None:
        self._tape, self._device, self._note = tape, device, note
        self._queue: list[pygame.event.Event] = []
        self._is_blocked = pygame.event.get_blocked

    def get(self, eventtype: Any = None, pump: bool = True, exclude: Any = None) -> list[pygame.event.Event]:
        """Take events from the queue, as `pygame.event.get`."""
        if pump:
            self.pump()
        if eventtype is None and exclude is None:
            found, self._queue = self._queue, []
            return found
        wanted, unwanted = _types(eventtype), _types(exclude)
        taken = [
            event for event in self._queue if (eventtype is None or event.type in wanted) and event.type not in unwanted
        ]
        self._queue = [event for event in self._queue if not any(event is each for each in taken)]
        return taken

    def poll(self) -> pygame.event.Event:
        """Take one event; of the type NOEVENT if there is none."""
        self.pump()
        return self._queue.pop(0) if self._queue else pygame.event.Event(pygame.NOEVENT)

    def wait(self, timeout: int = 0) -> pygame.event.Event:
        """Take one event, and wait for it, for at most `timeout` ms if that is not 0."""
        waited = 0
        while True:
            self.pump()
            if self._queue:
                return self._queue.pop(0)
            if timeout and waited >= timeout:
                return pygame.event.Event(pygame.NOEVENT)
            if not timeout:
                self._add(self._tape.awaited_events())
            pause: Any = self._tape.result("event.wait", lambda: self._device.wait(1), lambda _: 1)
            waited += max(pause, 1)

    def peek(self, eventtype: Any = None, pump: bool = True) -> Any:
        """Return whether an event of some types is in the queue, or without types the next event."""
        if pump:
            self.pump()
        if eventtype is None:
            return self._queue[0] if self._queue else pygame.event.Event(pygame.NOEVENT)
        return any(event.type in _types(eventtype) for event in self._queue)

    def clear(self, eventtype: Any = None, pump: bool = True) -> None:
        """Remove events from the queue."""
        self.get(eventtype, pump)

    def pump(self) -> None:
        """Let the events of the device into the queue."""
        self._add(self._tape.events(self._live))

    def post(self, event: pygame.event.Event) -> bool:
        """Add an event of the program to the queue; return whether its type is allowed."""
        if self._is_blocked(event.type):
            return False
        self._queue.append(event)
        return True

    def _add(self, events: Events) -> None:
        self._queue += [pygame.event.Event(kind, _tuples(values)) for kind, values in events]

    def _live(self) -> Events:
        return [(event.type, self._values(event)) for event in self._device.events()]

    def _values(self, event: pygame.event.Event) -> dict[str, InputValue]:
        """Return the attributes of an event that a recording can have."""
        values: dict[str, InputValue] = {}
        for name, value in event.__dict__.items():
            if is_value(value):
                values[name] = _list(value)
            elif name != "window":  # an object of the window itself
                self._note(f"{LOST}: {name} of {pygame.event.event_name(event.type)}")
        return values


def is_value(value: Any) -> bool:
    """Return whether a recording can have a value."""
    if isinstance(value, (list, tuple)):
        return all(map(is_value, value))
    return value is None or isinstance(value, (bool, int, float, str))


def _tuples(values: dict[str, InputValue]) -> dict[str, Any]:
    """Return attributes with tuples, as pygame has them, for lists."""
    return {name: _tuple(value) for name, value in values.items()}


def _list(value: Any) -> Any:
    return [*map(_list, value)] if isinstance(value, (list, tuple)) else value


def _tuple(value: Any) -> Any:
    return tuple(map(_tuple, value)) if isinstance(value, (list, tuple)) else value


def _types(value: Any) -> set[int]:
    if value is None:
        return set()
    return {int(each) for each in value} if isinstance(value, Sequence) else {int(value)}


@dataclass(frozen=True)
class PressedKeys:
    """Result of `pygame.key.get_pressed`.

    It knows keys by their constants and not by their places on the keyboard, so that a recording means the same with
    each layout.
    """

    keys: frozenset[int]

    def __getitem__(self, key: int) -> bool:
        """Return whether a key is pressed."""
        return key in self.keys

    def __len__(self) -> int:
        """Return the number of scan codes, as pygame does."""
        return SCAN_CODES

    def __iter__(self) -> Iterator[bool]:
        """Return whether the key of each scan code is pressed, on a keyboard of the United States."""
        codes = {scan_code(key) for key in self.keys}
        return (code in codes for code in range(SCAN_CODES))


def scan_code(key: int) -> int:
    """Return the scan code of a key on a keyboard of the United States; 0 for a character that has no key there."""
    return key & ~SCAN_CODE_BIT if key & SCAN_CODE_BIT else _SCAN_CODES.get(key, 0)


_DISTINCT_KEYS = tuple(dict.fromkeys(KEYS.values()))
_SCAN_CODES = {
    value: getattr(pygame, f"KSCAN_{name.upper()}")
    for name, value in KEYS.items()
    if hasattr(pygame, f"KSCAN_{name.upper()}")
}


class TapedClock:
    """`pygame.time.Clock` whose times are read from a tape."""

    tape: InputTape
    device: PygameDevice
    make: Callable[[], pygame.time.Clock]

    def __init__(self) -> None:
        self._clock = type(self).make()
        self._time, self._fps = 0, 0.0
        self._times: list[int] = []

    def tick(self, framerate: float = 0) -> int:
        """Wait for the next frame, and return the time since the last call, ms."""
        time: Any = self.tape.result("tick", lambda: self.device.tick(self._clock, framerate), _in_milliseconds)
        self._time = time
        self._times.append(self._time)
        if len(self._times) == FPS_TICKS:
            self._fps = FPS_TICKS * MILLISECONDS / max(sum(self._times), 1)
            self._times.clear()
        return self._time

    tick_busy_loop = tick

    def get_time(self) -> int:
        """Return the time between the last two ticks, ms."""
        return self._time

    def get_rawtime(self) -> int:
        """Return the time between the last two ticks, ms, of which none is known to be idle."""
        return self._time

    def get_fps(self) -> float:
        """Return the frames per second, computed every ten ticks as in pygame; 0 before them."""
        return self._fps


def _in_milliseconds(seconds: float) -> int:
    return round(MILLISECONDS * seconds)


def _sounds(tape: InputTape) -> Iterator[tuple[Any, str, Any]]:
    """Yield the functions by which a program asks whether sounds still play, with those that read a tape."""

    def taped(kind: str, live: Callable[[], InputValue]) -> Callable[[], InputValue]:
        return lambda: tape.state(kind, live)

    for name in ("mixer", "mixer_music"):
        module = sys.modules.get(f"pygame.{name}")  # absent where pygame has been built without sound
        for function in ("get_busy", "get_pos"):
            if hasattr(module, function):
                yield module, function, taped(f"{name}.{function}", getattr(module, function))


@contextmanager
def pygame_inputs_from(
    tape: InputTape, device: PygameDevice, *, end_frame: Callable[[], None], note: Callable[[str], None]
) -> Iterator[None]:
    """Let a program read the inputs of pygame from a tape, within a `with` block.

    Args:
        tape: of the inputs.
        device: from which a tape that records reads.
        end_frame: called after each frame that the program shows.
        note: called with a remark on what the tape cannot have.
    """
    queue = PygameEventQueue(tape, device, note)
    flip, update = pygame.display.flip, pygame.display.update
    joystick = pygame.joystick.Joystick

    def shown_by(show: Callable[..., None]) -> Callable[..., None]:
        def function(*arguments: Any, **more: Any) -> None:
            show(*arguments, **more)
            end_frame()

        return function

    def get_pressed() -> PressedKeys:
        keys: Any = tape.state("keys", device.keys)
        return PressedKeys(frozenset(keys))

    def mouse_buttons(num_buttons: int = 3) -> tuple[bool, ...]:
        buttons: Any = tape.state("mouse_buttons", lambda: list(device.mouse_buttons()))
        return tuple(buttons[:num_buttons])

    def mouse_movement() -> Any:
        return _tuple(tape.result("mouse_movement", lambda: list(device.mouse_movement()), lambda _: [0, 0]))

    def wait(milliseconds: int) -> Any:
        return tape.result("wait", lambda: device.wait(milliseconds), lambda _: milliseconds)

    def joystick_noted(*arguments: Any) -> Any:
        note("a joystick")
        return joystick(*arguments)

    clock = type("Clock", (TapedClock,), {"tape": tape, "device": device, "make": staticmethod(pygame.time.Clock)})

    def ticks() -> int:
        return int(tape.time("pygame.time.get_ticks", device.ticks, MILLISECONDS))

    replaced: list[tuple[Any, str, Any]] = [
        *(
            (pygame.event, name, getattr(queue, name))
            for name in ("get", "poll", "wait", "peek", "clear", "pump", "post")
        ),
        (pygame.key, "get_pressed", get_pressed),
        (pygame.key, "get_mods", lambda: tape.state("modifiers", device.modifiers)),
        (pygame.key, "get_focused", lambda: tape.state("focus", device.is_focused)),
        (pygame.mouse, "get_pos", lambda: _tuple(tape.state("mouse", lambda: list(device.mouse_position())))),
        (pygame.mouse, "get_pressed", mouse_buttons),
        (pygame.mouse, "get_rel", mouse_movement),
        (pygame.time, "Clock", clock),
        (pygame.time, "get_ticks", ticks),
        (pygame.time, "wait", wait),
        (pygame.time, "delay", wait),
        (pygame.time, "set_timer", lambda event, millis, loops=0: device.set_timer(event, millis, loops)),
        (pygame.display, "flip", shown_by(flip)),
        (pygame.display, "update", shown_by(update)),
        (pygame.joystick, "Joystick", joystick_noted),
        *_sounds(tape),
    ]
    with ExitStack() as stack:
        for owner, name, function in replaced:
            stack.enter_context(patch.object(owner, name, function))
        yield
