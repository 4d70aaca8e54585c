"""Sampled points: their grammar, ranges, spread and reproducibility."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.batch.sampling import BLOCK, MAX_LATIN, Sampling, sampled_axis
from sandbox.batch.sweep import SampledRange
from sandbox.scene.files.overrides import AddressError


def ranges(*texts: str) -> list[SampledRange]:
    found = [SampledRange.parse(text) for text in texts]
    assert None not in found
    return [each for each in found if each is not None]


def points(sampling: str, *texts: str) -> np.ndarray:
    axis = sampled_axis(ranges(*texts), Sampling.parse(sampling))
    return np.array([axis.points[k] for k in range(len(axis.points))])


def test_sampling_is_parsed() -> None:
    assert Sampling.parse("64") == Sampling(64, "latin", 0)
    assert Sampling.parse("64:sobol") == Sampling(64, "sobol", 0)
    assert Sampling.parse("64:latin:7") == Sampling(64, "latin", 7)
    assert [Sampling.parse(text).is_balanced for text in ("64:sobol", "60:sobol", "60")] == [True, False, True]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a sample is N"),
        ("x", "a sample is N"),
        ("-3", "a sample is N"),
        ("3.5", "a sample is N"),
        ("3:halton", "a sample is N"),
        ("3:sobol:x", "a sample is N"),
        ("3:sobol:1:2", "a sample is N"),
        ("٣", "a sample is N"),
        ("0", "at least 1 point"),
        (f"{MAX_LATIN + 1}", "draw 1000001:sobol"),
        ("100000001:sobol", "SANDBOX_MAX_RUNS"),
        ("9" * 400, "a sample is N"),
    ],
)
def test_invalid_sampling_is_rejected(text: str, message: str) -> None:
    with pytest.raises(AddressError, match=message):
        Sampling.parse(text)


@pytest.mark.parametrize("text", ["a.b=1:2:3", "a.b=1,2", "a.b=[1:2]", "a.b=1:2:lin", "a.b=x:2", "a.b=1"])
def test_sweep_of_another_form_is_no_sampled_range(text: str) -> None:
    assert SampledRange.parse(text) is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a.b=2:1", "LOW <= HIGH"),
        ("a.b=1:inf", "finite ends"),
        ("a.b=0:1:log", "0 < LOW"),
        ("a.b=0.5:3:int", "integer ends"),
    ],
)
def test_invalid_range_is_rejected(text: str, message: str) -> None:
    with pytest.raises(AddressError, match=message):
        SampledRange.parse(text)


@given(st.floats(-1e6, 1e6), st.floats(0.0, 1e6), st.floats(0.0, 1.0, exclude_max=True))
def test_values_are_within_their_range(low: float, width: float, fraction: float) -> None:
    (plain,) = ranges(f"a.b={low!r}:{low + width!r}")
    # 1e-15: rounding of the sum
    assert low - 1e-15 * abs(low) <= plain.value(fraction) <= low + width + 1e-15 * (abs(low) + width)
    (whole,) = ranges(f"a.b={math.floor(low)}:{math.ceil(low + width)}:int")
    assert isinstance(whole.value(fraction), int)
    assert math.floor(low) <= whole.value(fraction) <= math.ceil(low + width)


def test_latin_hypercube_has_one_point_in_each_slice_of_every_range() -> None:
    found = points("50:latin:3", "a.b=0:1", "a.c=1:100:log", "a.d=-5:5")
    fractions = np.stack([found[:, 0], np.log(found[:, 1]) / math.log(100.0), (found[:, 2] + 5.0) / 10.0])
    for column in fractions:
        assert sorted(np.floor(column * 50.0).astype(int).tolist()) == list(range(50))


def test_sobol_points_fill_each_pair_of_ranges_evenly() -> None:
    found = points("64:sobol:3", "a.b=0:1", "a.c=0:1")
    cells = np.floor(found * 8.0).astype(int)
    assert len({(x, y) for x, y in cells.tolist()}) == 64  # one in each of 8 × 8 squares


def test_integers_are_equally_frequent() -> None:
    found = points("4000:latin", "a.b=1:4:int")[:, 0]
    assert [np.count_nonzero(found == k) for k in (1, 2, 3, 4)] == [1000] * 4


@pytest.mark.parametrize("method", ["latin", "sobol"])
def test_points_depend_on_the_seed_alone(method: str) -> None:
    first, again, other = (points(f"32:{method}:{seed}", "a.b=0:1", "a.c=0:1") for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_sobol_points_are_the_same_in_any_order_of_access() -> None:
    count = 2 * BLOCK + 3
    axis = sampled_axis(ranges("a.b=0:1", "a.c=0:1"), Sampling(count, "sobol", 5))
    forward = [axis.points[k] for k in range(count)]
    assert axis.points[-1] == forward[-1]
    for k in (2 * BLOCK, 0, BLOCK - 1, BLOCK, 7):
        assert axis.points[k] == forward[k]
    with pytest.raises(IndexError):
        _ = axis.points[count]
