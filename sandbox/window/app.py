"""The window: main loop, event dispatch and signals.

A frame handles the events, advances the session and draws, so that input is visible in the next picture.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import pygame

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.scene.editing.draft import NEW_SCENE, SceneDraft
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps
from sandbox.window.app_state import AppState
from sandbox.window.commands import CommandDispatcher
from sandbox.window.context import TITLE, WindowContext
from sandbox.window.display import close_screen, open_screen, ui_scale
from sandbox.window.editor.edit_keys import GLOBAL_KEYS, HELP_GROUPS, press_key
from sandbox.window.editor.edit_view import EditView
from sandbox.window.input.bindings import KeyHandler
from sandbox.window.input.clipboard import ClipboardError
from sandbox.window.input.gamepad import Gamepads
from sandbox.window.input.keymap import Command, Keyboard, bound_key, latin_key, pressed_key
from sandbox.window.mouse import MouseController
from sandbox.window.playback.live import LiveView
from sandbox.window.render.palette import ORANGE
from sandbox.window.ui.hud import draw_notice
from sandbox.window.worker import Wait, Worker, compute_here

MAX_FRAME_RATE = 60
"""frames per second"""
WAIT_RATE = 20
"""frames per second while a job compiles or takes long"""

MODIFIER_KEYS = frozenset(
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
"""keys that have no command of their own"""

TOOLBAR_ZOOM = 0.9
"""zoom factor at which a fitted scene leaves room for the toolbar of the editor"""
EMPTY_VIEW = (-6.0, -0.6), (6.0, 6.0)
"""m, part of the world that is shown while a scene without bodies is edited"""

INPUT_EVENTS = frozenset(
    {
        pygame.KEYDOWN,
        pygame.TEXTINPUT,
        pygame.MOUSEBUTTONDOWN,
        pygame.MOUSEWHEEL,
        pygame.JOYBUTTONDOWN,
        pygame.JOYHATMOTION,
    }
)
"""events that are discarded after a compilation"""

GAMEPAD_EVENTS = frozenset(
    {
        pygame.JOYAXISMOTION,
        pygame.JOYBUTTONDOWN,
        pygame.JOYBUTTONUP,
        pygame.JOYDEVICEADDED,
        pygame.JOYDEVICEREMOVED,
        pygame.JOYHATMOTION,
    }
)


class App:
    """The window: it opens the display, and owns it until `close`."""

    def __init__(
        self,
        app_state: AppState,
        *,
        size: tuple[int, int] | None = None,
        folder: Path | None = None,
        film: str = ".gif",
        say: Callable[[str], None] = print,
    ) -> None:
        """Open the window.

        Args:
            app_state: the open scene and its operations.
            size: px; by default derived from the desktop.
            folder: where screenshots, films and sessions are saved; by default the working folder.
            film: format of films, `.gif` or `.mp4`.
            say: prints a line on the terminal.

        Raises:
            NoDisplayError: there is no display.
        """
        surface = open_screen(size, TITLE)
        self.app_state = app_state
        self.context = WindowContext(surface, ui_scale(), app_state, folder or Path(), film, say)
        self._keyboard = Keyboard()
        self._release_handlers: dict[tuple[bool, int], KeyHandler] = {}  # of bound keys that are down
        self._gamepads = Gamepads(self.context.notify)
        self._gamepads.start()
        self.mouse = MouseController(self.context)
        self.commands = CommandDispatcher(self.context, self.mouse)
        self.editing: EditView | None = None
        """the editor, while the scene is edited"""
        self._edited: EditView | None = None
        """the editor of the open scene, which was left to run it"""
        self.commands.on_edit = self.start_editing
        self._folder = folder or Path()
        self._command: Command | None = None  # of the last event
        self._layers: tuple[Callable[[pygame.event.Event], object], ...] = (
            self._start_game,
            self._use_gamepad,
            self._edit,
            lambda event: self.context.gui.handle_event(event, app_state),
            self._run_command,
            self._press_key,
            self.mouse.handle_event,
        )
        """functions that return whether they have used an event, the topmost first"""
        self._clock = pygame.time.Clock()
        app_state.on_scene_changed = self._on_scene_changed
        self._worker = Worker(self._wait)
        app_state.compute = self._worker.compute
        app_state.on_part = self._show_part
        COMPILE_CLOCK.on_begin = self._note_compiling
        if app_state.view is not None:
            self.context.on_scene_changed(False)

    def run(self) -> int:
        """Run the main loop until the window is closed; return the exit status."""
        with self._signals():
            self._clock.tick()
            while self.context.exit_status is None:
                self.run_frame(self._clock.tick(MAX_FRAME_RATE) / 1000.0)
        return self.context.exit_status

    def run_frame(self, elapsed: float) -> None:
        """Handle events, advance by an interval of real time, s, and draw."""
        for event in pygame.event.get():
            self.handle_event(event)
        self.commands.flush()
        if self.context.exit_status is not None:
            return
        has_cover = self.context.gui.covers_scene or self.app_state.question is not None
        self.app_state.covered = has_cover or self.editing is not None
        compiled = COMPILE_CLOCK.seconds
        self.app_state.update(elapsed)
        if self._edited is not None:
            self._edited.update()
        if COMPILE_CLOCK.seconds > compiled:
            self._clock.tick()  # compile time does not advance the scene
        self.context.update_camera(elapsed)
        self.draw()
        if COMPILE_CLOCK.seconds > compiled and not self._takes_text:
            pygame.event.get(tuple(INPUT_EVENTS))
        pygame.display.flip()
        self.context.capture.update(self._film_picture, elapsed)

    def _film_picture(self) -> pygame.Surface:
        """Return the picture of a film: the scene alone; the whole window while a scene is edited or picked."""
        context = self.context
        picture = None if self.editing is not None else context.gui.film_picture(context.camera, self.app_state)
        return context.surface if picture is None else picture

    def draw(self) -> None:
        """Draw the scene and the GUI."""
        context = self.context
        context.gui.has_gamepad = self._gamepads.is_connected
        frame = context.gui.update(self.app_state, self._clock.get_fps(), context.capture.status)
        if self.editing is not None and context.gui.scene_browser is None:
            self._draw_editing(self.editing)
            return
        context.refit_if_covered()
        context.gui.bodies_out_of_view = context.is_out_of_view
        context.gui.draw(context.surface, context.camera, self.app_state, frame)
        context.gui.announce_keys(self.app_state)

    def _wait(self, done: Callable[[float], bool]) -> None:
        """Show progress until a job of the worker is done; Esc and the close button still close the window.

        After a compilation, which takes seconds, key and button presses are dropped, unless text is typed. Other events
        are posted again.
        """
        wait, later = Wait(self._worker), []
        asks = not self.app_state.saves_at_end and self.app_state.count_unsaved() > 0
        behind = self.context.render_preview() or self.context.surface.copy()
        while not done(1.0 / WAIT_RATE):
            surface = pygame.display.get_surface() or self.context.surface
            surface.blit(behind, (0, 0))
            self.context.gui.draw_wait(surface, wait.text())
            pygame.display.flip()
            for event in pygame.event.get():
                escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
                if (escape or event.type == pygame.QUIT) and not asks:
                    self.context.exit_status = 0
                later.append(event)
            if self.context.exit_status is not None:
                pygame.display.iconify()
        for event in later:
            escape = event.type == pygame.KEYDOWN and event.key == pygame.K_ESCAPE
            if escape or self._takes_text or not (wait.compiled and event.type in INPUT_EVENTS):
                pygame.event.post(event)
        if wait.compiled:
            self._clock.tick()

    @property
    def _takes_text(self) -> bool:
        """Whether keys are text for the scene browser or the editor, not input of a scene that has not started yet."""
        return self.editing is not None or self.context.gui.scene_browser is not None

    def _show_part(self, part: str) -> None:
        """Name the part of a warm-up in the progress notice; called by the job."""
        self._worker.part = part

    def _note_compiling(self, what: str) -> None:
        """Show that a kernel is being compiled, if the main thread compiles it."""
        self._worker.note_compiling(what)
        if threading.current_thread() is not threading.main_thread():
            return
        self.context.gui.draw_wait(self.context.surface, what)
        pygame.display.flip()
        pygame.event.pump()  # keeps the window manager from marking the window as unresponsive

    def handle_event(self, event: pygame.event.Event) -> None:
        """Handle an event: note what it means for the window and the keyboard, and pass it to the layers."""
        try:
            self._handle_window_event(event)
            self._command = self._keyboard.command(event, self.app_state.key_bindings.pressed.keys())
            self._withdraw_question(event)
            self._release_keys(event)
            for handle in self._layers:
                if handle(event):
                    return
        except ClipboardError as error:  # the system gives no access to the clipboard
            self.app_state.messages.add(str(error), "warning")

    def _handle_window_event(self, event: pygame.event.Event) -> None:
        if event.type == pygame.QUIT:
            self.commands.run(Command.QUIT)
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.app_state.unfocused = True
        elif event.type in (pygame.WINDOWFOCUSGAINED, pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN):
            self.app_state.unfocused = False
        elif event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
            surface = pygame.display.get_surface()
            if surface is not None and surface.get_size() != self.context.camera.size:
                self.context.resize(surface)

    def _use_gamepad(self, event: pygame.event.Event) -> bool:
        if event.type not in GAMEPAD_EVENTS:
            return False
        for error in self._gamepads.handle_event(event, self.app_state.host, lambda: self.commands.run(Command.PAUSE)):
            self.app_state.messages.add(str(error), "warning")
        return True

    def _run_command(self, _: pygame.event.Event) -> bool:
        if self._command is not None:
            self.commands.run(self._command)
        return self._command is not None

    def start_editing(self) -> None:
        """Edit the open scene, or go on editing it; without a scene, a new one with a ground."""
        app_state, is_new = self.app_state, self.app_state.view is None
        if is_new and not app_state.play_draft(SceneDraft().scene, None):
            return
        if not isinstance(app_state.view, LiveView) or app_state.file is None:
            app_state.messages.add("a stored run cannot be edited; open its scene with `sandbox play`", "warning")
            return
        editing = self._edited
        if editing is not None and not editing.draft.is_changed and editing.draft.is_file_changed():
            editing = self._reopened(editing)
        if editing is None:
            try:
                path = app_state.path
                text = NEW_SCENE if is_new else dumps(app_state.file)
                draft = SceneDraft(text) if path is None else SceneDraft.read(path)
            except SceneError as error:
                app_state.messages.add(str(error), "error")
                return
            editing = EditView(self.context, draft, self.stop_editing, self.commands.run, self._folder)
        self.mouse.release_all()
        self.context.following = None
        if not editing.draft.scene.bodies.names:
            self.context.show_box(EMPTY_VIEW)
        elif self.context.is_fitted:  # leaves room for the toolbar at the left
            area = self.context.gui.area
            self.context.camera = self.context.camera.zoomed(TOOLBAR_ZOOM, (area.right, area.centery))
        self.context.is_fitted = False  # the view stays when the scene runs
        self.editing = self._edited = editing

    def _reopened(self, editing: EditView) -> EditView:
        """Return an editor of a file that was changed on disk; the former one if it cannot be edited any more."""
        path = editing.draft.path
        try:
            draft = None if path is None else SceneDraft.read(path)
        except SceneError:  # a message of the window says so when it is saved
            draft = None
        if draft is None:
            return editing
        editing.close(is_lost=False)
        return EditView(self.context, draft, self.stop_editing, self.commands.run, self._folder)

    def stop_editing(self) -> None:
        """Run the edited scene from the start."""
        editing = self.editing
        if editing is None:
            return
        editing.panel.commit()
        editing.drop_gesture()
        editing.reset_cursor()
        self.app_state.paused = False
        self.editing = None
        if not self.app_state.play_draft(editing.draft.scene, editing.draft.path):
            self.editing = editing  # no engine can run it, which a message says
        self._edited = editing

    def _edit(self, event: pygame.event.Event) -> bool:
        """Pass an event to the editor; zoom, panning and Esc are those of the window."""
        editing, is_key = self.editing, event.type == pygame.KEYDOWN
        if editing is None or self.context.gui.covers_scene:
            return False
        if is_key and latin_key(event) in GLOBAL_KEYS and self._keyboard.is_repeat:
            return True
        if editing.handle_event(event) or (is_key and press_key(editing, event)):
            return True
        if is_key and event.key == pygame.K_ESCAPE:
            self.commands.run(Command.QUIT)
        elif (
            event.type in (pygame.MOUSEWHEEL, pygame.WINDOWFOCUSLOST)
            or getattr(event, "button", 0) in (2, 3)
            or (event.type == pygame.MOUSEMOTION and self.mouse.is_panning)
        ):
            self.mouse.handle_event(event)
        return True

    def _draw_editing(self, editing: EditView) -> None:
        """Draw the scene that is edited, and what covers it."""
        context = self.context
        editing.draw(context.surface)
        if context.gui.help.open:
            context.gui.help.draw(context.surface, context.gui.ui_scale, groups=HELP_GROUPS)
        if self.app_state.question is not None:
            size = 16 * context.gui.ui_scale
            draw_notice(context.surface, self.app_state.question, context.gui.area, size, ORANGE)

    def _press_key(self, event: pygame.event.Event) -> bool:
        """Run the handler that the scene or its game binds to a key."""
        if event.type != pygame.KEYDOWN:
            return False
        if self.app_state.waits_for_start or event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT):
            return True
        bindings = self.app_state.key_bindings
        key = bound_key(event, bindings.pressed.keys())
        if key is not None and (key in bindings.repeated or not self._keyboard.is_repeat):
            self.app_state.run_handler(bindings.pressed[key])
            if key in bindings.released:
                self._release_handlers[pressed_key(event)] = bindings.released[key]
        return True

    def _withdraw_question(self, event: pygame.event.Event) -> None:
        """Withdraw a question if the event is another key or a click on the scene; the panel may confirm it as well."""
        confirmation = self.commands.confirmation
        if confirmation.pending is None:
            return
        if event.type == pygame.KEYDOWN:
            is_answer = self._command == confirmation.pending or event.key in MODIFIER_KEYS or self._keyboard.is_repeat
        else:
            left = self.context.surface.get_width() - self.context.gui.panel.width
            is_answer = event.type != pygame.MOUSEBUTTONDOWN or event.pos[0] >= left
        if not is_answer:
            confirmation.cancel()

    def _start_game(self, event: pygame.event.Event) -> bool:
        """Start the game that waits for it, with Space or any button of a gamepad."""
        is_hidden = self.editing is not None or self.context.gui.covers_scene
        if not self.app_state.waits_for_start or is_hidden or self.app_state.faults:
            return False
        if event.type != pygame.JOYBUTTONDOWN and not (event.type == pygame.KEYDOWN and event.key == pygame.K_SPACE):
            return False
        self.app_state.start_game()
        return True

    def _release_keys(self, event: pygame.event.Event) -> None:
        """Run the release handlers of bound keys, also if the event itself is consumed elsewhere."""
        if event.type == pygame.WINDOWFOCUSLOST:
            keys = list(self._release_handlers)
        else:
            keys = [pressed_key(event)] if event.type == pygame.KEYUP else []
        for key in keys:
            handler = self._release_handlers.pop(key, None)
            if handler is not None:
                self.app_state.run_handler(handler)

    def _on_scene_changed(self, same: bool) -> None:
        self._release_handlers.clear()  # they act on the former session
        is_reload_confirmed = self.commands.confirmation.given is Command.RELOAD
        if not same or is_reload_confirmed:
            self._end_editing()
            self.app_state.has_unsaved_draft = False
        self.context.on_scene_changed(same)

    def _end_editing(self) -> None:
        """Close the editor; unsaved changes are lost only if the user has agreed."""
        if self._edited is not None:
            self._edited.close(is_lost=self.commands.confirmation.loses_draft)
        self.editing = self._edited = None

    @contextmanager
    def _signals(self) -> Iterator[None]:
        """Close cleanly on Ctrl+C and SIGTERM; at a second signal raise KeyboardInterrupt at once."""

        def leave(number: int, _: FrameType | None) -> None:
            if self.context.exit_status is not None:
                raise KeyboardInterrupt
            self.context.exit_status = 130 if number == signal.SIGINT else 0

        before = {number: signal.signal(number, leave) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def close(self) -> None:
        """Finish a film that is being recorded, and close the window."""
        COMPILE_CLOCK.on_begin = None
        self._end_editing()
        self.context.capture.stop_recording()
        self.context.gui.close()
        self.app_state.compute = compute_here
        if not self._worker.is_busy:  # otherwise the engine is in use, and the process ends anyway
            self.app_state.close()
        self._worker.close()
        close_screen()
