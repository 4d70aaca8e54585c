"""Window: the loop that turns events into deeds, and what is on into pictures.

One turn is: wait, take the events in, let time pass, draw, show. What a hand does is so seen in the very next
picture.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import pygame

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.games.billiards.view.controls import KeyHandler
from sandbox.window.app_state import AppState
from sandbox.window.commands import Commands
from sandbox.window.context import TITLE, WindowContext
from sandbox.window.display import close_screen, open_screen, ui_scale
from sandbox.window.input.gamepad import Gamepads
from sandbox.window.input.keymap import Command, Keyboard
from sandbox.window.mouse import MouseController
from sandbox.window.worker import Wait, Worker, compute_here

RATE = 60
"""pictures a second, at most"""
WAIT_RATE = 20
"""pictures a second while something compiles"""

MODIFIERS = frozenset(
    {
        pygame.K_LCTRL,
        pygame.K_RCTRL,
        pygame.K_LSHIFT,
        pygame.K_RSHIFT,
        pygame.K_LALT,
        pygame.K_RALT,
        pygame.K_LMETA,
        pygame.K_RMETA,
    }
)
"""Keys that ask for nothing by themselves."""

PRESSES = frozenset(
    {
        pygame.KEYDOWN,
        pygame.TEXTINPUT,
        pygame.MOUSEBUTTONDOWN,
        pygame.MOUSEWHEEL,
        pygame.JOYBUTTONDOWN,
        pygame.JOYHATMOTION,
    }
)
"""Input events that are discarded after a compile."""


class App(WindowContext):
    """The window. It owns the display from `open` to `close`."""

    def __init__(
        self,
        stage: AppState,
        *,
        size: tuple[int, int] | None = None,
        folder: Path | None = None,
        film: str = ".gif",
        say: Callable[[str], None] = print,
    ) -> None:
        """Open the window.

        Args:
            stage: what is played.
            size: px; by default what suits the desktop.
            folder: where screenshots, films and sessions go; by default the working folder.
            film: what Ctrl+R records, `.gif` or `.mp4`.
            say: who prints a line on the terminal.

        Raises:
            NoDisplayError: there is no display.
        """
        super().__init__(open_screen(size, TITLE), ui_scale(), stage, folder or Path(), film, say)
        self._keyboard = Keyboard()
        self._held: dict[int, KeyHandler] = {}  # claimed keys that are down, and what is done when they are let go
        self._gamepads = Gamepads(self.tell)
        self._gamepads.begin()
        self.mouse = MouseController(self)
        self.commands = Commands(self, self.mouse)
        self._clock = pygame.time.Clock()
        stage.on_new = self.renew
        self._worker = Worker(self._wait)
        stage.compute = self._worker.compute
        COMPILE_CLOCK.on_begin = self._note_compiling
        if stage.show is not None:
            self.renew(False)

    def run(self) -> int:
        """Play until the window is closed; return the exit status."""
        with self._signals():
            self._clock.tick()
            while self.leaving is None:
                self.turn(self._clock.tick(RATE) / 1000.0)
        return self.leaving

    def turn(self, elapsed: float) -> None:
        """Take events in, let so much real time pass, s, draw, and show."""
        for event in pygame.event.get():
            self.take(event)
        self.commands.settle()
        if self.leaving is not None:
            return
        self.stage.covered = self.gui.covers_scene or self.stage.question is not None
        compiled = COMPILE_CLOCK.seconds
        self.stage.go_on(elapsed)
        if COMPILE_CLOCK.seconds > compiled:
            self._clock.tick()  # that time was not the scene's
        self.follow(elapsed)
        self.draw()
        if COMPILE_CLOCK.seconds > compiled:
            pygame.event.get(tuple(PRESSES))
        pygame.display.flip()
        self.taking.update(self.surface, elapsed)

    def draw(self) -> None:
        """Draw what is on, and what surrounds it."""
        self.make_room()
        self.gui.bodies_out_of_view = self.loses_sight
        self.gui.draw(self.surface, self.camera, self.stage, self._clock.get_fps(), self.taking.status)

    def _wait(self, done: Callable[[float], bool]) -> None:
        """Stay alive until a job of the worker is done: show what is waited for, and close at Esc and the cross.

        What compiles takes seconds: keys and buttons that were pressed meanwhile are dropped. Other events come later.
        """
        wait, later = Wait(self._worker), []
        asks = not self.stage.saves_at_end and self.stage.count_unsaved() > 0
        behind = self.preview() or self.surface.copy()
        while not done(1.0 / WAIT_RATE):
            surface = pygame.display.get_surface() or self.surface
            surface.blit(behind, (0, 0))
            self.gui.draw_wait(surface, wait.told())
            pygame.display.flip()
            for event in pygame.event.get():
                escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
                if (escape or event.type == pygame.QUIT) and not asks:
                    self.leaving = 0
                later.append(event)
            if self.leaving is not None:
                pygame.display.iconify()
        for event in later:
            escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
            if escape or not (wait.compiled and event.type in PRESSES):
                pygame.event.post(event)
        if wait.compiled:
            self._clock.tick()

    def _note_compiling(self, what: str) -> None:
        """Take note that a kernel is being compiled. What other threads wait for keeps none waiting."""
        self._worker.note_compiling(what)
        if threading.current_thread() is not threading.main_thread():
            return
        self.gui.draw_wait(self.surface, what)
        pygame.display.flip()
        pygame.event.pump()  # keeps the window manager from marking the window as unresponsive

    def take(self, event: pygame.event.Event) -> None:
        """Take one event in."""
        if event.type == pygame.QUIT:
            self.commands.do(Command.QUIT)
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.stage.unfocused = True
        elif event.type in (pygame.WINDOWFOCUSGAINED, pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN):
            self.stage.unfocused = False
        elif event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
            self._resize()
        if self._starts(event):
            self.stage.start_game()
            return
        for error in self._gamepads.take(event, self.stage.host, lambda: self.commands.do(Command.PAUSE)):
            self.stage.messages.tell(str(error), "warning")
        command = self._keyboard.command(event, self.gui.claimed_keys(self.stage))
        self._dismiss(event, command)
        self._let_go(event)
        if self.gui.handle_event(event, self.stage):
            return
        if command is not None:
            self.commands.do(command)
        elif event.type == pygame.KEYDOWN:
            claims = self.gui.key_bindings(self.stage)
            deed = claims.deed(event.key, self._keyboard.again)
            waits = self.stage.waits_for_start
            if deed is not None and not waits and not event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT):
                self.stage.act(deed)
                if event.key in claims.releases:
                    self._held[event.key] = claims.releases[event.key]
        else:
            self.mouse.take(event)

    def _dismiss(self, event: pygame.event.Event, command: Command | None) -> None:
        """Take back a question that is answered by doing something else; the panel may ask and confirm as well."""
        asked = self.commands.asked
        if asked is None:
            return
        if event.type == pygame.KEYDOWN:
            other = command != asked and event.key not in MODIFIERS and not self._keyboard.again
        else:
            left = self.surface.get_width() - self.gui.panel.width
            other = event.type == pygame.MOUSEBUTTONDOWN and event.pos[0] < left
        if other:
            self.commands.dismiss()

    def _starts(self, event: pygame.event.Event) -> bool:
        """Tell whether an event starts the game that waits for it: Space, or any button of a gamepad."""
        if not self.stage.waits_for_start or self.gui.covers_scene or self.stage.faults:
            return False
        space = event.type == pygame.KEYDOWN and event.key == pygame.K_SPACE
        return space or event.type == pygame.JOYBUTTONDOWN

    def _let_go(self, event: pygame.event.Event) -> None:
        """Do what the release of a claimed key asks for, also where the release itself will go elsewhere."""
        if event.type == pygame.WINDOWFOCUSLOST:
            gone = list(self._held)
        else:
            gone = [event.key] if event.type == pygame.KEYUP else []
        for key in gone:
            deed = self._held.pop(key, None)
            if deed is not None and self.stage.live is not None:
                self.stage.act(deed)

    def _resize(self) -> None:
        surface = pygame.display.get_surface()
        if surface is None or surface.get_size() == self.camera.size:
            return
        self.resize(surface)

    @contextmanager
    def _signals(self) -> Iterator[None]:
        """Close cleanly on Ctrl+C and SIGTERM; at a second signal raise KeyboardInterrupt at once."""

        def leave(number: int, _: FrameType | None) -> None:
            if self.leaving is not None:
                raise KeyboardInterrupt
            self.leaving = 130 if number == signal.SIGINT else 0

        before = {number: signal.signal(number, leave) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def close(self) -> None:
        """Finish what is being recorded, and close the window."""
        COMPILE_CLOCK.on_begin = None
        self.taking.stop_recording()
        self.gui.close()
        self.stage.compute = compute_here
        if not self._worker.is_busy:  # else the engine is in use, and the process ends anyway
            self.stage.close()
        self._worker.close()
        close_screen()
