"""Ground: its amount is conserved exactly; craters are round; loose dirt falls onto the remaining ground."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.games.artillery.scene import QUANTUM
from sandbox.games.artillery.terrain import Crater, Ground
from tests.games.artillery.grounds import flat, hills

CENTRES = st.tuples(st.floats(-20, 320), st.floats(-20, 80))
RADII = st.floats(0.01, 40)


def quanta(heights: object) -> list[int]:
    """Return heights as integer multiples of the quantum; they are exact multiples."""
    counts = np.asarray(heights) / QUANTUM
    assert (counts == np.round(counts)).all()
    return [int(count) for count in counts.tolist()]


@given(st.integers(0, 50), CENTRES, RADII)
def test_crater_removes_exactly_the_reported_heights(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    crater = before.without(centre, radius)
    assert sum(quanta(crater.ground.heights)) == sum(quanta(before.heights)) - sum(quanta(crater.removed))
    assert float(crater.ground.heights.sum()) == float(before.heights.sum()) - float(crater.removed.sum())
    assert (crater.removed >= 0.0).all()
    assert (crater.ground.heights >= 0.0).all()
    outside = np.abs(before.middles - centre[0]) >= radius
    assert not crater.removed[outside].any()
    # No column loses more than the chord of the circle there, plus the rounding of both ends of the chord.
    chord = 2.0 * np.sqrt(np.maximum(radius**2 - (before.middles - centre[0]) ** 2, 0.0))
    assert (crater.removed <= chord + QUANTUM).all()


@given(st.integers(0, 50), CENTRES, RADII)
def test_loose_dirt_falls_by_the_removed_height(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    crater = before.without(centre, radius)
    for each in crater.loose:
        assert each.top == before.heights[each.column]
        assert each.drop == crater.removed[each.column]
        assert each.top - each.drop == crater.ground.heights[each.column]
        assert centre[1] < each.bottom + QUANTUM < each.top + 2 * QUANTUM
    hanging = {each.column for each in crater.loose}
    sunk = {k for k in range(300) if crater.removed[k] > 0.0 and k not in hanging}
    for k in sunk:  # open above: the ground ends at the lower edge of the circle, or at height 0
        half = math.sqrt(max(radius**2 - (before.middles[k] - centre[0]) ** 2, 0.0))
        assert crater.ground.heights[k] == pytest.approx(max(centre[1] - half, 0.0), abs=QUANTUM)


@given(st.integers(0, 50), CENTRES, RADII)
def test_heap_falls_onto_the_columns_below_it(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    heap = before.with_heap(centre, radius)
    assert sum(quanta(heap.ground.heights)) == sum(quanta(before.heights)) - sum(quanta(heap.removed))
    assert (heap.removed <= 0.0).all()
    for each in heap.loose:
        assert each.bottom - each.drop == before.heights[each.column]
        assert each.top - each.drop == heap.ground.heights[each.column]


def test_area_of_a_crater_converges_to_that_of_a_circle() -> None:
    """The sum of chords differs from their integral, πr², by O((w/r)^1.5), as the ends of the circle are steep."""
    radius, errors = 5.0, []
    for columns in (100, 400, 1600, 6400):
        crater = flat(50.0, 100.0, columns).without((50.3, 25.0), radius)
        area = float(crater.removed.sum()) * 100.0 / columns
        errors.append(abs(area / (math.pi * radius**2) - 1.0))
        assert errors[-1] <= (100.0 / columns / radius) ** 1.5
    assert errors[-1] < 1e-4


def test_crater_at_the_surface_is_half_a_circle_without_loose_dirt() -> None:
    crater = flat(20.0, 100.0, 4000).without((50.0, 20.0), 5.0)
    assert float(crater.removed.sum()) * 0.025 == pytest.approx(0.5 * math.pi * 25.0, rel=1e-3)  # (w/r)^1.5 = 4e-4
    assert crater.loose == ()
    assert float(crater.ground.surface(50.0)) == pytest.approx(15.0, abs=1e-3)  # x = 50 is between two columns


def test_blasts_beside_and_above_the_ground_remove_nothing() -> None:
    ground = flat(10.0, 100.0, 100)
    for centre in ((50.0, 15.1), (-5.1, 10.0), (105.1, 10.0)):
        crater = ground.without(centre, 5.0)
        assert not crater.removed.any()
        assert (crater.ground.heights == ground.heights).all()


def test_surface_interpolates_column_middles_and_ends_at_the_edges() -> None:
    ground = Ground(np.array([1.0, 3.0, 2.0]), 6.0)
    assert ground.surface(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 6.0])).tolist() == [1.0, 1.0, 2.0, 3.0, 2.5, 2.0]
    assert ground.surface(np.array([-0.1, 6.1])).tolist() == [-math.inf, -math.inf]
    assert (ground.under(1.0, 0.5), ground.under(2.5, 1.0), ground.under(5.5, 1.0)) == (1.5, 3.0, 2.25)
    assert ground.points == ((0.0, 1.0), (1.0, 1.0), (3.0, 3.0), (5.0, 2.0), (6.0, 2.0))


def test_dirt_is_conserved_over_a_hundred_craters_and_heaps() -> None:
    random = np.random.Generator(np.random.PCG64(1))
    ground = first = hills(7, 0.4)
    removed = 0
    for k in range(100):
        centre, radius = (random.uniform(0, 300), random.uniform(0, 60)), random.uniform(1, 12)
        change: Crater = ground.with_heap(centre, radius) if k % 4 == 3 else ground.without(centre, radius)
        ground, removed = change.ground, removed + sum(quanta(change.removed))
    assert sum(quanta(ground.heights)) == sum(quanta(first.heights)) - removed
