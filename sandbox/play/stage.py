"""Stage: what is on, where it came from, and all that can be asked of it; no pygame, so that it can be tried without.

Whatever fails is told as a message, and what was on goes on.
"""

from collections.abc import Callable, Iterable
from pathlib import Path

from sandbox.action import ActionError, SetParameter
from sandbox.engines.registry import ENGINES, USUAL, engine_named, usual
from sandbox.games.registry import is_real_time
from sandbox.play.billiards.game import PLAYERS, Game, Players
from sandbox.play.billiards.gestures import Gestures
from sandbox.play.billiards.seats import Seats
from sandbox.play.camera import Box
from sandbox.play.framing import look_ahead
from sandbox.play.hands import Hands, count_changes
from sandbox.play.hosting.host import Host, hosted
from sandbox.play.instruments.knob import Value
from sandbox.play.knobs import turned
from sandbox.play.messages import Messages
from sandbox.play.running.beginning import begun, played_again
from sandbox.play.running.live import Live
from sandbox.play.running.stored import Stored
from sandbox.play.shelf import neighbour
from sandbox.play.wishes import Wishes
from sandbox.play.worker import Compute, compute_here
from sandbox.recording import Recording
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import Override, load
from sandbox.scene.scene import Scene

FEW = 64
"""Bodies up to which a twin is watched from the beginning."""


class Stage:
    """What the window shows, and what is done to it."""

    def __init__(self, engine: str | None = None, overrides: Iterable[Override] = ()) -> None:
        """Start with nothing on.

        Args:
            engine: whose name is tried first for every scene, until another is chosen; by default the exact one
                for tables, and pymunk for all else.
            overrides: values set in every scene that is opened.
        """
        self.show: Live | Stored | None = None
        self.path: Path | None = None
        self.reach: Box | None = None
        """where the bodies come without a hand, m, as far as that is known"""
        self.file: Scene | None = None
        """the scene as its file has it"""
        self._seats = Seats()
        self.host: Host | None = None
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
        self.hands = Hands()
        self.messages = Messages()
        self.faults: tuple[str, ...] = ()
        self.on_new: Callable[[bool], object] = bool
        """Called when something else is on; with whether it is the same scene, for the camera to stay."""
        self._wishes = Wishes(engine, tuple(overrides))
        self._again: Callable[[], Live | Stored] | None = None
        self._tried: Path | None = None  # the file that was not opened after the present one, for its faults

    @property
    def live(self) -> Live | None:
        """What is on, where it can be changed."""
        return self.show if isinstance(self.show, Live) else None

    @property
    def game(self) -> Game | None:
        """Who plays at the table, where one is on."""
        return self._seats.game

    @property
    def gestures(self) -> Gestures | None:
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
        if self._paused and not paused and isinstance(self.show, Stored) and self.show.at_end:
            self.show.scrub(self.show.begin)
        self._paused = paused

    def put_on(
        self,
        show: Live | Stored,
        path: Path | None,
        file: Scene,
        same: bool = False,
        again: Callable[[], Live | Stored] | None = None,
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
        self.host = hosted(show) if isinstance(show, Live) else None
        if self.show is not None:
            self.show.close()
        self.show, self.path, self.file = show, path, file
        if isinstance(show, Stored):
            self.reach = show.film.box
        elif again is not None and not same:
            self.reach = None
        self._again, self._tried = again, None
        self.hands.forget()
        self.faults, self.question, self._lost = (), None, None
        if not same:
            self.waits_for_start = again is None and self.host is not None and is_real_time(file.play.game)
        if isinstance(show, Live):
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
            live = self.compute(lambda: begun(scene, engine, settings, self.messages))
            if live is not None and not same:
                started = live
                self.reach = self.compute(lambda: look_ahead(started.scene, started.engine, settings))
        finally:
            self.opening = None
        if live is not None:
            self.put_on(live, path, file, same)
        return live is not None

    def restart(self) -> None:
        """Start the same scene at 0, with what was turned, and with the same engine."""
        if isinstance(self.show, Stored):
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
        self.put_on(self.compute(lambda: played_again(known)), self.path, self.file, same=True)
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
        if self.path is None or not isinstance(self.show, Live):
            self.messages.tell("there is no scene file to reload", "warning")
            return
        if self.open(self.path, same=True, engine=self.show.engine):
            self._wishes.turned.clear()
            self.messages.tell(f"{self.path.name} reloaded")

    def walk(self, by: int) -> None:
        """Open the scene file before or after the one that is on, or after the faulty one that was tried last."""
        path = neighbour(self._tried or self.path, by)
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
        if not isinstance(self.show, Live):
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

    def turn(self, key: str, value: Value) -> None:
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

        def turn(live: Live) -> None:
            for action in turned(live, key, value, self.hands.picked_of(live)):
                live.act(action)
                if isinstance(action, SetParameter):
                    self._wishes.turn(action)

        self.act(turn)

    def _tell_why_not(self, what: str) -> None:
        """Say that what is on is no session."""
        self.messages.tell(f"a stored run {what}" if self.show is not None else "no scene is open", "warning")

    def act(self, deed: Callable[[Live], object]) -> bool:
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
        if isinstance(show, Live) and show.wants_pause:
            self.paused, show.wants_pause = True, False
        elif isinstance(show, Stored) and show.at_end:
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
