"""Gymnasium environments: a scene with a game as an environment for reinforcement learning.

    import gymnasium
    import sandbox.gym

    env = gymnasium.make("sandbox/Landing-v0")

`SandboxEnv(scene)` makes an environment of any scene whose `[play] game` has rules. Actions are the controls of the
game, the reward is the increase of the score. `recording()` returns the episode as a recorded session, for replay in
the window. `SandboxVectorEnv(scene, 64)` advances many episodes of a game at once by compiled calls, where game and
engine allow that. This is the only module that imports gymnasium.
"""

import math
import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

try:
    import gymnasium
    from gymnasium import spaces
except ImportError:
    raise ImportError("sandbox.gym needs gymnasium: pip install -e '.[gym]'") from None

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.contract import Divergence, Exhaustion, Refusal
from sandbox.engines.registry import able, engine_named
from sandbox.game_names import game_specs
from sandbox.games.contract import HasObservation, HasPlayers, Rules
from sandbox.games.registry import required_rules
from sandbox.measure.run.episode_batch import EpisodeBatch
from sandbox.measure.run.sessions import Episode
from sandbox.measure.seeds import with_seed
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import World
from sandbox.scene.files.load import as_scene

GAMES = {each.name: (each.scene, each.frame_skip) for spec in game_specs() for each in spec.environments}
"""Shipped scene and number of steps per action, by the name in the environment id."""
LIMIT = 1e6
"""bound to which observed numbers are clipped: learning algorithms expect bounded spaces"""
STATES = "x", "y", "vx", "vy", "angle", "ω", "present"
"""observed state of a body, in m, m/s, rad and rad/s; `present` is 1, or 0 after removal"""
SIZE = 640, 480
"""px, size of a rendered picture"""
SEEDS, MAX_SEED = 2**31, 2**63
"""random seeds are below the first number, and all seeds below the second"""

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
        self._has_observation = isinstance(rules, HasObservation)
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
        _refuse_options(options)
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
        return _bounded(values)

    def _info(self) -> dict[str, Any]:
        episode = self._current_episode()
        rules = episode.rules
        info: dict[str, Any] = {
            "time": episode.time,
            "score": rules.score,
            "over": rules.game_over,
            "seed": episode.scene.world.seed,
        }
        if isinstance(rules, HasPlayers):
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


class SandboxVectorEnv(gymnasium.vector.VectorEnv[Observation, Any, Any]):
    """Gymnasium vector environment: many episodes of a game, which compiled calls advance together.

    Spaces, observations, rewards and infos are those of `SandboxEnv` on the same engine, bit for bit. Values of `info`
    are arrays over the episodes. An episode that has ended begins anew at the next step, whose action it ignores
    (`AutoresetMode.NEXT_STEP`). To watch an episode, repeat its seed and actions with a `SandboxEnv`.

    Episodes are advanced by compiled calls if the game has rules for many games at once, as `landing` has; if the
    engine is `reference`; and if the bodies touch only static elements and have no joints. The first environment on a
    computer compiles for up to a minute; the compiled code is kept on disk.

    Args:
        scene: as for `SandboxEnv`.
        num_envs: number of episodes.
        engine: name of the engine.
        bodies: as for `SandboxEnv`.
        every: number of steps per action.
        duration: as for `SandboxEnv`.

    Raises:
        CompiledOnlyError: the scene, its game or the engine does not allow compiled calls.
        SceneError, UnsuitableSceneError, Refusal, ValueError: as for `SandboxEnv`.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012, as the base has it
        "render_modes": [],
        "autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        scene: Scene | str | Path,
        num_envs: int,
        engine: str = "reference",
        bodies: Sequence[str] | None = None,
        every: int = 1,
        duration: float | None = None,
    ) -> None:
        """Create an environment; `reset` begins the episodes."""
        self._single = single = SandboxEnv(scene, engine, bodies, every, duration=duration)
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, is {num_envs!r}")
        batch = EpisodeBatch.start_batch(single.scene, engine, num_envs)
        if batch is None:
            raise CompiledOnlyError(
                f"{single.scene.title!r} on {engine} cannot be advanced by compiled calls; use "
                "gymnasium.make_vec(..., vectorization_mode='sync')"
            )
        self.num_envs, self._batch, self.scene, self.engine, self.every = num_envs, batch, single.scene, engine, every
        self.controls, self.observed, self.analogue = single.controls, single.observed, single.analogue
        self.single_action_space, self.single_observation_space = single.action_space, single.observation_space
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self._generators: list[np.random.Generator] = []
        self._seed, self._ended = np.zeros(num_envs, np.int64), np.zeros(num_envs, np.bool_)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin all episodes, or some of them.

        Args:
            seed: seed of the first episode, the others have the numbers after it; or one for each. Without it, the
                first episodes have the seed of the scene file and the numbers after it, and each later one has a new
                random seed.
            options: `reset_mask`, (M,) which episodes to begin; default: all.

        Returns:
            The first observations, (M, O), and the info dict.

        Raises:
            ValueError: other options are given; or a seed is out of range, or not one for each episode.
        """
        options = dict(options or {})
        mask = np.asarray(options.pop("reset_mask", np.ones(self.num_envs, np.bool_)))
        _refuse_options(options)
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise ValueError(f"reset_mask must be {self.num_envs} values of type bool, not {mask!r}")
        if not self._generators and not mask.all():
            raise ValueError("the first reset must begin all episodes")
        if seed is None and not self._generators:
            seed = self.scene.world.seed
        seeds = [None] * self.num_envs if seed is None else _seeds(seed, self.num_envs)
        if not self._generators:
            self._generators = [np.random.default_rng() for _ in range(self.num_envs)]
        for k, number in enumerate(seeds):
            if number is not None and mask[k]:
                self._generators[k], _ = gymnasium.utils.seeding.np_random(number)
        self._begin(np.flatnonzero(mask), seeds)
        return self._observation(), self._info(mask)

    def step(self, actions: Any) -> tuple[Observation, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Set the controls and advance all episodes by `every` steps, or to their end; begin those that had ended.

        Args:
            actions: (M, C) numbers.

        Returns:
            Observations (M, O); rewards, terminated and truncated, (M,); and the info dict.

        Raises:
            ValueError: an action does not have one valid number for each control. The environment is left unchanged.
            ResetNeeded: no episode has begun.
        """
        if not self._generators:
            raise gymnasium.error.ResetNeeded("call reset before step")
        levels = self._levels_of(actions)
        batch, running = self._batch, np.flatnonzero(~self._ended)
        before = batch.rules.score.copy()
        restarted = np.flatnonzero(self._ended)
        batch.advance(running, levels[running], self.every)
        reward = (batch.rules.score - before).astype(np.float64)
        over, failed = batch.is_over, batch.failed
        late = ~over & (batch.late | batch.states.diverged)
        if len(restarted):
            self._begin(restarted, [None] * self.num_envs)
            reward[restarted], over[restarted], late[restarted] = 0.0, False, False
        self._ended = over | late
        return self._observation(), reward, over, late, self._info(np.ones(self.num_envs, np.bool_), failed)

    def _begin(self, episodes: IntArray, seeds: Sequence[int | None]) -> None:
        """Begin episodes, by their indices, with those of M seeds that are given, or with random ones."""
        for k in episodes.tolist():
            given = seeds[k]
            self._seed[k] = self._generators[k].integers(SEEDS) if given is None else given
        self._batch.restart(episodes, self._seed[episodes].tolist())
        self._ended[episodes] = False

    def _levels_of(self, actions: Any) -> FloatArray:
        """Return the value of each control in each action, 0 to 1.

        Raises:
            ValueError: an action does not have one valid number for each control.
        """
        try:
            levels = np.asarray(actions, dtype=np.float64)
        except (TypeError, ValueError):
            levels = np.empty(0)
        is_valid = levels.shape == (self.num_envs, len(self.controls))
        if not (is_valid and np.isfinite(levels).all() and (self.analogue or np.isin(levels, (0.0, 1.0)).all())):
            names, each = ", ".join(control.name for control in self.controls), "0 to 1" if self.analogue else "0 or 1"
            raise ValueError(f"actions are {self.num_envs} × {len(self.controls)} numbers, {each}, for {names}")
        return levels.clip(0.0, 1.0)

    def _observation(self) -> Observation:
        """Return the observations, (M, O)."""
        now, some, count = self._batch.states.now, self._single.observed_bodies, self.num_envs
        values = np.empty((count, len(self.observed)))
        states = values[:, : len(STATES) * len(some)].reshape(count, len(some), len(STATES))
        states[..., 0:2], states[..., 2:4] = now.position[:, some], now.velocity[:, some]
        states[..., 4], states[..., 5] = now.angle[:, some], now.angular_velocity[:, some]
        states[..., 6] = self._batch.states.present[:, some]
        values[:, states[0].size : -2] = self._batch.rules.observation()
        values[:, -2], values[:, -1] = self._batch.states.time, self._batch.rules.score
        return _bounded(values)

    def _info(self, mask: BoolArray, failed: Mapping[int, str] = MappingProxyType({})) -> dict[str, Any]:
        """Return the infos of those episodes that `mask` selects, and the reasons why some of them failed."""
        rules = self._batch.rules
        over: Any = np.full(self.num_envs, None, dtype=object)
        over[mask] = np.asarray(rules.game_over, dtype=object)[mask]
        values: dict[str, Any] = {
            "time": np.where(mask, self._batch.states.time, 0.0),
            "score": np.where(mask, rules.score, 0),
            "over": over,
            "seed": np.where(mask, self._seed, 0),
        }
        infos = {key: value for name, array in values.items() for key, value in ((name, array), (f"_{name}", mask))}
        if failed:
            infos["failed"] = np.asarray([failed.get(k) for k in range(self.num_envs)], dtype=object)
            infos["_failed"] = np.isin(np.arange(self.num_envs), list(failed))
        return infos


class CompiledOnlyError(ValueError):
    """A scene, its game or the engine does not allow that many episodes are advanced by compiled calls."""


def make_vector_env(num_envs: int, **arguments: Any) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
    """Return a vector environment, for `gymnasium.make_vec`.

    It is a `SandboxVectorEnv` if numba is installed and the scene, its game and the engine allow compiled calls;
    otherwise the episodes of a `SyncVectorEnv` are advanced one after the other.

    Args:
        num_envs: number of episodes.
        arguments: those of `SandboxEnv`.
    """
    if COMPILED and arguments.get("render_mode") is None:
        try:
            return SandboxVectorEnv(num_envs=num_envs, **{k: v for k, v in arguments.items() if k != "render_mode"})
        except CompiledOnlyError:
            pass
    return gymnasium.vector.SyncVectorEnv([lambda: SandboxEnv(**arguments)] * num_envs)


def _refuse_options(options: Mapping[str, Any] | None) -> None:
    """Refuse options of `reset` that do not exist.

    Raises:
        ValueError: there are some.
    """
    if options:
        raise ValueError(f"reset accepts no options {', '.join(map(repr, options))}")


def _seeds(seed: int | Sequence[int | None], count: int) -> list[int | None]:
    """Return the seed of each of so many episodes.

    Raises:
        ValueError: a seed is out of range, or there is not one for each episode.
    """
    seeds: list[int | None] = [*seed] if isinstance(seed, Sequence) else [seed + k for k in range(count)]
    if len(seeds) != count:
        raise ValueError(f"{len(seeds)} seeds are given for {count} episodes")
    if any(number is not None and not 0 <= number < MAX_SEED for number in seeds):
        raise ValueError(f"a seed must be 0 or more and below 2**63, not {seed!r}")
    return seeds


def _bounded(values: FloatArray) -> Observation:
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


for _spec in game_specs():
    for _each in _spec.environments:
        _options = {"scene": _each.scene, "every": _each.frame_skip, "engine": _each.engine}
        gymnasium.register(
            f"sandbox/{_each.name}-v0",
            entry_point="sandbox.gym:SandboxEnv",
            kwargs=_options if _each.duration is None else _options | {"duration": _each.duration},
            vector_entry_point="sandbox.gym:make_vector_env" if _spec.vector_rules is not None else None,
        )
