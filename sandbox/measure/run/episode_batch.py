"""Many episodes of a game, advanced together by compiled calls."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.contract import HasWorldBatch, Members, WorldBatch, WorldStates
from sandbox.engines.registry import start
from sandbox.game_spec import import_part
from sandbox.games.contract import Control
from sandbox.games.registry import find_spec
from sandbox.measure.seeds import is_random
from sandbox.scene.compile.scene import Scene


class VectorRules(Protocol):
    """Rules of M independent games of one scene, as arrays: what `Rules` of each game would do, bit for bit.

    Only games whose controls set levels of thrusts can have them. A host calls:

        restart(games, seeds)                  start states of new games
        set_controls(games, levels)            controls, between two steps
        on_step(games, states)                 after at most `quiet_steps(dt)` steps, and after a step with contacts

    A game in which a body is removed is over.
    """

    controls: tuple[Control, ...]
    score: IntArray
    """(M,)"""
    game_over: list[str | None]
    """reason why each game is over; None while it runs"""
    thrust_level: FloatArray
    """(M, T) level of each thrust of the scene, as the rules set it"""

    def restart(self, games: IntArray, seeds: Sequence[int]) -> Members:
        """Start games, by their (K,) indices, with K seeds; return the K start states of their bodies."""

    def set_controls(self, games: IntArray, levels: FloatArray) -> None:
        """Set the controls of K games to levels (K, C), from 0 to 1."""

    def quiet_steps(self, dt: float) -> IntArray:
        """Return for each game, (M,), what `HasQuietSteps.quiet_steps` returns."""

    def on_step(self, games: IntArray, states: WorldStates) -> None:
        """Update games, by their (K,) indices, after steps; the states are those of all M worlds."""

    def observation(self) -> FloatArray:
        """Return the values (M, O) of the observation of each game."""


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
        spec = find_spec(scene.play.game)
        if spec is None or spec.vector_rules is None or is_random(scene) or scene.events or scene.sensors:
            return None
        rules: VectorRules = import_part(spec.vector_rules)(scene, scene.bodies, count)
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
