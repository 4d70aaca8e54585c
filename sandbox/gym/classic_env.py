"""Base of the environments that repeat Gymnasium's Box2D environments on a scene and an engine of the sandbox."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np

from sandbox.action import Action, Throttle
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import able, engine_named
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.gym.game_env import Observation, refuse_options
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import load
from sandbox.trajectory import Contacts

SIZE = 600, 400
"""px, size of a rendered picture"""


FAR = 20.0
"""m, to which the ground is drawn on each side and below"""


def below(ground: Sequence[Point]) -> tuple[Point, ...]:
    """Return the corners that complete those of a ground, m, to the outline of the soil as it is drawn."""
    (left, first), (right, last) = ground[0], ground[-1]
    return (right + FAR, last), (right + FAR, -FAR), (left - FAR, -FAR), (left - FAR, first)


def checked_numbers(action: Any, count: int) -> list[float]:
    """Return the numbers of an action, clipped to −1 to 1.

    Raises:
        ValueError: they are not so many finite numbers.
    """
    values = np.asarray(action, np.float64)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise ValueError(f"an action is {count} numbers, -1 to 1, not {action!r}")
    numbers: list[float] = values.clip(-1.0, 1.0).tolist()
    return numbers


class ClassicEnv(gymnasium.Env[Observation, Any]):
    """Environment whose episodes are scenes with actions, so that any engine can replay them.

    A step of the environment is one step dt of the scene.

    Pickles and copies, also those of a running episode, repeat the episode from its start, and continue it alike.
    """

    observed: tuple[str, ...]
    """name of each number of an observation"""
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 50}  # noqa: RUF012, as the base has it

    def __init__(self, scene: str, engine: str, render_mode: str | None) -> None:
        """Create an environment of a shipped scene; `reset` begins an episode.

        Raises:
            Refusal: the engine does not support the scene.
            ValueError: the engine or the render mode does not exist.
        """
        self._base = load(scene)
        missing = engine_named(engine).missing(self._base, self._base.solver)
        if missing:
            raise Refusal(engine, missing, able(self._base))
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ValueError(f"unknown render mode {render_mode!r}; use 'rgb_array'")
        self.engine, self.render_mode = engine, render_mode
        self._scene: Scene | None = None
        self._simulation: SwitchableSimulation | None = None
        self._actions: list[Action] = []
        self._steps = 0
        self._potential: float | None = None
        self._canvas: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode, and make a first step without engines or motors.

        Args:
            seed: seed of the random numbers; default: they continue, at first from a random seed.
            options: not supported.

        Returns:
            The first observation, and an empty info dict.

        Raises:
            ValueError: options are given.
        """
        refuse_options(options)
        super().reset(seed=seed)
        self._potential = None
        self._begin_episode()
        return self.step(self._idle_action)[0], {}

    @property
    @abstractmethod
    def _idle_action(self) -> Any:
        """Action that does nothing."""

    @abstractmethod
    def _begin_episode(self) -> None:
        """Draw the random numbers of an episode, and start its simulation."""

    def _gain(self, potential: float) -> float:
        """Return the increase of a potential since the last step; 0 in the first step of an episode."""
        before, self._potential = self._potential, potential
        return 0.0 if before is None else potential - before

    def _begin(self, scene: Scene) -> SwitchableSimulation:
        """Start the simulation of an episode, and return it."""
        self._release()
        self._scene, self._actions, self._steps = scene, [], 0
        self._simulation = simulation = start(scene, self.engine)
        simulation.contacts()  # contacts are recorded from now on
        return simulation

    def _advance(self, actions: list[Action]) -> Contacts:
        """Apply actions, whose times must be that of this step, advance by one step, and return the contacts."""
        simulation = self._running
        for action in actions:
            simulation.apply(action)
        self._actions += actions
        self._steps += 1
        simulation.step()
        return simulation.contacts()

    @property
    def _running(self) -> SwitchableSimulation:
        """The simulation of the episode.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._simulation is None:
            raise gymnasium.error.ResetNeeded("call reset before step, render or recording")
        return self._simulation

    def recording(self) -> Recording:
        """Return the episode so far as a recording, for `sandbox replay`."""
        simulation = self._running
        return Recording(
            scene=simulation.scene,
            engine=self.engine,
            settings=simulation.scene.solver,
            actions=tuple(self._actions),
            duration=simulation.time,
            state_hash=simulation.state_hash(),
        )

    def render(self) -> Any:
        """Return a picture, (height, width, 3) from 0 to 255; None without a render mode."""
        if self.render_mode is None:
            return None
        simulation = self._running
        if self._canvas is None:
            from sandbox.window.render.renderer import OffscreenRenderer  # pygame is needed only to render

            self._canvas = OffscreenRenderer(SIZE)
        scene, throttles = self._drawn()
        return self._canvas.picture(scene, simulation.bodies, simulation.frame(), None, throttles)

    def _drawn(self) -> tuple[Scene, Mapping[str, Throttle]]:
        """Return the scene as it is drawn now, and the throttles of its thrusts."""
        return self._running.scene, {}

    def close(self) -> None:
        """Release the engine and the canvas."""
        self._release()
        self._canvas = None

    def _release(self) -> None:
        if self._simulation is not None:
            self._simulation.close()
        self._simulation = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without engine and canvas."""
        return self.__dict__ | {"_simulation": None, "_canvas": None, "_is_running": self._simulation is not None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take over a state, and repeat its episode."""
        is_running = state.pop("_is_running")
        self.__dict__.update(state)
        if is_running:
            assert self._scene is not None
            actions, steps, dt = self._actions, self._steps, self._scene.solver.dt
            self._begin(self._scene)
            of_step: dict[int, list[Action]] = {}
            for action in actions:
                of_step.setdefault(round(action.time / dt), []).append(action)
            for k in range(steps):
                self._advance(of_step.get(k, []))
