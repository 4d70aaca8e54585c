"""Gymnasium environments: a scene with a game as an environment for reinforcement learning.

    import gymnasium
    import sandbox.gym

    env = gymnasium.make("sandbox/Landing-v1")

`SandboxEnv(scene)` makes an environment of any scene whose `[play] game` has rules. Actions are the controls of the
game. The reward is the increase of the score, or of the lead, or the outcome. `recording()` returns the episode as a
recorded session, for replay in the window. `SandboxVectorEnv(scene, 64)` advances many episodes of a game at once by
compiled calls, where game and engine allow that. This package alone imports gymnasium.
"""

try:
    import gymnasium
except ImportError:
    raise ImportError("sandbox.gym needs gymnasium: pip install -e '.[gym]'") from None

from sandbox.game_names import game_specs
from sandbox.gym.bipedal_walker import BipedalWalker
from sandbox.gym.game_env import OBSERVABLE, REWARDS, STATES, SandboxEnv
from sandbox.gym.game_vector_env import CompiledOnlyError, SandboxVectorEnv, make_vector_env
from sandbox.gym.lunar_lander import LunarLander

__all__ = [
    "CLASSICS",
    "GAMES",
    "OBSERVABLE",
    "REWARDS",
    "STATES",
    "BipedalWalker",
    "CompiledOnlyError",
    "LunarLander",
    "SandboxEnv",
    "SandboxVectorEnv",
    "make_vector_env",
]

GAMES = {each.name: (each.scene, each.frame_skip) for spec in game_specs() for each in spec.environments}
"""Shipped scene and number of steps per action, by the name in the environment id."""

for _spec in game_specs():
    for _each in _spec.environments:
        _options = {"scene": _each.scene, "every": _each.frame_skip, "engine": _each.engine}
        gymnasium.register(
            _each.id,
            entry_point="sandbox.gym:SandboxEnv",
            kwargs=_options if _each.duration is None else _options | {"duration": _each.duration},
            vector_entry_point="sandbox.gym:make_vector_env" if _spec.vector_rules is not None else None,
        )

CLASSICS: dict[str, tuple[str, dict[str, bool], int, float]] = {
    "LunarLander-v3": ("LunarLander", {}, 1000, 200.0),
    "LunarLanderContinuous-v3": ("LunarLander", {"continuous": True}, 1000, 200.0),
    "BipedalWalker-v3": ("BipedalWalker", {}, 1600, 300.0),
    "BipedalWalkerHardcore-v3": ("BipedalWalker", {"hardcore": True}, 2000, 300.0),
}
"""Class, arguments, longest episode in steps, and return of a solution, by the name in the environment id."""

for _name, (_class, _arguments, _steps, _threshold) in CLASSICS.items():
    gymnasium.register(
        f"sandbox/{_name}",
        entry_point=f"sandbox.gym:{_class}",
        kwargs=dict(_arguments),
        max_episode_steps=_steps,
        reward_threshold=_threshold,
    )
