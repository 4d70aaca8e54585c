"""Gymnasium environment of a game: its controls are the actions, the increase of its score is the reward."""

import copy
import math
import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import gymnasium
import numpy as np
from gymnasium import spaces

from sandbox.action import ActionError
from sandbox.arrays import FloatArray
from sandbox.engines.contract import Divergence, Exhaustion, Refusal, SnapshotError
from sandbox.engines.registry import able, engine_named
from sandbox.games.contract import HasObservation, HasObservationRanges, HasPlayers, ObservationRange, Rules
from sandbox.games.registry import required_rules
from sandbox.measure.run.sessions import Episode
from sandbox.measure.seeds import with_seed
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import World
from sandbox.scene.files.load import SceneText, as_scene
from sandbox.scene.files.shipped_scenes import find

STATES = "x", "y", "vx", "vy", "angle", "ω", "present"
"""observed state of a body; `present` is 1, or 0 after removal"""
STATE_UNITS = "m", "m", "m/s", "m/s", "rad", "rad/s", ""
"""units of `STATES`"""
OBSERVABLE = "time", "score"
"""numbers that are observed only if `observe` names them"""
REWARDS = "score", "lead", "outcome"
"""rewards: see `SandboxEnv`"""
FINITE = float(np.finfo(np.float32).max)
"""bound to which unbounded numbers are clipped, so that they stay finite"""
SIZE = 640, 480
"""px, size of a rendered picture"""
SEEDS = 2**31
"""random seeds are below this number"""

Observation = np.ndarray[tuple[int], np.dtype[np.float32]]


class SandboxEnv(gymnasium.Env[Observation, Any]):
    """Gymnasium environment of a game.

    Observation: x, y, vx, vy, angle, ω and presence of each observed body; then the observation of the rules, such as
    fuel, wind, or the setting of a gun; then what `observe` names. `observed` has the name of each number,
    `observed_ranges` its bounds and unit. Positions are bounded by the bounds of the scene, or as the rules state;
    velocities by the speed limits of bodies. Numbers are clipped to their bounds. Those without bounds are finite.

    Action: one number for each control. If a control is analogue, the space is a `Box` from 0 to 1; other controls are
    then on above 0.5, analogue controls are released up to their `dead_zone`, and values out of range are clipped.
    Otherwise the space is a `MultiDiscrete` of 0 and 1.

    Reward: see `reward`. In games of several players it is that of `player`; `info["scores"]` has the score of each
    player by name, and `info["player"]` the one whose turn it is. An episode is terminated when the game is over. It is
    truncated at its `duration`, or if the physics fails; `info["failed"]` then has the reason.

    An environment can be pickled and copied before its first reset and after `close`. From reset to `close` it can be
    copied (`copy.deepcopy`) on engines that make snapshots, `reference` and `exact`; the copy continues alike, bit for
    bit.

    Args:
        scene: scene, path of a scene file, or name of a shipped scene.
        engine: name of the engine.
        bodies: names of the observed bodies; default: all bodies that are not fixed.
        every: number of steps per action.
        render_mode: None, or `rgb_array`.
        duration: longest simulated time of an episode, s; default: the duration of the scene.
        observe: numbers to observe in addition, of `time`, s, and `score`.
        reward: `score`, the increase of the score; `lead`, the increase of the difference to the best score of the
            other players; or `outcome`, at the end 1 for winning and −1 for losing.
        player: name of the player whose reward it is. Default: the player that is not a bot; if there are several, the
            one whose turn it is at the action, as for self-play.

    Raises:
        SceneError: the file has faults, or no file and no shipped scene has that name.
        UnsuitableSceneError: the scene has no game with rules, or lacks an element that its game needs.
        Refusal: the engine does not support the scene.
        ValueError: an engine, body, render mode, observable, reward or player does not exist, `every` is not an integer
            of at least 1, or the duration is out of range.
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
        observe: Sequence[str] = (),
        reward: str = "score",
        player: str | None = None,
    ) -> None:
        """Create an environment; `reset` begins an episode."""
        self.scene = as_scene(scene)
        self._file = None if isinstance(scene, Scene) else SceneText.read(find(str(scene)))
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
        self.observe = _checked_observables(observe)
        self.observed: tuple[str, ...] = (*states, *(name for name, _ in _rules_observation(rules)), *self.observe)
        """name of each number of an observation"""
        self.observed_ranges = self._ranges(rules)
        """range and unit of each number of an observation"""
        self.reward, self.player = _checked_reward(reward, rules), _checked_player(player, rules)
        count = len(self.controls)
        self.analogue = any(control.analogue for control in self.controls)
        self.action_space = (
            spaces.Box(0.0, 1.0, (count,), np.float32) if self.analogue else spaces.MultiDiscrete([2] * count)
        )
        low, high = (np.array([each[k] for each in self.observed_ranges], np.float32) for k in (0, 1))
        self.observation_space = spaces.Box(low, high, dtype=np.float32)
        self.bounds = np.clip((low, high), -FINITE, FINITE, dtype=np.float64)
        """(2, O) bounds to which observations are clipped: those of the space, or finite numbers"""
        self.metadata = self.metadata | {"render_fps": max(round(1.0 / (self.scene.solver.dt * every)), 1)}
        self._episode: Episode | None = None
        self._ended = False
        self._canvas: Any = None

    def _ranges(self, rules: Rules) -> tuple[ObservationRange, ...]:
        """Return range and unit of each number of an observation."""
        bodies, bounds, ranges = self.scene.bodies, self.scene.world.bounds, dict[str, ObservationRange]()
        corners = bounds or ((-math.inf, -math.inf), (math.inf, math.inf))
        for index in self.observed_bodies.tolist():
            speed, spin = float(bodies.max_speed[index]), float(bodies.max_angular_velocity[index])
            across, up = zip(*corners, strict=True)
            limits = across, up, (-speed, speed), (-speed, speed), (-math.inf, math.inf), (-spin, spin), (0.0, 1.0)
            for state, unit, (low, high) in zip(STATES, STATE_UNITS, limits, strict=True):
                ranges[f"{bodies.names[index]} {state}"] = ObservationRange(low, high, unit)
        last = self.scene.world.duration + self.every * self.scene.solver.dt  # an episode ends with a whole action
        ranges["time"] = ObservationRange(0.0, last, "s")
        if isinstance(rules, HasObservationRanges):
            ranges.update(rules.observation_ranges())
        return tuple(ranges.get(name, ObservationRange()) for name in self.observed)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: seed of the scene. Without it, the first episode has the seed of the scene file, and each later one a
                new random seed. An environment of a scene object keeps what reading its file has generated by its
                seed, such as the rack of a billiard table.
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
        self._episode, self._ended = Episode(self._seeded(number), self.engine), False
        return self._observation(), self._info()

    def _seeded(self, seed: int) -> Scene:
        """Return the scene of an episode: of a file, with all that the seed generates, such as the gaps of a rack."""
        if self._file is None:
            return with_seed(self.scene, seed)
        return self._file.scene([("world.seed", seed), ("world.duration", self.scene.world.duration)])

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
        rules: Any = episode.rules
        player, failed = (self.player or rules.player) if self._has_players else None, None
        before = self._value(rules, player)
        try:
            episode.set_levels(levels)
            episode.advance(self.every)
        except (Divergence, Exhaustion, ActionError) as error:
            failed = str(error)
        info = self._info() | ({} if failed is None else {"failed": failed})
        over = rules.game_over is not None
        late = not over and (episode.late or failed is not None)
        self._ended = over or late
        return self._observation(), float(self._value(rules, player) - before), over, late, info

    def _value(self, rules: Any, player: str | None) -> float:
        """Return the quantity whose increase is the reward of a player; None in games of one player."""
        if player is None:
            return float(rules.score)
        if self.reward == "outcome":
            return 0.0 if rules.winner is None else 1.0 if rules.winner == player else -1.0
        scores: Mapping[str, float] = rules.scores
        others = max(score for name, score in scores.items() if name != player) if self.reward == "lead" else 0.0
        return scores[player] - others

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
        return [
            min(max(level, 0.0), 1.0) if level > control.dead_zone else 0.0
            for level, control in zip(found, self.controls, strict=True)
        ]

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
        own = {"time": episode.time, "score": rules.score}
        values[states.size :] = [*numbers, *(own[name] for name in self.observe)]
        return bounded(values, self.bounds)

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

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return an independent environment, in an episode in the same state.

        Raises:
            SnapshotError: an episode runs on an engine that makes no snapshots.
        """
        copied = object.__new__(type(self))
        memo[id(self)] = copied
        try:
            copied.__dict__.update(copy.deepcopy(self.__dict__ | {"_canvas": None}, memo))
        except SnapshotError as error:
            raise SnapshotError(
                f"an environment cannot be copied during an episode on {self.engine!r}: {error}. To branch from here, "
                "reset another environment with the same seed and repeat the actions; recording() keeps the episode"
            ) from None
        return copied

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle.

        Raises:
            TypeError: an episode runs.
        """
        if self._episode is not None:
            raise TypeError(
                "an environment cannot be pickled during an episode: a running simulation cannot be pickled. close() "
                "ends the episode; recording() keeps it, and another environment with its seed and actions repeats it"
            )
        return self.__dict__ | {"_canvas": None}

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


def bounded(values: FloatArray, bounds: FloatArray) -> Observation:
    """Return observed numbers, clipped to their lower and upper bounds, (2, O); 0 for those that are undefined."""
    if not math.isfinite(np.vdot(values, values)):  # rarely: a number is not finite, or huge
        values = np.nan_to_num(values)
    observation: Observation = np.minimum(np.maximum(values, bounds[0]), bounds[1]).astype(np.float32)
    return observation


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


def _checked_observables(observe: Sequence[str]) -> tuple[str, ...]:
    """Return the names of additional observed numbers; `observe` is a list of names, or one name.

    Raises:
        ValueError: a name is unknown, or is given twice.
    """
    names = (observe,) if isinstance(observe, str) else tuple(observe)
    unknown = [name for name in names if name not in OBSERVABLE]
    if unknown or len(set(names)) < len(names):
        raise ValueError(f"observe accepts {' and '.join(map(repr, OBSERVABLE))}, each once, not {observe!r}")
    return names


def _checked_reward(reward: str, rules: Rules) -> str:
    """Return a kind of reward.

    Raises:
        ValueError: it is unknown, or needs a game of several players.
    """
    if reward not in REWARDS:
        raise ValueError(f"unknown reward {reward!r}; rewards: {', '.join(REWARDS)}")
    if reward != "score" and not (isinstance(rules, HasPlayers) and len(rules.scores) > 1):
        raise ValueError(f"the reward {reward!r} needs a game of several players; use 'score'")
    return reward


def _checked_player(player: str | None, rules: Rules) -> str | None:
    """Return the player whose reward it is; None for the one whose turn it is, and in games of one player.

    Raises:
        ValueError: there is no such player.
    """
    scores = rules.scores if isinstance(rules, HasPlayers) else {}
    if player is not None:
        if player not in scores:
            players = ", ".join(scores) or "none, it is a game of one player"
            raise ValueError(f"no player is named {player!r}; players: {players}")
        return player
    people = [name for name in scores if isinstance(rules, HasPlayers) and name not in rules.bots]
    return people[0] if len(people) == 1 else None


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
