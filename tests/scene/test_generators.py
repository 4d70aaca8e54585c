"""Grids, scatters and emitters: the positions, velocities and lifetimes that they expand to."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.compile.generators import GeneratorError, expand, lifetimes
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Emitter, Grid, Scatter
from sandbox.scene.description.world import World
from sandbox.scene.validate.scene import crosscheck

GRID = Grid(origin=(1.0, 2.0), columns=3, rows=2, spacing=(0.5, -4.0), radius=0.1)
SCATTER = Scatter(count=200, lower=(-5.0, 0.0), upper=(5.0, 20.0), radius=0.1)
EMITTER = Emitter(position=(3.0, 4.0), count=200, velocity_min=(-1.0, 8.0), velocity_max=(1.0, 12.0))
RANDOM = {
    "grid": Grid(origin=(0.0, 0.0), columns=20, spacing=(1.0, 1.0), radius=0.1, jitter=0.1, velocity_jitter=1.0),
    "scatter": Scatter(count=20, lower=(0.0, 0.0), upper=(9.0, 9.0), radius=0.1, velocity_jitter=1.0),
    "emitter": Emitter(position=(0.0, 0.0), count=20, velocity_min=(0.0, 0.0), velocity_max=(1.0, 1.0)),
}


def assert_uniform(values: np.ndarray, low: float, high: float) -> None:
    """Check that values are uniform in [low, high) by their range, mean and variance."""
    n, width = len(values), high - low
    assert low <= values.min()
    assert values.max() <= high
    assert abs(values.mean() - (low + high) / 2) < 5 * width / math.sqrt(12 * n)  # 5 σ of a mean of n
    assert abs(values.var() - width**2 / 12) < 5 * width**2 / math.sqrt(180 * n)  # 5 σ of the variance of n


def test_grid_is_numbered_along_rows_from_the_origin() -> None:
    position, velocity = expand(GRID, 0, 0)
    assert position.tolist() == [[1.0, 2.0], [1.5, 2.0], [2.0, 2.0], [1.0, -2.0], [1.5, -2.0], [2.0, -2.0]]
    assert velocity.tolist() == [[0.0, 0.0]] * 6
    assert np.array_equal(expand(GRID, 0, 0), expand(GRID, 99, 3))  # without jitter there is nothing to draw


def test_grid_jitter_moves_each_coordinate_by_up_to_its_amount() -> None:
    grid = Grid(origin=(0.0, 0.0), columns=50, rows=50, spacing=(1.0, 1.0), radius=0.1, jitter=0.2, velocity=(3.0, 0.0),
                velocity_jitter=0.5)  # fmt: skip
    regular = Grid(origin=(0.0, 0.0), columns=50, rows=50, spacing=(1.0, 1.0), radius=0.1)
    position, velocity = expand(grid, 7, 0)
    offset = position - expand(regular, 7, 0)[0]
    for axis in (0, 1):
        assert_uniform(offset[:, axis], -0.2 - 1e-14, 0.2 + 1e-14)  # rounding of the difference of numbers up to 50
    assert_uniform(velocity[:, 0], 2.5, 3.5)
    assert_uniform(velocity[:, 1], -0.5, 0.5)


def test_scatter_is_uniform_in_its_box_without_overlap() -> None:
    position, velocity = expand(SCATTER, 3, 0)
    assert_uniform(position[:, 0], -5.0, 5.0)
    assert_uniform(position[:, 1], 0.0, 20.0)
    assert not velocity.any()
    distance = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1))
    assert distance[np.triu_indices(200, 1)].min() >= 0.2


def test_scatter_redraws_the_later_ball_of_an_overlap() -> None:
    scatter = SCATTER.model_copy(update={"radius": 0.3})
    first = np.random.Generator(np.random.PCG64([3, 1, 0])).random((200, 2)) * [10.0, 20.0] + [-5.0, 0.0]
    position, _ = expand(scatter, 3, 0)
    kept = (position == first).all(axis=1)
    assert kept[0]
    assert 20 < kept.sum() < 200
    distance = np.hypot(*(first[:, None] - first[None]).transpose(2, 0, 1))
    overlapping = np.triu(distance < 0.6, 1).any(axis=0)  # overlaps an earlier ball
    assert np.array_equal(kept & overlapping, np.zeros(200, dtype=bool))


@given(st.integers(0, 2**63 - 1), st.integers(1, 40), st.floats(0.01, 1.0), st.floats(0.1, 0.3), st.floats(0.2, 5.0))
def test_scatter_never_overlaps(seed: int, count: int, radius: float, coverage: float, stretch: float) -> None:
    side = math.sqrt(count * math.pi * radius**2 / coverage)
    scatter = Scatter(count=count, lower=(0.0, 0.0), upper=(side * stretch, side / stretch), radius=radius)
    position, _ = expand(scatter, seed, 0)
    assert position.shape == (count, 2)
    assert (position >= 0).all()
    assert (position <= [side * stretch, side / stretch]).all()
    distance = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + 1e9 * np.eye(count)
    assert distance.min() >= 2 * radius


@pytest.mark.parametrize("collides", ["none", "fixed"])
def test_scatter_without_mutual_collisions_may_overlap(collides: str) -> None:
    scatter = SCATTER.model_copy(update={"radius": 100.0, "collides": collides})
    assert expand(scatter, 0, 0)[0].shape == (200, 2)


@pytest.mark.parametrize("radius", [0.9, 0.6])
def test_scatter_that_does_not_fit_raises(radius: float) -> None:
    with pytest.raises(GeneratorError, match=r"do not fit.*use\s+fewer") as caught:
        expand(SCATTER.model_copy(update={"radius": radius}), 0, 4)
    assert caught.value.location == ("scatter", 4, "count")


def test_emitter_draws_velocities_between_its_bounds() -> None:
    emitter = EMITTER.model_copy(update={"count": 5000})
    position, velocity = expand(emitter, 1, 0)
    assert (position == [3.0, 4.0]).all()
    assert_uniform(velocity[:, 0], -1.0, 1.0)
    assert_uniform(velocity[:, 1], 8.0, 12.0)
    assert abs(np.corrcoef(velocity.T)[0, 1]) < 5 / math.sqrt(5000)  # 5 σ of a correlation of 5,000 independent pairs


@pytest.mark.parametrize("kind", RANDOM)
def test_draws_depend_on_the_seed_and_the_index_only(kind: str) -> None:
    first, again, other_seed, other_index = (
        expand(RANDOM[kind], seed, k) for seed, k in ((5, 0), (5, 0), (6, 0), (5, 1))
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other_seed)
    assert not np.array_equal(first, other_index)


@pytest.mark.parametrize("kind", RANDOM)
def test_added_generators_do_not_change_earlier_ones(kind: str) -> None:
    field = f"{kind}s"
    alone = Scene(world=World(seed=4), **{field: (RANDOM[kind],)}).bodies
    several = {f"{other}s": (generator,) for other, generator in RANDOM.items()}
    several[field] = (RANDOM[kind], RANDOM[kind].model_copy(update={"name": "more"}))
    extended = Scene(world=World(seed=4), **several).bodies
    earlier = [name in alone.names for name in extended.names]
    assert sum(earlier) == 20
    assert np.array_equal(extended.position[earlier], alone.position)
    assert np.array_equal(extended.velocity[earlier], alone.velocity)


def test_draws_of_an_emitter_are_unchanged_between_releases() -> None:
    # PCG64 keyed by [seed, kind, index]: numpy guarantees that the stream of `random()` does not change
    expected = np.random.Generator(np.random.PCG64([1, 2, 0])).random((200, 2)) * [2.0, 4.0] + [-1.0, 8.0]
    assert np.array_equal(expand(EMITTER, 1, 0)[1], expected)


def test_lifetimes_are_uniform_about_the_given_one_and_sorted() -> None:
    emitter = EMITTER.model_copy(update={"count": 5000, "lifetime": 3.0, "lifetime_jitter": 0.5})
    drawn = lifetimes(emitter, 1, 0)
    assert_uniform(drawn, 2.5, 3.5)
    assert (np.diff(drawn) >= 0).all()
    velocity = expand(emitter, 1, 0)[1]
    assert abs(np.corrcoef(drawn, velocity[:, 0])[0, 1]) < 5 / math.sqrt(5000)  # 5 σ of 5,000 independent pairs


def test_lifetimes_are_drawn_after_the_velocities() -> None:
    emitter = EMITTER.model_copy(update={"lifetime": 3.0, "lifetime_jitter": 0.5})
    random = np.random.Generator(np.random.PCG64([7, 2, 4]))
    velocity = random.random((200, 2)) * [2.0, 4.0] + [-1.0, 8.0]
    assert np.array_equal(expand(emitter, 7, 4)[1], velocity)
    assert np.array_equal(lifetimes(emitter, 7, 4), np.sort(3.0 + (random.random(200) * 2.0 - 1.0) * 0.5))


def test_bodies_have_the_lifetime_of_their_emitter() -> None:
    limited = EMITTER.model_copy(update={"lifetime": 3.0})
    bodies = Scene(emitters=(EMITTER, limited), grids=(GRID,)).bodies
    assert bodies.lifetime.tolist() == [np.inf] * 206 + [3.0] * 200
    assert not bodies.born.any()


@pytest.mark.parametrize(
    ("update", "key", "words"),
    [
        ({"lifetime_jitter": 0.5}, "lifetime_jitter", "needs a `lifetime`"),
        ({"lifetime": 1.0, "lifetime_jitter": 1.0}, "lifetime_jitter", "less than `lifetime`"),
        ({"colours": ("#000000", "#ffffff")}, "colours", "need a `lifetime`"),
        ({"lifetime": 1.0, "colour": "#000000", "colours": ("#000000", "#ffffff")}, "colours", "with `colour`"),
    ],
)
def test_inconsistent_lifetime_keys_are_faults(update: dict[str, object], key: str, words: str) -> None:
    faults = crosscheck(Scene(emitters=(EMITTER, EMITTER.model_copy(update=update))))
    ((location, message),) = faults
    assert location == ("emitter", 1, key)
    assert words in message
