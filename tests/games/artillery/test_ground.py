"""Ground: nothing of it gets lost, to the last bit; craters are round; loose dirt falls onto what is left."""

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


def whole(heights: object) -> list[int]:
    """Return heights as numbers of quanta, which they are exactly."""
    counts = np.asarray(heights) / QUANTUM
    assert (counts == np.round(counts)).all()
    return [int(count) for count in counts.tolist()]


@given(st.integers(0, 50), CENTRES, RADII)
def test_what_is_taken_out_is_what_is_missing(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    crater = before.without(centre, radius)
    assert sum(whole(crater.ground.heights)) == sum(whole(before.heights)) - sum(whole(crater.removed))
    assert float(crater.ground.heights.sum()) == float(before.heights.sum()) - float(crater.removed.sum())
    assert (crater.removed >= 0.0).all()
    assert (crater.ground.heights >= 0.0).all()
    outside = np.abs(before.middles - centre[0]) >= radius
    assert not crater.removed[outside].any()
    # No column loses more than the circle is wide there, but for the rounding of both its ends.
    chord = 2.0 * np.sqrt(np.maximum(radius**2 - (before.middles - centre[0]) ** 2, 0.0))
    assert (crater.removed <= chord + QUANTUM).all()


@given(st.integers(0, 50), CENTRES, RADII)
def test_what_falls_is_what_hung(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    crater = before.without(centre, radius)
    for each in crater.loose:
        assert each.top == before.heights[each.column]
        assert each.drop == crater.removed[each.column]
        assert each.top - each.drop == crater.ground.heights[each.column]
        assert centre[1] < each.bottom + QUANTUM < each.top + 2 * QUANTUM
    hanging = {each.column for each in crater.loose}
    sunk = {k for k in range(300) if crater.removed[k] > 0.0 and k not in hanging}
    for k in sunk:  # open above: the ground ends at the lower edge of the circle, or at its foot
        half = math.sqrt(max(radius**2 - (before.middles[k] - centre[0]) ** 2, 0.0))
        assert crater.ground.heights[k] == pytest.approx(max(centre[1] - half, 0.0), abs=QUANTUM)


@given(st.integers(0, 50), CENTRES, RADII)
def test_dirt_comes_down_where_it_is_thrown(seed: int, centre: tuple[float, float], radius: float) -> None:
    before = hills(seed, 0.5)
    heap = before.with_heap(centre, radius)
    assert sum(whole(heap.ground.heights)) == sum(whole(before.heights)) - sum(whole(heap.removed))
    assert (heap.removed <= 0.0).all()
    for each in heap.loose:
        assert each.bottom - each.drop == before.heights[each.column]
        assert each.top - each.drop == heap.ground.heights[each.column]


def test_a_crater_in_solid_ground_tends_to_a_circle() -> None:
    """The chords' sum differs from their integral, πr², by O((w/r)^1.5): the circle's ends are steep."""
    radius, errors = 5.0, []
    for columns in (100, 400, 1600, 6400):
        crater = flat(50.0, 100.0, columns).without((50.3, 25.0), radius)
        area = float(crater.removed.sum()) * 100.0 / columns
        errors.append(abs(area / (math.pi * radius**2) - 1.0))
        assert errors[-1] <= (100.0 / columns / radius) ** 1.5
    assert errors[-1] < 1e-4


def test_half_a_circle_is_taken_at_the_surface_and_nothing_hangs() -> None:
    crater = flat(20.0, 100.0, 4000).without((50.0, 20.0), 5.0)
    assert float(crater.removed.sum()) * 0.025 == pytest.approx(0.5 * math.pi * 25.0, rel=1e-3)  # (w/r)^1.5 = 4e-4
    assert crater.loose == ()
    assert float(crater.ground.surface(50.0)) == pytest.approx(15.0, abs=1e-3)  # the middle is between two columns


def test_blasts_beside_and_above_take_nothing() -> None:
    ground = flat(10.0, 100.0, 100)
    for centre in ((50.0, 15.1), (-5.1, 10.0), (105.1, 10.0)):
        crater = ground.without(centre, 5.0)
        assert not crater.removed.any()
        assert (crater.ground.heights == ground.heights).all()


def test_the_surface_goes_through_the_middles_and_ends_at_the_sides() -> None:
    ground = Ground(np.array([1.0, 3.0, 2.0]), 6.0)
    assert ground.surface(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 6.0])).tolist() == [1.0, 1.0, 2.0, 3.0, 2.5, 2.0]
    assert ground.surface(np.array([-0.1, 6.1])).tolist() == [-math.inf, -math.inf]
    assert (ground.under(1.0, 0.5), ground.under(2.5, 1.0), ground.under(5.5, 1.0)) == (1.5, 3.0, 2.25)
    assert ground.points == ((0.0, 1.0), (1.0, 1.0), (3.0, 3.0), (5.0, 2.0), (6.0, 2.0))


def test_a_hundred_craters_later_all_dirt_is_accounted_for() -> None:
    random = np.random.Generator(np.random.PCG64(1))
    ground = first = hills(7, 0.4)
    taken = 0
    for k in range(100):
        place, radius = (random.uniform(0, 300), random.uniform(0, 60)), random.uniform(1, 12)
        change: Crater = ground.with_heap(place, radius) if k % 4 == 3 else ground.without(place, radius)
        ground, taken = change.ground, taken + sum(whole(change.removed))
    assert sum(whole(ground.heights)) == sum(whole(first.heights)) - taken
