"""Oriented boxes: they contain their pieces, are exact for rectangles and separate no near pair."""

import math

import numpy as np
import pytest
import shapely

from sandbox.engines.reference.polygon_contacts import are_separated, oriented_box
from tests.engines.reference.outlines import (
    box,
    capsule,
    disc,
    moved,
    pack_outlines,
    random_outline,
    ring,
    separation_of,
    size_of,
)


def box_of(outline):
    return oriented_box(*pack_outlines(outline), 0)


def rectangle(oriented):
    """Return an oriented box as a shapely polygon."""
    x, y, ax, ay, along, across = oriented
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return shapely.Polygon(
        [(x + s * along * ax - t * across * ay, y + s * along * ay + t * across * ax) for s, t in signs]
    )


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_oriented_box_of_a_rectangle_is_the_rectangle(angle):
    x, y, ax, ay, along, across = box_of(box(3.0, -2.0, 4.0, 1.0, angle))
    assert (x, y) == pytest.approx((3.0, -2.0), abs=1e-15)  # an ulp or two
    assert abs(ax * math.cos(angle) + ay * math.sin(angle)) == pytest.approx(1.0, abs=1e-15)  # likewise
    assert (along, across) == pytest.approx((2.0, 0.5), abs=1e-15)  # likewise


def test_oriented_boxes_of_discs_and_capsules_are_tight():
    assert box_of(disc(1.0, 2.0, 0.5)) == (1.0, 2.0, 1.0, 0.0, 0.5, 0.5)
    assert box_of(capsule(0.0, 0.0, 0.0, 2.0, 0.25)) == (0.0, 1.0, 0.0, 1.0, 1.25, 0.25)


def test_oriented_box_contains_its_piece_and_touches_it_on_all_sides():
    random = np.random.default_rng(1)
    for _ in range(300):
        outline = random_outline(random)
        x, y, ax, ay, along, across = box_of(outline)
        local = (outline[0] - (x, y)) @ np.array([(ax, -ay), (ay, ax)])
        size = size_of(outline)
        assert local.max(axis=0) + outline[1] == pytest.approx((along, across), abs=1e-14 * size)  # rounding
        assert local.min(axis=0) - outline[1] == pytest.approx((-along, -across), abs=1e-14 * size)  # likewise


def test_boxes_are_separated_exactly_if_an_axis_separates_them():
    random = np.random.default_rng(2)
    counts = [0, 0]
    for _ in range(1500):
        a, b = box_of(random_outline(random)), box_of(moved(random_outline(random), *random.normal(0, 1.5, 2)))
        distance = rectangle(a).distance(rectangle(b))
        apart = are_separated(a, b, 0.0)
        assert apart == are_separated(b, a, 0.0)
        assert apart == are_separated(np.array(a), np.array(b), 0.0)  # rows of an array are accepted
        counts[apart] += 1
        if abs(distance) > 1e-12 or rectangle(a).intersection(rectangle(b)).area > 1e-12:  # not just touching
            assert apart == (distance > 0.0)
    assert min(counts) > 300


@pytest.mark.fail_slow(60)  # takes over half a second
def test_pieces_nearer_than_the_margin_are_not_separated():
    random = np.random.default_rng(3)
    near = rejected = 0
    for _ in range(1500):
        p, q = random_outline(random), moved(random_outline(random), *random.normal(0, 2, 2))
        margin = random.choice([0.0, 0.1, 1.0])
        separation, apart = separation_of(p, q), are_separated(box_of(p), box_of(q), margin)
        if separation <= margin:
            near += 1
            assert not apart
        rejected += apart
    assert near > 400
    assert rejected > 0.7 * (1500 - near)


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.1])
def test_touching_boxes_are_not_separated_far_from_the_origin(offset, angle):
    reach = 1.5 * math.cos(angle), 1.5 * math.sin(angle)
    p = box(offset, -offset, 1.0, 1.0, angle)
    q = box(offset + reach[0], -offset + reach[1], 2.0, 1.0, angle)
    assert not are_separated(box_of(p), box_of(q), 0.0)
    assert are_separated(box_of(p), box_of(moved(q, *(0.1 * each for each in reach))), 0.0)


def test_oriented_box_of_a_regular_polygon_is_a_square():
    *_, along, across = box_of(ring(1000))
    assert along == pytest.approx(1.0, abs=1e-5)  # (π / 1000)² / 2
    assert across == pytest.approx(1.0, abs=1e-5)  # likewise
