"""The grammar of `--sweep` and `--sample`: keys, lists, ranges and repeated keys, and sampled points."""

import math
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.batch.sampling import BLOCK, MAX_LATIN, Sampling, sampled_axis
from sandbox.batch.sweep import SampledRange, parse_sweep, repeated_keys
from sandbox.resource_limits import RUNS
from sandbox.scene.files.overrides import AddressError


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("solver.dt=0.1,0.01", "solver.dt", [0.1, 0.01]),
        ("solver.half_kick=true,false", "solver.half_kick", [True, False]),
        ("solver.integrator=rk4,leapfrog", "solver.integrator", ["rk4", "leapfrog"]),
        ("world.gravity=[0,-9.81],[0, -1.62]", "world.gravity", [[0, -9.81], [0, -1.62]]),
        ("title=\"a, b\",'c'", "title", ["a, b", "c"]),
        ('title="1:2:3"', "title", ["1:2:3"]),
        ('ball."a=b".mass=1,2', 'ball."a=b".mass', [1, 2]),
        ("solver.dt=0:1:5", "solver.dt", [0, 0.25, 0.5, 0.75, 1]),
        ("solver.dt=1:0:3", "solver.dt", [1, 0.5, 0]),
        ("solver.dt=0.001:0.1:3:log", "solver.dt", [0.001, 0.01, 0.1]),
        ("solver.substeps=1:8:4:log", "solver.substeps", [1, 2, 4, 8]),
        ("ball.a.mass=-2:2:3", "ball.a.mass", [-2, 0, 2]),
    ],
)
def test_sweep_is_a_key_and_values(text: str, key: str, values: list[object]) -> None:
    found, swept = parse_sweep(text)
    assert (found, list(swept)) == (key, values)


@given(st.integers(1, 60), st.integers(1, 60), st.integers(1, 200))
def test_whole_values_of_a_range_with_integer_ends_are_integers(low: int, width: int, count: int) -> None:
    _, values = parse_sweep(f"x={low}:{low + width}:{count}")
    for k, value in enumerate(values):
        whole = count == 1 or k * width % (count - 1) == 0
        assert isinstance(value, int) == whole
        # Two roundings of numbers up to 120.
        assert value == pytest.approx(low + (k * width / (count - 1) if count > 1 else 0), rel=1e-15, abs=3e-14)
    assert all(isinstance(value, float) for value in parse_sweep(f"x={low}.0:{low + width}.0:{count}")[1])


@given(st.floats(1e-9, 1e9), st.floats(1.0, 1e9), st.integers(2, 200))
def test_log_range_has_equal_factors_and_exact_ends(low: float, factor: float, count: int) -> None:
    high = low * factor
    _, values = parse_sweep(f"x={low!r}:{high!r}:{count}:log")
    assert (len(values), values[0], values[-1]) == (count if low < high else 1, low, high)
    for k, value in enumerate(values):
        # pow of up to 1e9 rounds its exponent by 1e-16, and its result by 20 times that.
        assert math.log(value / low) == pytest.approx(math.log(factor) * k / (count - 1), abs=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("solver.dt", "is not KEY=VALUE"), ("=1,2", "is not KEY=VALUE"), ("solver.dt=", "a value is missing"),
        ("solver.dt=1,,2", "a value is missing"), ("solver.dt=1:2:2.5", "a range is LOW:HIGH:N"),
        ("solver.dt=a:2:3", "a range is LOW:HIGH:N"), ("solver.dt=1:2:0", "at least 1 value"),
        (f"solver.dt=1:2:{RUNS.default + 1}", "set SANDBOX_MAX_RUNS=110_000_000"),
        ("solver.dt=1:inf:3", "finite ends"), ("solver.dt=-1e308:1e308:3", "finite ends"),
        ("solver.dt=1" + "0" * 400 + ":2:3", "finite ends"), ("solver.dt=1:2:3:lin", "'lin' is unknown"),
        ("solver.dt=0:2:3:log", "0 < LOW <= HIGH"), ("solver.dt=2:1:3:log", "0 < LOW <= HIGH"),
        ("solver.dt=1e-300:1e300:3:log", "0 < LOW <= HIGH"),
    ],
)  # fmt: skip
def test_invalid_sweep_is_rejected(text: str, message: str) -> None:
    with pytest.raises(AddressError, match=message):
        parse_sweep(text)


@given(st.text(max_size=20))
def test_any_text_is_a_sweep_or_rejected(text: str) -> None:
    try:
        key, values = parse_sweep(text)
    except AddressError as error:
        assert str(error)
    else:
        assert key
        assert values


@given(
    st.lists(
        st.integers() | st.booleans() | st.lists(st.integers(), max_size=3) | st.sampled_from(["a,b", "[", "c"]),
        min_size=1,
        max_size=5,
    )
)
def test_listed_values_are_parsed_as_toml(values: list[object]) -> None:
    texts = [str(v).lower() if isinstance(v, bool) else f'"{v}"' if isinstance(v, str) else str(v) for v in values]
    key, found = parse_sweep(f"x={','.join(texts)}")
    parsed = tomllib.loads(f"x = [{','.join(texts)}]")["x"]
    assert (key, found) == ("x", [value for k, value in enumerate(parsed) if not _contains_equal(value, parsed[:k])])


def _contains_equal(value: object, others: list[object]) -> bool:
    """Return whether an equal value of the same type is among others: 1, 1.0 and true are different."""
    return any(type(other) is type(value) and repr(other) == repr(value) for other in others)


@pytest.mark.parametrize("values", [",".join(["a"] * 10**5), "1:1:1000000", '"' + "," * 10**5, "[" + "," * 10**5])
def test_equal_values_of_a_sweep_are_merged(values: str) -> None:
    assert len(parse_sweep(f"title={values}")[1]) == 1


@pytest.mark.parametrize(
    ("overrides", "sweeps", "seeds", "repeated"),
    [
        ([], ["world.seed=1,2"], 2, [("--sweep", "world.seed")]),
        (["world.seed=1"], [], 2, [("--set", "world.seed")]),
        (["solver.dt=1"], ["solver.dt=1,2"], None, [("--sweep", "solver.dt")]),
        ([], ["ball[0].mass=1", "ball.0.mass=2"], None, [("--sweep", "ball.0.mass")]),
        (["solver.dt=1"], ["world.seed=1,2"], None, []),
        (["nonsense"], ["ball..mass=1", "ball..mass=2"], 2, []),
    ],
)
def test_repeated_keys_are_found(overrides, sweeps, seeds, repeated):
    faults = repeated_keys(overrides, sweeps, seeds)
    assert [(fault.file, fault.path) for fault in faults] == repeated


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
        ("", "a sample is N"), ("x", "a sample is N"), ("3:halton", "a sample is N"), ("3:sobol:1:2", "a sample is N"),
        ("٣", "a sample is N"), ("0", "at least 1 point"), (f"{MAX_LATIN + 1}", "draw 1000001:sobol"),
        ("100000001:sobol", "SANDBOX_MAX_RUNS"), ("9" * 400, "a sample is N"),
    ],
)  # fmt: skip
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
