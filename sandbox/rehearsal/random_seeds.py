"""Random numbers of a game that are the same in each of its runs."""

import random
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import count
from typing import Any
from unittest.mock import patch

import numpy as np

SEED_BITS = 32


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Seed `random` and `numpy.random`, within a `with` block, and each generator that is made without a seed.

    A program that states its own seeds keeps them. `random.SystemRandom`, `secrets` and `os.urandom` are not affected.

    Args:
        seed: at least 0.
    """
    numbers = count()

    def next_seed() -> int:
        return int(np.random.SeedSequence((seed, next(numbers))).generate_state(1)[0])

    own_seed = random.Random.seed

    def seed_generator(self: random.Random, a: Any = None, version: int = 2) -> None:
        own_seed(self, next_seed() if a is None else a, version)

    make = np.random.default_rng

    def default_rng(seed: Any = None) -> np.random.Generator:
        return make(next_seed() if seed is None else seed)

    seed_legacy = np.random.seed

    def legacy_seed(seed: Any = None) -> None:
        seed_legacy(next_seed() if seed is None else seed)

    with ExitStack() as stack:
        stack.enter_context(patch.object(random.Random, "seed", seed_generator))
        # The functions of the module are bound to the method before it was replaced.
        stack.enter_context(patch.object(random, "seed", random._inst.seed))
        stack.enter_context(patch.object(np.random, "default_rng", default_rng))
        stack.enter_context(patch.object(np.random, "seed", legacy_seed))
        random.seed(next_seed())
        np.random.seed(next_seed())
        yield


def random_seed() -> int:
    """Return a new seed, of `SEED_BITS` bits."""
    return random.SystemRandom().getrandbits(SEED_BITS)
