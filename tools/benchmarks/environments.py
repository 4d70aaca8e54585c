"""Rows of Gymnasium environments, against LunarLander-v3 and BipedalWalker-v3."""

import importlib
import importlib.util

from tools.benchmarks.clock import cpu_time
from tools.benchmarks.row import Bench
from tools.benchmarks.workloads import Timed

STEPS = 400
SEED = 5


def missing() -> str | None:
    """Return the reason why LunarLander is not available, or None."""
    needed = ("gymnasium", "Box2D")
    absent = [name for name in needed if importlib.util.find_spec(name) is None]
    return f"{' and '.join(absent)} not installed here: pip install 'gymnasium[box2d]'" if absent else None


def env_steps(name: str) -> Timed:
    """Return a workload that makes steps of an environment with random actions; its resets are not timed."""
    import gymnasium

    importlib.import_module("sandbox.gym")  # registers the environments
    env = gymnasium.make(name).unwrapped
    env.action_space.seed(SEED)
    actions = [env.action_space.sample() for _ in range(STEPS)]

    def work() -> float:
        env.reset(seed=SEED)
        seconds = 0.0
        for action in actions:
            begin = cpu_time()
            _, _, terminated, truncated, _ = env.step(action)
            seconds += cpu_time() - begin
            if terminated or truncated:
                env.reset(seed=SEED)
        return seconds

    return work


EPISODES = 64
"""number of episodes of the vector environment"""


def vector_steps() -> Timed:
    """Return a workload that makes steps of many episodes in compiled calls; its time is that of one episode."""
    from sandbox.gym import SandboxVectorEnv

    env = SandboxVectorEnv("landing", EPISODES, every=5)
    env.action_space.seed(SEED)
    actions = [env.action_space.sample() for _ in range(STEPS)]

    def work() -> float:
        env.reset(seed=SEED)
        begin = cpu_time()
        for action in actions:  # episodes that end begin anew, which is timed here
            env.step(action)
        return (cpu_time() - begin) / EPISODES

    return work


ENVIRONMENTS = (
    *(
        Bench(
            f"env-{name.lower()}",
            f"{STEPS} steps of sandbox/{name}-v1 with random actions / of LunarLander-v3",
            lambda name=name: env_steps(f"sandbox/{name}-v1"),
            lambda: env_steps("LunarLander-v3"),
            target,
            missing=missing,
        )
        for name, target in (("Landing", 2.0), ("PinballFull", None))
    ),
    *(
        Bench(
            f"env-{name.lower()}",
            f"{STEPS} steps of sandbox/{name}-v3 with random actions / of Gymnasium's {name}-v3",
            lambda name=name: env_steps(f"sandbox/{name}-v3"),
            lambda name=name: env_steps(f"{name}-v3"),
            1.5,
            missing=missing,
        )
        for name in ("LunarLander", "BipedalWalker")
    ),
    Bench(
        "env-landing-vector",
        f"{STEPS} steps of an episode, one of {EPISODES} in a SandboxVectorEnv of landing / of LunarLander-v3",
        vector_steps,
        lambda: env_steps("LunarLander-v3"),
        0.3,
        missing=missing,
    ),
)
