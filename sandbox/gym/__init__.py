"""Gymnasium environments: a scene with a game as an environment for reinforcement learning.

    import gymnasium
    import sandbox.gym

    env = gymnasium.make("sandbox/Landing-v0")

`SandboxEnv(scene)` makes an environment of any scene whose `[play] game` has rules. Actions are the controls of the
game, the reward is the increase of the score. `recording()` returns the episode as a recorded session, for replay in
the window. `SandboxVectorEnv(scene, 64)` advances many episodes of a game at once by compiled calls, where game and
engine allow that. This package alone imports gymnasium.
"""

try:
    import gymnasium
except ImportError:
    raise ImportError("sandbox.gym needs gymnasium: pip install -e '.[gym]'") from None

from sandbox.game_names import game_specs
from sandbox.gym.game_env import STATES, SandboxEnv
from sandbox.gym.game_vector_env import CompiledOnlyError, SandboxVectorEnv, make_vector_env
from sandbox.gym.lunar_lander import LunarLander

__all__ = ["GAMES", "STATES", "CompiledOnlyError", "LunarLander", "SandboxEnv", "SandboxVectorEnv", "make_vector_env"]

GAMES = {each.name: (each.scene, each.frame_skip) for spec in game_specs() for each in spec.environments}
"""Shipped scene and number of steps per action, by the name in the environment id."""

for _spec in game_specs():
    for _each in _spec.environments:
        _options = {"scene": _each.scene, "every": _each.frame_skip, "engine": _each.engine}
        gymnasium.register(
            f"sandbox/{_each.name}-v0",
            entry_point="sandbox.gym:SandboxEnv",
            kwargs=_options if _each.duration is None else _options | {"duration": _each.duration},
            vector_entry_point="sandbox.gym:make_vector_env" if _spec.vector_rules is not None else None,
        )

for _name, _arguments in {"LunarLander": {}, "LunarLanderContinuous": {"continuous": True}}.items():
    gymnasium.register(
        f"sandbox/{_name}-v3",
        entry_point="sandbox.gym:LunarLander",
        kwargs=_arguments,
        max_episode_steps=1000,
        reward_threshold=200.0,
    )
