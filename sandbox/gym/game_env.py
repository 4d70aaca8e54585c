"""Gymnasium environment of a game: its controls are the actions, the increase of its score is the reward."""

import math
import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from sandbox.action import ActionError
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import able, engine_named
from sandbox.games.contract import HasObservation, HasPlayers, Rules
from sandbox.games.registry import required_rules
from sandbox.measure.run.sessions import Episode
from sandbox.measure.seeds import with_seed
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import World
from sandbox.scene.files.load import as_scene

LIMIT = 1e6
"""bound to which observed numbers are clipped: learning algorithms expect bounded spaces"""
STATES = "x", "y", "vx", "vy", "angle", "ω", "present"
"""observed state of a body, in m, m/s, rad and rad/s; `present` is 1, or 0 after removal"""
SIZE = 640, 480
"""px, size of a rendered picture"""
SEEDS = 2**31
"""random seeds are below this number"""

Observation = np.ndarray[tuple[int], np.dtype[np.float32]]


class SandboxEnv(gymnasium.Env[Observation, Any]):
    """Gymnasium environment of a game.

    Observation: x, y, vx, vy, angle, ω and presence of each observed body; then the observation of the rules (such as
    fuel, wind, or the setting of a gun), the time in s, and the score. `observed` has the name of each number. Numbers
    are clipped to ±1e6; the bounds of presence and time are closer.

    Action: one number for each control. If a control is analogue, the space is a `Box` from 0 to 1; other controls are
    then on above 0.5, and values out of range are clipped. Otherwise the space is a `MultiDiscrete` of 0 and 1.

    Reward: increase of the score. In games of several players, `info["scores"]` has the score of each player by name,
    and `info["player"]` the one whose turn it is. An episode is terminated when the game is over. It is truncated at
    its `duration`, or if the physics fails; `info["failed"]` then has the reason.

    An environment can be pickled and copied before its first episode. During an episode it can be copied
    (`copy.deepcopy`) on engines that make snapshots, `reference` and `exact`; the copy continues alike, bit for bit.

    Args:
        scene: scene, path of a scene file, or name of a shipped scene.
        engine: name of the engine.
        bodies: names of the observed bodies; default: all bodies that are not fixed.
        every: number of steps per action.
        render_mode: None, or `rgb_array`.
        duration: longest simulated time of an episode, s; default: the duration of the scene.

    Raises:
        SceneError: the file has faults, or no file and no shipped scene has that name.
        UnsuitableSceneError: the scene has no game with rules, or lacks an element that its game needs.
        Refusal: the engine does not support the scene.
        ValueError: an engine, body or render mode does not exist, `every` is not an integer of at least 1, or the
            duration is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012, as the base has it

    def __init__(
        self,
        scene: Scene | str | Path,
        engine: str = "pymunk",
        bodies: Sequence[str] | None = None,
        every: int = 1,
        render_mode: str | None = None,
        duration: float | None = None,
    ) -> None:
        """Create an environment; `reset` begins an episode."""
        self.scene = as_scene(scene)
        if duration is not None:
            self.scene = self.scene.with_duration(_checked_duration(duration))
        self.engine, self.every, self.render_mode = engine, _steps_per_action(every), render_mode
        rules = required_rules(self.scene)
        self.controls = rules.controls
        missing = engine_named(engine).missing(self.scene, self.scene.solver)
        if missing:
            raise Refusal(engine, missing, able(self.scene))
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"unknown render mode {render_mode!r}; use 'rgb_array'")
        self.observed_bodies = np.asarray(_body_indices(self.scene, bodies), np.int64)
        """indices of the observed bodies"""
        self._has_observation, self._has_players = isinstance(rules, HasObservation), isinstance(rules, HasPlayers)
        states = [
            f"{self.scene.bodies.names[index]} {state}" for index in self.observed_bodies.tolist() for state in STATES
        ]
        self.observed: tuple[str, ...] = (*states, *(name for name, _ in _rules_observation(rules)), "time", "score")
        """name of each number of an observation"""
        count = len(self.controls)
        self.analogue = any(control.analogue for control in self.controls)
        self.action_space = (
            spaces.Box(0.0, 1.0, (count,), np.float32) if self.analogue else spaces.MultiDiscrete([2] * count)
        )
        self.observation_space = spaces.Box(*self._bounds(), dtype=np.float32)
        self.metadata = self.metadata | {"render_fps": max(round(1.0 / (self.scene.solver.dt * every)), 1)}
        self._episode: Episode | None = None
        self._ended = False
        self._canvas: Any = None

    def _bounds(self) -> tuple[Observation, Observation]:
        """Return the lower and upper bounds of an observation."""
        upper = np.full(len(self.observed), LIMIT, np.float32)
        lower, presence = -upper, len(STATES) - 1
        states = slice(presence, len(STATES) * len(self.observed_bodies), len(STATES))
        lower[states], upper[states] = 0.0, 1.0
        last = self.scene.world.duration + self.every * self.scene.solver.dt  # an episode ends with a whole action
        lower[-2], upper[-2] = 0.0, min(last, LIMIT)
        return lower, upper

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: seed of the scene. Without it, the first episode has the seed of the scene file, and each later one a
                new random seed.
            options: not supported.

        Returns:
            The first observation, and the info dict.

        Raises:
            ValueError: options are given.
        """
        refuse_options(options)
        first = self._np_random is None
        super().reset(seed=self.scene.world.seed if seed is None and first else seed)
        number = seed if seed is not None else self.scene.world.seed if first else int(self.np_random.integers(SEEDS))
        self._release()
        self._episode, self._ended = Episode(with_seed(self.scene, number), self.engine), False
        return self._observation(), self._info()

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Set the controls and advance by `every` steps, or to the end of the episode.

        Args:
            action: one number for each control.

        Returns:
            Observation, reward, terminated, truncated, and the info dict.

        Raises:
            ValueError: the action does not have one valid number for each control. The environment is left unchanged.
            ResetNeeded: no episode has begun, or the episode has ended.
        """
        episode = self._current_episode()
        if self._ended:
            raise gymnasium.error.ResetNeeded("the episode has ended; call reset before the next step")
        levels = self._levels_of(action)
        before, failed = episode.rules.score, None
        try:
            episode.set_levels(levels)
            episode.advance(self.every)
        except (Divergence, Exhaustion, ActionError) as error:
            failed = str(error)
        info = self._info() | ({} if failed is None else {"failed": failed})
        over = episode.rules.game_over is not None
        late = not over and (episode.late or failed is not None)
        self._ended = over or late
        return self._observation(), float(episode.rules.score - before), over, late, info

    def _current_episode(self) -> Episode:
        """Return the episode.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._episode is None:
            raise gymnasium.error.ResetNeeded("call reset before step, render or recording")
        return self._episode

    def _levels_of(self, action: Any) -> list[float]:
        """Return the value of each control in an action, 0 to 1.

        Raises:
            ValueError: the action does not have one valid number for each control.
        """
        try:
            levels = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            levels = np.empty(0)
        found: list[float] | None = levels.tolist() if levels.shape == (len(self.controls),) else None
        is_valid = math.isfinite if self.analogue else (0.0, 1.0).__contains__
        if found is None or not all(map(is_valid, found)):
            names, each = ", ".join(control.name for control in self.controls), "0 to 1" if self.analogue else "0 or 1"
            raise ValueError(f"an action is {len(self.controls)} numbers, {each}, for {names}; not {action!r}")
        return [min(max(level, 0.0), 1.0) for level in found]

    def _observation(self) -> Observation:
        episode = self._current_episode()
        frame, some = episode.frame(), self.observed_bodies
        values = np.empty(len(self.observed))
        states = values[: len(STATES) * len(some)].reshape(len(some), len(STATES))
        states[:, 0:2], states[:, 2:4] = frame.position[some], frame.velocity[some]
        states[:, 4], states[:, 5] = frame.angle[some], frame.angular_velocity[some]
        states[:, 6] = frame.present[some]
        rules: Any = episode.rules
        numbers = [value for _, value in rules.observation()] if self._has_observation else []
        values[states.size :] = [*numbers, episode.time, rules.score]
        return bounded(values)

    def _info(self) -> dict[str, Any]:
        episode = self._current_episode()
        rules: Any = episode.rules
        info: dict[str, Any] = {
            "time": episode.time,
            "score": rules.score,
            "over": rules.game_over,
            "seed": episode.scene.world.seed,
        }
        if self._has_players:
            info |= {"player": rules.player, "scores": dict(rules.scores)}
        return info

    def display_lines(self) -> dict[str, str]:
        """Return the lines of the score panel, texts by label."""
        return dict(self._current_episode().rules.display_lines())

    def recording(self) -> Recording:
        """Return the episode so far as a recording, for `sandbox replay`."""
        return self._current_episode().recording()

    def render(self) -> Any:
        """Return a picture, (height, width, 3) from 0 to 255; None without a render mode."""
        if self.render_mode is None:
            return None
        episode = self._current_episode()
        if self._canvas is None:
            from sandbox.window.render.renderer import OffscreenRenderer  # pygame is needed only to render

            self._canvas = OffscreenRenderer(SIZE)
        relay = episode.simulation
        return self._canvas.picture(relay.scene, relay.bodies, episode.frame(), episode.rules, relay.throttles)

    def close(self) -> None:
        """Release the engine and the canvas."""
        self._release()
        self._canvas = None

    def _release(self) -> None:
        if self._episode is not None:
            self._episode.close()
        self._episode = None


def refuse_options(options: Mapping[str, Any] | None) -> None:
    """Refuse options of `reset` that do not exist.

    Raises:
        ValueError: there are some.
    """
    if options:
        raise ValueError(f"reset accepts no options {', '.join(map(repr, options))}")


def bounded(values: FloatArray) -> Observation:
    """Return observed numbers, clipped to their bounds; 0 for those that are not finite."""
    if not np.vdot(values, values) < LIMIT * LIMIT:  # rarely: a number is out of bounds, or is not finite
        values = np.nan_to_num(values, posinf=LIMIT, neginf=-LIMIT).clip(-LIMIT, LIMIT)
    return values.astype(np.float32)


def _steps_per_action(every: int) -> int:
    """Return the number of steps per action as an int.

    Raises:
        ValueError: it is not an integer of at least 1.
    """
    try:
        steps = operator.index(every)
    except TypeError:
        steps = 0
    if steps < 1:
        raise ValueError(f"every must be a whole number of steps, 1 or more, is {every!r}")
    return steps


def _checked_duration(duration: float) -> float:
    """Return a duration that a scene may have.

    Raises:
        PartError: it is out of range.
    """
    return World(duration=duration).duration


def _rules_observation(rules: Rules) -> Sequence[tuple[str, float]]:
    """Return the names and values that the rules of the game observe; empty if they observe nothing."""
    return rules.observation() if isinstance(rules, HasObservation) else ()


def _body_indices(scene: Scene, names: Sequence[str] | None) -> list[int]:
    """Return the indices of the observed bodies; `names` is a list of names, one name, or None for the default.

    Raises:
        ValueError: there is no body of that name.
    """
    bodies = scene.bodies
    if names is None:
        return [int(index) for index in np.flatnonzero(~bodies.fixed)]
    names = (names,) if isinstance(names, str) else names
    unknown = [name for name in names if name not in bodies.names]
    if unknown:
        raise ValueError(f"no body is named {', '.join(map(repr, unknown))}; bodies: {', '.join(bodies.names[:9])}")
    return [bodies.names.index(name) for name in names]
