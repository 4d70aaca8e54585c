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
from sandbox.gym.game_env import OBSERVABLE, REWARDS, STATES, SandboxEnv
from sandbox.gym.game_vector_env import CompiledOnlyError, SandboxVectorEnv, make_vector_env

__all__ = [
    "GAMES",
    "OBSERVABLE",
    "REWARDS",
    "STATES",
    "CompiledOnlyError",
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
