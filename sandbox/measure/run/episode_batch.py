"""Many episodes of a game, advanced together by compiled calls."""

from collections.abc import Sequence

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.contract import HasWorldBatch, WorldBatch
from sandbox.engines.registry import start
from sandbox.games.contract import VectorRules
from sandbox.games.registry import vector_rules_of
from sandbox.measure.seeds import is_random
from sandbox.scene.compile.scene import Scene


class EpisodeBatch:
    """M episodes of the game of a scene, each of which does what an `Episode` with the same seed does, bit for bit."""

    def __init__(self, scene: Scene, rules: VectorRules, worlds: WorldBatch) -> None:
        """Combine rules and worlds; `start_batch` does that for a scene."""
        self._scene, self._dt, self.rules, self._worlds = scene, scene.solver.dt, rules, worlds
        self.states = worlds.states
        """states of the worlds"""
        self.failed: dict[int, str] = {}
        """reasons why the physics of episodes failed in the last call of `advance`, by the index of the episode"""

    @classmethod
    def start_batch(cls, scene: Scene, engine: str, count: int) -> "EpisodeBatch | None":
        """Return so many episodes; None if the game, the scene or the engine does not allow compiled calls.

        Each has to be started by `restart`.

        Raises:
            UnsuitableSceneError: the scene lacks an element that its game needs.
            Refusal: the engine does not support the scene.
        """
        rules = vector_rules_of(scene, count)
        if rules is None or is_random(scene):
            return None
        simulation = start(scene, engine)
        worlds = simulation.world_batch(count) if isinstance(simulation, HasWorldBatch) else None
        simulation.close()
        return None if worlds is None else cls(scene, rules, worlds)

    @property
    def late(self) -> BoolArray:
        """(M,) whether the duration of the scene is over."""
        return self.states.time >= self._scene.world.duration - 0.5 * self._dt

    @property
    def is_over(self) -> BoolArray:
        """(M,) whether each game is over."""
        return np.asarray([reason is not None for reason in self.rules.game_over])

    def restart(self, episodes: IntArray, seeds: Sequence[int]) -> None:
        """Start episodes, by their (K,) indices, with K seeds."""
        self._worlds.restart(episodes, self.rules.restart(episodes, seeds))

    def advance(self, episodes: IntArray, levels: FloatArray, steps: int) -> None:
        """Set the controls of K episodes to levels (K, C) and advance these by so many steps, or to their end."""
        worlds, rules, states = self._worlds, self.rules, self.states
        self.failed = {}
        rules.set_controls(episodes, levels)
        left = np.zeros(len(states.time), np.int64)
        left[episodes] = np.minimum(
            steps, np.ceil((self._scene.world.duration - states.time[episodes]) / self._dt - 0.5)
        )
        while left.any():
            worlds.thrust_level[:] = rules.thrust_level
            made = worlds.advance(np.minimum(left, rules.quiet_steps(self._dt)))
            left -= made
            self._update_rules(made > 0)
            left[self.is_over | states.diverged] = 0

    def _update_rules(self, moved: BoolArray) -> None:
        """Pass the present states to the rules; of worlds that have just diverged, those one step before."""
        states, diverged = self.states, moved & self.states.diverged
        if diverged.any():
            touched = np.zeros_like(states.touched)
            before = states._replace(time=states.previous_time, now=states.previous, touched=touched)
            self.rules.on_step(np.flatnonzero(diverged), before)
            self.failed |= {world: str(self._worlds.divergence(world)) for world in np.flatnonzero(diverged).tolist()}
        self.rules.on_step(np.flatnonzero(moved & ~diverged), states)
