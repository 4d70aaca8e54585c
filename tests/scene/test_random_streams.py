"""Streams: no two purposes draw the same numbers, for any seed and any number of elements."""

from collections.abc import Iterator

import numpy as np
import pytest

from sandbox.scene.files.load import from_document
from sandbox.scene.random_streams import Stream, draws, key_of

WITHOUT_INDEX = {
    Stream.RACK,
    Stream.LANDSCAPE,
    Stream.SHOTS,
    Stream.BALL_SEARCH,
    Stream.FLIPPERS,
    Stream.LANDING,
    Stream.KEYS,
}
"""Of which a seed has one; of all others there are several."""

MANY = 10_000
"""Elements of a kind, turns or strokes."""

SEEDS = (0, 1, 2, 3, 4, 7, 11, 12, 12345, 2**32 - 1, 2**32, 3 * 2**32 + 1, 2**63 - 1, *(s.value for s in Stream))
"""Some that look like the numbers of streams, and some of two words."""


def words(key: list[int]) -> tuple[int, ...]:
    """Return what numpy's seed sequence makes of a key: words of 32 bits, without trailing zeros."""
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


@pytest.mark.parametrize("seed", SEEDS)
def test_every_stream_of_a_seed_has_a_key_of_its_own(seed):
    every = [words(key) for key in keys(seed, MANY)]
    assert len(set(every)) == len(every)


@pytest.mark.parametrize(
    "stream", [Stream.COIL, Stream.CURLER, Stream.FLIPPERS, Stream.LANDING, Stream.KEYS, Stream.AIM]
)
def test_seed_that_is_the_number_of_a_stream_has_keys_of_its_own(stream):
    index = () if stream in WITHOUT_INDEX else (0,)
    others = {words(key_of(stream, seed, *index)) for seed in range(1000)}
    for generator in (Stream.GRID, Stream.SCATTER, Stream.EMITTER, Stream.STACK):
        for k in range(1000):
            assert words(key_of(generator, stream.value, k)) not in others


def test_words_are_what_numpy_makes_of_a_key():
    """The rules by which keys are told apart here are numpy's own."""
    alike = [[5, 3], [5, 3, 0], [5, 3, 0, 0]], [[5, 2**32 + 3], [5, 3, 1]]
    for group in alike:
        assert len({words(key) for key in group}) == 1
        assert len({int(np.random.PCG64(key).random_raw()) for key in group}) == 1
    assert words([5, 0, 3]) != words([5, 3])
    assert np.random.PCG64([5, 0, 3]).random_raw() != np.random.PCG64([5, 3]).random_raw()


@pytest.mark.parametrize("seed", [0, 1, 3, 2**40])
def test_every_stream_of_a_seed_begins_with_other_draws(seed):
    begins = [draws(s, seed, *(() if s in WITHOUT_INDEX else (k,))).random() for s in Stream for k in range(50)]
    assert len(set(begins)) == len(begins) - 49 * len(WITHOUT_INDEX)


def test_rack_and_first_stack_draw_apart():
    assert draws(Stream.RACK, 7).random() != draws(Stream.STACK, 7, 0).random()


def test_jitter_of_a_stack_follows_the_seed():
    stack = {"name": "s", "base": [0, 0], "size": [1, 1], "columns": 1, "rows": 4, "jitter": 0.1}
    places = [from_document({"world": {"seed": seed}, "stack": [stack]}).bodies.position[:, 0] for seed in (1, 1, 2)]
    assert (places[0] == places[1]).all()
    assert (places[0] != places[2]).all()
