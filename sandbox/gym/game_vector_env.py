"""Vector environment of a game: many episodes, which compiled calls advance together."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import gymnasium
import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import COMPILED
from sandbox.gym.game_env import SEEDS, STATES, Observation, SandboxEnv, bounded, refuse_options
from sandbox.measure.run.episode_batch import EpisodeBatch
from sandbox.scene.compile.scene import Scene

MAX_SEED = 2**63
"""all seeds are below this number"""


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
        duration, observe, reward, player: as for `SandboxEnv`.

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
        observe: Sequence[str] = (),
        reward: str = "score",
        player: str | None = None,
    ) -> None:
        """Create an environment; `reset` begins the episodes."""
        self._single = single = SandboxEnv(
            scene, engine, bodies, every, duration=duration, observe=observe, reward=reward, player=player
        )
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, is {num_envs!r}")
        batch = EpisodeBatch.start_batch(single.scene, engine, num_envs)
        if batch is None:
            raise CompiledOnlyError(
                f"{single.scene.title!r} on {engine} cannot be advanced by compiled calls; use "
                "gymnasium.make_vec(..., vectorization_mode='sync')"
            )
        self.num_envs, self._batch, self.scene, self.engine, self.every = num_envs, batch, single.scene, engine, every
        self.controls, self.analogue = single.controls, single.analogue
        self.observed, self.observed_ranges = single.observed, single.observed_ranges
        self._dead_zone = np.array([control.dead_zone for control in single.controls])
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
        refuse_options(options)
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
        return np.where(levels > self._dead_zone, levels.clip(0.0, 1.0), 0.0)

    def _observation(self) -> Observation:
        """Return the observations, (M, O)."""
        now, some, count = self._batch.states.now, self._single.observed_bodies, self.num_envs
        values = np.empty((count, len(self.observed)))
        states = values[:, : len(STATES) * len(some)].reshape(count, len(some), len(STATES))
        states[..., 0:2], states[..., 2:4] = now.position[:, some], now.velocity[:, some]
        states[..., 4], states[..., 5] = now.angle[:, some], now.angular_velocity[:, some]
        states[..., 6] = self._batch.states.present[:, some]
        end = len(self.observed) - len(self._single.observe)
        values[:, states[0].size : end] = self._batch.rules.observation()
        for k, name in enumerate(self._single.observe, end):
            values[:, k] = self._batch.states.time if name == "time" else self._batch.rules.score
        return bounded(values, self._single.bounds)

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
