"""Certificate of fidelity: Gymnasium's Box2D environments against those of `sandbox.gym`, by episodes of policies.

    pip install "gymnasium[box2d]"
    python -m tools.oracles.gymnasium_classics LunarLander

The tables of docs/results/gymnasium.md. Each policy plays the same number of episodes in both environments, with
different seeds, so that the samples are independent. A second sample of Gymnasium's own environment shows what chance
alone makes of it. `train_classics` trains the policies that are played.
"""

import argparse
import json
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from scipy import stats

from sandbox.arrays import FloatArray

Policy = Callable[[FloatArray], Any]

POLICIES = "random", "heuristic", "trained"
ACTION_SEEDS = 10**6
"""added to the seed of an episode for that of random actions, which would else repeat the numbers of its start"""
CHUNK = 25
"""episodes of a task of a worker"""


class Episode(NamedTuple):
    """Result of one episode."""

    total: float
    """return"""
    length: int
    """steps"""
    observation: tuple[float, ...]
    """that of a random step of the episode, so that the observations of several episodes are independent"""


class Linear:
    """Linear policy: the action with the largest output, or the outputs, between −1 and 1."""

    def __init__(self, weights: Sequence[float], env: gymnasium.Env[Any, Any]) -> None:
        """Create a policy for an environment from its weights."""
        self._matrix = np.asarray(weights).reshape(-1, inputs_of(env) + 1)
        self._is_discrete = isinstance(env.action_space, gymnasium.spaces.Discrete)

    def __call__(self, observation: FloatArray) -> Any:
        """Return the action for an observation."""
        outputs = self._matrix[:, :-1] @ observation + self._matrix[:, -1]
        return int(outputs.argmax()) if self._is_discrete else outputs.clip(-1.0, 1.0)


def inputs_of(env: gymnasium.Env[Any, Any]) -> int:
    """Return the number of numbers of an observation."""
    return int(np.prod(env.observation_space.shape or (0,)))


def outputs_of(env: gymnasium.Env[Any, Any]) -> int:
    """Return the number of actions, or of numbers of an action."""
    space = env.action_space
    return int(space.n) if isinstance(space, gymnasium.spaces.Discrete) else int(np.prod(space.shape or ()))


def make(name: str, peer: bool) -> gymnasium.Env[Any, Any]:
    """Return Gymnasium's environment, or that of the sandbox, with its limit of steps."""
    if not peer:
        import sandbox.gym  # registers the environments

        assert sandbox.gym.__name__
    return gymnasium.make(name if peer else f"sandbox/{name}", disable_env_checker=True)


def policy_of(kind: str, name: str, env: gymnasium.Env[Any, Any], seed: int) -> Policy:
    """Return a policy for one episode."""
    if kind == "random":
        env.action_space.seed(seed + ACTION_SEEDS)
        return lambda _: env.action_space.sample()
    if kind == "trained":
        return Linear(json.loads(weights_file(name).read_text())["weights"], env)
    if name.startswith("LunarLander"):
        from gymnasium.envs.box2d.lunar_lander import heuristic

        return lambda observation: heuristic(env, observation)  # type: ignore[no-untyped-call]  # of gymnasium
    from gymnasium.envs.box2d.bipedal_walker import BipedalWalkerHeuristics

    walker = BipedalWalkerHeuristics()
    walker.a = np.zeros(4)
    return lambda observation: walker.step_heuristic(observation).copy()  # type: ignore[no-untyped-call]


def weights_file(name: str) -> Path:
    """Return the file with the weights of the trained policy."""
    return Path(__file__).with_name(f"{name.partition('-')[0].lower()}_policy.json")


def play(env: gymnasium.Env[Any, Any], policy: Policy, seed: int) -> Episode:
    """Play an episode."""
    observation, _ = env.reset(seed=seed)
    seen, total, ended = [observation], 0.0, False
    while not ended:
        observation, reward, terminated, truncated, _ = env.step(policy(observation))
        seen.append(observation)
        total, ended = total + float(reward), terminated or truncated
    chosen = seen[int(np.random.default_rng(seed).integers(len(seen)))]
    return Episode(total, len(seen) - 1, tuple(chosen.tolist()))


def play_many(name: str, peer: bool, kind: str, seeds: range) -> list[Episode]:
    """Play the episodes of seeds."""
    env = make(name, peer)
    found = [play(env, policy_of(kind, name, env, seed), seed) for seed in seeds]
    env.close()
    return found


def sample(pool: ProcessPoolExecutor, name: str, peer: bool, kind: str, seeds: range) -> list[Episode]:
    """Play the episodes of seeds in several processes."""
    tasks = [pool.submit(play_many, name, peer, kind, seeds[k : k + CHUNK]) for k in range(0, len(seeds), CHUNK)]
    return [episode for task in tasks for episode in task.result()]


class Comparison(NamedTuple):
    """Two samples of one quantity."""

    means: tuple[float, float]
    deviations: tuple[float, float]
    distance: float
    """largest distance of the distribution functions (Kolmogorov and Smirnov)"""
    probability: float
    """of a distance as large by chance"""
    effect: float
    """difference of the means in standard deviations (Cohen's d)"""

    @classmethod
    def of(cls, first: FloatArray, second: FloatArray) -> "Comparison":
        """Compare two samples."""
        test = stats.ks_2samp(first, second, method="asymp")
        deviations = float(first.std(ddof=1)), float(second.std(ddof=1))
        pooled = math.sqrt(0.5 * (deviations[0] ** 2 + deviations[1] ** 2))
        means = float(first.mean()), float(second.mean())
        effect = (means[1] - means[0]) / pooled if pooled > 0.0 else 0.0
        return cls(means, deviations, float(test.statistic), float(test.pvalue), effect)


def _row(label: str, peer: FloatArray, own: FloatArray, again: FloatArray) -> str:
    found, chance = Comparison.of(peer, own), Comparison.of(peer, again)
    sides = " | ".join(f"{m:.3g} ± {s:.3g}" for m, s in zip(found.means, found.deviations, strict=True))
    figures = f"{found.effect:+.2f} | {found.distance:.3f} | {found.probability:.2g} | {chance.distance:.3f}"
    return f"| {label} | {sides} | {figures} |"


def certificate(name: str, policies: Sequence[str], episodes: int, workers: int) -> None:
    """Print the tables of an environment."""
    observed: Sequence[str] = make(name, False).get_wrapper_attr("observed")
    with ProcessPoolExecutor(workers) as pool:
        for kind in policies:
            peer = sample(pool, name, True, kind, range(episodes))
            own = sample(pool, name, False, kind, range(episodes, 2 * episodes))
            again = sample(pool, name, True, kind, range(2 * episodes, 3 * episodes))
            sides = [peer, own, again]
            print(f"\n{kind} policy, {episodes} episodes each\n")
            print("| | Gymnasium | sandbox | effect d | KS distance | p | KS distance by chance |")
            print("|---|---|---|---|---|---|---|")
            print(_row("return", *(np.asarray([e.total for e in side]) for side in sides)))
            print(_row("length, steps", *(np.asarray([float(e.length) for e in side]) for side in sides)))
            for k, label in enumerate(observed):
                print(_row(label, *(np.asarray([e.observation[k] for e in side]) for side in sides)), flush=True)
            if kind == "trained":
                _print_transfer(peer, own)


def _print_transfer(peer: Sequence[Episode], own: Sequence[Episode]) -> None:
    """Print the return of the trained policy in parts of that in Gymnasium's environment, with its 95 % interval."""
    rng = np.random.default_rng(0)
    first, second = (np.asarray([e.total for e in side]) for side in (peer, own))
    means = [rng.choice(side, (2000, len(side))).mean(axis=1) for side in (first, second)]
    low, high = np.quantile(means[1] / means[0], (0.025, 0.975))
    print(f"\nreturn carried over: {second.mean() / first.mean():.1%} ({low:.1%} to {high:.1%})")


NAMES = "LunarLander", "BipedalWalker"
"""of the environments"""


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--policies", nargs="+", choices=POLICIES, default=POLICIES, help="default: all")
    parser.add_argument("--episodes", type=int, default=1000, help="episodes of each policy and side")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    options = parser.parse_args()
    certificate(f"{options.name}-v3", options.policies, options.episodes, options.workers)


if __name__ == "__main__":
    main()
