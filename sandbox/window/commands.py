"""Command dispatch: handlers of the commands of keys and panel buttons."""

from collections.abc import Callable

from sandbox.window.app_state import AppState
from sandbox.window.context import WindowContext
from sandbox.window.input.body_tools import describe_loss
from sandbox.window.input.keymap import Command
from sandbox.window.mouse import MouseController
from sandbox.window.playback.parameters import ParameterValue

CONFIRMATIONS = {
    Command.RESTART: "press R again to restart",
    Command.PREVIOUS: "press [ again to open the other scene",
    Command.NEXT: "press ] again to open the other scene",
    Command.RELOAD: "press Ctrl+L again to reload",
    Command.QUIT: "press Esc again to quit",
    Command.EDIT: "press Ctrl+E again to edit the scene",
}
"""Confirmation hints of the commands that end a session with unsaved manual changes."""


LOSE_DRAFT = (Command.PREVIOUS, Command.NEXT, Command.RELOAD, Command.QUIT)
"""Commands that lose the unsaved changes of an edited scene."""


class CommandConfirmation:
    """Question before a command that loses unsaved changes: the command must be given again, as the next one."""

    def __init__(self, app_state: AppState) -> None:
        self._app_state = app_state
        self.pending: Command | None = None
        """command that waits to be given again"""
        self.given: Command | None = None
        """command that was given again, while it runs and when it has closed the window"""

    @property
    def loses_draft(self) -> bool:
        """Whether the user has agreed to lose the unsaved changes of an edited scene."""
        return self.given in LOSE_DRAFT

    def is_needed(self, command: Command) -> bool:
        """Ask if a command would lose changes; return False if none would be lost or it was just given again."""
        app_state, self.given = self._app_state, command if command == self.pending else None
        self.cancel()
        if command not in CONFIRMATIONS or self.given or (command is Command.QUIT and app_state.saves_at_end):
            return False
        if app_state.has_unsaved_draft and command in LOSE_DRAFT:
            question = f"the edited scene is not saved: {CONFIRMATIONS[command]}, Ctrl+E and Ctrl+S save it"
        else:
            count = app_state.count_unsaved(restart=command is Command.RESTART)
            if not count:
                return False
            question = describe_loss(count, CONFIRMATIONS[command], kept=app_state.count_unsaved() - count)
        self.pending, app_state.question = command, question
        return True

    def cancel(self) -> None:
        """Withdraw the question."""
        self.pending = self._app_state.question = None


class CommandDispatcher:
    """Handlers of commands and of the panel's widgets."""

    def __init__(self, context: WindowContext, mouse: MouseController) -> None:
        self._context, self._mouse = context, mouse
        self._changed: dict[str, ParameterValue] = {}  # parameter changes since the last `flush`, latest last
        self.confirmation = CommandConfirmation(context.app_state)
        self.on_edit: Callable[[], None] = lambda: None
        """callback that starts the editing of the scene"""
        app_state, gui = context.app_state, context.gui
        self._handlers: dict[Command, Callable[[], object]] = {
            Command.PAUSE: app_state.toggle_pause,
            Command.STEP: app_state.step,
            Command.BACK: app_state.step_back,
            Command.RESTART: app_state.restart,
            Command.PREVIOUS: lambda: app_state.open_neighbour(-1),
            Command.NEXT: lambda: app_state.open_neighbour(1),
            Command.PICKER: self._open_scene_browser,
            Command.SLOWER: app_state.slower,
            Command.FASTER: app_state.faster,
            Command.ENGINE: app_state.switch_to_next_engine,
            Command.GHOST: app_state.toggle_ghost,
            Command.TRUST: app_state.toggle_trust,
            Command.HOME: self._fit_view,
            Command.PANEL: self._toggle_panel,
            Command.HELP: self._toggle_help,
            Command.SCREENSHOT: self._save_screenshot,
            Command.RECORD: self._toggle_recording,
            Command.SAVE: lambda: context.capture.save_session(app_state.view, context.name),
            Command.RELOAD: app_state.reload,
            Command.SOUND: lambda: app_state.messages.add(*gui.toggle_sound()),
            Command.DELETE: lambda: app_state.use_tool(app_state.body_tools.remove),
            Command.NUDGE: lambda: app_state.use_tool(app_state.body_tools.nudge),
            Command.ADD_BALL: lambda: self._add_body(box=False),
            Command.ADD_BOX: lambda: self._add_body(box=True),
            Command.QUIT: self._quit,
            Command.EDIT: lambda: self.on_edit(),
            Command.UNDO: app_state.restore_session,
            Command.FOLLOW: context.toggle_follow,
            Command.FULL_SCREEN: context.toggle_full_screen,
        }
        gui.panel.on_button = self.run
        gui.panel.on_toggle = lambda name, _: self.toggle(name)
        gui.panel.on_change = self._store_parameter

    def run(self, command: Command) -> None:
        """Run a command after applying the pending changes of parameters and of the mouse."""
        self.flush()
        if self.confirmation.is_needed(command):
            return
        if command.overlay is not None:
            self._context.gui.overlays ^= {command.overlay}
        else:
            self._handlers[command]()
        if self._context.exit_status is None:
            self.confirmation.given = None

    def toggle(self, name: str) -> None:
        """Toggle one of the panel's checkboxes."""
        if name == "antialias":
            self._context.gui.antialias = not self._context.gui.antialias
        else:
            self.run(Command[name.upper()])

    def flush(self) -> None:
        """Apply the latest values of sliders and of a drag: once per frame, whatever the number of motion events."""
        changed, self._changed = self._changed, {}
        for key, value in changed.items():
            self._context.app_state.set_parameter(key, value)
        self._mouse.flush()

    def _store_parameter(self, key: str, value: ParameterValue, _: bool) -> None:
        self._changed.pop(key, None)
        self._changed[key] = value

    def _release_all(self) -> None:
        """End all drags, before an overlay covers the scene and consumes the button releases."""
        self._mouse.release_all()
        self._context.gui.panel.release()
        self.flush()

    def _open_scene_browser(self) -> None:
        self._release_all()
        self._context.gui.open_scene_browser(self._context.app_state.path)

    def _toggle_help(self) -> None:
        self._release_all()
        self._context.gui.toggle_help()

    def _fit_view(self) -> None:
        """Fit the camera to the scene; if it is fitted already, to the present positions of the bodies."""
        self._context.following = None
        if self._context.is_fitted:
            self._context.fit_bodies()
        else:
            self._context.fit_scene()

    def _toggle_panel(self) -> None:
        self._release_all()
        gui = self._context.gui
        gui.panel.visible = not gui.panel.visible
        if self._context.is_fitted:
            self._context.fit_scene()

    def _save_screenshot(self) -> None:
        self._context.capture.save_screenshot(self._context.surface, self._context.name)

    def _toggle_recording(self) -> None:
        capture = self._context.capture
        if capture.is_recording:
            capture.stop_recording()
        else:
            capture.start_recording(self._context.gui.area.size, self._context.name)

    def _add_body(self, *, box: bool) -> None:
        camera, app_state = self._context.camera, self._context.app_state
        view_size = min(camera.size) / camera.scale
        app_state.use_tool(app_state.body_tools.add, self._mouse.world_position(), view_size, box=box)

    def _quit(self) -> None:
        self._context.exit_status = 0
