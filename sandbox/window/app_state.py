"""Application state: the open scene or stored run, its game, pause, engine and preferences. No drawing.

A failed operation adds a message and leaves the open scene unchanged.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, Concatenate, ParamSpec

from sandbox.action import ActionError, SetParameter
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES, USUAL, able, engine_named, usual
from sandbox.games.contract import UnsuitableSceneError
from sandbox.games.registry import is_real_time, rules_in_window, scene_in_window
from sandbox.games.session import GameSession
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import Override, from_document, load
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.step_clock import speed_for
from sandbox.window.camera import ViewBox
from sandbox.window.game_controls import GameControls
from sandbox.window.game_host import GameHost, controls_of, host_of
from sandbox.window.input.bindings import NO_BINDINGS, KeyBindings, KeyHandler, key_bindings
from sandbox.window.input.body_tools import BodyTools, count_changes
from sandbox.window.playback.diagnostics import GHOST_ENGINES, Diagnostics
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import ParameterValue, parameter_actions
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.session import Session
from sandbox.window.view_bounds import predict_bounds
from sandbox.window.warm_up import warm_up
from sandbox.window.worker import Compute, compute_here

P = ParamSpec("P")

MAX_TWIN_BODIES = 64
"""Number of bodies up to which a scene starts with the divergence monitor on."""


def scenes_beside(path: Path | None) -> tuple[Path, ...]:
    """Return the scene files in the folder of a file; without a file, the shipped scenes."""
    if path is None:
        return tuple(scene.path for scene in shipped())
    try:
        found = sorted(path.parent.glob("*.toml"))
    except OSError:  # the folder is gone or unreadable: the open scene can still be played
        found = []
    known = {file.resolve() for file in found}
    return tuple(found) if path.resolve() in known else (path, *found)


def neighbouring_scene(path: Path | None, offset: int) -> Path | None:
    """Return the scene file `by` positions further, cyclically; None if there are no scene files."""
    files = scenes_beside(path)
    if not files:
        return None
    if path is None:
        return files[0 if offset > 0 else -1]
    index = next((k for k, file in enumerate(files) if file.resolve() == path.resolve()), 0)
    return files[(index + offset) % len(files)]


def scenes_to_pick(path: Path | None) -> list[tuple[str, Path]]:
    """Return (name, file) of the scenes in the folder of the open one, then of the shipped scenes."""
    own_scenes = [(scene.name, scene.path) for scene in shipped()]
    known = {file.resolve() for _, file in own_scenes}
    others = [file for file in (scenes_beside(path) if path is not None else ()) if file.resolve() not in known]
    return [*((f"{file.parent.resolve().name}/{file.stem}", file) for file in others), *own_scenes]


MESSAGE_DURATION = {"info": 3.0, "warning": 6.0, "error": 10.0}
"""s that a message is shown, by its level"""
MAX_MESSAGES = 5


class Messages:
    """The messages of the last seconds, newest last."""

    def __init__(self) -> None:
        self._messages: list[tuple[float, str, str]] = []

    def add(self, text: str, level: str = "info") -> None:
        """Add a message; a repeated one is shown for longer instead."""
        until = perf_counter() + MESSAGE_DURATION[level]
        self._messages = [each for each in self._messages if each[1:] != (level, text)]
        self._messages = [*self._messages, (until, level, text)][-MAX_MESSAGES:]

    def extend(self, notes: list[tuple[str, str]]) -> None:
        """Add notes, (level, text), and clear the list."""
        for level, text in notes:
            self.add(text, level)
        notes.clear()

    def visible(self) -> tuple[tuple[str, str], ...]:
        """Return (level, text) of the messages that have not expired."""
        now = perf_counter()
        self._messages = [each for each in self._messages if each[0] > now]
        return tuple((level, text) for _, level, text in self._messages)


@dataclass
class Preferences:
    """Preferences that persist across scenes, and parameters of the open scene that persist across restarts."""

    engine: str | None
    """preferred engine; a session uses another one if it does not support the scene"""
    overrides: tuple[Override, ...]
    """values set in every scene that is opened"""
    ghosted: bool = False
    speed: float | None = None
    """playback speed of every scene, as a multiple of real time; None for that of the scene"""
    trusting: bool | None = None
    """None if the user has not chosen"""
    parameters: dict[str, Any] = field(default_factory=dict)
    """parameter values of the open scene by path"""

    def apply(self, diagnostics: Diagnostics, trusting: bool) -> None:
        """Apply the ghost and twin preferences to a new session; `trusting` is the default of the twin."""
        diagnostics.watch_divergence(trusting if self.trusting is None else self.trusting)
        if self.ghosted and not diagnostics.has_ghost:
            diagnostics.show_ghost(True)

    def initial_speed(self, view: LiveView | RecordedView, file: Scene) -> float:
        """Return the playback speed at which a view of a scene starts.

        Args:
            view: the view.
            file: its scene as read from its file.
        """
        if (speed := self.speed or file.play.speed) is not None:
            return speed
        if isinstance(view, RecordedView):
            return speed_for(view.end_time - view.start_time)
        has_keys = file.drives or file.thrusts or any(tyre.keys for tyre in file.tyres)
        has_controls = file.play.game or file.play.arrows or file.play.relaunch or has_keys
        return 1.0 if has_controls else speed_for(file.world.duration)

    def toggle_ghost(self, diagnostics: Diagnostics) -> None:
        """Start or stop the ghost, also for later scenes."""
        self.ghosted = not diagnostics.has_ghost
        diagnostics.show_ghost(self.ghosted)

    def toggle_trust(self, diagnostics: Diagnostics) -> None:
        """Start or stop the perturbed twin, also for later scenes."""
        self.trusting = diagnostics.divergence is None
        diagnostics.watch_divergence(self.trusting)

    def store_parameter(self, action: SetParameter) -> None:
        """Store a parameter value for restarts."""
        self.parameters.pop(action.path, None)  # re-inserted, as the latest value is applied last
        self.parameters[action.path] = action.value

    def with_parameters(self, file: Scene) -> Scene:
        """Return the scene of a file with the stored parameter values.

        Raises:
            SceneError: the values contradict each other.
        """
        return from_document(to_document(file), "<scene>", self.parameters.items())


def session_of_recording(recording: Recording) -> LiveView:
    """Return a session that has replayed a recording and continues from its end."""
    try:
        rules = rules_in_window(recording.scene)
    except UnsuitableSceneError:  # the session was played without the rules, too
        rules = None
    game = None if rules is None else GameSession(rules, recording.presses)
    session = Session.of_recording(recording, game)
    session.log.saved = ()
    live = LiveView(session)
    live.seek(round(recording.duration / session.settings.dt))
    return live


def create_session(scene: Scene, engine: str, settings: Settings | None, messages: Messages) -> LiveView | None:
    """Return a new session of a scene, including its game if it suits the rules; None if no engine supports the scene.

    Args:
        scene: as read from its file.
        engine: preferred engine; if it does not support the scene, another one is used, with a warning.
        settings: solver settings; None for those of the scene.
        messages: receives warnings and errors.
    """
    game: GameSession | None = None
    try:
        scene = scene_in_window(scene)
        rules = rules_in_window(scene)
        game = None if rules is None else GameSession(rules)
    except UnsuitableSceneError as error:
        messages.add(str(error), "warning")
    try:
        return LiveView(Session(scene, engine, settings, game=game))
    except Refusal as refusal:
        others = able(scene)
        if not others:
            messages.add(str(refusal), "error")
            return None
        messages.add(f"{refusal}; opened with {others[0]}", "warning")
        return LiveView(Session(scene, others[0], game=game))


class AppState:
    """The open scene or stored run, and the operations on it."""

    def __init__(
        self, engine: str | None = None, overrides: Iterable[Override] = (), speed: float | None = None
    ) -> None:
        """Start without a scene.

        Args:
            engine: preferred engine of all scenes; by default `exact` for tables and `pymunk` for all other scenes.
            overrides: values set in every scene that is opened.
            speed: playback speed at which every scene starts; by default that of the scene.
        """
        self.view: LiveView | RecordedView | None = None
        self.path: Path | None = None
        self.reach: ViewBox | None = None
        """bounds of the predicted motion without user input, m; None if unknown"""
        self.file: Scene | None = None
        """the scene as read from its file"""
        self.host: GameHost | None = None
        """host of the scene's game, if any"""
        self.controls: GameControls | None = None
        """controls of a game that has more than keys, if any"""
        self._game_options: dict[str, str] = {}
        """chosen values of the parameters of game controls, by key; they persist across scenes"""
        self.key_bindings: KeyBindings = NO_BINDINGS
        """keys bound by the scene and its game"""
        self._paused = False
        self.waits_for_start = False
        """whether a real-time game waits for its start"""
        self.covered = False
        """whether help, the scene browser or a question covers the scene, which pauses it"""
        self.unfocused = False
        """whether another window has the keyboard focus, which pauses the scene"""
        self.compute: Compute = compute_here
        """runner of jobs that may compile kernels; the window uses a worker thread"""
        self.on_part: Callable[[str], None] = lambda _: None
        """callback that receives the description of each part of a warm-up"""
        self.question: str | None = None
        """question asked before manual changes are lost"""
        self.has_unsaved_draft = False
        """whether the scene was edited and is not saved"""
        self.saves_at_end = False
        """whether the session is saved when the window closes"""
        self._lost: Recording | None = None  # restored by Ctrl+Z
        self.opening: Scene | None = None
        """scene whose session is being started"""
        self.opens_same = False
        """whether it is the shown scene, restarted or edited"""
        self.body_tools = BodyTools()
        self.messages = Messages()
        self.faults: tuple[str, ...] = ()
        self.on_scene_changed: Callable[[bool], None] | None = None
        """callback after a change of the view; its argument is whether the new view is of the same scene"""
        self._preferences = Preferences(engine, tuple(overrides), speed=speed)
        self._again: Callable[[], LiveView | RecordedView] | None = None
        self._tried: Path | None = None  # faulty file that was tried after the open one

    @property
    def live(self) -> LiveView | None:
        """The interactive session; None if a stored run or nothing is shown."""
        return self.view if isinstance(self.view, LiveView) else None

    @property
    def engine(self) -> str:
        """Name of the present engine."""
        return self.view.engine if self.view is not None else self._preferences.engine or USUAL

    @property
    def paused(self) -> bool:
        """Whether the user has paused; resuming a stored run at its end restarts it."""
        return self._paused

    @paused.setter
    def paused(self, paused: bool) -> None:
        if self._paused and not paused and isinstance(self.view, RecordedView) and self.view.at_end:
            self.view.scrub(self.view.start_time)
        self._paused = paused

    def show(
        self,
        view: LiveView | RecordedView,
        path: Path | None,
        file: Scene,
        same: bool = False,
        again: Callable[[], LiveView | RecordedView] | None = None,
    ) -> None:
        """Replace the present view by a session or a stored run.

        Args:
            view: the session or run.
            path: its scene file.
            file: the scene as read from its file.
            same: whether the view is of the open scene.
            again: creates the view again for a restart, if scene and settings do not suffice, as for a recording.
        """
        self._close_controls()
        self.host = host = host_of(view) if isinstance(view, LiveView) else None
        if self.view is not None:
            self.view.close()
        self.view, self.path, self.file = view, path, file
        view.clock.speed = self._preferences.initial_speed(view, file)
        if isinstance(view, RecordedView):
            self.reach = view.run.bounds
        elif again is not None and not same:
            self.reach = None
        self._again, self._tried = again, None
        self.body_tools.reset()
        self.faults, self.question, self._lost = (), None, None
        if not same:
            self.waits_for_start = again is None and self.host is not None and is_real_time(file.play.game)
        self.key_bindings = NO_BINDINGS
        if isinstance(view, LiveView):
            # A twin cannot predict the next input of rules and players, unless time waits for it.
            is_free = host is None or host.can_wait
            self._preferences.apply(view.diagnostics, trusting=len(view.bodies) <= MAX_TWIN_BODIES and is_free)
            if host is not None:
                self.controls = self.compute(lambda: controls_of(host, file, self._game_options))
            self.key_bindings = key_bindings(view, self.body_tools, host, self.controls)
        if self.on_scene_changed is not None:
            self.on_scene_changed(same)

    def _close_controls(self) -> None:
        if self.controls is not None:
            self.controls.close()
            self.controls = None

    def open(self, path: Path, same: bool = False, engine: str | None = None) -> bool:
        """Open a scene file; return whether that succeeded. Faults of the file are stored in `faults`."""
        try:
            scene = load(path, self._preferences.overrides)
        except SceneError as error:
            # Without its folders, the file name leaves space for the fault.
            self.faults = tuple(str(Fault(path.name, f.line, f.path, f.message)) for f in error.faults)
            return False
        return self._start(scene, path, scene, engine or self._preferences.engine or usual(scene), None, same)

    def _start(
        self, scene: Scene, path: Path | None, file: Scene, engine: str, settings: Settings | None, same: bool
    ) -> bool:
        def job() -> LiveView | None:  # one job, so that there is one wait for all that must be compiled
            self._warm_up(scene, engine, settings)
            live = create_session(scene, engine, settings, self.messages)
            if live is not None and not same:
                self.reach = predict_bounds(live.scene, live.engine, settings)
            return live

        self.opening, self.opens_same = scene, same
        try:
            live = self.compute(job)
        finally:
            self.opening = None
        if live is not None:
            self.show(live, path, file, same)
        return live is not None

    def _warm_up(self, scene: Scene, engine: str, settings: Settings | None, *, ghost: bool | None = None) -> None:
        """Compile what playing a scene needs: the engine, and the one of its ghost if that is on."""
        try:
            scene = scene_in_window(scene)
        except UnsuitableSceneError:
            return
        warm_up(scene, engine, settings, self.on_part)
        if self._preferences.ghosted if ghost is None else ghost:
            wanted = (scene.solver if settings is None else settings).common()
            names = (name for name in GHOST_ENGINES if name != engine and not engine_named(name).missing(scene, wanted))
            if (name := next(names, None)) is not None:
                warm_up(scene, name, wanted, self.on_part)

    def play_draft(self, scene: Scene, path: Path | None) -> bool:
        """Start a scene that was edited; return whether an engine can run it. The camera stays."""
        self._preferences.parameters.clear()
        preferred = self.view.engine if self.view is not None else self._preferences.engine
        return self._start(scene, path, scene, preferred or usual(scene), None, same=self.view is not None)

    def restart(self) -> None:
        """Restart the scene at time 0 with the same engine and the parameters set by the user."""
        if isinstance(self.view, RecordedView):
            self.view.scrub(self.view.start_time)
        elif self._again is not None and self.file is not None:
            self.show(self.compute(self._again), self.path, self.file, same=True, again=self._again)
        elif self.view is not None and self.file is not None:
            try:
                scene = self._preferences.with_parameters(self.file)
            except SceneError as error:
                self.messages.add(str(error), "error")
                return
            lost = self._current_recording() if self.count_unsaved(restart=True) else self._lost
            self._start(scene, self.path, self.file, self.view.engine, self.view.session.simulation.wanted, same=True)
            self._lost = lost

    def count_unsaved(self, restart: bool = False) -> int:
        """Return the number of manual changes that would be lost; 0 for games.

        Args:
            restart: count only those that a restart loses; it keeps parameters.
        """
        live = self.live
        if live is None or self.host is not None:
            return 0
        kept = SetParameter if restart else ()
        actions = [action for action in live.session.log.unsaved if not isinstance(action, kept)]
        return count_changes(actions, live.scene.play.arrows)

    def restore_session(self) -> None:
        """Restore the session as it was before a restart, or before an action in its past discarded its future."""
        live = self.live
        lost = self._lost
        if live is not None and live.session.replaced is not None:
            lost = live.session.replaced.recording
        if lost is None or live is None or self.file is None:
            self.messages.add("there is nothing to restore", "warning")
            return
        known, present = lost, self._current_recording() if self.count_unsaved() else None
        self.show(self.compute(lambda: session_of_recording(known)), self.path, self.file, same=True)
        self._lost = present
        again = "" if present is None else " (Ctrl+Z again: the later one)"
        self.messages.add(f"previous session restored{again}")

    def _current_recording(self) -> Recording | None:
        """Return the recording of the session, after finishing a pending seek."""
        live = self.live
        if live is None:
            return None
        if live.busy is not None:
            self.compute(live.finish_seek)
        return live.session.recording()

    def reload(self) -> None:
        """Read the scene file again and start the scene at time 0."""
        if self.path is None or not isinstance(self.view, LiveView):
            self.messages.add("there is no scene file to reload", "warning")
            return
        if self.open(self.path, same=True, engine=self.view.engine):
            self._preferences.parameters.clear()
            self.messages.add(f"{self.path.name} reloaded")

    def open_neighbour(self, by: int) -> None:
        """Open the scene file `by` positions after the open one, or after the faulty one tried last."""
        path = neighbouring_scene(self._tried or self.path, by)
        if path is None:
            self.messages.add("there is no other scene", "warning")
        elif self._tried is not None and self.path is not None and path.resolve() == self.path.resolve():
            self.faults, self._tried = (), None  # back at the open scene
        else:
            self.open_other(path)

    def open_other(self, path: Path) -> None:
        """Open another scene file and discard the parameters set by the user."""
        if self.open(path):
            self._preferences.parameters.clear()
        else:
            self._tried = path

    def toggle_ghost(self) -> None:
        """Start the ghost at the present time, or stop it."""
        if self.live is None:
            self._warn_no_session("has no ghost; replay it with --engine NAME")
            return
        diagnostics = self.live.diagnostics
        live = self.live

        def job() -> None:
            if not diagnostics.has_ghost:
                self._warm_up(live.scene, live.engine, live.session.simulation.wanted, ghost=True)
            self._preferences.toggle_ghost(diagnostics)

        self.compute(job)

    def toggle_trust(self) -> None:
        """Start the divergence monitor at the present time, or stop it."""
        if self.live is None:
            self._warn_no_session("has no predictability horizon; open its scene with `sandbox play`")
            return
        diagnostics = self.live.diagnostics
        self.compute(lambda: self._preferences.toggle_trust(diagnostics))

    def switch_to_next_engine(self) -> None:
        """Switch to the next engine that supports the scene; each skipped engine adds its reason as a warning."""
        if not isinstance(self.view, LiveView):
            self._warn_no_session("cannot change its engine; replay it with --engine NAME")
            return
        names = list(ENGINES)
        index = names.index(self.view.engine)
        for name in names[index + 1 :] + names[:index]:
            if self.switch_engine(name):
                return

    def switch_engine(self, engine: str) -> bool:
        """Continue on another engine from the present state; return whether that succeeded."""
        live = self.live
        if live is None or engine == live.engine:
            return False

        def job() -> str | None:
            if engine in ENGINES:
                self._warm_up(live.scene, engine, live.session.simulation.wanted.common())
            return live.switch_engine(engine)

        try:
            note = self.compute(job)
        except ActionError as error:
            self.messages.add(str(error), "warning")
            return False
        self._preferences.engine = engine
        self.messages.add(f"{engine}: {engine_named(engine).about}" + (f" ({note})" if note else ""))
        return True

    def set_parameter(self, key: str, value: ParameterValue) -> None:
        """Set a parameter of the session by its key."""
        live = self.live
        if live is None:
            return
        if key == "engine":
            self.switch_engine(str(value))
            return
        if self.controls is not None and any(each.key == key for each in self.controls.parameters()):
            self._game_options[key] = str(value)
            self.restart()
            return

        def apply() -> None:
            for action in parameter_actions(live, key, value, self.body_tools.picked_index(live)):
                live.apply(action)
                if isinstance(action, SetParameter):
                    self._preferences.store_parameter(action)

        self.run_handler(apply)

    def _warn_no_session(self, what: str) -> None:
        """Add a warning that a stored run, or no scene, is open."""
        self.messages.add(f"a stored run {what}" if self.view is not None else "no scene is open", "warning")

    def run_handler(self, handler: KeyHandler) -> bool:
        """Run a handler that acts on the session; return whether it succeeded. A refused action adds a warning."""
        if self.live is None:
            self._warn_no_session("cannot be changed; open its scene with `sandbox play`")
            return False
        try:
            self.compute(handler)
        except ActionError as error:
            self.messages.add(str(error), "warning")
            return False
        return True

    def use_tool(self, tool: Callable[Concatenate[LiveView, P], object], *args: P.args, **kwargs: P.kwargs) -> bool:
        """Run a tool of `body_tools` on the session, like `run_handler`."""
        live = self.live
        return self.run_handler(lambda: tool(live, *args, **kwargs) if live is not None else None)

    def update(self, elapsed: float) -> None:
        """Advance the session by an interval of real time, s, unless it is paused."""
        view = self.view
        if view is None:
            return
        held = self.host is not None and self.host.waiting  # time stops until the player acts
        halted = self.paused or self.waits_for_start or self.covered or self.unfocused or held
        self.compute(lambda: view.update(elapsed, halted))
        controls = self.controls
        if controls is not None:
            self.run_handler(lambda: controls.update(elapsed))
            self.messages.extend(controls.messages())
        if self.host is not None:  # the log of a game with a display of its own is shown there
            self.messages.extend(self.host.messages(with_log=controls is None))
        if isinstance(view, LiveView) and view.wants_pause:
            self.paused, view.wants_pause = True, False
        elif isinstance(view, RecordedView) and view.at_end:
            self.paused = True
        self.messages.extend(view.notifications)

    def start_game(self) -> None:
        """Start the clock of a real-time game."""
        self.waits_for_start = self.paused = False

    def toggle_pause(self) -> None:
        """Pause or resume; start a game that waits for its start."""
        if self.waits_for_start:
            self.start_game()
        else:
            self.paused = not self.paused

    def step(self) -> None:
        """Pause and advance by one step."""
        self.paused, self.waits_for_start = True, False
        if self.view is not None:
            self.compute(self.view.step)

    def step_back(self) -> None:
        """Pause and go back by one step."""
        self.paused, self.waits_for_start = True, False
        if self.view is not None:
            self.compute(self.view.step_back)

    def slower(self) -> None:
        """Select the next slower playback speed."""
        if self.view is not None:
            self.view.clock.slower()

    def faster(self) -> None:
        """Select the next faster playback speed."""
        if self.view is not None:
            self.view.clock.faster()

    def close(self) -> None:
        """Close the session or run."""
        self._close_controls()
        if self.view is not None:
            self.view.close()
            self.view = None
