import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.missed_contacts.swept_geometry import (
    CLEAR,
    DEEP,
    JUMP,
    approaching,
    closest_to_origin,
    closest_to_segment,
    crosses,
)
from sandbox.scene.geometry.vectors import offset_from_segment

FRACTIONS = np.linspace(0, 1, 2001)[:, None]
coordinate = st.floats(-5, 5).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate).map(np.array)


def rows(*points):
    return tuple(np.array([p], dtype=float) for p in points)


@given(point, point)
def test_closest_to_origin_agrees_with_sampling(start, move):
    (found,) = np.sqrt(closest_to_origin(*rows(start, move)))
    sampled = np.linalg.norm(start + FRACTIONS * move, axis=1).min()
    step = np.linalg.norm(move) / 2000
    assert found <= sampled + 1e-12  # rounding of coordinates up to 10
    assert sampled <= found + step + 1e-12  # the nearest sample is at most half a step along the path away


@given(point, point, point)
def test_offset_from_segment_agrees_with_sampling(position, tail, head):
    (offset,) = offset_from_segment(*rows(position, tail, head - tail))
    sampled = np.linalg.norm(position - tail - FRACTIONS * (head - tail), axis=1).min()
    found = np.linalg.norm(offset)
    assert found <= sampled + 1e-12  # rounding of coordinates up to 10
    assert sampled <= found + np.linalg.norm(head - tail) / 2000 + 1e-12  # at most half a step away, and rounding


@given(point, point, point, point)
def test_closest_to_segment_agrees_with_sampling(start, end, tail, head):
    nearest2, _ = closest_to_segment(*rows(start, end, tail, head - tail))
    path = start + FRACTIONS * (end - start)
    count = len(path)
    offsets = offset_from_segment(path, np.tile(tail, (count, 1)), np.tile(head - tail, (count, 1)))
    sampled = np.linalg.norm(offsets, axis=1).min()
    found = np.sqrt(nearest2[0])
    assert found <= sampled + 1e-7  # the root of rounding, if a path just reaches the segment
    assert sampled <= found + np.linalg.norm(end - start) / 2000 + 1e-7  # at most half a step away; as above


@given(point, point, point, point)
def test_closest_to_segment_is_symmetric(start, end, tail, head):
    one = closest_to_segment(*rows(start, end, tail, head - tail))
    other = closest_to_segment(*rows(end, start, head, tail - head))
    swapped = closest_to_segment(*rows(tail, head, start, end - start))
    assert one[0] == pytest.approx(other[0], abs=1e-13)  # squares up to 200, rounded at 1e-16
    assert one[0] == pytest.approx(swapped[0], abs=1e-13)  # as above


def test_closest_to_origin_is_accurate_for_a_long_grazing_path():
    # A path 2e6 long that passes at 0.3: a discriminant b² − 4ac would lose twelve digits of it.
    start, move = rows((-1e6, 0.3), (2e6, 0.0))
    assert np.sqrt(closest_to_origin(start, move))[0] == pytest.approx(0.3, rel=1e-14)  # a few roundings


def test_path_crosses_only_within_the_segment():
    tail, along = rows((0.0, -1.0), (0.0, 2.0))
    assert crosses(*rows((-1.0, 0.0), (1.0, 0.5)), tail, along)[0]
    assert not crosses(*rows((-1.0, 1.5), (1.0, 1.5)), tail, along)[0]
    assert not crosses(*rows((-1.0, 0.0), (-0.5, 0.0)), tail, along)[0]
    assert not crosses(*rows((-1.0, 0.0), (0.0, 0.0)), tail, along)[0]  # it ends on the line


def test_path_through_a_joint_crosses_at_least_one_segment():
    start, end = rows((-1.0, 0.0), (1.0, 0.0))
    lower = crosses(start, end, *rows((0.0, -1.0), (0.0, 1.0)))[0]
    upper = crosses(start, end, *rows((0.0, 0.0), (0.0, 1.0)))[0]
    assert lower or upper


def test_segment_of_zero_length_is_a_point():
    tail, along = rows((0.0, 0.0), (0.0, 0.0))
    nearest2, crossed = closest_to_segment(*rows((-1.0, 0.3), (1.0, 0.3)), tail, along)
    assert nearest2[0] == pytest.approx(0.09, rel=1e-15)  # one rounding
    assert not crossed[0]


def test_approaching_excludes_sliding_and_leaving():
    offset = np.array([[0.0, 1.0]] * 3)
    move = np.array([[1.0, -1e-6], [1.0, 0.0], [1.0, 1e-6]])
    assert approaching(offset, move).tolist() == [True, False, False]


@given(st.floats(0, DEEP), st.floats(CLEAR, 3))
def test_jump_is_the_shortest_path_from_clear_past_a_deep_approach(closest, start):
    # Straight past a centre at `closest`, from a distance of `start`: Pythagoras.
    assert np.sqrt(start**2 - closest**2) >= JUMP * (1 - 1e-9)  # cancellation: 1e-16 / JUMP²
