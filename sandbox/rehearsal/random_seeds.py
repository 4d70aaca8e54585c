"""Random numbers of a game that are the same in each of its runs."""

import random
import sys
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from sandbox.rehearsal.game_clock import is_own_code

SEED_BITS = 32


@contextmanager
def seeded(seed: int) -> Iterator[None]:
    """Seed `random`, `numpy.random` and each generator that the program makes without a seed, within a `with` block.

    A program that states its own seeds keeps them. `random.SystemRandom`, `secrets` and `os.urandom` are not affected.

    Args:
        seed: at least 0.
    """
    calls: Counter[tuple[str, int]] = Counter()

    def next_seed() -> int | None:
        """Return the seed of a generator by the line of the program that makes it; None for the standard library."""
        frame = sys._getframe(2)
        while frame.f_back is not None and Path(frame.f_code.co_filename).name == "random.py":
            frame = frame.f_back
        file, line = Path(frame.f_code.co_filename).name, frame.f_lineno
        if is_own_code(frame.f_code.co_filename):
            return None
        calls[file, line] += 1
        return _number(seed, zlib.crc32(file.encode()), line, calls[file, line])

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
        random.seed(_number(seed, 0))
        np.random.seed(_number(seed, 1))
        yield


def _number(*parts: int) -> int:
    return int(np.random.SeedSequence(parts).generate_state(1)[0])


def random_seed() -> int:
    """Return a new seed, of `SEED_BITS` bits."""
    return random.SystemRandom().getrandbits(SEED_BITS)
