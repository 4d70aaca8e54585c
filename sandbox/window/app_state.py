"""Stage: what is on, where it came from, and all that can be asked of it; no pygame, so that it can be tried without.

Whatever fails is told as a message, and what was on goes on.

Shelf: the scene files that lie beside the one that was opened, and the shipped ones.

Wishes: what somebody has chosen, which what is on next is to keep.

Beginning: a scene becomes a session that is watched, on the engine that is wished for or one that can.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sandbox.action import ActionError, SetParameter
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES, USUAL, able, engine_named, usual
from sandbox.games.billiards.view.controls import CueControls, TableGameHost, prepared_scene
from sandbox.games.billiards.view.table_game import PLAYERS, BilliardsGame, Players
from sandbox.games.registry import is_real_time, rules_of
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_document, load
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.scene.scene import Scene
from sandbox.window.camera import Box
from sandbox.window.game_host import GameHost, game_session_of, host_of
from sandbox.window.input.body_tools import BodyTools, count_changes
from sandbox.window.messages import Messages
from sandbox.window.playback.diagnostics import Diagnostics
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import ParameterValue, turned
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.session import Session
from sandbox.window.view_bounds import predict_bounds
from sandbox.window.worker import Compute, compute_here


def scenes_beside(path: Path | None) -> tuple[Path, ...]:
    """Return the scene files to walk through from one: those of its folder, or where none is open, the shipped."""
    if path is None:
        return tuple(scene.path for scene in shipped())
    try:
        found = sorted(path.parent.glob("*.toml"))
    except OSError:  # the folder has gone, or may not be read: what is open can still be played
        found = []
    known = {file.resolve() for file in found}
    return tuple(found) if path.resolve() in known else (path, *found)


def neighbouring_scene(path: Path | None, by: int) -> Path | None:
    """Return the scene file so many places on, round and round; None where there is none."""
    files = scenes_beside(path)
    if not files:
        return None
    if path is None:
        return files[0 if by > 0 else -1]
    here = next((k for k, file in enumerate(files) if file.resolve() == path.resolve()), 0)
    return files[(here + by) % len(files)]


def scenes_to_pick(path: Path | None) -> list[tuple[str, Path]]:
    """Return what a picker offers, by name: the shipped scenes, and those beside the one that is open."""
    own = [(scene.name, scene.path) for scene in shipped()]
    known = {file.resolve() for _, file in own}
    others = [file for file in (scenes_beside(path) if path is not None else ()) if file.resolve() not in known]
    return [*((f"{file.parent.resolve().name}/{file.stem}", file) for file in others), *own]


@dataclass
class Preferences:
    """What is chosen for every scene, and what was turned of the present one."""

    engine: str | None
    """what plays may be another"""
    overrides: tuple[Override, ...]
    """values set in every scene that is opened"""
    ghosted: bool = False
    trusting: bool | None = None
    """None: nobody has said"""
    turned: dict[str, Any] = field(default_factory=dict)
    """values of the present scene by path, for a restart to keep"""

    def begin(self, company: Diagnostics, trusting: bool) -> None:
        """Show beside a session what is wished; a twin, where nobody has said, as told."""
        company.show_trust(trusting if self.trusting is None else self.trusting)
        if self.ghosted and not company.ghosted:
            company.show_ghost(True)

    def toggle_ghost(self, company: Diagnostics) -> None:
        """Begin a ghost from here, or end it; from now on that is wished."""
        self.ghosted = not company.ghosted
        company.show_ghost(self.ghosted)

    def toggle_trust(self, company: Diagnostics) -> None:
        """Begin to watch a twin from here, or end it; from now on that is wished."""
        self.trusting = company.trust is None
        company.show_trust(self.trusting)

    def turn(self, action: SetParameter) -> None:
        """Keep a value for a restart."""
        self.turned.pop(action.path, None)  # what is turned last is set last
        self.turned[action.path] = action.value

    def as_turned(self, file: Scene) -> Scene:
        """Return the scene as its file has it, with what was turned.

        Raises:
            SceneError: what was turned does not go together.
        """
        return from_document(to_document(file), "<scene>", self.turned.items())


def session_of_recording(recording: Recording) -> LiveView:
    """Return a session that has done again all that was done in another, and goes on from there."""
    rules = rules_of(recording.scene)
    game = None if rules is None else GameSession(rules, recording.presses)
    session = Session(
        recording.scene, recording.engine, recording.settings, recording.actions, game, recording.duration
    )
    session.note_unsaved()
    live = LiveView(session)
    live.seek(round(recording.duration / session.settings.dt))
    return live


def create_session(scene: Scene, engine: str, settings: Settings | None, messages: Messages) -> LiveView | None:
    """Begin a session of a scene, with its game where it has one; None where no engine can, which is told.

    Args:
        scene: as its file has it.
        engine: the wish; where it cannot, one that can takes its place, and that is told.
        settings: by default the scene's own.
        messages: told of what is not as wished.
    """
    scene = prepared_scene(scene)
    game = game_session_of(scene, messages)
    try:
        return LiveView(Session(scene, engine, settings, game=game))
    except Refusal as refusal:
        others = able(scene)
        if not others:
            messages.tell(str(refusal), "error")
            return None
        messages.tell(f"{refusal}; opened with {others[0]}", "warning")
        return LiveView(Session(scene, others[0], game=game))


FEW = 64
"""Bodies up to which a twin is watched from the beginning."""


class AppState:
    """What the window shows, and what is done to it."""

    def __init__(self, engine: str | None = None, overrides: Iterable[Override] = ()) -> None:
        """Start with nothing on.

        Args:
            engine: whose name is tried first for every scene, until another is chosen; by default the exact one
                for tables, and pymunk for all else.
            overrides: values set in every scene that is opened.
        """
        self.show: LiveView | RecordedView | None = None
        self.path: Path | None = None
        self.reach: Box | None = None
        """where the bodies come without a hand, m, as far as that is known"""
        self.file: Scene | None = None
        """the scene as its file has it"""
        self._seats = TableGameHost()
        self.host: GameHost | None = None
        """of the game with rules that is on"""
        self._paused = False
        self.waits_for_start = False
        """a real-time game has been opened, and no key has started it yet"""
        self.covered = False
        """help or the picker covers the scene; time stands still meanwhile"""
        self.unfocused = False
        """another window has the keyboard; time stands still meanwhile"""
        self.compute: Compute = compute_here
        """calls all that may have to compile; the window lets it run beside itself"""
        self.question: str | None = None
        """what is asked before hand-made changes are lost"""
        self.saves_at_end = False
        """the session is saved when the window closes"""
        self._lost: Recording | None = None  # what Ctrl+Z brings back
        self.opening: Scene | None = None
        """the scene whose session is being started"""
        self.hands = BodyTools()
        self.messages = Messages()
        self.faults: tuple[str, ...] = ()
        self.on_new: Callable[[bool], object] = bool
        """Called when something else is on; with whether it is the same scene, for the camera to stay."""
        self._wishes = Preferences(engine, tuple(overrides))
        self._again: Callable[[], LiveView | RecordedView] | None = None
        self._tried: Path | None = None  # the file that was not opened after the present one, for its faults

    @property
    def live(self) -> LiveView | None:
        """What is on, where it can be changed."""
        return self.show if isinstance(self.show, LiveView) else None

    @property
    def game(self) -> BilliardsGame | None:
        """Who plays at the table, where one is on."""
        return self._seats.game

    @property
    def gestures(self) -> CueControls | None:
        """What a hand does at it."""
        return self._seats.gestures

    @property
    def engine(self) -> str:
        """The present engine's name."""
        return self.show.engine if self.show is not None else self._wishes.engine or USUAL

    @property
    def paused(self) -> bool:
        """Whether time stands still; a stored run that goes on at its end starts over."""
        return self._paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        if self._paused and not paused and isinstance(self.show, RecordedView) and self.show.at_end:
            self.show.scrub(self.show.begin)
        self._paused = paused

    def put_on(
        self,
        show: LiveView | RecordedView,
        path: Path | None,
        file: Scene,
        same: bool = False,
        again: Callable[[], LiveView | RecordedView] | None = None,
    ) -> None:
        """Show something, and let go of what was on.

        Args:
            show: what is on from now.
            path: its scene file.
            file: the scene as its file has it.
            same: it is the scene that was on.
            again: makes it anew for a restart, where scene and settings are not all of it, as of a recording.
        """
        self._seats.leave()
        self.host = host_of(show) if isinstance(show, LiveView) else None
        if self.show is not None:
            self.show.close()
        self.show, self.path, self.file = show, path, file
        if isinstance(show, RecordedView):
            self.reach = show.run.bounds
        elif again is not None and not same:
            self.reach = None
        self._again, self._tried = again, None
        self.hands.forget()
        self.faults, self.question, self._lost = (), None, None
        if not same:
            self.waits_for_start = again is None and self.host is not None and is_real_time(file.play.game)
        if isinstance(show, LiveView):
            # What rules and hands do next, no twin can tell.
            self._wishes.begin(show.company, trusting=len(show.bodies) <= FEW and self.host is None)
            self.compute(lambda: self._seats.take(show, file, self.messages.tell))
        self.on_new(same)

    def seat(self, players: Players) -> None:
        """Begin the game anew with other players."""
        self._seats.players = players
        self.restart()

    def open(self, path: Path, same: bool = False, engine: str | None = None) -> bool:
        """Open a scene file; one with faults is told, and what was on goes on. Return whether it was opened."""
        try:
            scene = load(path, self._wishes.overrides)
        except SceneError as error:
            # By the file's own name: its folders would take the place of what is wrong.
            self.faults = tuple(str(Fault(path.name, f.line, f.path, f.message)) for f in error.faults)
            return False
        return self._start(scene, path, scene, engine or self._wishes.engine or usual(scene), None, same)

    def _start(
        self, scene: Scene, path: Path | None, file: Scene, engine: str, settings: Settings | None, same: bool
    ) -> bool:
        self.opening = scene
        try:
            live = self.compute(lambda: create_session(scene, engine, settings, self.messages))
            if live is not None and not same:
                started = live
                self.reach = self.compute(lambda: predict_bounds(started.scene, started.engine, settings))
        finally:
            self.opening = None
        if live is not None:
            self.put_on(live, path, file, same)
        return live is not None

    def restart(self) -> None:
        """Start the same scene at 0, with what was turned, and with the same engine."""
        if isinstance(self.show, RecordedView):
            self.show.scrub(self.show.begin)
        elif self._again is not None and self.file is not None:
            self.put_on(self.compute(self._again), self.path, self.file, same=True, again=self._again)
        elif self.show is not None and self.file is not None:
            try:
                scene = self._wishes.as_turned(self.file)
            except SceneError as error:
                self.messages.tell(str(error), "error")
                return
            lost = self._recorded() if self.count_unsaved(restart=True) else self._lost
            self._start(scene, self.path, self.file, self.show.engine, self.show.session.wanted, same=True)
            self._lost = lost

    def count_unsaved(self, restart: bool = False) -> int:
        """Return how many hand-made changes would be lost; those of a game are its own.

        Args:
            restart: by a restart, which keeps the values that were set.
        """
        live = self.live
        if live is None or self.host is not None or self.game is not None:
            return 0
        kept = SetParameter if restart else ()
        actions = [action for action in live.session.unsaved if not isinstance(action, kept)]
        return count_changes(actions, live.scene.play.arrows)

    def bring_back(self) -> None:
        """Go back to the session as it was before a restart, or before something later was replaced."""
        live = self.live
        lost = self._lost
        if live is not None and live.session.replaced is not None:
            lost = live.session.replaced.recording
        if lost is None or live is None or self.file is None:
            self.messages.tell("there is nothing to restore", "warning")
            return
        known, present = lost, self._recorded() if self.count_unsaved() else None
        self.put_on(self.compute(lambda: session_of_recording(known)), self.path, self.file, same=True)
        self._lost = present
        again = "" if present is None else " (Ctrl+Z again: the later one)"
        self.messages.tell(f"previous session restored{again}")

    def _recorded(self) -> Recording | None:
        """Return the session as it is, whole; one that is being replayed is first played to where it is wanted."""
        live = self.live
        if live is None:
            return None
        if live.busy is not None:
            self.compute(live.arrive)
        return live.session.recording()

    def reload(self) -> None:
        """Read the scene's file again, and start it at 0."""
        if self.path is None or not isinstance(self.show, LiveView):
            self.messages.tell("there is no scene file to reload", "warning")
            return
        if self.open(self.path, same=True, engine=self.show.engine):
            self._wishes.turned.clear()
            self.messages.tell(f"{self.path.name} reloaded")

    def walk(self, by: int) -> None:
        """Open the scene file before or after the one that is on, or after the faulty one that was tried last."""
        path = neighbouring_scene(self._tried or self.path, by)
        if path is None:
            self.messages.tell("there is no other scene", "warning")
        elif self._tried is not None and self.path is not None and path.resolve() == self.path.resolve():
            self.faults, self._tried = (), None  # back to what is on: it goes on
        else:
            self.take(path)

    def take(self, path: Path) -> None:
        """Open another scene file."""
        if self.open(path):
            self._wishes.turned.clear()
        else:
            self._tried = path

    def toggle_ghost(self) -> None:
        """Begin a ghost from here, or end it."""
        if self.live is None:
            self._tell_why_not("has no ghost; replay it with --engine NAME")
            return
        company = self.live.company
        self.compute(lambda: self._wishes.toggle_ghost(company))

    def toggle_trust(self) -> None:
        """Begin to watch a twin from here, or end it."""
        if self.live is None:
            self._tell_why_not("has no predictability horizon; open its scene with `sandbox play`")
            return
        company = self.live.company
        self.compute(lambda: self._wishes.toggle_trust(company))

    def next_engine(self) -> None:
        """Go on with the next engine that can, from the same state; who cannot says why."""
        if not isinstance(self.show, LiveView):
            self._tell_why_not("cannot change its engine; replay it with --engine NAME")
            return
        names = list(ENGINES)
        here = names.index(self.show.engine)
        for name in names[here + 1 :] + names[:here]:
            if self.switch(name):
                return

    def switch(self, engine: str) -> bool:
        """Go on with an engine; return whether it could."""
        live = self.live
        if live is None or engine == live.engine:
            return False
        try:
            note = self.compute(lambda: live.switch(engine))
        except ActionError as error:
            self.messages.tell(str(error), "warning")
            return False
        self._wishes.engine = engine
        self.messages.tell(f"{engine}: {engine_named(engine).about}" + (f" ({note})" if note else ""))
        return True

    def turn(self, key: str, value: ParameterValue) -> None:
        """Turn a knob."""
        live = self.live
        if live is None:
            return
        if key == "engine":
            self.switch(str(value))
            return
        players = next((each for each in PLAYERS if each == value), None)
        if key == "players" and players is not None:
            self.seat(players)
            return
        if key == "misses":
            self._seats.misses = value == "on"
            self.restart()
            return

        def turn(live: LiveView) -> None:
            for action in turned(live, key, value, self.hands.picked_of(live)):
                live.act(action)
                if isinstance(action, SetParameter):
                    self._wishes.turn(action)

        self.act(turn)

    def _tell_why_not(self, what: str) -> None:
        """Say that what is on is no session."""
        self.messages.tell(f"a stored run {what}" if self.show is not None else "no scene is open", "warning")

    def act(self, deed: Callable[[LiveView], object]) -> bool:
        """Do something to what is on, and say so where it cannot be done; return whether it could."""
        live = self.live
        if live is None:
            self._tell_why_not("cannot be changed; open its scene with `sandbox play`")
            return False
        try:
            self.compute(lambda: deed(live))
        except ActionError as error:
            self.messages.tell(str(error), "warning")
            return False
        return True

    def go_on(self, elapsed: float) -> None:
        """Let real time pass, s."""
        show = self.show
        if show is None:
            return
        game, still = self.game, self._seats.waits and not self.hands.holding
        stands = self.paused or self.waits_for_start or self.covered or self.unfocused or still
        self.compute(lambda: show.go_on(elapsed, stands))
        if game is not None:
            self.act(lambda _: game.go_on(elapsed))
            self.messages.take(game.notes)
        if self.host is not None:
            self.messages.take(self.host.notes())
        if isinstance(show, LiveView) and show.wants_pause:
            self.paused, show.wants_pause = True, False
        elif isinstance(show, RecordedView) and show.at_end:
            self.paused = True
        self.messages.take(show.notes)

    def start_game(self) -> None:
        """Let the time of a real-time game begin."""
        self.waits_for_start = self.paused = False

    def toggle_pause(self) -> None:
        """Pause, or resume; a game that has not begun begins."""
        if self.waits_for_start:
            self.start_game()
        else:
            self.paused = not self.paused

    def step(self) -> None:
        """Make one step; a running scene pauses."""
        self.paused, self.waits_for_start = True, False
        if self.show is not None:
            self.compute(self.show.step)

    def back(self) -> None:
        """Go one step back; a running scene pauses."""
        self.paused, self.waits_for_start = True, False
        if self.show is not None:
            self.compute(self.show.back)

    def slower(self) -> None:
        """Go one rung slower."""
        if self.show is not None:
            self.show.pace.slower()

    def faster(self) -> None:
        """Go one rung faster."""
        if self.show is not None:
            self.show.pace.faster()

    def close(self) -> None:
        """Let go of what is on."""
        self._seats.leave()
        if self.show is not None:
            self.show.close()
            self.show = None
