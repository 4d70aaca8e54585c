"""Random streams: streams of one seed have distinct keys and draws, for any seed and any number of elements."""

from collections.abc import Iterator

import numpy as np
import pytest

from sandbox.scene.random_streams import Stream, draws, key_of

WITHOUT_INDEX = {
    Stream.RACK, Stream.LANDSCAPE, Stream.SHOTS, Stream.BALL_SEARCH, Stream.FLIPPERS, Stream.LANDING, Stream.KEYS,
}  # fmt: skip
"""Streams of which a seed has only one; all others have an index."""

MANY = 10_000
"""Number of indices: elements of a kind, turns or strokes."""

SEEDS = (0, 1, 12345, 2**32, 3 * 2**32 + 1, 2**63 - 1, Stream.RACK.value, Stream.COIL.value)
"""Seeds; some equal the number of a stream, some take two 32-bit words."""


def words(key: list[int]) -> tuple[int, ...]:
    """Return the 32-bit words that numpy's SeedSequence makes of a key, without trailing zeros."""
    found: list[int] = []
    for each in key:
        found.append(each & 0xFFFFFFFF)
        while each := each >> 32:
            found.append(each & 0xFFFFFFFF)
    while found and found[-1] == 0:
        found.pop()
    return tuple(found)


def keys(seed: int, many: int) -> Iterator[list[int]]:
    for stream in Stream:
        if stream in WITHOUT_INDEX:
            yield key_of(stream, seed)
        else:
            yield from (key_of(stream, seed, index) for index in range(many))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("seed", SEEDS)
def test_streams_of_a_seed_have_distinct_keys(seed):
    all_words = [words(key) for key in keys(seed, MANY)]
    assert len(set(all_words)) == len(all_words)


@pytest.mark.parametrize(
    "stream", [Stream.COIL, Stream.CURLER, Stream.FLIPPERS, Stream.LANDING, Stream.KEYS, Stream.AIM]
)
def test_seed_equal_to_a_stream_number_has_distinct_keys(stream):
    index = () if stream in WITHOUT_INDEX else (0,)
    others = {words(key_of(stream, seed, *index)) for seed in range(1000)}
    for generator in (Stream.GRID, Stream.SCATTER, Stream.EMITTER, Stream.STACK):
        for k in range(1000):
            assert words(key_of(generator, stream.value, k)) not in others


def test_keys_with_equal_words_have_equal_draws_in_numpy():
    """`words` compares keys as numpy does."""
    equal_groups = [[5, 3], [5, 3, 0], [5, 3, 0, 0]], [[5, 2**32 + 3], [5, 3, 1]]
    for group in equal_groups:
        assert len({words(key) for key in group}) == 1
        assert len({int(np.random.PCG64(key).random_raw()) for key in group}) == 1
    assert words([5, 0, 3]) != words([5, 3])
    assert np.random.PCG64([5, 0, 3]).random_raw() != np.random.PCG64([5, 3]).random_raw()


@pytest.mark.parametrize("seed", [0, 2**40])
def test_streams_of_a_seed_have_distinct_first_draws(seed):
    first_draws = [draws(s, seed, *(() if s in WITHOUT_INDEX else (k,))).random() for s in Stream for k in range(50)]
    assert len(set(first_draws)) == len(first_draws) - 49 * len(WITHOUT_INDEX)
