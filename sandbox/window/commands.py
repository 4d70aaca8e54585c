"""Commands: what each key and button does."""

from collections.abc import Callable

from sandbox.window.context import WindowContext
from sandbox.window.input.body_tools import describe_loss
from sandbox.window.input.keymap import Command
from sandbox.window.mouse import MouseController
from sandbox.window.playback.parameters import ParameterValue

BUTTONS = {
    "play": Command.PAUSE,
    "pause": Command.PAUSE,
    "step": Command.STEP,
    "back": Command.BACK,
    "restart": Command.RESTART,
    "camera": Command.SCREENSHOT,
    "record": Command.RECORD,
    "stop": Command.RECORD,
    "save": Command.SAVE,
    "picker": Command.PICKER,
    "help": Command.HELP,
}
"""What the panel's buttons stand for."""


LOSING = {
    Command.RESTART: "press R again to restart",
    Command.PREVIOUS: "press [ again to open the other scene",
    Command.NEXT: "press ] again to open the other scene",
    Command.RELOAD: "press Ctrl+L again to reload",
    Command.QUIT: "press Esc again to quit",
}
"""What ends a session, and how that is confirmed where something hand-made would be lost."""


class Commands:
    """One function for each command."""

    def __init__(self, seat: WindowContext, mouse: MouseController) -> None:
        self._seat, self._mouse = seat, mouse
        self._turned: dict[str, ParameterValue] = {}  # knobs since the last `settle`, the last turned last
        self.asked: Command | None = None
        """what was not done at once, as something would be lost"""
        stage, gui = seat.stage, seat.gui
        self._deeds: dict[Command, Callable[[], object]] = {
            Command.PAUSE: stage.toggle_pause,
            Command.STEP: stage.step,
            Command.BACK: stage.back,
            Command.RESTART: stage.restart,
            Command.PREVIOUS: lambda: stage.walk(-1),
            Command.NEXT: lambda: stage.walk(1),
            Command.PICKER: self._picker,
            Command.SLOWER: stage.slower,
            Command.FASTER: stage.faster,
            Command.ENGINE: stage.next_engine,
            Command.GHOST: stage.toggle_ghost,
            Command.TRUST: stage.toggle_trust,
            Command.HOME: self._home,
            Command.PANEL: self._panel,
            Command.HELP: self._help,
            Command.SCREENSHOT: self._screenshot,
            Command.RECORD: self._record,
            Command.SAVE: lambda: seat.taking.save_session(stage.show, seat.name),
            Command.RELOAD: stage.reload,
            Command.SOUND: lambda: stage.messages.tell(*gui.toggle_sound()),
            Command.DELETE: lambda: stage.act(stage.hands.remove),
            Command.NUDGE: lambda: stage.act(stage.hands.nudge),
            Command.ADD_BALL: lambda: self._add(box=False),
            Command.ADD_BOX: lambda: self._add(box=True),
            Command.QUIT: self._quit,
            Command.UNDO: stage.bring_back,
            Command.FOLLOW: seat.toggle_follow,
            Command.FULL_SCREEN: seat.toggle_full_screen,
        }
        gui.panel.on_button = lambda name: self.do(BUTTONS[name])
        gui.panel.on_toggle = lambda name, _: self.toggle(name)
        gui.panel.on_change = self._turn

    def do(self, command: Command) -> None:
        """Do what a command says, after what came before it."""
        self.settle()
        if self._asks(command):
            return
        if command.overlay is not None:
            self._seat.gui.overlays ^= {command.overlay}
        else:
            self._deeds[command]()

    def _asks(self, command: Command) -> bool:
        """Ask before hand-made changes are lost; return whether that was asked now. Asked twice, it is done."""
        stage, confirmed = self._seat.stage, command == self.asked
        self.dismiss()
        if command not in LOSING or confirmed or (command is Command.QUIT and stage.saves_at_end):
            return False
        count = stage.count_unsaved(restart=command is Command.RESTART)
        if not count:
            return False
        self.asked, stage.question = command, describe_loss(count, LOSING[command])
        return True

    def dismiss(self) -> None:
        """Take back what was asked."""
        self.asked = self._seat.stage.question = None

    def toggle(self, name: str) -> None:
        """Turn one of the panel's switches."""
        if name == "antialias":
            self._seat.gui.antialias = not self._seat.gui.antialias
        else:
            self.do(Command(name))

    def settle(self) -> None:
        """Act on where knobs and the mouse are by now: once a turn, however many motions led there."""
        turned, self._turned = self._turned, {}
        for key, value in turned.items():
            self._seat.stage.turn(key, value)
        self._mouse.settle()

    def _turn(self, key: str, value: ParameterValue, _: bool) -> None:
        self._turned.pop(key, None)
        self._turned[key] = value

    def _let_go(self) -> None:
        """Let go of everything, as something comes that hides the releases."""
        self._mouse.let_go()
        self._seat.gui.panel.release()
        self.settle()

    def _picker(self) -> None:
        self._let_go()
        self._seat.gui.open_scene_browser(self._seat.stage.path)

    def _help(self) -> None:
        self._let_go()
        self._seat.gui.toggle_help()

    def _home(self) -> None:
        """Show the scene as it began; where that is seen already, the bodies where they are now."""
        self._seat.following = None
        if self._seat.at_home:
            self._seat.find()
        else:
            self._seat.home()

    def _panel(self) -> None:
        self._let_go()
        gui = self._seat.gui
        gui.panel.visible = not gui.panel.visible
        if self._seat.at_home:
            self._seat.home()

    def _screenshot(self) -> None:
        self._seat.taking.save_screenshot(self._seat.surface, self._seat.name)

    def _record(self) -> None:
        taking = self._seat.taking
        if taking.is_recording:
            taking.stop_recording()
        else:
            taking.start_recording(self._seat.surface.get_size(), self._seat.name)

    def _add(self, *, box: bool) -> None:
        seat = self._seat
        place = self._mouse.world()
        size = min(seat.camera.size) / seat.camera.scale
        seat.stage.act(lambda live: seat.stage.hands.add(live, place, size, box=box))

    def _quit(self) -> None:
        self._seat.leaving = 0
