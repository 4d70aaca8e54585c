"""Commands: what each key and button does."""

from collections.abc import Callable

from sandbox.play.keys import Command
from sandbox.play.mouse import Mouse
from sandbox.play.seat import Seat

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


class Commands:
    """One function for each command."""

    def __init__(self, seat: Seat, mouse: Mouse) -> None:
        self._seat, self._mouse = seat, mouse
        stage, desk = seat.stage, seat.desk
        self._deeds: dict[Command, Callable[[], object]] = {
            Command.PAUSE: self._pause,
            Command.STEP: stage.step,
            Command.BACK: stage.back,
            Command.RESTART: stage.restart,
            Command.PREVIOUS: lambda: stage.walk(-1),
            Command.NEXT: lambda: stage.walk(1),
            Command.PICKER: lambda: desk.open_picker(stage.path),
            Command.SLOWER: stage.slower,
            Command.FASTER: stage.faster,
            Command.ENGINE: stage.next_engine,
            Command.GHOST: stage.toggle_ghost,
            Command.TRUST: stage.toggle_trust,
            Command.HOME: seat.home,
            Command.PANEL: self._panel,
            Command.HELP: desk.toggle_help,
            Command.SCREENSHOT: self._screenshot,
            Command.RECORD: self._record,
            Command.SAVE: lambda: seat.taking.session(stage.show, seat.name),
            Command.RELOAD: stage.reload,
            Command.SOUND: lambda: stage.messages.tell(*desk.toggle_sound()),
            Command.DELETE: lambda: stage.act(stage.hands.remove),
            Command.NUDGE: lambda: stage.act(stage.hands.nudge),
            Command.ADD_BALL: self._add,
            Command.QUIT: self._quit,
        }
        desk.panel.on_button = lambda name: self.do(BUTTONS[name])
        desk.panel.on_toggle = lambda name, _: self.toggle(name)
        desk.panel.on_change = lambda key, value, _: stage.turn(key, value)

    def do(self, command: Command) -> None:
        """Do what a command says."""
        if command.overlay is not None:
            self._seat.desk.overlays ^= {command.overlay}
        else:
            self._deeds[command]()

    def toggle(self, name: str) -> None:
        """Turn one of the panel's switches."""
        if name == "antialias":
            self._seat.desk.antialias = not self._seat.desk.antialias
        else:
            self.do(Command(name))

    def _pause(self) -> None:
        self._seat.stage.paused = not self._seat.stage.paused

    def _panel(self) -> None:
        desk = self._seat.desk
        desk.panel.visible = not desk.panel.visible
        if self._seat.at_home:
            self._seat.home()

    def _screenshot(self) -> None:
        self._seat.taking.picture(self._seat.surface, self._seat.name)

    def _record(self) -> None:
        taking = self._seat.taking
        if taking.filming:
            taking.end_film()
        else:
            taking.begin_film(self._seat.surface.get_size(), self._seat.name)

    def _add(self) -> None:
        seat = self._seat
        place = self._mouse.world()
        size = min(seat.camera.size) / seat.camera.scale
        seat.stage.act(lambda live: seat.stage.hands.add(live, place, size))

    def _quit(self) -> None:
        self._seat.leaving = 0
