"""Sessions without a window: replays of recordings, games played by a policy, episodes of an environment."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from sandbox.action import Switch, actions_from_json
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import UnknownEngineError, engine_named
from sandbox.frame_table import FrameTable
from sandbox.games.contract import Control, HasQuietSteps, Policy, Press
from sandbox.games.players import PlayerSpec
from sandbox.games.registry import required_rules
from sandbox.games.session import HeadlessGame, SteppedGame
from sandbox.measure.run.runner import run
from sandbox.progress import ProgressCallback
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings, SettingsChanges
from sandbox.scene.errors import Fault, SceneError, SettingsError
from sandbox.trajectory import Contacts, Frame, Trajectory


def read_session(path: str | Path) -> Recording:
    """Read a session, and check that the engines and settings of the session and of its `switch` actions exist.

    Raises:
        SceneError: the file cannot be read or is no session; or with every engine and setting that does not exist.
    """
    session = Recording.load(path)
    faults = []

    def check_engine(name: str, key: str) -> None:
        try:
            engine_named(name)
        except UnknownEngineError as error:
            faults.append(Fault(str(path), None, key, str(error)))

    check_engine(session.engine, "engine")
    for k, action in enumerate(session.actions):
        if not isinstance(action, Switch):
            continue
        if action.engine is not None:
            check_engine(action.engine, f"actions[{k}].engine")
        try:
            session.settings.replace(**action.settings)
        except SettingsError as error:
            for each in error.faults:
                key = each.path.replace("solver", "settings", 1)
                faults.append(Fault(str(path), None, f"actions[{k}].{key}", each.message))
    if faults:
        raise SceneError(faults)
    return session


def recorded_scene(recording: Recording) -> Scene:
    """Return the scene of a recording with its duration, and with its settings as `[solver]`.

    Settings that its engine chooses by itself are left out, so that other engines can run the scene.
    """
    scene, settings = recording.whole_scene, recording.settings
    common = settings.common()
    chosen = engine_named(recording.engine).resolve(scene, common)
    own = {key: value for key in Settings.model_fields if (value := getattr(settings, key)) != getattr(chosen, key)}
    return scene.model_copy(update={"solver": common.replace(**own)})


def rerun(
    recording: Recording, engine: str | None = None, *, audit: bool = True, on_progress: ProgressCallback | None = None
) -> Trajectory:
    """Run a session again.

    With its own engine and the same versions it ends in the same state, bit for bit: `info["state_hash"]` is that of
    the recording. Another engine computes the whole session, even if the session switched engines.

    The rules of a game are evaluated as well: `info["game"]` has their score, and in `otherwise` the first time, s, at
    which their actions differ from the recording. They do not differ on the same engine.

    Args:
        recording: the session.
        engine: name of another engine; default: the session's own.
        audit: count the contacts that the engine misses.
        on_progress: progress callback; its fraction is the completed part.

    Raises:
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.
        UnsuitableSceneError: the scene lacks an element that its game needs.
    """
    return run(recording, engine, audit=audit, on_progress=on_progress)


@dataclass(frozen=True, eq=False)
class PlayedGame:
    """Result of a game."""

    score: float
    """score at the end"""
    over: str | None
    """reason why the game ended; None if it lasted to the end of the scene's duration"""
    recording: Recording
    """all controls and actions; `measure.replay.rerun` reproduces score and state from it"""
    trajectory: Trajectory
    """recorded run with its contacts; its `status` is `ok` if the physics reached the end"""


def play_out(
    scene: Scene,
    player: Policy | str = "random",
    engine: str = "pymunk",
    *,
    audit: bool = False,
    on_progress: ProgressCallback | None = None,
    **settings: Unpack[SettingsChanges],
) -> PlayedGame:
    """Play the game of a scene until it is over, or for the scene's duration.

    Args:
        scene: scene with a game; its seed determines all random numbers, also those of the `random` player.
        player: `random`, `none`, the path of a script, or a policy.
        engine: name of the engine.
        audit: count the contacts that the engine misses.
        on_progress: progress callback; its fraction is the completed part.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnsuitableSceneError: the scene has no game with rules, or lacks an element that its game needs.
        SceneError: the script has faults.
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.

    Example:
        >>> played = sandbox.play_out(sandbox.load("landing"), "none")
        >>> played.recording.presses
        ()
    """
    rules = required_rules(scene)
    game = (
        PlayerSpec.parse(player).start_game(scene)
        if isinstance(player, str)
        else HeadlessGame(rules, player, type(player).__name__)
    )
    assert game is not None
    trajectory = run(scene, engine, audit=audit, on_progress=on_progress, bout=game, **settings)
    return PlayedGame(
        game.score, game.game_over, _recording(scene, engine, trajectory, game.presses, settings), trajectory
    )


def _recording(
    scene: Scene, engine: str, run: Trajectory, presses: tuple[Press, ...], settings: SettingsChanges
) -> Recording:
    return Recording(
        scene=scene,
        engine=engine,
        settings=scene.solver.replace(**settings) if settings else scene.solver,
        actions=actions_from_json(json.dumps(run.info["actions"])),
        duration=float(run.time[-1]) if len(run.time) else 0.0,
        state_hash=run.info["state_hash"],
        presses=presses,
        score=run.info["game"]["score"] if "game" in run.info else None,
    )


MAX_QUIET_STEPS = 64
"""Largest number of steps that an `Episode` makes at once."""


class Episode(SteppedGame):
    """Scene with a game that runs to the duration of the scene, for environments."""

    def __init__(self, scene: Scene, engine: str) -> None:
        """Start the scene and its game.

        Raises:
            UnsuitableSceneError: the scene has no game with rules, or lacks an element that its game needs.
            Refusal: the engine does not support the scene.
        """
        super().__init__(scene, engine, required_rules(scene))
        self._table = FrameTable(MAX_QUIET_STEPS, len(self.simulation.bodies))
        self._quiet_rules = self.rules if isinstance(self.rules, HasQuietSteps) else None
        self._levels = [0.0] * len(self.rules.controls)
        self._dt, self._duration = self.scene.solver.dt, self.scene.world.duration

    @property
    def late(self) -> bool:
        """Whether the duration of the scene is over."""
        return self.simulation.time >= self._duration - 0.5 * self._dt

    @property
    def ended(self) -> bool:
        """Whether the scene or the game is over."""
        return self.late or self.rules.game_over is not None

    def set_levels(self, levels: Sequence[float]) -> None:
        """Set each control to a level from 0 to 1; a digital control is on above one half.

        Raises:
            ActionError: an action of the game is invalid.
        """
        for k, (control, level) in enumerate(zip(self.rules.controls, levels, strict=True)):
            value = _value(control, level)
            if value != self._levels[k]:
                self._levels[k] = value
                self.set_control(control.name, value)

    def advance(self, steps: int) -> None:
        """Advance by a number of steps dt, or to the end, and apply the actions of the rules after each.

        Steps in which nothing happens that concerns the rules are made at once; see `HasQuietSteps`.

        Raises:
            Divergence, Exhaustion: the engine cannot continue.
            ActionError: an action of the rules is invalid.
        """
        while steps and not self.ended:
            quiet = 1
            if steps > 1 and self._quiet_rules is not None:
                quiet = self._quiet_rules.quiet_steps(self.simulation.settings.dt)
                quiet = min(quiet, self._steps_left, steps, MAX_QUIET_STEPS)
            if quiet > 1:
                steps -= self._advance_quietly(quiet)
            else:
                self.step()
                steps -= 1

    def _advance_quietly(self, steps: int) -> int:
        """Make at most so many steps, of which the rules see only the last, and the one before if something happens."""
        simulation, table, retired = self.simulation, self._table, len(self.simulation.retired)
        table.clear()
        self._frame = None
        try:
            simulation.advance(steps, table, until_event=True)
        except (Divergence, Exhaustion):
            if table.steps:
                self._show_quiet_step(table.frame(table.count - 1, self.frame().present))
            raise
        contacts = simulation.contacts()
        removed = [*simulation.retired][retired:]
        if table.steps > 1 and (len(contacts) or removed):
            present = self.frame().present.copy()
            present[removed] = True
            self._show_quiet_step(table.frame(table.count - 2, present))
        self._update_rules(contacts)
        return table.steps

    def _show_quiet_step(self, frame: Frame) -> None:
        """Pass a step without contacts to the rules, after others have followed it."""
        if self.session.on_step(frame.time, frame, Contacts.none()):
            raise RuntimeError(f"the rules of {self.scene.play.game!r} acted in a step announced as quiet")

    @property
    def _steps_left(self) -> int:
        """Number of steps to the duration of the scene."""
        return math.ceil((self._duration - self.simulation.time) / self._dt - 0.5)


def _value(control: Control, level: float) -> float:
    return level if control.analogue else float(level > 0.5)
