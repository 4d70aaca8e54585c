"""Scripts of inputs: a file with keys and mouse by frame, which plays a game without a window on a virtual clock."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import pygame
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from sandbox.rehearsal.pygame_inputs import KEYS, scan_code
from sandbox.rehearsal.tape import TICK
from sandbox.scene.errors import Fault, SceneError

MOUSE_BUTTONS = {f"mouse {number}": number for number in range(1, 6)}
MAX_FRAMES = 1_000_000


class InputChange(BaseModel):
    """What happens to keys and mouse in one frame."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    frame: Annotated[int, Field(ge=0)]
    """number of the frame, from 0"""
    press: str | None = None
    """key by its name in pygame, such as `space`, or `mouse 1` to `mouse 5`"""
    release: str | None = None
    """likewise"""
    mouse: tuple[int, int] | None = None
    """position to which the mouse moves, px, as the program reads it: y points down in pygame, and up in pyglet"""

    @model_validator(mode="after")
    def _check(self) -> Self:
        given = [name for name in ("press", "release", "mouse") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError("needs one of `press`, `release` and `mouse`")
        for key in (self.press, self.release):
            if key is not None and key not in MOUSE_BUTTONS:
                _key_code(key)
        return self


class InputScript(BaseModel):
    """Script of inputs."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    frames: Annotated[int, Field(ge=1, le=MAX_FRAMES)]
    """frames after which the window is closed"""
    fps: Annotated[float, Field(gt=0.0, le=1000.0)] = 60.0
    """frames per second of the virtual clock"""
    seed: Annotated[int, Field(ge=0)] = 0
    """seed of `random` and `numpy.random`"""
    input: tuple[InputChange, ...] = ()
    """in any order"""


def load_script(path: str | Path) -> InputScript:
    """Read a script of inputs.

    Args:
        path: of the TOML file.

    Raises:
        SceneError: it cannot be read, or has faults.
    """
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or error
        raise SceneError([Fault.of(str(path), f"cannot be read: {reason}")]) from None
    try:
        return TypeAdapter(InputScript).validate_python(document)
    except ValidationError as error:
        faults = []
        for each in error.errors():
            where = ".".join(str(part) for part in each["loc"])
            faults.append(Fault(str(path), None, where, each["msg"].removeprefix("Value error, ")))
        raise SceneError(faults) from None


def _key_code(name: str) -> int:
    """Return the key of a name.

    Raises:
        ValueError: pygame has no such key.
    """
    if name.lower() not in KEYS:
        raise ValueError(f"{name!r} is no key of pygame; keys are named as in pygame.K_space: `space`, `a`, `left`")
    key: int = KEYS[name.lower()]
    return key


@dataclass
class _Timer:
    event: pygame.event.Event
    period: float
    """s"""
    due: float
    """s"""
    loops: int
    """times that are left; 0 without a limit"""


class ScriptedDevice:
    """Keyboard, mouse, clock and window that follow a script.

    Args:
        script: of the inputs.
    """

    def __init__(self, script: InputScript) -> None:
        self._script = script
        self._frame = 0
        self.time = 0.0
        """time since the start, s"""
        self._last_tick = 0
        self._pending: list[pygame.event.Event] = []
        self._keys: list[int] = []
        self._position = self._last_position = (0, 0)
        self._buttons = [False] * len(MOUSE_BUTTONS)
        self._timers: dict[int, _Timer] = {}
        self._inputs: dict[int, list[InputChange]] = {}
        for each in script.input:
            self._inputs.setdefault(each.frame, []).append(each)
        self._start_frame()

    @property
    def frames_since_close(self) -> int:
        """Frames since the script has closed the window; negative before."""
        return self._frame - self._script.frames

    def now(self) -> float:
        """Return the time since the start, s; each reading takes a little of it."""
        self.time += TICK
        return self.time

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self.time += max(seconds, 0.0)

    def end_frame(self) -> None:
        """End the frame: the clock is at least at the start of the next one."""
        self._frame += 1
        self.time = max(self.time, self._frame / self._script.fps)
        self._start_frame()

    def _start_frame(self) -> None:
        for each in self._inputs.get(self._frame, ()):
            self._happen(each)
        if self._frame >= self._script.frames:
            self._pending.append(pygame.event.Event(pygame.QUIT))

    def _happen(self, each: InputChange) -> None:
        if each.mouse is not None:
            moved = (each.mouse[0] - self._position[0], each.mouse[1] - self._position[1])
            self._position = each.mouse
            buttons = tuple(map(int, self._buttons[:3]))
            self._add(pygame.MOUSEMOTION, pos=each.mouse, rel=moved, buttons=buttons, touch=False)
            return
        name = each.press if each.press is not None else each.release
        is_pressed = each.press is not None
        assert name is not None
        if name in MOUSE_BUTTONS:
            self._buttons[MOUSE_BUTTONS[name] - 1] = is_pressed
            kind = pygame.MOUSEBUTTONDOWN if is_pressed else pygame.MOUSEBUTTONUP
            self._add(kind, pos=self._position, button=MOUSE_BUTTONS[name], touch=False)
            return
        key = _key_code(name)
        if is_pressed:
            self._keys.append(key)
            self._add(pygame.KEYDOWN, key=key, mod=0, unicode=name if len(name) == 1 else "", scancode=scan_code(key))
        else:
            self._keys = [each for each in self._keys if each != key]
            self._add(pygame.KEYUP, key=key, mod=0, unicode="", scancode=scan_code(key))

    def _add(self, kind: int, **values: Any) -> None:
        self._pending.append(pygame.event.Event(kind, values))

    def events(self) -> list[pygame.event.Event]:
        """Take the events of the script up to the present frame, and those of timers."""
        for timer in list(self._timers.values()):
            while timer.due <= self.time and timer.event.type in self._timers:
                self._pending.append(timer.event)
                timer.due += timer.period
                timer.loops -= 1
                if timer.loops == 0:
                    del self._timers[timer.event.type]
        found, self._pending = self._pending, []
        return found

    def keys(self) -> list[int]:
        """Return the pressed keys, by the constants of pygame."""
        return sorted(self._keys)

    def modifiers(self) -> int:
        """Return the pressed modifier keys."""
        return sum(bit for key, bit in _MODIFIERS.items() if key in self._keys)

    def mouse_position(self) -> tuple[int, int]:
        """Return the position of the mouse, px."""
        return self._position

    def mouse_movement(self) -> tuple[int, int]:
        """Return the movement of the mouse since the last call, px."""
        (x, y), (x0, y0), self._last_position = self._position, self._last_position, self._position
        return x - x0, y - y0

    def mouse_buttons(self) -> tuple[bool, ...]:
        """Return which of five buttons are pressed."""
        return tuple(self._buttons)

    def is_focused(self) -> bool:
        """Return whether the window has the keyboard."""
        return True

    def ticks(self) -> int:
        """Return the time since the start, ms."""
        return int(1e3 * self.now())

    def wait(self, milliseconds: int) -> int:
        """Let time pass, and return it, ms."""
        self.sleep(1e-3 * milliseconds)
        return milliseconds

    def tick(self, clock: pygame.time.Clock, fps: float) -> int:  # noqa: ARG002
        """Return the time since the last call, ms."""
        now = int(1e3 * self.time)
        elapsed, self._last_tick = now - self._last_tick, now
        return elapsed

    def set_timer(self, event: Any, milliseconds: int, loops: int) -> None:
        """Post an event again and again; with 0 ms no more."""
        made = event if isinstance(event, pygame.event.EventType) else pygame.event.Event(int(event))
        self._timers.pop(made.type, None)
        if milliseconds > 0:
            period = 1e-3 * milliseconds
            self._timers[made.type] = _Timer(made, period, self.time + period, loops)


_MODIFIERS: Mapping[int, int] = {
    pygame.K_LSHIFT: pygame.KMOD_LSHIFT,
    pygame.K_RSHIFT: pygame.KMOD_RSHIFT,
    pygame.K_LCTRL: pygame.KMOD_LCTRL,
    pygame.K_RCTRL: pygame.KMOD_RCTRL,
    pygame.K_LALT: pygame.KMOD_LALT,
    pygame.K_RALT: pygame.KMOD_RALT,
}
