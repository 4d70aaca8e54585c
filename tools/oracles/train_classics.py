"""Training of the linear policies of the certificate, in Gymnasium's environments on Box2D.

    python -m tools.oracles.train_classics LunarLander
    python -m tools.oracles.train_classics BipedalWalker

The lander learns by the cross-entropy method, the walker by augmented random search with normalised observations
(Mania, Guy and Recht 2018), which takes an hour. The weights are written beside this file.
"""

import argparse
import json
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray
from tools.oracles.gymnasium_classics import NAMES, Linear, inputs_of, make, outputs_of, play, weights_file

TRAINING_SEEDS = 10**6, 10**7
"""range of the seeds of episodes; none of the certificate"""

GENERATIONS, POPULATION, ELITE, EPISODES = 80, 100, 20, 5
"""of the lander: generations, policies of each, those that form the next, and episodes of each"""

ITERATIONS, DIRECTIONS, BEST_DIRECTIONS, STEP, NOISE = 800, 16, 8, 0.03, 0.1
"""of the walker: iterations, directions of each, those that are followed, step length, and size of a perturbation"""
TEST_INTERVAL, TEST_SEEDS = 20, range(10**8, 10**8 + 5)
"""iterations between two tests, and seeds of these; the policy with the best test is written"""
MAX_PENALTY = 5.0
"""points, largest loss of a step in training: with that of a fall, 100, the walker learns to stand still"""
PATIENCE, TEST_PATIENCE, PROGRESS = 120, 400, 0.2
"""steps within which an episode must progress by so many m, in training and in tests; else it ends"""


def mean_return(name: str, weights: Sequence[float], seeds: Sequence[int]) -> float:
    """Return the mean return of a policy."""
    env = make(name, True)
    policy = Linear(weights, env)
    total = math.fsum(play(env, policy, seed).total for seed in seeds)
    env.close()
    return total / len(seeds)


def train_lander(name: str, workers: int, seed: int = 1) -> None:
    """Train a policy by the cross-entropy method, and write its weights."""
    env = make(name, True)
    size = (inputs_of(env) + 1) * outputs_of(env)
    rng = np.random.default_rng(seed)
    mean, spread = np.zeros(size), np.ones(size)
    with ProcessPoolExecutor(workers) as pool:
        for generation in range(GENERATIONS):
            policies = mean + spread * rng.normal(size=(POPULATION, size))
            seeds = rng.integers(*TRAINING_SEEDS, EPISODES).tolist()
            tasks = [pool.submit(mean_return, name, weights.tolist(), seeds) for weights in policies]
            returns = np.asarray([task.result() for task in tasks])
            best = policies[np.argsort(returns)[-ELITE:]]
            mean = best.mean(axis=0)
            spread = best.std(axis=0) + max(0.3 * (1.0 - 2.0 * generation / GENERATIONS), 0.0)
            print(f"generation {generation}: mean {returns.mean():.1f}, best {returns.max():.1f}", flush=True)
    _write(name, seed, GENERATIONS, mean)


class Walk:
    """A linear policy of the walker in training, with running mean and variance of the observations."""

    def __init__(self, name: str) -> None:
        self.env: Any = make(name, True).unwrapped
        inputs, outputs = inputs_of(self.env), outputs_of(self.env)
        self.weights: FloatArray = np.zeros((outputs, inputs))
        self._count, self._mean, self._squares = 1, np.zeros(inputs), np.full(inputs, 0.01)

    def deviation(self) -> FloatArray:
        """Return the standard deviation of each observed number."""
        return np.asarray(np.sqrt(self._squares / self._count).clip(0.01))

    def play(self, weights: FloatArray, seed: int, patience: int, max_penalty: float) -> tuple[float, list[FloatArray]]:
        """Play an episode; return the sum of its rewards and its observations."""
        observation, _ = self.env.reset(seed=seed)
        deviation, total, far, since, seen = self.deviation(), 0.0, -math.inf, 0, []
        for k in range(1600):
            seen.append(observation)
            action = (weights @ ((observation - self._mean) / deviation)).clip(-1.0, 1.0)
            observation, reward, terminated, _, _ = self.env.step(action)
            total += max(reward, -max_penalty)
            if self.env.hull.position[0] > far + PROGRESS:
                far, since = self.env.hull.position[0], k
            if terminated or k - since > patience:
                break
        return total, seen

    def observe(self, seen: Sequence[FloatArray]) -> None:
        """Update mean and variance by each third observation."""
        for each in seen[::3]:
            self._count += 1
            difference = each - self._mean
            self._mean = self._mean + difference / self._count
            self._squares = self._squares + difference * (each - self._mean)

    def linear(self) -> FloatArray:
        """Return the weights of the same policy for observations that are not normalised, with a constant."""
        scaled = self.weights / self.deviation()
        return np.column_stack((scaled, -scaled @ self._mean)).ravel()


def train_walker(name: str, seed: int = 2) -> None:
    """Train a policy by augmented random search, and write its weights."""
    walk, rng, best = Walk(name), np.random.default_rng(seed), -math.inf
    for iteration in range(ITERATIONS):
        directions = rng.normal(size=(DIRECTIONS, *walk.weights.shape))
        episode, returns, seen = int(rng.integers(*TRAINING_SEEDS)), [], list[FloatArray]()
        for direction in directions:
            pair = [
                walk.play(walk.weights + sign * NOISE * direction, episode, PATIENCE, MAX_PENALTY) for sign in (1, -1)
            ]
            returns.append([total for total, _ in pair])
            seen += [each for _, observations in pair for each in observations]
        sides = np.asarray(returns)
        followed = np.argsort(sides.max(axis=1))[-BEST_DIRECTIONS:]
        gain = np.einsum("k,kij->ij", sides[followed, 0] - sides[followed, 1], directions[followed])
        walk.weights = walk.weights + STEP / (BEST_DIRECTIONS * sides[followed].std() + 1e-9) * gain
        walk.observe(seen)
        if iteration % TEST_INTERVAL == 0:
            test = float(np.mean([walk.play(walk.weights, k, TEST_PATIENCE, math.inf)[0] for k in TEST_SEEDS]))
            print(f"iteration {iteration}: mean {sides.mean():.1f}, test {test:.1f}", flush=True)
            if test > best:
                best = test
                _write(name, seed, iteration, walk.linear())


def _write(name: str, seed: int, iterations: int, weights: FloatArray) -> None:
    figures = {"environment": name, "seed": seed, "iterations": iterations}
    weights_file(name).write_text(json.dumps(figures | {"weights": [round(w, 5) for w in weights.tolist()]}) + "\n")


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--workers", type=int, default=2, help="processes, for the lander")
    options = parser.parse_args()
    if options.name == "LunarLander":
        train_lander(f"{options.name}-v3", options.workers)
    else:
        train_walker(f"{options.name}-v3")


if __name__ == "__main__":
    main()
