"""Inputs of programs that use pyglet, or Arcade on top of it: events of windows and the clock, read from a tape.

pyglet is no dependency: its modules are patched after the program has imported them. The events that the platform
sends to windows, in a step of the event loop or in `Window.dispatch_events`, pass through the tape, and are dispatched
at the end of the step. Events that the program dispatches itself do not: it dispatches them in each run.
"""

import ctypes
import importlib
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from importlib.machinery import ModuleSpec
from time import perf_counter
from types import ModuleType
from typing import Any
from unittest.mock import patch
from weakref import WeakValueDictionary

from sandbox.game_inputs import PYGLET_EVENT, InputValue
from sandbox.rehearsal.input_script import ScriptedDevice
from sandbox.rehearsal.pygame_inputs import LOST, is_value
from sandbox.rehearsal.pyglet_script import ScriptedWindow
from sandbox.rehearsal.tape import EndOfTape, Events, InputTape

TICK = "pyglet.clock.tick"
"""Kind of the readings with which a clock moves on: one for each turn of the event loop"""
CLOCK = "pyglet.clock"
"""Kind of the other readings of clocks, as by `schedule_once`"""
_RESIZE_EVENTS = ("_on_internal_resize", "on_resize")
"""Event by which the platform resizes a window: in pyglet 2.1 the first one, whose handler dispatches the second"""


class _ImportHook:
    """Finder of modules that calls a function after a module has been imported.

    Args:
        functions: by the name of the module.
    """

    def __init__(self, functions: Mapping[str, Callable[[Any], None]]) -> None:
        self._functions = functions

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Return the specification of a module as the other finders know it, with a loader that calls the function."""
        if name not in self._functions:
            return None
        for finder in sys.meta_path:
            spec = None if finder is self else finder.find_spec(name, path, target)
            if spec is not None and spec.loader is not None:
                loader: Any = spec.loader
                loader.exec_module = self._executed_by(loader.exec_module)
                return spec
        return None

    def _executed_by(self, execute: Callable[[ModuleType], None]) -> Callable[[ModuleType], None]:
        def exec_module(module: ModuleType) -> None:
            execute(module)
            self._functions[module.__name__](module)

        return exec_module


@contextmanager
def _after_import(functions: Mapping[str, Callable[[Any], None]]) -> Iterator[None]:
    """Call functions with modules that have been imported, or are imported within a `with` block, by their names."""
    for name, function in functions.items():
        if name in sys.modules:
            function(sys.modules[name])
    hook: Any = _ImportHook(functions)
    sys.meta_path.insert(0, hook)
    try:
        yield
    finally:
        sys.meta_path.remove(hook)


@contextmanager
def pyglet_inputs_from(
    tape: InputTape,
    device: ScriptedDevice | None,
    *,
    open_window: Callable[[], None],
    end_frame: Callable[[], None],
    note: Callable[[str], None],
    draws: bool = True,
) -> Iterator[None]:
    """Let a program read the inputs of pyglet from a tape, within a `with` block.

    Args:
        tape: of the inputs.
        device: from which a tape that records reads; None for the windows of the platform. With a device, windows are
            not shown, the event loop does not wait, and there is no sound.
        open_window: called with each window that the program makes.
        end_frame: called after each frame that the program shows.
        note: called with a remark on what the tape cannot have.
        draws: whether the program draws.
    """
    with ExitStack() as stack:
        patches = _Patches(stack, tape, device, open_window, end_frame, note, draws)
        functions: dict[str, Callable[[Any], None]] = {
            "pyglet": patches.options,
            "pyglet.app": patches.app,
            "pyglet.clock": patches.clock,
            "pyglet.display.base": patches.display,
            "pyglet.input.base": patches.before_input,
            "pyglet.input": patches.input,
            "pyglet.media.drivers": patches.sound,
            "pyglet.window": patches.window,
        }
        stack.enter_context(_after_import(functions))
        yield


def _has_egl() -> bool:
    """Return whether pyglet can draw without a display; where it cannot, its windows are hidden."""
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    return True


class _Patches:
    """Patches of the modules of pyglet.

    Args:
        stack: undoes them.
        tape: see `pyglet_inputs_from`, also for the others.
    """

    def __init__(
        self,
        stack: ExitStack,
        tape: InputTape,
        device: ScriptedDevice | None,
        open_window: Callable[[], None],
        end_frame: Callable[[], None],
        note: Callable[[str], None],
        draws: bool,
    ) -> None:
        self._stack, self._tape, self._device = stack, tape, device
        self._open_window, self._end_frame, self._note, self._draws = open_window, end_frame, note, draws
        self._windows: WeakValueDictionary[int, Any] = WeakValueDictionary()
        self._count = 0
        self._is_collecting = False  # the platform sends events
        self._collected: list[tuple[Any, tuple[Any, ...]]] = []
        self._clock_kind = CLOCK
        self._keyboard: ScriptedWindow | None = None

    def _patch(self, owner: Any, name: str, function: Any, *, create: bool = False) -> None:
        self._stack.enter_context(patch.object(owner, name, function, create=create))

    def options(self, pyglet: Any) -> None:
        """Patch `pyglet`: windows are not shown."""
        if self._device is not None:
            for name, value in (("headless", _has_egl()), ("audio", ("silent",))):
                self._stack.callback(pyglet.options.__setitem__, name, pyglet.options[name])
                pyglet.options[name] = value

    def sound(self, drivers: Any) -> None:
        """Patch `pyglet.media.drivers`: sounds have no thread, which would post events at any time."""
        if self._device is not None:
            self._patch(drivers, "get_audio_driver", _NoSound)

    def before_input(self, _: Any) -> None:
        """Import what `pyglet.input` takes from `pyglet.window` on Linux, where windows that are not shown lack it."""
        if self._device is not None and sys.modules["pyglet"].options["headless"] and sys.platform == "linux":
            importlib.import_module("pyglet.window.xlib")

    def input(self, module: Any) -> None:
        """Patch `pyglet.input`: other devices are noted."""
        for name in ("get_devices", "get_joysticks", "get_controllers", "get_tablets"):
            self._patch(module, name, self._noted(getattr(module, name)))

    def _noted(self, get: Callable[..., list[Any]]) -> Callable[..., list[Any]]:
        def function(*arguments: Any, **more: Any) -> list[Any]:
            found = get(*arguments, **more) if self._device is None else []
            if found:
                self._note("a joystick")
            return found

        return function

    def display(self, base: Any) -> None:
        """Patch `pyglet.display.base`: sizes of screens come from the tape."""
        own = base.Screen.__init__

        def init(screen: Any, display: Any, x: int, y: int, width: int, height: int) -> None:
            size: Any = self._tape.result("pyglet.screen", lambda: [width, height], lambda _: [width, height])
            own(screen, display, x, y, *size)

        self._patch(base.Screen, "__init__", init)

    def clock(self, module: Any) -> None:
        """Patch `pyglet.clock`: readings of clocks come from the tape."""
        device = self._device
        update, call = module.Clock.update_time, module.Clock.call_scheduled_functions

        def read() -> float:
            return self._tape.time(self._clock_kind, perf_counter if device is None else device.now)

        def update_time(clock: Any) -> Any:
            self._clock_kind = TICK
            try:
                return update(clock)
            finally:
                self._clock_kind = CLOCK

        init = module.Clock.__init__
        self._stack.callback(setattr, init, "__defaults__", init.__defaults__)
        init.__defaults__ = (read,)
        self._patch(module._default, "time", read)
        module._default.next_ts = read()
        self._patch(module.Clock, "update_time", update_time)
        # Windows moves and resizes a window in a loop of its own, and calls the functions in it.
        self._patch(module.Clock, "call_scheduled_functions", self._of_program(call))

    def app(self, module: Any) -> None:
        """Patch `pyglet.app`: a step of the event loop takes events from the tape."""
        loop_type = type(module.platform_event_loop)
        wait, post = loop_type.step, self._of_program(loop_type.dispatch_posted_events)
        device = self._device

        def live_step(loop: Any, timeout: float | None = None) -> bool:
            return bool(self._exchange(lambda: wait(loop, timeout)))

        def step(loop: Any, timeout: float | None = None) -> bool:
            assert device is not None
            is_idle = timeout is None and loop._event_queue.empty() and not module.event_loop.has_exit
            post(loop)
            device.sleep(timeout or 0.0)
            is_found = self._exchange(lambda: None)
            if is_idle and not is_found:
                events = self._tape.awaited_events()
                if not events:
                    raise EndOfTape(0)
                self._dispatch(events)
            return is_found

        self._patch(loop_type, "dispatch_posted_events", post)
        self._patch(loop_type, "step", live_step if device is None else step)
        if device is not None:
            self._patch(loop_type, "notify", lambda _: None)

    def _of_program(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return a function in which events are those of the program, and not of the platform."""

        def called(*arguments: Any) -> Any:
            was_collecting, self._is_collecting = self._is_collecting, False
            try:
                return function(*arguments)
            finally:
                self._is_collecting = was_collecting

        return called

    def window(self, module: Any) -> None:
        """Patch `pyglet.window`: its events come from the tape, and `flip` ends a frame."""
        base, window_type = module.BaseWindow, module.Window
        init, dispatch, flip = base.__init__, base.dispatch_event, window_type.flip
        pump, pump_pending = window_type.dispatch_events, window_type.dispatch_pending_events

        def make(window: Any, *arguments: Any, **more: Any) -> None:
            self._windows[self._count] = window
            self._count += 1
            self._open_window()
            init(window, *arguments, **more)
            size: Any = self._tape.result(
                "pyglet.window", lambda: [*window.get_size()], lambda _: [window._width, window._height]
            )
            if self._device is not None:
                window._width, window._height = size
                if not self._draws:
                    gl = importlib.import_module("pyglet.gl")
                    gl.glEnable(gl.GL_RASTERIZER_DISCARD)

        def dispatch_event(window: Any, *event: Any) -> Any:
            if not self._is_collecting:
                return dispatch(window, *event)
            self._collected.append((window, event))
            return None

        def dispatch_pending_events(window: Any) -> None:
            if self._is_collecting:
                self._collect_queue(window)
                pump_pending(window)
            else:
                self._exchange(lambda: dispatch_pending_events(window))
                window._event_queue.clear()

        def dispatch_events(window: Any) -> None:
            def platform() -> None:
                if self._device is None:
                    pump(window)
                else:
                    self._collect_queue(window)

            self._exchange(platform)
            window._event_queue.clear()

        def shown(window: Any) -> None:
            flip(window)
            self._end_frame()

        self._patch(base, "__init__", make)
        self._patch(base, "dispatch_event", dispatch_event)
        self._patch(window_type, "dispatch_events", dispatch_events)
        self._patch(window_type, "dispatch_pending_events", dispatch_pending_events)
        self._patch(window_type, "flip", shown)
        if self._device is not None:
            self._keyboard = ScriptedWindow(module.key)
            if window_type.__module__ == "pyglet.window.headless":
                self._complete(window_type)
            else:
                self._hide(window_type)

    def _collect_queue(self, window: Any) -> None:
        """Take the events that a window has kept since before the event loop."""
        self._collected += [(window, event) for event in window._event_queue]
        window._event_queue.clear()

    def _hide(self, window_type: Any) -> None:
        """Patch windows of the platform: they never appear."""

        def set_visible(window: Any, visible: bool = True) -> None:
            window._visible = visible
            _dispatch_size(window)

        self._patch(window_type, "set_visible", set_visible)
        self._patch(window_type, "activate", lambda _: None)

    def _complete(self, window_type: Any) -> None:
        """Patch windows of EGL, which have no platform: with them a program can do all that it can with a window."""
        set_size = window_type.__mro__[1].set_size

        def resize(window: Any, width: int, height: int) -> None:
            set_size(window, width, height)
            _dispatch_size(window)

        def recreate(window: Any, _: Sequence[str]) -> None:
            _dispatch_size(window)

        clipboard = ""

        def set_clipboard_text(_: Any, text: str) -> None:
            nonlocal clipboard
            clipboard = text

        def do_nothing(*_: Any) -> None:
            """Do nothing: the window is hidden."""

        replaced: dict[str, Any] = {
            "set_size": resize,
            "_recreate": recreate,
            "get_location": lambda _: (0, 0),
            "set_mouse_position": do_nothing,
            "set_mouse_passthrough": do_nothing,
            "get_clipboard_text": lambda _: clipboard,
            "set_clipboard_text": set_clipboard_text,
        }
        for name, function in replaced.items():
            self._patch(window_type, name, function, create=True)

    def _exchange(self, platform: Callable[[], Any]) -> bool:
        """Let the platform send events, and dispatch those of the tape.

        Returns:
            Whether there are any.
        """
        events = self._tape.events(lambda: self._live(platform))
        self._dispatch(events)
        return bool(events)

    def _live(self, platform: Callable[[], Any]) -> Events:
        """Return the events that the platform, or the device, sends to windows."""
        self._is_collecting = True
        try:
            platform()
        finally:
            self._is_collecting = False
        collected, self._collected = self._collected, []
        if self._device is not None and self._keyboard is not None:
            for event in self._device.events():
                collected += self._keyboard.events(event, [each for _, each in sorted(self._windows.items())])
        numbers = {id(window): number for number, window in self._windows.items()}
        found: list[tuple[int, dict[str, InputValue]]] = []
        for window, (name, *arguments) in collected:
            if id(window) not in numbers:
                continue  # made before the tape
            if is_value(arguments):
                found.append((PYGLET_EVENT, {"window": numbers[id(window)], "name": name, "arguments": arguments}))
            else:
                self._note(f"{LOST}: an argument of {name}")
        return found

    def _dispatch(self, events: Events) -> None:
        for _, values in events:
            number, name, arguments = values["window"], values["name"], values["arguments"]
            assert isinstance(number, int)
            assert isinstance(arguments, list)
            window = self._windows.get(number)
            if window is None or window.context is None:
                continue  # closed
            if self._device is not None:
                self._apply(window, str(name), arguments)
            if name in _RESIZE_EVENTS:
                window.switch_to()
            dispatch = sys.modules["pyglet.event"].EventDispatcher.dispatch_event
            # What handlers dispatch is dispatched at once, as in the event loop.
            was_allowed, window._allow_dispatch_event = window._allow_dispatch_event, True
            try:
                dispatch(window, name, *arguments)
            finally:
                window._allow_dispatch_event = was_allowed

    @staticmethod
    def _apply(window: Any, name: str, arguments: list[Any]) -> None:
        """Give a window the attributes that the platform gives it with an event."""
        if name in _RESIZE_EVENTS:
            window._width, window._height = arguments
        elif name.startswith("on_mouse_"):
            window._mouse_x, window._mouse_y = arguments[:2]
            window._mouse_in_window = name != "on_mouse_leave"


def _dispatch_size(window: Any) -> None:
    """Dispatch the size of a window, as the platform does after a change."""
    name = next(name for name in _RESIZE_EVENTS if name in window.event_types)
    window.dispatch_event(name, window._width, window._height)


class _NoSound:
    """Driver, player and listener of sounds that does nothing."""

    def __getattr__(self, name: str) -> Callable[..., "_NoSound"]:
        return lambda *_, **__: self

    def get_time(self) -> float:
        """Return the position in the sound, s."""
        return 0.0
